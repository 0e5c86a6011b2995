"""Runs: statuses, certificates, what actuators deliver, and the loop of one's own."""

import signal
import threading
from dataclasses import dataclass

import numpy as np
import pytest
from builders import (
    EQUAL,
    FIVE,
    V0,
    clock,
    distributed,
    integrators,
    osnr_system,
    pi_cascades,
    reference_robots,
    robot_state,
    robot_system,
)

import reference
import reference_games
from gne_mj import graph as graphs
from gne_mj.controllers import FullInformation, FullyDistributed
from gne_mj.scenario import load_scenario, run
from gne_mj.simulation import Simulation
from gne_mj.system import Clock


def simulate(system, **options):
    return Simulation([system], Clock(**{**CLOCK, **options})).run()


CLOCK = {"duration": 20.0, "timestep": 0.01, "control_period": 0.01, "sample_period": 0.1}


@pytest.fixture(scope="module")
def exact():
    """States and inputs of the shipped robots at the step times, by DOP853."""
    game = reference_games.VelocityGame(V0, np.full(5, 3.0))
    robot = reference_robots(EQUAL)
    rate = reference.closed_loop_rate(robot, "full_information", game, 0.1)
    times = np.arange(0, 20.001, 0.01)
    states = reference.dop853(rate, robot_state(FIVE)[:, :3].ravel(), times, rtol=1e-11)
    states = states.reshape(-1, 5, 3)
    u = np.array([reference.full_information(game, 0.1, y) for y in states[:, :, 1]])
    return times, states, u


@pytest.mark.parametrize("engine", ["mujoco", "ode"])
def test_the_certificate_says_what_happened(engine, exact):
    times, states, u = exact
    trajectory = simulate(robot_system(robot_state(FIVE), engine=engine))
    report = trajectory.reports["robots"]
    assert trajectory.status == report["status"] == "converged"
    assert trajectory.holds

    distance = np.max(np.abs(states[::10, :, 1] - V0), axis=1)
    late = np.flatnonzero(distance > 0.02 * distance[0])[-1]
    assert report["settling_time"] == pytest.approx(0.1 * (late + 1))
    assert report["equilibrium"]["final_distance"] == pytest.approx(distance[-1], rel=1e-3)
    assert np.allclose(report["equilibrium"]["variational"], V0)

    actuators = report["actuators"]
    first = np.unravel_index(np.argmax(np.abs(u)), u.shape)
    assert actuators["peak"] == pytest.approx(np.max(np.abs(u)), rel=1e-6)
    assert actuators["peak_agent"] == first[1] + 1
    assert actuators["peak_time"] == pytest.approx(times[first[0]])
    rms = np.sqrt(np.trapezoid(u**2, times, axis=0) / 20)
    assert np.allclose(actuators["rms"], rms, rtol=1e-3)
    energy = np.trapezoid(u * states[:, :, 1], times, axis=0)
    assert np.allclose(actuators["energy"], energy, rtol=1e-3)
    assert actuators["saturated"] is None

    g = (np.diff(states[:, :, 1], axis=1, prepend=V0)) ** 2 - 9
    worst = np.unravel_index(np.argmax(g), g.shape)
    assert report["worst_constraint"]["margin"] == pytest.approx(-np.max(g), abs=1e-6)
    assert report["worst_constraint"]["index"] == worst[1] + 1
    assert report["lyapunov"]["claimed"]
    assert report["lyapunov"]["monotone"]
    assert report["steps"] == 2000

    data = trajectory["robots"]
    assert np.allclose(data["action"], states[::10, :, 1], atol=1e-6)
    assert np.allclose(data["extension"], states[::10, :, 0], atol=1e-6)
    assert np.allclose(data["input"], u[::10], atol=1e-5)
    distance_run = np.trapezoid(states[:, :, 1], times, axis=0)
    assert np.allclose(data["position"][-1] - data["position"][0], distance_run, atol=1e-3)
    assert np.allclose(data["gap"], np.diff(data["action"], axis=1, prepend=V0))
    assert data["time"].to_numpy()[-1] == pytest.approx(20.0)


def test_the_storage_function_is_the_papers(exact):
    _, states, _ = exact
    robot = reference_robots(EQUAL)
    rest = robot.equilibrium(np.full(5, V0))
    lyapunov = simulate(robot_system(robot_state(FIVE))).reports["robots"]["lyapunov"]
    assert lyapunov["start"] == pytest.approx(np.sum(robot.storage(states[0], rest)))
    assert lyapunov["final"] == pytest.approx(np.sum(robot.storage(states[-1], rest)), rel=1e-4)


