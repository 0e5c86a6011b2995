"""Whether the tests notice a mutant: the nearest ones first, until one fails."""

import ast
import hashlib
import json
import os
import re
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from dataclasses import asdict, dataclass, field
from itertools import accumulate
from pathlib import Path

import coverage
from copies import Tree, environment
from operators import Mutant

# Pages, packages and other products have tests that these modules hardly concern
LEFT_OUT = ("test_browser", "test_notebook", "test_packaging", "test_peers", "test_view_")
PLAIN_LIMIT = 5.0  # s for a test without compiled code; those that take longer are left out
TEST_LIMIT = 180.0  # s for any test, compiling included
FIRST = 5.0  # s that the nearest tests may take, which run before all others

_running: set[subprocess.Popen] = set()


def give_up() -> None:
    """End the tests that run, and this process; what was decided is kept."""
    for process in _running:
        os.killpg(process.pid, signal.SIGKILL)
    os._exit(130)


@dataclass
class Baseline:
    """What the tests do without any mutant.

    Attributes:
        seconds: of those that pass, by their names.
        executing: which of them execute a function, by file and dotted name; of a function that
            runs as machine code nothing is known.
    """

    seconds: dict[str, float] = field(default_factory=dict)
    executing: dict[str, dict[str, list[str]]] = field(default_factory=dict)

    def without(self, files: set[str]) -> "Baseline":
        """What is known of the tests in other files."""

        def stays(test: str) -> bool:
            return test.partition("::")[0] not in files

        executing = {
            file: {name: list(filter(stays, tests)) for name, tests in functions.items()}
            for file, functions in self.executing.items()
        }
        return Baseline({t: s for t, s in self.seconds.items() if stays(t)}, executing)

    def add(self, other: "Baseline") -> None:
        """Join what is known of other tests."""
        self.seconds |= other.seconds
        for file, functions in other.executing.items():
            for name, tests in functions.items():
                self.executing.setdefault(file, {}).setdefault(name, []).extend(tests)


@dataclass
class Verdict:
    """What became of a mutant: "killed", "timed out", "survived" or "undecided", and by what."""

    outcome: str
    by: str
    seconds: float


def baseline(tree: Tree, folder: Path) -> dict[str, Baseline]:
    """Run all tests that are new in the untouched copy, which also warms its machine code.

    Returns:
        "plain", with numba switched off, so that kernels are plain Python functions; and
        "compiled", as users run them.
    """
    kept = folder / "baseline.json"
    texts = {str(path.relative_to(tree.base)): path.read_bytes() for path in _test_files(tree.base)}
    files = {file: hashlib.sha256(text).hexdigest() for file, text in texts.items()}
    before = json.loads(kept.read_text()) if kept.exists() else {"files": {}}
    new = sorted(file for file in files if before["files"].get(file) != files[file])
    gone = set(before["files"]) - set(files)
    known = {}
    for name, limit in (("plain", PLAIN_LIMIT), ("compiled", 0.0)):
        known[name] = Baseline(**before.get(name, {})).without({*new, *gone})
        if new:
            print(f"running {len(new)} files of tests without any mutant, {name} ...", flush=True)
            lines = folder / "coverage"
            lines.unlink(missing_ok=True)
            report, _ = _pytest(tree.base, folder, new, limit, 7200.0, [], lines)
            passed = {test: seconds for test, outcome, seconds in report if outcome == "passed"}
            failed = [test for test, outcome, _ in report if outcome == "failed"]
            if not passed:
                raise SystemExit(f"no test passes without any mutant: see {folder / 'log.txt'}")
            known[name].add(Baseline(passed, executed(lines, tree.base, set(passed))))
            if name == "compiled" and failed:
                print("left out, since they fail without any mutant:", *failed, sep="\n  ")
    kept.write_text(json.dumps({"files": files} | {n: asdict(k) for n, k in known.items()}))
    return known


def executed(lines: Path, base: Path, passed: set[str]) -> dict[str, dict[str, list[str]]]:
    """Which tests execute which functions, see :class:`Baseline`, from a file of coverage."""
    data = coverage.CoverageData(str(lines))
    data.read()
    by_file: dict[str, set[str]] = {}
    for test in passed:
        by_file.setdefault(test.partition("::")[0], set()).add(test)
    found: dict[str, dict[str, list[str]]] = {}
    for measured in data.measured_files():
        path = Path(measured)
        if not path.is_relative_to(base.resolve()):
            continue
        name = str(path.relative_to(base.resolve()))
        owner = functions_of_lines(path.read_bytes())
        tests: dict[str, set[str]] = {}
        for line, contexts in data.contexts_by_lineno(measured).items():
            for context in contexts:
                own = {context} & passed if "::" in context else by_file.get(context, set())
                tests.setdefault(owner.get(line, ""), set()).update(own)
        found[name] = {function: sorted(own) for function, own in tests.items() if function}
    return found


