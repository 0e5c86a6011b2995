"""Functions of users' own that end the program, print, return no number, or never return."""

import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import own_games
import pytest
from commands import gne_here

import gne_mj
from gne_mj.equilibrium import penalised_equilibrium
from gne_mj.errors import InfeasibleStart, InvalidInput, UserCodeError
from gne_mj.game_model import Game
from gne_mj.plain import number_of
from gne_mj.user_files import load_module

EXAMPLES = Path(__file__).parent.parent / "examples"
FILES = {"law": "damped_plain.py", "game": "charging_plain.py"}
ODE = {"law": ("--set", "plant.engine=ode"), "game": ()}
ENDINGS = {
    "exit": ("sys.exit(0)", "SystemExit: 0"),
    "generator": ("raise GeneratorExit", "GeneratorExit"),
    "own": ("raise Own('of mine')", "Own: of mine"),
}


def setting(kind, folder, *changes):
    """What --set names: the example's file with some text put in place of other."""
    text = "import sys\nclass Own(BaseException): pass\n" + (
        EXAMPLES / kind / FILES[kind]
    ).read_text().replace("from __future__", "# from __future__")
    for old, new in changes:
        assert old in text
        text = text.replace(old, new)
    path = folder / "mine.py"
    path.write_text(text)
    key = {"law": "controller.file", "game": "game.file"}[kind]
    return (EXAMPLES / kind / "scenario.toml", "--set", f"{key}={path}", *ODE[kind])


def run(kind, folder, *changes, command="run", more=("--set", "simulation.duration=0.1")):
    return gne_here(command, *setting(kind, folder, *changes), *more)


def failed(done, words, code=1, status="user_code_failed"):
    assert done.returncode == code, done.stderr
    assert done.stdout == ""
    assert done.stderr.count("\n") == 1
    assert done.stderr.startswith("gne-mj: " + (f"{status}: mine.py, line " if code == 1 else ""))
    assert words in done.stderr


@pytest.mark.parametrize("ending", ENDINGS)
@pytest.mark.parametrize(
    ("kind", "before"),
    [
        ("law", "    gradient = "),
        ("law", "    return y\n"),  # in initial_memory
        ("game", "    power = 0.0\n"),
    ],
)
def test_what_would_end_the_program_is_a_failure(tmp_path, kind, before, ending):
    statement, words = ENDINGS[ending]
    failed(run(kind, tmp_path, (before, f"    {statement}\n{before}")), f": {words}")


@pytest.mark.parametrize("ending", ENDINGS)
@pytest.mark.parametrize(
    ("kind", "before", "words"),
    [
        ("law", "def action(", "Python must run it: "),
        ("game", "def game(", "Python must run it: "),
        ("game", "    return Game(", "the file must accept them: "),
    ],
)
def test_so_it_is_before_there_is_a_run(tmp_path, kind, before, words, ending):
    statement, raised = ENDINGS[ending]
    indent = " " * (len(before) - len(before.lstrip()))
    done = run(kind, tmp_path, (before, f"{indent}{statement}\n{before}"))
    failed(done, words + raised, code=2)


@pytest.mark.parametrize(
    ("command", "more"),
    [
        ("solve", ()),
        ("certify", ()),
        ("check", ()),
        ("batch", ("--runs", "2", "--threads", "1")),
        ("map", ("--runs", "1")),
    ],
)
def test_no_command_ends_well_then(tmp_path, monkeypatch, command, more):
    """Each calls the game's functions from somewhere else."""
    monkeypatch.chdir(tmp_path)
    late = (
        "    total_calls.append(1)\n    if len(total_calls) > 500: sys.exit(0)\n    power = 0.0\n"
    )
    changes = (("    power = 0.0\n", late), ("def game(", "total_calls = []\ndef game("))
    done = run("game", tmp_path, *changes, command=command, more=more)
    failed(done, ": SystemExit: 0")


def test_a_law_of_kernels_may_fail_in_python(tmp_path):
    """In a method of its own, which nobody guards."""
    text = (EXAMPLES / "law" / "damped_fast.py").read_text()
    old = "        return np.concatenate([super().settings"
    assert old in text
    (tmp_path / "mine.py").write_text(text.replace(old, f"        raise SystemExit(0)\n{old}"))
    law = f"controller.file={tmp_path / 'mine.py'}"
    failed(
        gne_here("run", EXAMPLES / "law" / "scenario.toml", "--set", law, *ODE["law"]),
        "in settings: SystemExit: 0",
    )


@pytest.mark.parametrize(
    ("value", "words"),
    [
        ("1j * y", "numbers, not complex ones"),
        ("[str(each) for each in y]", "numbers, not list"),
        ("None", "numbers, not NoneType"),
        ("y[:2]", "5 numbers, not shape (2,)"),
        ("y[:, None]", "5 numbers, not shape (5, 1)"),
    ],
)
def test_inputs_that_are_no_numbers(tmp_path, value, words):
    change = ("    gradient = ", f"    return {value}\n    gradient = ")
    failed(run("law", tmp_path, change), f"in action: it must return {words}")


