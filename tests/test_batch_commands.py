"""`gne-mj batch`, `batch-report` and `run --from`."""

import json
import sys

import numpy as np
import pytest
import xarray
from batch_plans import ODE, small

import gne_mj
from gne_mj.batches import cluster, execute
from gne_mj.batches.chunk import Runner
from gne_mj.batches.progress import count_early
from gne_mj.batches.report import combinations
from gne_mj.cli import main


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
        "barrier.rho", "controller.mode", "runs", "ended", "early", "worst", "margin", "settling",
        "(s)", "not", "settled", "final", "error",
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
    assert report["combinations"][1]["ended_early"] == report["statuses"]["left_feasible_set"] > 0
    code, _, _ = run(capsys, *options, "--out", tmp_path / "b", "--fail-on-exit")
    assert code == 1


def test_a_part_of_a_batch_is_called_partial(tmp_path, capsys):
    store = small(tmp_path)  # 12 runs in 3 chunks
    store.write(1, Runner(store.plan, 1).run(1))
    code, printed, _ = run(capsys, "batch-report", store.folder)
    assert code == 0
    assert printed.splitlines()[-1] == (
        f"partial: 5 of 12 runs are stored; go on with `gne-mj batch --resume --out {store.folder}`"
    )
    code, printed, _ = run(capsys, "batch-report", store.folder, "--json")
    report = json.loads(printed)
    assert (report["runs"], report["done"], report["complete"]) == (12, 5, False)
    execute(store, threads=1)
    code, printed, _ = run(capsys, "batch-report", store.folder)
    assert "partial" not in printed


def test_every_run_that_did_not_reach_its_end_ended_early():
    statuses = np.array(
        ["", "converged", "completed", "left_feasible_set", "step_too_small", "infeasible_start"]
    )
    assert count_early(statuses) == 3


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
        (
            ["batch", "velocity-sync", "--check-in-mujoco", "2", "--out", "{tmp}/x"],
            "--check-in-mujoco: got '2', but it must be a share",
        ),
        (
            ["batch", "velocity-sync", "--check-in-mujoco", "1%", "--out", "{tmp}/x"],
            "--check-in-mujoco: got 0.01, but it is for plant.engine = 'ode'",
        ),
        (
            ["batch", "osnr", "--check-in-mujoco", "1%", "--out", "{tmp}/x"],
            "--check-in-mujoco: got 0.01, but these runs are not for MuJoCo",
        ),
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
