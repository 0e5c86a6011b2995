"""Batches: every run as it would be alone, whatever happens to threads, chunks and processes."""

import datetime
import json
import os
import shutil
import signal
import socket
import subprocess
import sys
import time
from contextlib import contextmanager
from pathlib import Path

import mujoco
import numpy as np
import pytest
import xarray
from hypothesis import given
from hypothesis import strategies as st

import gne_mj
from gne_mj.batches import (
    Plan,
    Progress,
    Store,
    Sweep,
    cluster,
    execute,
    make_plan,
    parse_sweep,
    run_batch,
)
from gne_mj.batches.chunk import Runner
from gne_mj.batches.report import combinations
from gne_mj.batches.summary import join
from gne_mj.cli import main
from gne_mj.errors import InfeasibleStart, InvalidInput, StorageError, UserCodeError
from gne_mj.games import osnr_game, ten_channels, velocity_game
from gne_mj.plants.fleet import compile_model, compose
from gne_mj.starts import interior_profile, random_starts

SHORT = {"simulation.duration": 1.0, "simulation.timestep": 0.01, "recording.period": 0.1}
ODE = {**SHORT, "plant.engine": "ode"}
ROOT = Path(__file__).parent.parent

# name: scenario, changes, sweeps. Between them all engines, laws, modes, faults and dimensions.
CASES = {
    "robots": (
        "velocity-sync",
        SHORT,
        [
            Sweep("barrier.rho", (0.1, 1.0)),
            Sweep("agents.main_mass", (1.0, 2.5)),
            Sweep("agents.stiffness", (0.5, 3.0)),
            Sweep("game.reference_velocity", (3.0, 2.0)),
        ],
    ),
    "periods that leave": (
        "velocity-sync",
        {**SHORT, "controller.mode": "sampled", "simulation.duration": 2.0},
        [Sweep("simulation.control_period", (0.01, 0.5, 1.0))],
    ),
    "steps": (
        "velocity-sync",
        {**SHORT, "controller.mode": "sampled", "simulation.control_period": 0.1},
        [Sweep("simulation.timestep", (0.01, 0.005))],
    ),
    "first steps that leave": (
        "desired-velocity",
        {"simulation.duration": 0.1, "plant.engine": "ode"},
        [Sweep("barrier.rho", (0.1, 0.2))],
    ),
    "twin": ("velocity-sync", ODE, [Sweep("controller.mode", ("continuous", "sampled"))]),
}
SLOW = {
    "a start's seed is the scenario's": (
        "disturbed",
        {"simulation.duration": 0.5, "simulation.seed": 1153240287915889},
        [Sweep("barrier.rho", (0.1,))],
    ),
    "partial information": (
        "velocity-sync",
        {**SHORT, "controller": {"information": "partial", "graph": "ring"}},
        [Sweep("controller.coupling", (1.0, 2.0)), Sweep("controller.graph", ("ring", "line"))],
    ),
    "implicit": (
        "velocity-sync",
        {**SHORT, "controller.mode": "implicit", "simulation.control_period": 0.05},
        [Sweep("barrier.rho", (0.1, 1.0)), Sweep("controller.mode", ("implicit", "sampled"))],
    ),
    "faults": ("disturbed", {"simulation.duration": 1.0}, [Sweep("barrier.rho", (0.1, 1.0))]),
    "plane": ("planar-sync", {"simulation.duration": 1.0}, [Sweep("agents.main_mass", (1.0, 2.0))]),
    "adaptive steps": ("osnr", {"simulation.duration": 1.0}, [Sweep("barrier.rho", (0.1, 0.2))]),
    "firms": ("cournot", {"simulation.duration": 1.0}, [Sweep("barrier.rho", (1.0, 2.0))]),
    "own robots": (
        str(ROOT / "examples" / "robot" / "scenario.toml"),
        {"simulation.duration": 0.5},
        [Sweep("barrier.rho", (0.1, 0.2))],
    ),
    "own robots, implicit": (
        str(ROOT / "examples" / "robot" / "scenario.toml"),
        {"simulation.duration": 0.5, "controller.mode": "implicit"},
        [Sweep("barrier.rho", (0.1, 0.2))],
    ),
}


def plan_of(name, **options):
    source, changes, sweeps = {**CASES, **SLOW}[name]
    return make_plan(source, changes, sweeps=sweeps, **{"starts": 3, "record": 1, **options})


def all_chunks(plan, threads):
    runner = Runner(plan, threads)
    return join([runner.run(chunk) for chunk in range(plan.chunks)])


