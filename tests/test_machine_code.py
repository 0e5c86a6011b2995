"""Where machine code is kept if neither the package's folder nor a home can be written."""

import os
import pickle
import shutil
import subprocess
import sys
from pathlib import Path

import numba
import pytest

import gne_mj
from gne_mj import machine_code

PACKAGE = Path(gne_mj.__file__).parent
SCENARIOS = "import sys; from gne_mj.cli import main; sys.argv = ['gne-mj', 'scenarios']; main()"
COMPILE = """
from gne_mj.controllers import settings
from gne_mj.native import compiled
double = compiled(settings.twice)
print(double(21))
"""


@pytest.fixture(scope="module")
def locked(tmp_path_factory):
    """The package where nothing can be written beside its sources, whoever tries (root too)."""
    root = tmp_path_factory.mktemp("locked")
    copy = shutil.copytree(
        PACKAGE, root / "gne_mj", ignore=shutil.ignore_patterns("__pycache__", "*.nb?")
    )
    for folder in [copy, *(each for each in copy.rglob("*") if each.is_dir())]:
        (folder / "__pycache__").touch()  # a file where a folder would have to be
    with (copy / "controllers" / "settings.py").open("a") as file:
        file.write("\n\ndef twice(x):\n    return 2 * x\n")
    return root


def python(root, program, **environment):
    """In a process without a home."""
    nowhere = {"HOME": "/dev/null", "XDG_CACHE_HOME": "/dev/null", "NUMBA_CACHE_DIR": ""}
    return subprocess.run(
        [sys.executable, "-B", "-c", program],
        cwd=root, env={**os.environ, **nowhere, "PYTHONPATH": str(root), **environment},
        capture_output=True, text=True, check=False, timeout=120,
    )  # fmt: skip


def test_it_is_kept_in_a_temporary_folder_and_that_is_said_once(locked, tmp_path):
    done = python(locked, COMPILE, TMPDIR=str(tmp_path))
    assert done.stdout == "42\n", done.stderr
    folder = tmp_path / f"gne-mj-{os.getuid()}"
    assert done.stderr == (
        f"gne-mj: warning: machine code is kept in {folder}: neither the package's folder nor a"
        " home can be written; NUMBA_CACHE_DIR names another folder\n"
    )
    assert folder.stat().st_mode & 0o777 == 0o700
    assert list(folder.rglob("settings.twice-*.nbi"))


@pytest.mark.slow
def test_what_a_version_with_other_modules_left_is_made_anew(locked, tmp_path):
    assert python(locked, COMPILE, NUMBA_CACHE_DIR=str(tmp_path)).stdout == "42\n"
    (index,) = tmp_path.rglob("settings.twice-*.nbi")
    version = pickle.dumps(numba.__version__, protocol=-1)
    index.write_bytes(version + b"cgne_mj.no_more\nRecord\n.")
    done = python(locked, COMPILE, NUMBA_CACHE_DIR=str(tmp_path))
    assert (done.stdout, done.stderr) == ("42\n", "")
    assert b"no_more" not in index.read_bytes(), "kept again"


def test_what_is_kept_is_loaded_without_what_compiles(locked, tmp_path):
    program = f"{COMPILE}\nimport sys\nprint('numba.np.linalg' in sys.modules, double(2.5))"
    first, second = (
        python(locked, program, NUMBA_CACHE_DIR=str(tmp_path)).stdout.split() for _ in range(2)
    )
    assert first == ["42", "True", "5.0"]
    assert second == ["42", "False", "5.0"]


def test_a_folder_that_is_named_is_used_without_a_word(locked, tmp_path):
    done = python(locked, COMPILE, NUMBA_CACHE_DIR=str(tmp_path))
    assert (done.stdout, done.stderr) == ("42\n", "")
    assert list(tmp_path.rglob("settings.twice-*.nbi"))


def test_code_that_another_process_has_put_in_its_place_is_not_taken(tmp_path):
    """Both find no index, both call their file number 1: numba would run the other's code."""
    cache = machine_code._Index(str(tmp_path), "function", "stamp")
    index = tmp_path / "function.nbi"
    cache.save("mine", "my code")
    assert cache.load("mine") == "my code"
    kept = index.read_bytes()
    index.unlink()
    cache.save("other's", "other code")
    index.write_bytes(kept)
    assert [path.name for path in tmp_path.glob("*.nbc")] == ["function.1.nbc"]
    assert cache.load("mine") is None
    cache.save("mine", "my code")
    assert cache.load("mine") == "my code"


def test_commands_work_without_any_folder(locked):
    """Not even a temporary one; `scenarios` ended in a traceback."""
    everywhere = f"import tempfile; tempfile.gettempdir = lambda: '/dev/null'; {SCENARIOS}"
    done = python(locked, everywhere)
    assert done.returncode == 0, done.stderr
    assert "velocity-sync" in done.stdout
    assert done.stderr.count("machine code is kept nowhere") == 1
    assert len(done.stderr.splitlines()) == 1


@pytest.mark.parametrize("mode", [0o777, 0o750])
def test_a_folder_of_somebody_else_is_not_trusted(mode, tmp_path, monkeypatch):
    """Machine code from it is run."""
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))
    planted = tmp_path / f"gne-mj-{os.getuid()}"
    planted.mkdir()
    planted.chmod(mode)
    assert machine_code._folder() != planted
    planted.chmod(0o700)
    assert machine_code._folder() == planted
