"""Batches: every run as it would be alone, whatever happens to threads and chunks."""

import mujoco
import numpy as np
import pytest
from batch_plans import CASES, ODE, ROOT, SLOW, all_chunks, assert_same, plan_of

from gne_mj.batches import Sweep, make_plan
from gne_mj.batches import chunk as chunks
from gne_mj.batches.chunk import Runner
from gne_mj.errors import InfeasibleStart, UserCodeError
from gne_mj.plants.fleet import compile_model, compose


def check_as_alone(name):
    """Bit for bit: threads, chunks, and every run alone through the ordinary simulation."""
    plan = plan_of(name, chunk=1000)
    whole = all_chunks(plan, 2)
    assert_same(whole, all_chunks(plan, 1))
    assert_same(whole, all_chunks(plan_of(name, chunk=2), 2))
    statuses = set()
    for run in range(0, plan.runs, 2):
        trajectory = plan.alone(run).simulation_object().run()
        data, report = trajectory[plan.name], trajectory.reports[plan.name]
        statuses.add(report["status"])
        assert whole["status"][1][run] == report["status"]
        assert whole["least_margin"][1][run] == report["worst_constraint"]["margin"]
        assert whole["least_margin_constraint"][1][run] == report["worst_constraint"]["index"]
        assert whole["least_margin_time"][1][run] == report["worst_constraint"]["time"]
        assert whole["peak_input"][1][run] == report["actuators"]["peak"]
        assert whole["rms_input"][1][run].tolist() == report["actuators"]["rms"]
        assert whole["energy"][1][run].tolist() == report["actuators"]["energy"]
        rise = report["lyapunov"]["largest_rise"]
        assert whole["lyapunov_rise"][1][run] == pytest.approx(rise, rel=1e-6, abs=1e-12)
        assert whole["steps"][1][run] == report["steps"]
        if report["division"] is not None:
            smallest = whole["smallest_step"][1][run]
            assert whole["divided_steps"][1][run] == report["division"]["divided_steps"]
            assert (None if np.isnan(smallest) else smallest) == report["division"]["smallest_step"]
            statuses.update(["divided"] * (report["division"]["divided_steps"] > 0))
        settled = whole["settling_time"][1][run]
        inside = report["exit"] is None
        if inside:
            assert (None if np.isnan(settled) else settled) == report["settling_time"]
            # y* is solved for from another start there, so that its last digits may differ
            assert whole["final_error"][1][run] == pytest.approx(
                report["equilibrium"]["final_distance"], abs=1e-12
            )
            assert np.isnan(whole["exit_time"][1][run])
        else:
            assert whole["exit_time"][1][run] == report["exit"]["time"]
            assert whole["exit_value"][1][run] == report["exit"]["value"]
            assert whole["exit_at_instant"][1][run] == report["exit"]["at_control_instant"]
            names = plan.combination(0).system.game.constraint_names
            number = int(whole["exit_constraint"][1][run]) - 1
            assert names[number] == report["exit"]["constraint"]
            assert np.isnan(settled)
        for variable in set(whole) & set(data.data_vars) | {"constraint"}:
            if whole[variable][0][:2] == ("run", "time"):
                rows = len(data["time"]) - (not inside)  # the last one of an exit is outside
                recorded = whole[variable][1][run]
                np.testing.assert_array_equal(
                    recorded[:rows], data[variable].to_numpy()[:rows], err_msg=variable
                )
                assert np.all(np.isnan(recorded[rows + (not inside) :]))
    return statuses


@pytest.mark.parametrize("name", CASES)
def test_every_run_is_as_it_would_be_alone(name):
    statuses = check_as_alone(name)
    assert ("left_feasible_set" in statuses) == ("leave" in name)
    if name == "divided steps":
        assert "divided" in statuses


@pytest.mark.slow
@pytest.mark.parametrize("name", SLOW)
def test_every_run_is_as_it_would_be_alone_for_all_laws_and_plants(name):
    check_as_alone(name)


