"""Commands that are killed at random moments: nothing that was finished may be lost, nothing
half-written may stay, and no process.

Each kill begins in a folder of its own, with a finished run, results of an earlier `paper` and a
file of the user's. What SIGKILL leaves in hidden folders has to go with the next command there.
"""

import argparse
import json
import os
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from draws import progress

from gne_mj import Trajectory
from gne_mj.batches import Progress, Store
from gne_mj.errors import GneError
from gne_mj.files import hidden_folder

GNE = (
    sys.executable,
    "-c",
    "import sys; from gne_mj.cli import main; sys.argv[0] = 'gne-mj'; main()",
)
SIGNALS = (signal.SIGKILL, signal.SIGTERM, signal.SIGINT)
ATTEMPTS, BEFORE = 5, "before"  # a command that ends before it is killed is run again
PATIENCE = 60.0  # s for a command to end once it was asked to, on a machine that is busy
WATCHED = 2.0  # s that a page is looked at before its command is killed, at most

RUN = ("run", "velocity-sync", "--set", "simulation.duration=200")
COMMANDS = {
    "run": (*RUN, "--out", "out"),
    "paper": ("paper", "--set", "simulation.duration=2", "--out", "paper"),
    "map": ("map", "velocity-sync", "--periods", "0.01:0.1:3", "--margins", "0.1:0.5:3",
            "--runs", "3", "--out", "out"),
    "batch": ("batch", "velocity-sync", "--set", "simulation.duration=5", "--set",
              "simulation.timestep=0.01", "--sweep", "barrier.rho=0.05:1:4log", "--runs", "20",
              "--chunk", "3", "--record", "4", "--resume", "--out", "out"),
    "solve": ("solve", "velocity-sync", "--path", "1:1e-6:13", "--out", "out"),
    "view --html": ("view", "run", "--html", "out"),
    "plot": ("plot", "run", "--out", "out"),
    "view": ("view", "run"),
    "run --view": ("run", "velocity-sync", "--view", "--now", "--out", "out"),
}  # fmt: skip
PAGES = ("view", "run --view")  # which end only if they are asked to


@dataclass(frozen=True)
class Reference:
    """What commands leave if nobody kills them.

    Attributes:
        folder: where they ran, one after the other.
        durations: of each command in s.
    """

    folder: Path
    durations: dict[str, float]


def main() -> int:
    """Kill, print the table; 1 if something was lost, or stayed."""
    parser = argparse.ArgumentParser(prog="scripts/check-kills", description=__doc__)
    parser.add_argument("--kills", type=int, default=200)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--index", type=int, help="repeat this kill alone")
    parser.add_argument("--processes", type=int, default=2)
    options = parser.parse_args()
    # A shell that starts this in the background has it, and all that it starts, ignore Ctrl-C.
    signal.signal(signal.SIGINT, signal.default_int_handler)
    started = time.perf_counter()
    with tempfile.TemporaryDirectory(prefix="gne-mj-kills-") as name:
        reference = prepared(Path(name) / "reference")
        chosen = range(options.kills) if options.index is None else [options.index]

        def one(index: int) -> tuple[str, str, str, list[str]]:
            return kill(Path(name) / str(index), reference, options.seed, index)

        with ThreadPoolExecutor(options.processes) as pool:
            rows = list(progress(pool.map(one, chosen), len(chosen), "kills"))
    counts = Counter((command, sent, ended) for command, sent, ended, _ in rows)
    print("| command | signal | ended | kills |\n|---|---|---|---|")
    for key in sorted(counts):
        print(f"| {' | '.join(key)} | {counts[key]} |")
    faults = [(index, row) for index, row in zip(chosen, rows, strict=True) if row[3]]
    for index, (command, sent, ended, found) in faults:
        print(f"--index {index}: {command}, {sent}, {ended}: {'; '.join(found)}")
    print(f"\n{len(rows)} kills, {len(faults)} with a fault; {time.perf_counter() - started:.0f} s")
    return 1 if faults else 0


