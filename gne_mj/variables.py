"""What a variable of a run is: its name, unit, source and where it is shown.

Those that there are stand in :mod:`gne_mj.signals`, and batches' figures of runs in
:mod:`gne_mj.batch_variables`.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING, Any, Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from gne_mj.loops.base import Samples
from gne_mj.system.data import SystemData

if TYPE_CHECKING:
    import pandas

Array = NDArray[Any]
# name -> (dimensions, values, attributes), as xarray takes them
Labelled = dict[str, tuple[tuple[str, ...], Array, dict[str, str]]]
Text = str | Callable[[SystemData], str]

AXIS = "agent or action"  # in place of the dimension of actions, see axis_of


class Panel(NamedTuple):
    """A panel of a batch's figure."""

    title: str
    log: bool  # the axis, where values look spaced in proportion
    worst: Literal["min", "max"]  # of the runs


class Column(NamedTuple):
    """A column of a batch's table of combinations."""

    name: str
    title: str  # in the table on the terminal; empty if it is not there
    of: Callable[["pandas.Series[float]"], float]  # of the runs' values; infinite if there is none


@dataclass(frozen=True, eq=False)
class Variable:
    """One signal of a run, or one figure that batches keep of each run.

    Args:
        name: in datasets, packs and tables.
        dimensions: "time" first if it is sampled, "run" first if it is a figure of runs; AXIS
            stands for one entry for each action.
        source: the values, from :class:`Rows` or, of a figure, from
            :class:`gne_mj.batch_runs.Runs`; their shape is that of the dimensions.
        there: whether a system has it.
        unit, long_name: for every reader; None writes no such attribute, "" an empty one.
        symbol: its formula in TeX, likewise.
        more: further attributes, by name.
        bounds: arrays by the variables' names NAME_bound and NAME_lower_bound, without the time.
        instant: whether state and memory say it, so that a live page has it at any moment; of
            others it has what was recorded last.
        figure: whether figures of a trajectory draw it.
        page: where the page has it: a "line" of a plot; the "bound" of one, that moves;
            "estimates", drawn over agents; "behind" it, for places of bodies and margins; nowhere.
        batch: whether batches that record rows have it in them.
        runs: figures that batches keep of it.
        panel: of a figure of runs, its panel in a batch's figure.
        columns: of a figure of runs, what the table of combinations has of it.
    """

    name: str
    dimensions: tuple[str, ...]
    source: Callable[[Any], Array]
    there: Callable[[SystemData], bool] = lambda system: True
    unit: Text | None = None
    long_name: Text | None = None
    symbol: str | None = None
    more: Mapping[str, str] = field(default_factory=dict)
    bounds: Callable[[SystemData], Mapping[str, Array]] = lambda system: {}
    instant: bool = True
    figure: bool = False
    page: Literal["", "line", "bound", "estimates", "behind"] = ""
    batch: bool = True
    runs: tuple["Variable", ...] = ()
    panel: Panel | None = None
    columns: tuple[Column, ...] = ()

    def dims(self, system: SystemData) -> tuple[str, ...]:
        """The dimensions in a system's dataset."""
        return tuple(axis_of(system) if d == AXIS else d for d in self.dimensions)

    def attributes(self, system: SystemData) -> dict[str, str]:
        """Units, long_name, symbol and what else is said, those there are."""
        given: dict[str, Text | None] = {
            "units": self.unit, "long_name": self.long_name, "symbol": self.symbol, **self.more
        }  # fmt: skip
        return {
            key: text(system) if callable(text) else text
            for key, text in given.items()
            if text is not None
        }


@dataclass(frozen=True)
class Rows:
    """What sources are given: samples of one system.

    Attributes:
        system: with the numbers that it had.
        time: (samples,) in s.
        samples: at these times.
    """

    system: SystemData
    time: NDArray[np.float64]
    samples: Samples

    @cached_property
    def y(self) -> NDArray[np.float64]:
        """(samples, m) outputs, which are the actions."""
        return self.samples.state[:, :, self.system.agents.kind.OUTPUT]


def changed(samples: Samples, change: Callable[[Array], Array]) -> Samples:
    """The same of every column."""
    return Samples(*(change(column) for column in samples))


def axis_of(system: SystemData) -> str:
    """The dimension of actions: agents, where each has one."""
    return "agent" if system.game.actions == system.game.agents else "action"


def labelled(variables: list[Variable], rows: Rows) -> Labelled:
    """These variables and their bounds."""
    system, found = rows.system, {}
    for variable in variables:
        dimensions, attributes = variable.dims(system), variable.attributes(system)
        found[variable.name] = (dimensions, variable.source(rows), attributes)
        units = {key: text for key, text in attributes.items() if key == "units"}
        for name, bound in variable.bounds(system).items():
            found[name] = (tuple(d for d in dimensions if d != "time"), bound, units)
    return found
