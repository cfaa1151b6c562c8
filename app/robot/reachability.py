# pyright: reportAttributeAccessIssue=false
"""Which grasps the arm can reach without touching anything: IK and MuJoCo's collision check."""

import mujoco
import numpy as np

from app.core.types import Array
from app.robot.inverse import PoseSolver
from app.robot.scene import Scene
from app.robot.simulation import Simulation

STAND_OFFS = (0.10, 0.05, 0.0)  # [m] before the grasp, in the order of the approach
SHOULDER = np.array([0.0, 0.0, 0.28481])  # [m], where joints 1 and 2 meet
WRIST_TO_TOOL = 0.30246  # [m] from joint 6 to the tool centre, along the approach
WRIST_RANGE = (0.22, 0.745)  # [m] of joint 6 from the shoulder: bent and straight, 1 cm generous


class ReachabilityCheck:
    """Checks hand poses in a scene; owns a simulation and a solver for it."""

    def __init__(self, scene: Scene) -> None:
        self._scene = scene
        self._sim = Simulation(scene)
        self._solver = PoseSolver()
        model = self._sim.model
        bodies = [model.body(f"object/{name}").id for name in scene.object_names]
        fixed = np.zeros(model.nbody, dtype=bool)
        fixed[[0, *bodies]] = True
        self._is_arm = ~fixed[model.geom_bodyid]
        self._start = scene.start_joint_positions

    def place(self, item: int, place: int) -> None:
        """Put one object at a place, the others in their order at the places that are left."""
        rest = [i for i in range(len(self._scene.places)) if i != place]
        others = iter(rest)
        layout = tuple(
            place if i == item else next(others) for i in range(len(self._scene.objects))
        )
        self._sim.reset(layout)

    def reaches(self, grasp: Array) -> bool:
        """Whether the arm can stand 10 cm and 5 cm before a grasp and at it, touching nothing.

        Args:
            grasp: T_world_ee, shape (4, 4).
        """
        return self.path(grasp) is not None

    def path(self, grasp: Array) -> list[Array] | None:
        """Joint positions [rad] 10 cm and 5 cm before a grasp and at it, or None.

        Args:
            grasp: T_world_ee, shape (4, 4).
        """
        rotation, position = grasp[:3, :3], grasp[:3, 3]
        points = [position - distance * rotation[:, 2] for distance in STAND_OFFS]
        if not all(self._wrist_in_range(point, rotation) for point in points):
            return None
        for seed in self._seeds(position):
            path = self._follow(points, rotation, seed)
            if path is not None:
                return path
        return None

    def _follow(self, points: list[Array], rotation: Array, seed: Array) -> list[Array] | None:
        path: list[Array] = []
        q: Array | None = seed
        for point in points:
            q = self._solver.solve(point, rotation, q)
            if q is None or self.touches(q):
                return None
            path.append(q)
        return path

    def _wrist_in_range(self, position: Array, rotation: Array) -> bool:
        """A cheap necessary condition, before any iteration: most candidates fail here."""
        wrist = position - WRIST_TO_TOOL * rotation[:, 2]
        return WRIST_RANGE[0] <= float(np.linalg.norm(wrist - SHOULDER)) <= WRIST_RANGE[1]

    def touches(self, q: Array) -> bool:
        """Whether the open-handed arm at q [rad] overlaps the table or an object."""
        sim = self._sim
        sim.put_arm(q)
        mujoco.mj_collision(sim.model, sim.data)
        contact = sim.data.contact
        if len(contact.dist) == 0:
            return False
        arm = self._is_arm[contact.geom].sum(axis=1) == 1
        return bool((arm & (contact.dist < 0.0)).any())

    def _seeds(self, position: Array) -> list[Array]:
        """Start pose turned towards the point; the same with the elbow swung to either side."""
        bearing = np.arctan2(position[1], position[0])
        seeds = []
        for swing in (0.0, 0.6, -0.6):
            seed = self._start.copy()
            seed[0] += bearing - swing
            seed[2] += swing
            seeds.append(seed)
        return seeds
