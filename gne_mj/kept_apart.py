"""What a run showed of agents that keep apart: how far, which pairs held it, how it ended."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from gne_mj.loops import monitor as watch
from gne_mj.loops.division import PIECES
from gne_mj.run_metrics import at_rest
from gne_mj.system import System

Pairs = list[tuple[int, int]]
# Pairs of agents that a sentence names
MOST_NAMED = 5


def report(system: System, monitor: Any, pairs: Pairs) -> dict[str, Any] | None:
    """How far apart agents that keep apart were, at every integration step; None of others.

    Args:
        system: that was run.
        monitor: of its loop.
        pairs: of agents, from 0, that hold each other at its end.
    """
    if system.separation is None or not monitor.apart:
        return None
    near = bool(np.isfinite(monitor.least_distance))
    return {
        "distance": system.separation.distance,
        "reach": system.separation.reach,
        "observed": int(monitor.apart),
        "too_near": int(monitor.too_near),
        "least_distance": float(monitor.least_distance) if near else None,
        "agents": [int(monitor.nearest_first) + 1, int(monitor.nearest_second) + 1]
        if near
        else None,
        "time": float(monitor.least_distance_time) if near else None,
        "most_pairs": int(monitor.most_pairs),
        "held_by": [[i + 1, j + 1] for i, j in pairs],
    }


def holding(
    system: System,
    time: NDArray[np.float64],
    action: NDArray[np.float64],
    ended: tuple[str, float, float],
) -> Pairs:
    """The pairs of agents, from 0, that hold each other where a run rests away from equilibrium.

    Args:
        system: that was run.
        time: (samples,) in s.
        action: y (samples, m).
        ended: how, how long the run was meant to last, in s, and the tolerance of ``converged``.

    Returns:
        The hardest pushed ones first; none of a run that arrived, goes on, or has no separation.
    """
    status, duration, tolerance = ended
    if system.separation is None or status != "completed":
        return []
    (still,) = at_rest(time, action[None], duration, tolerance)
    points = action[-1].reshape(system.game.agents, -1)  # at rest positions are outputs
    return system.separation.holding(points, points, system.rho) if still else []


def held_text(pairs: Pairs) -> str:
    """How a run's sentence goes on that rests away from its equilibrium; empty if nothing holds."""
    if not pairs:
        return ""
    return f"; at rest, away from equilibrium: held by the separation of {pairs_text(pairs)}"


def pairs_text(pairs: Pairs) -> str:
    """In words; those behind the first few are counted."""
    shown = [f"agents {i + 1} and {j + 1}" for i, j in pairs[:MOST_NAMED]]
    more = len(pairs) - len(shown)
    return ", ".join(shown) + (f" and {more} pair{'s' * (more > 1)} more" if more else "")


def pair_of(monitor: Any) -> tuple[int, int] | None:
    """The two agents, from 0, that an exit is of; None if it is of something else."""
    first = int(monitor.exit_agent)
    too_near = monitor.exit == watch.TOO_NEAR
    if too_near or (monitor.exit == watch.STEP_TOO_SMALL and first >= 0):
        return first, int(monitor.exit_constraint)
    return None


def exit_text(system: System, monitor: Any, pair: tuple[int, int], at: str) -> str:
    """How two agents did not keep apart, or could not."""
    assert system.separation is not None
    who, value = pairs_text([pair]), float(monitor.exit_value)
    least = system.separation.distance
    between = "line" if system.agents.dimension == 2 else "plane"
    if monitor.exit == watch.STEP_TOO_SMALL:
        return f"1/{PIECES} of the timestep is still too long to keep {who} apart {at}"
    if value < least:
        return f"the positions of {who} were {value:.6g} m apart {at}, less than {least:g} m"
    return (
        f"where {who} are, {value:.6g} m apart, and where they are going no {between} keeps"
        f" {least:g} m between them {at}: their inputs were not those that keep them apart"
    )
