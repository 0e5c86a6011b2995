"""A process that runs the command again and again, and what is kept of each time.

Started as a program it reads one JSON line for each command line and answers with one; all else of
this module is for the process that starts it.
"""

import json
import os
import resource
import select
import shutil
import signal
import subprocess
import sys
import tempfile
import time
import warnings
from collections.abc import Sequence
from pathlib import Path
from typing import Any, Self

GIB = 2**30
MOST_MEMORY = 4 * GIB
KEPT = 20_000  # characters of what is printed
LIMIT, WARM = 40.0, 480.0  # s: half of it until Ctrl-C, the rest until it is killed; if compiling


class Worker:
    """The other process; started anew when it ends, or after so many command lines."""

    def __init__(self, files: Sequence[Path], lines: int = 200) -> None:
        self._files, self._lines, self._left = files, lines, 0
        self._process: subprocess.Popen[bytes] | None = None
        self.folder = Path(tempfile.mkdtemp(prefix="gne-mj-fuzz-"))

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self._end()
        shutil.rmtree(self.folder, ignore_errors=True)

    def run(self, words: Sequence[str], contents: bytes = b"", *, limit: float) -> dict[str, Any]:
        """What one command line did: exit status, what it printed, seconds, peak memory in bytes.

        Args:
            words: behind the command's name; in them PATH and OUT stand for a file and a folder.
            contents: of PATH.
            limit: s until it is killed; Ctrl-C comes in the middle.
        """
        self._prepare(contents)
        if self._process is None or not self._left:
            self._end()
            self._start()
        self._left -= 1
        places = {"PATH": "input.toml", "OUT": "out"}
        for name, place in places.items():
            words = [word.replace(name, place) for word in words]
        process = self._process
        assert process is not None
        assert process.stdin is not None
        assert process.stdout is not None
        started = time.perf_counter()
        process.stdin.write(json.dumps(words).encode() + b"\n")
        process.stdin.flush()
        interrupted = False
        for until in (limit / 2, limit):
            wait = max(0.0, until - (time.perf_counter() - started))
            if select.select([process.stdout], [], [], wait)[0]:
                break
            if until < limit:
                interrupted = True
                process.send_signal(signal.SIGINT)
        else:
            self._end()
            seconds = time.perf_counter() - started
            return {"code": None, "out": "", "err": "", "seconds": seconds, "memory": 0,
                    "ended": "killed", "interrupted": True}  # fmt: skip
        line = process.stdout.readline()
        if interrupted:  # which leaves a compiler in any state
            self._left = 0
        about = {"seconds": time.perf_counter() - started, "interrupted": interrupted}
        if not line:
            code = process.wait()
            self._end()
            return {"code": code, "out": "", "err": "", "memory": 0, "ended": "died", **about}
        return {**json.loads(line), "ended": "", **about}

    def _prepare(self, contents: bytes) -> None:
        """A folder with the file and what its name may lead to, and nothing else."""
        shutil.rmtree(self.folder, ignore_errors=True)
        (self.folder / "folder.toml").mkdir(parents=True)
        (self.folder / "input.toml").write_bytes(contents)
        (self.folder / "zero.toml").symlink_to("/dev/zero")
        os.mkfifo(self.folder / "pipe.toml")
        for file in self._files:
            shutil.copy(file, self.folder)

    def _start(self) -> None:
        command = [sys.executable, __file__, str(self.folder)]
        self._process = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE)
        self._left = self._lines

    def _end(self) -> None:
        if self._process is not None:
            self._process.kill()
            self._process.wait()
            for stream in (self._process.stdin, self._process.stdout):
                if stream is not None:
                    stream.close()
            self._process = None


def _serve(folder: str) -> None:
    """Read command lines and answer, until there are no more."""
    answers = os.fdopen(os.dup(1), "w", encoding="utf-8")
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    import gne_mj.cli
    import gne_mj.scenario
    import gne_mj.trajectory  # so that none of their memory counts as an input's

    for kind in (RuntimeWarning, UserWarning):  # in a process of its own each would be the first
        warnings.simplefilter("always", kind)
    size = int(Path("/proc/self/statm").read_text().split()[0]) * resource.getpagesize()
    resource.setrlimit(resource.RLIMIT_AS, (size + MOST_MEMORY, resource.RLIM_INFINITY))
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    for line in sys.stdin:
        answers.write(json.dumps(_one(gne_mj.cli.main, folder, json.loads(line))) + "\n")
        answers.flush()


def _one(main: Any, folder: str, words: list[str]) -> dict[str, Any]:
    os.chdir(folder)
    Path("/proc/self/clear_refs").write_text("5")  # the peak starts anew
    sys.argv = ["gne-mj", *words]
    with tempfile.TemporaryFile() as out, tempfile.TemporaryFile() as err:
        for stream, number in ((out, 1), (err, 2)):
            os.dup2(stream.fileno(), number)
        code = _ended(main)
        for text in (sys.stdout, sys.stderr):
            text.flush()
        peak = next(
            int(line.split()[1]) * 1024
            for line in Path("/proc/self/status").read_text().splitlines()
            if line.startswith("VmHWM")
        )
        said = []
        for stream in (out, err):
            stream.seek(0)
            said.append(stream.read().decode("utf-8", "replace"))
    done = bool(said[0].strip()) if len(said[0]) > KEPT else said[0]
    shown = [each if len(each) <= KEPT else each[:KEPT] + "..." for each in said]
    return {"code": code, "out": shown[0], "err": shown[1], "memory": peak, "said": bool(done)}


def _ended(main: Any) -> int | None:
    """The exit status that the command's process would have."""
    try:
        signal.signal(signal.SIGINT, signal.default_int_handler)
        main()
        return 0
    except SystemExit as ended:
        if ended.code is None or isinstance(ended.code, int):
            return ended.code or 0
        print(ended.code, file=sys.stderr)
        return 1
    except BaseException:
        import traceback

        traceback.print_exc()
        return 1
    finally:
        signal.signal(signal.SIGINT, signal.SIG_IGN)


if __name__ == "__main__":
    _serve(sys.argv[1])
