"""Imported by the forkserver, so that a worker is ready in a fraction of a second.

Nothing here starts a thread or opens a file that a fork must not share. What is slow the first
time is done once for all workers: numba's kernels are compiled (or read from their cache), the
default scene's grasps found (or read from theirs), and one tick made.
"""

import app.session.worker  # noqa: F401
from app.core import UserInput, preset, warm_up
from app.robot.scene_file import load_scene
from app.session.physics_world import PhysicsWorld
from app.session.trial import Trial

warm_up()
_scene = load_scene("default")
_trial = Trial(PhysicsWorld(_scene), preset("default"), _scene.object_names[0], start_delay_s=0.0)
_trial.step(UserInput(axes=(0.0, 0.0, 0.0, 1.0)))
del _scene, _trial
