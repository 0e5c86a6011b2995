"""Mutated scenario files, each following from a seed and its number."""

import json
import random
import re
import tomllib
from collections.abc import Callable
from copy import deepcopy
from datetime import date, datetime, time
from functools import cache
from pathlib import Path
from typing import Any

from gne_mj.scenario import shipped

EXAMPLES = Path(__file__).resolve().parents[2] / "examples"
SECONDS = 0.2  # that a file lasts unless it is mutated to last longer


class Raw(str):
    """A value as the file has it."""


NUMBERS = (
    "0", "-1", "1", "2", "3", "-0.0", "5e-324", "1e-300", "1e-12", "1e12", "1e300", "-1e300",
    "1e308", "nan", "inf", "-inf", "9223372036854775807", "9223372036854775808", "4294967296",
    "-9223372036854775809", "1000000000", "100000", "1" + "0" * 40, "9" * 5000, "1e999",
    "0.1", "0.5", "0.002", "7",
)  # fmt: skip
OTHERS = (
    "true", "false", '""', '"x"', '"ring"', '"nan"', "[]", "[[]]", "{}", "[1]", "[0.0, nan]",
    "[1, 2, 3]", "[[1, 2], [2, 3]]", '["a", "b"]', "[{}, {}]", "{ a = 1 }", "[true, 1]",
    "2026-01-01", "2026-01-01T00:00:00Z", "12:30:00", "[2026-01-01]",
    '"' + "long " * 20_000 + '"', "[" + "0.5, " * 20_000 + "]", "[" * 60 + "]" * 60,
    "[" * 300 + "]" * 300, "[" * 5000 + "]" * 5000, "{a=" * 300 + "1" + "}" * 300,
    '"\\u0000"', '"\\n\\t"', '"é😀\\u202e"', '"../../etc/passwd"', '"/dev/zero"', '"/"',
)  # fmt: skip
TABLES = (
    "{ type = 'velocity-synchronization' }", "{ type = 'velocity-consensus' }",
    "{ type = 'cournot' }", "{ type = 'osnr' }", "{ type = 'integrator', count = 4 }",
    "{ type = 'platoon' }", "{ type = 'formation' }", "{ radius = 1e300 }",
    "{ vertices = [[0, 0], [1, 0], [0, 1e-300]] }", "{ box = [[-1, -1], [1, 1]], radius = 1 }",
    "{ type = 'custom', file = 'nothing.py' }", "{ type = 'flexible-robot', count = 3 }",
    "{ type = 'planar-flexible-robot', count = 2 }", "{ type = 'pi-cascade', count = 10 }",
    "{ type = 'mixed', groups = [] }", "{ type = 'mixed', groups = [{ type = 'mixed' }] }",
    "{ type = 'mjcf-robot', count = 1, file = 'cart.xml', output = 'x', input = 'y' }",
    "{ information = 'full', mode = 'sampled' }", "{ information = 'partial', graph = 'line' }",
    "{ information = 'distributed', epsilon = 0.1 }", "{ information = 'partial', graph = [] }",
    "{ information = 'custom', file = 'damped_plain.py' }",
    "{ information = 'full', mode = 'implicit' }", "[{ type = 'noise', amplitude = 1e300 }]",
    "[{ type = 'sensor-delay', periods = 1000000000000 }]", "{ push = 1e300, delay = 3 }",
    "[{ type = 'push', force = 1e300, agents = [99] }]", "{ delay = 9223372036854775807 }",
    "[{ type = 'message-delay', periods = 1000000000 }]", "{ engine = 'mujoco' }",
    "[{ type = 'silence', edges = [[1, 2]] }]", "{ integrator = 'rosenbrock' }",
    "{ rho = 1.0, schedule = 'halving', time_constant = 1e-300 }",
    "{ rho = 1e-300 }", "{ rho = 1.0, schedule = 'exponential' }",
)  # fmt: skip
PLACES = ("game", "agents", "controller", "barrier", "plant", "initial", "margin", "faults")


@cache
def bases() -> dict[str, str]:
    """The files that are mutated: name to TOML text, all of them short runs."""
    texts = shipped()
    texts |= {f.parent.name: f.read_text("utf-8") for f in EXAMPLES.glob("*/scenario.toml")}
    return {
        name: re.sub(r"(?m)^duration = \S+", f"duration = {SECONDS}", text)
        for name, text in sorted(texts.items())
    }


def companions() -> list[Path]:
    """The files that the examples' scenarios name."""
    return [f for f in sorted(EXAMPLES.glob("*/*")) if f.suffix in (".py", ".xml")]


