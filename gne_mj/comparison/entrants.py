"""Who takes part in a comparison: each law with the table that a scenario would have of it.

A law is named as scenarios name it, with a mode of its own behind a colon if need be
(``full:sampled``), by a file of one's own, or by the table that functions such as
:func:`gne_mj.full_information` make. Which scenarios it is for, and which of its numbers are tuned,
it says itself: a law that refuses a scenario takes no part, and its reason is kept.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from gne_mj.controllers import Law
from gne_mj.controllers.table import EstimatesTable, LawTable, NetworkTable
from gne_mj.errors import GneError, InvalidInput, nearest
from gne_mj.faults import strikes_messages
from gne_mj.registry import LAWS
from gne_mj.scenario import Scenario, load_scenario, plain
from gne_mj.scenario_tables.system import SystemTable
from gne_mj.user_files import load_module

Given = str | Path | LawTable
ALL = "all"  # laws of scenarios, each once
_OWN = ("custom", "python")  # informations that name no law by themselves
# What a scenario's own controller says of all laws that have such a key, not of itself alone
_SHARED = (LawTable, NetworkTable, EstimatesTable)
_OF_SOLVED = {"decentralised": False, "observer": 0.0, "between": "watched"}


@dataclass(frozen=True)
class Entrant:
    """A law that takes part.

    Attributes:
        name: in tables and folders.
        tables: the whole scenario with it, and one system.
        tuned: dotted keys of the system, each with the values to choose among.
        law: as the scenario builds it.
    """

    name: str
    tables: dict[str, Any]
    tuned: Mapping[str, tuple[float, ...]] = field(default_factory=dict)
    law: Law | None = None


def entrants(source: Scenario, laws: Sequence[Given]) -> tuple[list[Entrant], dict[str, str]]:
    """The laws that take part in a scenario of one system, and why others do not.

    Raises:
        InvalidInput: a name that no law has, two of the same name, or none that takes part.
    """
    found: list[Entrant] = []
    refused: dict[str, str] = {}
    for given in _expanded(laws):
        name, controller, tuned = _controller(source, given)
        if name in refused or any(each.name == name for each in found):
            raise InvalidInput("laws", name, "each law may be there once")
        try:
            found.append(_entrant(source, name, controller, tuned))
        except GneError as error:
            refused[name] = str(error)
    if not found:
        reasons = "; ".join(f"{name}: {why}" for name, why in refused.items())
        raise InvalidInput(
            "laws", [*refused], f"one at least must be for this scenario ({reasons})"
        )
    return found, refused


def _expanded(laws: Sequence[Given]) -> list[Given]:
    if isinstance(laws, str | Path | LawTable) or not laws:
        raise InvalidInput("laws", laws, "it must be a list of laws, of one at least")
    every = [name for name in LAWS if name not in _OWN]
    return [each for given in laws for each in (every if given == ALL else [given])]


def _controller(
    source: Scenario, given: Given
) -> tuple[str, dict[str, Any], Mapping[str, tuple[float, ...]]]:
    """A law's name, its table, and what of it is tuned."""
    (system,) = source.systems.values()
    own: dict[str, Any] = plain(system.controller)
    if isinstance(given, LawTable):
        tables: dict[str, Any] = plain(given)
        return _label(tables["information"], given.mode, own), tables, type(given).tuned
    if Path(given).suffix == ".py":
        return _of_file(Path(given), own)
    information, _, mode = str(given).partition(":")
    if information not in LAWS or information in _OWN:
        known = [name for name in LAWS if name not in _OWN]
        raise InvalidInput("laws", information, nearest(information, [*known, ALL]))
    kind: Any = LAWS[information]
    tables = own if own.get("information") == information else _shared(own, kind)
    tables = {**tables, "information": information, **({"mode": mode} if mode else {})}
    for key, values in kind.tuned.items():
        if key in kind.model_fields and kind.model_fields[key].is_required():
            tables.setdefault(key, values[0])
    return _label(information, mode, own), tables, kind.tuned


def _label(information: str, mode: str, own: Mapping[str, Any]) -> str:
    """A name that says the mode where it is not the scenario's."""
    return information if mode in ("", own["mode"]) else f"{information}-{mode}"


def _shared(own: Mapping[str, Any], kind: Any) -> dict[str, Any]:
    """What the scenario's controller says of any law of a kind."""
    keys = {key for each in _SHARED if issubclass(kind, each) for key in each.model_fields}
    return {key: value for key, value in own.items() if key in keys}


def _of_file(
    path: Path, own: Mapping[str, Any]
) -> tuple[str, dict[str, Any], Mapping[str, tuple[float, ...]]]:
    """A law of one's own, whose file may have ``TUNED``, parameters with values to choose among."""
    tuned = dict(getattr(load_module(path), "TUNED", {}))
    tables = {
        **_shared(own, NetworkTable),
        "information": "custom",
        "file": str(path.resolve()),
        "parameters": {name: values[0] for name, values in tuned.items()},
    }
    return path.stem, tables, {f"parameters.{name}": tuple(v) for name, v in tuned.items()}


def _entrant(
    source: Scenario,
    name: str,
    controller: dict[str, Any],
    tuned: Mapping[str, tuple[float, ...]],
) -> Entrant:
    """A law in the scenario, in a mode that it has, with the faults that can strike it.

    Raises:
        GneError: the law is not for this scenario.
    """
    tables: dict[str, Any] = plain(source)
    (system,) = tables["systems"].values()
    system["controller"] = controller
    law = _law(tables)
    if not law.implicit and controller.get("mode") == "implicit":
        controller["mode"] = "sampled"
    if controller.get("mode") != "implicit":
        controller.update({key: v for key, v in _OF_SOLVED.items() if key in controller})
    (table,) = source.systems.values()
    if law.graph is None:  # which sends no messages
        given = zip(system.get("faults", []), table.faults, strict=True)
        system["faults"] = [one for one, kind in given if not strikes_messages([kind.build()])]
    tables["simulation"]["on_exit"] = "continue"
    built = load_scenario(tables)
    (only,) = built.system_objects()
    built.clock()
    keys = {_full(key): values for key, values in tuned.items()}
    return Entrant(name, plain(built), keys, only.law)


def _law(tables: Mapping[str, Any]) -> Law:
    """The law of tables whose mode may not be one of its own."""
    (table,) = load_scenario({**tables}).systems.values()
    return table.controller.build(table._game())


def _full(key: str) -> str:
    """A key of a system: a law's own keys are those of its controller."""
    return key if key.partition(".")[0] in SystemTable.model_fields else f"controller.{key}"
