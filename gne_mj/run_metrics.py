"""How runs are judged by what their monitors and samples say; one rule for one run and for many.

Arrays have a row for each run. A single run's certificate is made by the same rules as a batch's
figures.
"""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from gne_mj.game_model import Game
from gne_mj.loops import monitor as watch

SUCCESSES = ("converged", "completed")
WENT_OUTSIDE = "went_outside"  # of runs that go on where they leave, and have come to their end
EXITS = {
    watch.LEFT_SET: "left_feasible_set",
    watch.ESTIMATE_LEFT: "estimate_left_feasible_set",
    watch.DIVERGED: "diverged",
    watch.STEP_TOO_SMALL: "step_too_small",
    watch.FORCES_LOST: "forces_left_out",
    watch.TOO_NEAR: "too_near",
    watch.FORESEEN: "exit_foreseen",
    watch.MOVED_PAST: "bound_moved_past",
}
STATUS = "<U28"  # dtype that holds every status, infeasible_start too
SETTLED = 0.02  # of the initial distance
TAIL = 0.05  # of the run, over which "converged" must hold


class Inputs(NamedTuple):
    """What actuators had to deliver, each (runs, m), in the input's unit."""

    peak: NDArray[np.float64]  # of what the law asked for
    peak_time: NDArray[np.float64]  # s
    rms: NDArray[np.float64]
    energy: NDArray[np.float64]  # integral of u y


def status(monitors: Any, tail: NDArray[np.float64], tolerance: float) -> NDArray[np.str_]:
    """(runs,) how each run ended, having run its time or left.

    Args:
        monitors: (runs,), see :func:`gne_mj.loops.monitor.fresh`.
        tail: (runs,) greatest distance over the last part, see :func:`tail_distance`.
        tolerance: of ``converged``.
    """
    found = np.where(tail <= tolerance, "converged", "completed").astype(STATUS)
    found[monitors.exits > 0] = WENT_OUTSIDE
    for code, name in EXITS.items():
        found[monitors.exit == code] = name
    return found


def tail_distance(
    time: NDArray[np.float64], distance: NDArray[np.float64], duration: float
) -> NDArray[np.float64]:
    """(runs,) greatest distance over the last part of the run.

    Args:
        time: (samples,) in s.
        distance: (runs, samples) max |y - y*|.
        duration: how long the run was meant to last, in s.
    """
    greatest: NDArray[np.float64] = np.max(
        distance[:, time >= time[-1] - TAIL * duration - 1e-9], axis=1
    )
    return greatest


def at_rest(
    time: NDArray[np.float64], action: NDArray[np.float64], duration: float, tolerance: float
) -> NDArray[np.bool_]:
    """(runs,) whether outputs move by no more than a tolerance over the last part of the run.

    Args:
        time: (samples,) in s.
        action: (runs, samples, m) outputs.
        duration: how long the run was meant to last, in s.
        tolerance: in the outputs' unit.
    """
    moved = np.max(np.abs(action - action[:, -1:]), axis=2)
    still: NDArray[np.bool_] = tail_distance(time, moved, duration) <= tolerance
    return still


def settling_time(time: NDArray[np.float64], distance: NDArray[np.float64]) -> NDArray[np.float64]:
    """(runs,) first sample time in s after which the distance (runs, samples) stays within 2% of
    its start; not a number where a run has not settled."""
    outside = ~(distance <= SETTLED * distance[:, :1])
    last = outside.shape[1] - 1 - np.argmax(outside[:, ::-1], axis=1)
    last = np.where(outside.any(axis=1), last, -1)
    return np.append(time, np.nan)[last + 1]


def check_numbers(game: Game, monitor: Any, y: NDArray[np.float64], reach: float) -> None:
    """Where a run ended since something is no longer a number, see whether the game is why.

    Args:
        game: which was played.
        monitor: the run's.
        y: (m,) outputs at the start of the step in which it ended.
        reach: about how far they go in the step with an input of one; profiles on the way are
            looked at too, since a later stage of the step may have been the first to notice.

    Raises:
        UserCodeError: a function of the game raises there, or returns what is not a number.
    """
    if monitor.exit != watch.DIVERGED or not np.all(np.isfinite(y)):
        return
    push = np.nan_to_num(monitor.last_u, posinf=0.0, neginf=0.0)
    for share in (0.0, 0.5, 1.0):
        game.check_numbers(y + share * reach * push)


def worst_constraints(monitors: Any) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Each constraint's greatest g and when in s, both (runs, p), that at an exit included.

    Of a run in which nothing was observed it is minus infinity.
    """
    # by item, which costs a part of what attributes of such arrays do: pages ask at every frame
    worst, when = monitors["worst"].copy(), monitors["worst_time"].copy()
    worst[monitors["started"] == 0.0] = -np.inf
    for run in np.flatnonzero(monitors["exit"] == watch.LEFT_SET).tolist():
        index, value = int(monitors["exit_constraint"][run]), monitors["exit_value"][run]
        if value > worst[run, index]:
            worst[run, index], when[run, index] = value, monitors["exit_time"][run]
    return worst, when


def inputs(monitors: Any) -> Inputs:
    """What actuators had to deliver in each run."""
    square, elapsed = monitors.square, monitors.time[:, None]
    rms = np.sqrt(np.divide(square, elapsed, out=np.zeros_like(square), where=elapsed > 0))
    return Inputs(monitors.peak, monitors.peak_time, rms, monitors.energy)