def mutated(seed: int, index: int) -> tuple[str, bytes]:
    """A file's contents, and in words what was done to it."""
    rng = random.Random(f"{seed}/{index}")
    texts = bases()
    name = rng.choice(sorted(texts))
    if rng.random() < 0.25:
        mutate = rng.choice(TEXT)
        return f"{name}: {mutate.__name__}", mutate(rng, texts[name])
    tables = tomllib.loads(texts[name])
    other = tomllib.loads(texts[rng.choice(sorted(texts))])
    done = []
    for _ in range(rng.choice((1, 1, 1, 2, 3))):
        mutate = rng.choice(VALUES)
        mutate(rng, tables, other)
        done.append(mutate.__name__)
    return f"{name}: {', '.join(done)}", written(tables).encode("utf-8", "replace")


def written(tables: dict[str, Any]) -> str:
    """TOML with one line for each entry at the top."""
    return "".join(f"{_key(key)} = {_value(value)}\n" for key, value in tables.items())


def _key(key: str) -> str:
    return key if re.fullmatch(r"[A-Za-z0-9_-]+", key) else json.dumps(key)


def _value(value: Any) -> str:
    match value:
        case Raw():
            return str(value)
        case dict():
            return "{" + ", ".join(f"{_key(k)} = {_value(v)}" for k, v in value.items()) + "}"
        case list():
            return "[" + ", ".join(map(_value, value)) + "]"
        case str():
            return json.dumps(value)
        case bool():
            return str(value).lower()
        case datetime() | date() | time():
            return value.isoformat()
    return repr(value)


def _leaves(table: Any, found: list[tuple[Any, Any]]) -> list[tuple[Any, Any]]:
    """Every entry of tables and lists, with what holds it."""
    for key in table if isinstance(table, dict) else range(len(table)):
        found.append((table, key))
        if isinstance(table[key], dict | list):
            _leaves(table[key], found)
    return found


def _leaf(rng: random.Random, tables: dict[str, Any]) -> tuple[Any, Any]:
    """One entry, those deep inside as likely as their keys are many."""
    leaves = _leaves(tables, [])
    ends = [(at, key) for at, key in leaves if not isinstance(at[key], dict)]
    return rng.choice(ends if ends and rng.random() < 0.8 else leaves)


def _named(rng: random.Random, tables: dict[str, Any]) -> tuple[dict[str, Any], str]:
    """One entry of a table."""
    return rng.choice([(at, k) for at, k in _leaves(tables, []) if isinstance(at, dict)])


def number(rng: random.Random, tables: dict[str, Any], other: dict[str, Any]) -> None:
    """An extreme number in an entry's place."""
    at, key = _leaf(rng, tables)
    at[key] = Raw(rng.choice(NUMBERS))


def scale(rng: random.Random, tables: dict[str, Any], other: dict[str, Any]) -> None:
    """A number some powers of ten larger or smaller."""
    numbers = [
        (at, key) for at, key in _leaves(tables, [])
        if isinstance(at[key], int | float) and not isinstance(at[key], bool)
    ]  # fmt: skip
    if numbers:
        at, key = rng.choice(numbers)
        factor = 10.0 ** rng.choice((-9, -3, -1, 1, 2, 3, 6, 9, 15))
        at[key] = int(at[key] * factor) if isinstance(at[key], int) else at[key] * factor


def kind(rng: random.Random, tables: dict[str, Any], other: dict[str, Any]) -> None:
    """Something of another type in an entry's place."""
    at, key = _leaf(rng, tables)
    at[key] = Raw(rng.choice(OTHERS))


def delete(rng: random.Random, tables: dict[str, Any], other: dict[str, Any]) -> None:
    """An entry less."""
    if tables:
        at, key = _named(rng, tables)
        del at[key]


def rename(rng: random.Random, tables: dict[str, Any], other: dict[str, Any]) -> None:
    """A key with another name, misspelt or of another place."""
    at, key = _named(rng, tables)
    names = [key[1:], key + "s", key.upper(), "type", "file", "é", "x" * 10_000, "a.b", " ", ""]
    at[rng.choice([*names, _named(rng, other)[1]])] = at.pop(key)


def move(rng: random.Random, tables: dict[str, Any], other: dict[str, Any]) -> None:
    """An entry in another table."""
    at, key = _named(rng, tables)
    value = at.pop(key)
    into, beside = _named(rng, tables or other)  # the value is in neither
    (into[beside] if isinstance(into.get(beside), dict) else into)[key] = value


