"""What makes compiled loops trustworthy: their arithmetic, and a cache that forgets in time."""

import importlib.util
import json
import os
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import gne_mj
from gne_mj import game_functions as functions
from gne_mj import interior_point, native
from gne_mj.controllers import full_information
from gne_mj.games import velocity_game, velocity_synchronization
from gne_mj.loops import ode
from gne_mj.plants import flexible_robot

ROOT = Path(__file__).resolve().parents[1]


@native.kernel
def quotient(a, b):
    """A kernel that may divide by zero."""
    return a / b


@native.kernel
def logarithm(a):
    """A kernel that may leave the logarithm's domain."""
    return np.log(a)


@native.compiled
def quotients(a, b, out):
    """A loop of them."""
    for r in range(len(a)):
        out[r] = quotient(a[r], b[r])


@native.compiled
def logarithms(a, out):
    """A loop of them."""
    for r in range(len(a)):
        out[r] = logarithm(a[r])


def test_division_by_zero_gives_what_numpy_gives():
    a, b = np.array([1.0, -1.0, 0.0, 1.0, np.inf]), np.array([0.0, 0.0, 0.0, -0.0, 0.0])
    out = np.empty(5)
    quotients(a, b, out)
    assert np.array_equal(out, [np.inf, -np.inf, np.nan, -np.inf, np.inf], equal_nan=True)


def test_the_logarithm_is_not_clipped():
    out = np.empty(3)
    logarithms(np.array([0.0, -1.0, np.nan]), out)
    assert out[0] == -np.inf
    assert np.all(np.isnan(out[1:]))


def test_kernels_stay_python_functions():
    assert quotient(3.0, 2.0) == 1.5
    with pytest.raises(ZeroDivisionError):
        quotient(1.0, 0.0)
    q, y = np.array([3.0, 2.0, 2.0]), np.array([2.0, 1.5])
    assert velocity_synchronization.gap(q, 1, y) == -0.5
    assert velocity_synchronization.constraint(q, 0, y) == -3.0
    out = np.empty(4)
    flexible_robot.rate(np.ones(5), np.array([1.0, 2.0, 0.0, 9.0]), 0.5, out)
    force = 1 + np.arctan(1.0) + 2
    assert np.allclose(out, [2.0, 0.5 - force, force, 2.0], rtol=1e-15)


def test_python_and_compiled_kernels_agree_to_the_bit():
    rng = np.random.default_rng(0)
    a, b = rng.normal(size=(2, 1000))
    out = np.empty(1000)
    quotients(a, b, out)
    assert np.array_equal(out, [quotient(x, y) for x, y in zip(a, b, strict=True)])


def test_copy_copies():
    source, target = np.arange(3.0), np.zeros(5)
    native.copy(source, target)
    assert target.tolist() == [0, 1, 2, 0, 0]


def load(path, name="a_game"):
    specification = importlib.util.spec_from_file_location(name, path)
    module = importlib.util.module_from_spec(specification)
    specification.loader.exec_module(module)
    return module


def test_the_key_follows_a_modules_source(tmp_path):
    text = "def cost(q, i, y):\n    return {}\n"
    keys = {}
    for name, value in (("first", 1.0), ("same", 1.0), ("changed", 2.0)):
        path = tmp_path / f"{name}.py"
        path.write_text(text.format(value))
        keys[name] = native.source_key(load(path, name))
    assert keys["first"] == keys["same"] != keys["changed"]
    assert native.source_key() not in keys.values()
    one, two = native.source_key(full_information), native.source_key(velocity_synchronization)
    assert len({one, two, native.source_key(full_information, velocity_synchronization)}) == 3


@pytest.mark.slow
def test_the_key_follows_this_packages_sources(tmp_path):
    """Any kernel of the package may be inlined anywhere: a change in one file concerns all."""
    packages = tmp_path / "gne_mj"
    skip = shutil.ignore_patterns("__pycache__")
    shutil.copytree(ROOT / "gne_mj", packages, ignore=skip)
    code = "import gne_mj.native as n; assert n.__file__.startswith(%r); print(n.source_key())"

    def key():
        done = subprocess.run(
            [sys.executable, "-c", code % str(tmp_path)],
            env={**os.environ, "PYTHONPATH": str(tmp_path)},
            cwd=tmp_path, capture_output=True, text=True, check=True,
        )  # fmt: skip
        return done.stdout

    seen = {key()}
    for name in ("barrier.py", "controllers/estimates.py", "games/osnr.py", "loops/monitor.py",
                 "plants/integrator.py"):  # fmt: skip
        with open(packages / name, "a", encoding="utf-8") as file:
            file.write("# changed\n")
        seen.add(key())
    assert len(seen) == 6


RUN = """
import json, sys
from gne_mj.loops import faultless, ode
from gne_mj.scenario import run
trajectory = run("velocity-sync", {"plant.engine": "ode", "simulation.duration": 0.1})
advance = ode.build(faultless)
print(json.dumps([advance.cache_hits, trajectory["robots"]["action"].values.tolist()]))
"""


