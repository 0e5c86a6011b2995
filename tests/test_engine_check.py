"""Batches of ODE twins of which some runs are made in MuJoCo too."""

import numpy as np
import pytest
from batch_plans import ODE

import gne_mj
from gne_mj.batches import Store, Sweep, execute, make_plan, parse_share
from gne_mj.batches.engine_check import STATES, SUMMARIES, _greatest
from gne_mj.batches.report import check_of, checked, figures_of

SAME = 1e-11


def plan_of(**options):
    sweeps = [Sweep("barrier.rho", (0.1, 1.0))]
    return make_plan("velocity-sync", ODE, sweeps=sweeps, starts=5, record=1, **options)


def stored(folder, plan):
    store = Store.create(folder, plan)
    execute(store, threads=2)
    return figures_of(store), store.dataset().load()


def test_some_runs_are_made_in_mujoco_too_and_are_the_same(tmp_path):
    plan = plan_of(check_in_mujoco=0.4, chunk=3)
    assert len(plan.checked) == len(set(plan.checked.tolist())) == 4
    runs, whole = stored(tmp_path / "a", plan)
    made = np.flatnonzero(runs[STATES].notnull())
    np.testing.assert_array_equal(made, plan.checked)
    assert max(runs[STATES].max(), runs[SUMMARIES].max()) <= SAME
    for run in made:  # by the ordinary simulation
        alone = gne_mj.run(plan.alone(int(run)), {"plant.engine": "mujoco"})["robots"]
        names = ("extension", "action", "appendage_velocity", "position")
        apart = max(
            float(np.max(np.abs(alone[name].values - whole[name].values[run]))) for name in names
        )
        assert apart == pytest.approx(float(runs[STATES][run]), abs=1e-15)
    check = check_of(runs)
    assert check["runs"] == 4
    assert check["state_difference"] == float(runs[STATES].max())
    assert check["state_difference_run"] in plan.checked
    assert "4 runs; states differ by" in checked(check)


def test_which_runs_are_checked_follows_from_the_seed_alone(tmp_path):
    plan, other = plan_of(check_in_mujoco=0.3, chunk=1), plan_of(check_in_mujoco=0.3, seed=1)
    assert plan.checked.tolist() != other.checked.tolist()
    assert plan_of().checked.size == 0
    assert "check_in_mujoco" not in plan_of().manifest()
    begun = Store.create(tmp_path / "a", plan)
    looks = iter([False] * 5)
    assert not execute(begun, threads=1, stopped=lambda: next(looks, True)).complete
    execute(Store.continued(tmp_path / "a"), threads=2)
    again, _ = stored(tmp_path / "b", plan_of(check_in_mujoco=0.3, chunk=4))
    for name in (STATES, SUMMARIES):
        np.testing.assert_array_equal(figures_of(begun)[name], again[name])


def test_runs_that_end_in_one_engine_only_are_told():
    one, other = np.array([[1.0, np.nan], [np.nan, 2.0]]), np.array([[1.5, np.nan], [1.0, 2.0]])
    np.testing.assert_array_equal(_greatest(one, other), [0.5, np.inf])
    check = {"runs": 3, "ended_differently": 1, "state_difference": None}
    assert checked(check) == "checked in MuJoCo: 3 runs; 1 ended differently"


def test_a_share_is_a_number_or_a_percentage():
    assert [parse_share(each) for each in ("1%", 0.25, "0.5", 1, "0")] == [0.01, 0.25, 0.5, 1, 0]
