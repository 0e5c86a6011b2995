"""Rules of thumb for the period of an explicit law that is sampled and held.

They are local and necessary at best: a run within them may still leave the set. With M the
agents' effective masses (dy/dt jumps by u/M) and d the distance to a bound delta on a gap,

- one push of the barrier must not throw an agent across: dt < delta M d / (2 rho);
- the sampled linearisation must be stable: all eigenvalues of I - dt M^-1 (d2phi + dF/dy) within
  the unit circle, dt < 2 / lambda_max for real ones.

A gain k multiplies both forces; under partial information a coupling gain adds c times the number
of neighbours to the second.
"""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from gne_mj.bounds import MOST_EXAMINED
from gne_mj.system import System
from gne_mj.theory import spectra

Array = NDArray[np.float64]


def push_period(system: System, y: Array) -> float | None:
    """The first rule at a feasible profile y (m,), for games with bounds on gaps."""
    bounds, inverse = system.game.gap_bounds, system.agents.mobility
    if bounds is None or inverse is None:
        return None
    gaps = np.sqrt(np.maximum(system.game.constraints(y) + bounds**2, 0.0))
    owner = system.game.agent_of_action
    heaviest_push = np.array(
        [np.max(inverse[np.isin(owner, list(members))]) for members in system.game.in_constraint]
    )
    push = 2.0 * system.rho * system.law.gain * heaviest_push
    return float(np.min(bounds * (bounds - gaps) / push))


def linear_period(system: System, y: Array) -> float | None:
    """The second rule at a feasible profile y (m,); of many agents to 1e-4, if lambda is real."""
    inverse = system.agents.mobility
    if inverse is None or system.game.actions > MOST_EXAMINED:
        return None
    game, law = system.game, system.law
    matrix = law.gain * (system.barrier.hessian(y) + game.pseudo_gradient_jacobian(y))
    if law.coupling and law.graph is not None:
        neighbours = law.listeners[game.agent_of_action]
        matrix += law.coupling * np.diag(neighbours)
    values = spectra.eigenvalues(inverse[:, None] * matrix)
    values = values[values.real > 0]
    return float(np.min(2.0 * values.real / np.abs(values) ** 2, initial=np.inf))


def least_rho(system: System, period: float, *, reserve: float = 1.25) -> float:
    """The least penalty whose equilibrium a law that is held for ``period`` s keeps, by the rule.

    Where a bound is active at the variational equilibrium, its distance shrinks with rho and the
    barrier's slope there grows as 1/rho, so that an explicit law needs rho > (multiplier)^2 times
    something of the order of the period. Searched down from the system's start of rho, with a
    reserve of a factor in the period.
    """
    highest = system.rho if system.schedule is None else system.schedule.start

    def kept(rho: float) -> bool:
        there = replace(system, rho=rho, schedule=None)
        known = there.known_equilibrium
        if known is None:
            return False
        longest = linear_period(there, known.action)
        return longest is None or longest >= reserve * period

    low, high = 1e-9, highest
    if kept(low) or not kept(high):
        return low if kept(low) else high
    while high / low > 1.02:
        middle = float(np.sqrt(low * high))
        if kept(middle):
            high = middle
        else:
            low = middle
    return high
