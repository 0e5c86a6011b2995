"""How finely the steps of mode continuous will have to be divided, at the start and at y*."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gne_mj.loops import division
from gne_mj.loops.feedback import Work, work
from gne_mj.system import Clock, System
from gne_mj.system.first_input import law_at, limits_at, problem_at_start
from gne_mj.system.steps import STABLE
from gne_mj.theory.periods import linear_period

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Pieces:
    """Into how many pieces a step is divided: a power of two up to ``finest``, None for more.

    Attributes:
        start: in the first step, by trying pieces of it with the agents' other states at rest.
        equilibrium: at y*, so that the linearised loop is stable under the integrator.
        finest: beyond which no run goes.
    """

    start: int | None
    equilibrium: int | None
    finest: int = division.PIECES


def forecast(system: System, clock: Clock) -> Pieces | None:
    """Of a system with fixed steps in mode continuous.

    None of others, of MJCF robots, and where y* is not known.
    """
    known = system.known_equilibrium
    if system.mode != "continuous" or system.integrator not in STABLE or known is None:
        return None
    longest = linear_period(system, known.action)
    if longest is None:
        return None
    share = 2.0 * clock.timestep / (STABLE[system.integrator] * longest)  # 0: no mode decays
    level = 0 if share <= 1.0 else int(np.ceil(np.log2(share)))
    return Pieces(_at_start(system, clock.timestep), _power(level))


def _power(level: int) -> int | None:
    return 1 << level if level <= division.FINEST else None


def _at_start(system: System, h: float) -> int | None:
    game, kind = system.game, system.agents.kind
    drift, scratch = np.zeros(game.actions), np.zeros(system.agents.states)
    for r, (q, x) in enumerate(zip(system.agents.parameters, system.state, strict=True)):
        kind.rate(q, x, 0.0, scratch)
        drift[r] = scratch[kind.OUTPUT]
    for level in range(division.FINEST + 1):
        looked_at = work(game.actions, game.constraints_count, game.agents)
        looked_at.division[division.LEVEL] = level
        if _stands(system, drift, h * division.SHARES[level], looked_at):
            return _power(level)
    return None


def _stands(system: System, drift: Array, h: float, looked_at: Work) -> bool:
    """Whether a piece of h seconds would stand if only outputs moved: y' = drift + M^-1 u."""
    problem, mobility = problem_at_start(system), system.agents.mobility
    assert mobility is not None  # the linearised loop is known
    stages = 4 if system.integrator == "rk4" else 1
    point, rates = system.start, []
    for stage in range(stages):
        if not _evaluate(system, point, looked_at):
            return False
        division.note(stage, problem, looked_at)
        limit = limits_at(system, 0.0)
        u = np.clip(law_at(system, point), -limit, limit)
        if not np.all(np.isfinite(u)):
            return False
        rates.append(drift + mobility * u)
        point = system.start + h * (1.0 if stage == 2 or stages == 1 else 0.5) * rates[-1]
    if stages == 4:
        point = system.start + h / 6.0 * (rates[0] + 2.0 * (rates[1] + rates[2]) + rates[3])
    return _evaluate(system, point, looked_at) and (
        division.judge(stages, h, problem, looked_at) < 0
    )


def _evaluate(system: System, y: Array, looked_at: Work) -> bool:
    """Put outputs and constraints where the division looks; False if they are not inside."""
    looked_at.y[:], looked_at.g[:] = y, system.game.constraints(y)
    return bool(np.all(looked_at.g + system.game.margins < 0.0))
