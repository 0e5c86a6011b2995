"""Rules for periods and penalties against closed forms, and what certificates read in monitors."""

from dataclasses import replace

import numpy as np
import pytest
from builders import EQUAL, FIVE, V0, clock, integrators, robot_state, robot_system, robots

import reference
import reference_games
from gne_mj import certificate, exits, monitored
from gne_mj import graph as graphs
from gne_mj.barrier import LogBarrier, Schedule
from gne_mj.controllers import FullInformation, FullyDistributed, PartialInformation
from gne_mj.epsilon import epsilon_bounds
from gne_mj.faults import Push, Saturation
from gne_mj.games import cournot_game, velocity_consensus_game, velocity_game
from gne_mj.loops import monitor as watch
from gne_mj.system import System
from gne_mj.theory import certify
from gne_mj.theory.periods import least_rho, linear_period, push_period

MASSES = [2.0, 0.5, 4.0]
DELTA = [3.0, 2.0, 1.0]


def line(law=None, rho=0.1, masses=MASSES, **options):
    numbers = {name: [1.0] * 3 for name in EQUAL} | {"main_mass": masses}
    y = V0 + np.array([-1.0, 0.5, 0.75])
    return System(
        "line", velocity_game(3, V0, DELTA), robots(numbers), law or FullInformation(), rho,
        robot_state(y), **options,
    )  # fmt: skip


# --------------------------------------------------------------------------------------- rules


def test_the_push_rule_is_that_of_the_gap_with_the_least_room():
    """delta (delta - |gap|) M / (2 rho k), M the lightest in the gap."""
    system, y = line(), V0 + np.array([-1.0, 0.5, 0.75])
    gaps, lightest = np.array([1.0, 1.5, 0.25]), np.array([2.0, 0.5, 0.5])
    delta = np.array(DELTA)
    expected = np.min(delta * (delta - gaps) * lightest / (2 * 0.1))
    assert push_period(system, y) == pytest.approx(expected)
    strong = line(FullyDistributed(graphs.line(3), 0.01, 4.0))
    assert push_period(strong, y) == pytest.approx(expected / 4)
    firms = cournot_game(2)
    none = System("firms", firms, integrators(2), FullInformation(), 0.1, np.full((2, 1), 20.0))
    assert push_period(none, none.start) is None


def test_the_linear_rule_has_the_couplings_of_all_neighbours():
    """The least 2 Re / |.|^2 of the eigenvalues of M^-1 (d2phi + dF + c D)."""
    oracle = reference_games.VelocityGame(V0, np.array(DELTA))
    y = V0 + np.array([-1.0, 0.5, 0.75])
    jacobian = reference.pseudo_gradient_jacobian(oracle, y)
    matrix = jacobian + reference.barrier_hessian(oracle, 0.1, y)
    for law, added, gain in (
        (FullInformation(), np.zeros(3), 1.0),
        (PartialInformation(graphs.line(3), 3.0), 3.0 * np.array([1, 2, 1]), 1.0),
        (FullyDistributed(graphs.line(3), 0.01, 0.5), np.zeros(3), 0.5),
    ):
        values = np.linalg.eigvals((gain * matrix + np.diag(added)) / np.array(MASSES)[:, None])
        expected = np.min(2 * values.real / np.abs(values) ** 2)
        assert linear_period(line(law), y) == pytest.approx(expected, rel=1e-9)


def wanting(rho=0.1, **options):
    """Robots that want to be outside, so that a bound is active at the equilibrium."""
    game = velocity_game(2, V0, [1.0, 1.0], [V0 + 3.0] * 2, [1.0] * 2)
    state = robot_state(np.full(2, V0))
    agents = robots({name: [1.0] * 2 for name in EQUAL})
    return System("wanting", game, agents, FullInformation(), rho, state, **options)