def test_robots_of_every_row_are_those_that_composing_anew_would_make():
    plan = plan_of("robots", chunk=1)
    runner = Runner(plan, 1)
    for run in range(0, plan.runs, 5):
        runner.run(run)
        (structure,) = runner._structures.values()
        (fleet,) = structure.loop._fleets
        scenario = plan.alone(run)
        numbers = scenario.system_objects()[0].agents.parameters
        lane = compose(numbers, decorated=False)
        model = compile_model(lane, timestep=0.01, integrator="RK4")
        found = fleet.plant.model
        for field in (
            "body_mass", "body_subtreemass", "body_inertia", "dof_M0", "tendon_stiffness",
            "tendon_damping", "tendon_lengthspring", "body_pos", "jnt_stiffness", "dof_damping",
        ):  # fmt: skip
            np.testing.assert_array_equal(getattr(found, field), getattr(model, field), field)


def test_a_batch_restores_mujocos_callbacks():
    Runner(plan_of("robots", chunk=1000), 2).run(0)
    assert mujoco.get_mjcb_control() is None
    assert mujoco.get_mjcb_passive() is None


def test_a_failing_function_of_ones_own_is_told(tmp_path):
    text = (ROOT / "examples" / "game" / "charging_plain.py").read_text()
    assert "def cost_gradient(q, i, a, y):\n" in text
    text = text.replace(
        "def cost_gradient(q, i, a, y):\n",
        "calls = []\ndef cost_gradient(q, i, a, y):\n    calls.append(1)\n"
        "    if len(calls) > 3000: raise ZeroDivisionError('mine')\n",
    )
    (tmp_path / "charging_plain.py").write_text(text)
    scenario = (ROOT / "examples" / "game" / "scenario.toml").read_text()
    (tmp_path / "s.toml").write_text(scenario.replace("charging_fast", "charging_plain"))
    changes = {"simulation.duration": 20.0, "agents": {"type": "integrator", "count": 6}}
    plan = make_plan(tmp_path / "s.toml", changes, starts=3)
    with pytest.raises(UserCodeError, match="mine"):
        Runner(plan, 2).run(0)


def test_a_stop_is_heard_in_the_middle_of_runs():
    """Of a million seconds each, which no test waits for."""
    endless = {**ODE, "simulation.duration": 1e6, "recording.period": 1e5}
    for changes in (endless, {**endless, "plant.engine": "mujoco"}):
        plan = make_plan("velocity-sync", changes, starts=4, chunk=4)
        asked = []
        assert Runner(plan, 2).run(0, lambda asked=asked: asked.append(1) or len(asked) > 6) is None


def test_estimates_that_are_given_may_make_a_start_infeasible():
    law = {"information": "distributed", "epsilon": 0.1, "graph": "complete", "mode": "sampled"}
    given = {"controller": law, "initial.estimate": 3.0}
    plan = make_plan("velocity-sync", {**ODE, **given}, starts=8, spread=0.99, chunk=8)
    found = Runner(plan, 1).run(0)
    refused = found["status"][1] == "infeasible_start"
    assert 0 < np.sum(refused) < 8
    np.testing.assert_array_equal(np.isnan(found["least_margin"][1]), refused)
    for run in range(8):
        if refused[run]:
            with pytest.raises(InfeasibleStart):
                plan.alone(run).system_objects()
        else:
            report = plan.alone(run).simulation_object().run().reports["robots"]
            assert report["worst_constraint"]["margin"] == found["least_margin"][1][run]


def test_a_runner_keeps_so_many_combinations_and_not_more(monkeypatch):
    monkeypatch.setattr(chunks, "_COMBINATIONS", 2)
    plan = make_plan("velocity-sync", ODE, sweeps=[Sweep("barrier.rho", (0.1, 0.2, 0.3, 0.4))])
    runner = Runner(plan, 1)
    for chunk in range(plan.chunks):
        runner.run(chunk)
    assert [number for number, _ in runner._prepared] == [2, 3]
