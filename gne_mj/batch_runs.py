"""Runs of one system side by side: what figures of batches are taken from."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gne_mj import outside, run_metrics
from gne_mj.loops import monitor as watch
from gne_mj.loops.base import Samples
from gne_mj.system import System
from gne_mj.variables import Rows, changed

Array = NDArray[Any]


@dataclass(frozen=True)
class Runs:
    """What sources of figures are given: runs of one system side by side.

    Attributes:
        system: what was run.
        duration: how long the runs were meant to last, in s.
        tolerance: of the status ``converged``.
        time: (rows,) sample times in s.
        samples: of shapes (runs, rows, ...).
        monitors: (runs, :func:`gne_mj.loops.monitor.length`).
    """

    system: System
    duration: float
    tolerance: float
    time: NDArray[np.float64]
    samples: Samples
    monitors: Any

    def of(self, source: Callable[[Rows], Array]) -> Array:
        """(runs, rows, ...) the values of a signal's source."""
        return self.in_rows(source(self.flat))

    def in_rows(self, values: Array) -> Array:
        """Values of all samples (runs * rows, ...) as (runs, rows, ...)."""
        return values.reshape(len(self.monitors), len(self.time), *values.shape[1:])

    @cached_property
    def flat(self) -> Rows:
        """The samples of all runs one after the other."""
        count = len(self.monitors)
        flat = changed(self.samples, lambda c: c.reshape(count * len(self.time), *c.shape[2:]))
        return Rows(self.system, np.tile(self.time, count), flat)

    def thinned(self, rows: NDArray[np.int64]) -> "Runs":
        """These rows only."""
        return Runs(
            self.system, self.duration, self.tolerance, self.time[rows],
            changed(self.samples, lambda column: column[:, rows]), self.monitors,
        )  # fmt: skip

    @cached_property
    def y(self) -> NDArray[np.float64]:
        """(runs, rows, m) outputs."""
        return self.samples.state[:, :, :, self.system.agents.kind.OUTPUT]

    @cached_property
    def equilibrium(self) -> NDArray[np.float64]:
        """(m,) y*, of a game that moves that of the end; not a number where it is not known."""
        return self.system.equilibria(self.time[-1:])[0]

    @cached_property
    def distance(self) -> NDArray[np.float64]:
        """(runs, rows) max |y - y*|."""
        greatest: NDArray[np.float64] = np.max(
            np.abs(self.y - self.system.equilibria(self.time)), axis=2
        )
        return greatest

    @cached_property
    def from_variational(self) -> NDArray[np.float64]:
        """(runs, rows) max |y - y_v| to the variational equilibrium; not a number where that is not
        known, and of games that move."""
        found = self.system.variational
        if found is None:
            return np.full(self.y.shape[:2], np.nan)
        greatest: NDArray[np.float64] = np.max(np.abs(self.y - found.action), axis=2)
        return greatest

    @cached_property
    def outside(self) -> outside.Outside:
        """How far, how often and how long outside the set."""
        return outside.seen(self.system.game, self.monitors)

    @cached_property
    def worst(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """(runs, p) each constraint's greatest g, and when in s."""
        return run_metrics.worst_constraints(self.monitors)

    @cached_property
    def tightest(self) -> NDArray[np.int64]:
        """(runs,) the constraint that was nearest to its bound, or farthest beyond."""
        return np.argmax(self.worst[0], axis=1)

    @cached_property
    def inputs(self) -> run_metrics.Inputs:
        """What actuators had to deliver."""
        return run_metrics.inputs(self.monitors)

    def seen(self, name: str) -> NDArray[np.float64]:
        """(runs,) a number of the monitors."""
        found: NDArray[np.float64] = self.monitors[name].copy()
        return found

    @property
    def observed(self) -> NDArray[np.bool_]:
        """(runs,) whether anything was seen at all."""
        return self.monitors.started > 0

    @property
    def left(self) -> NDArray[np.bool_]:
        """(runs,) whether a run ended early."""
        return self.monitors.exit != watch.INSIDE

    @property
    def violated(self) -> NDArray[np.bool_]:
        """(runs,) whether a run ended early at a constraint that is known."""
        exits = self.monitors.exit
        of_pairs = (exits == watch.STEP_TOO_SMALL) & (self.monitors.exit_agent >= 0)
        return self.left & (exits != watch.DIVERGED) & (exits != watch.TOO_NEAR) & ~of_pairs
