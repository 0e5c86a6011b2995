"""Scenario files: TOML in, validated objects out. A scenario defines a run, and holds no code."""

import json
import re
import tomllib
from collections.abc import Mapping
from importlib.resources import files
from pathlib import Path
from typing import Any

from pydantic import ValidationError

from gne_mj.bounds import MOST_SYSTEMS, check_count, check_nesting, check_text, read_file
from gne_mj.errors import InvalidInput, nearest
from gne_mj.scenario_tables import Scenario, SystemTable, union_tags
from gne_mj.trajectory import Trajectory

__all__ = ["Scenario", "full_key", "load_scenario", "parse_value", "run", "shipped"]


def shipped() -> dict[str, str]:
    """The shipped scenarios: name to TOML text."""
    folder = files("gne_mj.scenarios")
    return {
        entry.name.removesuffix(".toml"): entry.read_text(encoding="utf-8")
        for entry in sorted(folder.iterdir(), key=lambda entry: entry.name)
        if entry.name.endswith(".toml")
    }


def load_scenario(
    source: str | Path | Mapping[str, Any], changes: Mapping[str, Any] | None = None
) -> Scenario:
    """A scenario from a shipped name, a TOML file or a mapping, with some values changed.

    Args:
        source: name of a shipped scenario, path of a file ending in .toml, or the tables.
        changes: dotted keys to new values, e.g. {"systems.robots.barrier.rho": 0.2}; "systems."
            may be left out, and the system's name too if there is only one.

    Raises:
        InvalidInput: names the key, the value and what would be right.
    """
    if isinstance(source, Mapping):
        check_nesting("source", source)
        tables = json.loads(json.dumps(source))
    else:
        tables = _read(source)
    for key, value in (changes or {}).items():
        check_nesting(key, value)
        _check_text(key, value)
        _change(tables, key, value)
    systems = tables.get("systems")
    if isinstance(systems, Mapping):
        check_count("systems", len(systems), MOST_SYSTEMS, "their number")
    _check_text("source", tables)
    try:
        scenario = Scenario.model_validate(tables)
    except ValidationError as error:
        raise _first(error) from None
    scenario.clock()  # what does not fit together is told before anything is built
    return scenario


def run(
    source: str | Path | Mapping[str, Any], changes: Mapping[str, Any] | None = None
) -> Trajectory:
    """Load a scenario, run it to its end and return the trajectory; see :func:`load_scenario`."""
    return load_scenario(source, changes).simulation_object().run()


def parse_value(text: str) -> Any:
    """What ``--set key=TEXT`` means: a TOML value, else the text itself."""
    try:
        return tomllib.loads(f"value = {text}")["value"]
    except (ValueError, RecursionError):
        return text


def _read(source: str | Path) -> dict[str, Any]:
    names = shipped()
    if str(source) in names:
        return tomllib.loads(names[str(source)])
    path = Path(source)
    if path.suffix != ".toml":
        raise InvalidInput(
            "source",
            str(source),
            f"it must name a file ending in .toml; {nearest(str(source), names)}",
        )
    try:
        contents = read_file(path)
        check_text("source", contents)
        tables = tomllib.loads(contents.decode("utf-8"))
    except (OSError, UnicodeDecodeError) as error:
        reason = getattr(error, "strerror", None) or "it is not UTF-8 text"
        raise InvalidInput("source", str(source), f"it cannot be read: {reason}") from None
    except RecursionError:
        raise InvalidInput("source", str(source), "it is nested too deeply") from None
    except ValueError as error:  # TOMLDecodeError, or an integer of thousands of digits
        raise InvalidInput("source", str(source), f"it is not valid TOML: {error}") from None
    check_nesting("source", tables)
    return _resolve(tables, path.parent)


def _resolve(tables: dict[str, Any], folder: Path) -> dict[str, Any]:
    """Make the names of a user's own files, which are relative to the scenario's, absolute."""
    systems = tables.get("systems")
    for system in systems.values() if isinstance(systems, dict) else ():
        for table in system.values() if isinstance(system, dict) else ():
            given = table.get("file") if isinstance(table, dict) else None
            if isinstance(given, str):
                table["file"] = _absolute(folder, given)
            elif isinstance(given, list):
                table["file"] = [_absolute(folder, str(name)) for name in given]
    return tables


