"""From twists to joint motion: true to the line, inside every limit, and it never raises."""

import numpy as np
import pinocchio as pin  # pyright: ignore[reportMissingImports]
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from app.core.types import Array
from app.robot import Kinematics, Scene, kinematics, load_scene
from app.robot.arm import JOINT_HIGH, JOINT_LOW, MAX_ACCELERATION, MAX_VELOCITY
from tests.robot.driving import LEVEL
from tests.robot.pink_reference import PinkKinematics

DT = 0.01


class Path:
    """What a constant translation does to the ideal arm that follows q̇ exactly."""

    def __init__(self, scene: Scene, q: Array, legs: list[tuple[list[float], float]]) -> None:
        kin = Kinematics(scene)
        velocity = np.zeros(7)
        start = kin.hand_pose(q).position
        self.q, self.off_line, self.off_axis, self.peak = q.copy(), 0.0, 0.0, 0.0
        self.braking = False
        for push, seconds in legs:
            line = np.array(push) / max(float(np.linalg.norm(push)), 1e-12)
            for _ in range(round(seconds / DT)):
                new = kin.solve(self.q, velocity, np.concatenate([push, np.zeros(3)]), DT)
                self.peak = max(self.peak, float(np.abs((new - velocity) / DT).max()))
                velocity, self.q = new, self.q + DT * new
                pose = kin.hand_pose(self.q)
                way = pose.position - start
                w, x, y, z = pose.quaternion
                turn = pin.log3(pin.Quaternion(w, x, y, z).toRotationMatrix() @ LEVEL.T)
                if np.any(push):
                    off = float(np.linalg.norm(way - (way @ line) * line))
                    self.off_line = max(self.off_line, off)
                self.off_axis = max(self.off_axis, float(np.degrees(np.linalg.norm(turn))))
                self.braking |= kin.status != "solved"
        self.way = kin.hand_pose(self.q).position - start


DIRECTIONS = {
    "away": [0.2, 0.0, 0.0],
    "back": [-0.2, 0.0, 0.0],
    "left": [0.0, 0.2, 0.0],
    "right": [0.0, -0.2, 0.0],
    "up": [0.0, 0.0, 0.2],
    "aslant": [0.12, -0.12, -0.06],
}


@pytest.mark.parametrize("name", DIRECTIONS)
def test_pushing_beyond_reach_stops_on_the_line_and_comes_back(scene: Scene, name: str) -> None:
    """Five seconds outwards: ≤ 4 mm off the line, ≤ 2.5° turned; three back: it moves again.

    Damped least squares with clipping is 215 mm and 39° off; a plain program 55 mm and 2.7°.
    """
    push = DIRECTIONS[name]
    out = Path(scene, scene.start_joint_positions, [(push, 5.0)])
    assert np.linalg.norm(out.way) < 0.85  # it did reach a limit: 5 s would be 1 m
    assert out.off_line < 0.004
    assert out.off_axis < 2.5
    assert not out.braking
    back = Path(scene, out.q, [([-v for v in push], 2.0)])
    assert np.linalg.norm(back.way) > 0.1


def test_a_free_line_is_followed_exactly(scene: Scene) -> None:
    """Away from limits the hand arrives where the twist says, less the ramp of acceleration."""
    path = Path(scene, scene.start_joint_positions, [([0.05, 0.06, -0.06], 2.0)])
    assert path.off_line < 0.0015
    assert path.off_axis < 0.1
    assert np.linalg.norm(path.way) > 0.97 * 2.0 * np.linalg.norm([0.05, 0.06, 0.06])


def test_the_hand_returns_to_where_it_was(scene: Scene) -> None:
    """There and back again, and the posture is the same one: no drift about the free axis."""
    there = [([0.1, 0.0, 0.0], 1.5), ([-0.1, 0.0, 0.0], 1.5), ([0.0, 0.0, 0.0], 2.0)]
    path = Path(scene, scene.start_joint_positions, there)
    assert np.linalg.norm(path.way) < 0.01
    assert np.abs(path.q - scene.start_joint_positions).max() < 0.05


def test_accelerations_stay_bounded_through_singularities(scene: Scene) -> None:
    """Pitch the level hand down through the wrist singularity: no spike beyond the limits.

    Without the bound, joints jump by 60 to 280 rad/s² there.
    """
    kin = Kinematics(scene)
    q, velocity, least = scene.start_joint_positions, np.zeros(7), np.inf
    for i in range(600):
        turn = 0.6 if i < 250 else -0.6
        new = kin.solve(q, velocity, np.array([0.0, 0.02, 0.02, 0.0, turn, 0.1]), DT)
        assert (np.abs(new - velocity) <= MAX_ACCELERATION * DT + 1e-6).all()
        velocity, q = new, q + DT * new
        least = min(least, float(np.linalg.svd(kin.jacobian(q), compute_uv=False)[-1]))
    assert least < 0.05  # it was near a singularity


