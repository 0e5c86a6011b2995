"""ASCII terminals, names that are not UTF-8, and settings for displays."""

import os
import subprocess
import sys

import pytest
from commands import gne_here

import gne_mj
from gne_mj.errors import InvalidInput
from gne_mj.viewer import write_html

MAIN = "import sys; from gne_mj.cli import main; sys.argv[0] = 'gne-mj'; main()"
SHORT = ("--set", "plant.engine=ode", "--set", "simulation.duration=0.05")
NAME = "n\udcffö"  # as Python has the bytes n, 255 and UTF-8's of ö


def ascii_only(*arguments, **more):
    """The command on a terminal of the C locale, strictly ASCII."""
    plain = {
        "LC_ALL": "C", "PYTHONUTF8": "0", "PYTHONCOERCECLOCALE": "0",
        "PYTHONIOENCODING": "ascii:strict",
    }  # fmt: skip
    return subprocess.run(
        [sys.executable, "-c", MAIN, *map(os.fsencode, map(str, arguments))],
        env={**os.environ, **plain, **more}, capture_output=True, check=False, timeout=120,
    )  # fmt: skip


@pytest.mark.slow
def test_a_run_in_a_folder_of_any_name_on_any_terminal(tmp_path):
    """None of these knows a display either."""
    folder = tmp_path / NAME
    nowhere = {"MUJOCO_GL": "junk", "MPLBACKEND": "junk", "PYOPENGL_PLATFORM": "junk"}
    done = ascii_only("run", "velocity-sync", *SHORT, "--out", folder, **nowhere)
    assert (done.returncode, done.stderr) == (0, b"")
    assert b"report.json" in done.stdout
    assert done.stdout.isascii()
    done = ascii_only("plot", folder, **nowhere)
    assert (done.returncode, done.stderr) == (0, b"")
    assert b"robots-gaps.png" in done.stdout
    assert (folder / "robots-gaps.png").is_file()


def test_a_page_of_a_folder_of_any_name(tmp_path):
    trajectory = gne_mj.run("velocity-sync", {"plant.engine": "ode", "simulation.duration": 0.05})
    folder = tmp_path / "n\udcff"
    folder.mkdir()
    trajectory.save(folder / "trajectory.zarr")
    done = gne_here("view", folder, "--html", tmp_path / "page.html")
    assert done.returncode == 0, done.stderr
    assert "<title>n?" in (tmp_path / "page.html").read_text(encoding="utf-8")
    write_html(trajectory, tmp_path / "n\udcff.html", "a title")


@pytest.mark.parametrize(
    ("changes", "key"),
    [
        ({"game.file": "n\udcff.py"}, "game.file"),
        ({"agents.file": ["a.xml", "n\udcff.xml"]}, "agents.file"),
        ({"barrier.n\udcff": 1.0}, "barrier.n"),
        ({"game.parameters": {"note": "\ud800"}}, "game.parameters.note"),
    ],
)
def test_a_scenario_is_text(changes, key):
    """Trajectories and batches keep it, in UTF-8."""
    with pytest.raises(InvalidInput, match="it must be UTF-8 text") as caught:
        gne_mj.load_scenario("velocity-sync", changes)
    assert caught.value.key.startswith(key)


def test_text_of_a_files_own_folder_too(tmp_path):
    folder = tmp_path / "n\udcff"
    folder.mkdir()
    (folder / "s.toml").write_text('[systems.s.game]\ntype = "custom"\nfile = "g.py"\n')
    with pytest.raises(InvalidInput, match=r"^systems\.s\.game\.file: got .*UTF-8 text"):
        gne_mj.load_scenario(folder / "s.toml")
