"""The worked examples, copied elsewhere and run by the installed command as a user would."""

import json
import os
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import xarray
from scipy.optimize import brentq

import gne_mj
from gne_mj.barrier import LogBarrier
from gne_mj.cli import main
from gne_mj.user_files import load_module

EXAMPLES = Path(__file__).resolve().parents[1] / "examples"
COMMAND = Path(sys.executable).with_name("gne-mj")
SHORT = ("--set", "simulation.duration=0.2")


@pytest.fixture(scope="module")
def copied(tmp_path_factory):
    """The examples in a folder that knows nothing of this checkout."""
    folder = tmp_path_factory.mktemp("user") / "examples"
    shutil.copytree(EXAMPLES, folder, ignore=shutil.ignore_patterns("__pycache__"))
    return folder


def run(copied, scenario, out, *arguments):
    """Run by the command, from another folder; the finished process, its report and data."""
    elsewhere = out.parent
    environment = {key: value for key, value in os.environ.items() if key != "DISPLAY"}
    done = subprocess.run(
        [COMMAND, "run", copied / scenario, "--out", out, "--json", *map(str, arguments)],
        cwd=elsewhere, env=environment, capture_output=True, text=True, check=False, timeout=300,
    )  # fmt: skip
    assert done.stderr == ""
    assert done.returncode == 0, done.stdout
    with xarray.open_datatree(out / "trajectory.zarr", engine="zarr") as tree:
        (group,) = tree.children.values()
        data = group.to_dataset().load()
    (report,) = json.loads(done.stdout)["systems"].values()
    return report, data


@pytest.mark.slow
def test_robots_of_ones_own_find_a_common_velocity(copied, tmp_path):
    report, data = run(copied, "robot/scenario.toml", tmp_path / "joints")
    assert report["status"] == "converged"
    assert np.allclose(data["action"][-1], 2.0, rtol=0, atol=1e-4)
    assert report["worst_gap"]["gap"] < 1.5
    assert report["lyapunov"]["known"] is False
    assert report["lyapunov"]["claimed"] is False
    # positions are those that the velocities add up to (trapezoids, 0.05 s)
    way = data["state"].sel(component="position").values
    speed = data["action"].values
    added = np.cumsum(0.5 * 0.05 * (speed[1:] + speed[:-1]), axis=0)
    assert np.allclose(way[1:] - way[0], added, rtol=0, atol=2e-3)
    # momentum: forces along the rail are the inputs alone, so at the end, when all of a robot
    # moves at one speed, their impulse is its whole mass times the gain in speed
    sampled, measured = run(copied, "robot/sensor.toml", tmp_path / "sensors")
    assert sampled["status"] == "converged"
    impulse = np.sum(0.5 * 0.05 * (data["input"].values[1:] + data["input"].values[:-1]), axis=0)
    mass = np.array([3.05, 4.0, 3.05, 4.0])
    assert np.allclose(impulse, mass * (2.0 - speed[0]), rtol=0, atol=5e-3)
    # 10 ms of delay hardly matter here
    assert np.max(np.abs(measured["action"] - data["action"])) < 0.02


CAPACITY, SLOPE, RHO = 20.0, 0.05, 0.02
WEIGHT = np.array([1.0, 1.0, 2.0, 0.5, 1.0, 1.5])
WANTED = np.array([7.0, 3.6, 7.0, 11.0, 3.6, 7.0])


def powers(rho):
    """The penalised equilibrium in closed form, up to one equation for the total s.

    a (y - d) + c (s + y) - rho / y + rho / (P - s) = 0 is a quadratic in each y > 0.
    """

    def each(s):
        b = SLOPE * s - WEIGHT * WANTED + rho / (CAPACITY - s)
        a = WEIGHT + SLOPE
        return (-b + np.sqrt(b * b + 4 * a * rho)) / (2 * a)

    total = brentq(lambda s: each(s).sum() - s, 0.1, CAPACITY - 1e-9, xtol=1e-14)
    return each(total)


def shared():
    """The variational GNE: a (y - d) + c (P + y) + lambda = 0 with sum y = P."""
    room = WEIGHT + SLOPE
    wish = WEIGHT * WANTED - SLOPE * CAPACITY
    multiplier = (np.sum(wish / room) - CAPACITY) / np.sum(1 / room)
    y = (wish - multiplier) / room
    assert multiplier > 0
    assert np.all(y > 0)
    return y