def prepared(folder: Path) -> Reference:
    """Run every command once, unkilled: compiled by then, and with results to compare with."""
    folder.mkdir()
    (folder / "mine.txt").write_text("mine")
    durations = {}
    subprocess.run([*GNE, *RUN, "--out", "run"], cwd=folder, check=True, capture_output=True)
    for name, arguments in COMMANDS.items():
        started = time.perf_counter()
        if name in PAGES:
            process = begun(folder, arguments)
            assert process.stderr is not None
            while not process.stderr.readline().startswith(b"view"):
                assert process.poll() is None, f"{name} did not begin"
            durations[name] = time.perf_counter() - started + WATCHED
            process.terminate()
            process.communicate()
        else:
            subprocess.run([*GNE, *arguments], cwd=folder, check=True, capture_output=True)
            durations[name] = time.perf_counter() - started
        if (folder / "out").exists():
            (folder / "out").rename(folder / f"out of {name}")
    return Reference(folder, durations)


def begun(folder: Path, arguments: tuple[str, ...]) -> subprocess.Popen[bytes]:
    """A command, in a session of its own."""
    return subprocess.Popen(
        [*GNE, *arguments], cwd=folder, start_new_session=True,
        stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.PIPE,
    )  # fmt: skip


def kill(
    folder: Path, reference: Reference, seed: int, index: int
) -> tuple[str, str, str, list[str]]:
    """Kill one command; its name, the signal, how it ended, and what was wrong."""
    rng = np.random.default_rng((seed, index))
    name = tuple(COMMANDS)[index % len(COMMANDS)]
    number = SIGNALS[(index + index // len(COMMANDS)) % len(SIGNALS)]
    # Half of the moments are late, where results are written
    share = rng.uniform(0.0 if rng.random() < 0.5 else 0.7, 1.0)
    duration, ended, faults = reference.durations[name], BEFORE, list[str]()
    for _ in range(ATTEMPTS):
        _fill(folder, reference)
        started = time.perf_counter()
        process = begun(folder, COMMANDS[name])
        try:
            process.communicate(timeout=share * duration)
            duration = time.perf_counter() - started  # the machine has less to do by now
        except subprocess.TimeoutExpired:
            process.send_signal(number)
            ended = str(_end_of(process))
        faults += _faults(name, number, ended, process, folder, reference)
        shutil.rmtree(folder, ignore_errors=True)
        if ended != BEFORE:
            break
    return name, number.name, ended, faults


def _fill(folder: Path, reference: Reference) -> None:
    """What was finished before the command begins."""
    folder.mkdir()
    for entry in ("run", "paper", "mine.txt"):
        copy = shutil.copytree if (reference.folder / entry).is_dir() else shutil.copy
        copy(reference.folder / entry, folder / entry)
    (folder / "paper" / "mine.txt").write_text("mine too")


def _end_of(process: subprocess.Popen[bytes]) -> int | None:
    """The exit status; None if it does not end."""
    try:
        process.communicate(timeout=PATIENCE)
    except subprocess.TimeoutExpired:
        return None
    return process.returncode


def _faults(
    name: str,
    number: signal.Signals,
    ended: str,
    process: subprocess.Popen[bytes],
    folder: Path,
    reference: Reference,
) -> Iterator[str]:
    if ended == "None":
        yield f"it did not end within {PATIENCE:g} s"
    if left := _session(process.pid):
        yield f"processes stayed: {left}"
        for pid in left:
            with suppress(OSError):
                os.kill(pid, signal.SIGKILL)
        process.communicate()
    hidden = [path.name for path in folder.rglob(".gne-mj-*")]
    if hidden and number != signal.SIGKILL:
        yield f"hidden folders stayed: {hidden}"
    for place in (folder, folder / "paper"):
        with hidden_folder(place):  # sweeps
            pass
    expected = {"run", "paper", "mine.txt"}
    stayed = {path.name for path in folder.iterdir()} - expected
    if stayed - {"out"}:
        yield f"there is {sorted(stayed - {'out'})} that is no result"
    out = folder / "out"
    # A command that says by its exit status that it kept something has done so
    done = ended in (BEFORE, "0", "1")
    if (
        done
        and not out.exists()
        and name not in ("paper", "view")
        and not _stopped_early(name, ended)
    ):
        yield f"exit status {process.returncode}, and no result"
    if out.exists():
        yield from _told(WHOLE[name], out, reference.folder / f"out of {name}", folder)
    yield from _told(_paper, folder / "paper", reference.folder / "paper", folder)
    for entry in ("run", "mine.txt"):
        if _contents(folder / entry) != _contents(reference.folder / entry):
            yield f"{entry} is not as it was"


def _stopped_early(name: str, ended: str) -> bool:
    """Whether a command may have ended by a signal before there was anything to keep."""
    return ended == "1" and name in ("map", "batch")


def _told(
    check: Callable[[Path, Path, Path], Iterator[str]], out: Path, expected: Path, folder: Path
) -> Iterator[str]:
    """What a check finds; what it stumbles over is a fault too."""
    try:
        yield from check(out, expected, folder)
    except (GneError, OSError, ValueError, KeyError) as error:
        yield f"{out.name}: {type(error).__name__}: {error}"


def _run(out: Path, expected: Path, folder: Path) -> Iterator[str]:
    """A trajectory and the report that goes with it."""
    report = json.loads((out / "report.json").read_text())
    if Trajectory.load(out / "trajectory.zarr").report() != report:
        yield "the report is not the trajectory's"
    if {path.name for path in out.iterdir()} != {"report.json", "trajectory.zarr"}:
        yield f"a run left {sorted(path.name for path in out.iterdir())}"


def _paper(out: Path, expected: Path, folder: Path) -> Iterator[str]:
    """All of the old results or all of the new ones, beside a file of the user's."""
    report = json.loads((out / "report.json").read_text())
    if Trajectory.load(out / "trajectory.zarr").report() != report:
        yield "the paper's report is not the trajectory's"
    if (out / "mine.txt").read_text() != "mine too":
        yield "the user's file is not as it was"
    names = {path.name for path in expected.iterdir()} | {"mine.txt"}
    if {path.name for path in out.iterdir()} != names:
        yield f"the paper left {sorted(path.name for path in out.iterdir())}"
    yield from _drawn(out)


def _map(out: Path, expected: Path, folder: Path) -> Iterator[str]:
    """Whole cells, as many as were done, and their figure."""
    lines = (out / "map.csv").read_text().splitlines()
    wanted = (expected / "map.csv").read_text().splitlines()
    if lines != wanted[: len(lines)] or len(lines) < 2:
        yield f"the map's {len(lines)} lines are not the first of {len(wanted)}"
    yield from _drawn(out)


def _batch(out: Path, expected: Path, folder: Path) -> Iterator[str]:
    """It goes on to the same bytes, and loses nothing that was stored."""
    before = Progress.of(Store.open(out)).done
    runs = Store.open(out).statuses() != ""
    again = subprocess.run([*GNE, *COMMANDS["batch"]], cwd=folder, capture_output=True, text=True)
    if again.returncode != 0:
        yield f"it does not go on from {before} runs: {again.stderr}"
    elif not np.all(Store.open(out).statuses()[runs] != ""):
        yield "runs that were stored are lost"
    elif _contents(out) != _contents(expected):
        yield "it does not end as if it had not been killed"


def _same(out: Path, expected: Path, folder: Path) -> Iterator[str]:
    """The same bytes as without a kill."""
    if _contents(out) != _contents(expected):
        yield "it is not what it is without a kill"


def _figures(out: Path, expected: Path, folder: Path) -> Iterator[str]:
    """Whole figures, as many as were drawn."""
    if not {path.name for path in out.iterdir()} <= {path.name for path in expected.iterdir()}:
        yield f"there are {sorted(path.name for path in out.iterdir())}"
    yield from _drawn(out)


def _drawn(folder: Path) -> Iterator[str]:
    for path in folder.glob("*.png"):
        if not path.read_bytes().endswith(b"IEND\xaeB`\x82"):
            yield f"{path.name} is half a figure"


WHOLE = {
    "run": _run, "run --view": _run, "map": _map, "batch": _batch, "solve": _same, "plot": _figures,
    "view --html": _same,
}  # fmt: skip


def _contents(place: Path) -> dict[str, bytes]:
    """All files of a folder, or a file, by name."""
    paths = [place] if place.is_file() else sorted(p for p in place.rglob("*") if p.is_file())
    return {str(path.relative_to(place.parent / place.name)): path.read_bytes() for path in paths}


def _session(leader: int) -> list[int]:
    """Processes of a session that have not ended."""
    found = []
    for entry in Path("/proc").iterdir():
        with suppress(OSError, ValueError):
            state, _, _, session = (entry / "stat").read_text().rpartition(")")[2].split()[:4]
            if int(session) == leader and state != "Z":
                found.append(int(entry.name))
    return found


if __name__ == "__main__":
    sys.exit(main())
