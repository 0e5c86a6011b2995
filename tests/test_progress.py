"""How long something takes and how far it is: what is told, when, and to whom."""

import io
import time
from types import SimpleNamespace

import numpy as np
import pytest
from builders import FIVE, robot_state, robot_system
from matplotlib.figure import Figure

import gne_mj as gm
from gne_mj import game_check, progress
from gne_mj.batches import Progress, of_runs
from gne_mj.games import cournot_game
from gne_mj.plots import trajectories
from gne_mj.solutions import solve_system


@pytest.fixture
def clock(monkeypatch):
    """Time as tests set it, in which a wait of 10 s is long."""
    now = SimpleNamespace(time=0.0)
    monkeypatch.setattr(progress, "monotonic", lambda: now.time)
    monkeypatch.setattr(progress, "LONG", 10.0)
    return now


def work(clock, pieces, each, first=0.0, last=None):
    """Pieces that take ``each`` s, the first one so much more, up to the last or another one."""
    with progress.telling("preparing") as tell:
        tell(0, pieces, f"{pieces} runs of 20 s on 2 processors")
        for done in range(1, (last or pieces) + 1):
            clock.time += each + (first if done == 1 else 0.0)
            tell(done, pieces, f"{done} of {pieces} runs")


def test_the_estimate_is_what_is_left_at_the_pace_so_far(clock, capsys):
    work(clock, 75, 0.5)
    # told once a second was measured: two pieces behind the first one, and 72 are left
    assert capsys.readouterr().err == "gne-mj: about 35 s: 75 runs of 20 s on 2 processors\n"


def test_what_the_first_piece_compiles_is_not_counted(clock, capsys):
    work(clock, 75, 0.5, first=300.0)
    assert capsys.readouterr().err == "gne-mj: about 35 s: 75 runs of 20 s on 2 processors\n"


def test_a_short_wait_is_not_told(clock, capsys):
    work(clock, 10, 1.0)
    assert capsys.readouterr().err == ""


def test_what_was_done_before_is_not_work_of_now(clock, capsys):
    """A batch that goes on: 1000 of 1100 runs are there already."""
    with progress.telling("preparing") as tell:
        show = of_runs(tell, "runs of 3 s on 2 processors")
        for done in (1000, 1010, 1020):
            clock.time += 2.0
            show(Progress(done, 1100, 1))
    assert capsys.readouterr().err == "gne-mj: about 15 s: 100 runs of 3 s on 2 processors\n"


def test_work_may_turn_out_to_be_more(clock, capsys):
    """The searches' totals are estimates themselves."""
    with progress.telling("preparing") as tell:
        for done, total in ((0, 10), (1, 10), (3, 12), (6, 60)):
            clock.time += 1.0
            tell(done, total, "a search")
    # 5 pieces in 2 s, and 54 are left
    assert capsys.readouterr().err == "gne-mj: about 20 s: a search\n"


@pytest.mark.parametrize(
    ("seconds", "told"),
    [(0.2, "0 s"), (7.4, "7 s"), (43.0, "45 s"), (89.0, "90 s"), (100.0, "2 min"),
     (1830.0, "30 min"), (5399.0, "90 min"), (5400.0, "1.5 h"), (360_000.0, "100.0 h")],
)  # fmt: skip
def test_estimates_are_rounded(seconds, told):
    assert progress._rounded(seconds) == told


def test_a_log_has_a_line_every_minute(monkeypatch, capsys):
    monkeypatch.setattr(progress, "MINUTE", 0.05)
    monkeypatch.setattr(progress, "MEASURED", 0.01)
    with progress.telling("preparing") as tell:
        time.sleep(0.07)
        for done in range(3):
            tell(done, 8, f"{done} of 8 runs")
            time.sleep(0.02)
        time.sleep(0.1)
    told = capsys.readouterr().err.splitlines()
    assert told[0] == "gne-mj: 1 min: preparing"
    assert told[-1].split("min: ")[1].startswith("2 of 8 runs, about ")
    assert told[-1].endswith(" s left")


class Terminal(io.StringIO):
    def isatty(self):
        return True