def assert_same(one, two):
    assert one.keys() == two.keys()
    for name in one:
        assert one[name][0] == two[name][0]
        np.testing.assert_array_equal(one[name][1], two[name][1], err_msg=name)


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


@pytest.mark.slow
@pytest.mark.parametrize("name", SLOW)
def test_every_run_is_as_it_would_be_alone_for_all_laws_and_plants(name):
    check_as_alone(name)


def test_robots_of_every_row_are_those_that_composing_anew_would_make():
    plan = plan_of("robots", chunk=1000)
    runner = Runner(plan, 1)
    runner.run(0)
    (structure,) = runner._structures.values()
    batch = structure.loop._batch
    for run in range(0, plan.runs, 5):
        scenario = plan.alone(run)
        numbers = scenario.system_objects()[0].agents.parameters
        lane = compose(numbers, decorated=False)
        model = compile_model(lane, timestep=0.01, integrator="RK4")
        found = batch.get_model(run)
        for field in (
            "body_mass", "body_subtreemass", "body_inertia", "dof_M0", "tendon_stiffness",
            "tendon_damping", "tendon_lengthspring", "body_pos", "jnt_stiffness", "dof_damping",
        ):  # fmt: skip
            np.testing.assert_array_equal(getattr(found, field), getattr(model, field), field)


def test_a_batch_restores_mujocos_callbacks():
    Runner(plan_of("robots", chunk=1000), 2).run(0)
    assert mujoco.get_mjcb_control() is None
    assert mujoco.get_mjcb_passive() is None


# Starts


@given(st.integers(0, 2**32), st.floats(0.01, 0.999), st.integers(1, 6))
def test_random_starts_are_inside_and_not_beyond_the_spread(seed, spread, count):
    game = velocity_game(count, 3.0, np.linspace(0.5, 3.0, count))
    middle = np.full(count, 3.0)
    starts = random_starts(game, middle, range(seed, seed + 20), spread)
    assert np.all(game.constraints(starts) < 0)
    # scaled up by 1 / spread they are inside still: none lies farther than that share of the way
    assert np.all(game.constraints(middle + (starts - middle) / spread * (1 - 1e-9)) < 1e-9)


def test_a_start_has_one_direction_in_all_games():
    wide, narrow = velocity_game(3, 3.0, 3.0), velocity_game(3, 3.0, 0.1)
    one, two = (random_starts(g, np.full(3, 3.0), [7, 8], 0.5) - 3.0 for g in (wide, narrow))
    np.testing.assert_allclose(one, 30.0 * two, rtol=1e-9)


def test_random_starts_reach_all_around():
    """Uniform in a disc, of which a quarter lies within half of the radius."""
    game = velocity_game(2, 0.0, 1.0)
    found = random_starts(game, np.zeros(2), range(4000), 0.999)
    gaps = np.stack([found[:, 0], found[:, 1] - found[:, 0]])
    share = np.max(np.abs(gaps), axis=0)
    assert abs(np.mean(share < 0.5) - 0.25) < 0.03
    assert np.all(np.abs(np.mean(found, axis=0)) < 0.05)


def test_where_a_set_has_no_boundary_starts_stay_near():
    game = osnr_game(**{**ten_channels(), "total_power_limit": 1e6})
    found = random_starts(game, np.full(10, 0.2), range(50), 0.9)
    assert np.all(game.constraints(found) < 0)
    assert np.max(np.abs(found)) < 50


@pytest.mark.parametrize("shift", [0.0, 50.0])
def test_an_interior_profile_is_found_from_outside(shift):
    game = velocity_game(5, 3.0, 0.5)
    outside = np.array([1.0, 0.0, -1.0, 0.5, 2.0]) + shift
    assert np.any(game.constraints(outside) > 0)
    assert np.all(game.constraints(interior_profile(game, outside)) < 0)


def test_a_sweep_may_make_the_scenarios_own_start_infeasible():
    bounds = Sweep("game.gap_bound", (0.4, 3.0))
    with_random = make_plan("velocity-sync", ODE, sweeps=[bounds], starts=4)
    assert set(all_chunks(with_random, 1)["status"][1]) == {"completed"}
    own = make_plan("velocity-sync", ODE, sweeps=[bounds])
    found = all_chunks(own, 1)
    assert found["status"][1].tolist() == ["infeasible_start", "completed"]
    assert np.isnan(found["least_margin"][1][0])


# Sweeps and plans


