"""The inner functions as compiled loops: no allocation, one pass over the targets.

The same formulas as `values.py`, `evaluation.py` and `belief.py` (read those first); tests hold the
two equal to 1e-12. Importing this module compiles everything, or loads it from the cache beside
the source. All kernels live in this one file because numba's cache only watches the file of the
function itself: a helper elsewhere could change unnoticed.
"""

import math
from collections.abc import Callable
from typing import Any

import numba
from numba import float64, int64

_VECTOR, _MATRIX, _ROWS = float64[::1], float64[:, ::1], int64[::1]
# As in exact.py; not imported, since the cache would not see them change.
PASSES, COARSE, TOLERANCE = 200, 1e-6, 1e-14
RESTART_GOALS, RESTART_TARGETS, SHORT_OF_TARGET = 4, 3, 0.9
STARTS = 2 + RESTART_GOALS * RESTART_TARGETS
_SOFT_MIN_REACH = 40.0  # exp(−40) of a term is below the rounding of the sum


def compile_kernel(signature: Any) -> Callable[[Callable], Any]:
    """Compile for exactly these types now; without the cache where no folder can be written."""

    def decorate(function: Callable) -> Any:
        try:
            return numba.njit(signature, cache=True, error_model="numpy")(function)
        except (RuntimeError, OSError):
            return numba.njit(signature, error_model="numpy")(function)

    return decorate


@compile_kernel(float64(float64, float64, float64, float64, float64))
def value(d, alpha, delta, offset, speed):
    """V(d), `values.value`."""
    if d > delta:
        return (alpha * (d - 0.5 * delta) + offset * d) / speed
    return (0.5 * alpha / delta * d * d + offset * d) / speed


@compile_kernel(float64(float64, float64, float64, float64))
def cost_rate(d, alpha, delta, offset):
    """C(d), `values.cost_rate`."""
    return alpha * min(1.0, d / delta) + offset


@compile_kernel(float64(float64, float64))
def angle(cosine, sine):
    """Angle r from |cos(r/2)| and sin(r/2) ≥ 0, accurate near 0 and near π."""
    if sine < cosine:
        return 2.0 * math.asin(min(sine, 1.0))
    return 2.0 * math.acos(min(cosine, 1.0))


@compile_kernel(float64(_MATRIX, int64, float64, float64, float64, float64))
def angle_to(quaternions, k, w, x, y, z):
    """Angle between target k's orientation and (w, x, y, z), `rotations.rotation_between`."""
    kw, kx, ky, kz = quaternions[k, 0], quaternions[k, 1], quaternions[k, 2], quaternions[k, 3]
    cosine = abs(kw * w + kx * x + ky * y + kz * z)
    if cosine * cosine < 0.5:  # acos is accurate here, and the axis is not needed
        return 2.0 * math.acos(cosine)
    nx = w * kx - kw * x - (ky * z - kz * y)
    ny = w * ky - kw * y - (kz * x - kx * z)
    nz = w * kz - kw * z - (kx * y - ky * x)
    return angle(cosine, math.sqrt(nx * nx + ny * ny + nz * nz))


@compile_kernel(float64(_MATRIX, int64, float64, float64, float64))
def along_approach(quaternions, k, ex, ey, ez):
    """Return e · z of target k, `rotations.approach_axes`."""
    w, x, y, z = quaternions[k, 0], quaternions[k, 1], quaternions[k, 2], quaternions[k, 3]
    along = 2.0 * (ex * (x * z + w * y) + ey * (y * z - w * x))
    return along + ez * (1.0 - 2.0 * (x * x + y * y))


