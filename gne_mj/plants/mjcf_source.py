"""Where a robot's MJCF file is: at a path, or in a package and called ``dm_control:walker``."""

from collections.abc import Sequence
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path

from gne_mj.errors import InvalidInput, nearest
from gne_mj.extras import need

FILES = ("file", "terrain")  # keys that name files, of any table of a system
# Folders of MJCF files, and the extras that bring their packages
FOLDERS = {
    "gne_mj": ("models", ""),
    "dm_control": ("suite", "learning"),
    "gymnasium": ("envs/mujoco/assets", "learning"),
}
MENAGERIE = "menagerie"


def is_named(name: str) -> bool:
    """Whether a text names a file without being its path."""
    package, colon, _ = name.partition(":")
    return bool(colon) and (package in FOLDERS or package == MENAGERIE)


def located(name: str) -> Path:
    """The path of a file. Nothing is downloaded.

    Args:
        name: a path; ``gne_mj:car.xml``, ``dm_control:walker`` or ``gymnasium:ant``, files of
            these packages; ``menagerie:unitree_go2`` or ``menagerie:unitree_go2/go2``, a robot of
            MuJoCo Menagerie, by its scene or another file of its.

    Raises:
        InvalidInput: the package has none of this name, or not yet on this machine; names
            ``file``.
        MissingExtra: it is not installed.
    """
    if not is_named(name):
        return Path(name)
    return _in_menagerie(name) if name.startswith(f"{MENAGERIE}:") else _in_folder(name)


def _in_folder(name: str) -> Path:
    package, _, wanted = name.partition(":")
    folder, extra = FOLDERS[package]
    if extra:
        need(extra, f"the robot {name}", package)
    # found without being imported, which takes seconds and asks for a display
    spec = find_spec(package)
    assert spec is not None
    assert spec.submodule_search_locations
    place = Path(spec.submodule_search_locations[0], folder)
    wanted = wanted.removesuffix(".xml")
    _check_known(name, wanted, sorted(path.stem for path in place.glob("*.xml")))
    return place / f"{wanted}.xml"


def _in_menagerie(name: str) -> Path:
    need(MENAGERIE, f"the robot {name}", "mujoco_menagerie")
    menagerie = import_module("mujoco_menagerie")
    wanted, _, entry = name.partition(":")[2].partition("/")
    _check_known(name, wanted, menagerie.names())
    robot, cache = menagerie.get(wanted), menagerie.Cache()
    if entry:
        _check_known(name, entry, robot.entry_names)
    if cache.root is None and not cache.is_cached(robot):
        raise InvalidInput(
            "file",
            name,
            f"its files must be on this machine first: mujoco-menagerie prefetch {wanted}",
        )
    return Path(robot.xml(entry or None, cache))


def _check_known(name: str, wanted: str, known: Sequence[str]) -> None:
    if wanted not in known:
        raise InvalidInput("file", name, f"it has no such robot; {nearest(wanted, known)}")
