"""NUMBA_DISABLE_JIT=1: loops of ODE agents in plain Python, to debug a kernel in."""

import json
import os
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import gne_mj
from gne_mj.errors import InvalidInput

EXAMPLES = Path(__file__).parent.parent / "examples"
RUNS = [  # each of the kernels' own, and what compiled loops that other tests need too make of it
    ("velocity-sync", {"plant.engine": "ode", "simulation.duration": 0.05}, {}),
    (
        str(EXAMPLES / "game" / "scenario.toml"),
        {"simulation.duration": 0.05, "game.file": str(EXAMPLES / "game" / "charging_fast.py")},
        {"game.file": str(EXAMPLES / "game" / "charging_plain.py")},
    ),
]
RUN = """
import json, sys
import gne_mj
for scenario, changes, _ in json.loads(sys.argv[1]):
    (system,) = (trajectory := gne_mj.run(scenario, changes)).reports
    print(json.dumps(trajectory[system]["state"].values.tolist()))
"""


def interpreted(cache, *arguments):
    """Python in a process of its own, with numba switched off and an empty cache."""
    return subprocess.run(
        [sys.executable, *map(str, arguments)],
        env={**os.environ, "NUMBA_DISABLE_JIT": "1", "NUMBA_CACHE_DIR": str(cache)},
        capture_output=True, text=True, check=False, timeout=120,
    )  # fmt: skip


@pytest.mark.slow
def test_plain_python_takes_the_same_steps(tmp_path):
    done = interpreted(tmp_path / "cache", "-c", RUN, json.dumps(RUNS))
    assert done.returncode == 0, done.stderr
    assert done.stderr == ""
    for line, (scenario, changes, others) in zip(done.stdout.splitlines(), RUNS, strict=True):
        trajectory = gne_mj.run(scenario, {**changes, **others})
        (system,) = trajectory.reports
        expected = trajectory[system]["state"].values
        got = np.array(json.loads(line))
        assert np.allclose(got, expected, rtol=1e-12, atol=1e-12 * np.max(np.abs(expected)))
    assert not list(tmp_path.rglob("*.nb?"))  # no machine code was made, so none can be old


COMMAND = "import sys; from gne_mj.cli import main; sys.argv[0] = 'gne-mj'; main()"


def test_a_kernel_that_reads_beyond_an_array_is_told_and_mended(tmp_path):
    """Machine code would read what lies there; and what is mended acts at once."""
    folder = tmp_path / "law"
    shutil.copytree(EXAMPLES / "law", folder, ignore=shutil.ignore_patterns("__pycache__"))
    law, right = folder / "damped_fast.py", "u[a] = -numbers[GAINS + a]"
    text = law.read_text()
    assert right in text
    command = [
        "-c", COMMAND, "run", folder / "scenario.toml", "--set", f"controller.file={law}",
        "--set", "simulation.duration=0.01", "--set", "plant.engine=ode", "--json",
    ]  # fmt: skip
    law.write_text(text.replace(right, "u[a] = -numbers[GAINS + 1 + a]"))
    line = 1 + law.read_text().splitlines().index(
        next(each for each in law.read_text().splitlines() if "GAINS + 1 + a" in each)
    )
    done = interpreted(tmp_path / "cache", *command)
    assert done.returncode == 1
    assert done.stderr.startswith(
        f"gne-mj: user_code_failed: damped_fast.py, line {line}, in action: IndexError: index"
    )
    assert json.loads(done.stdout)["status"] == "user_code_failed"
    law.write_text(text)
    done = interpreted(tmp_path / "cache", *command)
    assert (done.returncode, done.stderr) == (0, "")


def test_mujoco_needs_machine_code(monkeypatch):
    monkeypatch.setattr("gne_mj.system.checks.INTERPRETED", True)
    with pytest.raises(InvalidInput, match=r"plant\.engine: got 'mujoco', but .*NUMBA_DISABLE_JIT"):
        gne_mj.run("velocity-sync")
