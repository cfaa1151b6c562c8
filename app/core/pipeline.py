"""One tick of the assistance: belief, V, Q, method, limits. Pure: state in, state out."""

import math
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import numpy.typing as npt

from app.core.backend import active
from app.core.belief import PREDICTORS, Evidence, bounded, initial_elapsed
from app.core.checks import as_array, as_quaternions
from app.core.errors import CoreError
from app.core.evaluation import BELIEF, GRADIENT, LOG_BELIEF, N_ROWS, Q_VALUE, VALUE
from app.core.goals import goal_index
from app.core.limits import fixed_magnitude, limited
from app.core.methods import METHODS
from app.core.settings import AssistanceSettings
from app.core.situation import Situation
from app.core.types import Array, Goals, Pose


@dataclass(frozen=True, slots=True)
class AssistanceState:
    """What one tick hands to the next.

    Attributes:
        belief: b(g), sums to 1, shape (n_goals,).
        log_belief: log b(g), shape (n_goals,).
        log_prior: log p(g) before any input, shape (n_goals,).
        twist: The twist executed last [m/s, rad/s], shape (6,).
        elapsed: Time since the predictor with a period last counted an input [s].
    """

    belief: Array
    log_belief: Array
    log_prior: Array
    twist: Array
    elapsed: float


@dataclass(frozen=True, slots=True)
class AssistanceStep:
    """What one tick found.

    Attributes:
        direct: D(u) [m/s, rad/s], shape (6,).
        assistance: What the method adds, the twist it asks for minus D(u), shape (6,).
        twist: The executed twist: after speed and slew limits, shape (6,).
        belief: b(g) after this input, shape (n_goals,).
        values: V_g(x) [nat], shape (n_goals,).
        q_values: Q_g(x, u) [nat], shape (n_goals,).
        best_targets: Per goal the row of the target that is best after the action, int64.
        situation: What the method was given; not to be changed.
    """

    direct: Array
    assistance: Array
    twist: Array
    belief: Array
    values: Array
    q_values: Array
    best_targets: npt.NDArray[np.int64]
    situation: Situation = field(repr=False, compare=False)


def initial_state(
    goals: Goals, settings: AssistanceSettings, belief: Any = None
) -> AssistanceState:
    """Return the state before any input: the prior, the hand at rest.

    Args:
        goals: Goals with targets.
        settings: Prior and bounds of the belief.
        belief: Start from this belief instead of the prior, e.g. from a log, shape (n_goals,).

    Raises:
        CoreError: If prior or belief do not fit the goals.
    """
    n = goals.n_goals
    prior = np.array(settings.prior) if settings.prior else np.ones(n)
    if prior.shape != (n,):
        raise CoreError(f"prior must have one number per goal, shape ({n},), got {prior.shape}")
    log_prior = _bounded_log(prior, settings)
    log_belief = log_prior
    if belief is not None:
        given = as_array(belief, (n,), "belief")
        if given.min() < 0.0 or given.sum() <= 0.0:
            raise CoreError(f"belief must be probabilities, got {given.tolist()}")
        log_belief = np.log(np.maximum(given / given.sum(), 1e-300))
    return AssistanceState(
        np.exp(log_belief), log_belief, log_prior, np.zeros(6), initial_elapsed(settings)
    )


def assist(
    settings: AssistanceSettings,
    goals: Goals,
    state: AssistanceState,
    pose: Pose,
    direct: Array,
    dt: float,
) -> tuple[AssistanceState, AssistanceStep]:
    """Do one tick: condition the belief on the user's input, ask the method, apply the limits.

    Args:
        settings: Method, options, costs, limits.
        goals: Goals with targets, world frame; they may move from tick to tick.
        state: As the tick before returned it, or `initial_state`.
        pose: The hand's pose.
        direct: D(u) [m/s, rad/s], world frame, shape (6,).
        dt: Time since the tick before [s], above 0.

    Raises:
        CoreError: If an argument is not valid; the message names it.
    """
    if not 0.0 < dt < math.inf:
        raise CoreError(f"dt must be a time above 0 [s], got {dt!r}")
    x = _packed(pose, direct)
    weight, elapsed = PREDICTORS[settings.predictor](settings, dt, state.elapsed)
    drift, decay = 0.0, 1.0
    if settings.idle_drift > 0.0 and not x[7:].any():
        drift = settings.idle_drift * dt
    if settings.evidence_half_life < math.inf:
        decay = 0.5 ** (dt / settings.evidence_half_life)
    situation = _situation(settings, goals, state, x, Evidence(weight, drift, decay))
    rows = situation.rows
    asked = _asked(settings, settings.method if settings.enabled else "direct", situation)
    twist = limited(asked, state.twist, settings, dt)
    belief, user = rows[BELIEF], x[7:]
    following = AssistanceState(belief, rows[LOG_BELIEF], state.log_prior, twist, elapsed)
    values, q_values, best = rows[VALUE], rows[Q_VALUE], situation.best_targets
    return following, AssistanceStep(
        user, asked - user, twist, belief, values, q_values, best, situation
    )