def functions_of_lines(source: bytes) -> dict[int, str]:
    """For each line in a function's body the dotted name of the innermost one."""
    found: dict[int, str] = {}

    def visit(node: ast.AST, scopes: tuple[str, ...]) -> None:
        for child in ast.iter_child_nodes(node):
            inner = scopes
            if isinstance(child, ast.FunctionDef | ast.ClassDef | ast.AsyncFunctionDef):
                inner = (*scopes, child.name)
                if not isinstance(child, ast.ClassDef):
                    for line in range(child.body[0].lineno, (child.end_lineno or 0) + 1):
                        found[line] = ".".join(inner)
            visit(child, inner)

    visit(ast.parse(source), ())
    return found


def judge(
    mutant: Mutant, tree: Tree, known: dict[str, Baseline], folder: Path, limit: float
) -> Verdict:
    """Try one mutant in a copy of its own; ``limit`` in s is for all tests together."""
    begun = time.monotonic()
    work = folder / "tree"
    try:
        tree.put(mutant, work)
    except ValueError as error:
        return Verdict("undecided", str(error), 0.0)
    verdict = None
    for plain, tests in _stages(mutant, tree, known):
        how = ", as plain Python" if plain else ""
        left = max(limit - (time.monotonic() - begun), 10.0)
        report, ended = _pytest(
            work, folder, tests, 3 * PLAIN_LIMIT if plain else 0.0, left, ["-x"]
        )
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
    shutil.rmtree(work)
    outcome, by = verdict or ("survived", "")
    return Verdict(outcome, by, round(time.monotonic() - begun, 1))


def _stages(
    mutant: Mutant, tree: Tree, known: dict[str, Baseline]
) -> Iterator[tuple[bool, list[str]]]:
    """Lists of tests to run one after the other, and whether as plain Python.

    First those that are known to execute the mutant's function; then those of near files, since a
    cache may hide others, and those that start processes, of which nothing is known. Of machine
    code nothing is known: all others. What runs as machine code is tried as plain Python where that
    is soon done, since then nothing is compiled.
    """
    rank, compiled, done = _Rank(mutant, tree), known["compiled"], set()
    baseline = known["plain"] if mutant.native else compiled
    own = baseline.executing.get(mutant.file, {}).get(mutant.function, [])
    first, others = rank.nearest_first(own, baseline.seconds)
    if first:
        yield mutant.native, first
    others = [test for test in others if test in compiled.seconds]
    if others:
        yield False, others
    if not mutant.native:
        done = set(own)
    elif mutant.function:  # where they can execute it they have
        done = set(baseline.seconds)
    left = {test: seconds for test, seconds in compiled.seconds.items() if test not in done}
    near, others = rank.stages(left)
    if done and not mutant.native:
        hidden = _starting_processes(tree)
        others = [test for test in others if test.partition("::")[0] in hidden]
    for tests in filter(None, (near, others)):
        yield False, tests


def _starting_processes(tree: Tree) -> set[str]:
    words = re.compile(r"\bsubprocess\b|from commands import .*\b(gne|running)\b|multiprocessing")
    paths = _test_files(tree.base)
    return {str(p.relative_to(tree.base)) for p in paths if words.search(p.read_text("utf-8"))}


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

    def nearest_first(
        self, tests: list[str], seconds: dict[str, float]
    ) -> tuple[list[str], list[str]]:
        """The quickest tests of the nearest files, few seconds of them, and then all others."""

        def key(test: str) -> tuple[float, float]:
            return -self._near.get(test.partition("::")[0], 0), seconds[test]

        order = sorted(tests, key=key)
        passed = accumulate(seconds[test] for test in order)
        count = sum(1 for each in passed if each <= FIRST)
        return order[:count], order[count:]

    def stages(self, seconds: dict[str, float]) -> tuple[list[str], list[str]]:
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
        return near, order[len(near) :]


def _test_files(base: Path) -> list[Path]:
    return [
        p for p in sorted((base / "tests").glob("test_*.py")) if not p.stem.startswith(LEFT_OUT)
    ]


def _next(tests: list[str], report: list) -> str:
    """The test that ran when the process ended."""
    done = {test for test, _, _ in report}
    return next((test for test in tests if test not in done), "the end")


def _pytest(
    tree: Path, folder: Path, tests: list[str], plain_limit: float, limit: float, more: list[str],
    lines: Path | None = None,
) -> tuple[list, str]:  # fmt: skip
    """Run tests; what each did, and how the process ended: passed, failed, hung, limit or other.

    With ``lines`` a file of coverage is made, which tells what each test has executed.
    """
    report, chosen = folder / "report.jsonl", folder / "tests.json"
    report.unlink(missing_ok=True)
    settings = environment(tree) | {"MUTATION_REPORT": str(report.resolve())}
    settings["PYTHONPATH"] += os.pathsep + str(Path(__file__).parent / "plugin")
    if plain_limit:
        settings |= {"NUMBA_DISABLE_JIT": "1", "MUTATION_LIMIT": str(plain_limit)}
    if lines:
        settings["MUTATION_COVERAGE"] = str(lines.resolve())
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
