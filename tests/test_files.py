"""What is written appears whole, replaces nothing, and leaves nothing behind a kill."""

import errno
import os
import signal
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest

from gne_mj import files
from gne_mj.errors import InvalidInput, StorageError

HOLDS = """
import sys, time
from pathlib import Path
from gne_mj.files import hidden_folder
with hidden_folder(Path(sys.argv[1])) as folder:
    (folder / "half").write_text("half")
    print(folder, flush=True)
    time.sleep(600)
"""


@pytest.fixture(params=["renameat2", "without"])
def system(request, monkeypatch):
    """This system, and one that lacks Linux's renameat2 (as NFS does)."""
    if request.param == "without":

        def lacking(*_):
            raise OSError(errno.EINVAL, "Invalid argument")

        monkeypatch.setattr(files, "_renameat2", lacking)


def made(path, content):
    """A file, or a folder with a file if the content is a tuple."""
    if isinstance(content, tuple):
        path.mkdir()
        for text in content:
            (path / "file").write_text(text)
    else:
        path.write_text(content)
    return path


def content(path):
    return (path / "file").read_text() if path.is_dir() else path.read_text()


@pytest.mark.usefixtures("system")
@pytest.mark.parametrize("there", ["mine", ("mine",), ()], ids=["file", "folder", "empty folder"])
@pytest.mark.parametrize("new", ["new", ("new",)], ids=["file", "folder"])
def test_renaming_replaces_nothing(new, there, tmp_path):
    source, target = made(tmp_path / "source", new), made(tmp_path / "target", there)
    before = target.stat().st_ino
    with pytest.raises(FileExistsError):
        files.rename_new(source, target)
    assert target.stat().st_ino == before
    assert content(source) == "new"
    files.rename_new(source, tmp_path / "free")
    assert content(tmp_path / "free") == "new"
    assert not source.exists()


@pytest.mark.usefixtures("system")
def test_whoever_comes_later_gets_another_name(tmp_path):
    made(tmp_path / "run", "mine")
    for number in (2, 3):
        place = files.appear(made(tmp_path / "source", ("new",)), tmp_path / "run")
        assert place == tmp_path / f"run-{number}"
    made(tmp_path / "counts.json", "mine")
    place = files.appear(made(tmp_path / "source", "new"), tmp_path / "counts.json")
    assert place == tmp_path / "counts-2.json"
    assert content(tmp_path / "run") == content(tmp_path / "counts.json") == "mine"


@pytest.mark.usefixtures("system")
def test_of_many_at_once_everybody_keeps_what_is_theirs(tmp_path):
    sources = [made(tmp_path / f"source-{number}", (str(number),)) for number in range(40)]
    with ThreadPoolExecutor(8) as pool:
        places = list(pool.map(lambda source: files.appear(source, tmp_path / "run"), sources))
    assert [content(place) for place in places] == [str(number) for number in range(40)]
    assert {path.name for path in tmp_path.iterdir()} == {
        "run", *(f"run-{number}" for number in range(2, 41)),
    }  # fmt: skip


@pytest.mark.usefixtures("system")
def test_two_change_places(tmp_path):
    one, other = made(tmp_path / "one", ("one",)), made(tmp_path / "other", ("other",))
    files.exchange(one, other)
    assert (content(one), content(other)) == ("other", "one")
    assert len(list(tmp_path.iterdir())) == 2


def test_what_a_killed_process_leaves_goes_with_the_next(tmp_path):
    holders = []
    for _ in range(2):
        holder = subprocess.Popen(
            [sys.executable, "-c", HOLDS, tmp_path], stdout=subprocess.PIPE, text=True
        )
        holders.append((holder, Path(holder.stdout.readline().strip())))
    (tmp_path / ".mine-0123").mkdir()
    dead, alive = holders
    dead[0].send_signal(signal.SIGKILL)
    dead[0].wait()
    assert dead[1].exists()
    try:
        with files.hidden_folder(tmp_path) as own:
            assert {path.name for path in tmp_path.iterdir()} == {
                alive[1].name, own.name, ".mine-0123",
            }  # fmt: skip
            assert (alive[1] / "half").read_text() == "half"
    finally:
        alive[0].kill()
        alive[0].wait()
    assert not own.exists()
    for holder, _ in holders:
        holder.stdout.close()


@pytest.mark.parametrize(
    ("number", "error"),
    [(errno.ENOSPC, StorageError), (errno.EDQUOT, StorageError), (errno.EACCES, InvalidInput)],
)
def test_what_fails_leaves_all_as_it_was(number, error, tmp_path):
    path = made(tmp_path / "table.csv", "mine")

    def write():
        with files.written("--out", path, replace=True) as new:
            new.write_text("half")
            raise OSError(number, os.strerror(number))

    with pytest.raises(error, match=f"{path}.*{os.strerror(number)}"):
        write()
    assert content(path) == "mine"
    assert list(tmp_path.iterdir()) == [path]


def test_an_error_within_names_the_place_that_was_asked_for(tmp_path):
    def write():
        with files.written("--out", tmp_path / "run", replace=False) as outer:
            outer.mkdir()
            with files.written("folder", outer / "inner", replace=False):
                raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    with pytest.raises(StorageError, match=rf"^{tmp_path}/run: it cannot be written: No space"):
        write()


def test_a_file_replaces_another_only_if_it_may(tmp_path):
    path = made(tmp_path / "page.html", "mine")
    with (
        pytest.raises(InvalidInput, match="exists already"),
        files.written("--html", path, replace=False) as new,
    ):
        new.write_text("new")
    assert content(path) == "mine"
    with files.written("--html", path, replace=True) as new:
        new.write_text("new")
    assert content(path) == "new"
    assert list(tmp_path.iterdir()) == [path]


def test_permissions_are_the_users(tmp_path):
    before = os.umask(0o027)
    try:
        with files.written("--out", tmp_path / "run", replace=False) as new:
            new.mkdir()
        with files.written("--out", tmp_path / "file", replace=False) as new:
            new.write_text("new")
    finally:
        os.umask(before)
    assert (tmp_path / "run").stat().st_mode & 0o777 == 0o750
    assert (tmp_path / "file").stat().st_mode & 0o777 == 0o640