@compile_kernel("UniTuple(float64, 4)(float64[::1], float64)")
def turned(x, tau):
    """Return the unit quaternion exp(τ[ω]×) R of a row (position, quaternion, twist)."""
    norm = math.sqrt(x[3] * x[3] + x[4] * x[4] + x[5] * x[5] + x[6] * x[6])
    qw, qx, qy, qz = x[3] / norm, x[4] / norm, x[5] / norm, x[6] / norm
    rx, ry, rz = tau * x[10], tau * x[11], tau * x[12]
    if rx == 0.0 and ry == 0.0 and rz == 0.0:
        return qw, qx, qy, qz
    turn = math.sqrt(rx * rx + ry * ry + rz * rz)
    s = 0.5 - turn * turn / 48.0 if turn < 1e-4 else math.sin(0.5 * turn) / turn
    ew, ex, ey, ez = math.cos(0.5 * turn), s * rx, s * ry, s * rz
    return (
        ew * qw - ex * qx - ey * qy - ez * qz,
        ew * qx + ex * qw + ey * qz - ez * qy,
        ew * qy - ex * qz + ey * qw + ez * qx,
        ew * qz + ex * qy - ey * qx + ez * qw,
    )


@compile_kernel(numba.boolean(_VECTOR, _MATRIX, _MATRIX, _ROWS, _VECTOR, _MATRIX, _ROWS))
def evaluate(packed, positions, quaternions, offsets, x, rows, best_targets):
    """Fill rows 0…11 and the best targets, `evaluation.evaluate`; False where input is not valid.

    `packed` is `AssistanceSettings.packed`; rows are in the order of `evaluation.py`.
    """
    a_t, d_t, c_t, v_t = packed[0], packed[1], packed[2], packed[3]
    a_r, d_r, c_r, v_r, m = packed[4], packed[5], packed[6], packed[7], packed[8]
    tau, temperature, with_running = packed[9], packed[10], packed[11] == 1.0
    aside2 = packed[15] * packed[15]
    straight = aside2 == 1.0
    n_goals = offsets.shape[0] - 1
    if n_goals < 1 or n_goals != best_targets.shape[0] or n_goals != rows.shape[1]:
        return False
    if offsets[0] != 0 or offsets[n_goals] != positions.shape[0]:
        return False
    if quaternions.shape[0] != positions.shape[0] or x.shape[0] != 13:
        return False
    if positions.shape[1] != 3 or quaternions.shape[1] != 4:
        return False

    norm2 = x[3] * x[3] + x[4] * x[4] + x[5] * x[5] + x[6] * x[6]
    total = norm2
    for i in range(13):
        total += x[i]
    if not (norm2 > 1e-12 and math.isfinite(total)):
        return False
    px, py, pz = x[0], x[1], x[2]
    # x ⊕ τD(u)
    ax, ay, az = px + tau * x[7], py + tau * x[8], pz + tau * x[9]
    rotates = x[10] != 0.0 or x[11] != 0.0 or x[12] != 0.0
    qw, qx, qy, qz = turned(x, 0.0)
    tw, tx, ty, tz = turned(x, tau)

    for g in range(n_goals):
        first, end = offsets[g], offsets[g + 1]
        if end <= first:
            return False
        least = least_after = least_summed = nearest = math.inf
        sum_before = sum_after = 0.0
        rate_before = rate_after = 0.0
        best = first
        for k in range(first, end):
            ex, ey, ez = positions[k, 0] - px, positions[k, 1] - py, positions[k, 2] - pz
            square = ex * ex + ey * ey + ez * ez
            distance = math.sqrt(square)
            fx, fy, fz = ax - positions[k, 0], ay - positions[k, 1], az - positions[k, 2]
            if straight:
                d, d_after = distance, math.sqrt(fx * fx + fy * fy + fz * fz)
            else:  # |L e|² = a² |e|² + (1 − a²) (e · z)²
                along = along_approach(quaternions, k, ex, ey, ez)
                d = math.sqrt(aside2 * square + (1.0 - aside2) * along * along)
                along = along_approach(quaternions, k, fx, fy, fz)
                square = fx * fx + fy * fy + fz * fz
                d_after = math.sqrt(aside2 * square + (1.0 - aside2) * along * along)
            r = angle_to(quaternions, k, qw, qx, qy, qz)
            v_rotation = m * value(r, a_r, d_r, c_r, v_r)
            before = value(d, a_t, d_t, c_t, v_t) + v_rotation
            if rotates:
                r_after = angle_to(quaternions, k, tw, tx, ty, tz)
                v_rotation = m * value(r_after, a_r, d_r, c_r, v_r)
            after = value(d_after, a_t, d_t, c_t, v_t) + v_rotation
            rate = cost_rate(d, a_t, d_t, c_t) + m * cost_rate(r, a_r, d_r, c_r)
            summed = after + tau * rate if with_running else after
            if temperature > 0.0:
                # running log-sum-exp: the sum is kept relative to the least value so far
                if before < least:
                    sum_before = sum_before * math.exp((before - least) / temperature) + 1.0
                elif before - least < _SOFT_MIN_REACH * temperature:
                    sum_before += math.exp((least - before) / temperature)
                if summed < least_summed:
                    sum_after = sum_after * math.exp((summed - least_summed) / temperature) + 1.0
                elif summed - least_summed < _SOFT_MIN_REACH * temperature:
                    sum_after += math.exp((least_summed - summed) / temperature)
            nearest = min(nearest, distance)
            if summed < least_summed:
                least_summed = summed
            if before < least:
                least, rate_before = before, rate
            if after < least_after:
                least_after, rate_after, best = after, rate, k
        best_targets[g] = best
        rows[0, g] = least
        rows[1, g] = tau * rate_after + least_after
        rows[2, g] = nearest
        rows[3, g] = rate_before
        if temperature > 0.0:
            rows[4, g] = least - temperature * math.log(sum_before)
            rows[5, g] = least_summed - temperature * math.log(sum_after)
        else:
            rows[4, g] = least
            rows[5, g] = rows[1, g] if with_running else least_after
        if not math.isfinite(rows[4, g] + rows[5, g] + rows[1, g]):
            return False

        # ∇V at the best target after the action
        ex, ey, ez = ax - positions[best, 0], ay - positions[best, 1], az - positions[best, 2]
        square = ex * ex + ey * ey + ez * ez
        kw, kx = quaternions[best, 0], quaternions[best, 1]
        ky, kz = quaternions[best, 2], quaternions[best, 3]
        if not straight:
            along = along_approach(quaternions, best, ex, ey, ez)
            square = aside2 * square + (1.0 - aside2) * along * along
            along *= 1.0 - aside2
            ex = aside2 * ex + along * 2.0 * (kx * kz + kw * ky)
            ey = aside2 * ey + along * 2.0 * (ky * kz - kw * kx)
            ez = aside2 * ez + along * (1.0 - 2.0 * (kx * kx + ky * ky))
        d = math.sqrt(square)
        scale = cost_rate(d, a_t, d_t, c_t) / (v_t * d) if d > 0.0 else 0.0
        rows[6, g], rows[7, g], rows[8, g] = ex * scale, ey * scale, ez * scale
        scalar = kw * tw + kx * tx + ky * ty + kz * tz
        nx = tw * kx - kw * tx - (ky * tz - kz * ty)
        ny = tw * ky - kw * ty - (kz * tx - kx * tz)
        nz = tw * kz - kw * tz - (kx * ty - ky * tx)
        sine = math.sqrt(nx * nx + ny * ny + nz * nz)
        scale = 0.0
        if sine > 0.0:
            r = angle(abs(scalar), sine)
            scale = -m * cost_rate(r, a_r, d_r, c_r) / (v_r * sine)
        if scalar < 0.0 or (
            scalar == 0.0 and (nx < 0.0 or (nx == 0.0 and (ny < 0.0 or (ny == 0.0 and nz < 0.0))))
        ):
            scale = -scale
        rows[9, g], rows[10, g], rows[11, g] = nx * scale, ny * scale, nz * scale
    return True


