"""What runs are judged and told by: verdicts, a trajectory's variables, the columns of a batch."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from batch_plans import ROOT
from builders import FIVE, V0, distributed, integrators, robot_state, robot_system

from gne_mj import graph as graphs
from gne_mj import run_metrics
from gne_mj.barrier import Schedule
from gne_mj.batch_variables import declared_figures
from gne_mj.batches import summary
from gne_mj.batches.plan import make_plan
from gne_mj.controllers import FullInformation, PartialInformation, PlainLaw
from gne_mj.faults import Push
from gne_mj.games import velocity_consensus_game, velocity_game
from gne_mj.loops import monitor as watch
from gne_mj.loops.base import Samples
from gne_mj.loops.batch import Outcome, Span
from gne_mj.scenario import load_scenario
from gne_mj.signals import variables_of
from gne_mj.system import Clock, System

M, P = 2, 3
GAMES = {2: velocity_game(2, V0, 3.0)}


def run_of(**entries):
    """A monitor of two actions and three constraints, begun unless said otherwise."""
    monitor = watch.fresh(M, P)
    monitor.started = 1.0
    for name, value in entries.items():
        if name == "worst":
            monitor.worst[:] = value
        elif name == "when":
            monitor.worst_time[:] = value
        else:
            monitor[name.lower()] = value
    return monitor


# ------------------------------------------------------------------------------------ verdicts


def test_of_a_run_that_never_began_nothing_was_the_worst():
    runs = watch.together(
        [
            run_of(worst=[-1, -2, -3], when=[0.1, 0.2, 0.3]),
            run_of(STARTED=0.0),
            run_of(
                worst=[-1, -2, -3], when=[0.1, 0.2, 0.3], EXIT=watch.LEFT_SET, EXIT_CONSTRAINT=1,
                EXIT_VALUE=0.5, EXIT_TIME=0.7,
            ),
            run_of(STARTED=0.0, EXIT=watch.LEFT_SET, EXIT_CONSTRAINT=2, EXIT_VALUE=0.25),
            run_of(worst=[-1, 3, -3], EXIT=watch.ESTIMATE_LEFT, EXIT_CONSTRAINT=0, EXIT_VALUE=9.0),
        ]
    )  # fmt: skip
    kept = runs.copy()
    worst, when = run_metrics.worst_constraints(runs)
    assert worst.tolist() == [
        [-1, -2, -3], [-np.inf] * 3, [-1, 0.5, -3], [-np.inf, -np.inf, 0.25], [-1, 3, -3],
    ]  # fmt: skip
    assert when[0].tolist() == [0.1, 0.2, 0.3]
    assert when[2].tolist() == [0.1, 0.7, 0.3]
    assert np.array_equal(runs, kept), "what was seen stays as it is"
    # an exit below what was seen before does not hide that
    low = run_of(worst=[2, -2, -3], when=[0.1, 0.2, 0.3], EXIT=watch.LEFT_SET, EXIT_VALUE=1.0)
    worst, when = run_metrics.worst_constraints(watch.together([low]))
    assert (worst[0, 0], when[0, 0]) == (2.0, 0.1)


def test_how_runs_ended():
    runs = watch.together([run_of(EXIT=code) for code in (0, 0, 1, 2, 3)])
    found = run_metrics.status(runs, np.array([0.01, 0.011, 0.0, 0.0, np.nan]), 0.01)
    assert found.tolist() == [
        "converged", "completed", "left_feasible_set", "estimate_left_feasible_set", "diverged",
    ]  # fmt: skip
    assert found.dtype == run_metrics.STATUS


def test_the_tail_is_a_twentieth_of_what_was_meant():
    time = np.arange(0.0, 10.1, 0.25)
    distance = np.stack([np.where(time < 9.49, 7.0, time), np.where(time == 9.5, 3.0, 0.0)])
    assert run_metrics.tail_distance(time, distance, 10.0).tolist() == [10.0, 3.0]
    # a run that ended early is judged by as long a part
    assert run_metrics.tail_distance(time[:9], distance[:, :9], 10.0).tolist() == [7.0, 0.0]


def test_a_run_has_settled_when_it_stays_within_a_fiftieth():
    time = np.array([0.0, 1.0, 2.0, 3.0])
    rows = [
        [1.0, 0.02, 0.02, 0.0], [1.0, 0.0, 0.03, 0.0], [1.0, 0.5, 0.4, 0.3], [0.0] * 4,
        [1.0, 0.0, np.nan, 0.0],
    ]  # fmt: skip
    settled = run_metrics.settling_time(time, np.array(rows))
    assert settled.tolist() == pytest.approx([1.0, 3.0, np.nan, 0.0, 3.0], nan_ok=True)


def test_what_actuators_delivered():
    runs = watch.together([run_of(TIME=4.0), run_of(TIME=0.0)])
    runs.peak, runs.peak_time, runs.square, runs.energy = [3, 5], [0.1, 0.2], [16, 36], [-1, 1]
    found = run_metrics.inputs(runs)
    assert found.peak.tolist() == [[3, 5]] * 2
    assert found.peak_time.tolist() == [[0.1, 0.2]] * 2
    assert found.rms.tolist() == [[2, 3], [0, 0]]
    assert found.energy.tolist() == [[-1, 1]] * 2


# ----------------------------------------------------------------------- a trajectory's variables


def samples_of(system, memory=0, rows=3, **columns):
    m = system.game.actions
    state = np.tile(system.state, (rows, 1, 1)) + np.arange(rows)[:, None, None] * 0.01
    empty = np.zeros((rows, 0))
    given = {
        "state": state, "input": np.ones((rows, m)), "measurement": empty, "applied": empty,
        "memory": np.arange(rows * memory, dtype=float).reshape(rows, memory),
        "configuration": empty,
    }  # fmt: skip
    return Samples(**{**given, **columns})


TIMES = np.array([0.0, 0.5, 1.0])


def line(law=None, tightening=0.0, **options):
    agents = integrators(2)
    game = GAMES[2].tightened(np.full(2, tightening))
    state = agents.equilibrium(np.array([V0 - 1.0, V0 - 0.5]))
    return System("line", game, agents, law or FullInformation(), 0.1, state, **options)


def test_a_law_of_ones_own_has_its_memory_kept():
    one = PlainLaw(GAMES[2], lambda *_: np.zeros(2), lambda *_: np.zeros(1), lambda y: [0.5])
    system = line(one)
    found = variables_of(system, TIMES, samples_of(system, memory=1))
    dimensions, values, _ = found["memory"]
    assert dimensions == ("time", "memory_entry")
    assert values.tolist() == [[0.0], [1.0], [2.0]]
    static = line(PlainLaw(GAMES[2], lambda *_: np.zeros(2)))
    names = variables_of(static, TIMES, samples_of(static))
    assert not {"memory", "estimate", "filtered_action"} & set(names)


def test_a_tightening_is_kept_where_there_is_one():
    found = variables_of(line(tightening=0.0), TIMES, samples_of(line()))
    assert "tightening" not in found
    game = replace(GAMES[2]).tightened(np.array([0.0, 0.25]))  # of one constraint only
    system = replace(line(), game=game)
    dimensions, values, _ = variables_of(system, TIMES, samples_of(system))["tightening"]
    assert dimensions == ("constraint",)
    assert values.tolist() == [0.0, 0.25]


def test_estimates_and_filtered_actions_are_kept():
    law = PartialInformation(graphs.line(2))
    system = line(law)
    found = variables_of(system, TIMES, samples_of(system, memory=4))
    y = found["action"][1]
    dimensions, values, _ = found["estimate"]
    assert dimensions == ("time", "estimating_agent", "agent")
    assert values[1].tolist() == [[y[1, 0], 5.0], [6.0, y[1, 1]]]
    assert not {"memory", "filtered_action", "measurement", "penalty"} & set(found)
    system = line(distributed("line", count=2), schedule=Schedule("halving", 0.4, 0.1, 0.5))
    found = variables_of(system, TIMES, samples_of(system, memory=6))
    assert found["filtered_action"][1].tolist() == [[4, 5], [10, 11], [16, 17]]
    assert found["penalty"][1].tolist() == [0.4, 0.2, 0.1]


def test_what_was_seen_and_what_acted_is_kept_with_faults():
    system, rows = line(faults=(Push(force=2.0),)), np.arange(6.0).reshape(3, 2)
    found = variables_of(system, TIMES, samples_of(system, measurement=rows, applied=10.0 + rows))
    assert found["measurement"][1] is rows
    assert found["acting_input"][1].tolist() == (10.0 + rows).tolist()
    assert found["input"][2]["units"] == found["acting_input"][2]["units"]
    assert "configuration" not in found


def test_all_joints_of_mjcf_robots_are_kept():
    (system,) = load_scenario(ROOT / "examples" / "robot" / "scenario.toml").system_objects()
    given = samples_of(system, configuration=np.ones((3, 5)))
    dimensions, values, _ = variables_of(system, TIMES, given)["configuration"]
    assert dimensions == ("time", "coordinate")
    assert values is given.configuration


def test_states_but_the_output_are_kept_by_their_names():
    system = robot_system(robot_state(FIVE, extension=0.5, position=2.0))
    found = variables_of(system, TIMES, samples_of(system))
    for index, (name, unit) in enumerate(system.agents.kind.STATES):
        if index != system.agents.kind.OUTPUT:
            assert found[name][1] == pytest.approx(samples_of(system).state[:, :, index])
            assert found[name][2] == {"units": unit or system.game.action_unit}
    assert system.agents.kind.STATES[system.agents.kind.OUTPUT][0] not in found
    assert found["equilibrium"][1] == pytest.approx(np.full(5, V0))
    assert found["gap"][0] == ("time", "agent")
    assert found["gap_bound"][1].tolist() == [3.0] * 5


def test_actions_of_several_entries_have_a_dimension_of_their_own():
    game = velocity_consensus_game([(0, 1)], [1.0, 0.0], [1.0, 0.0], 1.5, 2.0)
    agents = integrators(4)
    system = System(
        "plane", game, agents, FullInformation(), 0.1, agents.equilibrium(np.full(4, 0.5))
    )
    found = variables_of(system, TIMES, samples_of(system))
    assert found["action"][0] == ("time", "action")
    assert found["equilibrium"][0] == ("action",)


# ------------------------------------------------------------------------------ columns of a batch


def batch(system, *monitors, rows=5):
    clock = Clock(2.0, 0.1, 0.1, 0.5)
    scenario = SimpleNamespace(simulation=SimpleNamespace(tolerance=0.05))
    combination = SimpleNamespace(system=system, clock=clock, scenario=scenario)
    span = summary.span_of(combination)
    runs = len(monitors)
    state = np.tile(system.equilibrium.action[:, None], (runs, rows, 1, 1)).astype(float)
    state[:, 0] += 1.0
    empty = np.zeros((runs, rows, 0))
    samples = Samples(state, np.ones((runs, rows, M)), empty, empty, empty, empty)
    return combination, span, Outcome(samples, watch.together(monitors))


def monitor_of(**entries):
    """As run_of, for two constraints."""
    monitor = watch.fresh(M, 2)
    monitor.started = 1.0
    monitor.worst[:], monitor.worst_time[:] = [-3.0, -2.0], [0.3, 0.2]
    monitor.peak[:], monitor.peak_time[:] = [4.0, 7.0], [0.4, 0.7]
    for name, value in entries.items():
        monitor[name.lower()] = value
    return monitor


def test_the_columns_of_a_batch():
    """One run that stayed, one of an agent's estimates, one that left the set, two others."""
    left = {"EXIT_TIME": 1.5, "EXIT_VALUE": 0.25}
    monitors = [
        monitor_of(TIME=2.0, STEPS=20, STORAGE_RISE=0.125),
        monitor_of(EXIT=watch.ESTIMATE_LEFT, EXIT_AGENT=0, EXIT_CONSTRAINT=1, **left),
        monitor_of(EXIT=watch.LEFT_SET, EXIT_AGENT=-1, EXIT_CONSTRAINT=0, EXIT_BETWEEN=1, **left),
        monitor_of(EXIT=watch.DIVERGED, EXIT_AGENT=-1, EXIT_CONSTRAINT=-1, **left),
        monitor_of(STARTED=0.0, SATURATED=1.0, SATURATED_TIME=0.75),
    ]
    found = summary.columns_of(*batch(line(), *monitors), record=0)
    nan = np.nan
    expected = {
        "least_margin": [2.0, 2.0, -0.25, 2.0, nan],
        "least_margin_time": [0.2, 0.2, 1.5, 0.2, nan],
        "least_margin_constraint": [2, 2, 1, 2, nan],
        "settling_time": [0.5] * 5,
        "final_error": [0.0] * 5,
        "end_time": [2.0, nan, nan, nan, 0.0],
        "exit_time": [nan, 1.5, 1.5, 1.5, nan],
        "exit_constraint": [nan, 2, 1, nan, nan],
        "exit_agent": [nan, 1, nan, nan, nan],
        "exit_value": [nan, 0.25, 0.25, 0.25, nan],
        "exit_at_instant": [nan, 1.0, 0.0, 1.0, nan],
        "peak_input": [7.0] * 5,
        "peak_input_time": [0.7] * 5,
        "saturated_time": [nan, nan, nan, nan, 0.75],
        "lyapunov_rise": [0.125, 0.0, 0.0, 0.0, 0.0],
        "steps": [20, 0, 0, 0, 0],
    }
    for name, values in expected.items():
        assert found[name][1].tolist() == pytest.approx(values, nan_ok=True), name
    assert found["status"][1].tolist() == [
        "converged", "estimate_left_feasible_set", "left_feasible_set", "diverged", "converged",
    ]  # fmt: skip
    assert found["margin"][1][4].tolist() == [np.inf, np.inf]
    assert found["initial_action"][1] == pytest.approx(found["equilibrium"][1] + 1.0)
    assert found["final_action"][1] == pytest.approx(found["equilibrium"][1])
    assert "solutions" not in found
    assert "action" not in found