@pytest.mark.slow
def test_loops_are_cached_between_processes(tmp_path):
    """The first process compiles; the second finds the machine code, and gets the same bits."""
    results = []
    for _ in range(2):
        done = subprocess.run(
            [sys.executable, "-c", RUN],
            env={**os.environ, "NUMBA_CACHE_DIR": str(tmp_path)},
            capture_output=True, text=True, check=True,
        )  # fmt: skip
        results.append(json.loads(done.stdout))
    (first, first_bits), (second, second_bits) = results
    assert (first, second) == (0, 1)
    assert first_bits == second_bits
    assert any(tmp_path.rglob("*.nbi"))


def test_loops_are_compiled_once_for_all_games_laws_and_agents(tmp_path):
    """Each of these has another game, law, agent type or mode; two have no loop of a fixed step."""
    for name, changes in (
        ("velocity-sync", {"plant.engine": "ode"}),
        ("velocity-sync", {"plant.engine": "ode", "controller.information": "partial"}),
        ("velocity-sync", {"plant.engine": "ode", "controller.mode": "implicit"}),
        ("cournot", {}),
        ("osnr", {"plant.integrator": "rk4", "simulation.timestep": 1e-3}),
    ):
        gne_mj.run(name, {"simulation.duration": 0.01, **changes})
    kinds = ("with faults", "without", "apart", "guarded", "guarded with faults")
    assert ode.build.cache_info().currsize <= len(kinds)
    assert interior_point.build.cache_info().currsize == 1


def test_functions_by_their_addresses_are_those_of_the_module():
    """In compiled code and from Python, each against the kernel as it stands."""
    game, y = velocity_game(4, 3.0, 2.0, [1.0, 2.0, 3.0, 4.0], 0.5), np.array([3.5, 2.0, 1.5, 0.3])
    data, kernels, q = game.data, game.kernels, game.data.parameters
    row, expected = np.zeros(4), np.zeros(4)
    for i in range(4):
        assert functions.cost(data, i, y) == kernels.cost(q, i, y)
        assert functions.cost_gradient(data, i, i, y) == kernels.cost_gradient(q, i, i, y)
        functions.add_cost_hessian(data, i, i, y, 0.5, row)
        kernels.add_cost_hessian(q, i, i, y, 0.5, expected)
        assert functions.constraint(data, i, y) == kernels.constraint(q, i, y)
        slope = functions.constraint_gradient(data, i, max(i - 1, 0), y)
        assert slope == kernels.constraint_gradient(q, i, max(i - 1, 0), y)
        second = functions.constraint_hessian(data, i, i, max(i - 1, 0), y)
        assert second == kernels.constraint_hessian(q, i, i, max(i - 1, 0), y)
    assert row.tolist() == expected.tolist()
    g, weights, some = np.zeros(4), np.zeros(4), np.zeros(2)
    assert functions.evaluate(data, 0.1, y, g, weights) == -1
    assert g.tolist() == [kernels.constraint(q, k, y) for k in range(4)]
    assert weights.tolist() == (0.1 / -g).tolist()
    assert functions.evaluate(data, 0.1, y + np.eye(4)[1] * 9.0, g, weights) == 1
    functions.values(data, np.array([3, 1]), y, some)
    assert some.tolist() == [kernels.constraint(q, k, y) for k in (3, 1)]
    gradient = np.full(4, 7.0)
    functions.gradients(data, np.array([2, 0]), y, gradient)
    own = [kernels.cost_gradient(q, i, i, y) for i in range(4)]
    assert gradient.tolist() == [own[0], 7.0, own[2], 7.0]
    entries = np.zeros(3)
    functions.slopes(data, np.array([2, 0]), np.array([0, 2, 3]), np.array([1, 2, 0]), y, entries)
    assert entries.tolist() == [
        kernels.constraint_gradient(q, k, a, y) for k, a in ((2, 1), (2, 2), (0, 0))
    ]


GAME = '''
"""Velocity synchronisation with costs of another weight."""
from gne_mj.games.velocity_synchronization import (
    add_cost_hessian, constraint, constraint_gradient, constraint_hessian, gap,
)
from gne_mj.native import kernel

@kernel
def cost(q, i, y):
    return WEIGHT * gap(q, i, y) ** 2

@kernel
def cost_gradient(q, i, a, y):
    return 2.0 * WEIGHT * gap(q, i, y)
'''
USE = """
import sys
sys.path.insert(0, sys.argv[1])
import numpy as np
import a_game
from gne_mj.games import velocity_game
from dataclasses import replace
game = replace(velocity_game(2, 0.0, 5.0), kernels=a_game)
print(game.costs(np.array([1.0, 1.0])).tolist(), game.pseudo_gradient([1.0, 1.0]).tolist())
"""


@pytest.mark.slow
def test_a_game_that_changed_is_compiled_anew(tmp_path):
    """The machine code of the earlier source, on disk, is not used for the later one."""
    for weight in (1.0, 3.0, 3.0, 1.0):
        (tmp_path / "a_game.py").write_text(GAME.replace("WEIGHT", str(weight)))
        done = subprocess.run(
            [sys.executable, "-B", "-c", USE, tmp_path],
            env={**os.environ, "NUMBA_CACHE_DIR": str(tmp_path / "cache")},
            capture_output=True, text=True, check=False,
        )  # fmt: skip
        assert done.returncode == 0, done.stderr
        assert done.stdout.strip() == f"[{weight}, 0.0] [{2 * weight}, 0.0]"