@compile_kernel(float64(_VECTOR, int64))
def log_sum_exp(values, skip):
    """Return log Σ exp(values) over all but row `skip` (−1: all)."""
    top = -math.inf
    for g in range(values.shape[0]):
        if g != skip and values[g] > top:
            top = values[g]
    total = 0.0
    for g in range(values.shape[0]):
        if g != skip:
            total += math.exp(values[g] - top)
    return top + math.log(total)


@compile_kernel(numba.void(_VECTOR, float64, float64, numba.boolean))
def bound(log_b, highest, lowest, equal):
    """Normalise and bound log b(g) in place, `belief.bounded`."""
    n = log_b.shape[0]
    if n == 1:
        log_b[0] = 0.0
        return
    shift = log_sum_exp(log_b, -1)
    smallest = math.inf
    for g in range(n):
        log_b[g] -= shift
        smallest = min(smallest, log_b[g])
    floor = min(lowest, max(1.0 - highest, 0.01) / (n - 1))
    if floor > 0.0 and math.exp(smallest) < floor:
        scale = 1.0
        for _ in range(n):
            count, rest = 0, 0.0
            for g in range(n):
                b = math.exp(log_b[g])
                if b * scale < floor:
                    count += 1
                else:
                    rest += b
            smaller = (1.0 - floor * count) / rest
            if smaller == scale:
                break
            scale = smaller
        for g in range(n):
            log_b[g] = math.log(max(math.exp(log_b[g]) * scale, floor))
    top = 0
    for g in range(n):
        if log_b[g] > log_b[top]:
            top = g
    if log_b[top] > math.log(highest):
        if equal:
            surplus = math.exp(log_b[top]) - highest
            for g in range(n):
                log_b[g] = math.log(math.exp(log_b[g]) + surplus / (n - 1))
        else:
            shift = math.log1p(-highest) - log_sum_exp(log_b, top)
            for g in range(n):
                log_b[g] += shift
        log_b[top] = math.log(highest)


