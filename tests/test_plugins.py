"""What other packages and files bring along: registered tables, entry points, agent types."""

import json
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path
from typing import Literal

import numpy as np
import pytest
from commands import COMMAND, gne_here
from scipy.optimize import brentq

import gne_mj
from gne_mj.errors import InvalidInput
from gne_mj.registry import Registry
from gne_mj.toml_table import Table

PLUGIN = Path(__file__).parent.parent / "examples/plugin"

# The integrator, as a user writes one
POINT = """
from gne_mj.native import kernel
NAME, PARAMETERS, STATES, OUTPUT, INPUT_UNIT = "point", ("factor",), (("place", ""),), 0, ""
@kernel
def rate(q, x, u, out):
    out[0] = q[0] * u
@kernel
def jacobian(q, x, out):
    out[0, 0] = 0.0
@kernel
def equilibrium(q, y, out):
    out[0] = y
@kernel
def storage(q, x, rest):
    return 0.5 * (x[0] - rest[0]) ** 2
"""


def with_agents(path, **agents):
    table = {"type": "custom", "count": 10, "file": str(path), "parameters": {"factor": 1.0}}
    return {"simulation.duration": 0.5, "systems.firms.agents": {**table, **agents}}


@pytest.fixture
def point(tmp_path):
    path = tmp_path / "point.py"
    path.write_text(POINT)
    return path


@pytest.mark.parametrize("integrator", ["rk4", "euler"])
def test_an_agent_type_of_ones_own_runs_as_the_same_one_built_in(point, integrator):
    changes = {"simulation.integrator": integrator}
    own = gne_mj.run("cournot", with_agents(point) | changes)
    theirs = {"type": "integrator", "count": 10}
    built_in = gne_mj.run(
        "cournot", {"simulation.duration": 0.5, "systems.firms.agents": theirs} | changes
    )
    for name in ("action", "input"):
        assert np.array_equal(own["firms"][name].to_numpy(), built_in["firms"][name].to_numpy())
    assert own.reports["firms"]["status"] == built_in.reports["firms"]["status"]
    assert own.reports["firms"]["lyapunov"]["claimed"] is False  # it says nothing of it


def test_parameters_of_an_agent_type_may_differ_from_agent_to_agent(point):
    factor = np.linspace(0.5, 2.5, 10)
    steps = {
        "simulation.duration": 0.05, "simulation.timestep": 1e-3, "recording.period": 1e-3,
        "simulation.integrator": "euler",
    }  # fmt: skip
    data = gne_mj.run("cournot", with_agents(point, parameters={"factor": factor.tolist()}) | steps)
    action, pushed = (data["firms"][name].to_numpy() for name in ("action", "input"))
    assert np.allclose(np.diff(action, axis=0), 1e-3 * factor * pushed[:-1], rtol=1e-9)


@pytest.mark.parametrize(
    ("changed", "agents", "said"),
    [
        (("@kernel\ndef storage", "def storage"), {}, "kernel storage(q, x, equilibrium_state)"),
        (("def rate(q, x, u, out)", "def rate(q, x, u)"), {}, "it must define rate(q, x, u, out)"),
        (('"point", ("factor",)', '"point", "f"'), {"parameters": {}}, "points have f"),
        ((', 0, ""\n', ', 1, ""\n'), {}, "OUTPUT must be the number of one of 1 states"),
        (("NAME, ", "NAMED, "), {}, "it must define NAME"),
        (('(("place", ""),)', '("place",)'), {}, "STATES must be pairs"),
        (("", ""), {"parameters": {"facto": 1.0}}, "points have factor"),
        (("", ""), {"parameters": {"factor": [1.0, 2.0]}}, "list of 10, one for each agent"),
        (("import kernel", "import kernal"), {}, "Python must run it"),
    ],
)
def test_what_is_no_agent_type_is_refused_in_one_sentence(point, changed, agents, said):
    point.write_text(POINT.replace(*changed))
    with pytest.raises(InvalidInput) as caught:
        gne_mj.load_scenario("cournot", with_agents(point, **agents)).system_objects()
    assert said in str(caught.value)
    assert caught.value.key.startswith("systems.firms.agents.")


