"""What is kept of every run of a batch: figures from its monitor and rows, and rows themselves."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gne_mj import verdicts
from gne_mj.batches.plan import Combination
from gne_mj.errors import InfeasibleStart
from gne_mj.loops import monitor as watch
from gne_mj.loops.base import Samples
from gne_mj.loops.batch import Outcome, Span
from gne_mj.trajectory import axis_of, variables_of

# name -> (dimensions, values, attributes); the first dimension is always "run"
Variables = dict[str, tuple[tuple[str, ...], NDArray[Any], dict[str, str]]]


def columns_of(combination: Combination, span: Span, outcome: Outcome, record: int) -> Variables:
    """The variables of runs of one combination.

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
    game, monitors, samples = system.game, outcome.monitors, outcome.samples
    p, m, runs = game.constraints_count, game.actions, len(monitors)
    time = times(combination, span)
    y = samples.state[:, :, :, system.agents.kind.OUTPUT]
    known = system.known_equilibrium
    middle = np.full(m, np.nan) if known is None else known.action  # then nothing is known of it
    distance = np.max(np.abs(y - middle), axis=2)
    for monitor, last in zip(monitors, y[:, -1], strict=True):
        verdicts.check_numbers(game, monitor, last, clock.timestep)
    left = monitors[:, watch.EXIT] != watch.INSIDE
    tail = verdicts.tail_distance(time, distance, clock.duration)
    status = verdicts.status(monitors, tail, combination.scenario.simulation.tolerance)
    worst, when = verdicts.worst_constraints(monitors, p)
    tightest = np.argmax(worst, axis=1)
    rows = np.arange(runs)
    inputs = verdicts.inputs(monitors, p, m)
    seen = monitors[:, watch.STARTED] > 0
    known = left & (monitors[:, watch.EXIT] != watch.DIVERGED)
    axis = axis_of(system)
    unit = {"units": game.action_unit}
    second = {"units": "s"}

    def where(condition: NDArray[np.bool_], values: NDArray[np.float64]) -> NDArray[np.float64]:
        return np.where(condition, values, np.nan)

    found: Variables = {
        "status": (("run",), status, {"long_name": "how the run ended"}),
        "least_margin": (
            ("run",),
            where(seen, -worst[rows, tightest]),
            {"long_name": "least -g over constraints and integration steps"},
        ),
        "least_margin_time": (("run",), where(seen, when[rows, tightest]), second),
        "least_margin_constraint": (
            ("run",),
            where(seen, 1.0 + tightest),
            {"long_name": "numbered from 1"},
        ),
        "margin": (("run", "constraint"), -worst, {"long_name": "least -g of each constraint"}),
        "settling_time": (
            ("run",),
            verdicts.settling_time(time, distance),
            {"long_name": "until max |y - y*| stays within 2% of its start", **second},
        ),
        "final_error": (
            ("run",),
            distance[:, -1],
            {"long_name": "max |y - y*| at the end", **unit},
        ),
        "end_time": (("run",), where(~left, monitors[:, watch.TIME]), second),
        "exit_time": (("run",), where(left, monitors[:, watch.EXIT_TIME]), second),
        "exit_constraint": (
            ("run",),
            where(known, 1.0 + monitors[:, watch.EXIT_CONSTRAINT]),
            {"long_name": "which was violated, numbered from 1"},
        ),
        "exit_agent": (
            ("run",),
            where(known & (monitors[:, watch.EXIT_AGENT] >= 0), 1 + monitors[:, watch.EXIT_AGENT]),
            {"long_name": "whose estimates left"},
        ),
        "exit_value": (("run",), where(left, monitors[:, watch.EXIT_VALUE]), {}),
        "exit_at_instant": (
            ("run",),
            where(left, 1.0 - monitors[:, watch.EXIT_BETWEEN]),
            {"long_name": "1: seen at a control instant, 0: between two"},
        ),
        "peak_input": (
            ("run",),
            np.max(inputs.peak, axis=1),
            {"units": system.agents.kind.INPUT_UNIT},
        ),
        "peak_input_time": (
            ("run",),
            inputs.peak_time[rows, np.argmax(inputs.peak, axis=1)],
            second,
        ),
        "rms_input": (("run", axis), inputs.rms, {"units": system.agents.kind.INPUT_UNIT}),
        "energy": (("run", axis), inputs.energy, {"long_name": "integral of u y"}),
        "saturated_time": (
            ("run",),
            where(monitors[:, watch.SATURATED] > 0, monitors[:, watch.SATURATED_TIME]),
            {"long_name": "when an input limit was first met", **second},
        ),
        "lyapunov_rise": (
            ("run",),
            where(np.full(runs, known is not None), monitors[:, watch.STORAGE_RISE]),
            {"long_name": "largest rise of V from one step to the next"},
        ),
        "steps": (("run",), monitors[:, watch.STEPS].copy(), {}),
        "initial_action": (("run", axis), y[:, 0].copy(), unit),
        "final_action": (("run", axis), y[:, -1].copy(), unit),
        "equilibrium": (
            ("run", axis),
            np.tile(middle, (runs, 1)),
            {**unit, "long_name": "y*"},
        ),
    }
    if system.mode == "continuous" and system.integrator != "rosenbrock":
        smallest = monitors[:, watch.SMALLEST_STEP]
        found["divided_steps"] = (
            ("run",),
            monitors[:, watch.DIVIDED].copy(),
            {"long_name": "integration steps divided near the boundary"},
        )
        found["smallest_step"] = (
            ("run",),
            where(smallest > 0, smallest),
            {"long_name": "shortest piece of a divided step", **second},
        )
    if system.mode == "implicit":
        for name, entry in (
            ("solutions", watch.SOLUTIONS),
            ("newton_steps", watch.SOLVER_STEPS),
            ("not_accurate", watch.UNSOLVED),
            ("prediction_error", watch.PREDICTION),
            ("periods_not_monotone", watch.NOT_MONOTONE),
        ):
            found[name] = (("run",), monitors[:, entry].copy(), {})
    if record:
        found.update(_recorded(combination, time, samples, kept(span, record)))
    return found