@compile_kernel(
    numba.boolean(
        *(_VECTOR, _MATRIX, _MATRIX, _ROWS, _VECTOR, _VECTOR, _VECTOR),
        *(float64, float64, float64, _MATRIX, _ROWS, _VECTOR),
    )
)
def update(
    packed,
    positions,
    quaternions,
    offsets,
    x,
    log_belief,
    log_prior,
    weight,
    drift,
    decay,
    rows,
    best_targets,
    expected_gradient,
):
    """One tick: evaluate, condition, Σ b ∇V; `numpy_backend.update`."""
    if not evaluate(packed, positions, quaternions, offsets, x, rows, best_targets):
        return False
    n = rows.shape[1]
    far = packed[0] + packed[2] + packed[8] * (packed[4] + packed[6])
    changed = False
    log_b = rows[13]
    for g in range(n):
        change = weight * (rows[4, g] - rows[5, g])
        if drift != 0.0 and far > 0.0:
            change += drift * (1.0 - rows[3, g] / far)
        if decay != 1.0:
            change += (decay - 1.0) * (log_belief[g] - log_prior[g])
        changed = changed or change != 0.0
        log_b[g] = log_belief[g] + change
    if changed:
        bound(log_b, packed[12], packed[13], packed[14] == 1.0)
    for i in range(6):
        expected_gradient[i] = 0.0
    for g in range(n):
        rows[12, g] = math.exp(log_b[g])
        for i in range(6):
            expected_gradient[i] += rows[12, g] * rows[6 + i, g]
    return True


