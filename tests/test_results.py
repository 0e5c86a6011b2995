"""Result folders: nothing that exists is replaced; full disks, full pipes and signals."""

import errno
import itertools
import json
import os
import resource
import signal
import subprocess
import time
from contextlib import contextmanager

import pytest
import zarr
from batch_plans import ODE, contents, small
from commands import COMMAND, environment, gne_here

import gne_mj.exit_map
import gne_mj.solutions
from gne_mj.batches import Store, execute, make_plan, store
from gne_mj.errors import InvalidInput, StorageError
from gne_mj.interruption import interruption
from gne_mj.simulation import Simulation

SHORT = ("--set", "simulation.duration=0.2", "--set", "plant.engine=ode")
RUN = ("run", "velocity-sync", *SHORT)
SOLVE = ("solve", "velocity-sync", "--path", "1:0.1:2")
MAP = (
    "map", "velocity-sync", "--periods", "0.01:0.1:2", "--margins", "0.3:0.5:2", "--pushes", "0",
    "--runs", "1", "--duration", "0.1", "--set", "plant.engine=ode",
)  # fmt: skip


@pytest.fixture(scope="module")
def run_folder(tmp_path_factory):
    """A short run's."""
    folder = tmp_path_factory.mktemp("results") / "run"
    assert gne_here(*RUN, "--out", folder).returncode == 0
    return folder


@contextmanager
def meanwhile(patch, what, name, act):
    """Something that happens while a command computes."""
    before = getattr(what, name)

    def after(*arguments, **options):
        found = before(*arguments, **options)
        act()
        return found

    patch.setattr(what, name, after)
    yield
    patch.undo()


@pytest.mark.parametrize("command", [RUN, SOLVE, MAP], ids=["run", "solve", "map"])
def test_who_comes_second_keeps_its_results_under_another_name(command, tmp_path, monkeypatch):
    out = tmp_path / "out"

    def act():
        out.mkdir()
        (out / "report.json").write_text('"mine"')

    what, name = {
        "run": (Simulation, "run"),
        "solve": (gne_mj.solutions, "solve_system"),
        "map": (gne_mj.exit_map, "exit_map"),
    }[command[0]]
    with meanwhile(monkeypatch, what, name, act):
        done = gne_here(*command, "--out", out)
    assert done.returncode == 0
    assert contents(out) == {"report.json": b'"mine"'}
    assert {path.name for path in tmp_path.iterdir()} == {"out", "out-2"}
    assert done.stderr == (
        f"gne-mj: warning: {out} was made by somebody else meanwhile; these results are in"
        f" {out}-2\n"
    )
    kept = {path.name for path in (tmp_path / "out-2").iterdir()}
    assert (
        kept
        == {
            "run": {"report.json", "trajectory.zarr"},
            "solve": {"report.json", "robots-path.csv", "robots-path.png"},
            "map": {"map.csv", "map.png"},
        }[command[0]]
    )
    if command[0] != "solve":
        assert str(tmp_path / "out-2") in done.stdout


@pytest.mark.slow
def test_two_runs_at_once_keep_both_results(tmp_path):
    started = [
        subprocess.Popen(
            [COMMAND, *RUN, "--set", f"barrier.rho={rho}", "--out", tmp_path / "out", "--json"],
            env=environment(), stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
        )
        for rho in (0.1, 0.2)
    ]  # fmt: skip
    printed = [process.communicate(timeout=120) for process in started]
    codes = [process.returncode for process in started]
    reports = [json.loads(path.read_text()) for path in tmp_path.glob("out*/report.json")]
    if 2 in codes:  # one was refused at once, having started late
        assert "exists already" in printed[codes.index(2)][1]
        del printed[codes.index(2)]
    told = [json.loads(stdout) for stdout, _ in printed]
    assert sorted(map(str, reports)) == sorted(map(str, told))


def test_a_batch_that_was_made_meanwhile_is_left_alone(tmp_path, monkeypatch):
    folder = tmp_path / "a"

    def act():
        folder.mkdir()
        (folder / "mine.txt").write_text("mine")

    plan = make_plan("velocity-sync", ODE, starts=1)
    with (
        meanwhile(monkeypatch, store, "_create_arrays", act),
        pytest.raises(InvalidInput, match="exists already"),
    ):
        Store.create(folder, plan)
    assert contents(folder) == {"mine.txt": b"mine"}
    assert list(tmp_path.iterdir()) == [folder]


def test_files_elsewhere_are_replaced_only_if_asked(run_folder, tmp_path):
    batch = small(tmp_path)
    execute(batch, threads=1)
    for command, name in (
        (("plot", run_folder, "--out", tmp_path), "robots-gaps.png"),
        (("view", run_folder, "--html", tmp_path / "page.html"), "page.html"),
        (("batch-report", batch.folder, "--out", tmp_path), "runs.csv"),
    ):
        mine = tmp_path / name
        mine.write_text("mine")
        before = contents(tmp_path)
        refused = gne_here(*command)
        assert refused.returncode == 2
        assert refused.stderr.count("\n") == 1
        assert f"'{mine}', but it exists already" in refused.stderr
        assert contents(tmp_path) == before
        assert gne_here(*command, "--replace").returncode == 0
        assert mine.read_bytes() != b"mine"


def test_what_is_refused_makes_no_folder(tmp_path):
    done = gne_here(*RUN, "--set", "barrier.rho=-1", "--out", tmp_path / "a" / "b")
    assert done.returncode == 2
    assert list(tmp_path.iterdir()) == []


