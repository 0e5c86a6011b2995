"""The store of a batch: whole or not at all, resumed to the same bytes, refused if changed."""

import subprocess
import sys

import mujoco
import numpy as np
import pytest
import xarray
from batch_plans import ODE, ROOT, contents, small

import gne_mj
from gne_mj.batches import (
    Progress,
    Store,
    Sweep,
    execute,
    make_plan,
)
from gne_mj.batches.chunk import Runner
from gne_mj.errors import InvalidInput, StorageError


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


def test_what_only_some_combinations_have_is_kept(tmp_path):
    """Steps are divided with a fixed step only, and the first combination has none."""
    sweep = [Sweep("plant.integrator", ("rosenbrock", "rk4"))]
    plan = make_plan(
        "osnr", {"simulation.timestep": 1e-3, "simulation.duration": 0.1}, sweeps=sweep
    )
    store = Store.create(tmp_path / "a", plan)
    execute(store, threads=1)
    divided = store.dataset()["divided_steps"].to_numpy()
    assert divided.tolist() == pytest.approx([np.nan, 0.0], nan_ok=True)


OWN = """
from gne_mj.games import velocity_game
from gne_mj.quantity import Quantity
from dataclasses import replace
def game(count):
    energy = Quantity("energy", "energy", "J", lambda y: y**2, each="agent")
    return replace(velocity_game(count, 3.0, 3.0), quantities=(energy,))
"""


def test_a_quantity_with_the_name_of_a_figure_is_refused_where_rows_are_kept(tmp_path):
    (tmp_path / "own.py").write_text(OWN)
    game = {"type": "custom", "file": str(tmp_path / "own.py")}
    changes = {**ODE, "game": game, "initial.action": [1.0, 1.5, 2.0, 2.5, 3.0]}
    Store.create(tmp_path / "a", make_plan("velocity-sync", changes))
    with pytest.raises(InvalidInput, match="got 'energy', but results have something else"):
        Store.create(tmp_path / "b", make_plan("velocity-sync", changes, record=1))
    assert not (tmp_path / "b").exists()


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


@pytest.mark.parametrize("begun", [False, pytest.param(True, marks=pytest.mark.slow)])  # compiles
def test_a_changed_file_of_ones_own_does_not_go_on(begun, tmp_path):
    for name in ("scenario.toml", "charging_plain.py"):
        text = (ROOT / "examples" / "game" / name).read_text()
        (tmp_path / name).write_text(text.replace("charging_fast", "charging_plain"))
    changes = {"simulation.duration": 0.1}
    plan = make_plan(tmp_path / "scenario.toml", changes, starts=2)
    store = Store.create(tmp_path / "a", plan)
    if begun:
        execute(store, threads=2)
        assert np.all(np.isin(store.statuses(), ["completed", "converged"]))
    with (tmp_path / "charging_plain.py").open("a") as file:
        file.write("\n# changed\n")
    for again in (lambda: Store.continued(store.folder), store.check_files):
        with pytest.raises(InvalidInput, match=r"charging_plain\.py"):
            again()


@pytest.mark.parametrize("text", ["{}", "[]", "no JSON", '{"format": 99}'])
def test_a_manifest_of_something_else_is_refused(text, tmp_path):
    store = small(tmp_path)
    (store.folder / "manifest.json").write_text(text)
    with pytest.raises(InvalidInput, match=r"batch` wrote|its format is 99"):
        gne_mj.open_batch(store.folder)
