"""Prints docs/licences.md: the licences of what is shipped and of what it depends on."""

import json
import re
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).parents[2]
HEAD = """# Licences

gne_mj is under Apache-2.0. The page in the browser has uPlot in it, which is MIT
(`gne_mj/viewer/page/uPlot-LICENSE.txt`). Nothing else of others is shipped.

What is installed beside it keeps its own licence, here as its metadata say it. `scripts/release`
writes this page, and a bill of materials (CycloneDX) to `dist`.
"""


def locked(name: str) -> set[str]:
    """Packages that a lock names."""
    text = (ROOT / "locks" / f"{name}.txt").read_text(encoding="utf-8")
    return set(re.findall(r"(?m)^([\w.-]+)==", text))


def licences() -> dict[str, str]:
    """Of what is installed, by normalised names."""
    printed = subprocess.run(
        [Path(sys.executable).with_name("pip-licenses"), "--format=json", "--with-system"],
        check=True, capture_output=True, text=True,
    ).stdout  # fmt: skip
    return {
        re.sub(r"[-_.]+", "-", each["Name"]).lower(): " ".join(each["License"].split())
        for each in json.loads(printed)
    }


def table(names: set[str], known: dict[str, str]) -> list[str]:
    """Rows of those that are installed on this system."""
    return [
        "| package | licence |", "|---|---|",
        *(f"| {name} | {known[name][:100]} |" for name in sorted(names) if name in known),
    ]  # fmt: skip


def main() -> None:
    """Print the page."""
    known, demo = licences(), locked("demo")
    print(HEAD)
    print("## What `scripts/demo` installs\n", *table(demo, known), sep="\n")
    tools = (locked("test") | locked("docs")) - demo
    print("\n## What tests, the site and other extras add\n", *table(tools, known), sep="\n")


if __name__ == "__main__":
    main()
