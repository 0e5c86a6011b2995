"""The map of control periods, margins and pushes."""

import csv
import json

import pytest
from builders import FIVE, robot_state, robot_system

from gne_mj.cli import main
from gne_mj.errors import InvalidInput
from gne_mj.exit_map import Grid, exit_map, summary

SMALL = [
    "map", "velocity-sync", "--set", "plant={engine='ode', integrator='euler'}", "--set",
    "simulation.timestep=0.005", "--periods", "0.005:0.1:2", "--margins", "1e-6:0.3:2", "--pushes",
    "0", "--runs", "3", "--duration", "0.3",
]  # fmt: skip


def run_main(monkeypatch, *words):
    monkeypatch.setattr("sys.argv", ["gne-mj", *words])
    with pytest.raises(SystemExit) as end:
        main()
    return end.value.code


@pytest.mark.slow
def test_cells_tell_who_left_and_when():
    system = robot_system(robot_state(FIVE), integrator="euler")
    grid = Grid(periods=(0.005, 0.1), margins=(1e-6, 0.3), runs=4, duration=0.3, seed=1)
    done = []
    cells = exit_map(system, 0.005, grid, lambda *told: done.append(told[2]))
    assert done[1:] == [f"{n} of 32 runs" for n in range(1, grid.total + 1)]
    assert len(cells) == 8
    by = {(c.mode, c.period, c.margin): c for c in cells}
    assert all(c.share == 0 for c in cells if c.mode == "implicit")
    assert by["sampled", 0.005, 1e-6].left_at_instant == 4
    assert by["sampled", 0.1, 1e-6].left_between == 4, "first seen a substep later"
    assert by["sampled", 0.005, 0.3].share == 0
    assert by["sampled", 0.005, 0.3].least_margin > 0
    assert by["sampled", 0.005, 1e-6].least_margin is None
    lines = list(summary(cells))
    assert lines[0] == (
        "sampled, push 0: no period was safe; of 16 runs 4 left at a control instant, 4 between"
    )
    assert "every start stayed inside up to 0.1 s" in lines[1]
    assert exit_map(system, 0.005, grid) == cells, "it repeats"
    assert exit_map(system, 0.005, grid, stopped=lambda: True) == []


@pytest.mark.slow
def test_the_command_writes_figure_and_table(tmp_path, monkeypatch, capsys):
    out = tmp_path / "map"
    assert run_main(monkeypatch, *SMALL, "--out", str(out)) == 0
    printed = capsys.readouterr().out
    assert "implicit, push 0: every start stayed inside up to 0.1 s" in printed
    assert str(out / "map.png") in printed
    with (out / "map.csv").open() as stream:
        rows = list(csv.DictReader(stream))
    assert len(rows) == 8
    assert {row["mode"] for row in rows} == {"sampled", "implicit"}
    assert (out / "map.png").stat().st_size > 10_000
    assert run_main(monkeypatch, *SMALL, "--json") == 0
    cells = json.loads(capsys.readouterr().out)
    assert [cell["left_at_instant"] for cell in cells] == [int(r["left_at_instant"]) for r in rows]


@pytest.mark.parametrize(
    ("words", "key"),
    [
        (["--periods", "1:2"], "--periods"),
        (["--margins", "0.5:2:2"], "--margins"),
        (["--pushes", "a"], "--pushes"),
        (["--runs", "0"], "--runs"),
        (["--system", "robot"], "--system"),
    ],
)
def test_mistakes_are_named(words, key, monkeypatch, capsys):
    assert run_main(monkeypatch, *SMALL, *words) == 2
    assert key in capsys.readouterr().err


def test_several_systems_need_a_name(monkeypatch, capsys):
    assert run_main(monkeypatch, "map", "paper") == 2
    assert "robots, channels" in capsys.readouterr().err


def test_negative_periods_are_refused():
    with pytest.raises(InvalidInput, match="periods: got"):
        Grid(periods=(-1.0,), margins=(0.1,))


def test_a_negative_seed_is_refused():
    with pytest.raises(InvalidInput, match="seed: got -1"):
        Grid(periods=(0.1,), margins=(0.1,), seed=-1)
