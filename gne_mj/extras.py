"""Parts of the package that need more than it installs by itself, each an extra of its name."""

import sys
from importlib.util import find_spec

from gne_mj.errors import MissingExtra

# What each of them imports
EXTRAS = {
    "plots": ("matplotlib",),
    "view": ("meshcat", "tornado", "umsgpack", "PIL"),
    "learning": ("dm_control", "dm_env", "gymnasium", "pettingzoo"),
    "arena": ("daqp",),
    "menagerie": ("mujoco_menagerie",),
}
# On Python 3.13 one of dm-control's own dependencies cannot be installed, see pyproject.toml
_ALONE = " && pip install --no-deps dm-control==1.0.50" if sys.version_info >= (3, 13) else ""
_MORE = {"learning": _ALONE}


def need(extra: str, doing: str, *packages: str) -> None:
    """Refuse to go on where an extra is not installed; nothing is imported.

    Args:
        extra: its name.
        doing: what needs it, for the message.
        packages: of its packages, all if left out.

    Raises:
        MissingExtra: says how to install it.
    """
    for package in packages or EXTRAS[extra]:
        if find_spec(package) is None:
            command = f"pip install 'gne-mj[{extra}]'{_MORE.get(extra, '')}"
            raise MissingExtra(f"{doing} needs {package}, which is not installed: {command}")