# --------------------------------------------------------------------------------- registries


def test_a_table_is_registered_once_and_by_a_literal():
    tables = Registry()

    class One(Table):
        type: Literal["one"]

    class Other(Table):
        type: Literal["one"]

    class Vague(Table):
        type: str

    class Nameless(Table):
        size: int

    assert tables.register(One) is One
    assert list(tables) == ["one"]
    for wrong, said in ((Other, "another one has"), (Vague, "Literal"), (Nameless, "Literal")):
        with pytest.raises(InvalidInput, match=said):
            tables.register(wrong)
    assert list(tables) == ["one"]


# ---------------------------------------------------------------------------- other packages


def command(folder, *arguments):
    """The installed command, in a process that finds the packages of a folder too."""
    kept = {key: value for key, value in os.environ.items() if key != "DISPLAY"}
    path = os.pathsep.join(filter(None, [str(folder), kept.get("PYTHONPATH")]))
    return subprocess.run(
        [COMMAND, *map(str, arguments)], env={**kept, "PYTHONPATH": path},
        capture_output=True, text=True, check=False, timeout=300,
    )  # fmt: skip


@pytest.fixture(scope="module")
def installed(tmp_path_factory):
    """A folder into which the example of a plug-in is installed."""
    folder = tmp_path_factory.mktemp("plugin")
    shutil.copytree(PLUGIN, folder / "source", ignore=shutil.ignore_patterns("__pycache__"))
    subprocess.run(
        [sys.executable, "-m", "pip", "install", "-q", "--no-deps", "--no-build-isolation",
         "--no-index", "--disable-pip-version-check", "--target", folder / "site", "./source"],
        cwd=folder, check=True, capture_output=True,
    )  # fmt: skip
    return folder / "site"


@pytest.mark.slow  # compiles, or starts programs, for seconds
def test_the_plug_in_of_the_examples_runs(installed):
    done = command(installed, "run", PLUGIN / "scenario.toml", "--json", "--set", "barrier.rho=0.1")
    assert (done.returncode, done.stderr) == (0, "")
    report = json.loads(done.stdout)["systems"]["houses"]
    assert report["status"] == "converged"
    wanted, rho, capacity = np.arange(2.0, 7.0), 0.1, 12.0

    def excess(price):  # of the sum whose barrier asks for this price
        heat = 0.5 * (wanted - price + np.sqrt((wanted - price) ** 2 + 4.0 * rho))
        return rho / (capacity - np.sum(heat)) - price if np.sum(heat) < capacity else 1e9

    price = brentq(excess, 1e-9, 100.0, xtol=1e-12)
    heat = 0.5 * (wanted - price + np.sqrt((wanted - price) ** 2 + 4.0 * rho))
    assert np.allclose(report["equilibrium"]["penalised"], heat, atol=1e-6)


def test_a_plug_in_that_cannot_be_loaded_is_named_in_one_sentence(tmp_path):
    (tmp_path / "broken.py").write_text("raise RuntimeError('no licence')\n")
    about = tmp_path / "broken-1.0.dist-info"
    about.mkdir()
    (about / "METADATA").write_text("Metadata-Version: 2.1\nName: broken\nVersion: 1.0\n")
    (about / "entry_points.txt").write_text("[gne_mj.plugins]\nworse = broken\n")
    done = command(tmp_path, "run", "velocity-sync")
    assert done.returncode == 2
    assert re.fullmatch(
        r"gne-mj: the plug-in 'worse' of broken cannot be loaded: RuntimeError: no licence\n",
        done.stderr,
    )


def test_what_only_a_plug_in_has_is_unknown_without_it():
    done = gne_here("run", PLUGIN / "scenario.toml")
    assert done.returncode == 2
    assert "heating" in done.stderr
