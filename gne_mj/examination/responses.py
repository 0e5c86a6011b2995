"""How a robot's outputs rise with its inputs: over which periods, at which states, how soon."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gne_mj.examination.bench import Bench

Array = NDArray[np.float64]
HORIZONS = (0.002, 0.005, 0.01, 0.02, 0.05, 0.1, 0.15, 0.2, 0.3)  # s
LEADS = (4, 8, 16)  # steps after which the first response is looked at
FINER = (1.0, 0.25)  # of the step: the relative degree must be the same with both
LATEST = 1.0  # s in which an input must show


@dataclass(frozen=True)
class Slopes:
    """dy+/du over some periods, of all states that were tried.

    Args:
        periods: in s.
        least: of each period the least eigenvalue of its symmetric part, over all states.
        most: likewise the greatest.
        positive: of each period the share of states at which it is positive.
        states: how many.
        coupling: greatest share that one channel's input has in another one's output.
    """

    periods: list[float]
    least: list[float]
    most: list[float]
    positive: list[float]
    states: int
    coupling: float

    def rising(self, lags: bool) -> list[float]:
        """The periods in s over which they are positive at all states, up to the first where they
        are not; none for none.

        Args:
            lags: whether the relative degree is more than 1: over short periods hardly anything is
                seen then, and the shortest need not be among them.
        """
        good = [least > 0.0 for least in self.least]
        first = good.index(True) if lags and any(good) else 0
        end = next((k for k in range(first, len(good)) if not good[k]), len(good))
        return self.periods[first:end]


def slopes(bench: Bench, states: Sequence[tuple[Array, Array]], change: Array) -> Slopes:
    """By differences about the inputs u of (state, u) pairs.

    Args:
        change: (d,) of inputs to either side.
    """
    at = sorted({bench.steps(each) for each in HORIZONS})
    d, rows = bench.channels, []
    for state, u in states:
        matrix = np.empty((len(at), d, d))
        for axis in range(d):
            part = np.where(np.arange(d) == axis, change, 0.0)
            up, down = (bench.course(state, u + sign * part, at) for sign in (1.0, -1.0))
            matrix[:, :, axis] = (up - down) / (2.0 * change[axis])
        rows.append(matrix)
    found = np.array(rows)  # (states, periods, d, d)
    symmetric = 0.5 * (found + np.swapaxes(found, 2, 3))
    finite = np.all(np.isfinite(symmetric), axis=(2, 3))
    values = np.linalg.eigvalsh(np.where(finite[..., None, None], symmetric, 0.0))
    values[~finite] = -np.inf
    least, most = values[..., 0], values[..., -1]
    off = found[:, 0] - found[:, 0] * np.eye(d)
    size = np.max(np.abs(found[:, 0]), axis=(1, 2))
    shares = np.divide(np.max(np.abs(off), axis=(1, 2)), size, out=np.zeros(len(size)),
                       where=size > 0)  # fmt: skip
    return Slopes(
        [steps * bench.plant.timestep for steps in at],
        least.min(axis=0).tolist(), most.max(axis=0).tolist(), (least > 0).mean(axis=0).tolist(),
        len(found), float(shares.max()),
    )  # fmt: skip


def lag(degrees: Sequence[int | None]) -> bool:
    """Whether a relative degree is more than 1, or none is known."""
    return max((each for each in degrees if each is not None), default=2) > 1


def relative_degrees(bench: Bench, state: Array, u: Array, change: Array) -> list[int | None]:
    """Of each channel after how many integrations its input shows; None for never, or too late.

    A response that begins like t^r has degree r: read off its growth from some first steps to twice
    as many, with two steps of which one is four times as fine. Where they differ, the finer tells.
    """
    own = bench.plant.timestep
    found: list[int | None] = []
    for axis in range(bench.channels):
        part = np.where(np.arange(bench.channels) == axis, change, 0.0)
        degree = None
        for share in FINER:
            bench.plant.model.opt.timestep = share * own
            moved = [
                (bench.course(state, u + part, LEADS) - bench.course(state, u - part, LEADS))[
                    :, axis
                ]
            ][0]
            degree = _degree(np.abs(moved), change[axis])
        bench.plant.model.opt.timestep = own
        found.append(degree)
    return found


def _degree(moved: Array, change: float) -> int | None:
    if not np.all(moved > 1e-14 * max(1.0, change)):
        return None
    return max(1, round(float(np.log2(moved[2] / moved[1]))))


def dead_time(bench: Bench, state: Array, u: Array, change: Array) -> float | None:
    """s after which an input shows in its own output at all, in every channel; None for never."""
    at = [bench.steps(share * LATEST) for share in np.linspace(0.02, 1.0, 50)]
    late = 0.0
    for axis in range(bench.channels):
        part = np.where(np.arange(bench.channels) == axis, change, 0.0)
        moved = bench.course(state, u + part, at) - bench.course(state, u - part, at)
        shown = np.flatnonzero(np.abs(moved[:, axis]) > 1e-14 * max(1.0, change[axis]))
        if not len(shown):
            return None
        late = max(late, at[shown[0]] * bench.plant.timestep)
    return late