@pytest.mark.parametrize("engine", ["mujoco", "ode"])
def test_step_shows_measurement_input_and_state(engine):
    system = robot_system(robot_state(FIVE), engine=engine)
    simulation = Simulation([system], Clock(**CLOCK))
    first = simulation.step()["robots"]
    assert first.time == 0.0
    assert np.array_equal(first.measurement, FIVE)
    assert np.allclose(first.input, [4.055, 2, 2.069444, -3, -3.044444], atol=1e-6)
    assert np.allclose(first.constraint, np.diff(FIVE, prepend=V0) ** 2 - 9)
    assert first.state.shape == (5, 4)
    second = simulation.step()["robots"]
    assert second.time == pytest.approx(0.01)
    for _ in range(8):
        simulation.step()
    assert simulation.time == pytest.approx(0.1)
    rest = simulation.run()["robots"]
    whole = simulate(system)["robots"]
    assert rest["time"].to_numpy()[0] == pytest.approx(0.1)
    assert np.array_equal(rest["action"].to_numpy(), whole["action"].to_numpy()[1:])


def test_an_input_limit_saturates_and_is_reported():
    report = simulate(robot_system(robot_state(FIVE), limit=2.5)).reports["robots"]
    saturated = report["actuators"]["saturated"]
    assert saturated == {"agent": 1, "time": 0.0, "demand": pytest.approx(4.055), "limit": 2.5}
    assert report["actuators"]["peak"] == pytest.approx(4.055)
    assert max(report["actuators"]["rms"]) <= 2.5
    assert not report["lyapunov"]["claimed"]
    data = simulate(robot_system(robot_state(FIVE), limit=2.5, engine="mujoco"))["robots"]
    assert np.max(np.abs(data["input"])) == 2.5


def test_completed_when_time_is_too_short():
    report = simulate(robot_system(robot_state(FIVE)), duration=1.0).reports["robots"]
    assert report["status"] == "completed"
    assert report["settling_time"] is None
    assert "from the penalised equilibrium" in report["message"]


def test_leaving_the_set_is_a_status_with_its_sentence():
    state = robot_state(FIVE, appendage=FIVE - 9.0 * np.array([1, 0, 0, 0, 0]))
    for engine in ("mujoco", "ode"):
        system = robot_system(
            state, engine=engine, mode="sampled", integrator="euler", delta=2.2, rho=1e-3
        )
        trajectory = simulate(system, timestep=0.05, control_period=0.5)
        report = trajectory.reports["robots"]
        assert trajectory.status == "left_feasible_set"
        assert not trajectory.holds
        assert "constraint 'gap of agent 1' was violated at" in report["message"]
        assert report["worst_constraint"]["margin"] <= 0
        assert report["worst_gap"]["gap"] >= report["worst_gap"]["bound"]
        data = trajectory["robots"]
        assert np.max(data["constraint"].to_numpy()[-1]) >= 0
        assert np.all(data["constraint"].to_numpy()[:-1] < 0)
        assert np.all(np.isnan(data["input"].to_numpy()[-1]))


@pytest.mark.slow
def test_the_printed_spring_diverges():
    """With psi(x) = -x - atan(x), as the paper prints it, the extension grows without bound."""
    numbers = {**EQUAL, "stiffness": [-1.0] * 5, "atan_coefficient": [-1.0] * 5}
    for engine in ("mujoco", "ode"):
        system = robot_system(robot_state(FIVE, extension=0.1), numbers, engine=engine)
        trajectory = simulate(system, duration=200.0)
        assert trajectory.status in ("diverged", "left_feasible_set", "step_too_small")
        assert not trajectory.holds
        assert not trajectory.reports["robots"]["lyapunov"]["claimed"]


def test_systems_do_not_wait_for_one_that_left():
    leaving = robot_system(robot_state(V0 + np.array([-2.9999999, 0.0, 0.0, 0.0, 0.0])))
    channels = osnr_system(integrators(10), FullInformation(), 0.2)
    trajectory = Simulation([leaving, channels], Clock(20.0, 0.001, 0.001, 0.1)).run()
    assert trajectory.status == "step_too_small"
    assert trajectory.reports["channels"]["status"] == "converged"
    assert trajectory["channels"]["time"].to_numpy()[-1] == pytest.approx(20.0)
    assert trajectory["robots"]["time"].to_numpy()[-1] < 20.0


