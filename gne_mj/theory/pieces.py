"""How finely the steps of mode continuous will have to be divided, at the start and at y*."""

from dataclasses import dataclass

import numpy as np

from gne_mj.loops import division
from gne_mj.loops import monitor as watch
from gne_mj.plain import raise_pending
from gne_mj.run_metrics import EXITS
from gne_mj.system import Clock, System, mode_of
from gne_mj.system.steps import STABLE
from gne_mj.theory.periods import linear_period


@dataclass(frozen=True)
class Pieces:
    """Into how many pieces a step is divided: a power of two up to ``finest``, None for more.

    Attributes:
        start: the finest of the first step, by taking it; None too if that cannot be taken.
        equilibrium: at y*, so that the linearised loop is stable under the integrator.
        finest: beyond which no run goes.
        ends: the status with which the first step ends the run; None if it does not.
    """

    start: int | None
    equilibrium: int | None
    finest: int = division.PIECES
    ends: str | None = None


def forecast(system: System, clock: Clock) -> Pieces | None:
    """Of a system with fixed steps in mode continuous.

    None of others, of MJCF robots, and where y* is not known.
    """
    known = system.known_equilibrium
    if not mode_of(system).divides(system) or known is None:
        return None
    longest = linear_period(system, known.action)
    if longest is None:
        return None
    share = 2.0 * clock.timestep / (STABLE[system.integrator] * longest)  # 0: no mode decays
    level = 0 if share <= 1.0 else int(np.ceil(np.log2(share)))
    start, ends = _at_start(system, clock)
    return Pieces(start, 1 << level if level <= division.FINEST else None, ends=ends)


def _at_start(system: System, clock: Clock) -> tuple[int | None, str | None]:
    """As a run does, since it is one, of a single step."""
    loop = system.closed_loop(clock)
    loop.advance(1, 1)
    raise_pending()
    if loop.monitor.exit != watch.INSIDE:
        return None, EXITS[int(loop.monitor.exit)]
    smallest = loop.monitor.smallest_step
    return 1 if smallest == 0.0 else round(clock.timestep / float(smallest)), None
