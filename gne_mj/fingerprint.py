"""What a function is, in a few letters: the same in every process for the same code and numbers.

A batch of functions that a program made can go on in another process only if the same functions
are given again, and by this that is seen.
"""

import hashlib
from collections.abc import Iterator, Mapping
from contextlib import suppress
from dataclasses import fields, is_dataclass
from dis import get_instructions
from functools import partial
from secrets import token_hex
from types import BuiltinFunctionType, CodeType, FunctionType, ModuleType
from typing import Any

import numpy as np

_DIGITS = 8
_OUTSIDE = ("LOAD_GLOBAL", "LOAD_NAME")


def fingerprint(*things: Any) -> str:
    """Of functions, with all that they read, and of plain data; else one that nothing else has."""
    digest, known = hashlib.sha256(), set[int]()
    try:
        for part in _parts(things, known):
            digest.update(len(part).to_bytes(8, "little") + part)
    except RecursionError:  # of data that contain themselves, say
        digest.update(token_hex().encode())
    return digest.hexdigest()[:_DIGITS]


def _parts(thing: Any, known: set[int]) -> Iterator[bytes]:
    """What makes a thing what it is."""
    if thing is None or isinstance(thing, bool | int | float | complex | str | bytes):
        yield f"{type(thing).__name__} {thing!r}".encode()
    elif isinstance(thing, np.ndarray | np.generic):
        array = np.asarray(thing)
        yield f"array {array.dtype} {array.shape}".encode()
        yield array.tobytes() if array.dtype != object else token_hex().encode()
    elif isinstance(thing, ModuleType | type | BuiltinFunctionType | np.ufunc) or _is_ours(thing):
        yield f"{getattr(thing, '__module__', '')}.{thing.__name__}".encode()
    elif isinstance(thing, Mapping | tuple | list | set | frozenset | range):
        yield type(thing).__name__.encode()
        entries = thing.items() if isinstance(thing, Mapping) else thing
        for each in sorted(entries, key=repr) if isinstance(thing, set | frozenset) else entries:
            yield from _parts(each, known)
    elif isinstance(thing, CodeType):
        yield thing.co_code
        yield from _parts((thing.co_names, thing.co_varnames, thing.co_consts), known)
    elif isinstance(thing, partial):
        yield from _parts((thing.func, thing.args, thing.keywords), known)
    elif isinstance(thing, FunctionType):
        if id(thing) not in known:
            known.add(id(thing))
            yield from _of_function(thing, known)
    elif is_dataclass(thing):
        own = [getattr(thing, field.name) for field in fields(thing)]
        yield from _parts((type(thing), own), known)
    else:  # an object of which nothing is known
        yield token_hex().encode()


def _is_ours(thing: Any) -> bool:
    """Whether it is a function of this package, whose version results have anyway."""
    return isinstance(thing, FunctionType) and thing.__module__.startswith("gne_mj.")


def _of_function(function: FunctionType, known: set[int]) -> Iterator[bytes]:
    code = function.__code__
    yield from _parts((code, function.__defaults__, function.__kwdefaults__), known)
    for cell in function.__closure__ or ():
        with suppress(ValueError):  # one that has nothing in it yet
            yield from _parts(cell.cell_contents, known)
    for name in sorted(_names(code)):
        if name in function.__globals__:
            yield from _parts((name, function.__globals__[name]), known)


def _names(code: CodeType) -> set[str]:
    """The names that a function, and what is defined in it, look for outside."""
    own = {each.argval for each in get_instructions(code) if each.opname in _OUTSIDE}
    return own.union(*(_names(each) for each in code.co_consts if isinstance(each, CodeType)))