@pytest.mark.slow
def test_a_game_of_ones_own_shares_the_feeder(copied, tmp_path):
    """Plain functions and the same ones as kernels; 4 s are enough to compare them."""
    arguments = ("--set", "simulation.duration=4")
    report, plain = run(copied, "game/scenario.toml", tmp_path / "plain", *arguments)
    fast = ("--set", f"game.file={copied / 'game/charging_fast.py'}", *arguments)
    again, kernels = run(copied, "game/scenario.toml", tmp_path / "fast", *fast)
    for name in ("action", "input", "constraint", "state"):
        assert np.array_equal(plain[name], kernels[name]), name
    expected = powers(RHO)
    for each in (report, again):
        assert each["equilibrium"]["penalised"] == pytest.approx(expected, abs=1e-9)
        assert each["equilibrium"]["variational"] == pytest.approx(shared(), abs=1e-8)
    multiplier = report["equilibrium"]["multipliers"][-1]
    assert 0.0 < CAPACITY - expected.sum() < 0.02, "the feeder is nearly full"
    assert multiplier == pytest.approx(RHO / (CAPACITY - expected.sum()), rel=1e-9)
    assert list(plain["constraint_name"].values[[0, -1]]) == ["vehicle 1 takes power", "feeder"]


@pytest.mark.slow
def test_a_game_of_ones_own_reaches_its_equilibrium(copied, tmp_path):
    fast = ("--set", f"game.file={copied / 'game/charging_fast.py'}")
    report, data = run(copied, "game/scenario.toml", tmp_path / "run", *fast)
    assert report["status"] == "converged"
    assert np.allclose(data["action"][-1], powers(RHO), rtol=0, atol=1e-3)
    assert report["worst_constraint"]["name"] == "feeder"


def test_the_kernels_are_the_plain_functions_with_a_mark():
    plain, fast = (
        (EXAMPLES / f"game/charging_{name}.py").read_text().splitlines()
        for name in ("plain", "fast")
    )
    marked = [line for line in fast if line not in ("@kernel", "from gne_mj.native import kernel")]
    assert marked[1:] == plain[1:], "but for the title"
    assert fast.count("@kernel") == 7


@pytest.mark.slow
def test_a_law_of_ones_own(copied, tmp_path):
    report, plain = run(copied, "law/scenario.toml", tmp_path / "plain")
    fast = ("--set", f"controller.file={copied / 'law/damped_fast.py'}")
    again, kernels = run(copied, "law/scenario.toml", tmp_path / "fast", *fast)
    for each in (report, again):
        assert each["status"] == "converged"
        assert each["lyapunov"]["claimed"] is False
    for name in ("action", "input", "state", "memory"):
        assert np.allclose(plain[name], kernels[name], rtol=0, atol=1e-12), name
    # the first input by hand: y - z is zero, and the gaps of FIVE are known
    y = np.array([1.0, 0.0, -1.0, 0.5, 2.0])
    gap = np.diff([3.0, *y])
    force = 2 * gap + 0.1 * 2 * gap / (9 - gap**2)
    force[:-1] -= 0.1 * 2 * gap[1:] / (9 - gap[1:] ** 2)
    gains = np.array([2.0, 2.0, 2.0, 3.0, 3.0])
    assert np.allclose(plain["input"][0], -gains * force, rtol=1e-13)
    # the filter is what it says: tau z' = y - z, by trapezoids between samples
    z, speed, tau = plain["memory"].values, plain["action"].values, 0.5
    rate = (speed - z) / tau
    assert np.allclose(np.diff(z, axis=0), 0.025 * (rate[1:] + rate[:-1]), rtol=0, atol=2e-3)
    assert np.allclose(z[-1], 3.0, rtol=0, atol=1e-3)


@pytest.mark.slow
def test_a_law_of_ones_own_propagates_exactly(copied):
    """Mode sampled: over each held period the filter moves by its exact solution."""
    trajectory = gne_mj.run(
        copied / "law/scenario.toml",
        {
            "controller.file": str(copied / "law/damped_fast.py"),
            "controller.mode": "sampled",
            "simulation.control_period": 0.05,
            "simulation.duration": 1.0,
        },
    )
    data = trajectory["robots"]
    y, z = data["action"].values, data["memory"].values
    expected = y[:-2] + np.exp(-0.05 / 0.5) * (z[:-2] - y[:-2])
    assert np.allclose(z[1:-1], expected, rtol=0, atol=1e-13)


def refused(capsys, monkeypatch, tmp_path, *arguments):
    """Run the command here: its exit status and the one sentence on stderr; nothing is written."""
    out = tmp_path / "results"
    monkeypatch.setattr(sys, "argv", ["gne-mj", "run", *map(str, arguments), "--out", str(out)])
    with pytest.raises(SystemExit) as ended:
        main()
    printed = capsys.readouterr()
    assert printed.out == ""
    assert printed.err.count("\n") == 1
    assert printed.err.startswith("gne-mj: ")
    assert not out.exists()
    assert not [path for path in tmp_path.iterdir() if path.name.startswith(".")]
    return ended.value.code, printed.err