def test_the_least_penalty_is_just_kept_by_the_period():
    system = wanting()
    for period in (0.001, 0.004):
        rho = least_rho(system, period)
        assert 1e-9 < rho < 0.1
        longest = {}
        for factor in (1.0, 0.97):
            there = wanting(factor * rho)
            longest[factor] = linear_period(there, there.equilibrium.action)
        assert longest[1.0] >= 1.25 * period > longest[0.97]
        assert least_rho(replace(system, rho=1e-8), period) == 1e-8, "not even the start keeps it"
        falling = replace(system, rho=1e-8, schedule=Schedule("halving", 0.1, 1e-8, 1.0))
        assert least_rho(falling, period) == pytest.approx(rho, rel=0.03)
        assert least_rho(system, period, reserve=2.5) == least_rho(system, 2.0 * period)
    resting = robot_system(robot_state(FIVE))
    assert least_rho(resting, 1e-3) == 1e-9, "no bound is active: any is kept"


def slopes_condition(system, period):
    held = certify(system, clock(0.005, period, period)).held
    (condition,) = [c for c in held["conditions"] if c["label"] == "dy+/du > 0"]
    return condition["status"], held["least_slope"]


def test_one_agent_whose_output_may_fall_is_enough():
    """Soft robots rise with their input for certain; with one stiff one it is not known."""
    stiff = {name: [1.0] * 3 for name in EQUAL} | {"stiffness": [1.0, 400.0, 1.0]}
    soft = {name: [1.0] * 3 for name in EQUAL}
    found = {}
    for name, numbers in (("soft", soft), ("stiff", stiff)):
        system = replace(line(), agents=robots(numbers), mode="implicit", integrator="euler")
        found[name], least = slopes_condition(system, 0.2)
        assert (min(least) > 0) == (found[name] == "met")
        assert max(least) > 0
    assert found == {"soft": "met", "stiff": "unknown"}


def test_epsilon_is_bounded_by_the_numbers_of_constraints():
    bound = epsilon_bounds(line().game, 0.25, None)
    assert bound["p_rho"] == 3 * 0.25
    assert bound["p_rho_affine"] == 6 * 0.25
    assert bound["largest_own_p_rho"] == 2 * 0.25
    found = epsilon_bounds(cournot_game(4), 0.5, None)
    assert (found["p_rho"], found["p_rho_affine"], found["largest_own_p_rho"]) == (4.0, None, 1.0)


def test_the_barriers_value_is_infinite_outside_of_any_bound():
    game = velocity_game(3, V0, DELTA)
    barrier = LogBarrier(game, 0.25)
    y = V0 + np.array([-1.0, 0.5, 0.75])
    assert barrier.value(y) == pytest.approx(-0.25 * np.sum(np.log(-game.constraints(y))))
    assert barrier.value(y) != 0
    for k in range(3):
        outside = np.full(3, V0)
        outside[k:] += DELTA[k] * 1.01
        assert barrier.value(outside) == np.inf


# ------------------------------------------------------------------------------------- reports


def monitor_of(system, worst, **entries):
    p, m = system.game.constraints_count, system.game.actions
    monitor = watch.fresh(m, p)
    monitor.started = 1.0
    monitor.worst[:] = worst
    monitor.worst_time[:] = 0.1 * np.arange(1, p + 1)
    for name, value in entries.items():
        monitor[name.lower()] = value
    return monitor


def test_the_worst_gap_is_the_one_nearest_to_its_own_bound():
    """Gaps of 2, 1.9 and 0.5 in bounds of 3, 2 and 1: the second, not the greatest."""
    system = line()
    gaps = np.array([2.0, 1.9, 0.5])
    monitor = monitor_of(system, gaps**2 - np.array(DELTA) ** 2)
    found = monitored.worst_gap(system, monitor)
    assert found["gap"] == pytest.approx(1.9)
    assert (found["bound"], found["index"], found["time"]) == (2.0, 2, 0.2)
    assert found["name"] == system.game.constraint_names[1]
    assert found["each"] == pytest.approx(gaps.tolist())
    # rounding below a gap of zero is none
    monitor = monitor_of(system, [-9.0 - 1e-12, -4.0, -1.0])
    assert monitored.worst_gap(system, monitor)["gap"] == 0.0
    worst = monitored.worst_constraint(system, monitor_of(system, [-3.0, -2.0, -2.5]))
    assert (worst["index"], worst["margin"], worst["time"]) == (2, 2.0, 0.2)
    nothing = watch.fresh(system.game.actions, system.game.constraints_count)
    assert monitored.worst_gap(system, nothing) is None
    assert monitored.worst_constraint(system, nothing) is None


