"""Feed-forward: the input under which agents at a moving equilibrium y*(t) stay there.

A law that pulls towards y* alone follows it with a lag. To its input is added that of a *reference*
of each channel, which has the output y*(t): the agent's own equations, solved for the input that
makes its output move so, while its other states follow. Where agents are linear the distance to the
reference then moves as it would about an equilibrium that stands still (docs/moving-problems.md).
"""

from itertools import pairwise
from typing import NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from gne_mj.bounds import check_room
from gne_mj.equilibrium_path import EquilibriumPath
from gne_mj.errors import InvalidInput
from gne_mj.plants import flexible_robot, integrator, pi_cascade
from gne_mj.plants.agents import Agents

Array = NDArray[np.float64]

# Agents whose output moves at once with their input, all else following
FED = (integrator, pi_cascade, flexible_robot)


class Times(Protocol):
    """Of a clock what is needed, in s."""

    @property
    def duration(self) -> float:
        """Of a run."""

    @property
    def timestep(self) -> float:
        """Of an integration step."""

    @property
    def control_period(self) -> float:
        """Of an input that is held."""


class FeedForward(NamedTuple):
    """Inputs over time, straight lines between.

    Attributes:
        input: (times, m), in the input's unit, from t = 0.
        spacing: of the times, in s.
        left: (steps,) how far y* moves in each step, or control period, that they do not.
    """

    input: Array
    spacing: float
    left: Array


def feed_forward(
    path: EquilibriumPath,
    agents: Agents,
    clock: Times,
    *,
    held: bool,
    ahead: bool,
) -> FeedForward:
    """The input to feed forward in a run.

    Args:
        path: where y* is.
        agents: of the types FED; in the held modes integrators.
        clock: of the run.
        held: whether inputs are, for a control period.
        ahead: whether they are asked for by the time of their period's end.

    Raises:
        InvalidInput: y* is not found at some time of the run.
    """
    if held:
        period = clock.control_period
        y = _followed(path, clock, period)
        u = np.diff(y, axis=0) / period
        rows = [u[:1], u] if ahead else [u, u[-1:]]
        return FeedForward(np.concatenate(rows), period, np.zeros(len(u)))
    simple = agents.kind is integrator
    spacing = 0.5 * clock.timestep  # of the stages of Runge-Kutta 4
    y = _followed(path, clock, spacing if simple else 0.5 * spacing)
    slope = _slopes(path, y, spacing if simple else 0.5 * spacing)
    u = slope if simple else _inputs(agents, y, slope, spacing)
    done = clock.timestep / 6.0 * (u[:-2:2] + 4.0 * u[1:-1:2] + u[2::2])
    every = y if simple else y[::2]
    left = np.linalg.norm(np.diff(every[::2], axis=0) - done, axis=1)
    return FeedForward(u, spacing, left)


def _followed(path: EquilibriumPath, clock: Times, spacing: float) -> Array:
    """y* (times, m) at all of a run, so many s apart."""
    steps = int(np.ceil(clock.duration / spacing - 1e-6))
    check_room("timestep", clock.timestep, 4.0 * steps * path.size, "what is fed forward")
    times = np.minimum(spacing * np.arange(steps + 1), clock.duration)
    y = path.actions(times)
    if not np.all(np.isfinite(y)):
        time = times[np.argmin(np.all(np.isfinite(y), axis=1))]
        raise InvalidInput(
            "feed_forward", True, f"the penalised equilibrium at {time:g} s was not found"
        )
    return y


def _slopes(path: EquilibriumPath, y: Array, spacing: float) -> Array:
    """dy*/dt (times, m), between two times at which rates jump by differences of second order."""
    jumps = {round(t / spacing) for t in path.knots}
    cuts = sorted({0, len(y), *(jump for jump in jumps if 2 < jump < len(y) - 3)})
    slopes = np.empty_like(y)
    for first, last in pairwise(cuts):
        piece = y[first : min(last + 1, len(y))]
        if len(piece) < 3:
            slopes[first:last] = (piece[-1] - piece[0]) / (spacing * (len(piece) - 1))
        else:
            found = np.gradient(piece, spacing, axis=0, edge_order=2)
            slopes[first:last] = found[: last - first]
    return slopes


def _inputs(agents: Agents, y: Array, slope: Array, spacing: float) -> Array:
    """The references' inputs, y and its slope being given twice as densely as these."""
    kind, states = agents.kind, agents.equilibrium(y[0])
    output = kind.OUTPUT
    found = np.empty((len(y) // 2 + 1, y.shape[1]))
    rates, driven = np.empty(states.shape[1]), np.empty(states.shape[1])
    for r, q in enumerate(agents.parameters):

        def at(x: Array, k: int, q: Array = q, r: int = r) -> tuple[float, Array]:
            """The input at the k-th time, and the rates of the states under it."""
            x[output] = y[k, r]
            kind.rate(q, x, 0.0, rates)
            kind.rate(q, x, 1.0, driven)
            u = (slope[k, r] - rates[output]) / (driven[output] - rates[output])
            return u, rates + u * (driven - rates)

        x = states[r].copy()
        for k in range(len(found) - 1):
            found[k, r], first = at(x, 2 * k)
            _, second = at(x + 0.5 * spacing * first, 2 * k + 1)
            _, third = at(x + 0.5 * spacing * second, 2 * k + 1)
            _, fourth = at(x + spacing * third, 2 * k + 2)
            x = x + spacing / 6.0 * (first + 2.0 * second + 2.0 * third + fourth)
        found[-1, r], _ = at(x, len(y) - 1)
    return found
