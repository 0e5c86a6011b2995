"""How far runs are from an equilibrium that moves, beside what is certain of that distance.

With W the storage's root, W^2 = sum of e'Pe over agents whose V = e'Pe/2, e = x - x*(t),

    dW/dt <= -r W + c |dy*/dt|,   |y - y*| <= b W

(docs/moving-problems.md): r is half the rate of V's decay, of integrators mu itself, and in mode
implicit W falls by 1/(1 + mu T) in a period T instead. The rate |dy*/dt| is computed at every
sample time and knot, both sides of it; between two times the greater one is taken, and where y*
has moved farther than that, it has jumped by the rest.
"""

from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from gne_mj.motion import motion_of
from gne_mj.plants import integrator, pi_cascade
from gne_mj.system import Clock, System, mode_of
from gne_mj.theory.constants import Slopes
from gne_mj.theory.gain import decay_rate

Array = NDArray[np.float64]

ROUNDING = 1e-6  # of a bound, by which the integrator's error may exceed it


class Decay(NamedTuple):
    """What is certain of W, see the module."""

    rate: float  # r in 1/s
    harm: float  # c
    share: float  # b
    start: float  # W(0)


def report(
    system: System,
    time: Array,
    action: Array,
    clock: Clock | None,
    spoilt: str = "",
) -> dict[str, Any] | None:
    """The section ``tracking`` of a run's report; None where neither game nor penalty move.

    Args:
        system: what was run.
        time: sample times (samples,) in s.
        action: y there (samples, m).
        clock: of the run; without one nothing is certain of held inputs and what is fed forward.
        spoilt: what happened in the run so that nothing is certain of it, in words.
    """
    if not system.moves:
        return None
    distance = np.linalg.norm(action - system.path.actions(time), axis=1)
    if np.any(np.isnan(distance)):
        return None
    knots = () if (motion := motion_of(system.game)) is None else motion.knots
    grid = np.unique([*time, *(t for t in knots if time[0] < t < time[-1])])
    points = [system.path.at(t) for t in grid]
    mu = _monotonicity(system, grid)
    why = spoilt or _why_not(system, time, mu, clock)
    bound = None
    if mu is not None and not why:
        bound = _bound(system, time, grid, mu, clock)
    worst = int(np.argmax(distance))
    rates = np.array([point.rate for point in points])
    found: dict[str, Any] = {
        "game": motion is not None,
        "penalty": system.schedule is not None,
        "feed_forward": system.feed_forward,
        "unit": system.game.action_unit,
        "largest_distance": float(distance[worst]),
        "largest_distance_time": float(time[worst]),
        "final_distance": float(distance[-1]),
        "largest_rate": float(np.nanmax(rates, initial=0.0)),
        "largest_rate_bound": None,
        "largest_bound": None,
        "final_bound": None,
        "within": None,
        "not_known": why or None,
    }
    if mu is not None and np.all(mu > 0.0):
        pushes = np.array([point.push for point in points]) / mu
        found["largest_rate_bound"] = float(np.nanmax(pushes, initial=0.0))
    if bound is not None:
        found["largest_bound"] = float(np.max(bound))
        found["final_bound"] = float(bound[-1])
        found["within"] = bool(np.all(distance <= bound * (1.0 + ROUNDING) + ROUNDING))
    return found


def _why_not(system: System, time: Array, mu: Array | None, clock: Clock | None) -> str:
    """Why no bound is certain; empty if one is."""
    kind, mode = system.agents.kind, mode_of(system)
    if kind not in (integrator, pi_cascade):
        return f"{kind.NAME}s take inertia or a spring along, and no rate of decay is known"
    if system.law.information != "full" or system.decentralised:
        return "it is known under full information, all agents' inputs together"
    if system.faults or system.separation is not None or system.game.private:
        return "faults, separation and private constraints are no part of it"
    if mu is None:
        return "of an F that is not affine dF/dy moves too, and mu is not known at all times"
    if not np.all(mu > 0.0):
        return "F is not strongly monotone at all times"
    if system.feed_forward and (kind is not integrator or clock is None):
        return "with an input fed forward it is known of integrators"
    if not mode.held:
        return ""
    if not mode.promises or kind is not integrator or clock is None:
        return "with a held input it is known of integrators in mode implicit"
    period = clock.control_period
    if np.any(np.abs(time / period - np.round(time / period)) > 1e-6):
        return "samples are not at control instants"
    return ""


def _monotonicity(system: System, grid: Array) -> Array | None:
    """mu at each time, where it is certain."""
    game = system.game
    if motion_of(game) is None:
        constant = Slopes(game, game.box, system.start, feasible=True).mu
        return np.full(len(grid), constant.value) if constant.certified else None
    if not game.affine:
        return None
    known: dict[bytes, float] = {}
    found = []
    for time in grid:
        slope = system.game_at(time).pseudo_gradient_jacobian(system.start)
        name = slope.tobytes()
        if name not in known:
            known[name] = float(np.linalg.eigvalsh(0.5 * (slope + slope.T))[0])
        found.append(known[name])
    return np.array(found)


def _bound(system: System, time: Array, grid: Array, mu: Array, clock: Clock | None) -> Array:
    """|y - y*| is at most this at sample times (samples,), which are among those of ``grid``."""
    path, held, moves = system.path, mode_of(system).held, motion_of(system.game) is not None
    rates = np.array([path.at(t).rate for t in grid])
    pushes = np.array([path.at(t).push for t in grid]) / mu
    rates = np.where(np.isnan(rates), pushes, rates)
    moved = np.linalg.norm(np.diff(path.actions(grid), axis=0), axis=1)
    decay = _decay(system, float(np.min(mu)), path.actions(grid[:1])[0])
    found, ends = [decay.start], np.searchsorted(grid, time)
    for first, last in pairwise(ends.tolist()):
        length, between = grid[last] - grid[first], slice(first, last + 1)
        speed, rate = np.max(rates[between]), decay.rate
        jumps = np.sum(np.maximum(0.0, moved[first:last] - speed * np.diff(grid[between])))
        left, late = np.exp(-rate * length), 1.0
        if held:
            assert clock is not None
            period, rate = clock.control_period, np.min(mu[between])
            left = (1.0 + rate * period) ** -round(length / period)
            # a penalty that falls, without an input fed forward, is that of the period's start
            late = 1.0 if moves or system.feed_forward else 1.0 + rate * period
        behind = decay.harm * (late * speed * (1.0 - left) / rate + jumps)
        if system.feed_forward:
            assert clock is not None
            step = clock.control_period if held else clock.timestep
            steps = slice(round(grid[first] / step), round(grid[last] / step))
            behind = float(np.sum(system.fed(clock).left[steps]))
        found.append(left * found[-1] + behind)
    return decay.share * np.array(found)


def _decay(system: System, mu: float, y: Array) -> Decay:
    """Of agents whose storage is e'Pe/2 exactly."""
    agents = system.agents
    storage, dissipation = agents.kind.energy_balance(agents.parameters)
    rest = agents.equilibrium(y)
    along = agents.equilibrium(y + 1.0) - rest  # pi is linear
    error = system.state - rest
    output = agents.kind.OUTPUT
    return Decay(
        0.5 * decay_rate(storage, dissipation, output, mu),
        float(np.sqrt(np.max(np.einsum("rs,rst,rt->r", along, storage, along)))),
        float(np.sqrt(np.max(np.linalg.inv(storage)[:, output, output]))),
        float(np.sqrt(np.sum(np.einsum("rs,rst,rt->r", error, storage, error)))),
    )