def test_exits_tell_whose_they_are():
    system = line()
    latched = {
        "set": {"EXIT": watch.LEFT_SET, "EXIT_AGENT": -1, "EXIT_CONSTRAINT": 1, "EXIT_VALUE": 0.5},
        "estimates": {"EXIT": watch.ESTIMATE_LEFT, "EXIT_AGENT": 2, "EXIT_CONSTRAINT": 0},
        "measured": {"EXIT": watch.ESTIMATE_LEFT, "EXIT_AGENT": -1, "EXIT_CONSTRAINT": 2},
        "number": {"EXIT": watch.DIVERGED, "EXIT_AGENT": -1, "EXIT_CONSTRAINT": -1},
    }
    whose = {"set": [1, 2], "estimates": [3], "measured": [2, 3], "number": []}
    of = {"set": None, "estimates": 3, "measured": None, "number": None}
    words = {
        "set": "was violated at 0.75 s: g = 0.5", "estimates": "agent 3's estimates violated",
        "measured": "the measured profile violated", "number": "no longer a usable number",
    }  # fmt: skip
    for name, entries in latched.items():
        monitor = monitor_of(system, [-1.0] * 3, EXIT_TIME=0.75, **entries)
        report = exits.exit_report(system, monitor)
        assert report["agents"] == whose[name] == exits.concerned(system, monitor)
        assert report["estimates_of_agent"] == of[name]
        assert report["at_control_instant"] is True
        assert report["stage"] == 1
        known = name != "number"
        index = int(monitor.exit_constraint)
        assert report["constraint"] == (system.game.constraint_names[index] if known else None)
        status, message = exits.exit_status(system, monitor)
        assert words[name] in message
        now = certificate.status_now(system, monitor)
        assert (now["status"], now["exit_agents"]) == (status, whose[name])
        assert now["exit_time"] == 0.75
        monitor.exit_between, monitor.exit_stage = 1.0, 2.0
        assert exits.exit_report(system, monitor)["at_control_instant"] is False
        assert "(stage 3 of the integration step)" in exits.exit_status(system, monitor)[1]
        between = "between two control instants" in exits.exit_status(system, monitor)[1]
        assert between == known
    monitor = monitor_of(system, [-3.0, -1.0, -0.5])
    assert exits.exit_report(system, monitor) is None
    now = certificate.status_now(system, monitor)
    assert (now["status"], now["margin"], now["exit_time"]) == ("running", 0.5, None)


def test_actuators_tell_the_greatest_demand_and_whose():
    limits = np.array([np.inf, 7.0, np.inf])
    system = line(faults=(Saturation(agents=(1,), limit=5.0, start=1.0, end=2.0),))
    system = replace(system, agents=replace(system.agents, input_limit=limits))
    monitor = monitor_of(system, [-1.0] * 3, TIME=4.0)
    monitor.peak[:], monitor.peak_time[:] = [3, 9, 4], [0.3, 0.9, 0.4]
    monitor.square[:], monitor.energy[:] = [16, 36, 64], [1, 2, 3]
    found = monitored.actuators(system, monitor)
    assert (found["peak"], found["peak_agent"], found["peak_time"]) == (9.0, 2, 0.9)
    assert found["rms"] == [2.0, 3.0, 4.0]
    assert found["energy"] == [1.0, 2.0, 3.0]
    assert found["limits"] == limits.tolist()
    assert found["saturated"] is None
    for time, limit in ((0.5, 7.0), (1.0, 5.0), (1.5, 5.0), (2.0, 7.0)):
        monitor.saturated, monitor.saturated_time = 1.0, time
        monitor.saturated_action, monitor.saturated_command = 1, -9.0
        assert monitored.actuators(system, monitor)["saturated"] == {
            "agent": 2, "time": time, "demand": -9.0, "limit": limit,
        }  # fmt: skip
    assert monitored.actuators(line(), monitor)["limits"] is None