@pytest.mark.parametrize(
    ("value", "shown"),
    [
        (np.complex128(1 + 2j), "complex128"),
        (np.array(3 + 0j), "ndarray"),
        ("3", "str '3'"),
        (b"3", "bytes"),
        (None, "None"),
        ([1.0], "list [1.0]"),
    ],
)
def test_numbers_that_are_none(value, shown):
    """NumPy would take most of them, and drop an imaginary part with a warning."""
    with pytest.raises(UserCodeError, match="it must return a number, not ") as caught:
        number_of(len, value)
    assert shown in str(caught.value)


def test_numbers():
    for value in (2, 2.0, np.float32(2.0), np.int64(2), np.array(2.0), True + 1):
        number = number_of(len, value)
        assert (number, type(number)) == (2.0, float)


@pytest.mark.parametrize(
    ("field", "value"),
    [
        ("name", None), ("name", "\udcff"), ("action_unit", 3), ("agent_name", ["a"]),
        ("constraint_names", ("a", 2)), ("constraint_names", "ab"), ("axes", 3), ("axes", (1,)),
        ("sizes", (1.0, 1.0)), ("sizes", ("1", "1")), ("sizes", None), ("sizes", 3),
        ("in_cost", None), ("in_cost", [[0.5], [1]]), ("in_cost", "ab"), ("in_cost", [0, 1]),
        ("in_constraint", [None, None]), ("in_constraint", [["a"], [1]]),
        ("parameters", "abc"), ("parameters", [1j]), ("parameters", [[1.0]]),
        ("parameters", [1, [2]]), ("parameters", None),
        ("quantities", 3), ("quantities", (3,)), ("quantities", "ab"),
        ("box", 3), ("box", (1.0, 2.0)), ("box", ("a", "b")), ("box", ([0j, 0j], [1.0, 1.0])),
        ("jacobian_bounds", 3), ("feasible_jacobian_bounds", 3),
        ("feasible_jacobian_bounds", ("a", "b")), ("feasible_jacobian_bounds", ([0.0], [1.0])),
        ("gap_bounds", "a"), ("gap_bounds", [1j, 1j]), ("gap_bounds", [1.0]),
        ("affine", 3), ("affine", np.ones(3)), ("smooth", "no"), ("tested", np.ones(3)),
        ("row_scaled", None),
        ("tightening", 3), ("tightening", "a"), ("tightening", -np.ones(2)),
        ("tightening", np.ones(3)), ("tightening", np.ones(2) * 1j),
    ],
)  # fmt: skip
def test_fields_of_a_game_that_are_of_another_kind(field, value):
    """Each ended in a traceback, or was dropped in silence."""
    written = own_games.quadratic(np.eye(2)).written
    given = {
        "name": "own", "kernels": written.module, "parameters": written.parameters, "sizes": (1, 1),
        "in_cost": [(0, 1)] * 2, "in_constraint": [(0,), (1,)], "constraint_names": ("a", "b"),
    }  # fmt: skip
    Game(**given)
    with pytest.raises(InvalidInput) as caught:
        Game(**{**given, field: value})
    assert caught.value.key == field
    assert len(str(caught.value)) < 300


@pytest.mark.parametrize(
    ("returned", "words"),
    [
        (lambda: 3, "it must return (lower, upper), each of shape (2, 2)"),
        (lambda: (None, None), "it must return (lower, upper)"),
        (lambda: (np.zeros(2), np.ones(2)), "it must return (lower, upper)"),
        (lambda: sys.exit(0), "SystemExit: 0"),
        (lambda: 1 / 0, "ZeroDivisionError"),
    ],
)
def test_bounds_of_slopes_that_are_none(returned, words):
    game = own_games.quadratic(np.eye(2), jacobian_bounds=lambda box: returned())
    with pytest.raises(UserCodeError) as caught:
        game.jacobian_bounds((np.zeros(2), np.ones(2)))
    assert words in str(caught.value)


def test_a_start_outside_a_game_of_plain_functions():
    """Its constraints are looked at in Python then."""
    with pytest.raises(InfeasibleStart, match="g = 1"):
        penalised_equilibrium(own_games.quadratic(np.eye(2)), 0.1, np.array([2.0, 0.5]))


# Processes

MAIN = (
    "import sys, gne_mj.cli.ending as ending\n"
    "ending.POLL, ending.OF_USER, ending.NATIVE, ending.GRACE = 0.05, 0.3, 1.0, 0.5\n"
    "from gne_mj.cli import main\n"
    "sys.argv[0] = 'gne-mj'\n"
    "main()"
)


def test_what_is_printed_does_not_mix_with_the_report(tmp_path):
    """Nor what programs and libraries print that a user's function calls."""
    printing = (
        "    print('by Python')\n    import os\n    os.write(1, b'by C\\n')\n"
        "    os.system('echo by another program')\n    power = 0.0\n"
    )
    once = printing.replace("    power", "    globals().update(total=silent)\n    power")
    silent = "def silent(y):\n    return float(y.sum())\n\n\ndef total("
    arguments = setting("game", tmp_path, ("    power = 0.0\n", once), ("def total(", silent))
    done = subprocess.run(
        [sys.executable, "-c", MAIN, "run", *arguments, "--set", "simulation.duration=0.1",
         "--json"],
        capture_output=True, text=True, check=False, timeout=120,
    )  # fmt: skip
    assert json.loads(done.stdout)["status"] == "completed"
    assert done.returncode == 0
    for words in ("by Python", "by C", "by another program"):
        assert words in done.stderr