@settings(max_examples=25, deadline=None)
@given(seed=st.integers(0, 2**31))
def test_limits_hold_under_any_pushing(seed: int) -> None:
    """Position, velocity, acceleration, for random twists from random postures."""
    scene = load_scene("default")
    kin = Kinematics(scene)
    rng = np.random.default_rng(seed)
    q, velocity = rng.uniform(JOINT_LOW, JOINT_HIGH), np.zeros(7)
    twist = np.zeros(6)
    for i in range(120):
        if i % 30 == 0:
            twist = rng.uniform(-1.0, 1.0, 6) * [0.5, 0.5, 0.5, 2.0, 2.0, 2.0]
        new = kin.solve(q, velocity, twist, DT)
        assert (np.abs(new) <= MAX_VELOCITY + 1e-9).all()
        assert (np.abs(new - velocity) <= MAX_ACCELERATION * DT + 1e-6).all()
        velocity, q = new, q + DT * new
        assert (q <= JOINT_HIGH + 1e-6).all() and (q >= JOINT_LOW - 1e-6).all()


@pytest.mark.parametrize("kind", ["free", "limits", "braking", "rest"])
def test_pink_finds_the_same_velocities(scene: Scene, kind: str) -> None:
    """The program is Pink's, stated at less cost: equal to 1e-6 rad/s in whatever posture."""
    kin, pink = Kinematics(scene), PinkKinematics(scene)
    rng = np.random.default_rng(3)
    reach = {"free": 0.3, "limits": 1.0, "braking": 1.0, "rest": 1.0}[kind]
    for _ in range(250):
        share = rng.uniform(0.5 - 0.5 * reach, 0.5 + 0.5 * reach, 7)
        q = JOINT_LOW + share * (JOINT_HIGH - JOINT_LOW)
        velocity = rng.uniform(-1.0, 1.0, 7) * MAX_VELOCITY * (kind != "rest")
        if kind == "limits":
            edge = rng.random(7) < 0.4
            q = np.where(edge, np.where(share > 0.5, JOINT_HIGH, JOINT_LOW), q)
        twist = rng.uniform(-1.0, 1.0, 6) * [0.3, 0.3, 0.3, 1.0, 1.0, 1.0]
        if kind == "braking":
            twist[:] = 0.0
        found = kin.solve(q, velocity, twist, DT)
        assert kin.status == "solved"
        assert np.abs(found - pink.solve(q, velocity, twist, DT)).max() < 1e-6


def test_without_a_compiler_the_velocities_are_the_same(
    scene: Scene, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The kernels run as plain Python where numba does not work."""
    rng = np.random.default_rng(4)
    cases = [
        (rng.uniform(JOINT_LOW, JOINT_HIGH), rng.uniform(-1.0, 1.0, 7), rng.normal(0.0, 0.3, 6))
        for _ in range(20)
    ]
    compiled = [Kinematics(scene).solve(*case, DT) for case in cases]
    for name in ("bound", "objective", "settle"):
        kernel = getattr(kinematics, name)
        monkeypatch.setattr(kinematics, name, getattr(kernel, "py_func", kernel))
    plain = [Kinematics(scene).solve(*case, DT) for case in cases]
    assert np.abs(np.array(plain) - np.array(compiled)).max() < 1e-9


def test_earlier_solutions_leave_no_trace(scene: Scene) -> None:
    """Equal inputs give equal bits, so that equal trials are equal."""
    kin = Kinematics(scene)
    q, velocity, twist = scene.start_joint_positions, np.zeros(7), np.array([0.3] * 3 + [1.0] * 3)
    first = kin.solve(q, velocity, twist, DT)
    kept = first.copy()
    kin.solve(0.5 * q, np.full(7, 0.5), -twist, DT)
    assert (first == kept).all()
    assert (kin.solve(q, velocity, twist, DT) == first).all()


@settings(max_examples=150, deadline=None)
@given(
    q=arrays(np.float64, 7, elements=st.floats(width=64)),
    velocity=arrays(np.float64, 7, elements=st.floats(width=64)),
    twist=arrays(np.float64, 6, elements=st.floats(width=64)),
    dt=st.one_of(st.just(0.01), st.floats()),
)
def test_whatever_comes_in_finite_velocities_within_limits_go_out(
    q: Array, velocity: Array, twist: Array, dt: float
) -> None:
    """NaN, infinities, enormous numbers, negative time: the loop never stops for them."""
    result = Kinematics(load_scene("default")).solve(q, velocity, twist, dt)
    assert result.shape == (7,) and np.isfinite(result).all()
    assert (np.abs(result) <= MAX_VELOCITY + 1e-9).all()


def test_without_a_solution_the_arm_slows_down_and_says_so(scene: Scene) -> None:
    """A broken twist brakes at the limit of acceleration to rest; the next good one moves again."""
    kin = Kinematics(scene)
    q = scene.start_joint_positions
    velocity = np.full(7, 0.3)
    for _ in range(20):
        new = kin.solve(q, velocity, np.full(6, np.nan), DT)
        assert kin.status == "braking"
        assert (np.abs(new) <= np.abs(velocity)).all()
        assert (np.abs(new - velocity) <= MAX_ACCELERATION * DT + 1e-12).all()
        velocity = new
    assert not velocity.any()
    assert kin.solve(q, velocity, np.array([0.1, 0, 0, 0, 0, 0]), DT).any()
    assert kin.status == "solved"