def test_of_a_system_without_a_known_equilibrium_no_rise_is_told(monkeypatch):
    """As in the certificate of one run."""
    one = batch(line(), monitor_of(STORAGE_RISE=0.125))
    assert summary.columns_of(*one, record=0)["lyapunov_rise"][1].tolist() == [0.125]
    monkeypatch.setattr(System, "known_equilibrium", None)
    found = summary.columns_of(*one, record=0)
    for name in ("lyapunov_rise", "final_error", "settling_time"):
        assert found[name][1].tolist() == pytest.approx([np.nan], nan_ok=True)


def test_inputs_of_a_batch_have_the_unit_that_a_trajectorys_have():
    for system in (line(), robot_system(robot_state(FIVE))):
        unit = variables_of(system, TIMES, samples_of(system))["input"][2]["units"]
        found = {each.name: each for each in declared_figures(system)}
        for name in ("peak_input", "rms_input"):
            assert found[name].attributes(system)["units"] == unit
    assert unit == "N"


def test_mode_implicit_has_columns_of_its_own():
    monitor = monitor_of(SOLUTIONS=5, SOLVER_STEPS=11, UNSOLVED=1, PREDICTION=0.5, NOT_MONOTONE=2)
    found = summary.columns_of(*batch(line(mode="implicit"), monitor), record=0)
    names = ("solutions", "newton_steps", "not_accurate", "prediction_error",
             "periods_not_monotone")  # fmt: skip
    assert [found[name][1].tolist() for name in names] == [[5], [11], [1], [0.5], [2]]


