"""The quadratic program of the inverse kinematics, as compiled loops over seven joints.

    min over q̇:  |S (J q̇ − [v; ω])|² + ε² |q̇|² + ε² |q̇ + g (q − q_start)/dt|²
    subject to:   lower ≤ q̇ ≤ upper

Axes are those of the world, the point is the hand's: what a twist of the contract means. S counts
rotation in units of 0.3 m/rad, and what leads off the commanded line STRAIGHTNESS times as much as
what is missing along it: at the end of its reach the arm slows down on the line instead of sliding
away from it.

The functions are plain Python, too, and run as such where numba does not work or
HINDSIGHT_KERNELS=numpy forbids it. Some fifty numpy calls instead would be a third of what the
physics of a tick costs.
"""

import math
import os
from collections.abc import Callable
from typing import Any

import numpy as np

UNITS = np.array([1.0, 1.0, 1.0, 0.3, 0.3, 0.3])  # [1, 1, 1, m/rad …]
STRAIGHTNESS = 10.0
REGULARISATION = 1e-3
"""ε, weight of damping and posture against the twist. With the weighted twist 1e-3 tracks as well
as 1e-5, and the arm no longer swirls about its free axis at the end of its reach."""
POSTURE_GAIN = 0.1
"""g, share of the way to the start posture taken per tick along the free axis; 1 would jerk."""
MAX_TWIST = 10.0  # [m/s, rad/s] of any component; what is asked beyond it only costs precision


def _compiled(arguments: str) -> Callable[[Callable[..., bool]], Any]:
    """Compile for these types at import; r: vector only read, w: vector, m: matrix, f: float."""

    def decorate(function: Callable[..., bool]) -> Any:
        if os.environ.get("HINDSIGHT_KERNELS") == "numpy":
            return function
        try:
            import numba
            from numba import types

            kinds = {
                "r": types.Array(types.float64, 1, "A", readonly=True),
                "m": types.float64[:, ::1],
                "w": types.float64[::1],
                "f": types.float64,
            }
            signature = types.boolean(*(kinds[kind] for kind in arguments))
            try:
                return numba.njit(signature, cache=True, error_model="numpy")(function)
            except (RuntimeError, OSError):  # no folder for the cache can be written
                return numba.njit(signature, error_model="numpy")(function)
        except Exception:  # numba and LLVM fail in many ways; the core warns of it, once
            return function

    return decorate


@_compiled("rrfmwww")
def bound(q, previous, dt, limits, middle, lower, upper):
    """Find how fast each joint may turn in the next tick, and where it will be half-way.

    A box that is never empty. For the upper side (the lower is its mirror), with d = q_max − q and
    a the acceleration limit:
        q̇ ≤ q̇_max,   q̇ ≤ q̇_prev + a dt,   q̇ dt + q̇²/(2a) ≤ d.
    The last keeps, after this tick, room to stop at a; once it holds, it never asks for more than
    a, so the two agree. From a state that breaks it (the arm was pushed), the position limit wins.
    Pink's own AccelerationLimit has no such order and makes the program infeasible there; without
    any acceleration bound, joints jump by 60–280 rad/s² near a singularity.

    Args:
        q: Joint positions [rad], (n,).
        previous: Joint velocities of the tick before [rad/s], (n,); what is not finite counts as 0.
        dt: Length of the tick [s].
        limits: Rows q_min, q_max [rad], q̇_max [rad/s], a [rad/s²], (4, n).
        middle: Filled with q + q̇_prev dt/2 [rad], (n,).
        lower: Filled with the lowest q̇ [rad/s], (n,).
        upper: Filled with the highest q̇ [rad/s], (n,).

    Returns:
        False where q is not finite.
    """
    for i in range(q.shape[0]):
        low, high, fastest, acceleration = limits[0, i], limits[1, i], limits[2, i], limits[3, i]
        if not abs(q[i]) < math.inf:
            return False
        at = min(max(q[i], low), high)
        before = previous[i] if abs(previous[i]) < math.inf else 0.0
        before = min(max(before, -fastest), fastest)
        # q̇ = √((a dt)² + 2 a d) − a dt solves the last inequality.
        change = acceleration * dt
        up = min(fastest, math.sqrt(change**2 + 2.0 * acceleration * (high - at)) - change)
        down = min(fastest, math.sqrt(change**2 + 2.0 * acceleration * (at - low)) - change)
        upper[i] = min(max(before + change, -down), up)
        lower[i] = min(max(before - change, -down), up)
        middle[i] = min(max(at + 0.5 * dt * before, low), high)
    return True


@_compiled("mrrrfmmw")
def objective(jacobian, q, start, twist, dt, rows, hessian, gradient):
    """Write what is minimised as ½ q̇ᵀ H q̇ + cᵀ q̇.

    With l the unit vector of U [v; ω] (U: units), s the straightness and S = (s − (s − 1) l lᵀ) U,
    which weighs what lies along the line by 1 and what lies across by s:
        S [v; ω] = U [v; ω],   (S J)ᵀ l = (U J)ᵀ l.

    Args:
        jacobian: J = ∂[v; ω]/∂q̇ of the hand at q, world frame, (6, n).
        q: Joint positions [rad], (n,).
        start: The posture the free axis tends to [rad], (n,).
        twist: [v; ω] of the hand [m/s, rad/s], (6,).
        dt: Length of the tick [s].
        rows: Filled with S J, (6, n).
        hessian: Filled with H, (n, n).
        gradient: Filled with c, (n,).

    Returns:
        False where the twist is not finite.
    """
    n = gradient.shape[0]
    largest = MAX_TWIST
    for k in range(6):
        if not abs(twist[k]) < math.inf:
            return False
        largest = max(largest, abs(twist[k]))
    shorter = MAX_TWIST / largest
    square = 0.0
    for k in range(6):
        square += (shorter * UNITS[k] * twist[k]) ** 2
    length = math.sqrt(square)
    unit = shorter / length if length > 0.0 else 0.0
    for i in range(n):
        along = 0.0
        for k in range(6):
            along += unit * UNITS[k] * twist[k] * UNITS[k] * jacobian[k, i]
        for k in range(6):
            across = STRAIGHTNESS * UNITS[k] * jacobian[k, i]
            rows[k, i] = across - (STRAIGHTNESS - 1.0) * unit * UNITS[k] * twist[k] * along
        pull = REGULARISATION**2 * POSTURE_GAIN * (q[i] - start[i]) / dt
        gradient[i] = pull - length * along
    for i in range(n):
        for j in range(i + 1):
            total = 0.0
            for k in range(6):
                total += rows[k, i] * rows[k, j]
            hessian[i, j] = total
            hessian[j, i] = total
        hessian[i, i] += 2.0 * REGULARISATION**2
    return True


@_compiled("wrr")
def settle(velocity, lower, upper):
    """Put a solution, (n,), exactly into its box; False where it is not finite."""
    for i in range(velocity.shape[0]):
        if not abs(velocity[i]) < math.inf:
            return False
        velocity[i] = min(max(velocity[i], lower[i]), upper[i])
    return True