@pytest.mark.parametrize(
    ("text", "values"),
    [
        ("barrier.rho=0.01:1:3log", (0.01, 0.1, 1.0)),
        ("barrier.rho=0:1:5", (0.0, 0.25, 0.5, 0.75, 1.0)),
        ("controller.coupling=1,2,5", (1, 2, 5)),
        ("controller.graph=ring,line", ("ring", "line")),
        ("game.gap_bound=[1.0, 2.0],[3.0, 4.0]", ([1.0, 2.0], [3.0, 4.0])),
        ("plant.engine=ode", ("ode",)),
    ],
)
def test_a_sweep_is_read(text, values):
    sweep = parse_sweep(text)
    assert sweep.key == text.partition("=")[0]
    assert sweep.values == values


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("barrier.rho", "it must read KEY"),
        ("barrier.rho=", "it must read KEY"),
        ("barrier.rho=0:1:5log", "must be positive"),
        ("barrier.rho=0:1:1", "at least two"),
        ("barrier.rho=1,1", "once only"),
    ],
)
def test_a_sweep_that_makes_no_sense_is_refused(text, words):
    with pytest.raises(InvalidInput, match=words):
        parse_sweep(text)


@given(st.lists(st.integers(1, 4), max_size=3), st.integers(0, 5))
def test_runs_and_combinations_correspond(lengths, starts):
    keys = ("barrier.rho", "agents.damping", "game.gap_bound")
    sweeps = [
        Sweep(key, [1.0 + n for n in range(length)])
        for key, length in zip(keys, lengths, strict=False)
    ]
    plan = make_plan("velocity-sync", ODE, sweeps=sweeps, starts=starts, chunk=7)
    seen = set()
    labels = plan.labels()
    for run in range(plan.runs):
        number, start = plan.of_run(run)
        changes = plan.changes(number)
        assert all(labels[key][run] == value for key, value in changes.items())
        seen.add((*changes.values(), start))
    assert len(seen) == plan.runs == max(starts, 1) * int(np.prod(lengths))
    again = Plan.from_manifest(json.loads(json.dumps(plan.manifest())))
    assert again.manifest() == plan.manifest()


@pytest.mark.parametrize(
    ("one", "other"),
    [
        ("barrier.rho", "robots.barrier.rho"),
        ("barrier.rho", "systems.robots.barrier.rho"),
        ("barrier", "barrier.rho"),
        ("systems.robots.barrier.rho", "systems.robots.barrier"),
    ],
)
def test_one_key_is_not_swept_twice_under_two_names(one, other):
    values = {True: [1.0, 2.0], False: [{"rho": 1.0}, {"rho": 2.0}]}
    sweeps = [Sweep(key, values[key.endswith("rho")]) for key in (one, other)]
    with pytest.raises(InvalidInput, match="swept already"):
        make_plan("velocity-sync", ODE, sweeps=sweeps)


@pytest.mark.parametrize(
    ("key", "values", "words"),
    [
        ("recording", [{"period": 0.1}, {"period": 0.2}], "same recording period"),
        ("simulation", [{"duration": 1.0}, {"duration": 2.0}], "same duration"),
        ("simulation", [{"duration": 1.0, "seed": 1}, {"duration": 1.0}], "same seed"),
    ],
)
def test_what_runs_share_is_not_swept_by_a_whole_table(key, values, words, tmp_path):
    with pytest.raises(InvalidInput, match=words):
        run_batch("velocity-sync", {key: values}, out=tmp_path / "a")


def test_values_are_pythons_own():
    values = (np.float64(0.5), np.array([1.0, 2.0]), (3, 4), np.int64(2))
    assert Sweep("key", values).values == (0.5, [1.0, 2.0], [3, 4], 2)
    assert Sweep("key", np.array([1.0, 2.0])).values == (1.0, 2.0)


@pytest.mark.parametrize(
    ("values", "words"),
    [
        (0.1, "must be a list"),
        ("ring", "must be a list"),
        ([datetime.date(1979, 5, 27)], "a number, a word, a list or a table"),
        ([float("nan")], "finite"),
        (range(200_000), "at most"),
    ],
)
def test_values_that_no_scenario_can_hold_are_refused(values, words):
    with pytest.raises(InvalidInput, match=words):
        Sweep("barrier.rho", values)


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"runs": "3"}, "--runs: got '3'"),
        ({"runs": 2.5}, "--runs: got 2.5"),
        ({"runs": 10**12}, "10000000 runs at most"),
        ({"seed": -1}, "--seed: got -1"),
        ({"record": "some"}, "--record: got 'some'"),
        ({"record": 1.5}, "--record: got 1.5"),
        ({"spread": "0.5"}, "--spread"),
        ({"threads": -1}, "--threads: got -1"),
    ],
)
def test_options_that_make_no_sense_are_refused(options, words, tmp_path):
    with pytest.raises(InvalidInput, match=words):
        run_batch("velocity-sync", changes=ODE, out=tmp_path / "a", **options)


