"""Whether the tests notice a mutant: the nearest ones first, until one fails."""

import hashlib
import json
import os
import re
import shutil
import signal
import subprocess
import sys
import time
from dataclasses import dataclass, field
from pathlib import Path

from operators import Mutant
from tree import Tree, environment

# Pages, packages and other products have tests that these modules hardly concern
LEFT_OUT = ("test_browser", "test_notebook", "test_packaging", "test_peers", "test_view_")
PLAIN_LIMIT = 5.0  # s for a test without compiled code; those that take longer are left out
TEST_LIMIT = 180.0  # s for any test, compiling included

_running: set[subprocess.Popen] = set()


def give_up() -> None:
    """End the tests that run, and this process; what was decided is kept."""
    for process in _running:
        os.killpg(process.pid, signal.SIGKILL)
    os._exit(130)


@dataclass
class Baseline:
    """What the tests do without any mutant: seconds of those that pass, by their names.

    Attributes:
        compiled: as users run it.
        plain: with numba switched off, so that kernels are plain Python functions.
    """

    compiled: dict[str, float] = field(default_factory=dict)
    plain: dict[str, float] = field(default_factory=dict)


@dataclass
class Verdict:
    """What became of a mutant: "killed", "timed out", "survived" or "undecided", and by what."""

    outcome: str
    by: str
    seconds: float


def baseline(tree: Tree, folder: Path) -> Baseline:
    """Run all tests that are new in the untouched copy, which also warms its machine code."""
    kept = folder / "baseline.json"
    texts = {str(path.relative_to(tree.base)): path.read_bytes() for path in _test_files(tree.base)}
    files = {file: hashlib.sha256(text).hexdigest() for file, text in texts.items()}
    known = json.loads(kept.read_text()) if kept.exists() else {"files": {}}
    same = {file for file in files if known["files"].get(file) == files[file]}
    for name, limit in (("plain", PLAIN_LIMIT), ("compiled", 0.0)):
        found = {t: s for t, s in known.get(name, {}).items() if t.partition("::")[0] in same}
        new = sorted(set(files) - same)
        if new:
            print(f"running {len(new)} files of tests without any mutant, {name} ...", flush=True)
            report, _ = _pytest(tree.base, folder, new, limit, 7200.0, [])
            found |= {test: seconds for test, outcome, seconds in report if outcome == "passed"}
            failed = [test for test, outcome, _ in report if outcome == "failed"]
            if name == "compiled" and failed:
                print("left out, since they fail without any mutant:", *failed, sep="\n  ")
        known[name] = found
    known["files"] = files
    kept.write_text(json.dumps(known))
    return Baseline(known["compiled"], known["plain"])


def judge(mutant: Mutant, tree: Tree, known: Baseline, folder: Path, limit: float) -> Verdict:
    """Try one mutant in a copy of its own; ``limit`` in s is for all tests together."""
    begun = time.monotonic()
    work = folder / "tree"
    try:
        tree.put(mutant, work)
    except ValueError as error:
        return Verdict("undecided", str(error), 0.0)
    rank = _Rank(mutant, tree)
    verdict = None
    for plain in (True, False) if mutant.native else (False,):
        how = ", as plain Python" if plain else ""
        for tests in rank.stages(known.plain if plain else known.compiled):
            left = max(limit - (time.monotonic() - begun), 10.0)
            own_limit = 3 * PLAIN_LIMIT if plain else 0.0
            report, ended = _pytest(work, folder, tests, own_limit, left, ["-x"])
            failed = [test for test, outcome, _ in report if outcome == "failed"]
            if failed:
                verdict = ("killed", failed[0] + how)
            elif ended == "limit":
                verdict = ("undecided", f"at {_next(tests, report)}{how}")
            elif ended == "hung":
                verdict = ("timed out", _next(tests, report) + how)
            elif ended != "passed":
                verdict = ("killed", f"{_next(tests, report)}{how}: the process ended, {ended}")
            if verdict:
                break
        if verdict:
            break
    shutil.rmtree(work)
    outcome, by = verdict or ("survived", "")
    return Verdict(outcome, by, round(time.monotonic() - begun, 1))


