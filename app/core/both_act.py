"""EXPERIMENTAL: the paper's other approximation of Q_g, "robot and user both act" (Sec. IV).

"Robot takes over" lets the robot finish alone. Here the user goes on, with inputs drawn from the
MaxEnt policy π_usr of the goal, and the robot is charged C_rob = C_usr + w |a − D(u)|² for all it
adds. The cost-to-go depends on the distance alone, so it is estimated once per settings by rollouts
from a row of distances and looked up from then on. Translation only; rotation stays as it is.

- The user pushes with `user_speed` in a direction drawn from p(u | x, g) ∝ exp(V_g(x) − Q_g(x, u)),
  to first order a von Mises–Fisher distribution about the way to the target, with concentration
  κ = β τ (C(d)/v_to) · user_speed, and mean help ū = user_speed (coth κ − 1/κ).
- The robot knows the goal and adds the speed s toward it that minimises the charge per metre of
  progress, (C + w s²)/(s + ū), i.e. s = √(ū² + C/w) − ū: the more the user does, the less it adds.

The same random numbers serve every distance, so that differences of values are not noise.
"""

import math
from functools import lru_cache

import numpy as np

from app.core.rotations import approach_axes
from app.core.settings import AssistanceSettings
from app.core.situation import Situation
from app.core.types import Array
from app.core.values import cost_rate, translation_cost, weigh

SAMPLES = 64
STEP = 0.04  # [s]
LONGEST = 20.0  # [s] of one rollout, for users and robots too slow to arrive
ARRIVED = 1e-3  # [m]
# distances the rollouts start from [m]: dense where the cost changes, straight beyond
DISTANCES = np.concatenate([np.linspace(0.0, 0.12, 25), np.linspace(0.15, 0.6, 10)])


def both_act_step(situation: Situation) -> Array:
    """Return the velocity the policy adds under "both act", to first order [m/s], shape (3,).

    s = −Σ_g b(g) ∇V_g^both(y)/(2w), y = p + τD(u), never past a target within τ.
    """
    settings, x = situation.settings, situation.x
    distances, values = both_act_values(settings)
    slopes = np.diff(values) / np.diff(distances)
    y = x[:3] + settings.look_ahead * x[7:10]
    best, aside = situation.best_targets, settings.translation_aside
    axes = approach_axes(situation.goals.quaternions[best])
    weighed = weigh(situation.goals.positions[best] - y, axes, aside)
    d, toward = np.linalg.norm(weighed, axis=1), weigh(weighed, axes, aside)
    middles = 0.5 * (distances[1:] + distances[:-1])
    speed = np.interp(d, middles, slopes) / (2.0 * settings.w_translation)
    speed = np.minimum(speed, d / (aside**2 * settings.look_ahead))
    unit = toward / np.where(d > 0.0, d, np.inf)[:, None]
    return (situation.belief * speed) @ unit


def expected_speeds(distance: Array, settings: AssistanceSettings) -> tuple[Array, Array, Array]:
    """Return κ, the mean help of the user [m/s] and the robot's own speed [m/s] at distances."""
    cost = translation_cost(settings)
    rate = cost_rate(distance, cost)
    beta = settings.beta if settings.predictor == "calibrated" else 1.0
    kappa = beta * settings.look_ahead * rate / cost.speed * settings.user_speed
    # coth κ − 1/κ, by its series where the difference would lose digits
    wide = np.maximum(kappa, 1e-3)
    mean = np.where(kappa < 1e-3, kappa / 3.0, 1.0 / np.tanh(wide) - 1.0 / wide)
    help_ = settings.user_speed * mean
    return kappa, help_, np.sqrt(help_**2 + rate / settings.w_translation) - help_


@lru_cache(maxsize=16)
def both_act_values(settings: AssistanceSettings) -> tuple[Array, Array]:
    """Return distances [m] and the expected cost-to-go V^both there [nat], each of shape (n,).

    Rollouts of SAMPLES users from every distance, charged C_rob = C_usr + w s² per second.
    """
    rng = np.random.default_rng(0)
    cost, w = translation_cost(settings), settings.w_translation
    position = np.zeros((len(DISTANCES), SAMPLES, 3))
    position[:, :, 0] = DISTANCES[:, None]
    total = np.zeros((len(DISTANCES), SAMPLES))
    for _ in range(math.ceil(LONGEST / STEP)):
        d = np.linalg.norm(position, axis=2)
        moving = d > ARRIVED
        if not moving.any():
            break
        kappa, _, robot = expected_speeds(d, settings)
        way = -position / np.where(moving, d, np.inf)[:, :, None]
        user = settings.user_speed * _directions(rng, way, kappa)
        step = STEP * (user + robot[:, :, None] * way)
        reach = np.linalg.norm(step, axis=2)
        # a step ends, and is charged, where it would pass the target
        share = np.where(moving, np.minimum(1.0, d / np.where(reach > 0.0, reach, np.inf)), 0.0)
        total += share * STEP * (cost_rate(d, cost) + w * robot**2)
        position += share[:, :, None] * step
    values = np.maximum.accumulate(total.mean(axis=1))
    values.setflags(write=False)
    return DISTANCES, values


def _directions(rng: np.random.Generator, way: Array, kappa: Array) -> Array:
    """Draw one von Mises–Fisher direction about each `way`; the same numbers for every distance.

    On the sphere the cosine has the closed form 1 + log(ξ + (1 − ξ) e^(−2κ))/κ, ξ uniform.
    """
    xi, turn = rng.random(way.shape[1]), rng.random(way.shape[1]) * 2.0 * math.pi
    wide = np.maximum(kappa, 1e-3)
    cosine = 1.0 + np.log(xi + (1.0 - xi) * np.exp(-2.0 * wide)) / wide
    cosine = np.where(kappa < 1e-3, 2.0 * xi - 1.0, np.clip(cosine, -1.0, 1.0))
    sine = np.sqrt(1.0 - cosine**2)
    # two axes across `way`, from whichever world axis is farther from it
    helper = np.where(np.abs(way[..., :1]) < 0.7, [1.0, 0.0, 0.0], [0.0, 1.0, 0.0])
    first = np.cross(way, helper)
    length = np.linalg.norm(first, axis=-1, keepdims=True)
    first /= np.where(length > 0.0, length, np.inf)
    second = np.cross(way, first)
    across = np.cos(turn)[:, None] * first + np.sin(turn)[:, None] * second
    return cosine[..., None] * way + sine[..., None] * across