@compile_kernel(
    numba.void(
        *(_VECTOR, _MATRIX, _MATRIX, _ROWS, _VECTOR, _VECTOR, _VECTOR),
        *(_VECTOR, _VECTOR, float64, _MATRIX, _MATRIX),
    )
)
def fill_grid(
    packed,
    positions,
    axes,
    offsets,
    rotation_values,
    weights,
    start,
    u,
    v,
    temperature,
    scratch,
    grid,
):
    """Fill `grid` with Σ_g weights(g) V_g on a plane; `numpy_backend.fill_grid`.

    The points of a row are the innermost loop, without branches, so that it runs four at a time.
    `scratch`: least value and sum of exponentials per point of a row, shape (2, n_v).
    """
    alpha, delta, offset, speed = packed[0], packed[1], packed[2], packed[3]
    aside2 = packed[15] * packed[15]
    n_u, n_v = grid.shape
    least, total = scratch[0], scratch[1]
    step = 1.0 / (n_v - 1)
    for i in range(n_u):
        s = i / (n_u - 1)
        grid[i, :] = 0.0
        for g in range(weights.shape[0]):
            if weights[g] == 0.0:
                continue
            least[:] = math.inf
            for k in range(offsets[g], offsets[g + 1]):
                rx = start[0] + s * u[0] - positions[k, 0]
                ry = start[1] + s * u[1] - positions[k, 1]
                rz = start[2] + s * u[2] - positions[k, 2]
                zx, zy, zz = axes[k, 0], axes[k, 1], axes[k, 2]
                rotation_value = rotation_values[k]
                for j in range(n_v):
                    t = j * step
                    ex, ey, ez = rx + t * v[0], ry + t * v[1], rz + t * v[2]
                    along = ex * zx + ey * zy + ez * zz
                    square = aside2 * (ex * ex + ey * ey + ez * ez)
                    d = math.sqrt(square + (1.0 - aside2) * along * along)
                    one = value(d, alpha, delta, offset, speed) + rotation_value
                    least[j] = one if one < least[j] else least[j]
            if temperature > 0.0:
                total[:] = 0.0
                for k in range(offsets[g], offsets[g + 1]):
                    rx = start[0] + s * u[0] - positions[k, 0]
                    ry = start[1] + s * u[1] - positions[k, 1]
                    rz = start[2] + s * u[2] - positions[k, 2]
                    zx, zy, zz = axes[k, 0], axes[k, 1], axes[k, 2]
                    for j in range(n_v):
                        t = j * step
                        ex, ey, ez = rx + t * v[0], ry + t * v[1], rz + t * v[2]
                        along = ex * zx + ey * zy + ez * zz
                        square = aside2 * (ex * ex + ey * ey + ez * ez)
                        d = math.sqrt(square + (1.0 - aside2) * along * along)
                        one = value(d, alpha, delta, offset, speed) + rotation_values[k]
                        total[j] += math.exp((least[j] - one) / temperature)
                for j in range(n_v):
                    least[j] -= temperature * math.log(total[j])
            for j in range(n_v):
                grid[i, j] += weights[g] * least[j]


