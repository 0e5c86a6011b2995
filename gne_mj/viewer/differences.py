"""What runs are called beside each other: what their scenarios differ in, if that is short."""

import json
from collections.abc import Mapping, Sequence
from typing import Any

KEYS, PART = 3, 30  # so many keys a heading has at most, each of so many characters
TOLD = 12  # differences that are listed at most
APART = (("description",), ("simulation", "duration"))  # which say nothing of how a run goes

Leaves = dict[tuple[str, ...], str]


def headings(names: Sequence[str], scenarios: Sequence[Mapping[str, Any]]) -> list[str]:
    """A heading for each run: "gain = 2", or its name where runs differ by nothing or by much.

    Args:
        names: of the runs, all different.
        scenarios: their tables.
    """
    parts = [[part for part in own if len(part) <= PART] for own in _parts(scenarios)]
    found = [", ".join(own) for own in parts]
    told = all(found) and len(set(found)) == len(found)
    return found if told and max(map(len, parts)) <= KEYS else list(names)


def differences(scenarios: Sequence[Mapping[str, Any]]) -> list[str]:
    """What each scenario has where others have something else, in words."""
    found = []
    for parts in _parts(scenarios):
        more = [f"and {len(parts) - TOLD} keys more"] if len(parts) > TOLD else []
        found.append(", ".join([*parts[:TOLD], *more]) or "no key differs")
    return found


def unique(names: Sequence[str]) -> list[str]:
    """The same names; of equal ones the further are numbered."""
    found: list[str] = []
    for name in names:
        number, new = 1, name
        while new in found:
            number += 1
            new = f"{name} ({number})"
        found.append(new)
    return found


def _parts(scenarios: Sequence[Mapping[str, Any]]) -> list[list[str]]:
    """Of each scenario what it has where others have something else: "gain = 2"."""
    leaves = [_leaves(scenario) for scenario in scenarios]
    keys = list(dict.fromkeys(key for each in leaves for key in each))
    differing = [key for key in keys if len({each.get(key) for each in leaves}) > 1]
    texts = {key: _shortest(key, differing) for key in differing}
    return [[f"{texts[key]} = {own[key]}" for key in differing if key in own] for own in leaves]


def _leaves(table: Mapping[str, Any], above: tuple[str, ...] = ()) -> Leaves:
    """What keys of tables have, as text."""
    found: Leaves = {}
    for key, value in table.items():
        if isinstance(value, Mapping):
            found |= _leaves(value, (*above, key))
        elif (*above, key) not in APART:
            found[*above, key] = value if isinstance(value, str) else json.dumps(value)
    return found


def _shortest(key: tuple[str, ...], others: Sequence[tuple[str, ...]]) -> str:
    """As many of a key's last parts as tell it from the others."""
    for count in range(1, len(key)):
        if sum(other[-count:] == key[-count:] for other in others) == 1:
            return ".".join(key[-count:])
    return ".".join(key)
