"""The assistance methods: what twist each asks for. One function each, one table.

A method sees a `Situation` and returns a twist [m/s, rad/s], shape (6,), world frame, with the
gain applied and before the limits. A new method is one function, one entry in METHODS, and its
name in `settings.METHOD_NAMES`.
"""

from collections.abc import Callable

import numpy as np

from app.core.arbitration import ARBITRATIONS
from app.core.backend import active
from app.core.both_act import both_act_step
from app.core.evaluation import GRADIENT, N_ROWS
from app.core.situation import Situation
from app.core.types import Array
from app.core.yielding import give_way


def direct(situation: Situation) -> Array:
    """Return D(u): no assistance."""
    return situation.direct.copy()


def blend(situation: Situation) -> Array:
    """Predict, then blend: (1 − c) D(u) + c P_g for the most probable goal g.

    Dragan & Srinivasa, the paper's comparison (Sec. VI). The robot's action is P_g = D(u) + A_g
    with A_g = −∇V_g(x ⊕ τD(u))/(2w); with `blend_replace` it is A_g alone.
    """
    settings = situation.settings
    goal = int(situation.belief.argmax())
    c = ARBITRATIONS[settings.arbitration](situation, goal)
    if c == 0.0:
        return situation.direct.copy()
    toward = situation.gradient(goal) * (-settings.gain / settings.two_w)
    kept = 1.0 - c if settings.blend_replace else 1.0
    return kept * situation.direct + c * toward


def policy(situation: Situation) -> Array:
    """Hindsight optimization: argmin_a τ w |a − D(u)|² + Σ_g b(g) V_g(x ⊕ τa).

    First order: a* = D(u) − Σ b ∇V_g(x ⊕ τD(u))/(2w); `step` "exact" minimises the translation.
    """
    return situation.direct + situation.settings.gain * policy_assistance(situation)


def yielding(situation: Situation) -> Array:
    """Return the policy's action, made to give way to where the user is pushing."""
    settings = situation.settings
    assistance = settings.gain * policy_assistance(situation)
    return situation.direct + give_way(assistance, situation.direct, settings)


def autonomy(situation: Situation) -> Array:
    """Let the robot complete the most probable goal by itself: −∇V_g(x)/(2w), whatever u is."""
    settings, goals = situation.settings, situation.goals
    x = situation.x.copy()
    x[7:] = 0.0
    rows = np.empty((N_ROWS, goals.n_goals))
    best_targets = np.empty(goals.n_goals, dtype=np.int64)
    active().evaluate(settings, goals, x, rows, best_targets)
    goal = int(situation.belief.argmax())
    return rows[GRADIENT : GRADIENT + 6, goal] * (-settings.gain / settings.two_w)


METHODS: dict[str, Callable[[Situation], Array]] = {
    "direct": direct,
    "blend": blend,
    "policy": policy,
    "yielding": yielding,
    "autonomy": autonomy,
}
"""Method → (situation) → twist asked for."""


def policy_assistance(situation: Situation) -> Array:
    """Return what the policy adds to D(u) at gain 1 [m/s, rad/s], shape (6,)."""
    settings = situation.settings
    assistance = situation.expected_gradient / -settings.two_w
    if settings.takeover == "both-act":
        assistance[:3] = both_act_step(situation)
    elif settings.step == "exact":
        assistance[:3] = active().exact_step(
            settings, situation.goals, situation.x, situation.belief, situation.expected_gradient
        )
    return assistance
