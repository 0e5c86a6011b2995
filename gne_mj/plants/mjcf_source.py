"""Where a robot's MJCF file is: at a path, or shipped and called ``gne_mj:car.xml``."""

from importlib.resources import files
from pathlib import Path

from gne_mj.errors import InvalidInput, nearest

FILES = ("file", "terrain")  # keys that name files, of any table of a system
SHIPPED = "gne_mj:"  # before the name of a file in models/


def is_named(name: str) -> bool:
    """Whether a text names a file without being its path."""
    return name.startswith(SHIPPED)


def located(name: str) -> Path:
    """The path of a file.

    Raises:
        InvalidInput: the package ships none of this name; names ``file``.
    """
    if not is_named(name):
        return Path(name)
    folder, wanted = files("gne_mj.models"), name.removeprefix(SHIPPED)
    known = sorted(entry.name for entry in folder.iterdir() if entry.name.endswith(".xml"))
    if wanted not in known:
        raise InvalidInput("file", name, f"no such robot is shipped; {nearest(wanted, known)}")
    return Path(str(folder / wanted))