def test_recorded_rows_of_a_batch():
    combination, span, outcome = batch(line(), monitor_of(), monitor_of())
    assert (span.rows, span.every, span.steps) == (5, 5, 20)
    assert summary.times(combination, span).tolist() == pytest.approx([0.0, 0.5, 1.0, 1.5, 2.0])
    assert summary.kept(span, 3).tolist() == [0, 3, 4]
    assert summary.kept(Span(21, 5), 2).tolist() == [0, 2, 4, 5]
    assert summary.times(combination, Span(21, 5)).tolist()[-2:] == pytest.approx([2.0, 2.1])
    found = summary.columns_of(combination, span, outcome, record=3)
    assert found["action"][0] == ("run", "time", "agent")
    assert found["action"][1] == pytest.approx(outcome.samples.state[..., 0][:, [0, 3, 4]])
    assert found["constraint"][1].shape == (2, 3, 2)
    assert found["gap_bound"][1].tolist() == [[3.0, 3.0]] * 2
    assert not {"state", "configuration"} & set(found)
    assert found["equilibrium"][0] == ("run", "agent")


def test_parts_of_a_batch_are_joined_and_rearranged():
    one = {"status": (("run",), np.array(["a", "b"]), {}), "x": (("run",), np.array([1.0, 2]), {})}
    two = summary.refused_columns(1)
    joined = summary.join([two, one])
    assert joined["status"][1].tolist() == ["infeasible_start", "a", "b"]
    assert joined["x"][1].tolist() == pytest.approx([np.nan, 1.0, 2.0], nan_ok=True)
    again = summary.rearranged(joined, np.array([2, 0, 1]))
    assert again["status"][1].tolist() == ["b", "infeasible_start", "a"]


def test_the_tables_of_a_batch_have_no_empty_entries():
    """They are kept as JSON and TOML, and TOML has no word for nothing."""
    plan = make_plan("velocity-sync", {"plant.engine": "ode"})

    def entries(value):
        if isinstance(value, dict):
            for each in value.values():
                yield from entries(each)
        elif isinstance(value, list):
            for each in value:
                yield from entries(each)
        else:
            yield value

    found = list(entries(plan.scenario))
    assert len(found) > 10
    assert not any(value is None for value in found)
