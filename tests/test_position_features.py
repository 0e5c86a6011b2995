"""Margins, faults, maps, environments, expressions: of position systems as of velocity systems."""

import numpy as np
import pytest

import gne_mj as gm
from gne_mj.environment import law_policy, load_environment
from gne_mj.exit_map import Grid, exit_map
from gne_mj.scenario import load_scenario

HELD = {
    "controller.mode": "implicit", "simulation.integrator": "euler", "simulation.timestep": 0.01,
    "simulation.control_period": 0.01, "simulation.duration": 2.0, "recording.period": 0.01,
}  # fmt: skip
TROUBLE = {
    "margin": {"push": 1.0, "noise": 0.002, "delay": 1},
    "faults": [
        {"type": "push", "force": 1.0, "profile": "square", "period": 0.6},
        {"type": "noise", "amplitude": 0.002},
        {"type": "sensor-delay", "periods": 1},
    ],
}


@pytest.mark.slow
@pytest.mark.parametrize("name", ["platoon", "formation"])
def test_pushed_with_noise_and_late_sensors_within_a_margin(name):
    scenario = load_scenario(name, {**HELD, **TROUBLE})
    found = gm.certify(scenario)
    assert found.status == "certified at control instants"
    assert found.held["largest_push"] >= 1.0
    run = gm.run(scenario)
    report, data = run.reports["robots"], run["robots"]
    assert report["status"] == "completed"
    assert report["positions"]["outside"] == 0
    assert report["contacts"]["count"] == 0
    # outputs come closer to the bounds than they were aimed at, but not beyond
    assert report["worst_constraint"]["margin"] > 0
    assert np.max(np.abs(data["measurement"] - data["action"])) > 1e-3
    (system,) = scenario.system_objects()
    assert np.all(system.game.constraints(data["position"].values) < 0)


def test_a_push_beyond_any_margin_is_seen_in_outputs_before_positions():
    """Positions follow outputs: at the instant at which an output leaves they are inside still."""
    push = {"faults": [{"type": "push", "agents": [3], "force": 60.0}]}
    run = gm.run("platoon", {**HELD, **push})
    report = run.reports["robots"]
    assert report["status"] == "left_feasible_set"
    assert "of agents" in report["exit"]["constraint"]
    assert report["positions"]["outside"] == 0


def test_a_map_of_periods_and_pushes():
    (system,) = load_scenario("platoon", HELD).system_objects()
    grid = Grid((0.01,), (1e-3, 0.3), (0.0, 60.0), runs=2, duration=0.4)
    cells = [cell for cell in exit_map(system, 0.01, grid) if cell.mode == "implicit"]
    assert {cell.share for cell in cells if cell.push == 0.0} == {0.0}
    assert max(cell.share for cell in cells if cell.push > 0.0) > 0.0


@pytest.mark.parametrize("name", ["platoon", "formation"])
def test_environments_observe_what_is_there_and_the_law_plays_them(name):
    scenario = load_scenario(name, {"simulation.duration": 0.1, "simulation.timestep": 0.01})
    environment = load_environment(scenario)
    step, (system,) = environment.reset(), scenario.system_objects()
    seen = step.observation
    assert np.allclose(seen["all/output"], system.start, rtol=0, atol=1e-12)
    assert np.allclose(seen["all/state"], system.state, rtol=0, atol=1e-12)
    if name == "platoon":
        assert np.allclose(seen["all/spacing"], -np.diff(system.start))
        assert np.allclose(seen["all/leader_place"], system.start[:1])
    else:
        assert seen["all/link_length"].shape == (4,)
        assert seen["all/region_share"].shape == (5,)
    policy = law_policy(system)
    while not step.last():
        step = environment.step(policy(step))
    assert environment.physics.exit is None
    positions = environment.physics.state[:, 3]
    assert np.all(system.game.constraints(positions) < 0)


def cost(i, y, p):
    ahead = 0.5 * (y[i - 1] - y[i] - 1.2) ** 2 if i else 0.0
    return 0.5 * (y[i] - p.wish[i]) ** 2 + ahead


def constraints(y, p):
    for i in range(1, len(y)):
        yield f"spacing {i}", y[i - 1] - y[i] >= 0.8
        yield f"link {i}", y[i - 1] - y[i] <= 3.0
    yield "lead", abs(y[0]) <= 5.0


def test_a_game_of_ones_own_over_positions():
    game = gm.game(4, cost, constraints, wish=[0.0, -1.0, -4.0, -4.5])
    robots = gm.flexible_robots(
        4, main_mass=[1.0, 2.0, 1.0, 1.5], output="position", lookahead=0.5,
        reference_velocity=2.0, contacts=True,
    )  # fmt: skip
    run = gm.run(
        game,
        {"plant.engine": "mujoco", "initial.velocity": [0.5, -0.5, 0.5, -0.5]},
        agents=robots, rho=0.05, duration=2.0,
    )  # fmt: skip
    report = run.reports["players"]
    assert report["status"] in ("completed", "converged")
    assert report["positions"]["outside"] == 0
    assert report["contacts"]["count"] == 0
    assert report["lyapunov"]["claimed"]
    assert report["lyapunov"]["monotone"]
    told = gm.certify(run).guaranteed
    assert "positions keep every shared constraint wherever outputs do so" in told
