"""What is shipped: the wheel and the sdist, built from a copy of the checkout."""

import shutil
import subprocess
import sys
import tarfile
import tomllib
import zipfile
from collections import Counter
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]
# Folders at the top of the checkout, and where their files are in the wheel.
PLACES = {"gne_mj": "gne_mj", "controllers": "gne_mj/controllers", "models": "gne_mj/models"}
SUFFIXES = {".py", ".xml", ".toml", ".json", ".html", ".js", ".css", ".txt"}
LINKS = [ROOT / "gne_mj" / "controllers", ROOT / "gne_mj" / "models"]


def _shipped_sources() -> list[str]:
    """Names that the wheel must have, from what lies in the checkout."""
    return [
        f"{place}/{file.relative_to(ROOT / folder).as_posix()}"
        for folder, place in PLACES.items()
        for file in (ROOT / folder).rglob("*")
        if file.suffix in SUFFIXES or file.name == "py.typed"
        if not any(link in file.parents for link in LINKS)
    ]


@pytest.fixture(scope="module")
def built(tmp_path_factory: pytest.TempPathFactory) -> tuple[list[str], list[str]]:
    """Names in the wheel and in the sdist."""
    copy = tmp_path_factory.mktemp("packaging") / "checkout"
    copy.mkdir()
    for name in ["pyproject.toml", "README.md", "LICENSE"]:
        shutil.copy(ROOT / name, copy)
    for folder in PLACES:
        skip = shutil.ignore_patterns("__pycache__")
        shutil.copytree(ROOT / folder, copy / folder, symlinks=True, ignore=skip)
    # The wheel is built from the sdist, so this also shows that the sdist is complete.
    subprocess.run(
        [sys.executable, "-m", "build", "--no-isolation", "--outdir", copy / "dist", copy],
        check=True,
        capture_output=True,
    )
    (wheel,) = (copy / "dist").glob("*.whl")
    (sdist,) = (copy / "dist").glob("*.tar.gz")
    with zipfile.ZipFile(wheel) as archive:
        in_wheel = archive.namelist()
    with tarfile.open(sdist) as archive:
        in_sdist = [name.partition("/")[2] for name in archive.getnames()]
    return in_wheel, in_sdist


def test_every_package_is_listed() -> None:
    settings = tomllib.loads((ROOT / "pyproject.toml").read_text())["tool"]["setuptools"]
    modules = [name for name in _shipped_sources() if name.endswith(".py")]
    folders = {name.rpartition("/")[0] for name in modules}
    assert {folder.replace("/", ".") for folder in folders} == set(settings["packages"])


@pytest.mark.slow
def test_wheel_installs_one_name(built: tuple[list[str], list[str]]) -> None:
    tops = {name.split("/")[0] for name in built[0]}
    assert {top for top in tops if not top.endswith(".dist-info")} == {"gne_mj"}
    assert len(tops) == 2


@pytest.mark.slow
def test_wheel_has_every_source_once(built: tuple[list[str], list[str]]) -> None:
    counts = Counter(name for name in built[0] if ".dist-info/" not in name)
    assert counts == Counter(_shipped_sources())
    assert any(name.endswith("/licenses/LICENSE") for name in built[0])


@pytest.mark.slow
def test_sdist_has_the_sources_the_licence_and_the_readme(
    built: tuple[list[str], list[str]],
) -> None:
    names = set(built[1])
    assert {"LICENSE", "README.md", "pyproject.toml"} <= names
    assert {f"{folder}/__init__.py" for folder in PLACES} <= names
    assert not {name for name in names if name.startswith(("gne_mj/controllers", "gne_mj/models"))}
