"""Where numba keeps machine code where it can write neither to the package's folder nor to a home.

It keeps it beside the sources, else in the user's cache folder, and gives up without either, as in
an installation of another user's without a home. ``NUMBA_CACHE_DIR`` names a folder.
"""

import os
import stat
import sys
import tempfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import cache
from pathlib import Path
from typing import Any

import numba
from numba.core import caching, ccallback, dispatcher
from numba.core.caching import FunctionCache, IndexDataCacheFile
from numba.core.runtime import rtsys


def kept(compile: Callable[[bool], Any]) -> Any:
    """What ``compile(cache)`` makes, its machine code kept on disk wherever that can be.

    Args:
        compile: a decorator of numba's, told whether to keep machine code.
    """
    with older_versions_ignored():
        try:
            return compile(True)
        except RuntimeError as error:
            if "no locator available" not in str(error):
                raise
        return compile(_temporary())


class _Index(IndexDataCacheFile):
    """Which code is kept for a function: none where it is of modules that are gone.

    Two processes that keep something of one function at a time give it the same file name, and
    only one of them is in the index after; so each file says what it is of.
    """

    def save(self, key: Any, data: Any) -> None:
        super().save(key, (key, data))

    def load(self, key: Any) -> Any:
        found = super().load(key)
        return found[1] if found is not None and found[0] == key else None

    def _load_index(self) -> dict[Any, str]:
        try:
            found: dict[Any, str] = super()._load_index()
        except (ImportError, AttributeError):
            return {}
        return found


class _Cache(FunctionCache):
    """Loads machine code without all that numba imports to compile, a third of a second."""

    def load_overload(self, sig: Any, target_context: Any) -> Any:
        """As numba's caches have it; who compiles initialises the context himself."""
        rtsys.initialize(target_context)
        with self._guard_against_spurious_io_errors():
            return self._load_overload(sig, target_context)


def _make_caches(kind: type) -> None:
    for user in (dispatcher, ccallback):
        vars(user)["FunctionCache"] = kind


@contextmanager
def older_versions_ignored() -> Iterator[None]:
    """Numba reads an index before it asks whether the source is newer; loads as caches here do."""
    caching.IndexDataCacheFile = _Index
    _make_caches(_Cache)
    try:
        yield
    finally:
        caching.IndexDataCacheFile = IndexDataCacheFile
        _make_caches(FunctionCache)


@cache
def _temporary() -> bool:
    """Let numba keep machine code in a temporary folder, and say so; False if there is none."""
    try:
        folder = str(_folder())
    except OSError:
        folder = ""
        words = "nowhere, and made anew for every command: no folder can be written"
    else:
        words = f"in {folder}: neither the package's folder nor a home can be written"
    numba.config.CACHE_DIR = os.environ["NUMBA_CACHE_DIR"] = folder
    print(
        f"gne-mj: warning: machine code is kept {words}; NUMBA_CACHE_DIR names another folder",
        file=sys.stderr,
    )
    return bool(folder)


def _folder() -> Path:
    """A temporary folder, the same every time: the user's alone, since code from it is run."""
    folder = Path(tempfile.gettempdir(), f"gne-mj-{os.getuid()}")
    folder.mkdir(mode=0o700, exist_ok=True)
    about = folder.lstat()
    if stat.S_ISDIR(about.st_mode) and about.st_uid == os.getuid() and not about.st_mode & 0o077:
        return folder
    return Path(tempfile.mkdtemp(prefix="gne-mj-"))