def test_numpys_whole_numbers_will_do(tmp_path):
    runs = run_batch(
        "velocity-sync", changes=ODE, out=tmp_path / "a", runs=np.int64(2), seed=np.int64(3)
    )
    assert runs.sizes["run"] == 2


def test_rows_in_memory_are_bounded():
    fine = {**ODE, "simulation.duration": 600.0, "recording.period": 0.01}
    plan = make_plan("velocity-sync", fine, starts=100_000)
    assert 1 <= plan.chunk < 20
    assert make_plan("velocity-sync", ODE, starts=100_000).chunk == 256


@pytest.mark.parametrize(
    ("sweep", "words"),
    [
        (Sweep("barrier.roh", (1.0,)), "did you mean 'rho'"),
        (Sweep("barrier.rho", (0.1, -1.0)), "greater than 0.*with barrier.rho = -1"),
        (Sweep("simulation.duration", (1.0, 2.0)), "last as long"),
        (Sweep("agents.count", (5, 6)), "agents|same ones"),
    ],
)
def test_a_sweep_that_does_not_fit_is_refused_before_anything_is_written(sweep, words, tmp_path):
    with pytest.raises(InvalidInput, match=words):
        run_batch("velocity-sync", {sweep.key: sweep.values}, changes=ODE, out=tmp_path / "a")
    assert list(tmp_path.iterdir()) == []


def test_of_several_systems_one_must_be_named():
    with pytest.raises(InvalidInput, match="robots, channels"):
        make_plan("paper")
    assert make_plan("paper", system="channels").name == "channels"


# The store


def small(tmp_path, name="a", **options):
    plan = make_plan(
        "velocity-sync", ODE, sweeps=[Sweep("barrier.rho", (0.1, 0.3, 1.0))],
        **{"starts": 4, "chunk": 5, **options},
    )  # fmt: skip
    return Store.create(tmp_path / name, plan)


def contents(folder):
    """Every file of a store, with its bytes."""
    return {
        str(path.relative_to(folder)): path.read_bytes()
        for path in sorted(folder.rglob("*"))
        if path.is_file()
    }


def test_the_store_is_read_by_xarray_alone(tmp_path):
    store = small(tmp_path, record=2)
    execute(store, threads=1)
    program = (
        "import sys, xarray\n"
        f"runs = xarray.open_dataset({str(store.folder / 'runs.zarr')!r}, engine='zarr')\n"
        "assert 'gne_mj' not in sys.modules\n"
        "worst = runs['least_margin'].groupby('barrier.rho').min()\n"
        "print(runs['action'].dims, runs.sizes['run'], worst.size, runs['time'].values[-1])\n"
    )
    printed = subprocess.run(
        [sys.executable, "-c", program], capture_output=True, text=True, check=True
    ).stdout
    assert printed.split("\n")[0] == "('run', 'time', 'agent') 12 3 1.0"


def test_a_dataset_says_what_each_run_was(tmp_path):
    store = small(tmp_path, record=3)
    execute(store, threads=2)
    runs = store.dataset()
    assert not runs["final_error"]._in_memory, "values are read when they are used"
    assert runs["barrier.rho"].values.tolist() == [0.1] * 4 + [0.3] * 4 + [1.0] * 4
    assert runs["start"].values.tolist() == [0, 1, 2, 3] * 3
    assert len(set(runs["seed"].values.tolist())) == 4
    np.testing.assert_allclose(runs["time"], [0.0, 0.3, 0.6, 0.9, 1.0])
    assert runs["action"].shape == (12, 5, 5)
    assert np.all(runs["status"] == "completed")
    grid = runs[["final_error"]].set_index(run=["barrier.rho", "start"]).unstack("run")
    assert dict(grid.sizes) == {"barrier.rho": 3, "start": 4}


def test_summaries_are_the_same_with_and_without_samples(tmp_path):
    kept, dropped = small(tmp_path, record=1), small(tmp_path, "b", record=0)
    execute(kept, threads=1)
    execute(dropped, threads=1)
    one, two = kept.dataset(), dropped.dataset()
    assert "action" in one
    assert "action" not in two
    for name in two.data_vars:
        xarray.testing.assert_equal(one[name].drop_vars("time", errors="ignore"), two[name])