def test_a_terminal_has_one_line_that_is_rewritten(clock, monkeypatch):
    terminal = Terminal()
    monkeypatch.setattr("sys.stderr", terminal)
    for name, value in (("TERM", "xterm"), ("COLUMNS", "120")):
        monkeypatch.setenv(name, value)
    work(clock, 75, 0.5, last=40)
    shown = terminal.getvalue()
    assert "gne-mj: about 35 s: 75 runs of 20 s on 2 processors" in shown
    assert "40 of 75 runs, about 20 s left" in shown
    assert shown.endswith("\x1b[2K") or "\x1b[2K" in shown[-40:], "the line is gone at the end"


def test_with_json_a_log_is_told_nothing(clock, monkeypatch, capsys):
    monkeypatch.setattr(progress, "MINUTE", 0.01)
    with progress.telling("preparing", quiet=True) as tell:
        show = of_runs(tell, "runs", quiet=True)
        for done in range(75):
            clock.time += 0.5
            show(Progress(done, 75, 0, workers=0))
        time.sleep(0.03)
    assert capsys.readouterr().err == ""


def test_a_cluster_without_workers_is_told_at_once(capsys):
    with progress.telling("preparing") as tell:
        show = of_runs(tell, "runs")
        for workers in (0, 0, 1, 0):
            show(Progress(3, 9, 1, workers))
    told = capsys.readouterr().err.splitlines()
    assert told == ["gne-mj: waiting: the cluster has no workers (Ctrl-C ends)"] * 2


# ------------------------------------------------------------------------------- who tells what


def told_by(work):
    """Each (done, of how much, words) that work tells."""
    told = []
    work(lambda *now: told.append(now))
    return told


def test_solving_tells_after_every_best_response():
    system = robot_system(robot_state(FIVE))
    told = told_by(lambda tell: solve_system(system, (0.1, 0.01), (1e-3, 1e-4), tell))
    assert [done for done, _, _ in told] == list(range(5 * 5 + 1))
    assert {total for _, total, _ in told} == {5 * 5}
    assert told[0][2] == "5 equilibria, and at each the best response of each of 5 agents"
    assert told[-1][2] == "robots: 5 of 5 equilibria"


def test_checking_tells_after_every_profile():
    game, start = cournot_game(2), np.array([20.0, 30.0])
    told = told_by(lambda tell: game_check.examine(game, start, 3, 2, tell))
    assert [now[:2] for now in told] == [(k, 3) for k in range(4)]
    assert told[-1][2] == "3 of 3 profiles"


def test_drawing_tells_after_every_file(monkeypatch, tmp_path):
    figures = {name: Figure(figsize=(0.1, 0.1)) for name in ("gaps", "margins", "velocities")}
    monkeypatch.setattr(trajectories, "draw", lambda trajectory: figures)
    told = told_by(lambda tell: trajectories.save(None, tmp_path, ("png", "svg"), progress=tell))
    assert [now[:2] for now in told] == [(k, 6) for k in range(7)]
    assert (told[0][2], told[-1][2]) == ("6 figures", "6 of 6 figures")
    assert len(list(tmp_path.iterdir())) == 6


SHORT = {"plant.engine": "ode", "simulation.duration": 5.0}


@pytest.mark.parametrize(
    ("words", "run"),
    [
        ("a run of 5 s", lambda out, asked: gm.run("velocity-sync", SHORT, progress=asked)),
        (
            "2 runs, 10 s of them together",
            lambda out, asked: gm.vary(
                "velocity-sync", {"rho": [0.1, 0.2]}, SHORT, progress=asked
            ),
        ),
        (
            "4 runs of 5 s on 1 processor",
            lambda out, asked: gm.batch(
                "velocity-sync", {"barrier.rho": [0.1, 0.2, 0.3, 0.4]}, changes=SHORT, threads=1,
                out=out, progress=asked,
            ),
        ),
    ],
    ids=["run", "vary", "batch"],
)  # fmt: skip
def test_programs_ask_for_it(words, run, clock, monkeypatch, capsys, tmp_path):
    """Whatever takes however long: nothing is told unless ``progress`` is True."""
    monkeypatch.setattr(progress, "MEASURED", 0.0)
    monkeypatch.setattr(progress, "LONG", 0.0)

    def ticking():
        clock.time += 1.0
        return clock.time

    monkeypatch.setattr(progress, "monotonic", ticking)
    run(tmp_path / "one", True)
    told = capsys.readouterr().err
    assert told.count("\n") == 1
    assert told.endswith(f": {words}\n")
    run(tmp_path / "other", False)
    assert capsys.readouterr().err == ""
