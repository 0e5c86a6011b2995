"""`gne-mj paper`, its figures, and long runs of the same systems that are interrupted.

In a file of its own, which comes late: by then others have compiled what the systems need.
"""

import json
import shutil
import signal
import time
from pathlib import Path

import pytest
from commands import gne, gne_here, running

import gne_mj
from gne_mj.simulation import Simulation

FIGURES = {
    *("robots-velocities", "robots-gaps", "robots-constraints"),
    *("channels-powers", "channels-total-power", "channels-constraints"),
}
SHORT = ("--set", "simulation.duration=0.2")


@pytest.fixture(scope="module")
def drawn(tmp_path_factory):
    """A short `paper`."""
    folder = tmp_path_factory.mktemp("cli") / "paper"
    return folder, gne("paper", *SHORT, "--out", folder)


def test_paper_draws_its_four_figures_and_all_constraints(drawn):
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


@pytest.mark.parametrize("changed", [True, pytest.param(False, marks=pytest.mark.slow)])
def test_what_was_changed_while_paper_ran_is_not_replaced(changed, drawn, tmp_path, monkeypatch):
    folder = tmp_path / "paper"
    shutil.copytree(drawn[0], folder)
    run = Simulation.run

    def meanwhile(*arguments):
        (folder / "notes.txt").write_text("mine")
        if changed:
            (folder / "robots-gaps.png").write_bytes(b"mine")
        return run(*arguments)

    monkeypatch.setattr(Simulation, "run", meanwhile)
    report = (folder / "report.json").read_text()
    done = gne_here("paper", *SHORT, "--out", folder)
    assert done.returncode == 0
    assert (folder / "notes.txt").read_text() == "mine"
    if not changed:
        assert [path.name for path in tmp_path.iterdir()] == ["paper"]
        assert (folder / "report.json").read_text() != report
        return
    assert (folder / "robots-gaps.png").read_bytes() == b"mine"
    assert (folder / "report.json").read_text() == report
    assert {path.name for path in tmp_path.iterdir()} == {"paper", "paper-2"}
    assert f"these results are in {folder}-2" in done.stderr
    assert str(tmp_path / "paper-2" / "replay.html") in done.stdout


def test_paper_leaves_a_report_of_someone_elses_alone(drawn, tmp_path):
    """All else there may be of `paper`."""
    folder = tmp_path / "paper"
    shutil.copytree(drawn[0], folder)
    (folder / "report.json").write_text('{"author": "me"}')
    assert gne_here("paper", *SHORT, "--out", folder).returncode == 2
    assert (folder / "report.json").read_text() == '{"author": "me"}'
    assert [path.name for path in tmp_path.iterdir()] == ["paper"]


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


SLOW = pytest.mark.slow


@pytest.mark.parametrize(
    ("scenario", "number"),
    [
        ("velocity-sync", signal.SIGTERM),
        pytest.param("velocity-sync", signal.SIGHUP, marks=SLOW),
        pytest.param("velocity-sync", signal.SIGINT, marks=SLOW),
        pytest.param("cournot", signal.SIGTERM, marks=SLOW),
        pytest.param("paper", signal.SIGINT, marks=SLOW),
    ],
)
@pytest.mark.usefixtures("drawn")  # compiled by now
def test_a_signal_keeps_what_was_done(scenario, number, tmp_path):
    out = tmp_path / "run"
    changes = ("simulation.duration=100000", "simulation.timestep=0.001", "recording.period=10")
    changes = [word for change in changes for word in ("--set", change)]
    with running("run", scenario, *changes, "--out", out, until="of 100000 s") as process:
        time.sleep(1.0)
        assert list(tmp_path.iterdir()) == []
        process.send_signal(number)
        stdout, _ = process.communicate(timeout=60)
    assert process.returncode == 1
    assert "stopped by the user" in stdout
    assert [path.name for path in tmp_path.iterdir()] == ["run"]
    report = json.loads((out / "report.json").read_text())
    assert report["status"] == "interrupted"
    loaded = gne_mj.Trajectory.load(out / "trajectory.zarr")
    assert loaded.status == "interrupted"
    for system, certificate in report["systems"].items():
        times = loaded[system]["time"].to_numpy()
        assert "stopped by the user" in certificate["message"]
        assert 0 < times[-1] == pytest.approx(certificate["end_time"])
        assert times[-1] < 100000
