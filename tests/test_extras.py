"""What is told where a part of the package is asked for that is not installed."""

import subprocess
import sys
import tomllib
from importlib import import_module
from pathlib import Path

import pytest
from commands import environment, gne_here

from gne_mj import extras
from gne_mj.errors import MissingExtra

ROOT = Path(__file__).resolve().parents[1]
HEAVY = {"dm_control", "matplotlib", "meshcat", "mujoco", "numba", "scipy", "tornado", "xarray"}


@pytest.fixture
def missing(monkeypatch):
    """Lets packages look as if they were not installed."""

    def hide(*packages):
        found = extras.find_spec
        monkeypatch.setattr(
            extras, "find_spec", lambda name: None if name in packages else found(name)
        )

    return hide


@pytest.mark.parametrize(
    ("command", "package", "extra"),
    [
        (("plot", "run"), "matplotlib", "plots"),
        (("paper",), "matplotlib", "plots"),
        (("paper",), "meshcat", "view"),
        (("solve", "osnr", "--path", "1:1e-3:3", "--out", "new"), "matplotlib", "plots"),
        (("map", "osnr", "--out", "new"), "matplotlib", "plots"),
        (("batch", "osnr"), "matplotlib", "plots"),
        (("batch-report", "run"), "matplotlib", "plots"),
        (("view", "run"), "tornado", "view"),
        (("run", "osnr", "--view"), "umsgpack", "view"),
    ],
    ids=lambda given: " ".join(given) if isinstance(given, tuple) else given,
)
def test_a_command_says_at_once_what_to_install(
    tmp_path, monkeypatch, missing, command, package, extra
):
    monkeypatch.chdir(tmp_path)
    missing(package)
    done = gne_here(*command)
    assert done.returncode == 2
    assert done.stdout == ""
    assert done.stderr.startswith("gne-mj: ")
    assert done.stderr.endswith(
        f" needs {package}, which is not installed: pip install 'gne-mj[{extra}]'\n"
    )
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    ("module", "package", "extra"),
    [("gne_mj.environment", "dm_control", "learning"), ("gne_mj.viewer", "meshcat", "view")],
)
def test_a_part_says_so_when_it_is_imported(monkeypatch, missing, module, package, extra):
    monkeypatch.delitem(sys.modules, module, raising=False)
    missing(package)
    with pytest.raises(MissingExtra, match=rf"pip install 'gne-mj\[{extra}\]'"):
        import_module(module)


def test_figures_say_so_when_they_are_drawn(missing):
    from gne_mj.plots.style import styled

    missing("matplotlib")
    with pytest.raises(MissingExtra, match="drawing figures needs matplotlib"), styled():
        pass


def test_the_extras_are_those_of_the_package():
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    optional = project["optional-dependencies"]
    assert set(extras.EXTRAS) < set(optional)
    tested = [name for name in extras.EXTRAS if name != "menagerie"]  # which has a stand-in
    assert optional["test"][0] == f"gne-mj[{','.join(tested)}]"
    names = {"umsgpack": "u-msgpack-python", "PIL": "pillow", "dm_control": "dm-control",
             "dm_env": "dm-env", "mujoco_menagerie": "mujoco-menagerie"}  # fmt: skip
    for extra, packages in extras.EXTRAS.items():
        for package in packages:
            name = names.get(package, package)
            assert any(asked.startswith(name) for asked in optional[extra])
            assert not any(asked.startswith(name) for asked in project["dependencies"])


def test_the_package_is_imported_without_what_is_heavy():
    code = f"import sys, gne_mj; print(sorted({HEAVY!r} & set(sys.modules)))"
    done = subprocess.run(
        [sys.executable, "-c", code], env=environment(), capture_output=True, text=True, check=True
    )
    assert done.stdout == "[]\n"
