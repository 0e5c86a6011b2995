"""The longest integration step at which a robot's own motion is followed, by its linearisation.

MuJoCo's own step is differentiated about a state: x+ = A(h) x. Very short steps tell the motion's
eigenvalues, log(mu) / h; a step h is stable if no eigenvalue of A(h) is greater than those of the
motion itself let it be, exp(h max Re) or 1.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import mujoco
import numpy as np
from numpy.typing import NDArray

from gne_mj.examination.bench import Bench

Array = NDArray[np.float64]
SHORT = 1e-5  # s, of the motion's own eigenvalues
NUDGE = 1e-6
GROWS = 1e-3  # beyond what the motion does itself: what differences leave is less
LONGEST, SHORTEST, RATIO = 0.2, 1e-5, 1.6  # s of steps that are tried, and from one to the next


@dataclass(frozen=True)
class StableSteps:
    """Of one robot.

    Args:
        fastest: greatest |eigenvalue| of its motion in 1/s.
        growth: greatest real part in 1/s: what is positive falls over by itself.
        longest: by integrator the longest stable step in s, up to LONGEST.
    """

    fastest: float
    growth: float
    longest: dict[str, float]


def worst(found: Sequence[StableSteps]) -> StableSteps:
    """Of several states together."""
    return StableSteps(
        max(each.fastest for each in found), max(each.growth for each in found),
        {name: min(each.longest[name] for each in found) for name in found[0].longest},
    )  # fmt: skip


def stable_steps(bench: Bench, state: Array, u: Array, integrators: tuple[str, ...]) -> StableSteps:
    """About a state under inputs u (d,); the bench's step and integrator stay."""
    own, integrator = bench.plant.timestep, bench.plant.integrator
    try:
        bench.use_step(SHORT, "rk4")
        matrix = np.nan_to_num(transition(bench, state, u))
        rates = np.log(np.linalg.eigvals(matrix).astype(complex)) / SHORT
        growth = float(np.max(rates.real))
        longest = {name: _longest(bench, state, u, name, growth) for name in integrators}
    finally:
        bench.use_step(own, integrator)
    return StableSteps(float(np.max(np.abs(rates))), growth, longest)


def _longest(bench: Bench, state: Array, u: Array, integrator: str, growth: float) -> float:
    """The longest stable step, to 2%: shorter ones are tried until one is stable."""
    high = LONGEST
    while high > SHORTEST and not _stable(bench, state, u, high, integrator, growth):
        high /= RATIO
    if high >= LONGEST or high <= SHORTEST:
        return high
    low, high = high, high * RATIO
    while high > 1.02 * low:
        middle = np.sqrt(low * high)
        if _stable(bench, state, u, middle, integrator, growth):
            low = middle
        else:
            high = middle
    return float(low)


def _stable(
    bench: Bench, state: Array, u: Array, step: float, integrator: str, growth: float
) -> bool:
    bench.use_step(step, integrator)
    matrix = transition(bench, state, u)
    if not np.all(np.isfinite(matrix)):
        return False
    radius = float(np.max(np.abs(np.linalg.eigvals(matrix))))
    return radius <= max(1.0, float(np.exp(step * min(growth, 50.0)))) * (1.0 + GROWS)


def transition(bench: Bench, state: Array, u: Array) -> Array:
    """(n, n) how the state (tangents of joints, velocities, activations) moves on in a step."""
    model, data = bench.plant.model, bench.plant.data
    nv, na = model.nv, model.na
    size = 2 * nv + na
    columns = np.empty((size, size))
    bench.go(state)
    origin = data.qpos.copy()
    for column in range(size):
        ends = []
        for sign in (1.0, -1.0):
            bench.go(state)
            nudge = np.zeros(size)
            nudge[column] = sign * NUDGE
            mujoco.mj_integratePos(model, data.qpos, nudge[:nv], 1.0)
            data.qvel += nudge[nv : 2 * nv]
            data.act += nudge[2 * nv :]
            good = bench.move(u)
            ends.append(_tangent(model, data, origin) if good else np.full(size, np.nan))
        columns[:, column] = (ends[0] - ends[1]) / (2.0 * NUDGE)
    return columns


def _tangent(model: mujoco.MjModel, data: mujoco.MjData, origin: Array) -> Array:
    way = np.empty(model.nv)
    mujoco.mj_differentiatePos(model, way, 1.0, origin, data.qpos)
    return np.concatenate([way, data.qvel, data.act])
