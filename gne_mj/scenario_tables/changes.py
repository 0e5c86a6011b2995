"""Tables changed by dotted keys and made a scenario again; values may be objects."""

import re
from collections.abc import Mapping
from typing import Any

from pydantic import ValidationError

from gne_mj.bounds import MOST_SYSTEMS, check_count, check_nesting
from gne_mj.changing_graph import ChangingGraph
from gne_mj.controllers import Law
from gne_mj.errors import InvalidInput, nearest
from gne_mj.expressions.build import ExpressionGame
from gne_mj.expressions.table import table_of
from gne_mj.game_model import Game
from gne_mj.graph import Graph
from gne_mj.loops.base import Present
from gne_mj.python_objects import PythonGame, keep
from gne_mj.scenario_tables.scenario import Scenario
from gne_mj.scenario_tables.system import SystemTable
from gne_mj.system import System
from gne_mj.toml_table import Table, union_tags

_TABLES = "tagged-union"  # pydantic's name of tables that a key chooses among
_STAYS = "it stays as it is while a simulation goes on; games, barriers and controllers may change"


def changed(scenario: Scenario, changes: Mapping[str, Any]) -> Scenario:
    """The same scenario with some values changed, see :func:`gne_mj.load_scenario`."""
    tables: dict[str, Any] = plain(scenario)
    change(tables, changes)
    return validated(tables)


def changed_systems(
    before: Scenario, after: Scenario, present: Mapping[str, Present]
) -> list[System]:
    """The systems that a changed scenario has otherwise, as they go on from where they are.

    Args:
        before, after: which may differ in games, barriers and laws' numbers.
        present: where each system is.

    Raises:
        InvalidInput: something else has changed.
    """
    check_stays(before, after)
    return [
        table.build(name, after.simulation, present[name])
        for name, table in after.systems.items()
        if table != before.systems[name]
    ]


def check_stays(before: Scenario, after: Scenario) -> None:
    """Refuse changes of what stays as it is while a simulation goes on."""
    for name in Scenario.model_fields:
        if name != "systems" and getattr(before, name) != getattr(after, name):
            raise InvalidInput(name, "another value", _STAYS)
    for name, table in after.systems.items():
        if table.membership is not None and table != before.systems[name]:
            expected = "where agents leave and join numbers stay as they are"
            raise InvalidInput(f"systems.{name}.membership", "given", expected)
        for part in SystemTable.model_fields:
            if part not in ("game", "barrier", "controller") and (
                getattr(before.systems[name], part) != getattr(table, part)
            ):
                raise InvalidInput(f"systems.{name}.{part}", "another value", _STAYS)


def whole(scenario: Scenario, changes: Mapping[str, Any]) -> dict[str, Any]:
    """Changes as JSON has them, by keys from which nothing is left out."""
    tables: dict[str, Any] = plain(scenario)
    return {".".join(full_key(tables, key, each)): plain(each) for key, each in changes.items()}


def change(tables: dict[str, Any], changes: Mapping[str, Any]) -> None:
    """Put values at dotted keys."""
    for key, given in changes.items():
        check_nesting(key, given)
        value = plain(given)
        check_texts(key, value)
        _change_one(tables, key, value)


def _change_one(tables: dict[str, Any], key: str, value: Any) -> None:
    parts = full_key(tables, key, value)
    table = tables
    for part in parts[:-1]:
        table = table.setdefault(part, {})
        if not isinstance(table, dict):
            raise InvalidInput(key, value, f"'{part}' is a value, not a table")
    table[parts[-1]] = value


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


def plain(value: Any) -> Any:
    """A value as scenario files have it: objects and functions become tables, arrays lists."""
    if isinstance(value, Table):
        return value.model_dump(mode="json", exclude_none=True)
    if isinstance(value, Game):
        return plain(_game_table(value))
    if isinstance(value, Law):
        return {"information": "python", "object": keep(value, type(value).__name__)}
    if isinstance(value, ChangingGraph):
        return plain(value.table)
    if isinstance(value, Graph):
        return [[i + 1, j + 1] for i, j in value.edges]  # a name would fit any number of agents
    if isinstance(value, Mapping):
        return {str(key): plain(each) for key, each in value.items()}
    if isinstance(value, list | tuple):
        return [plain(each) for each in value]
    if callable(value):
        name = getattr(value, "__name__", "function")
        return {"type": "python", "object": keep(value, name, value)}
    return value.tolist() if hasattr(value, "tolist") else value


def _game_table(game: Game) -> Table:
    if isinstance(game, ExpressionGame):
        return table_of(game)
    return PythonGame(type="python", object=keep(game, game.name))


def check_texts(key: str, value: Any) -> None:
    """Refuse what is not UTF-8, as a file's name can be: results keep the scenario as text."""
    if isinstance(value, Mapping):
        for name, entry in value.items():
            check_texts(str(name) if key == "source" else f"{key}.{name}", entry)
    elif isinstance(value, list):
        for entry in value:
            check_texts(key, entry)
    else:
        for text in (key, str(value)):
            if text != text.encode(errors="ignore").decode():
                raise InvalidInput(key, value, "it must be UTF-8 text, names of files too")


def validated(tables: dict[str, Any]) -> Scenario:
    """The scenario of tables.

    Raises:
        InvalidInput: names the key, the value and what would be right.
    """
    systems = tables.get("systems")
    if isinstance(systems, Mapping):
        check_count("systems", len(systems), MOST_SYSTEMS, "their number")
    check_texts("source", tables)
    try:
        scenario = Scenario.model_validate(tables)
    except ValidationError as error:
        raise complaint(error) from None
    scenario.clock()  # what does not fit together is told before anything is built
    return scenario


def _is_table(part: Any) -> bool:
    """Whether a part of a place in pydantic's words is a choice that is a table."""
    return str(part).startswith(_TABLES) or str(part).endswith("Table")


def complaint(error: ValidationError) -> InvalidInput:
    """The first of pydantic's complaints as one sentence."""
    details = error.errors()
    detail = details[0]
    if not detail["loc"]:
        return InvalidInput("source", list(detail["input"]), detail["msg"])
    chosen = detail["loc"][-1]
    if (chosen in ("float", "str") or _is_table(chosen)) and isinstance(detail["input"], list):
        # of "one number (or table), a list or a list of lists" the user meant what goes deepest
        same = [d for d in details if d["loc"][: len(detail["loc"]) - 1] == detail["loc"][:-1]]
        detail = max(same[1:], key=lambda d: len(d["loc"]))
    while isinstance(detail["input"], Mapping):  # so it is the tables among the choices that count
        here = len(detail["loc"]) - 1  # where the choice is
        deeper = [
            d for d in details
            if d["loc"][:here] == detail["loc"][:here] and any(map(_is_table, d["loc"][here:]))
        ]  # fmt: skip
        if not deeper or deeper[0] is detail:
            break
        detail = deeper[0]
    tags = union_tags() | {"float", "str", "list", "literal", _TABLES}
    where = [
        str(part)
        for depth, part in enumerate(detail["loc"])
        # a system's name, and what an intervention does, may be called as a tag is
        if detail["loc"][:depth] == ("systems",)
        or (depth == 2 and detail["loc"][0] == "interventions")
        or (str(part).split("[")[0] not in tags and not _is_table(part))
    ]
    value = detail["input"]
    context = detail.get("ctx", {})
    kind = detail["type"]
    if kind == "time_function":
        return InvalidInput(
            ".".join([*where, str(context["key"])]), context["value"], context["expected"]
        )
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