def stuck(folder, command, statement, interrupts=1):
    """The command after Ctrl-C in a law's function that never returns."""
    change = (
        "    gradient = ",
        "    if y[0] != y0[0]:\n        print('stuck', flush=True)\n"
        f"        while True: {statement}\n    gradient = ",
    )
    start = ("    return y\n", "    y0[:] = y\n    return y\n")
    arguments = setting("law", folder, change, start, ("def action(", "y0 = [0.0]\ndef action("))
    process = subprocess.Popen(
        [sys.executable, "-c", MAIN, *command, *map(str, arguments)], cwd=folder,
        stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, start_new_session=True,
    )  # fmt: skip
    try:
        assert process.stdout.readline() == "stuck\n"
        for _ in range(interrupts):
            process.send_signal(signal.SIGINT)
            time.sleep(0.2)  # two at once would be one
        _, told = process.communicate(timeout=60)
    finally:
        if process.poll() is None:
            os.killpg(process.pid, signal.SIGKILL)
            process.communicate()
    return process.returncode, told


@pytest.mark.parametrize(
    "statement", ["pass", pytest.param("__import__('time').sleep(1e6)", marks=pytest.mark.slow)]
)
@pytest.mark.parametrize(
    "command",
    [
        ("run", "--out", "results"),
        pytest.param(("batch", "--out", "results"), marks=pytest.mark.slow),
    ],
)
def test_ctrl_c_ends_a_function_that_never_returns(tmp_path, command, statement):
    code, told = stuck(tmp_path, command, statement)
    assert code == 1
    assert told.startswith("gne-mj: user_code_failed: mine.py, line ")
    assert told.count("\n") == 1
    assert "in action: " in told
    if command[0] == "run":
        left = {path.name for path in tmp_path.iterdir()}
        assert left - {"__pycache__"} == {"mine.py"}, "no result, and no hidden folder"


@pytest.mark.slow
def test_a_second_ctrl_c_does_not_wait(tmp_path):
    code, told = stuck(tmp_path, ("run",), "pass", interrupts=2)
    assert code in (1, 130)
    assert told.startswith("gne-mj: ")


ENDLESS = '''
"""A law whose kernel never returns once the outputs have moved."""
import sys

from gne_mj.controllers import Law
from gne_mj.native import kernel


class Endless(Law):
    """As above."""

    @property
    def kernels(self):
        return sys.modules[__name__]


def law(game, graph):
    return Endless()


@kernel
def action(game, problem, y, weights, memory, work, u):
    rounds = 1.0
    while y[0] != 1.0 and rounds > 0.0:
        rounds = 1.0 + 1.0 / (1.0 + rounds)
    for a in range(len(u)):
        u[a] = 1.0
    return -1


@kernel
def rate(problem, y, memory, out):
    pass


@kernel
def propagate(problem, y, memory, scratch):
    pass


@kernel
def storage(problem, memory):
    return 0.0
'''


ANNOUNCED = """
import gne_mj.simulation as simulation
advance = simulation.Simulation.advance
def announced(self, steps):
    print("begins", flush=True)
    advance(self, steps)
simulation.Simulation.advance = announced
"""


@pytest.mark.slow
@pytest.mark.parametrize("interrupts", [1, 2])
def test_ctrl_c_ends_a_kernel_that_never_returns(tmp_path, interrupts):
    """Python's own handlers never run meanwhile."""
    (tmp_path / "endless.py").write_text(ENDLESS)
    settings = (
        f"controller.file={tmp_path / 'endless.py'}", "controller.information=custom",
        "plant.engine=ode", "initial.action=[1.0, 0.0, 0.5, -0.5, 0.2]",
    )  # fmt: skip
    process = subprocess.Popen(
        [sys.executable, "-c", ANNOUNCED + MAIN, "run", "velocity-sync",
         *(part for each in settings for part in ("--set", each))],
        stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
    )  # fmt: skip
    try:
        assert process.stdout.readline() == "begins\n"
        time.sleep(0.5)
        for _ in range(interrupts):
            process.send_signal(signal.SIGINT)
            time.sleep(0.2)  # two at once would be one
        _, told = process.communicate(timeout=30)
    finally:
        process.kill()
    assert process.returncode == (1 if interrupts == 1 else 130)
    assert "gne-mj: interrupted" in told


def test_files_written_for_the_first_version_find_game(tmp_path):
    """Its module had the name that is a function's now; both are there."""
    path = tmp_path / "old.py"
    path.write_text("from gne_mj.game import Game\n")
    assert load_module(path).Game is Game
    assert callable(gne_mj.game)