def _check_text(key: str, value: Any) -> None:
    """Refuse what is not UTF-8, as a file's name can be: results keep the scenario as text."""
    if isinstance(value, Mapping):
        for name, entry in value.items():
            _check_text(str(name) if key == "source" else f"{key}.{name}", entry)
    elif isinstance(value, list):
        for entry in value:
            _check_text(key, entry)
    else:
        for text in (key, str(value)):
            if text != text.encode(errors="ignore").decode():
                raise InvalidInput(key, value, "it must be UTF-8 text, names of files too")


def _absolute(folder: Path, name: str) -> str:
    try:
        return str((folder / name).resolve())
    except (ValueError, OSError):  # no file can be called so: whoever reads it will say so
        return name


def full_key(tables: Mapping[str, Any], key: str, value: Any = None) -> list[str]:
    """The parts of a dotted key, with "systems" and the system's name where they were left out.

    Args:
        tables: of the scenario.
        key: as :func:`load_scenario` takes it.
        value: what was given for it, for messages.

    Raises:
        InvalidInput: there is no such system or table.
    """
    systems = tables.get("systems")
    if not isinstance(systems, dict):
        systems = {}
    parts = key.split(".")
    if parts[0] in systems and parts[0] not in Scenario.model_fields:
        parts.insert(0, "systems")
    elif parts[0] in SystemTable.model_fields:
        if len(systems) != 1:
            raise InvalidInput(
                key, value, f"it must begin with one of the systems: {', '.join(systems)}"
            )
        parts = ["systems", next(iter(systems)), *parts]
    elif parts[0] == "systems" and len(parts) > 1 and parts[1] not in systems:
        raise InvalidInput(key, value, f"there is no such system; {nearest(parts[1], systems)}")
    elif parts[0] not in Scenario.model_fields:
        known = [*Scenario.model_fields, *SystemTable.model_fields, *systems]
        raise InvalidInput(key, value, f"there is no such key; {nearest(parts[0], known)}")
    return parts


def _change(tables: dict[str, Any], key: str, value: Any) -> None:
    parts = full_key(tables, key, value)
    table = tables
    for part in parts[:-1]:
        table = table.setdefault(part, {})
        if not isinstance(table, dict):
            raise InvalidInput(key, value, f"'{part}' is a value, not a table")
    table[parts[-1]] = value


def _first(error: ValidationError) -> InvalidInput:
    """The first of pydantic's complaints as one sentence."""
    details = error.errors()
    detail = details[0]
    if not detail["loc"]:
        return InvalidInput("source", list(detail["input"]), detail["msg"])
    if detail["loc"][-1] in ("float", "str") and isinstance(detail["input"], list):
        # of "one number, a list of them or a list of lists" the user meant what goes deepest
        same = [d for d in details if d["loc"][: len(detail["loc"]) - 1] == detail["loc"][:-1]]
        detail = max(same[1:], key=lambda d: len(d["loc"]))
    tags = union_tags() | {"float", "str", "list", "literal"}
    where = [
        str(part)
        for depth, part in enumerate(detail["loc"])
        # at this depth stands a system's name, which may be that of a tag
        if depth == 1 or str(part).split("[")[0] not in tags
    ]
    value = detail["input"]
    context = detail.get("ctx", {})
    kind = detail["type"]
    if kind == "unknown_key":
        return InvalidInput(
            ".".join([*where, str(context["key"])]),
            value[context["key"]],
            f"there is no such key; {context['hint']}",
        )
    if kind == "missing":
        return InvalidInput(".".join(where), None, "this key must be given")
    if kind == "union_tag_not_found":
        field = context["discriminator"].strip("'")
        return InvalidInput(".".join([*where, field]), None, "this key must be given")
    if kind == "union_tag_invalid":
        field = context["discriminator"].strip("'")
        names = [name.strip(" '") for name in context["expected_tags"].split(",")]
        return InvalidInput(
            ".".join([*where, field]), context["tag"], nearest(str(context["tag"]), names)
        )
    if kind == "literal_error":
        names = re.findall(r"'([^']*)'", context["expected"])
        return InvalidInput(".".join(where), value, nearest(str(value), names))
    if kind in ("model_type", "dict_type", "model_attributes_type"):
        return InvalidInput(".".join(where), value, "it must be a table")
    message = detail["msg"][0].lower() + detail["msg"][1:]
    return InvalidInput(".".join(where), value, message.replace("input should", "it should"))
