"""Tables as the text of a TOML file."""

import json
import re
from collections.abc import Iterator, Mapping
from typing import Any

_BARE = re.compile(r"[A-Za-z0-9_-]+")


def toml_text(tables: Mapping[str, Any]) -> str:
    """A file that tomllib reads as these tables.

    Args:
        tables: of texts, finite numbers, truth values, lists and tables, without None.
    """
    return "\n".join(_lines(tables, "")).strip() + "\n"


def _lines(table: Mapping[str, Any], name: str) -> Iterator[str]:
    """What stands below a header: values first, then tables with headers of their own."""
    below = {key: each for key, each in table.items() if _has_header(each)}
    for key, each in table.items():
        if key not in below:
            yield f"{_key(key)} = {_value(each)}"
    for key, each in below.items():
        inner = f"{name}.{_key(key)}".removeprefix(".")
        if isinstance(each, list):
            for entry in each:
                yield from ("", f"[[{inner}]]")
                yield from (f"{_key(name)} = {_value(value)}" for name, value in entry.items())
        elif any(not _has_header(value) for value in each.values()) or not each:
            yield from ("", f"[{inner}]", *_lines(each, inner))
        else:
            yield from _lines(each, inner)


def _has_header(value: Any) -> bool:
    """Whether a value is a table, or a list of tables."""
    if isinstance(value, list):
        return bool(value) and all(isinstance(each, Mapping) for each in value)
    return isinstance(value, Mapping)


def _key(key: str) -> str:
    return key if _BARE.fullmatch(key) else _text(key)


def _text(text: str) -> str:
    return json.dumps(text, ensure_ascii=False).replace("\x7f", "\\u007f")


def _value(value: Any) -> str:
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, str):
        return _text(value)
    if isinstance(value, list):
        return f"[{', '.join(map(_value, value))}]"
    if isinstance(value, Mapping):
        inner = ", ".join(f"{_key(key)} = {_value(each)}" for key, each in value.items())
        return f"{{{inner}}}"
    return repr(value)