def test_a_chunk_is_there_whole_or_not_at_all(tmp_path, monkeypatch):
    store = small(tmp_path)
    runner = Runner(store.plan, 1)
    store.write(0, runner.run(0))
    write, wrote = xarray.Dataset.to_zarr, []

    def failing(dataset, *arguments, **options):
        wrote.append(set(dataset.data_vars))
        if "status" in dataset:
            raise OSError(28, "No space left on device")
        return write(dataset, *arguments, **options)

    monkeypatch.setattr(xarray.Dataset, "to_zarr", failing)
    with pytest.raises(StorageError, match=r"No space left.*--resume"):
        store.write(1, runner.run(1))
    assert wrote[-1] == {"status"}, "statuses are last"
    monkeypatch.undo()
    assert store.missing() == [1, 2]
    runs = store.dataset()
    assert runs["status"].isnull().values.tolist() == [False] * 5 + [True] * 7
    assert Progress.of(store).done == 5
    execute(store, threads=1)
    unbroken = small(tmp_path, "b")
    execute(unbroken, threads=1)
    assert contents(store.folder) == contents(unbroken.folder)


def test_a_stopped_batch_goes_on_to_the_same_bytes(tmp_path):
    stopped, unbroken = small(tmp_path, record=1), small(tmp_path, "b", record=1)
    seen = []
    now = execute(stopped, threads=2, progress=seen.append, stopped=lambda: len(seen) > 1)
    assert (now.done, now.total) == (5, 12)
    for _ in range(2):
        execute(Store.resume(stopped.folder, stopped.plan), threads=1)
    execute(unbroken, threads=2)
    assert contents(stopped.folder) == contents(unbroken.folder)


@pytest.mark.parametrize(
    ("changes", "sweep", "options", "words"),
    [
        ({"barrier.rho": 0.2}, (0.1, 1.0), {}, "scenario.systems.robots.barrier.rho: got 0.2.*0.1"),
        ({}, (0.1, 2.0), {}, "sweeps"),
        ({}, (0.1, 1.0), {"seed": 1}, "seed: got 1"),
        ({}, (0.1, 1.0), {"starts": 3}, "runs: got 3"),
        ({}, (0.1, 1.0), {"record": 1}, "record"),
        ({"agents.damping": 2.0}, (0.1, 1.0), {}, "agents.damping: got 2.0.*begun with 1.0"),
    ],
)
def test_a_changed_batch_does_not_go_on(changes, sweep, options, words, tmp_path):
    def plan(changed, values, **given):
        sweeps = [Sweep("game.reference_velocity", values)]
        given = {"starts": 2, "chunk": 2, **given}
        return make_plan("velocity-sync", {**ODE, **changed}, sweeps=sweeps, **given)

    store = Store.create(tmp_path / "a", plan({}, (0.1, 1.0)))
    before = contents(store.folder)
    with pytest.raises(InvalidInput, match=words):
        Store.resume(store.folder, plan(changes, sweep, **options))
    assert contents(store.folder) == before


def test_other_versions_do_not_go_on(tmp_path):
    store = small(tmp_path)
    path = store.folder / "manifest.json"
    path.write_text(path.read_text().replace(mujoco.__version__, "3.16.0"))
    with pytest.raises(InvalidInput, match=r"versions.mujoco: .*begun with 3.16.0"):
        Store.continued(store.folder)


def test_two_processes_do_not_write_one_batch(tmp_path):
    store = small(tmp_path)
    with store.locked(), pytest.raises(InvalidInput, match="another process"):
        execute(store, threads=1)


def test_a_changed_file_of_ones_own_does_not_go_on(tmp_path):
    for name in ("scenario.toml", "charging_plain.py"):
        text = (ROOT / "examples" / "game" / name).read_text()
        (tmp_path / name).write_text(text.replace("charging_fast", "charging_plain"))
    changes = {"simulation.duration": 0.1}
    plan = make_plan(tmp_path / "scenario.toml", changes, starts=2)
    store = Store.create(tmp_path / "a", plan)
    execute(store, threads=2)
    assert np.all(np.isin(store.statuses(), ["completed", "converged"]))
    with (tmp_path / "charging_plain.py").open("a") as file:
        file.write("\n# changed\n")
    for again in (lambda: Store.continued(store.folder), store.check_files):
        with pytest.raises(InvalidInput, match=r"charging_plain\.py"):
            again()


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
    plan = make_plan(tmp_path / "s.toml", {"simulation.duration": 20.0}, starts=3)
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


def test_a_worker_keeps_nothing_of_an_earlier_batch(tmp_path):
    for rho in (0.1, 1.0):
        plan = make_plan("velocity-sync", ODE, sweeps=[Sweep("barrier.rho", [rho])], starts=2)
        store = Store.create(tmp_path / "a", plan)
        manifest = json.dumps(plan.manifest())
        for chunk in range(plan.chunks):
            cluster.run_chunk(str(store.folder), manifest, chunk)
        expected = all_chunks(plan, 1)["final_error"][1]
        np.testing.assert_array_equal(store.dataset()["final_error"], expected)
        shutil.rmtree(store.folder)
        with pytest.raises(InvalidInput, match="batch` wrote"):
            cluster.run_chunk(str(store.folder), manifest, 0)


