"""How far, how long and how often runs were outside the set, the same of every run and law.

A run that ends where it leaves the set was outside for no time; one that goes on there
(``simulation.on_exit = "continue"``, :mod:`gne_mj.loops.outside`) has all figures. Rows are runs.
"""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from gne_mj import run_metrics
from gne_mj.game_model import Game
from gne_mj.loops import monitor as watch
from gne_mj.motion import motion_of

Array = NDArray[np.float64]


class Outside(NamedTuple):
    """Each (runs,); times in s, not a number where a run was never outside."""

    largest: Array  # the greatest max_l g_l, 0 if no g was positive, in the unit of g
    of_bound: Array  # the same as part of the bound, see :func:`parts_of_bounds`
    exits: Array  # how often it went outside
    first: Array
    duration: Array  # outside, in all
    integral: Array  # of max_l g_l over that time
    until: Array  # when it was outside last


def parts_of_bounds(game: Game, g: Array) -> Array:
    """How far constraints' values (..., p) are beyond bounds, as part of the bound; 0.1 is 10%.

    Of a bound on a gap it is the gap's; else g over |g(0)|, which is |b| of a y <= b. Not a number
    of constraints that have no such bound (as y >= 0), and of games that move.
    """
    bounds = game.gap_bounds
    if motion_of(game) is not None:
        return np.full(g.shape, np.nan)
    if bounds is not None:
        return np.asarray(np.sqrt(np.maximum(g + bounds**2, 0.0)) / bounds - 1.0)
    with np.errstate(all="ignore"):
        bound = np.abs(game.constraints(np.zeros(game.actions)))
        known = np.isfinite(bound) & (bound > 0.0)
        return np.where(known, g / np.where(known, bound, 1.0), np.nan)


def seen(game: Game, monitors: Any) -> Outside:
    """What monitors (runs,) have seen of it."""
    worst, _ = run_metrics.worst_constraints(monitors)
    parts = parts_of_bounds(game, worst)
    known = ~np.all(np.isnan(parts), axis=1)
    of_bound = np.full(len(worst), np.nan)
    of_bound[known] = np.maximum(np.nanmax(parts[known], axis=1), 0.0)
    went, left = monitors.exits > 0, monitors.exit == watch.LEFT_SET
    first = np.where(went, monitors.outside_first, np.where(left, monitors.exit_time, np.nan))
    until = np.where(left, monitors.exit_time, np.where(went, monitors.outside_time, np.nan))
    return Outside(
        np.maximum(np.max(worst, axis=1), 0.0), of_bound, monitors.exits + left, first,
        monitors.outside_for.copy(), monitors.outside_integral.copy(), until,
    )  # fmt: skip


def report(game: Game, monitor: Any, goes_on: bool) -> dict[str, Any]:
    """The section of one run's certificate: numbers for JSON, None where a figure has no meaning.

    Args:
        game: which was played.
        monitor: of the run.
        goes_on: whether it goes on where it leaves.
    """
    one = watch.together([monitor])
    worst, when = (each[0] for each in run_metrics.worst_constraints(one))
    found = {name: float(values[0]) for name, values in seen(game, one)._asdict().items()}
    index = int(np.argmax(worst))
    told = {name: None if np.isnan(value) else value for name, value in found.items()}
    was = found["exits"] > 0
    return {
        "goes_on": goes_on,
        **told,
        "exits": int(found["exits"]),
        "constraint": game.constraint_names[index] if was else None,
        "time": float(when[index]) if was else None,
        "relaxed": int(monitor.relaxed),
        "at_end": bool(was and found["until"] >= monitor.time),
    }


def sentence(game: Game, monitor: Any, end: float) -> str:
    """How a run went that was outside and came to its end."""
    seen = report(game, monitor, True)
    first = game.constraint_names[int(monitor.outside_constraint)]
    times = f"{seen['exits']} time{'s' * (seen['exits'] != 1)}"
    last = "and at its end" if seen["at_end"] else f"last at {seen['until']:.6g} s"
    return (
        f"ran its {end:g} s, but outside the set for {seen['duration']:.4g} s of them ({times},"
        f" first by constraint '{first}' at {seen['first']:.6g} s, {last}); at most g ="
        f" {seen['largest']:.6g}, constraint '{seen['constraint']}' at {seen['time']:.6g} s"
    )