GAME_MISTAKES = {
    # name: what is replaced by what, the exit status and words of the sentence
    "raises": (
        "    power = 0.0\n",
        "    assert y[0] < 1.01, 'too much'\n    power = 0.0\n",
        1,
        ["user_code_failed: mine.py, line 37, in ", "AssertionError: too much"],
    ),
    "signature": ("cost(q, i, y)", "cost(q, y)", 2, ["mine.py", "cost(q, i, y)"]),
    "syntax": ("def cost(q, i, y):", "def cost(q, i y):", 2, ["SyntaxError", "line 4"]),
    "import": ("import sys\n", "import sys\nimport nope\n", 2, ["ModuleNotFoundError", "nope"]),
    "missing": ("def constraint(", "def constrain(", 2, ["must define constraint(q, l, y)"]),
    "no game": ("def game(", "def play(", 2, ["mine.py", "function game(count, ...)"]),
    "no Game": ("    return Game(", "    return dict(", 2, ["must return a gne_mj Game"]),
    "None": ("return 0.0", "return None", 1, ["constraint_hessian", "a number, not None"]),
    "text": ("return -y[k] if", "return 'no' if", 1, ["constraint", "not str 'no'"]),
    "sizes": ("(1,) * count", "(1,) * (count - 1)", 2, ["game.in_cost", "there must be 5"]),
    "members": ("[i] for i in", "[i + 1] for i in", 2, ["game.in_constraint: got [6]", "0 to 5"]),
    "writes": ("    power = 0.0\n", "    y[0] = 0.0\n    power = 0.0\n", 1, ["read-only"]),
}  # fmt: skip


@pytest.mark.parametrize("mistake", GAME_MISTAKES)
def test_mistakes_in_a_game(copied, tmp_path, capsys, monkeypatch, mistake):
    old, new, status, words = GAME_MISTAKES[mistake]
    text = (copied / "game/charging_plain.py").read_text()
    assert old in text
    (tmp_path / "mine.py").write_text(text.replace(old, new))
    arguments = ("--set", f"game.file={tmp_path / 'mine.py'}", *SHORT)
    code, sentence = refused(
        capsys, monkeypatch, tmp_path, copied / "game/scenario.toml", *arguments
    )
    assert code == status
    for word in words:
        assert word in sentence


@pytest.mark.parametrize(
    ("old", "new", "status", "words"),
    [
        ("@kernel\ndef cost_gradient", "def cost_gradient", 2, "'cost' is a kernel"),
        ("@kernel\ndef total", "def total", 1, "line 67: a kernel cannot be compiled: Untyped"),
        ("power = 0.0", "power = np.zeros(1)[0]", 1, "line 39: a kernel cannot be compiled: it al"),
    ],
    ids=["mixture", "unmarked", "allocates"],
)
def test_mistakes_in_kernels(copied, tmp_path, capsys, monkeypatch, old, new, status, words):
    text = (copied / "game/charging_fast.py").read_text()
    assert old in text
    (tmp_path / "mine.py").write_text(text.replace(old, new))
    arguments = ("--set", f"game.file={tmp_path / 'mine.py'}", *SHORT)
    code, sentence = refused(
        capsys, monkeypatch, tmp_path, copied / "game/scenario.toml", *arguments
    )
    assert code == status
    assert words in sentence


LAW_MISTAKES = {
    "mid-run": (
        "    gradient =",
        "    assert y[0] < 1.02, 'fast'\n    gradient =",
        1,
        "user_code_failed: mine.py, line 23, in action: AssertionError: fast",
    ),
    "raises": ("    gradient =", "    1 / 0\n    gradient =", 1, "in action: ZeroDivisionError"),
    "shape": ("    return -np", "    return 0\n    return -np", 1, "5 numbers, not shape ()"),
    "rate": ("def rate(", "def rat(", 2, "both of these functions"),
    "action": ("def action(", "def act(", 2, "law(game, graph, ...) or action(...)"),
    "memory": ("    return y\n", "    return None\n", 1, "in initial_memory: it must return"),
    "parameter": ("gains, damping, tau", "gains, tau", 2, "'damping'"),
}


def test_a_failure_as_json(copied, tmp_path, capsys, monkeypatch):
    path = tmp_path / "mine.py"
    path.write_text("def action(game, rho, y, memory, **parameters):\n    return y[99]\n")
    scenario = str(copied / "law/scenario.toml")
    setting = f"controller.file={path}"
    monkeypatch.setattr(sys, "argv", ["gne-mj", "run", scenario, "--json", "--set", setting])
    with pytest.raises(SystemExit) as ended:
        main()
    document = json.loads(capsys.readouterr().out)
    assert ended.value.code == 1
    assert document["status"] == "user_code_failed"
    assert document["message"].startswith("mine.py, line 2, in action: IndexError")