@compile_kernel(
    float64(
        *(_VECTOR, _MATRIX, _MATRIX, _ROWS, _VECTOR, _VECTOR, _VECTOR),
        *(float64, _MATRIX, _MATRIX, _VECTOR),
    )
)
def exact_step(
    packed, positions, quaternions, offsets, x, belief, gradient, w, towards, starts, best
):
    """Write the velocity of `exact.exact_step` to `best`, return its objective.

    Room to work in: `towards`, per target the way to it (3), its approach axis (3), the value of
    its rotation and its distance squared, shape (n_targets, 8); `starts`, shape (STARTS, 3).
    """
    alpha, delta, offset, speed, tau = packed[0], packed[1], packed[2], packed[3], packed[9]
    a_r, d_r, c_r, v_r, m = packed[4], packed[5], packed[6], packed[7], packed[8]
    aside2 = packed[15] * packed[15]
    n_goals = belief.shape[0]
    tw, tx, ty, tz = turned(x, tau)
    ax, ay, az = x[0] + tau * x[7], x[1] + tau * x[8], x[2] + tau * x[9]
    for k in range(positions.shape[0]):
        ex, ey, ez = positions[k, 0] - ax, positions[k, 1] - ay, positions[k, 2] - az
        towards[k, 0], towards[k, 1], towards[k, 2] = ex, ey, ez
        kw, kx, ky, kz = quaternions[k, 0], quaternions[k, 1], quaternions[k, 2], quaternions[k, 3]
        towards[k, 3] = 2.0 * (kx * kz + kw * ky)
        towards[k, 4] = 2.0 * (ky * kz - kw * kx)
        towards[k, 5] = 1.0 - 2.0 * (kx * kx + ky * ky)
        r = angle_to(quaternions, k, tw, tx, ty, tz)
        towards[k, 6] = m * value(r, a_r, d_r, c_r, v_r)
        towards[k, 7] = ex * ex + ey * ey + ez * ez

    # where to start: no assistance, first order, and into the nearest targets of the likeliest
    starts[0] = 0.0
    starts[1] = -gradient[:3] / (2.0 * w)
    n_starts = 2
    likelier, likelier_at = math.inf, -1
    for _ in range(min(RESTART_GOALS, n_goals)):
        goal = -1
        for g in range(n_goals):  # the likeliest of those that come after the last one
            after = belief[g] < likelier or (belief[g] == likelier and g > likelier_at)
            if after and (goal < 0 or belief[g] > belief[goal]):
                goal = g
        likelier, likelier_at = belief[goal], goal
        nearer, nearer_at = -1.0, -1
        for _ in range(min(RESTART_TARGETS, offsets[goal + 1] - offsets[goal])):
            target = -1
            for k in range(offsets[goal], offsets[goal + 1]):
                after = towards[k, 7] > nearer or (towards[k, 7] == nearer and k > nearer_at)
                if after and (target < 0 or towards[k, 7] < towards[target, 7]):
                    target = k
            nearer, nearer_at = towards[target, 7], target
            for i in range(3):
                starts[n_starts, i] = SHORT_OF_TARGET / tau * towards[target, i]
            n_starts += 1

    least = math.inf
    for index in range(n_starts + 1):
        start = starts[index % n_starts]
        sx, sy, sz = start[0], start[1], start[2]
        limit = COARSE
        if index == n_starts:  # at last, on from the best end
            sx, sy, sz, limit = best[0], best[1], best[2], TOLERANCE
        objective = math.inf
        for step in range(PASSES + 1):
            # the objective at s, and the quadratic that touches it there
            ax = ay = az = stiffness = 0.0
            mxx = mxy = mxz = myy = myz = mzz = 0.0  # (1 − a²) Σ k z zᵀ
            objective = tau * w * (sx * sx + sy * sy + sz * sz)
            for g in range(n_goals):
                value_best, d_best, k_best = math.inf, 0.0, offsets[g]
                for k in range(offsets[g], offsets[g + 1]):
                    ex = towards[k, 0] - tau * sx
                    ey = towards[k, 1] - tau * sy
                    ez = towards[k, 2] - tau * sz
                    along = ex * towards[k, 3] + ey * towards[k, 4] + ez * towards[k, 5]
                    square = aside2 * (ex * ex + ey * ey + ez * ez)
                    d = math.sqrt(square + (1.0 - aside2) * along * along)
                    one = value(d, alpha, delta, offset, speed) + towards[k, 6]
                    if one < value_best:
                        value_best, d_best, k_best = one, d, k
                objective += belief[g] * value_best
                rate = alpha * min(1.0, d_best / delta) + offset
                pull = belief[g] * rate / (speed * max(d_best, 1e-12))
                px, py, pz = towards[k_best, 0], towards[k_best, 1], towards[k_best, 2]
                zx, zy, zz = towards[k_best, 3], towards[k_best, 4], towards[k_best, 5]
                bent = pull * (1.0 - aside2)
                along = bent * (px * zx + py * zy + pz * zz)
                pull *= aside2
                ax += pull * px + along * zx
                ay += pull * py + along * zy
                az += pull * pz + along * zz
                stiffness += pull
                mxx, mxy, mxz = mxx + bent * zx * zx, mxy + bent * zx * zy, mxz + bent * zx * zz
                myy, myz, mzz = myy + bent * zy * zy, myz + bent * zy * zz, mzz + bent * zz * zz
            if step == PASSES:
                break
            # (2w I + τ Σ k L²) n = Σ k L² P, by Cramer's rule
            diagonal = 2.0 * w + tau * stiffness
            xx, yy, zz = diagonal + tau * mxx, diagonal + tau * myy, diagonal + tau * mzz
            xy, xz, yz = tau * mxy, tau * mxz, tau * myz
            cxx, cxy, cxz = yy * zz - yz * yz, xz * yz - xy * zz, xy * yz - xz * yy
            cyy, cyz, czz = xx * zz - xz * xz, xy * xz - xx * yz, xx * yy - xy * xy
            scale = 1.0 / (xx * cxx + xy * cxy + xz * cxz)
            nx = (cxx * ax + cxy * ay + cxz * az) * scale
            ny = (cxy * ax + cyy * ay + cyz * az) * scale
            nz = (cxz * ax + cyz * ay + czz * az) * scale
            moved = max(abs(nx - sx), abs(ny - sy), abs(nz - sz))
            if moved < limit:
                break
            sx, sy, sz = nx, ny, nz
        if objective < least or index == n_starts:
            least = objective
            best[0], best[1], best[2] = sx, sy, sz
    return least
