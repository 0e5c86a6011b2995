"""Stored runs and batches of which something is missing or damaged: noticed, and said."""

import json
import shutil

import numpy as np
import pytest
import xarray
from batch_plans import ODE, contents, small
from commands import gne_here

import gne_mj
from gne_mj.batches import Store, Sweep, execute, make_plan
from gne_mj.errors import InvalidInput


@pytest.fixture(scope="module")
def run_folder(tmp_path_factory):
    """A stored run whose state fills several chunks."""
    folder = tmp_path_factory.mktemp("damage") / "run"
    changes = {"simulation.duration": 1.0, "plant.engine": "ode"}
    trajectory = gne_mj.run("velocity-sync", changes)
    folder.mkdir()
    trajectory.save(folder / "trajectory.zarr")
    return folder


def chunk_files(store):
    return sorted(path for path in store.rglob("[0-9]*") if path.is_file())


def flipped(path):
    """One bit in the middle."""
    content = bytearray(path.read_bytes())
    content[len(content) // 2] ^= 4
    path.write_bytes(content)


def cut(path):
    path.write_bytes(path.read_bytes()[:-3])


def emptied(path):
    path.write_bytes(b"")


def removed(path):
    path.unlink()


DAMAGES = (flipped, cut, emptied, removed)


def test_every_chunk_of_a_run_counts(run_folder, tmp_path):
    store = tmp_path / "trajectory.zarr"
    shutil.copytree(run_folder / "trajectory.zarr", store)
    chunks = chunk_files(store)
    assert len(chunks) >= 15
    for number, path in enumerate(chunks):
        whole, damage = path.read_bytes(), DAMAGES[number % len(DAMAGES)]
        damage(path)
        with pytest.raises(InvalidInput, match=f"{path.relative_to(store)} is missing or damaged"):
            gne_mj.Trajectory.load(store)
        path.write_bytes(whole)
    gne_mj.Trajectory.load(store)


def test_metadata_of_a_run_count(run_folder, tmp_path):
    store = tmp_path / "trajectory.zarr"
    shutil.copytree(run_folder / "trajectory.zarr", store)
    path = store / ".zmetadata"
    whole = path.read_text()
    for text in (
        "", "{}", "[]", whole[:-20], whole.replace("completed", "converged"),
        whole.replace('"<f8"', '"<f4"', 1), whole.replace("m/s", "km/h", 1),
    ):  # fmt: skip
        path.write_text(text)
        with pytest.raises(InvalidInput, match=r"trajectory\.zarr"):
            gne_mj.Trajectory.load(store)
    path.write_text(whole)
    shutil.rmtree(store / "robots" / "gap")
    with pytest.raises(InvalidInput, match="gap"):
        gne_mj.Trajectory.load(store)


def test_what_is_no_number_is_not_missing(tmp_path):
    """Where no equilibrium is known its chunk holds no number at all, and is there."""
    trajectory = gne_mj.run("velocity-sync", {"simulation.duration": 0.1, "plant.engine": "ode"})
    dataset = trajectory["robots"]
    dataset["equilibrium"] = dataset["equilibrium"] * np.nan
    trajectory.tree["robots"] = xarray.DataTree(dataset)
    store = trajectory.save(tmp_path / "trajectory.zarr")
    loaded = gne_mj.Trajectory.load(store)
    assert np.all(np.isnan(loaded["robots"]["equilibrium"]))
    (store / "robots" / "equilibrium" / "0").unlink()
    with pytest.raises(InvalidInput, match="equilibrium/0"):
        gne_mj.Trajectory.load(store)


@pytest.mark.parametrize("damage", [flipped, removed])
@pytest.mark.parametrize(
    "command", [("plot",), ("view", "--html", "page.html")], ids=["plot", "view"]
)
def test_a_damaged_run_is_not_shown(command, damage, run_folder, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    shutil.copytree(run_folder, tmp_path / "run")
    damage(tmp_path / "run" / "trajectory.zarr" / "robots" / "gap" / "0.0")
    done = gne_here(command[0], "run", *command[1:])
    assert (done.returncode, done.stdout) == (2, "")
    assert done.stderr.count("\n") == 1
    assert "robots/gap/0.0 is missing or damaged" in done.stderr
    assert [path.name for path in tmp_path.iterdir()] == ["run"]


def test_runs_stored_without_checksums_are_read(run_folder, tmp_path):
    """As by earlier versions, which left out chunks without any number."""
    tree = gne_mj.Trajectory.load(run_folder / "trajectory.zarr").tree
    for node in tree.subtree:
        for variable in node.variables.values():
            variable.encoding = {}
    tree.to_zarr(tmp_path / "old.zarr", zarr_format=2)
    old = gne_mj.Trajectory.load(tmp_path / "old.zarr")
    xarray.testing.assert_identical(old.tree, tree)


@pytest.fixture(scope="module")
def batch(tmp_path_factory):
    """A complete batch of 12 runs in 3 chunks, with samples."""
    store = small(tmp_path_factory.mktemp("damage"), record=2)
    execute(store, threads=1)
    return store.folder


def copied(batch, tmp_path):
    shutil.copytree(batch, tmp_path / "batch")
    return Store.open(tmp_path / "batch")


@pytest.mark.parametrize("name", ["least_margin/1", "margin/1.0", "action/1.0.0", "gap/1.0.0"])
def test_a_lost_chunk_of_a_batch_is_run_again(name, batch, tmp_path):
    store = copied(batch, tmp_path)
    (store.folder / "runs.zarr" / name).unlink()
    with pytest.raises(InvalidInput, match=rf"runs\.zarr/{name} is missing.*--resume"):
        gne_mj.open_batch(store.folder)
    assert store.missing() == [1]
    done = gne_here("batch-report", store.folder, "--json")
    assert done.returncode == 2
    assert done.stderr.count("\n") == 1
    assert f"{name} is missing" in json.loads(done.stdout)["message"]
    now = execute(store, threads=1)
    assert (now.done, now.total) == (12, 12)
    assert contents(store.folder) == contents(batch)


@pytest.mark.parametrize("damage", [flipped, cut, emptied])
@pytest.mark.parametrize("name", ["status/2", "final_error/1", "seed/0", "barrier.rho/1"])
def test_a_damaged_chunk_of_a_batch_is_named(name, damage, batch, tmp_path):
    store = copied(batch, tmp_path)
    path = store.folder / "runs.zarr" / name
    damage(path)
    done = gne_here("batch-report", store.folder)
    assert (done.returncode, done.stdout) == (2, "")
    assert done.stderr.count("\n") == 1
    assert f"runs.zarr/{name} is damaged" in done.stderr
    again = name in ("status/2", "final_error/1")
    assert ("delete that file, and `gne-mj batch --resume" in done.stderr) == again
    if again:  # what it asks for helps
        path.unlink()
        execute(store, threads=1)
        assert contents(store.folder) == contents(batch)


def test_what_no_run_can_bring_back_is_said(batch, tmp_path):
    store = copied(batch, tmp_path)
    (store.folder / "runs.zarr" / "seed" / "1").unlink()
    for look in (store.dataset, store.missing):
        with pytest.raises(InvalidInput, match=r"runs\.zarr/seed/1 is missing"):
            look()
    shutil.copytree(batch / "runs.zarr", store.folder / "runs.zarr", dirs_exist_ok=True)
    (store.folder / "runs.zarr" / "margin" / ".zarray").write_text("{}")
    with pytest.raises(InvalidInput, match=r"margin/\.zarray is missing or damaged"):
        store.dataset()
    shutil.copytree(batch / "runs.zarr", store.folder / "runs.zarr", dirs_exist_ok=True)
    (store.folder / "runs.zarr" / ".zgroup").write_bytes(bytes(20))
    for look in (store.dataset, store.missing):
        with pytest.raises(InvalidInput, match=r"runs\.zarr"):
            look()


def test_a_chunk_of_runs_that_could_not_begin_is_whole(tmp_path):
    """They have statuses only; what others have is stored for them too, as no number."""
    values = ([2.0] * 5, [0.0] * 5)
    plan = make_plan("velocity-sync", ODE, sweeps=[Sweep("initial.action", values)], chunk=1)
    store = Store.create(tmp_path / "a", plan)
    execute(store, threads=1)
    runs = store.dataset()
    assert runs["status"].values.tolist() == ["completed", "infeasible_start"]
    assert np.isnan(runs["least_margin"].values).tolist() == [False, True]
    assert store.missing() == []
