"""What batches keep of each run: one figure, or one for each action or constraint.

Most are what its monitor saw at every step; the others are what signals say that batches keep of
them (``Variable.runs``).
"""

from collections.abc import Iterable
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from gne_mj import kept_apart, run_metrics, signals
from gne_mj.batch_runs import Runs
from gne_mj.plants.agent_type import followed_position
from gne_mj.registry import MODES
from gne_mj.signals import input_unit
from gne_mj.system import System, mode_of
from gne_mj.system.data import SystemData
from gne_mj.system.modes import Figure, Mode
from gne_mj.variables import AXIS, Column, Panel, Variable

if TYPE_CHECKING:
    import pandas

Array = NDArray[Any]


def _where(condition: NDArray[np.bool_], values: Array) -> Array:
    return np.where(condition, values, np.nan)


def _in_each(values: Array, entry: NDArray[np.int64]) -> Array:
    """(runs,) the entry (runs,) of each row."""
    return values[np.arange(len(values)), entry]


def _middle(values: "pandas.Series[float]") -> float:
    """The median, of an even number of runs the lower one; a run that has none is beyond all."""
    return float(np.quantile(values.fillna(np.inf), 0.5, method="inverted_cdf"))


def _agent_out(runs: Runs) -> Array:
    agent = runs.monitors.exit_agent
    return _where(runs.violated & (agent >= 0), 1 + agent)


def _rise(runs: Runs) -> Array:
    """Not a number without a y*, which V is about."""
    rise = runs.seen("storage_rise")
    return rise if runs.system.known_equilibrium is not None else np.full_like(rise, np.nan)


def _status(runs: Runs) -> Array:
    tail = run_metrics.tail_distance(runs.time, runs.distance, runs.duration)
    return run_metrics.status(runs.monitors, tail, runs.tolerance)


def follow(system: SystemData) -> bool:
    """Whether agents have positions that follow their outputs."""
    return followed_position(system.agents.kind) >= 0


def collide(system: SystemData) -> bool:
    """Whether bodies of different agents collide."""
    return system.agents.contacts


def apart(system: SystemData) -> bool:
    """Whether agents keep apart."""
    return system.separation is not None


def guarded(system: SystemData) -> bool:
    """Whether control periods may end early."""
    return system.guarded


def _least_distance(runs: Runs) -> Array:
    """Not a number where no two agents came within reach."""
    least = runs.seen("least_distance")
    return _where(runs.observed & np.isfinite(least), least)


def _held(runs: Runs) -> Array:
    """As a run's own report judges: it rests, and there are pairs that hold it."""
    holding = [
        kept_apart.holding(runs.system, runs.time, y, (status, runs.duration, runs.tolerance))
        for y, status in zip(runs.y, _status(runs), strict=True)
    ]
    return np.array([float(bool(pairs)) for pairs in holding])


def _of_monitor(name: str, entry: str, **about: Any) -> Variable:
    return Variable(name, ("run",), lambda runs: runs.seen(entry), **about)


