"""Runs what the documents show, each page from top to bottom in a folder of its own.

    python scripts/site/code_blocks.py [PAGE...]     # README.md, docs/view.md, ...; else all

Commands and Python are executed, in the order of the page and with what earlier blocks have made. A
block with a name (``title="..."``, or a first line ``# name.toml``) is written to that file; other
TOML must have keys that scenarios know. A block of no language is what the block before it printed.
code_blocks.toml, beside this file, has all exceptions: what is run shorter than it is shown, and
what is not run, each with the reason. One that fits no block is an error.
"""

import ast
import contextlib
import io
import os
import re
import shutil
import signal
import subprocess
import sys
import tempfile
import time
import tomllib
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path
from typing import Any

ROOT = Path(__file__).parents[2]
EXCEPTIONS = Path(__file__).with_suffix(".toml")
_FENCE = re.compile(r"(?ms)^( *)```(\w*)(?: title=\"([^\"]+)\")?\n(.*?)^\1```$")
_SERVER = re.compile(r"^\s*\S*gne-mj (view (?!.*--html)|run .*--view)")


@dataclass(frozen=True)
class Block:
    """A block of code of a page.

    Attributes:
        page: its path in the repository.
        language: as the fence names it; empty for output.
        name: of the file that it is, if it has one.
        text: what it shows.
    """

    page: str
    language: str
    name: str
    text: str

    @property
    def kind(self) -> str:
        """What is done with it: "write", "run", "keys", "compare" or, where nothing can, ""."""
        if self.name:
            return "write"
        known = {"sh": "run", "python": "run", "toml": "keys", "": "compare"}
        return known.get(self.language, "")


def pages() -> list[str]:
    """All documents."""
    found = [ROOT / "README.md", *ROOT.glob("docs/**/*.md"), *ROOT.glob("examples/*/*.md")]
    return sorted(str(page.relative_to(ROOT)) for page in found)


def blocks_of(page: str) -> list[Block]:
    """The blocks of a page, as they stand."""
    found = []
    for spaces, language, title, text in _FENCE.findall((ROOT / page).read_text("utf-8")):
        text = re.sub(rf"(?m)^{spaces}", "", text)
        named = re.match(r"# ([\w.-]+\.toml)\n", text)
        found.append(Block(page, language, title or (named[1] if named else ""), text))
    return found


def exceptions() -> dict[str, list[dict[str, str]]]:
    """Tables ``shorter``, ``first``, ``told_by`` and ``not_run`` of code_blocks.toml."""
    return tomllib.loads(EXCEPTIONS.read_text(encoding="utf-8"))


def left_out(block: Block) -> str | None:
    """Why a block is not run; None if it is."""
    for each in exceptions()["not_run"]:
        if each["page"] == block.page and each["begins"] in block.text.splitlines()[0]:
            return each["reason"]
    return None


def shortened(block: Block) -> Block:
    """As it is run."""
    text = block.text
    for each in exceptions()["shorter"]:
        if each["page"] == block.page:
            text = text.replace(each["text"], each["by"])
    return Block(block.page, block.language, block.name, text)


def stale() -> Iterator[str]:
    """Exceptions that fit no block."""
    everything = [block for page in pages() for block in blocks_of(page)]
    for each in exceptions()["shorter"]:
        if not any(each["page"] == b.page and each["text"] in b.text for b in everything):
            yield f"{each['page']}: no block has {each['text']!r}"
    for each in exceptions()["not_run"] + exceptions()["told_by"]:
        here = [b.text.splitlines()[0] for b in everything if b.page == each["page"]]
        if not any(each["begins"] in first for first in here):
            yield f"{each['page']}: no block begins with {each['begins']!r}"