def refused_columns(runs: int) -> Variables:
    """Of runs that cannot begin, since their start is not inside."""
    return {"status": (("run",), np.full(runs, InfeasibleStart.status, dtype=verdicts.STATUS), {})}


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


def rearranged(variables: Variables, order: NDArray[np.int64]) -> Variables:
    """The same runs in another order."""
    return {
        name: (dimensions, values[order], attributes)
        for name, (dimensions, values, attributes) in variables.items()
    }


def join(parts: Sequence[Variables]) -> Variables:
    """One after the other; what a part lacks is not a number there."""
    names = dict.fromkeys(name for part in parts for name in part)
    joined: Variables = {}
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


def _recorded(
    combination: Combination,
    time: NDArray[np.float64],
    samples: Samples,
    rows: NDArray[np.int64],
) -> Variables:
    """Rows of the same variables that a trajectory has, with a run dimension before them."""
    system = combination.system
    assert system is not None
    chosen = [getattr(samples, name)[:, rows] for name in Samples.__dataclass_fields__]
    runs = len(chosen[0])
    flat = Samples(*(c.reshape(runs * len(rows), *c.shape[2:]) for c in chosen))
    found: Variables = {}
    for name, (dimensions, values, attributes) in variables_of(
        system, np.tile(time[rows], runs), flat
    ).items():
        # a state is kept by its components, y* once a run, and not all joints of MJCF robots
        if name in ("state", "equilibrium", "configuration"):
            continue
        if dimensions[:1] == ("time",):
            values = values.reshape(runs, len(rows), *values.shape[1:])
        else:
            values = np.broadcast_to(values, (runs, *np.shape(values))).copy()
        found[name] = (("run", *dimensions), values, attributes)
    return found
