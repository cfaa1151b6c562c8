"""What an assistance method is given: the hand, the user's D(u), the belief and the values."""

from dataclasses import dataclass

from app.core.evaluation import DISTANCE, GRADIENT
from app.core.settings import AssistanceSettings
from app.core.types import Array, Goals, Rows


@dataclass(slots=True)
class Situation:
    """One moment, as a method sees it.

    Attributes:
        settings: The method's options.
        goals: Goals with targets, world frame.
        x: Position [m], unit quaternion w x y z, and D(u) [m/s, rad/s], shape (13,).
        belief: b(g), shape (n_goals,).
        rows: Values, costs and gradients per goal (`evaluation.py`), shape (N_ROWS, n_goals).
        best_targets: Per goal the target that is best after the action, shape (n_goals,).
        expected_gradient: Σ_g b(g) ∇V_g(x ⊕ τD(u)) [nat/m, nat/rad], shape (6,).
    """

    settings: AssistanceSettings
    goals: Goals
    x: Array
    belief: Array
    rows: Array
    best_targets: Rows
    expected_gradient: Array

    @property
    def direct(self) -> Array:
        """D(u) [m/s, rad/s], shape (6,)."""
        return self.x[7:]

    @property
    def distances(self) -> Array:
        """Distance of the hand to each goal's nearest target [m], shape (n_goals,)."""
        return self.rows[DISTANCE]

    def gradient(self, goal: int) -> Array:
        """Return ∇V_g(x ⊕ τD(u)) of one goal [nat/m, nat/rad], shape (6,)."""
        return self.rows[GRADIENT : GRADIENT + 6, goal]