def counterfactuals(
    settings: AssistanceSettings, goals: Goals, state: AssistanceState, pose: Pose, direct: Array
) -> dict[str, Array]:
    """Return what each method would have asked for: method → twist [m/s, rad/s], shape (6,).

    Args:
        settings: Options and costs; `method` and `enabled` are not looked at.
        goals: Goals with targets at that moment.
        state: As `assist` returned it for this input: its belief is used as it is.
        pose: The hand's pose.
        direct: D(u), shape (6,).

    Raises:
        CoreError: If an argument is not valid; the message names it.
    """
    situation = _situation(settings, goals, state, _packed(pose, direct), _NO_EVIDENCE)
    return {method: _asked(settings, method, situation) for method in METHODS}


def known_goal_twist(
    settings: AssistanceSettings,
    goals: Goals,
    state: AssistanceState,
    pose: Pose,
    direct: Array,
    goal: str | int,
) -> Array:
    """Return what the method would have asked for had the true goal been known, shape (6,).

    Args:
        settings: Method, options, costs; `enabled` is not looked at.
        goals: Goals with targets at that moment.
        state: Any state of the trial; its belief is replaced by certainty.
        pose: The hand's pose.
        direct: D(u), shape (6,).
        goal: The true goal, by name or row.

    Raises:
        CoreError: If an argument is not valid; the message names it.
    """
    situation = _situation(settings, goals, state, _packed(pose, direct), _NO_EVIDENCE)
    return _asked_if_known(settings, situation, goal)


def known_goal_twist_of_step(
    settings: AssistanceSettings, step: AssistanceStep, goal: str | int
) -> Array:
    """Return `known_goal_twist` for the input of a step, without evaluating the goals anew.

    Args:
        settings: Those of the step, but for `method` and `enabled`.
        step: As `assist` returned it.
        goal: The true goal, by name or row.

    Raises:
        CoreError: If there is no such goal.
    """
    return _asked_if_known(settings, step.situation, goal)


def _asked_if_known(settings: AssistanceSettings, situation: Situation, goal: str | int) -> Array:
    goals, rows = situation.goals, situation.rows
    row = goal_index(goals, goal)
    certain = np.zeros(len(goals.names))
    certain[row] = 1.0
    gradient = rows[GRADIENT : GRADIENT + 6, row].copy()
    known = Situation(settings, goals, situation.x, certain, rows, situation.best_targets, gradient)
    return _asked(settings, settings.method, known)


_NO_EVIDENCE = Evidence(0.0, 0.0, 1.0)


def _situation(
    settings: AssistanceSettings,
    goals: Goals,
    state: AssistanceState,
    x: Array,
    evidence: Evidence,
) -> Situation:
    n = len(goals.names)
    if len(state.log_belief) != n:
        raise CoreError(f"state must be of the same {n} goals, got {len(state.log_belief)}")
    rows = np.empty((N_ROWS, n))
    best_targets = np.empty(n, dtype=np.int64)
    gradient = np.empty(6)
    valid = active().update(
        settings,
        goals,
        x,
        state.log_belief,
        state.log_prior,
        evidence,
        rows,
        best_targets,
        gradient,
    )
    if not valid:
        raise _explained(goals, x)
    return Situation(settings, goals, x, rows[BELIEF], rows, best_targets, gradient)


def _asked(settings: AssistanceSettings, method: str, situation: Situation) -> Array:
    """Return the twist a method asks for, gain and magnitude included."""
    twist = METHODS[method](situation)
    if settings.magnitude == "fixed":
        return fixed_magnitude(twist, situation.direct)
    return twist


def _packed(pose: Pose, direct: Any) -> Array:
    """Return position, quaternion and D(u) in one array of shape (13,), shapes checked."""
    x = np.empty(13)
    for start, stop, value, name in (
        (0, 3, pose.position, "pose.position"),
        (3, 7, pose.quaternion, "pose.quaternion"),
        (7, 13, direct, "direct"),
    ):
        if type(value) is not np.ndarray or value.shape != (stop - start,):
            value = as_array(value, (stop - start,), name)
        x[start:stop] = value
    return x


def _explained(goals: Goals, x: Array) -> CoreError:
    """Return the error that says what was wrong with an input the inner functions refused."""
    try:
        as_array(x[:3], (3,), "pose.position")
        as_quaternions(x[3:7], (4,), "pose.quaternion")
        as_array(x[7:], (6,), "direct")
        as_array(goals.positions, (None, 3), "goals.positions")
        as_quaternions(goals.quaternions, (None, 4), "goals.quaternions")
    except CoreError as error:
        return error
    return CoreError(
        f"goals must have strictly growing offsets from 0 to {len(goals.positions)}, one more than"
        f" names, got {goals.offsets.tolist()} for {goals.names}; or values overflow"
    )


def _bounded_log(weights: Array, settings: AssistanceSettings) -> Array:
    return bounded(
        np.log(weights / weights.sum()),
        settings.belief_max,
        settings.belief_floor,
        settings.belief_surplus == "equal",
    )