def graft(rng: random.Random, tables: dict[str, Any], other: dict[str, Any]) -> None:
    """A table of another scenario, or one of a list, in a system."""
    systems = [s for s in _tables(tables.get("systems")) if isinstance(s, dict)]
    others = [s for s in _tables(other["systems"]) if isinstance(s, dict)]
    if not systems:
        return
    place, donor = rng.choice(PLACES), rng.choice(others)
    if place in donor and rng.random() < 0.5:
        rng.choice(systems)[place] = deepcopy(donor[place])
    else:
        rng.choice(systems)[place] = Raw(rng.choice(TABLES))


def insert(rng: random.Random, tables: dict[str, Any], other: dict[str, Any]) -> None:
    """An entry of another scenario in a table of the same name, or anywhere."""
    at, key = _named(rng, other)
    into, beside = _named(rng, tables)
    (into[beside] if isinstance(into.get(beside), dict) else into)[key] = deepcopy(at[key])


def _tables(table: Any) -> list[Any]:
    return list(table.values()) if isinstance(table, dict) else []


def nothing(rng: random.Random, text: str) -> bytes:
    """Nothing, or hardly anything."""
    return rng.choice((b"", b"\n", b"#", b"\0", b"=", b"[", b"\xef\xbb\xbf", b"a = 1\r"))


def cut(rng: random.Random, text: str) -> bytes:
    """The beginning alone."""
    return text.encode()[: rng.randrange(len(text))]


def flip(rng: random.Random, text: str) -> bytes:
    """Some bytes changed."""
    raw = bytearray(text.encode())
    for _ in range(rng.choice((1, 2, 20))):
        raw[rng.randrange(len(raw))] = rng.randrange(256)
    return bytes(raw)


def encode(rng: random.Random, text: str) -> bytes:
    """Another encoding."""
    code = rng.choice(("utf-16", "utf-32", "utf-8-sig", "latin-1", "cp1252"))
    return ("# é\n" + text).encode(code)


def line_ends(rng: random.Random, text: str) -> bytes:
    """Another end of lines."""
    return text.replace("\n", rng.choice(("\r\n", "\r", "\n\n", "\x0b\n", "\u2028"))).encode()


def twice(rng: random.Random, text: str) -> bytes:
    """A line, or all, written twice."""
    lines = text.splitlines()
    at = rng.randrange(len(lines))
    again = lines if rng.random() < 0.2 else [*lines[:at], *[lines[at]] * 2, *lines[at + 1 :]]
    return "\n".join(again + (lines if again is lines else [])).encode()


def swap(rng: random.Random, text: str) -> bytes:
    """Lines in another order."""
    lines = text.splitlines()
    for _ in range(rng.choice((1, 3))):
        a, b = rng.randrange(len(lines)), rng.randrange(len(lines))
        lines[a], lines[b] = lines[b], lines[a]
    return "\n".join(lines).encode()


def nest(rng: random.Random, text: str) -> bytes:
    """Nested very deeply, at the end of a file."""
    depth = rng.choice((30, 300, 3000))
    deep = rng.choice(
        (
            "[" + ".".join("a" * depth) + "]\nb = 1",
            "deep = " + "[" * depth + "]" * depth,
            "[systems.deep]\n" + ".".join(["game"] * depth) + " = 1",
            "[systems.deep.game]\ntype = 'custom'\nfile = 'x.py'\nparameters.a = "
            + "[" * depth + "]" * depth,
            "x = " + "{a = " * depth + "1" + "}" * depth,
        )
    )  # fmt: skip
    return f"{text}\n{deep}\n".encode()


def crowd(rng: random.Random, text: str) -> bytes:
    """Very many tables, keys or characters."""
    count = rng.choice((1000, 50_000))
    more = rng.choice(
        (
            "".join(f"[systems.s{i}]\n" for i in range(count)),
            "".join(f"k{i} = 1\n" for i in range(count)),
            "# " + "x" * 20 * count,
            "[[systems.robots.faults]]\ntype = 'noise'\namplitude = 0.0\n" * min(count, 20_000),
        )
    )
    return f"{text}\n{more}\n".encode()


Values = Callable[[random.Random, dict[str, Any], dict[str, Any]], None]
VALUES: tuple[Values, ...] = (
    number, number, number, scale, kind, kind, delete, rename, move, graft, graft, insert,
)  # fmt: skip
TEXT: tuple[Callable[[random.Random, str], bytes], ...] = (
    nothing, cut, flip, flip, encode, line_ends, twice, swap, nest, nest, crowd,
)  # fmt: skip