@pytest.mark.parametrize(
    "agents",
    [
        pytest.param(integrators(10), id="int", marks=pytest.mark.slow),
        pytest.param(pi_cascades(10), id="pi"),
    ],
)
@pytest.mark.parametrize("mode", ["continuous", "sampled"])
@pytest.mark.parametrize("law", ["full", "distributed"])
def test_osnr_under_every_law_ends_at_the_same_equilibrium(agents, mode, law):
    chosen = FullInformation() if law == "full" else distributed(gain=0.05)
    integrator = "rosenbrock" if (law, mode) == ("distributed", "continuous") else "rk4"
    system = osnr_system(agents, chosen, 0.2, mode=mode, integrator=integrator)
    trajectory = simulate(system, duration=200.0, timestep=0.001, control_period=0.001)
    report = trajectory.reports["channels"]
    assert report["status"] == "converged", report["message"]
    assert report["equilibrium"]["final_distance"] < 1e-6
    assert report["epsilon"]["measured"] <= report["epsilon"]["largest_own_p_rho"]
    data = trajectory["channels"]
    if law == "distributed":
        assert data["estimate"].shape == (2001, 10, 10)
        own = np.einsum("tii->ti", data["estimate"].to_numpy())
        assert np.array_equal(own, data["action"].to_numpy())


@dataclass(frozen=True, eq=False)
class WildGuess(FullyDistributed):
    """Agent 1 starts with a wild idea of agent 3, which it does not need but passes on."""

    def initial_memory(self, y):
        memory = super().initial_memory(y)
        memory[2] = V0 + 100.0
        return memory


@pytest.mark.parametrize("integrator", [pytest.param("rosenbrock", marks=pytest.mark.slow), "rk4"])
def test_an_estimate_that_leaves_is_a_status_of_its_own(integrator):
    state = robot_state(np.full(4, V0))
    numbers = {name: values[:4] for name, values in EQUAL.items()}
    law = WildGuess(graphs.ring(4), epsilon=0.1)
    system = robot_system(state, numbers, law=law, integrator=integrator)
    trajectory = simulate(system, timestep=0.001, control_period=0.001)
    report = trajectory.reports["robots"]
    assert report["status"] == "estimate_left_feasible_set"
    assert "agent 2's estimates violated constraint 'gap of agent 3'" in report["message"]
    assert report["worst_constraint"]["margin"] > 0
    assert 0 < report["end_time"] < 1.0


def test_ctrl_c_keeps_what_was_done():
    simulation = load_scenario("velocity-sync", {"simulation.duration": 2000}).simulation_object()
    simulation.step()  # compiled by now
    timer = threading.Timer(0.7, signal.raise_signal, [signal.SIGINT])
    timer.start()
    trajectory = simulation.run()
    timer.join()
    assert trajectory.status == "interrupted"
    assert not trajectory.holds
    assert 0 < trajectory["robots"]["time"].to_numpy()[-1] < 2000
    assert signal.getsignal(signal.SIGINT) is signal.default_int_handler


def test_a_run_goes_on_after_an_interruption():
    changes = {"simulation.duration": 2000, "plant.engine": "ode"}
    simulation = load_scenario("velocity-sync", changes).simulation_object()
    simulation.step()
    timer = threading.Timer(0.3, signal.raise_signal, [signal.SIGINT])
    timer.start()
    first = simulation.run()
    timer.join()
    assert first.status == "interrupted"
    whole = simulation.run()
    assert whole.status == "converged"
    times = whole["robots"]["time"].to_numpy()
    assert np.all(np.diff(times) > 0)
    assert np.allclose(np.diff(times[:-1]), 0.05)
    assert times[-1] == pytest.approx(2000)


def test_a_run_that_never_began_claims_nothing():
    report = simulate(robot_system(robot_state(FIVE), rho=1e15)).reports["robots"]
    assert report["status"] == "diverged"
    assert report["worst_constraint"] is None
    assert report["worst_gap"] is None
    assert not report["lyapunov"]["claimed"]


def test_running_twice_gives_the_same_bits():
    first, second = (
        run("paper", {"simulation.duration": 3}),
        run("paper", {"simulation.duration": 3}),
    )
    for name in ("robots", "channels"):
        assert first[name].drop_attrs().identical(second[name].drop_attrs())


def test_both_systems_share_the_clock():
    trajectory = run("paper", {"simulation.duration": 3})
    assert np.array_equal(trajectory["robots"]["time"], trajectory["channels"]["time"])
    assert clock(0.002, 3.0).steps(3.0) == trajectory.reports["robots"]["steps"]
