"""The position servos: tracking, and what happens when the arm is blocked."""

import mujoco
import numpy as np
import pytest

from app.core.types import Array
from app.robot import CONTROL_DT, Scene, Simulation
from app.robot.servo import LEASH, Servo
from tests.robot.driving import Rig


def _tracking_error(scene: Scene, feed_forward: bool) -> float:
    """RMS distance [m] of the hand from where the reference has it, over a smooth movement."""
    sim = Simulation(scene)
    rig = Rig(scene, sim, "block")
    errors = []
    for i in range(400):
        time = i * CONTROL_DT
        ramp = min(time / 0.5, 1.0)
        push = ramp * np.array([0.10 * np.sin(1.5 * time), 0.15 * np.cos(1.2 * time), 0.03])
        twist = np.concatenate([push, np.zeros(3)])
        velocity = rig.kin.solve(rig.servo.reference, rig.servo.velocity, twist, CONTROL_DT)
        ctrl = rig.servo.advance(sim.joint_positions, velocity, CONTROL_DT)
        sim.step(np.append(ctrl if feed_forward else rig.servo.reference, 0.0))
        wanted = rig.kin.hand_pose(rig.servo.reference).position
        errors.append(sim.hand_pose().position - wanted)
    return float(np.sqrt((np.square(errors).sum(axis=1)).mean()))


def test_feed_forward_makes_the_hand_follow(scene: Scene) -> None:
    """Below 1 mm rms, at least five times better than the plain position servo."""
    good = _tracking_error(scene, feed_forward=True)
    assert good < 0.001
    assert _tracking_error(scene, feed_forward=False) > 5.0 * good


def _push_into_table(scene: Scene) -> tuple[float, float]:
    """Push down for 1.5 s beyond contact; force on the table [N], seconds until it lifts."""
    sim = Simulation(scene)
    rig = Rig(scene, sim, "block")
    down, up = np.array([0, 0, -0.15, 0, 0, 0.0]), np.array([0, 0, 0.15, 0, 0, 0.0])
    for _ in range(600):
        rig.tick(down)
        if sim.hand_pose().position[2] < 0.0 or _table_force(sim) > 1.0:
            break
    else:
        pytest.fail("the hand did not reach the table")
    force = 0.0
    for _ in range(150):
        rig.tick(down)
        force = max(force, _table_force(sim))
    low = sim.hand_pose().position[2]
    for i in range(200):
        rig.tick(up)
        if sim.hand_pose().position[2] > low + 0.002:
            return force, (i + 1) * CONTROL_DT
    return force, np.inf


def _table_force(sim: Simulation) -> float:
    """Sum of the arm's contact forces on the table [N]."""
    wrench, total = np.empty(6), 0.0
    table = sim.model.geom("table").id
    for number, pair in enumerate(sim.data.contact.geom.tolist()):
        other = pair[0] if pair[1] == table else pair[1]
        if table in pair and sim.geom_object[other] < 0:
            mujoco.mj_contactForce(  # pyright: ignore[reportAttributeAccessIssue]
                sim.model, sim.data, number, wrench
            )
            total += wrench[0]
    return total


def test_an_arm_pushed_into_the_table_answers_a_reversal_at_once(scene: Scene) -> None:
    """The hand rises within 0.2 s of pulling up, and the force stays what 0.02 rad give."""
    force, seconds = _push_into_table(scene)
    assert 1.0 < force < 450.0
    assert seconds <= 0.2


def test_the_leash_is_what_does_it(scene: Scene, monkeypatch: pytest.MonkeyPatch) -> None:
    """The same with a leash of 10 rad: motors at their limit, twice as long to come free."""
    force, seconds = _push_into_table(scene)
    monkeypatch.setattr("app.robot.servo.LEASH", 10.0)
    force_without, seconds_without = _push_into_table(scene)
    assert force_without > 1.2 * force
    assert seconds_without > 1.8 * seconds


def test_the_reference_stays_on_the_leash() -> None:
    """However long one pushes against a blocked arm, and never beyond a joint's limit."""
    blocked = np.radians([0.0, 49.2, 0.0, 146.0, 0.0, -99.4, 0.0])
    servo = Servo(blocked)
    ctrl: Array = blocked
    for _ in range(500):
        ctrl = servo.advance(blocked, np.full(7, 0.5), CONTROL_DT)
        assert (np.abs(servo.reference - blocked) <= LEASH + 0.5 * CONTROL_DT + 1e-12).all()
    assert servo.reference[3] <= np.radians(147.2) + 1e-12
    assert np.isfinite(ctrl).all()
    servo.reset(np.zeros(7))
    assert not servo.reference.any() and not servo.velocity.any()
