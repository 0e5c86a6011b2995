"""The gallery's page, of what scripts/site/gallery.py has made."""

import tomllib
from pathlib import Path

from gne_mj.scenario import shipped

MADE = Path(__file__).parents[2] / "build" / "gallery"


def gallery_page() -> str:
    """What stands for the mark ``<!-- gallery -->``."""
    return "\n".join(_entry(name) for name in _made())


def pictures() -> list[Path]:
    """Files that the page shows."""
    return [file for name in _made() for file in sorted((MADE / name).iterdir())
            if file.suffix in (".png", ".html")]  # fmt: skip


def address(file: Path) -> str:
    """Of such a file, on the site."""
    return f"gallery/{file.parent.name}/{file.name}"


def _made() -> list[str]:
    """What is there so far; that it is all is looked at by check.py."""
    return [name for name in shipped() if (MADE / name).is_dir()]


def _entry(name: str) -> str:
    folder = MADE / name
    figures = [each for each in sorted(folder.glob("*.png")) if "constraints" not in each.name]
    images = "\n".join(f"![{name}: {each.stem}]({address(each)})" for each in figures)
    return f"""## {name}

{_description(name)}

```sh
gne-mj run {name}
```

{images}

<iframe class="replay" title="{name}, to play" loading="lazy"
src="gallery/{name}/replay.html"></iframe>

??? note "What the run says"

{_indented(folder / "run.txt")}

??? note "What the theory says"

{_indented(folder / "certificate.txt")}
"""


def _description(name: str) -> str:
    return str(tomllib.loads(shipped()[name]).get("description", ""))


def _indented(file: Path) -> str:
    lines = ["```text", *file.read_text(encoding="utf-8").rstrip().splitlines(), "```"]
    return "\n".join(f"    {line}".rstrip() for line in lines)