def test_in_its_own_folder_a_runs_figures_are_drawn_again(run_folder):
    for _ in range(2):
        assert gne_here("plot", run_folder).returncode == 0
    assert gne_here("plot", run_folder, "--out", run_folder / ".." / "run").returncode == 0


@contextmanager
def small_disk(size):
    """No file may grow beyond so many bytes, as on a disk that gets full."""
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (size, before[1]))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)


@pytest.mark.parametrize("size", [0, 400])
@pytest.mark.parametrize("command", ["run", "solve", "map", "view", "plot", "batch-report"])
def test_a_full_disk_is_one_sentence_and_changes_nothing(command, size, run_folder, tmp_path):
    batch = tmp_path / "batch"
    if command == "batch-report":
        execute(small(tmp_path, "batch"), threads=1)
    (tmp_path / "mine.txt").write_text("mine")
    before, out = contents(tmp_path), tmp_path / "out"
    arguments = {
        "run": (*RUN, "--out", out),
        "solve": (*SOLVE, "--out", out),
        "map": (*MAP, "--out", out),
        "view": ("view", run_folder, "--html", out),
        "plot": ("plot", run_folder, "--out", tmp_path),
        "batch-report": ("batch-report", batch),
    }[command]
    with small_disk(size):
        done = gne_here(*arguments)
    assert done.returncode == 1
    place = {"plot": tmp_path / "robots-", "batch-report": batch}.get(command, out)
    assert done.stderr.startswith(f"gne-mj: not_stored: {place}")
    assert done.stderr.count("\n") == 1
    assert contents(tmp_path) == before


def test_a_trajectory_that_does_not_fit_leaves_nothing(run_folder, tmp_path):
    trajectory = gne_mj.Trajectory.load(run_folder / "trajectory.zarr")
    with small_disk(100), pytest.raises(StorageError, match="File too large"):
        trajectory.save(tmp_path / "again")
    assert list(tmp_path.iterdir()) == []


def test_writes_that_go_on_beside_one_that_fails_leave_nothing(run_folder, tmp_path, monkeypatch):
    trajectory = gne_mj.Trajectory.load(run_folder / "trajectory.zarr")
    put, calls = zarr.storage._local._put, itertools.count()

    def slow(path, *arguments, **options):
        if next(calls) == 20:
            raise OSError(errno.ENOSPC, "No space left on device")
        time.sleep(0.02)
        return put(path, *arguments, **options)

    monkeypatch.setattr(zarr.storage._local, "_put", slow)
    with pytest.raises(StorageError, match="No space left"):
        trajectory.save(tmp_path / "again")
    time.sleep(0.5)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("arguments", [("scenarios",), ("run", "nonsense", "--json")])
def test_a_full_standard_output_is_one_sentence(arguments):
    with open("/dev/full", "w") as full:
        done = subprocess.run(
            [COMMAND, *arguments], stdout=full, stderr=subprocess.PIPE, text=True, check=False,
            env={key: v for key, v in environment().items() if key != "PYTHONUNBUFFERED"},
        )  # fmt: skip
    assert done.stderr.count("\n") == 1
    if arguments == ("scenarios",):
        assert "standard output: No space left on device" in done.stderr
        assert done.returncode == 1
    else:
        assert "nonsense" in done.stderr
        assert done.returncode == 2


@pytest.mark.parametrize("where", ["stdout", "stderr", "both"])
def test_a_closed_pipe_is_no_traceback(where):
    reading, writing = os.pipe()
    os.close(reading)
    pipes = {
        "stdout": writing if where != "stderr" else subprocess.PIPE,
        "stderr": writing if where != "stdout" else subprocess.PIPE,
    }
    plain = {key: v for key, v in environment().items() if key != "PYTHONUNBUFFERED"}
    arguments = ["run", "nonsense"] if where == "stderr" else ["scenarios", "paper"]
    done = subprocess.run([COMMAND, *arguments], env=plain, check=False, text=True, **pipes)
    os.close(writing)
    assert done.returncode == (2 if where == "stderr" else 1)
    assert not done.stderr
    assert not done.stdout


# Signals


def test_a_map_that_is_stopped_keeps_its_cells(tmp_path, monkeypatch):
    run, counted = gne_mj.exit_map._run, []

    def counting(*arguments):
        counted.append(1)
        if len(counted) == 6:  # the second run of the third cell
            os.kill(os.getpid(), signal.SIGTERM)
        return run(*arguments)

    monkeypatch.setattr(gne_mj.exit_map, "_run", counting)
    done = gne_here(*MAP, "--runs", "2", "--out", tmp_path / "map")
    assert done.returncode == 1
    assert "stopped: 3 of 8 cells were done" in done.stderr
    assert len((tmp_path / "map" / "map.csv").read_text().splitlines()) == 1 + 3


def test_one_signal_is_heard_within_and_without():
    """What runs inside another interruption ends with it, and a second signal ends all."""
    with interruption(signal.SIGTERM) as outer, interruption() as inner:
        assert outer is inner
        os.kill(os.getpid(), signal.SIGTERM)
        assert outer.is_set()
        assert signal.getsignal(signal.SIGTERM) is not signal.SIG_IGN
    with interruption() as later:
        assert not later.is_set()


def test_a_second_signal_ends_at_once():
    def twice():
        with interruption():
            for _ in range(2):
                signal.raise_signal(signal.SIGINT)

    with pytest.raises(KeyboardInterrupt):
        twice()
    assert signal.getsignal(signal.SIGINT) is signal.default_int_handler
