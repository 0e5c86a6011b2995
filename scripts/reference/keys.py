"""The page docs/keys.md: every key that a scenario can have, as its tables declare it."""

import json
from collections.abc import Iterator
from pathlib import Path
from types import NoneType, UnionType
from typing import Annotated, Any, Literal, Union, get_args, get_origin

from pydantic.fields import FieldInfo

from gne_mj.controllers.table import DiscTable, EventTable, SwitchingTable
from gne_mj.registry import LOW_LEVEL, TIMES, Names, Registry
from gne_mj.scenario_tables import Scenario, SystemTable
from gne_mj.scenario_tables.interventions import InterventionTable, LinkTable, PushTable
from gne_mj.toml_table import Table, Unit

PAGE = Path(__file__).parents[2] / "docs" / "keys.md"
HEAD = """# All keys of a scenario

`scripts/keys` writes this page from the tables that read scenarios; what is changed here is lost.

What is not said to be given may be left out; where "left out" is the default, what then holds is
told beside it. The unit 1 is that of numbers without one, as weights and counts; "any" is any
finite number. *One or a list*: one number for all agents, or a list
with one for each; of actions with several entries also one list for all, or a list of lists. The
action's unit is the game's; the input's is N or N m for robots, else the action's per second.
`gne-mj run --set KEY=VALUE` changes any of these by its dotted name, in which `systems.NAME.` may
be left out: `barrier.rho=0.02`.
"""
TITLES = {"game": "`[systems.NAME.game]`", "agents": "`[systems.NAME.agents]`",
          "controller": "`[systems.NAME.controller]`: the law",
          "faults": "`[[systems.NAME.faults]]`, as many as there are"}  # fmt: skip
GRAPHS = """`graph` is `line`, `ring`, `star` or `complete` for any number of agents, `printed` or
`caption` for ten (the paper's, as its figure is drawn and as its caption says), or a list of edges:
`graph = [[1, 2], [2, 3]]`; or a table of a graph that [changes](networks.md).
A table without `information` is of full information.
"""


INTERVENTIONS = """What is [done while it runs](view.md#keep-it), each of changes, a push or a link:
`changes = {"barrier.rho" = 0.02}`, `push = {agent = 2, force = 5.0, duration = 0.2}`,
`link = {agents = [3, 4]}`.
"""


TIME = """In the place of any number of a game, those within lists and of `parameters` too
([moving problems](moving-problems.md)):
`reference_velocity = {type = "ramp", from = 3.0, to = 5.0, start = 1.0, rate = 0.5}`.
"""
LOW = """`input` of `type = "mjcf-robot"` may be the table of one of these
([what they do](robots.md#low-level-controllers)):
`input = {controller = "quadrotor", rotors = ["a", "b", "c", "d"]}`.
"""
TIMES_OF = {tag: TIMES[tag] for tag in sorted(TIMES) if TIMES[tag].__module__.startswith("gne_mj.")}


def page() -> str:
    """The whole text."""
    parts = [HEAD, "## The whole file\n", _rows(Scenario)]
    for name in ("simulation", "recording"):
        parts += [f"## `[{name}]`\n", _rows(_table_of(Scenario.model_fields[name]))]
    parts += ["## `[[interventions]]`\n", INTERVENTIONS, _rows(InterventionTable)]
    parts += ["`push` has\n", _rows(PushTable), "`link` has\n", _rows(LinkTable)]
    parts += ["## `[systems.NAME]`\n", _rows(SystemTable)]
    for name, field in SystemTable.model_fields.items():
        parts += [f"## {TITLES.get(name, f'`[systems.NAME.{name}]`')}\n"]
        registry = _registry(field)
        if registry is None:
            parts += [_rows(_table_of(field))]
            continue
        if name == "controller":
            parts += [GRAPHS]
            for tag, table in (("switching", SwitchingTable), ("disc", DiscTable)):
                parts += [f'`graph = {{type = "{tag}"}}` has\n', _rows(table)]
            parts += ['`communication = {type = "event"}` ([messages](messages.md)) has\n',
                      _rows(EventTable)]  # fmt: skip
        for tag, table in sorted(registry._tables.items()):
            if table.__module__.startswith("gne_mj."):  # and of no plug-in
                parts += [f'### `{registry.key} = "{tag}"`\n', _about(table), _rows(table)]
                parts += [text for key, inner in _inner(table)
                          for text in (f"`{key}` has\n", _rows(inner))]  # fmt: skip
    parts += ["## Low-level controllers\n", LOW]
    for tag, table in sorted(LOW_LEVEL._tables.items()):
        if table.__module__.startswith("gne_mj."):
            parts += [f'### `controller = "{tag}"`\n', _about(table), _rows(table)]
            parts += [text for key, inner in _inner(table)
                      for text in (f"`{key}` has\n", _rows(inner))]  # fmt: skip
    parts += ["## Functions of time\n", TIME]
    for tag, table in TIMES_OF.items():
        parts += [f'### `type = "{tag}"`\n', _about(table), _rows(table)]
    return "\n".join(parts)


