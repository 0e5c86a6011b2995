"""What is shipped: the wheel and the sdist, built from a copy of the checkout."""

import importlib.util
import io
import re
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


def test_versions_agree_and_changes_are_dated() -> None:
    done = subprocess.run(
        [sys.executable, ROOT / "scripts" / "releasing" / "version.py"],
        capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    assert int(done.stdout) % 86400 == 0


@pytest.mark.parametrize("lock", sorted((ROOT / "locks").glob("*.txt")), ids=lambda path: path.stem)
def test_locks_have_the_versions_of_the_constraints_with_hashes_and_no_host(lock: Path) -> None:
    constraints = (ROOT / "constraints.txt").read_text(encoding="utf-8").splitlines()
    exact = dict(line.split("==") for line in constraints if not line.startswith("#"))
    text = lock.read_text(encoding="utf-8")
    entries = re.findall(
        r"(?m)^([\w.-]+)==([^ ;\\]+)[^\n]*\\\n((?:    --hash=sha256:\w{64}.*\n)+)", text
    )
    assert len(entries) == len(re.findall(r"(?m)^\S", text)) > 20
    for name, version, _ in entries:
        assert exact[name] == version, f"{name}: run scripts/lock"
    assert "://" not in text


def test_locks_have_what_is_asked_for() -> None:
    """All names of pyproject.toml, by the extras that each lock is for."""
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    extras = project["optional-dependencies"]
    asked = {
        "demo": ["plots", "view"],
        "test": ["plots", "view", "learning", "arena", "test"],
        "docs": ["plots", "view", "docs"],
        "peers": ["plots", "view", "learning", "peers"],
        "release": ["release"],
    }
    assert {path.stem for path in (ROOT / "locks").glob("*.txt")} == set(asked)
    for name, parts in asked.items():
        wanted = [*project["dependencies"], *(each for part in parts for each in extras[part])]
        names = {re.match(r"[\w-]+", each)[0].lower().replace("_", "-") for each in wanted}
        text = (ROOT / "locks" / f"{name}.txt").read_text(encoding="utf-8")
        locked = set(re.findall(r"(?m)^([\w.-]+)==", text))
        assert {"pip", "setuptools"} | names - {"gne-mj"} <= locked


def test_the_list_of_licences_has_what_the_demo_installs() -> None:
    shown = (ROOT / "docs" / "licences.md").read_text(encoding="utf-8")
    demo = (ROOT / "locks" / "demo.txt").read_text(encoding="utf-8")
    everywhere = set(re.findall(r"(?m)^([\w.-]+)==[^ ]+ \\$", demo))
    assert len(everywhere) > 40
    assert everywhere <= set(re.findall(r"(?m)^\| ([\w.-]+) \|", shown))


def test_sdists_are_packed_to_the_same_bits(tmp_path: Path) -> None:
    spec = importlib.util.spec_from_file_location("repack", ROOT / "scripts/releasing/repack.py")
    repack = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(repack)
    packed = []
    for turn, names in enumerate((["b", "a"], ["a", "b"])):
        folder = tmp_path / str(turn) / "x"
        folder.mkdir(parents=True)
        for name in names:
            (folder / name).write_text(name)
        archive = tmp_path / f"{turn}.tar.gz"
        with tarfile.open(archive, "w:gz") as file:
            file.add(folder, "x")
        packed.append(repack.repacked(archive.read_bytes(), 86400))
    assert packed[0] == packed[1]
    with tarfile.open(fileobj=io.BytesIO(packed[0])) as file:
        assert [member.name for member in file.getmembers()] == ["x", "x/a", "x/b"]
        assert file.extractfile("x/a").read() == b"a"
        assert {member.mtime for member in file.getmembers()} == {86400}
