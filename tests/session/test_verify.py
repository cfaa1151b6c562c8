"""Re-simulation from the logged controls repeats every state exactly, or says why it cannot."""

import msgspec
import pytest

from app.core import UserInput, preset
from app.recording.schema import StepRecord, TrialHeader
from app.robot.scene import Scene
from app.session.commands import Command
from app.session.kinematic_world import KinematicWorld
from app.session.physics_world import PhysicsWorld
from app.session.trial import Trial
from app.session.verify import VerifyError, resimulate
from tests.session.person import Person, finish

Log = tuple[TrialHeader, list[StepRecord]]


@pytest.fixture(scope="module")
def log(scene: Scene) -> Log:
    """A whole trial, as it comes back from JSON."""
    trial = Trial(PhysicsWorld(scene, 4), preset("default", method="policy"), "canteen", seed=4)
    header = trial.header()
    steps = finish(trial, Person("canteen"))
    steps += [trial.step(UserInput(), [Command("open")] if i == 0 else ()) for i in range(50)]
    assert trial.outcome == "grasped"
    coded = msgspec.json.encode((header, steps))
    return msgspec.json.decode(coded, type=tuple[TrialHeader, list[StepRecord]])


def test_a_trial_repeats_bit_for_bit(log: Log):
    """From the first state on, through the grasp, the lift and letting go."""
    header, steps = log
    assert steps[-1].object_poses != steps[0].object_poses
    assert resimulate(header, steps) is None


def test_the_smallest_change_is_found(log: Log):
    """One last bit of one joint in one step, or of one control."""
    header, steps = log
    joints = list(steps[200].joint_positions_rad)
    joints[3] += 2e-16 * max(1.0, abs(joints[3]))
    assert joints != steps[200].joint_positions_rad
    changed = [*steps]
    changed[200] = msgspec.structs.replace(steps[200], joint_positions_rad=joints)
    difference = resimulate(header, changed)
    assert difference is not None
    assert (difference.step, difference.field) == (200, "joint_positions_rad")
    assert "step 200" in str(difference)
    ctrl = list(steps[100].ctrl)
    ctrl[0] += 1e-9
    changed = [*steps]
    changed[100] = msgspec.structs.replace(steps[100], ctrl=ctrl)
    difference = resimulate(header, changed)
    assert difference is not None and difference.step == 100


def test_another_version_model_or_world_is_refused(scene: Scene, log: Log):
    """The reason names what differs."""
    header, steps = log
    versions = msgspec.json.decode(header.versions_json)
    other = msgspec.json.encode({**versions, "mujoco": "2.0"}).decode()
    with pytest.raises(VerifyError, match=r"mujoco 2\.0"):
        resimulate(msgspec.structs.replace(header, versions_json=other), steps)
    with pytest.raises(VerifyError, match="model"):
        resimulate(msgspec.structs.replace(header, model_hash="0" * 64), steps)
    with pytest.raises(VerifyError, match="step 5 is missing"):
        resimulate(header, steps[:5] + steps[6:])
    kinematic = Trial(KinematicWorld(scene), preset("default"), "glass")
    with pytest.raises(VerifyError, match="without physics"):
        resimulate(kinematic.header(), [])
