"""`gne-mj paper`, its figures, and long runs of the same systems that are interrupted.

In a file of its own, which comes late: by then others have compiled what the systems need.
"""

import json
import signal
import subprocess
import time
from pathlib import Path

import pytest
from commands import COMMAND, environment, gne, gne_here

import gne_mj

FIGURES = {"robots-velocities", "robots-gaps", "channels-powers", "channels-total-power"}
SHORT = ("--set", "simulation.duration=0.2")


@pytest.fixture(scope="module")
def drawn(tmp_path_factory):
    """A short `paper`."""
    folder = tmp_path_factory.mktemp("cli") / "paper"
    return folder, gne("paper", *SHORT, "--out", folder)


def test_paper_draws_its_four_figures(drawn):
    folder, done = drawn
    assert (done.returncode, done.stderr) == (0, "")
    assert {path.stem for path in folder.glob("*.png")} == FIGURES
    for path in folder.glob("*.png"):
        assert path.read_bytes().startswith(b"\x89PNG")
        assert path.stat().st_size > 5000
        assert str(path) in done.stdout
    assert set(json.loads((folder / "report.json").read_text())["systems"]) == {
        "robots",
        "channels",
    }
    names = {path.name for path in folder.iterdir()}
    kept = {"trajectory.zarr", "report.json", "replay.html"}
    assert names == {f"{name}.png" for name in FIGURES} | kept


def test_paper_replaces_its_own_results_only(drawn, tmp_path):
    out = tmp_path / "paper"
    out.mkdir()
    (out / "mine.txt").write_text("mine")
    refused = gne_here("paper", *SHORT, "--out", out)
    assert refused.returncode == 2
    assert [path.name for path in out.iterdir()] == ["mine.txt"]
    folder, _ = drawn
    (folder / "channels-powers.png").write_bytes(b"")
    before = json.loads((folder / "report.json").read_text())["wall_time"]
    done = gne_here("paper", *SHORT, "--out", folder, "--json")
    assert done.returncode == 0
    assert json.loads(done.stdout) == json.loads((folder / "report.json").read_text())
    assert json.loads(done.stdout)["wall_time"] != before
    assert (folder / "channels-powers.png").stat().st_size > 5000
    assert [path.name for path in folder.parent.iterdir()] == ["paper"]


def test_paper_leaves_a_folder_of_someone_elses_with_a_report_alone(tmp_path):
    """A report.json alone does not make a folder one that `paper` wrote."""
    out = tmp_path / "mine"
    out.mkdir()
    (out / "report.json").write_text('{"author": "me"}')
    (out / "thesis.txt").write_text("years of work")
    done = gne_here("paper", *SHORT, "--out", out)
    assert done.returncode == 2
    assert (out / "thesis.txt").read_text() == "years of work"


def test_plot_draws_every_format(drawn, tmp_path):
    folder, _ = drawn
    out = tmp_path / "figures"
    done = gne_here("plot", folder, "--out", out, "--format", "pdf", "--format", "svg")
    assert (done.returncode, done.stderr) == (0, "")
    expected = {f"{name}.{kind}" for name in FIGURES for kind in ("pdf", "svg")}
    assert {path.name for path in out.iterdir()} == expected
    assert {Path(line).name for line in done.stdout.splitlines()} == expected
    assert all(path.read_bytes().startswith(b"%PDF") for path in out.glob("*.pdf"))
    assert all(b"<svg" in path.read_bytes() for path in out.glob("*.svg"))


@pytest.mark.slow
@pytest.mark.parametrize("scenario", ["velocity-sync", "osnr", "paper"])
def test_ctrl_c_keeps_what_was_done(scenario, tmp_path, drawn):
    """drawn: compiled by now."""
    out = tmp_path / "run"
    process = subprocess.Popen(
        [COMMAND, "run", scenario, "--set", "simulation.duration=100000", "--json",
         "--set", "simulation.timestep=0.01", "--out", out],
        env=environment(), stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
    )  # fmt: skip
    try:
        deadline = time.monotonic() + 60
        while not list(tmp_path.iterdir()):  # the folder is made just before the run
            assert process.poll() is None, process.stderr.read()
            assert time.monotonic() < deadline
            time.sleep(0.02)
        time.sleep(1.0)
        process.send_signal(signal.SIGINT)
        stdout, stderr = process.communicate(timeout=60)
    finally:
        process.kill()
        process.wait()
    assert process.returncode == 1, stderr
    assert stderr == ""
    report = json.loads(stdout)
    assert report["status"] == "interrupted"
    assert [path.name for path in tmp_path.iterdir()] == ["run"]
    assert json.loads((out / "report.json").read_text()) == report
    loaded = gne_mj.Trajectory.load(out / "trajectory.zarr")
    assert loaded.status == "interrupted"
    for system, certificate in report["systems"].items():
        times = loaded[system]["time"].to_numpy()
        assert "stopped by the user" in certificate["message"]
        assert 0 < times[-1] == pytest.approx(certificate["end_time"])
        assert times[-1] < 100000
