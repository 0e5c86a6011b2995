"""`gne-mj solve`: what is computed, what is told and what is written."""

import csv
import json

import numpy as np
import pytest
from commands import gne_here as gne

import reference_games
from gne_mj import solutions
from gne_mj.equilibrium import penalised_equilibrium
from gne_mj.errors import InvalidInput
from gne_mj.scenario import load_scenario


def system(name="desired-velocity"):
    return load_scenario(name).simulation_object().systems[0]


def test_the_shipped_desires_make_two_bounds_bind():
    """By hand: with gaps 2 and 4 on their bounds, +1 and -1, three free velocities are left."""
    solution = solutions.solve_system(system())
    assert solution.holds
    assert solution.optimality.weakly_active == ()
    assert [solution.game.constraint_names[k] for k in solution.optimality.active] == [
        "gap of agent 2",
        "gap of agent 4",
    ]
    oracle = reference_games.VelocityGame(3.0, [1.0] * 5, [3.0, 6.0, 6.0, 1.0, 3.0], [2.0] * 5)
    y, pushes = solution.variational.action, solution.variational.multipliers
    force = np.array([oracle.partial_gradient(i, y) for i in range(5)])
    assert y[1] - y[0] == pytest.approx(1.0, abs=1e-10)
    assert y[3] - y[2] == pytest.approx(-1.0, abs=1e-10)
    # a bound's push on an agent and on the one ahead are opposite
    assert force[0] + force[1] == pytest.approx(0.0, abs=1e-9)
    assert force[2] + force[3] == pytest.approx(0.0, abs=1e-9)
    assert force[4] == pytest.approx(0.0, abs=1e-9)
    assert 2.0 * pushes[1] == pytest.approx(-force[1], abs=1e-9)
    assert 2.0 * pushes[3] == pytest.approx(force[3], abs=1e-9)


def test_what_the_lemma_says_is_what_is_measured():
    each = system()
    solution = solutions.solve_system(each, rhos=(0.1, 0.01), path_rhos=(1e-3, 1e-4))
    game = each.game
    for point in (*solution.penalised, *solution.path):
        rho, y = point.equilibrium.rho, point.equilibrium.action
        assert np.all(point.gains <= game.own_constraints * rho + 1e-9)
        expected = penalised_equilibrium(game, rho, each.start).action
        assert np.allclose(y, expected, rtol=0, atol=1e-10)
        assert point.distance == np.max(np.abs(y - solution.variational.action))
    distances = [point.distance for point in (*solution.penalised, *solution.path)]
    assert np.all(np.diff(distances) < 0)


def test_without_a_rho_the_systems_own():
    assert [p.equilibrium.rho for p in solutions.solve_system(system()).penalised] == [0.1]


def test_equal_ratios():
    rhos = solutions.parse_path("1:1e-6:7")
    assert np.allclose(rhos, 10.0 ** -np.arange(7.0), rtol=1e-12)


@pytest.mark.parametrize(
    "text", ["", "1", "1:2", "1:2:3:4", "0:1:3", "1:-1:3", "1:inf:3", "nan:1:3", "1:2:1", "a:1:3"]
)
def test_paths_that_are_none(text):
    with pytest.raises(InvalidInput, match="FROM:TO:COUNT"):
        solutions.parse_path(text)


def test_in_words():
    done = gne("solve", "desired-velocity", "--path", "1:1e-2:3")
    assert (done.returncode, done.stderr) == (0, "")
    for text in (
        "rho = 0.1", "3.6, 4.6, 4.32, 3.32, 3.1067 m/s", "2 of 5", "at most 0.5 = p rho", "path",
    ):  # fmt: skip
        assert text in done.stdout


def test_json_and_files(tmp_path):
    out = tmp_path / "solved"
    done = gne(
        "solve", "paper", "--system", "channels", "--rho", "0.1", "--rho", "0.01",
        "--path", "1:1e-3:4", "--out", out, "--json",
    )  # fmt: skip
    assert (done.returncode, done.stderr) == (0, "")
    report = json.loads(done.stdout)
    assert report == json.loads((out / "report.json").read_text())
    assert list(report) == ["channels"]
    channels = report["channels"]
    assert [point["rho"] for point in channels["penalised"]] == [0.1, 0.01]
    assert channels["variational"]["active"] == ["total power"]
    assert channels["variational"]["residual"] < 1e-10
    assert channels["variational"]["complementarity"] < 1e-10
    assert channels["variational"]["largest_constraint"] < 0
    assert len(channels["variational"]["multipliers"]) == len(channels["constraints"]) == 11
    first = channels["penalised"][0]["epsilon"]
    assert first["measured"] == max(first["each"]) <= first["largest_own_bound"] < first["bound"]
    with (out / "channels-path.csv").open(newline="") as stream:
        rows = list(csv.DictReader(stream))
    assert [float(row["rho"]) for row in rows] == pytest.approx([1.0, 0.1, 0.01, 1e-3])
    for row, point in zip(rows, channels["path"], strict=True):
        assert float(row["power 3"]) == point["action"][2]
        assert float(row["multiplier of total power"]) == point["multipliers"][-1]
    assert (out / "channels-path.png").read_bytes().startswith(b"\x89PNG")
    assert sorted(file.name for file in out.iterdir()) == [
        "channels-path.csv", "channels-path.png", "report.json",
    ]  # fmt: skip


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("--system", "robot"), ("--system", "'robots'")),
        (("--path", "1:2"), ("--path", "FROM:TO:COUNT")),
        (("--rho", "0"), ("--rho: got 0.0", "positive")),
        (("--rho", "1e-30"), ("residual",)),
        (("--set", "initial.action=[9, 9, 9, 9]"), ("initial.action", "5")),
    ],
    ids=str,
)
def test_errors_are_one_sentence(arguments, words):
    done = gne("solve", "desired-velocity", *arguments)
    assert done.returncode == 2
    assert done.stdout == ""
    assert len(done.stderr.splitlines()) == 1
    for word in words:
        assert word in done.stderr
    with_json = gne("solve", "desired-velocity", *arguments, "--json")
    assert with_json.returncode == 2
    assert json.loads(with_json.stdout)["message"] in done.stderr
