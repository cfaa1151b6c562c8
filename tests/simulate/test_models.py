"""What each simulated user does, seen from outside."""

import numpy as np
import pytest

from app.core import Goals, Pose, compute_input, make_goals
from app.core.types import Array
from app.simulate.models import MODELS, Action, Sight, User
from app.simulate.models.base import DECISION_S, REST

LEVEL = np.array([0.5**0.5, 0.0, 0.5**0.5, 0.0])  # the hand's z axis along world x
TARGET = np.array([0.5, 0.1, 0.1])
OTHER = np.array([0.5, -0.3, 0.1])
GOALS: Goals = make_goals({"cup": ([TARGET], [LEVEL]), "jug": ([OTHER], [LEVEL])})


def make_user(model: str, goal: str = "cup", seed: int = 1, **parameters: float) -> User:
    """A user with default parameters but for those named."""
    kind = MODELS[model]
    values = {name: p.default for name, p in kind.PARAMETERS.items()} | parameters
    return kind(goal, values, np.random.default_rng(seed))


def watch(user: User, positions: list[Array], quaternion: Array = LEVEL) -> list[Action]:
    """What the user does while the hand goes through these positions."""
    return [
        user.act(Sight(i * DECISION_S, Pose(np.asarray(p, dtype=float), quaternion), GOALS))
        for i, p in enumerate(positions)
    ]


def pushed(action: Action) -> Array:
    """The input after the dead zone, world axes."""
    return compute_input(action.input)[:3]


@pytest.mark.parametrize("model", ["continue", "lazy", "fight", "unmodelled"])
def test_a_still_hand_is_pushed_toward_the_goal(model: str):
    """By everyone who wants to get there, with the vigour they have."""
    start = np.array([0.3, 0.1, 0.1])
    (action,) = watch(make_user(model, delay_s=0.0, noise=0.0), [start])
    assert pushed(action) == pytest.approx([0.28, 0.0, 0.0], abs=1e-9)
    assert not action.close


def test_nothing_happens_before_the_reaction_time():
    """A user with a delay of 0.2 s does nothing in the first 0.2 s."""
    actions = watch(make_user("continue", delay_s=0.2), [np.array([0.3, 0.1, 0.1])] * 10)
    assert [a.input is REST for a in actions] == [True] * 5 + [False] * 5


def test_the_hand_is_seen_late():
    """A jump of the hand changes the push only `delay_s` later."""
    left, right = np.array([0.3, 0.1, 0.1]), np.array([0.7, 0.1, 0.1])
    actions = watch(make_user("continue", delay_s=0.2, noise=0.0), [left] * 10 + [right] * 10)
    forward = [pushed(a)[0] > 0.0 for a in actions]
    assert forward == [False] * 5 + [True] * 10 + [False] * 5


def test_the_hand_is_closed_at_a_grasp_and_only_there():
    """Within the tolerance of position and angle."""
    there = TARGET + [0.004, 0.0, 0.0]
    assert watch(make_user("continue", delay_s=0.0), [there])[0].close
    assert not watch(make_user("continue", delay_s=0.0), [TARGET + [0.02, 0.0, 0.0]])[0].close
    turned = np.array([1.0, 0.0, 0.0, 0.0])
    assert not watch(make_user("continue", delay_s=0.0), [there], turned)[0].close
    assert not watch(make_user("continue", delay_s=0.0, goal="jug"), [there])[0].close


def test_a_hand_that_is_turned_wrong_is_turned_after_a_while():
    """By the sticks in their other mode, toward the grasp's orientation."""
    turned = np.array([np.cos(0.5), 0.0, np.sin(0.5), 0.0])  # a pitch of 1 rad, not π/2
    user = make_user("continue", delay_s=0.0, noise=0.0, patience_s=0.4)
    actions = watch(user, [TARGET + [0.003, 0.0, 0.0]] * 20, turned)
    modes = [a.input.mode for a in actions]
    assert modes[:10] == ["translate"] * 10
    assert modes[10:] == ["rotate"] * 10
    rates = compute_input(actions[-1].input)[3:]
    assert rates[1] > 0.0
    assert rates[[0, 2]] == pytest.approx([0.0, 0.0], abs=1e-9)


def test_noise_is_of_the_size_and_duration_asked_for():
    """SD as a share of the input, correlation exp(−t/T)."""
    user = make_user("continue", noise=0.4, noise_time_s=0.2, delay_s=0.0, axis_preference=0.0)
    inputs = np.array([pushed(a) for a in watch(user, [np.array([0.2, 0.1, 0.1])] * 20000)])
    noise = inputs[:, 1] / 0.28
    assert noise.std() == pytest.approx(0.4, rel=0.05)
    correlation = np.corrcoef(noise[:-5], noise[5:])[0, 1]
    assert correlation == pytest.approx(np.exp(-1.0), abs=0.05)