class Page:
    """A page that is being run, in the current folder."""

    def __init__(self, page: str) -> None:
        self.page, self.printed = page, ""
        self.names: dict[str, Any] = {"__name__": "__main__"}

    def run(self) -> None:
        """All of it; fails at the first block that does."""
        for each in exceptions()["first"]:
            if each["page"] == self.page:
                self.shell(each["run"])
        for block in blocks_of(self.page):
            if left_out(block) is not None:
                continue
            block = shortened(block)
            begun = time.perf_counter()
            if block.kind == "write":
                Path(block.name).write_text(block.text, encoding="utf-8")
            elif block.kind == "keys":
                check_keys(block.text)
            elif block.kind == "compare":
                self.told(block)
                self.compare(block.text)
            elif block.language == "sh":
                self.shell(block.text)
            elif block.language == "python":
                self.python(block.text)
            else:
                raise AssertionError(f"nothing is known to do with a block of {block.language}")
            print(f"  {time.perf_counter() - begun:5.1f} s  {block.text.splitlines()[0][:70]}")

    def python(self, text: str) -> None:
        """As a notebook's cell."""
        out = io.StringIO()
        with contextlib.redirect_stdout(out):
            exec(compile(ast.parse(text), self.page, "exec"), self.names)
        self.printed = out.getvalue()

    def shell(self, text: str) -> None:
        """By bash; commands that serve a page are interrupted once they do."""
        self.printed, waiting = "", []
        for line in [*re.findall(r"(?m)^(?:.*\\\n)*.*\n", f"{text}\n"), None]:
            if line is not None and not _SERVER.match(line):
                waiting.append(line)
                continue
            if waiting:
                self.bash("".join(waiting))
            waiting = []
            if line is not None:
                serve(line)

    def bash(self, text: str) -> None:
        """A script, whose first failure ends it."""
        done = subprocess.run(
            ["bash", "-e", "-c", text], capture_output=True, text=True, timeout=1200, check=False
        )
        self.printed += done.stdout + done.stderr
        assert done.returncode == 0, f"{text}\n{self.printed}"

    def told(self, block: Block) -> None:
        """What prints a block, where no block of the page does."""
        for each in exceptions()["told_by"]:
            if each["page"] == self.page and each["begins"] in block.text:
                self.bash(f"({each['run'].strip()}) || true")

    def compare(self, shown: str) -> None:
        """What is shown has to be among what was printed, line by line."""
        there = [" ".join(line.split()) for line in self.printed.splitlines()]
        missing = [line for line in shown.splitlines() if " ".join(line.split()) not in there]
        assert not missing, f"{missing} is not among\n{self.printed}"


def serve(line: str) -> None:
    """A command that ends by Ctrl-C; it has to have named its page."""
    process = subprocess.Popen(
        ["bash", "-c", f"exec {line.strip()}"], stdout=subprocess.PIPE, stderr=subprocess.STDOUT,
        text=True, start_new_session=True, env={**os.environ, "PYTHONUNBUFFERED": "1"},
    )  # fmt: skip
    told = ""
    assert process.stdout is not None
    for said in process.stdout:
        told += said
        if "http://127.0.0.1" in said:
            break
    else:
        raise AssertionError(f"{line}\n{told}")
    process.send_signal(signal.SIGINT)
    process.communicate(timeout=600)


def check_keys(text: str) -> None:
    """All keys of a part of a scenario must be known; what it leaves out is velocity-sync's."""
    from gne_mj.errors import InvalidInput
    from gne_mj.scenario import load_scenario

    given = tomllib.loads(text)
    base = load_scenario("velocity-sync").model_dump(exclude_none=True)
    parts = next(iter(base["systems"].values()))
    systems = {}
    for name, tables in given.get("systems", {}).items():
        systems[name] = dict(parts)
        for part, table in tables.items():
            whole = isinstance(table, list) or {"type", "information"} & set(table)
            systems[name][part] = table if whole else {**parts.get(part, {}), **table}
    found = ""
    try:
        load_scenario({**base, **given, "systems": systems or base["systems"]})
    except InvalidInput as error:
        found = str(error)
    if "no such key" in found:
        raise AssertionError(found)


def run_here(page: str) -> None:
    """A page in the current folder, whose exit status tells."""
    try:
        Page(page).run()
    except Exception as error:
        print(f"{page}: {type(error).__name__}: {error}")
        sys.exit(1)


def run_page(page: str) -> tuple[str, int, str]:
    """A page in a folder and process of its own."""
    with tempfile.TemporaryDirectory() as folder:
        shutil.copytree(ROOT / "examples", Path(folder, "examples"))
        Path(folder, ".venv").symlink_to(sys.prefix)
        kept = {name: value for name, value in os.environ.items() if name != "DISPLAY"}
        environment = {**kept, "MPLBACKEND": "agg", "PYTHONWARNINGS": "ignore",
                       "PATH": f"{sys.prefix}/bin:{os.environ['PATH']}"}  # fmt: skip
        done = subprocess.run(
            [sys.executable, __file__, "--here", page], cwd=folder, env=environment, check=False,
            stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True,
        )  # fmt: skip
    return page, done.returncode, done.stdout


def main(chosen: list[str]) -> int:
    """Run pages beside each other; 0 if all went well."""
    wrong = list(stale())
    every = [block for page in pages() for block in blocks_of(page)]
    with_code = sorted({b.page for b in every if left_out(b) is None})
    with ThreadPoolExecutor(os.cpu_count()) as pool:
        for page, code, told in pool.map(run_page, chosen or with_code):
            print(f"{page}\n{told}", end="", flush=True)
            wrong += [page] * bool(code)
    skipped = sum(left_out(block) is not None for block in every)
    print(f"{len(every)} blocks of code: {len(every) - skipped} run, {skipped} not")
    print("\n".join(wrong), file=sys.stderr)
    return bool(wrong)


if __name__ == "__main__":
    if sys.argv[1:2] == ["--here"]:
        run_here(sys.argv[2])
    else:
        sys.exit(main(sys.argv[1:]))
