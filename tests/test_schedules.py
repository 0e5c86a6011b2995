"""Penalties that fall in time, towards the variational equilibrium."""

import numpy as np
import pytest
from builders import FIVE, robot_state, robot_system, run_loop
from hypothesis import assume, given
from hypothesis import strategies as st
from scipy.integrate import solve_ivp

import reference
import reference_games
from gne_mj.barrier import Schedule
from gne_mj.equilibrium import variational_equilibrium
from gne_mj.errors import InvalidInput
from gne_mj.scenario import load_scenario, run
from gne_mj.theory import certify
from gne_mj.theory.periods import least_rho, linear_period

GAME = reference_games.VelocityGame(3.0, np.full(5, 3.0))


KINDS = ("exponential", "reciprocal", "halving")


@given(st.sampled_from(KINDS), st.floats(1e-3, 10), st.floats(0.01, 100), st.floats(0, 200))
def test_schedules_are_what_they_are_called(kind, start, constant, time):
    assume(kind != "halving" or abs(time / constant - round(time / constant)) > 1e-6 or time == 0)
    schedule = Schedule(kind, start, 1e-6 * start, constant)
    expected = {
        "exponential": start * np.exp(-time / constant),
        "reciprocal": start / (1.0 + time / constant),
        "halving": start * 0.5 ** np.floor(time / constant),
    }[kind]
    assert schedule.at(time) == pytest.approx(max(expected, 1e-6 * start), rel=1e-9)
    assert schedule.at(0.0) == start


@pytest.mark.parametrize("engine", ["ode", pytest.param("mujoco", marks=pytest.mark.slow)])
def test_the_law_takes_the_penalty_of_its_time(engine):
    schedule = Schedule("exponential", 0.5, 0.01, 0.3)
    system = robot_system(
        robot_state(FIVE), rho=0.01, schedule=schedule, mode="sampled", integrator="euler",
        engine=engine,
    )  # fmt: skip
    state, u, _, _ = run_loop(system, 0.01, 200)
    for k in (0, 10, 50, 150):
        rho = max(0.5 * np.exp(-k * 0.01 / 0.3), 0.01)
        expected = reference.full_information(GAME, rho, state[k, :, 1])
        assert np.allclose(u[k], expected, rtol=0, atol=1e-12)


def test_every_stage_takes_the_penalty_of_its_own_time():
    """Against SciPy: half the step leaves a sixteenth of the error."""
    schedule = Schedule("exponential", 1.0, 1e-3, 0.1)
    system = robot_system(robot_state(FIVE), rho=1e-3, schedule=schedule)

    def rate(time, flat):
        x1, y, x3, _ = flat.reshape(5, 4).T
        spring = x1 + np.arctan(x1) + (y - x3)  # every number of EQUAL is 1
        u = reference.full_information(GAME, max(np.exp(-time / 0.1), 1e-3), y)
        return np.column_stack([y - x3, u - spring, spring, y]).ravel()

    begin = system.state.ravel()
    exact = solve_ivp(rate, (0.0, 0.32), begin, "DOP853", rtol=1e-12, atol=1e-13).y[:, -1]
    errors = [
        np.max(np.abs(run_loop(system, h, round(0.32 / h))[0][-1].ravel() - exact))
        for h in (0.01, 0.005)
    ]
    assert errors[1] < 1e-9
    assert errors[0] > 12.0 * errors[1]


@pytest.mark.slow
def test_the_channels_reach_the_exact_variational_equilibrium_from_inside():
    """The power limit binds there; below it at every step, within 1e-6 at the end."""
    changes = {
        "controller": {"information": "full", "mode": "implicit"},
        "plant.integrator": "euler",
        "barrier": {"rho": 0.1, "schedule": "exponential", "time_constant": 1.0},
        "simulation.timestep": 0.01,
        "simulation.duration": 40.0,
    }
    trajectory = run("osnr", changes)
    report = trajectory.reports["channels"]
    data = trajectory["channels"]
    (system,) = load_scenario("osnr", changes).system_objects()
    exact = variational_equilibrium(system.game, system.start)
    assert exact.multipliers[10] > 0.05, "the power limit is active"
    assert trajectory.status == "converged"
    assert report["worst_constraint"]["margin"] > 0, "at every integration step"
    assert np.linalg.norm(data["action"].to_numpy()[-1] - exact.action) < 1e-6
    assert float(data["total_power"].max()) < 2.5
    assert float(data["penalty"][0]) == 0.1
    assert float(data["penalty"][-1]) == 1e-9
    assert report["equilibrium"]["final_distance_to_variational"] < 1e-6


def test_an_explicit_law_stops_where_its_period_stops_it():
    """Below that floor the held law no longer keeps its own equilibrium."""
    changes = {
        "controller": {"information": "full", "mode": "sampled"},
        "plant.integrator": "euler",
        "barrier": {"rho": 1.0, "schedule": "exponential", "time_constant": 1.0},
        "simulation.timestep": 0.002,
        "simulation.duration": 20.0,
    }
    scenario = load_scenario("osnr", changes)
    (system,) = scenario.system_objects()
    assert 0.05 < system.rho < 0.5
    assert system.rho == pytest.approx(least_rho(system, 0.002), rel=0.05)
    assert linear_period(system, system.equilibrium.action) >= 0.0025 * (1 - 1e-9)
    allowed = run("osnr", changes)
    assert allowed.status == "converged"
    below = run("osnr", {**changes, "barrier.floor": system.rho / 20})
    assert below.status == "left_feasible_set"


def test_what_is_said_of_a_falling_penalty():
    scenario = load_scenario(
        "velocity-sync", {"barrier": {"rho": 1.0, "schedule": "reciprocal", "floor": 0.1}}
    )
    (system,) = scenario.system_objects()
    assert system.rho == 0.1
    report = certify(system, scenario.clock())
    assert report.status == "not certified"
    assert any("penalty changes in time" in sentence for sentence in report.not_certified)


@pytest.mark.parametrize(
    ("barrier", "words"),
    [
        ({"schedule": "linear"}, ["schedule", "'linear'"]),
        ({"schedule": "halving", "floor": 1.0}, ["barrier.floor", "rho(0)"]),
    ],
)
def test_schedules_that_cannot_be(barrier, words):
    with pytest.raises(InvalidInput) as error:
        load_scenario("velocity-sync", {"barrier": barrier}).system_objects()
    for word in words:
        assert word in str(error.value)


def test_the_adaptive_integrator_has_none():
    with pytest.raises(InvalidInput, match="does not change in time"):
        load_scenario("osnr", {"barrier": {"schedule": "halving"}}).system_objects()