class _Rank:
    """Which test files are nearest to a mutant: by their name, their words and their imports."""

    def __init__(self, mutant: Mutant, tree: Tree) -> None:
        stem = Path(mutant.file).stem
        names = [n for n in mutant.function.split(".") if n and not n.startswith("__")]
        words = re.compile(rf"\b({'|'.join(map(re.escape, names))})\b") if names else None
        direct = tree.importing(mutant.file, 1)
        through = tree.importing(mutant.file, 2)
        self._near: dict[str, int] = {}
        for path in _test_files(tree.base):
            file = str(path.relative_to(tree.base))
            self._near[file] = (
                3 * (stem in path.stem)
                + 2 * bool(words and words.search(path.read_text(encoding="utf-8")))
                + (file in direct)
                + (file in through)
            )

    def stages(self, seconds: dict[str, float]) -> list[list[str]]:
        """The tests of near files, nearest and quickest first, and then all others."""
        total: dict[str, float] = {}
        for test, each in seconds.items():
            file = test.partition("::")[0]
            total[file] = total.get(file, 0.0) + each

        def key(test: str) -> tuple[float, ...]:
            file = test.partition("::")[0]
            return -self._near.get(file, 0), total[file]

        order = sorted(seconds, key=key)
        near = [test for test in order if self._near.get(test.partition("::")[0])]
        return [tests for tests in (near, order[len(near) :]) if tests]


def _test_files(base: Path) -> list[Path]:
    return [
        p for p in sorted((base / "tests").glob("test_*.py")) if not p.stem.startswith(LEFT_OUT)
    ]


def _next(tests: list[str], report: list) -> str:
    """The test that ran when the process ended."""
    done = {test for test, _, _ in report}
    return next((test for test in tests if test not in done), "the end")


def _pytest(
    tree: Path, folder: Path, tests: list[str], plain_limit: float, limit: float, more: list[str]
) -> tuple[list, str]:
    """Run tests; what each did, and how the process ended: passed, failed, hung, limit or other."""
    report, chosen = folder / "report.jsonl", folder / "tests.json"
    report.unlink(missing_ok=True)
    settings = environment(tree) | {"MUTATION_REPORT": str(report.resolve())}
    settings["PYTHONPATH"] += os.pathsep + str(Path(__file__).parent / "plugin")
    if plain_limit:
        settings |= {"NUMBA_DISABLE_JIT": "1", "MUTATION_LIMIT": str(plain_limit)}
    files = list(dict.fromkeys(test.partition("::")[0] for test in tests))
    if any("::" in test for test in tests):
        chosen.write_text(json.dumps(tests))
        settings["MUTATION_TESTS"] = str(chosen.resolve())
    command = [
        sys.executable, "-m", "pytest", "-q", "--no-header", "--tb=no", "-p", "no:cacheprovider",
        "-p", "mutation_plugin", "-o", f"faulthandler_timeout={TEST_LIMIT}",
        "-o", "faulthandler_exit_on_timeout=true", *more, *files,
    ]  # fmt: skip
    log = (folder / "log.txt").open("wb")
    process = subprocess.Popen(
        command, cwd=tree, env=settings, stdout=log, stderr=subprocess.STDOUT,
        stdin=subprocess.DEVNULL, start_new_session=True,
    )  # fmt: skip
    _running.add(process)
    try:
        code = process.wait(timeout=limit)
    except subprocess.TimeoutExpired:
        code = None
    finally:
        if process.poll() is None:
            os.killpg(process.pid, signal.SIGKILL)
            process.wait()
        _running.discard(process)
        log.close()
    lines = report.read_text().splitlines() if report.exists() else []
    found = [json.loads(line) for line in lines]
    hung = b"Timeout (" in (folder / "log.txt").read_bytes()
    ended = "limit" if code is None else "hung" if hung and code != 0 else None
    return found, ended or {0: "passed", 1: "failed"}.get(code, f"exit status {code}")
