"""What is kept of every run of a batch: figures from its monitor and rows, and rows themselves."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from gne_mj import run_metrics
from gne_mj.batch_runs import Runs
from gne_mj.batch_variables import declared_figures
from gne_mj.batches.plan import Combination
from gne_mj.errors import InfeasibleStart
from gne_mj.loops.batch import Outcome, Span
from gne_mj.signals import declared
from gne_mj.variables import Labelled, labelled


def columns_of(combination: Combination, span: Span, outcome: Outcome, record: int) -> Labelled:
    """The variables of runs of one combination; their first dimension is always "run".

    Args:
        combination: whose.
        span: of the runs.
        outcome: what they showed.
        record: every which row is kept; 0 for none. The last one always is.

    Raises:
        UserCodeError: a run ended since a function of the user's game returned no number.
    """
    system, clock = combination.system, combination.clock
    assert system is not None
    runs = Runs(
        system, clock.duration, combination.scenario.simulation.tolerance,
        times(combination, span), outcome.samples, outcome.monitors,
    )  # fmt: skip
    for monitor, last in zip(runs.monitors, runs.y[:, -1], strict=True):
        run_metrics.check_numbers(system.game, monitor, last, clock.timestep)
    found = {
        figure.name: (figure.dims(system), figure.source(runs), figure.attributes(system))
        for figure in declared_figures(system)
    }
    return found | (_recorded(runs.thinned(kept(span, record))) if record else {})


def refused_columns(runs: int) -> Labelled:
    """Of runs that cannot begin, since their start is not inside."""
    return {
        "status": (("run",), np.full(runs, InfeasibleStart.status, dtype=run_metrics.STATUS), {})
    }


def span_of(combination: Combination) -> Span:
    """How long a combination's runs are, and when they are sampled."""
    clock = combination.clock
    return Span(clock.steps(clock.duration), clock.steps(clock.sample_period))


def times(combination: Combination, span: Span) -> NDArray[np.float64]:
    """(rows,) sample times in s."""
    steps = np.append(span.every * np.arange(span.rows - 1, dtype=np.float64), span.steps)
    return steps * combination.clock.timestep


def kept(span: Span, record: int) -> NDArray[np.int64]:
    """Which rows are recorded: every so many, and the last."""
    return np.unique(np.append(np.arange(0, span.rows, record), span.rows - 1))


def rearranged(variables: Labelled, order: NDArray[np.int64]) -> Labelled:
    """The same runs in another order."""
    return {
        name: (dimensions, values[order], attributes)
        for name, (dimensions, values, attributes) in variables.items()
    }


def join(parts: Sequence[Labelled]) -> Labelled:
    """One after the other; what a part lacks is not a number there."""
    names = dict.fromkeys(name for part in parts for name in part)
    joined: Labelled = {}
    for name in names:
        dimensions, like, attributes = next(part[name] for part in parts if name in part)
        pieces = [
            part[name][1]
            if name in part
            else np.full((len(part["status"][1]), *like.shape[1:]), np.nan)
            for part in parts
        ]
        joined[name] = (dimensions, np.concatenate(pieces), attributes)
    return joined


def _recorded(runs: Runs) -> Labelled:
    """Rows of the same variables that a trajectory has, with a run dimension before them."""
    found: Labelled = {}
    chosen = [variable for variable in declared(runs.system) if variable.batch]
    for name, (dimensions, values, attributes) in labelled(chosen, runs.flat).items():
        if dimensions[:1] == ("time",):
            values = runs.in_rows(values)
        else:
            values = np.broadcast_to(values, (len(runs.monitors), *np.shape(values))).copy()
        found[name] = (("run", *dimensions), values, attributes)
    return found
