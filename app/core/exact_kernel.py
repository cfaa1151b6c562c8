"""The exact step's descent as compiled loops; `exact.descend` says what it computes.

It calls no other kernel: numba's cache only watches the file of the function itself.
"""

import math

from numba import float64, int64

from app.core.kernels import compile_kernel

_VECTOR, _MATRIX, _ROWS = float64[::1], float64[:, ::1], int64[::1]


@compile_kernel(
    float64(
        *(_VECTOR, _MATRIX, _ROWS, _VECTOR, _VECTOR),
        *(float64, int64, float64, _MATRIX, _VECTOR),
    )
)
def descend(packed, towards, offsets, rotation_values, belief, w, passes, tolerance, starts, best):
    """Descend from every start, write the best velocity to `best`, return its objective."""
    alpha, delta, offset, speed, tau = packed[0], packed[1], packed[2], packed[3], packed[9]
    n_goals = belief.shape[0]
    least = math.inf
    for index in range(starts.shape[0]):
        sx, sy, sz = starts[index, 0], starts[index, 1], starts[index, 2]
        objective = math.inf
        for step in range(passes + 1):
            # the objective at s, and the quadratic that touches it there
            ax = ay = az = stiffness = 0.0
            objective = tau * w * (sx * sx + sy * sy + sz * sz)
            for g in range(n_goals):
                value_best, d_best, k_best = math.inf, 0.0, offsets[g]
                for k in range(offsets[g], offsets[g + 1]):
                    ex = towards[k, 0] - tau * sx
                    ey = towards[k, 1] - tau * sy
                    ez = towards[k, 2] - tau * sz
                    d = math.sqrt(ex * ex + ey * ey + ez * ez)
                    if d > delta:
                        one = (alpha * (d - 0.5 * delta) + offset * d) / speed
                    else:
                        one = (0.5 * alpha / delta * d * d + offset * d) / speed
                    one += rotation_values[k]
                    if one < value_best:
                        value_best, d_best, k_best = one, d, k
                objective += belief[g] * value_best
                rate = alpha * min(1.0, d_best / delta) + offset
                pull = belief[g] * rate / (speed * max(d_best, 1e-12))
                ax += pull * towards[k_best, 0]
                ay += pull * towards[k_best, 1]
                az += pull * towards[k_best, 2]
                stiffness += pull
            if step == passes:
                break
            scale = 1.0 / (2.0 * w + tau * stiffness)
            nx, ny, nz = ax * scale, ay * scale, az * scale
            moved = max(abs(nx - sx), abs(ny - sy), abs(nz - sz))
            if moved < tolerance:
                break
            sx, sy, sz = nx, ny, nz
        if objective < least:
            least = objective
            best[0], best[1], best[2] = sx, sy, sz
    return least
