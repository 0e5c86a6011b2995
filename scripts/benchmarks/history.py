"""What was measured, on which machine and of which versions: its table, and its file."""

import json
import os
import platform
import re
from dataclasses import asdict, dataclass, replace
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

PACKAGES = (
    "gne-mj", "mujoco", "numba", "numpy", "scipy", "nashopt", "jax", "mujoco-mjx", "diffrax",
    "cbfpy", "elastiqp", "qpax",
)  # fmt: skip
COLUMNS = ("what", "ours", "other", "ratio", "target")
HEAD = ["| what | ours | other | ratio | target |", "|---|---|---|---|---|"]


@dataclass(frozen=True)
class Measured:
    """Rows and where they are from.

    Attributes:
        machine: processor model and cores, nothing else of it.
        versions: of Python and of packages.
        turns: of which the medians are.
        rows: as :func:`turns.row` makes them, each with its "group".
    """

    machine: str
    versions: dict[str, str]
    turns: int
    rows: list[dict[str, str]]

    @classmethod
    def here(cls, turns: int) -> "Measured":
        """Nothing yet, on this machine."""
        return cls(_machine(), _versions(), turns, [])

    @property
    def name(self) -> str:
        """Of its file: machine and version of this package."""
        words = re.sub(r"[^a-z0-9.]+", "-", f"{self.machine} {self.versions['gne-mj']}".lower())
        return words.strip("-")

    def with_rows(self, group: str, rows: list[dict[str, str]]) -> "Measured":
        """With these in place of the group's, or behind the others."""
        new = [{**row, "group": group} for row in rows]
        at = next((k for k, row in enumerate(self.rows) if row["group"] == group), len(self.rows))
        others = [row for row in self.rows if row["group"] != group]
        return replace(self, rows=[*others[:at], *new, *others[at:]])


def table(measured: Measured) -> str:
    """In Markdown, with machine and versions named."""
    return "\n".join(["# Benchmarks", "", _about(measured), "", *_lines(measured)]) + "\n"


def write(measured: Measured, path: Path) -> None:
    """The table, and the same as JSON beside it."""
    path.write_text(table(measured), encoding="utf-8")
    _write_json(measured, path.with_suffix(".json"))


def read(path: Path) -> Measured:
    """What :func:`write` or :func:`keep` wrote as JSON."""
    content: dict[str, Any] = json.loads(path.read_text(encoding="utf-8"))
    return Measured(**content)


def keep(measured: Measured, docs: Path) -> None:
    """Put these rows in place of the same groups' of this machine and version, and on the page.

    Peers that no group of these asked for keep the versions that their rows were measured with.
    """
    path = docs / "benchmarks" / f"{measured.name}.json"
    path.parent.mkdir(exist_ok=True)
    whole = read(path) if path.exists() else replace(measured, rows=[])
    versions = {**whole.versions, **measured.versions}
    whole = replace(whole, versions=versions, turns=measured.turns)
    for group in dict.fromkeys(row["group"] for row in measured.rows):
        whole = whole.with_rows(group, [row for row in measured.rows if row["group"] == group])
    _write_json(whole, path)
    page = docs / "benchmarks.md"
    page.write_text(on_page(whole, page.read_text(encoding="utf-8")), encoding="utf-8")


def on_page(measured: Measured, page: str) -> str:
    """A page with these rows in place of its table, and of the paragraph before that."""
    lines = page.split("\n")
    first = lines.index(HEAD[0])
    last = next(k for k in range(first, len(lines)) if not lines[k].startswith("|"))
    before = next(k for k in range(first - 2, -1, -1) if not lines[k])
    return "\n".join([*lines[: before + 1], _about(measured), "", *_lines(measured), *lines[last:]])


def _write_json(measured: Measured, path: Path) -> None:
    path.write_text(json.dumps(asdict(measured), indent=1) + "\n", encoding="utf-8")


def _about(measured: Measured) -> str:
    versions = ", ".join(f"{name} {number}" for name, number in measured.versions.items())
    return (
        f"Medians of {measured.turns} turns in one process, compiled and warm, one thread where no"
        f" cores are named. Machine: {measured.machine}; {versions}. Repeat with"
        " `scripts/benchmark`."
    )


def _lines(measured: Measured) -> list[str]:
    return [*HEAD, *(f"| {' | '.join(row[name] for name in COLUMNS)} |" for row in measured.rows)]


def _machine() -> str:
    cores = len(os.sched_getaffinity(0))
    return f"{_processor()}, {cores} core{'s' * (cores > 1)}"


def _processor() -> str:
    try:
        for line in Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines():
            if line.startswith("model name"):
                return line.split(":", 1)[1].strip()
    except OSError:
        pass
    return platform.processor() or platform.machine()


def _versions() -> dict[str, str]:
    found = {"Python": platform.python_version()}
    for name in PACKAGES:
        try:
            found[name] = version(name)
        except PackageNotFoundError:  # a peer that no group of these asked for
            continue
    return found
