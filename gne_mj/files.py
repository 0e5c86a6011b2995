"""Files and folders that appear whole, under a name that nothing else has.

What is being written lies in a hidden folder beside its place, and moves there in one step. A
process that is killed meanwhile leaves such a folder behind; the next one that is made in the same
place removes it.
"""

import ctypes
import errno
import fcntl
import os
import platform
import secrets
import shutil
from collections.abc import Iterable, Iterator
from contextlib import contextmanager, suppress
from itertools import count
from pathlib import Path

from gne_mj.errors import GneError, InvalidInput, StorageError

# Errors that tell of the place that was named, not of the disk
_NO_PLACE = {
    errno.EACCES, errno.EEXIST, errno.EISDIR, errno.ELOOP, errno.ENAMETOOLONG, errno.ENOENT,
    errno.ENOTDIR, errno.EPERM, errno.EROFS,
}  # fmt: skip

# Of Linux's renameat2; what a system or file system says that has no such thing
_NEVER_REPLACE, _EXCHANGE = 1, 2
_LACKING = {errno.EINVAL, errno.ENOSYS, errno.EOPNOTSUPP}
_HERE = -100


@contextmanager
def storing(key: str, path: Path) -> Iterator[None]:
    """Say in one sentence why a path cannot be written; what is inside only writes.

    Raises:
        InvalidInput: it exists already, or is no place to write to.
        StorageError: the disk is full, or fails.
    """
    try:
        yield
    except OSError as error:
        raise _refusal(key, path, error) from error
    except StorageError as error:  # of something within it, which by then has vanished
        if not isinstance(error.__cause__, OSError):
            raise
        raise _refusal(key, path, error.__cause__) from error.__cause__


def _refusal(key: str, path: Path, error: OSError) -> GneError:
    if error.errno == errno.EEXIST and str(path) in (error.filename, error.filename2):
        return InvalidInput(key, str(path), "it exists already; name one that does not")
    if error.errno in _NO_PLACE:
        return InvalidInput(key, str(path), f"it cannot be written: {error.strerror}")
    return StorageError(f"{path}: it cannot be written: {error.strerror or error}")


def refuse_existing(key: str, paths: Iterable[Path]) -> None:
    """What exists is somebody's.

    Raises:
        InvalidInput: one of the paths does.
    """
    for path in paths:
        if os.path.lexists(path):
            raise InvalidInput(
                key, str(path), "it exists already; name another one, or give `replace`"
            )


@contextmanager
def written(key: str, path: Path, *, replace: bool) -> Iterator[Path]:
    """Where to write a file or folder that takes its place, in one step, when the block ends.

    Args:
        key: what an error calls the path.
        path: the place.
        replace: a file that is there already is replaced.

    Raises:
        InvalidInput, StorageError: see :func:`storing`; what was there is as it was.
    """
    with storing(key, path), hidden_folder(path.parent) as hidden:
        new = hidden / path.name
        yield new
        if replace:
            new.replace(path)
        else:
            rename_new(new, path)


@contextmanager
def hidden_folder(parent: Path) -> Iterator[Path]:
    """A folder that nobody looks at, for what is not whole yet; it goes with the block."""
    _sweep(parent)
    while True:
        folder = parent / f"{_prefix()}{secrets.token_hex(8)}"
        try:
            folder.mkdir()
            with locked(folder):
                if folder.exists():  # else another process swept before it was locked
                    yield folder
                    return
        finally:
            _remove(folder)


def _remove(folder: Path) -> None:
    try:
        shutil.rmtree(folder, ignore_errors=True)
    except BaseException:  # a signal came just now
        shutil.rmtree(folder, ignore_errors=True)
        raise


def _prefix() -> str:
    """Of hidden folders; with the machine's name, since not all locks reach other machines."""
    return f".gne-mj-{platform.node()}-"


@contextmanager
def locked(folder: Path) -> Iterator[None]:
    """Keep a folder to this process, where the file system has locks, among all that lock it."""
    lock = os.open(folder, os.O_RDONLY | os.O_DIRECTORY)
    try:
        with suppress(OSError):
            fcntl.flock(lock, fcntl.LOCK_EX)
        yield
    finally:
        os.close(lock)


def _sweep(parent: Path) -> None:
    """Remove hidden folders whose processes are gone."""
    with suppress(OSError):
        for name in os.listdir(parent):
            if name.startswith(_prefix()):
                _remove_unless_locked(parent / name)


def _remove_unless_locked(folder: Path) -> None:
    with suppress(OSError):
        lock = os.open(folder, os.O_RDONLY | os.O_DIRECTORY | os.O_NOFOLLOW)
        try:
            fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
            shutil.rmtree(folder, ignore_errors=True)
        finally:
            os.close(lock)


def appear(source: Path, target: Path) -> Path:
    """Give a file or folder its name or, if something has that, the first of NAME-2, NAME-3, ...

    Returns:
        Where it is now.
    """
    ending = "" if source.is_dir() else target.suffix
    base = target.name.removesuffix(ending)
    for number in count(1):
        place = target if number == 1 else target.with_name(f"{base}-{number}{ending}")
        with suppress(FileExistsError):
            rename_new(source, place)
            return place
    raise AssertionError


def rename_new(source: Path, target: Path) -> None:
    """Rename a file or folder, and replace nothing.

    Raises:
        FileExistsError: something has that name.
    """
    try:
        _renameat2(source, target, _NEVER_REPLACE)
    except OSError as error:
        if error.errno not in _LACKING:
            raise
        if source.is_dir():
            target.mkdir()  # who makes it has the name
            try:
                source.rename(target)  # replaces a folder only while it is empty
            except OSError as error:
                raise FileExistsError(errno.EEXIST, error.strerror, str(target)) from None
        else:
            os.link(source, target)
            source.unlink()


def exchange(one: Path, other: Path) -> None:
    """Let two files or folders change places; at no time is there none."""
    try:
        _renameat2(one, other, _EXCHANGE)
    except OSError as error:
        if error.errno not in _LACKING:
            raise
        aside = one.with_name(f"{one.name}-{secrets.token_hex(4)}")
        other.rename(aside)
        one.rename(other)
        aside.rename(one)


def _renameat2(source: Path, target: Path, flags: int) -> None:
    call = getattr(ctypes.CDLL(None, use_errno=True), "renameat2", None)
    number = errno.ENOSYS
    if call is not None:
        if call(_HERE, os.fsencode(source), _HERE, os.fsencode(target), flags) == 0:
            return
        number = ctypes.get_errno()
    raise OSError(number, os.strerror(number), str(source), None, str(target))
