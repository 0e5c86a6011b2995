"""Kernels that one process has translated are found by another, and only where they are right."""

import os
import subprocess
import sys
from types import ModuleType

import numpy as np
from numba import types

from gne_mj import banded, native
from gne_mj.banded import factorise_definite, solve_definite
from gne_mj.games import osnr
from gne_mj.kernel_cache import cache_for, package_digest

# The loop below for another process, which says what it translates anew
PROGRAM = """
import sys
import numpy as np
from gne_mj import kernel_compiler
from gne_mj.banded import factorise_definite, solve_definite
from gne_mj.native import compiled

translated, translate = [], kernel_compiler.LoopCompiler.compile_extra

def noted(self, function):
    translated.append(function.__name__)
    return translate(self, function)

kernel_compiler.LoopCompiler.compile_extra = noted

@compiled
def solved(band, b, x):
    good = factorise_definite(band, len(x), b)
    solve_definite(band, len(x), b, x)
    return good

band, x = (np.array(eval(text)) for text in sys.argv[1:])
assert solved(band, 1, x)
print(translated)
print(x.tolist())
"""


@native.compiled
def solved(band, b, x):
    """Solve with kernels of the package."""
    good = factorise_definite(band, len(x), b)
    solve_definite(band, len(x), b, x)
    return good


def test_another_process_finds_them_and_computes_the_same(tmp_path):
    band = np.array([[0.0, 3.0, -1.0], [0.5, 4.0, 0.75], [-0.25, 5.0, 0.0]])
    matrix = np.array([[3.0, -1.0, 0.0], [0.5, 4.0, 0.75], [0.0, -0.25, 5.0]])
    right, x = np.array([1.0, -0.3, 0.7]), np.array([1.0, -0.3, 0.7])
    program = tmp_path / "program.py"
    program.write_text(PROGRAM)
    given = [repr(array.tolist()) for array in (band, right)]
    assert solved(band, 1, x)
    np.testing.assert_allclose(x, np.linalg.solve(matrix, right), rtol=1e-14)
    done = subprocess.run(
        [sys.executable, str(program), *given],
        env=os.environ, capture_output=True, text=True, check=False, timeout=120,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    translated, found = (eval(line) for line in done.stdout.splitlines())
    assert translated == ["solved"]
    np.testing.assert_array_equal(found, x)


@native.kernel
def of_a_user(x):
    """Not the package's."""
    return x


def test_only_the_packages_own_is_kept():
    number, own = types.float64, types.Module(osnr)
    assert cache_for(banded.solve, (number,)) is not None
    assert cache_for(banded.solve, (number, own)) is not None
    assert cache_for(banded.solve, (number, types.Module(ModuleType("mine")))) is None
    assert cache_for(of_a_user, (number,)) is None
    made = native.kernel(lambda x: x)
    made.__module__ = banded.__name__  # as what a factory of the package makes
    assert cache_for(made, (number,)) is None


def test_a_translation_is_of_these_sources_only(monkeypatch):
    cache, given = cache_for(banded.solve, (types.float64,)), (types.float64,)
    codegen = type("Codegen", (), {"magic_tuple": lambda self: ("some processor",)})()
    before = cache._index_key(given, codegen)
    assert package_digest() in before
    monkeypatch.setattr("gne_mj.kernel_cache.package_digest", lambda: "other sources")
    assert cache._index_key(given, codegen) != before