def test_a_worker_with_other_versions_refuses(tmp_path):
    store = small(tmp_path)
    manifest = json.dumps(store.plan.manifest()).replace(mujoco.__version__, "3.16.0")
    with pytest.raises(InvalidInput, match="versions or files differ"):
        cluster.run_chunk(str(store.folder), manifest, 0)


@pytest.mark.parametrize("text", ["{}", "[]", "no JSON", '{"format": 99}'])
def test_a_manifest_of_something_else_is_refused(text, tmp_path):
    store = small(tmp_path)
    (store.folder / "manifest.json").write_text(text)
    with pytest.raises(InvalidInput, match=r"batch` wrote|its format is 99"):
        gne_mj.open_batch(store.folder)


def test_medians_count_runs_that_have_no_end():
    """Three of five settle at 1, 2 and 3: the median is 3; of two of five there is none."""
    for settled, median in (([1.0, 2.0, 3.0], 3.0), ([1.0, 2.0], np.nan)):
        times = settled + [np.nan] * (5 - len(settled))
        runs = xarray.Dataset(
            {
                "status": ("run", ["completed"] * 5),
                "settling_time": ("run", times),
                **{
                    name: ("run", np.arange(5.0))
                    for name in ("least_margin", "final_error", "peak_input")
                },
            },
            attrs={"swept": []},
        )
        table = combinations(runs)
        np.testing.assert_equal(table["settling_time_median"][0], median)
        assert table["not_settled"][0] == 5 - len(settled)
        assert table["final_error_median"][0] == 2.0


# Processes

BATCH = [
    "velocity-sync", "--set", "simulation.duration=4", "--set", "simulation.timestep=0.01",
    "--sweep", "barrier.rho=0.05:1:4log", "--runs", "30", "--chunk", "3", "--record", "4",
]  # fmt: skip


def command(folder, *more):
    program = "import sys; from gne_mj.cli import main; sys.argv[0] = 'gne-mj'; main()"
    return [sys.executable, "-c", program, "batch", *BATCH, "--out", str(folder), *more]


def killed_and_resumed(tmp_path, kills, seed):
    """How many kills met a batch at work; in the end it is as if there had been none."""
    whole, broken = tmp_path / "whole", tmp_path / "broken"
    subprocess.run(command(whole), check=True, capture_output=True)
    expected = contents(whole)
    rng, met, kept = np.random.default_rng(seed), 0, 0
    for _ in range(kills):
        more = ["--resume"] if broken.exists() else []
        process = subprocess.Popen(
            command(broken, *more), stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL
        )
        time.sleep(rng.uniform(0.8, 2.2))
        met += process.poll() is None
        process.send_signal(signal.SIGKILL)
        process.wait()
        if broken.exists():
            done = Progress.of(Store.open(broken)).done
            assert done >= kept, "what was stored is lost"
            kept = done
            found = contents(broken / "runs.zarr")
            statuses = {name for name in found if name.startswith("status/")}
            for name in statuses:  # of stored chunks every file is final
                end = name.removeprefix("status/")
                for other in found:
                    _, _, place = other.partition("/")
                    if place.split(".")[0] == end and not place.endswith(".partial"):
                        assert found[other] == expected[f"runs.zarr/{other}"], other
        if kept == 120:  # begin again
            subprocess.run(["rm", "-r", str(broken)], check=True)
            kept = 0
    more = ["--resume"] if broken.exists() else []
    subprocess.run(command(broken, *more), check=True, capture_output=True)
    assert contents(broken) == expected
    return met


def test_a_killed_batch_loses_nothing_that_was_stored(tmp_path):
    assert killed_and_resumed(tmp_path, kills=3, seed=0) > 0


@pytest.mark.slow
def test_fifty_kills(tmp_path):
    assert killed_and_resumed(tmp_path, kills=50, seed=1) >= 25


def test_a_batch_that_is_interrupted_says_how_to_go_on(tmp_path):
    process = subprocess.Popen(
        command(tmp_path / "a", "--set", "simulation.duration=400"),
        stdout=subprocess.PIPE, text=True,
    )  # fmt: skip
    while not (tmp_path / "a").exists():
        time.sleep(0.05)
    time.sleep(1.0)
    process.send_signal(signal.SIGINT)
    printed, _ = process.communicate(timeout=60)
    assert process.returncode == 1
    assert "of 120 runs are stored; go on with `gne-mj batch --resume" in printed