def test_mode_implicit_tells_when_it_was_not_accurate():
    system = line(mode="implicit", integrator="euler")
    monitor = monitor_of(
        system, [-1.0] * 3, SOLUTIONS=4, SOLVER_STEPS=10, MOST_STEPS=5, UNSOLVED=2,
        UNSOLVED_TIME=0.25, PREDICTION=0.5, PREDICTION_TIME=0.75, NOT_MONOTONE=1,
        NOT_MONOTONE_TIME=1.25,
    )  # fmt: skip
    expected = {
        "decentralised": False, "solutions": 4, "mean_newton_steps": 2.5, "most_newton_steps": 5,
        "not_accurate": 2, "first_not_accurate": 0.25, "largest_prediction_error": 0.5,
        "largest_prediction_error_time": 0.75, "periods_not_monotone": 1,
        "first_not_monotone": 1.25,
    }  # fmt: skip
    assert expected.items() <= certificate._of_modes(system, monitor)["implicit"].items()
    fresh = certificate._of_modes(
        system, watch.fresh(system.game.actions, system.game.constraints_count)
    )["implicit"]
    assert fresh["first_not_accurate"] is fresh["first_not_monotone"] is None
    assert fresh["mean_newton_steps"] == 0.0
    assert certificate._of_modes(line(mode="sampled"), monitor)["implicit"] is None


def test_planar_agents_are_told_by_agent_and_not_by_entry():
    game = velocity_consensus_game([(0, 1)], [1.0, 0.0], [1.0, 0.0], 1.5, 2.0)
    agents = integrators(4)
    system = System(
        "plane", game, agents, FullInformation(), 0.1, agents.equilibrium(np.full(4, 0.5))
    )
    monitor = monitor_of(system, [-1.0] * 2)
    monitor.peak[:] = [1, 2, 3, 2]
    assert monitored.actuators(system, monitor)["peak_agent"] == 2


# ------------------------------------------------------------------------ what a theorem gives


def test_what_the_theorem_would_cover_is_told_apart_from_what_it_covers_not():
    timing = clock(0.01)
    sampled = certify(line(mode="sampled"), timing)
    assert len(sampled.guaranteed) == 1
    assert "in continuous time is covered by the theorem" in sampled.guaranteed[0]
    assert any("mode 'sampled'" in each for each in sampled.not_certified)
    euler = certify(line(integrator="euler"), timing)
    assert any("Euler's method" in each for each in euler.not_certified)
    pushed = (Push(force=1.0),)
    struck = certify(line(mode="sampled", faults=pushed), timing)
    assert struck.guaranteed == ["nothing"]
    assert any("faults" in each for each in struck.not_certified)
    whole = certify(line(), timing)
    assert whole.status == "certified"
    assert not any("in continuous time, none covers this" in each for each in whole.not_certified)


def test_a_margin_is_told_where_there_is_one():
    """What lies beyond the declared disturbances is not certified, and in their place no pushes."""
    from gne_mj.margins import Disturbance, with_margin

    plain = line(mode="implicit", integrator="euler")
    bound = Disturbance(np.full(3, 1.0), np.zeros(3))
    game = with_margin(plain.game, plain.agents, bound, 0.01, "euler", 1)
    tight = replace(plain, game=game, disturbance=bound)
    told = [certify(system, clock(0.01)).not_certified for system in (plain, tight)]
    assert [any("anything under pushes" in each for each in lines) for lines in told] == [
        True,
        False,
    ]
    beyond = [any("beyond the disturbances" in each for each in lines) for lines in told]
    assert beyond == [False, True]


def test_mode_implicit_guarantees_nothing_that_it_does_not_promise():
    """A push that no margin covers, and barriers at estimates; the promise itself beside them."""
    promised = line(mode="implicit", integrator="euler")
    estimates = FullyDistributed(graphs.line(3), 0.01, 1.0)
    for system, expected in (
        (promised, True),
        (replace(promised, faults=(Push(force=1.0),)), False),
        (line(estimates, mode="implicit", integrator="euler"), False),
    ):
        report = certify(system, clock(0.01))
        assert report.held["promised"] == expected
        told = any("at every control instant" in each for each in report.guaranteed)
        assert told == expected


def test_a_limit_on_one_agent_is_told_as_one_on_all():
    told = []
    for limits in ([np.inf] * 3, [np.inf, 0.01, np.inf], [0.01] * 3):
        agents = replace(line().agents, input_limit=np.array(limits))
        report = certify(replace(line(), agents=agents), clock(0.01))
        assert report.system["limited_inputs"] == bool(len(told))
        told.append(report.guaranteed)
    assert told[0] != told[1]
    assert told[1] == told[2]
