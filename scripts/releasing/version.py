"""Prints when the version of pyproject.toml was released, in seconds since 1970, for builds to use.

Fails where pyproject.toml, CITATION.cff and CHANGELOG.md do not agree on the version and its date.
"""

import re
import sys
import tomllib
from datetime import UTC, datetime
from pathlib import Path

ROOT = Path(__file__).parents[2]


def released() -> dict[str, tuple[str, str]]:
    """Version and date as each file has them."""
    version = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["project"]["version"]
    log = re.search(r"(?m)^## \[([\d.]+)\] - ([\d-]+)$", (ROOT / "CHANGELOG.md").read_text("utf-8"))
    citation = (ROOT / "CITATION.cff").read_text("utf-8")
    cited = re.search(r"(?m)^version: (\S+)\ndate-released: (\S+)$", citation)
    assert log is not None
    assert cited is not None
    return {"pyproject.toml": (version, log[2]), "CHANGELOG.md": (log[1], log[2]),
            "CITATION.cff": (cited[1], cited[2])}  # fmt: skip


def main() -> None:
    """Print the time, or say what differs."""
    found = released()
    if len(set(found.values())) != 1:
        sys.exit(
            "\n".join(f"{file}: {version} of {date}" for file, (version, date) in found.items())
        )
    day = datetime.fromisoformat(found["CHANGELOG.md"][1]).replace(tzinfo=UTC)
    print(int(day.timestamp()))


if __name__ == "__main__":
    main()