def _about(table: type[Table]) -> str:
    first = (table.__doc__ or "").split("\n\n")[0]
    return " ".join(first.split()).rstrip(".").replace("``", "`") + ".\n"


def _rows(table: type[Table]) -> str:
    """The keys of a table, but the one that chooses it."""
    lines = ["| key | type | unit | default | range | |", "|---|---|---|---|---|---|"]
    for key, field in table.model_fields.items():
        chooses = key == LOW_LEVEL.key and get_origin(field.annotation) is Literal
        if chooses or key in ("type", "information"):
            continue
        unit = next((each for each in field.metadata if isinstance(each, Unit)), Unit(""))
        number = _is_number(field)
        measured, within = unit.name or "1" * number, unit.range or _range(field) or "any" * number
        cells = [f"`{key}`", _kind(field), measured, _default(field), within,
                 field.description or ""]  # fmt: skip
        lines.append("| " + " | ".join(cell.replace("|", "\\|") for cell in cells) + " |")
    return "\n".join(lines) + "\n" if len(lines) > 2 else "It has no keys of its own.\n"


def _is_number(field: FieldInfo) -> bool:
    """Whether a key has numbers, and no names that stand for them."""
    return "number" in _kind(field) and not _kind(field).startswith("`")


def _kind(field: FieldInfo) -> str:
    names = next((each for each in field.metadata if isinstance(each, Names)), None)
    return _choice(names) if names is not None else _words(field.annotation)


def _words(kind: Any) -> str:
    """A type, in the words of a scenario's author."""
    origin, inner = get_origin(kind), get_args(kind)
    if origin is Annotated:
        names = next((each for each in inner[1:] if isinstance(each, Names)), None)
        return _choice(names) if names is not None else _words(inner[0])
    if origin is Literal:
        return ", ".join(f"`{json.dumps(each)}`" for each in inner)
    if origin in (Union, UnionType):
        given = [each for each in inner if each is not NoneType]
        lists = [each for each in given if get_origin(each) is list]
        if float in given and lists:
            return "number, one or a list" + (" (of lists)" if len(lists) > 1 else "")
        return " or ".join(dict.fromkeys(_words(each) for each in given))
    if origin in (list, tuple):
        each = _words(inner[0])
        first = each.split(" of ")[0]
        return f"{'list' if origin is list else 'pair'} of {each.replace(first, f'{first}s', 1)}"
    if origin is dict or (isinstance(kind, type) and issubclass(kind, Table)):
        return "table"
    known = {float: "number", int: "whole number", str: "text", bool: "`true`, `false`"}
    return known.get(kind, "table")


def _choice(names: Names[Any]) -> str:
    return ", ".join(f"`{json.dumps(each.name)}`" for each in names)


def _default(field: FieldInfo) -> str:
    if field.is_required():
        return "must be given"
    value = field.default
    if value is None or isinstance(value, Table) or value in ({}, []):
        return "left out"
    return f"`{json.dumps(value)}`"


def _shown(limit: float) -> str:
    return f"{limit:g}" if isinstance(limit, float) else str(limit)


def _range(field: FieldInfo) -> str:
    words = {"gt": ">", "ge": ">=", "lt": "<", "le": "<="}
    found = [f"{sign} {_shown(getattr(each, name))}" for each in field.metadata
             for name, sign in words.items() if hasattr(each, name)]  # fmt: skip
    least = [f"at least {each.min_length}" for each in field.metadata
             if hasattr(each, "min_length")]  # fmt: skip
    return ", ".join(found + least)


def _registry(field: FieldInfo) -> Registry | None:
    """Which tables may stand there, or in the list there."""
    inner = get_args(field.annotation)
    items = get_args(inner[0]) if inner else ()
    return next((each for each in (*field.metadata, *items) if isinstance(each, Registry)), None)


def _table_of(field: FieldInfo) -> type[Table]:
    kinds = [field.annotation, *get_args(field.annotation)]
    return next(each for each in kinds if isinstance(each, type) and issubclass(each, Table))


def _inner(table: type[Table]) -> Iterator[tuple[str, type[Table]]]:
    """Tables in a table, such as a region; not those that have a name of their own."""
    for key, field in table.model_fields.items():
        for inner in dict.fromkeys(_tables(field.annotation)):
            if inner.model_fields and "type" not in inner.model_fields:
                yield key, inner


def _tables(kind: Any) -> Iterator[type[Table]]:
    if isinstance(kind, type) and issubclass(kind, Table):
        yield kind
    for inner in get_args(kind):
        yield from _tables(inner)


if __name__ == "__main__":
    PAGE.write_text(page(), encoding="utf-8")
