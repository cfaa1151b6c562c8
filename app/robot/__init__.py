"""The robot room: scenes, physics, kinematics, grasp targets, outcomes."""

from app.robot.errors import GraspError, RobotError, SceneError
from app.robot.hand import HandCommand, HandController
from app.robot.kinematics import Kinematics
from app.robot.layouts import random_layout
from app.robot.objects import HUES, footprint_radius, object_height
from app.robot.outcomes import OutcomeMonitor
from app.robot.scene import Layout, Scene
from app.robot.scene_file import list_scenes, load_scene
from app.robot.servo import Servo
from app.robot.simulation import CONTROL_DT, Simulation
from app.robot.targets import GraspTargets, goals_in_world, grasp_targets

__all__ = [
    "CONTROL_DT",
    "HUES",
    "GraspError",
    "GraspTargets",
    "HandCommand",
    "HandController",
    "Kinematics",
    "Layout",
    "OutcomeMonitor",
    "RobotError",
    "Scene",
    "SceneError",
    "Servo",
    "Simulation",
    "footprint_radius",
    "goals_in_world",
    "grasp_targets",
    "list_scenes",
    "load_scene",
    "object_height",
    "random_layout",
]
