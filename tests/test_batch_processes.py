"""Batches that are killed, interrupted, out of room, or run on a cluster."""

import json
import os
import pickle
import shutil
import signal
import socket
import subprocess
import sys
import time
from contextlib import contextmanager, nullcontext
from types import SimpleNamespace

import mujoco
import numpy as np
import psutil
import pytest
from batch_plans import (
    ODE,
    all_chunks,
    contents,
    small,
)

from gne_mj.batches import (
    Progress,
    Store,
    Sweep,
    cluster,
    make_plan,
)
from gne_mj.errors import (
    InfeasibleStart,
    InvalidInput,
    SolverError,
    StorageError,
    UserCodeError,
)

BATCH = [
    "velocity-sync", "--set", "simulation.duration=4", "--set", "simulation.timestep=0.01",
    "--sweep", "barrier.rho=0.05:1:4log", "--runs", "30", "--chunk", "3", "--record", "4",
]  # fmt: skip


def command(folder, *more):
    program = "import sys; from gne_mj.cli import main; sys.argv[0] = 'gne-mj'; main()"
    return [sys.executable, "-c", program, "batch", *BATCH, "--out", str(folder), *more]


def stored_chunks_are_final(found, expected):
    """Of chunks that are stored every file is that of the whole batch."""
    stored = {name.removeprefix("status/") for name in found if name.startswith("status/")}
    for name in found:
        _, _, place = name.partition("/")
        if place.split(".")[0] in stored and not place.endswith(".partial"):
            assert found[name] == expected[f"runs.zarr/{name}"], name


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
            stored_chunks_are_final(contents(broken / "runs.zarr"), expected)
        if kept == 120:  # begin again
            subprocess.run(["rm", "-r", str(broken)], check=True)
            kept = 0
    more = ["--resume"] if broken.exists() else []
    subprocess.run(command(broken, *more), check=True, capture_output=True)
    assert contents(broken) == expected
    return met


@pytest.mark.slow
def test_a_killed_batch_loses_nothing_that_was_stored(tmp_path):
    assert killed_and_resumed(tmp_path, kills=50, seed=1) >= 25


@pytest.mark.slow
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


@pytest.mark.slow
def test_files_that_cannot_grow_end_a_batch_cleanly(tmp_path):
    """A full disk, as far as one process can have one to itself."""
    # compiled by now, since machine code is kept in files too
    short = ["--set", "simulation.duration=0.1", "--runs", "1"]
    subprocess.run(command(tmp_path / "warm", *short), check=True)
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


class Done:
    """A chunk's future."""

    def result(self):
        return 3, 1


def test_what_a_cluster_has_finished_is_told(tmp_path, monkeypatch):
    """Of each chunk three runs, of which one ended early, by two workers."""
    store = small(tmp_path, chunk=2)
    client = SimpleNamespace(
        submit=lambda *given, **about: Done(),
        as_current=nullcontext, scheduler=SimpleNamespace(ncores=None), cancel=lambda left: None,
        sync=lambda *given, **about: {"a": 1, "b": 1},
    )  # fmt: skip
    monkeypatch.setattr("distributed.wait", lambda waiting, **about: (set(waiting), set()))
    (found,) = cluster.on_cluster(store, client, lambda: False)
    chunks = store.plan.chunks
    assert found == cluster.Finished(runs=3 * chunks, early=chunks, workers=2)
    assert chunks > 2


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


@pytest.mark.slow
def test_a_lost_scheduler_is_told_in_one_sentence(tmp_path):
    folder, longer = tmp_path / "a", ["--set", "simulation.duration=400"]
    with dask_cluster(1, tmp_path) as (address, _):
        process = subprocess.Popen(
            command(folder, *longer, "--cluster", address),
            stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
        )  # fmt: skip
        while not (folder.exists() and Progress.of(Store.open(folder)).done > 3):
            assert process.poll() is None
            time.sleep(0.05)
        with socket.socket() as probe:
            port = int(address.rsplit(":", 1)[1])
            assert probe.connect_ex(("127.0.0.1", port)) == 0
        (scheduler,) = (
            each
            for each in psutil.process_iter(["cmdline"])
            if str(port) in (each.info["cmdline"] or ())
        )
        scheduler.kill()
        _, told = process.communicate(timeout=120)
    assert process.returncode == 1
    *progress, told = told.splitlines()
    assert all(line.startswith("gne-mj: about ") for line in progress)
    assert told.startswith(f"gne-mj: cluster_lost: {folder}: the scheduler no longer answers")
    assert f"`gne-mj batch --resume --out {folder}`" in told
    assert Progress.of(Store.open(folder)).done > 3


@pytest.mark.parametrize(
    "error",
    [
        InvalidInput("a.key", 3, "it must be less"),
        InfeasibleStart("s", "start", "gap", 0.5),
        UserCodeError(len, "it must return a number"),
        SolverError("no way on", 1e-3, 7),
        StorageError("full"),
    ],
)
def test_errors_come_back_from_workers(error):
    """Most are not made of their messages, which is how Python would make them again."""
    back = pickle.loads(pickle.dumps(error))
    assert type(back) is type(error)
    assert str(back) == str(error)
    assert back.__dict__ == error.__dict__


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