JUDGED = (
    Variable("status", ("run",), _status, long_name="how the run ended"),
    Variable(
        "least_margin", ("run",),
        lambda runs: _where(runs.observed, -_in_each(runs.worst[0], runs.tightest)),
        long_name="least -g over constraints and integration steps",
        panel=Panel("worst margin", log=True, worst="min"),
        columns=(
            Column("least_margin_min", "worst margin", lambda values: values.min()),
            Column("least_margin_median", "", lambda values: values.median()),
        ),
    ),
    Variable(
        "least_margin_time", ("run",),
        lambda runs: _where(runs.observed, _in_each(runs.worst[1], runs.tightest)), unit="s",
    ),
    Variable(
        "least_margin_constraint", ("run",),
        lambda runs: _where(runs.observed, 1.0 + runs.tightest), long_name="numbered from 1",
    ),
    Variable(
        "margin", ("run", "constraint"), lambda runs: -runs.worst[0],
        long_name="least -g of each constraint",
    ),
    Variable(
        "largest_violation", ("run",), lambda runs: runs.outside.largest,
        long_name="greatest g over constraints and integration steps, 0 if none was positive",
    ),
    Variable(
        "violation_of_bound", ("run",), lambda runs: runs.outside.of_bound,
        long_name="the same as part of the bound",
    ),
    Variable("exits", ("run",), lambda runs: runs.outside.exits, long_name="how often it left"),
    Variable(
        "time_outside", ("run",), lambda runs: runs.outside.duration, unit="s",
        long_name="outside the set, in all, of runs that go on there",
    ),
    Variable(
        "violation_integral", ("run",), lambda runs: runs.outside.integral,
        long_name="integral of the greatest g over the time outside",
    ),
    Variable(
        "last_outside", ("run",), lambda runs: runs.outside.until, unit="s",
        long_name="when it was outside last",
    ),
    Variable(
        "relaxed", ("run",), lambda runs: runs.monitors.relaxed.copy(),
        long_name="evaluations of a law that had to make bounds soft",
    ),
    Variable(
        "settling_time", ("run",), lambda runs: run_metrics.settling_time(runs.time, runs.distance),
        unit="s", long_name="until max |y - y*| stays within 2% of its start",
        panel=Panel("settling time", log=False, worst="max"),
        columns=(  # a run that never settled took longer than any that did
            Column("settling_time_median", "settling (s)", _middle),
            Column("settling_time_max", "", lambda values: values.fillna(np.inf).max()),
            Column("not_settled", "not settled", lambda values: int(values.isna().sum())),
        ),
    ),
    Variable(
        "final_error", ("run",), lambda runs: runs.distance[:, -1],
        unit=lambda system: system.game.action_unit, long_name="max |y - y*| at the end",
        panel=Panel("final error", log=True, worst="max"),
        columns=(  # one that left has no end
            Column("final_error_median", "", _middle),
            Column("final_error_max", "final error", lambda values: values.max()),
        ),
    ),
    Variable(
        "settling_time_to_variational", ("run",),
        lambda runs: run_metrics.settling_time(runs.time, runs.from_variational), unit="s",
        long_name="until max |y - y_v| to the variational equilibrium stays within 2% of its start",
    ),
    Variable(
        "final_error_to_variational", ("run",), lambda runs: runs.from_variational[:, -1],
        unit=lambda system: system.game.action_unit, long_name="max |y - y_v| at the end",
    ),
    Variable(
        "end_time", ("run",), lambda runs: _where(~runs.left, runs.seen("time")), unit="s"
    ),
    Variable(
        "exit_time", ("run",), lambda runs: _where(runs.left, runs.seen("exit_time")),
        unit="s",
    ),
    Variable(
        "exit_constraint", ("run",),
        lambda runs: _where(runs.violated, 1.0 + runs.seen("exit_constraint")),
        long_name="which was violated, numbered from 1",
    ),
    Variable("exit_agent", ("run",), _agent_out, long_name="whose estimates left"),
    Variable(
        "exit_value", ("run",), lambda runs: _where(runs.left, runs.seen("exit_value"))
    ),
    Variable(
        "exit_at_instant", ("run",),
        lambda runs: _where(runs.left, 1.0 - runs.seen("exit_between")),
        long_name="1: seen at a control instant, 0: between two",
    ),
    Variable(
        "peak_input", ("run",), lambda runs: np.max(runs.inputs.peak, axis=1), unit=input_unit,
        columns=(Column("peak_input_max", "", lambda values: values.max()),),
    ),
    Variable(
        "peak_input_time", ("run",),
        lambda runs: _in_each(runs.inputs.peak_time, np.argmax(runs.inputs.peak, axis=1)),
        unit="s",
    ),
    Variable("rms_input", ("run", AXIS), lambda runs: runs.inputs.rms, unit=input_unit),
    Variable(
        "energy", ("run", AXIS), lambda runs: runs.inputs.energy, long_name="integral of u y"
    ),
    Variable(
        "saturated_time", ("run",),
        lambda runs: _where(
            runs.seen("saturated") > 0, runs.seen("saturated_time")
        ),
        unit="s", long_name="when an input limit was first met",
    ),
    Variable(
        "lyapunov_rise", ("run",), _rise, long_name="largest rise of V from one step to the next"
    ),
    _of_monitor("steps", "steps"),
    _of_monitor(
        "positions_outside", "positions_outside", there=follow,
        long_name="observations of positions that follow outputs outside the set",
    ),
    Variable(
        "position_margin", ("run",),
        lambda runs: _where(runs.observed, -runs.seen("positions_worst")), there=follow,
        long_name="least -g at positions that follow outputs",
    ),
    _of_monitor(
        "periods_cut", "cut", there=guarded,
        long_name="control periods that ended early, before they led outside",
    ),
    Variable(
        "shortest_period", ("run",),
        lambda runs: _where(runs.seen("cut") > 0, runs.seen("shortest_period")), there=guarded,
        unit="s", long_name="the shortest of these",
    ),
    _of_monitor(
        "contacts", "contacts", there=collide,
        long_name="contacts between agents, at all steps together",
        panel=Panel("contacts", log=False, worst="max"),
        columns=(Column("contacts", "contacts", lambda each: int(each.sum())),),
    ),
    _of_monitor(
        "too_near", "too_near", there=apart, long_name="observations of two agents too near"
    ),
    Variable(
        "least_distance", ("run",), _least_distance, there=apart, unit="m",
        long_name="least distance of the positions of two agents",
        panel=Panel("least distance", log=False, worst="min"),
        columns=(Column("least_distance_min", "least distance", lambda each: each.min()),),
    ),
    Variable(
        "held", ("run",), _held, there=apart,
        long_name="1: at rest, away from equilibrium, held by separation",
        columns=(Column("held", "held", lambda each: int(each.sum())),),
    ),
)  # fmt: skip


def _of_mode(mode: Mode, figure: Figure) -> Variable:
    """What batches keep of runs in a mode."""
    return Variable(
        figure.name, ("run",), lambda runs: figure.of(runs.monitors),
        there=lambda system: mode_of(system) is mode and mode.reports(system),
        unit=figure.unit, long_name=figure.long_name,
    )  # fmt: skip


def figures() -> list[Variable]:
    """All figures that runs may have, in the order of a batch's dataset."""
    return _with_figures_of(each for each in signals.SIGNALS if isinstance(each, Variable))


def declared_figures(system: System) -> list[Variable]:
    """The figures that a system's runs have."""
    found = _with_figures_of(signals.declared(system))
    return [figure for figure in found if figure.there(system)]


def _with_figures_of(signals: Iterable[Variable]) -> list[Variable]:
    return [
        *JUDGED,
        *(figure for signal in signals for figure in signal.runs),
        *(_of_mode(mode, figure) for mode in MODES for figure in mode.figures),
    ]