def test_files_that_cannot_grow_end_a_batch_cleanly(tmp_path):
    """A full disk, as far as one process can have one to itself."""
    program = (
        "import resource, sys\n"
        "resource.setrlimit(resource.RLIMIT_FSIZE, (20_000, 20_000))\n"
        "from gne_mj.cli import main\n"
        "sys.argv[0] = 'gne-mj'; main()\n"
    )
    arguments = [*BATCH, "--record", "1", "--set", "simulation.duration=40"]
    finished = subprocess.run(
        [sys.executable, "-c", program, "batch", *arguments, "--out", str(tmp_path / "a")],
        capture_output=True, text=True, env={**os.environ, "NUMBA_CACHE_DIR": ""},
    )  # fmt: skip
    assert finished.returncode == 1
    assert finished.stderr.count("\n") == 1
    assert "File too large" in finished.stderr
    assert "--resume" in finished.stderr
    assert Progress.of(Store.open(tmp_path / "a")).done == 0


# Clusters


@contextmanager
def dask_cluster(workers, folder):
    """A scheduler and workers of Dask's own, each a process; their address and the workers."""
    commands = "distributed.cli.dask_scheduler", "distributed.cli.dask_worker"
    started = []

    def start(module, *arguments):
        environment = {**os.environ, "DASK_DISTRIBUTED__SCHEDULER__WORKER_TTL": "10s"}
        process = subprocess.Popen(
            [sys.executable, "-m", module, *arguments], cwd=folder, env=environment,
            stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
        )  # fmt: skip
        started.append(process)
        return process

    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        port = probe.getsockname()[1]
    address = f"tcp://127.0.0.1:{port}"
    try:
        start(commands[0], "--host", "127.0.0.1", "--port", str(port), "--no-dashboard")
        running = [
            start(
                commands[1], address, "--host", "127.0.0.1", "--nthreads", "1", "--no-nanny",
                "--no-dashboard", "--name", f"worker-{number}",
            )
            for number in range(workers)
        ]  # fmt: skip
        yield address, running
    finally:
        for process in started:
            process.kill()
            process.wait()


@pytest.mark.slow
def test_a_cluster_runs_a_batch_and_survives_a_lost_worker(tmp_path):
    whole, spread = tmp_path / "whole", tmp_path / "spread"
    longer = ["--set", "simulation.duration=40"]
    subprocess.run(command(whole, *longer), check=True, capture_output=True)
    with dask_cluster(3, tmp_path) as (address, workers):
        process = subprocess.Popen(
            command(spread, *longer, "--cluster", address), stdout=subprocess.PIPE, text=True
        )
        while not (spread.exists() and Progress.of(Store.open(spread)).done > 6):
            assert process.poll() is None
            time.sleep(0.05)
        workers[0].kill()
        before = Progress.of(Store.open(spread)).done
        printed, _ = process.communicate(timeout=300)
    assert process.returncode == 0
    assert before < 120, "the worker was killed too late to matter"
    assert "runs.zarr" in printed
    assert contents(spread) == contents(whole)


# Commands


def run(capsys, *arguments):
    sys.argv = ["gne-mj", *map(str, arguments)]
    with pytest.raises(SystemExit) as ended:
        main()
    printed = capsys.readouterr()
    return ended.value.code or 0, printed.out, printed.err


SETTINGS = [part for key, value in ODE.items() for part in ("--set", f"{key}={value}")]


@pytest.fixture(autouse=True)
def _keep_arguments(monkeypatch):
    monkeypatch.setattr(sys, "argv", sys.argv)


def test_a_batch_writes_tables_and_a_figure(tmp_path, capsys):
    out = tmp_path / "a"
    sweep = ["--sweep", "barrier.rho=0.1,1", "--sweep", "controller.mode=continuous,sampled"]
    code, printed, err = run(
        capsys, "batch", "velocity-sync", *SETTINGS, *sweep, "--runs", 3, "--out", out
    )
    assert (code, err) == (0, "")
    assert printed.splitlines()[0].split() == [
        "barrier.rho", "controller.mode", "runs", "left", "worst", "margin", "settling", "(s)",
        "not", "settled", "final", "error",
    ]  # fmt: skip
    assert len(printed.splitlines()) == 5 + 5
    assert {p.name for p in out.iterdir()} == {
        "combinations.csv", "manifest.json", "runs.csv", "runs.zarr", "summary.png",
    }  # fmt: skip
    rows = np.genfromtxt(out / "combinations.csv", delimiter=",", names=True, dtype=None)
    runs = gne_mj.open_batch(out)
    own = runs["least_margin"].where(
        (runs["barrier.rho"] == 1.0) & (runs["controller.mode"] == "sampled"), drop=True
    )
    assert rows["least_margin_min"][3] == float(own.min())
    assert len((out / "runs.csv").read_text().splitlines()) == 1 + 12
    code, printed, _ = run(capsys, "batch-report", out, "--out", tmp_path / "b", "--format", "svg")
    assert code == 0
    assert (tmp_path / "b" / "summary.svg").read_text().startswith("<?xml")
    code, printed, _ = run(
        capsys, "batch", "velocity-sync", *SETTINGS, *sweep, "--runs", 3, "--out", out
    )
    assert code == 2, "it exists"