def test_noise_does_not_depend_on_what_is_done():
    """Two hands that go different ways under different methods meet the same noise."""
    near, far = [np.array([0.2, 0.1, 0.1])] * 50, [np.array([0.3, 0.1, 0.1])] * 30
    one = watch(make_user("continue", noise=0.5), near)
    two = watch(make_user("continue", noise=0.5), far + near[30:])
    first, second = (np.array([pushed(a) for a in actions[40:]]) for actions in (one, two))
    assert first == pytest.approx(second, abs=1e-12)
    assert first.std() > 0.01


def test_axis_preference_moves_one_axis_at_a_time():
    """At 1 only the axis that is farthest off; at 0 straight."""
    start = [TARGET - [0.2, 0.1, 0.05]]
    shy = make_user("continue", axis_preference=1.0, noise=0.0, delay_s=0.0, standoff_m=0.0)
    straight = make_user("continue", axis_preference=0.0, noise=0.0, delay_s=0.0, standoff_m=0.0)
    assert pushed(watch(shy, start)[0]) == pytest.approx([0.28, 0.0, 0.0])
    direction = np.array([0.2, 0.1, 0.05])
    expected = 0.28 * direction / np.linalg.norm(direction)
    assert pushed(watch(straight, start)[0]) == pytest.approx(expected)


def moving(velocity: list[float], n: int = 12) -> list[Array]:
    """A hand that moves by itself, ending 0.2 m before the target."""
    step = np.array(velocity) * DECISION_S
    return [TARGET - [0.2, 0.0, 0.0] + (i - n + 1) * step for i in range(n)]


def test_the_lazy_let_the_robot_work_only_while_it_does():
    """No input while the hand goes their way, and the usual one when it goes elsewhere."""
    assert watch(make_user("lazy"), moving([0.06, 0.0, 0.0]))[-1].input is REST
    assert watch(make_user("continue"), moving([0.06, 0.0, 0.0]))[-1].input is not REST
    wrong = watch(make_user("lazy", noise=0.0), moving([-0.06, 0.0, 0.0]))[-1]
    assert pushed(wrong)[0] > 0.2
    slow = watch(make_user("lazy", noise=0.0), moving([0.002, 0.0, 0.0]))[-1]
    assert pushed(slow)[0] > 0.2


def test_fighters_push_against_motion_aside():
    """The others do not."""
    aside = moving([0.0, 0.06, 0.0])

    def sideways(model: str) -> float:
        user = make_user(model, noise=0.0, standoff_m=0.0, axis_preference=1.0)
        return float(pushed(watch(user, aside)[-1])[1])

    assert sideways("fight") < -0.2
    assert sideways("continue") == pytest.approx(0.0)


def test_a_changed_mind_goes_elsewhere_first():
    """Toward the other object, and to the instructed one from half of the way."""
    user = make_user("changes-mind", noise=0.0, delay_s=0.0, standoff_m=0.0, change_at=0.5)
    start = np.array([0.5, -0.1, 0.1])
    way = [start, start - [0, 0.05, 0], start - [0, 0.11, 0], start - [0, 0.11, 0]]
    actions = watch(user, way)
    assert pushed(actions[0])[1] < 0.0 and pushed(actions[1])[1] < 0.0
    assert actions[2].input is REST
    assert pushed(actions[3])[1] > 0.0
    assert user.goal == "cup"


def test_a_changed_mind_does_not_close_on_the_first_object():
    """Even where the hand is at a grasp of it."""
    actions = watch(make_user("changes-mind", delay_s=0.0, change_at=1.0), [OTHER] * 3)
    assert not any(a.close for a in actions)


def test_the_idle_push_for_a_moment_and_then_only_watch():
    """They close when the hand arrives without them."""
    user = make_user("idle", delay_s=0.0, push_s=0.4)
    actions = watch(user, [np.array([0.3, 0.1, 0.1])] * 20 + [TARGET])
    assert [a.input is not REST for a in actions] == [True] * 10 + [False] * 11
    assert [a.close for a in actions] == [False] * 20 + [True]


def test_the_sampler_follows_the_maxent_policy():
    """Frequencies of inputs are ∝ exp(−β [V(x ⊕ τD(u)) − V(x)]); far off, V falls by 2.45 nat/m."""
    beta, start = 100.0, np.array([0.1, 0.1, 0.1])
    user = make_user("maxent", delay_s=0.0, hold_s=0.04, rationality=beta, vigour=0.5)
    inputs = np.array([pushed(a) for a in watch(user, [start] * 20000)])
    ahead = np.all(np.isclose(inputs, [0.5, 0.0, 0.0]), axis=1).sum()
    rest = np.all(inputs == 0.0, axis=1).sum()
    gain = (2.25 + 0.2) * 0.1 * 0.2 * 0.5  # [nat] of progress in τ = 0.1 s at half stick
    assert np.log(ahead / rest) == pytest.approx(beta * gain, abs=0.15)