@pytest.mark.parametrize("mistake", LAW_MISTAKES)
def test_mistakes_in_a_law(copied, tmp_path, capsys, monkeypatch, mistake):
    old, new, status, words = LAW_MISTAKES[mistake]
    text = (copied / "law/damped_plain.py").read_text()
    assert old in text
    (tmp_path / "mine.py").write_text(text.replace(old, new))
    arguments = ("--set", f"controller.file={tmp_path / 'mine.py'}", *SHORT)
    ode = ("--set", "plant.engine=ode")
    code, sentence = refused(
        capsys, monkeypatch, tmp_path, copied / "law/scenario.toml", *arguments, *ode
    )
    assert code == status
    assert words in sentence


@pytest.mark.parametrize(
    ("scenario", "setting", "words"),
    [
        ("game", "game.file=nope.py", "systems.vehicles.game.file: got "),
        ("game", "game.file=3", "systems.vehicles.game.file: got 3"),
        ("game", "game.file=EXAMPLES/game/README.md", "a Python file ending in .py"),
        ("game", "game.parameters.capactiy=3", "unexpected keyword argument 'capactiy'"),
        ("game", "agents.count=5", "must list 5 numbers each"),
        ("law", "controller.parameters.gain=3", "tau) has no 'gain'; did you mean 'gains'?"),
        ("law", "controller.mode=sampled", "systems.robots.controller.mode: got 'sampled'"),
        ("robot", "agents.output=travle", "systems.fleet.agents.output: got 'travle', but did you"),
        ("robot", 'agents.output=["a"]', "one name or a list of 4"),
        ("robot", "agents.output=[1, 2, 3, 4]", "systems.fleet.agents.output.0: got 1"),
        ("robot", "agents.input=drive", "systems.fleet.agents.input: got 'drive', but choose from"),
        ("robot", "agents.file=nope.xml", "systems.fleet.agents.file: got 'nope.xml'"),
        ("robot", "plant.engine=ode", "MJCF robots run on 'mujoco'"),
    ],
)
def test_mistakes_in_a_scenario(copied, tmp_path, capsys, monkeypatch, scenario, setting, words):
    setting = setting.replace("EXAMPLES", str(copied))
    code, sentence = refused(
        capsys, monkeypatch, tmp_path, copied / scenario / "scenario.toml", "--set", setting, *SHORT
    )
    assert code == 2
    assert words in sentence


def test_a_kernel_law_must_not_pass_for_another(copied, tmp_path, capsys, monkeypatch):
    text = (copied / "law/damped_fast.py").read_text()
    path = tmp_path / "mine.py"
    arguments = (copied / "law/scenario.toml", "--set", f"controller.file={path}", *SHORT)
    path.write_text(
        text.replace("class Damped(Law):", "class Damped(Law):\n    information = 'full'\n")
    )
    code, sentence = refused(capsys, monkeypatch, tmp_path, *arguments)
    assert code == 2
    assert "a law of one's own has 'custom'" in sentence
    path.write_text(text.replace("@kernel\ndef storage", "def storage"))
    assert "needs a kernel named storage" in refused(capsys, monkeypatch, tmp_path, *arguments)[1]
    path.write_text(text.replace("    return Damped(gains, damping, tau)", "    return 3"))
    assert "must return a Law" in refused(capsys, monkeypatch, tmp_path, *arguments)[1]


def test_a_relaxed_barrier_is_the_barrier_where_there_is_slack_and_goes_on_smoothly():
    law = load_module(EXAMPLES / "law" / "relaxed_plain.py")
    game = gne_mj.load_scenario("desired-velocity").system_objects()[0].game
    y, none = np.array([3.1, 3.2, 3.3, 3.2, 3.1]), np.zeros(0)
    expected = game.pseudo_gradient(y) + LogBarrier(game, 0.2).gradient(y)
    assert np.allclose(law.action(game, 0.2, y, none, 1.5, 1e-3), -1.5 * expected, atol=1e-12)
    near = [law.action(game, 0.2, y, none, 1.0, -game.constraints(y)[0] * (1 + e))
            for e in (-1e-9, 1e-9)]  # fmt: skip
    assert np.allclose(*near, atol=1e-7)
    outside = np.array([9.0, 3.0, 3.0, 3.0, 3.0])
    pushed = law.action(game, 0.2, outside, none, 1.0, 0.1) + game.pseudo_gradient(outside)
    assert pushed[0] < -100.0
    assert law.ACTS_OUTSIDE
    assert set(law.TUNED) == {"gain", "width"}