def test_runs_that_left_are_data(tmp_path, capsys):
    options = [
        "batch", "velocity-sync", *SETTINGS, "--set", "controller.mode=sampled", "--sweep",
        "simulation.control_period=0.01,1", "--runs", 5, "--spread", 0.99, "--json",
    ]  # fmt: skip
    code, printed, _ = run(capsys, *options, "--out", tmp_path / "a")
    report = json.loads(printed)
    assert code == 0
    assert report["done"] == report["runs"] == 10
    assert report["combinations"][1]["left"] == report["statuses"]["left_feasible_set"] > 0
    code, _, _ = run(capsys, *options, "--out", tmp_path / "b", "--fail-on-exit")
    assert code == 1


def test_a_run_of_a_batch_is_run_alone(tmp_path, capsys):
    out = tmp_path / "a"
    run(capsys, "batch", "velocity-sync", *SETTINGS, "--sweep", "barrier.rho=0.1,1", "--runs", 2,
        "--record", "all", "--out", out)  # fmt: skip
    code, _, _ = run(capsys, "run", "--from", out, "--index", 3, "--out", tmp_path / "b")
    assert code == 0
    alone = gne_mj.Trajectory.load(tmp_path / "b" / "trajectory.zarr")["robots"]
    stored = gne_mj.open_batch(out).isel(run=3)
    np.testing.assert_array_equal(alone["action"], stored["action"])
    assert alone.attrs["rho"] == 1.0


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["run"], "SCENARIO: nothing is given"),
        (["run", "--from", "{batch}"], "--index: nothing is given"),
        (["run", "--from", "{batch}", "--index", 12], "--index: got 12, but runs are numbered"),
        (["run", "velocity-sync", "--index", 1], "--index: got 1, but it goes with --from"),
        (["run", "--from", "{tmp}", "--index", 1], "a folder that `batch` wrote"),
        (["batch"], "SCENARIO: nothing is given"),
        (["batch", "--resume", "--out", "{tmp}/none"], "a folder that `batch` wrote"),
        (["batch", "--resume", "--out", "{batch}", "--runs", 3], "SCENARIO: nothing is given"),
        (["batch", "velocity-sync", "--cluster", "nonsense", "--out", "{tmp}/x"], "tcp://HOST"),
        (["batch-report", "{tmp}"], "a folder that `batch` wrote"),
        (["batch-report", "{batch}"], "it must hold at least one run"),
        (["batch-report", "{batch}", "--format", "jpg"], "choose from png, pdf, svg"),
        (["batch", "velocity-sync", "--out", "{batch}"], "it exists already"),
        (["batch", "velocity-sync", "--runs", "-1", "--out", "{tmp}/x"], "--runs: got -1"),
        (["batch", "velocity-sync", "--spread", "1", "--out", "{tmp}/x"], "--spread: got 1"),
        (["batch", "velocity-sync", "--threads", "-1", "--out", "{tmp}/x"], "--threads: got -1"),
        (["batch", "velocity-sync", "--record", "some", "--out", "{tmp}/x"], "--record: got 'some"),
        (
            ["batch", "velocity-sync", "--cluster", "tcp://127.0.0.1:9", "--out", "{tmp}/x"],
            "no scheduler answers",
        ),
    ],
)
def test_mistakes_are_answered_in_one_sentence(arguments, words, tmp_path, capsys, monkeypatch):
    monkeypatch.setattr(cluster, "PATIENCE", "1s")
    small(tmp_path, "batch")
    places = {"{batch}": str(tmp_path / "batch"), "{tmp}": str(tmp_path)}
    given = []
    for argument in arguments:
        text = str(argument)
        for name, path in places.items():
            text = text.replace(name, path)
        given.append(text)
    code, printed, err = run(capsys, *given)
    assert code == 2
    assert printed == ""
    assert err.count("\n") == 1
    assert words in err
