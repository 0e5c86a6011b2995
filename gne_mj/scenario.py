"""Scenario files: TOML in, validated objects out. A scenario defines a run, and holds no code."""

from __future__ import annotations

import json
import re
import tomllib
from collections.abc import Mapping, Sequence
from importlib.resources import files
from pathlib import Path
from typing import Any

from gne_mj.bounds import check_nesting, check_text, read_file
from gne_mj.errors import InvalidInput, nearest
from gne_mj.game_model import Game
from gne_mj.games.table import functions_in
from gne_mj.plants.mjcf_source import FILES, is_named
from gne_mj.scenario_tables import Scenario, SystemTable
from gne_mj.scenario_tables.changes import change, complaint, full_key, plain, validated
from gne_mj.scenario_tables.interventions import tables_of
from gne_mj.trajectory import Trajectory

__all__ = [
    "Scenario",
    "Source",
    "as_done",
    "complaint",
    "full_key",
    "load_scenario",
    "parse_value",
    "plain",
    "run",
    "scenario_of",
    "shipped",
]

# What a scenario is made from: a shipped name, a file, tables, a scenario, or a game alone
Source = str | Path | Mapping[str, Any] | Scenario | Game


def shipped() -> dict[str, str]:
    """The shipped scenarios: name to TOML text."""
    folder = files("gne_mj.scenarios")
    return {
        entry.name.removesuffix(".toml"): entry.read_text(encoding="utf-8")
        for entry in sorted(folder.iterdir(), key=lambda entry: entry.name)
        if entry.name.endswith(".toml")
    }


def load_scenario(source: Source, changes: Mapping[str, Any] | None = None) -> Scenario:
    """A scenario from a shipped name, a TOML file, tables or a game, with some values changed.

    Args:
        source: name of a shipped scenario, path of a file ending in .toml, the tables, another
            scenario, or a game, which integrators under full information play then.
        changes: dotted keys to new values, e.g. {"systems.robots.barrier.rho": 0.2}; "systems."
            may be left out, and the system's name too if there is only one. A value may be an
            object such as a law where a table is meant.

    Raises:
        InvalidInput: names the key, the value and what would be right.
    """
    tables = _tables(source)
    change(tables, changes or {})
    return validated(tables)


def run(source: Source, changes: Mapping[str, Any] | None = None) -> Trajectory:
    """Load a scenario, run it to its end and return the trajectory; see :func:`load_scenario`."""
    return load_scenario(source, changes).simulation_object().run()


def scenario_of(trajectory: Trajectory) -> Scenario:
    """The scenario of a run, with what was done while it ran: run again it takes the same steps.

    >>> gne_mj.run(gne_mj.scenario_of(trajectory))
    >>> Path("again.toml").write_text(gne_mj.scenario_of(trajectory).toml())

    Raises:
        InvalidInput: it holds no scenario, or something was done that no keys of one say.
    """
    if not trajectory.source:
        raise InvalidInput("trajectory", "of no scenario", "it must be one of a scenario's run")
    return as_done(trajectory.source, trajectory.interventions)


def as_done(source: str, done: Sequence[Mapping[str, Any]]) -> Scenario:
    """A scenario with what was done while it ran in place of what was planned.

    Args:
        source: as JSON.
        done: as :attr:`gne_mj.simulation.Simulation.interventions` has it.
    """
    return load_scenario(json.loads(source), {"interventions": tables_of(done)})


def parse_value(text: str) -> Any:
    """What ``--set key=TEXT`` means: a TOML value, else the text itself."""
    try:
        return tomllib.loads(f"value = {text}")["value"]
    except (ValueError, RecursionError):
        return text


def _tables(source: Source) -> dict[str, Any]:
    """A copy of the tables of a source, to be changed."""
    if isinstance(source, Mapping):
        check_nesting("source", source)
        given: dict[str, Any] = json.loads(json.dumps(plain(source)))
        return given
    if isinstance(source, Scenario):
        whole: dict[str, Any] = plain(source)
        return whole
    if isinstance(source, Game):
        name = re.sub(r"[^A-Za-z0-9]+", "-", f"{source.agent_name}s").strip("-")
        if name in (*SystemTable.model_fields, *Scenario.model_fields, "s"):
            name = "players"  # changes of `agents` are of that table
        agents = {"type": "integrator", "count": source.agents}
        return {"systems": {name: {"game": plain(source), "agents": agents}}}
    return _read(source)


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
            _resolve_in(table, folder)
        for _, function in functions_in(system.get("game") if isinstance(system, dict) else None):
            _resolve_in(function, folder)
    return tables


def _resolve_in(table: Any, folder: Path) -> None:
    if isinstance(table, list):
        for each in table:
            _resolve_in(each, folder)
    if not isinstance(table, dict):
        return
    _resolve_in(table.get("input"), folder)  # agents' low-level controllers
    for key in FILES:
        given = table.get(key)
        if isinstance(given, str):
            table[key] = _absolute(folder, given)
        elif isinstance(given, list):
            table[key] = [_absolute(folder, str(name)) for name in given]


def _absolute(folder: Path, name: str) -> str:
    if is_named(name):
        return name
    try:
        return str((folder / name).resolve())
    except (ValueError, OSError):  # no file can be called so: whoever reads it will say so
        return name
