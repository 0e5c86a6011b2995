"""Records for native code: where each array and each number lies follows from one declaration.

A record is a NamedTuple whose fields say their shape, and that they hold whole numbers if so;
single numbers that change are declared together (:mod:`gne_mj.numbers`):

    class Clock(Numbers):
        step: float
        time: float

    class Work(NamedTuple):
        now: Clock
        g: Annotated[np.ndarray, "p"]
        band: Annotated[np.ndarray, "m, 2 * b + 1"]
        index: Annotated[np.ndarray, "m", int]

A field that is a record itself stands for its arrays; one that is a plain number is given by
whoever reads. :func:`in_array` lays a record of floats out in one flat array,
:func:`in_parameter_block` finds one in a parameter block (:mod:`gne_mj.parameter_block`). Both
write the kernels that a hand would write, so that neither compiling nor running costs more. For
Python :func:`dtype_of` is the same layout as NumPy knows it, and :func:`by_name` the view of flat
arrays by it.
"""

import ast
from collections.abc import Callable, Mapping
from functools import cache
from types import CodeType, MappingProxyType
from typing import Annotated, Any, NamedTuple, get_args, get_origin, get_type_hints

import numpy as np
from numpy.typing import NDArray

from gne_mj.native import kernel, kernel_as, part, shaped
from gne_mj.numbers import Numbers, are_whole, flat, names_of, numbers, numbers_in
from gne_mj.parameter_block import floats, integers


class Field(NamedTuple):
    """One array of a record."""

    name: str
    shape: str  # what stands in the declaration
    whole: bool  # whether it holds whole numbers

    @property
    def size(self) -> str:
        """Its number of entries, as an expression."""
        return " * ".join(f"({extent})" for extent in self.extents)

    @property
    def extents(self) -> list[str]:
        """Its length in each dimension, as expressions."""
        written = ast.parse(f"({self.shape},)", mode="eval").body
        assert isinstance(written, ast.Tuple)
        return [ast.unparse(extent) for extent in written.elts]

    def evaluated(self, names: dict[str, Any]) -> tuple[int, ...]:
        """Its shape, the names in it standing for this."""
        found: tuple[int, ...] = eval(_compiled(self.shape), dict(names))
        return found


@cache  # shapes are our own declarations, and few
def _compiled(shape: str) -> CodeType:
    return compile(f"({shape},)", "<shape>", "eval")


def fields(record: Any) -> Mapping[str, Any]:
    """By name: a :class:`Field`, another record or class of numbers, None for a plain number."""
    return _fields(record)


@cache  # asked for whenever rows are recorded
def _fields(record: Any) -> Mapping[str, Any]:
    found: dict[str, Any] = {}
    for name, kind in get_type_hints(record, include_extras=True).items():
        if get_origin(kind) is Annotated:
            _, shape, *more = get_args(kind)
            found[name] = Field(name, shape, int in more)
        else:
            found[name] = kind if hasattr(kind, "_fields") or _are_numbers(kind) else None
    return MappingProxyType(found)


def _are_numbers(kind: Any) -> bool:
    return isinstance(kind, type) and issubclass(kind, Numbers)


@cache  # asked for at the start of every run of a batch
def dtype_of(record: Any, **known: Any) -> np.dtype[Any]:
    """The layout of a record that lies in one flat array, for NumPy.

    Numbers in it are among its own fields; ``known`` is what shapes use.
    """
    return _dtype_of(record, *known.items())


@cache
def _dtype_of(record: Any, *known: tuple[str, Any]) -> np.dtype[Any]:
    return np.dtype((np.record, _parts(record, dict(known))))


def _parts(record: Any, known: dict[str, Any]) -> list[tuple[Any, ...]]:
    parts: list[tuple[Any, ...]] = []
    for name, field in fields(record).items():
        if isinstance(field, Field):
            item = np.int64 if field.whole else np.float64
            parts.append((name, item, field.evaluated(known)))
        elif _are_numbers(field):
            item = np.int64 if are_whole(field) else np.float64
            parts += [(each, item) for each in names_of(field)]
        else:
            parts.append((name, dtype_of(field, **known)))
    return parts


def by_name(flat: NDArray[Any], dtype: np.dtype[Any]) -> Any:
    """The record that flat arrays (..., length) begin with: of one array itself, else (...)."""
    found = flat[..., : dtype.itemsize // 8].view(dtype)
    return found[0] if found.ndim == 1 else found[..., 0].view(np.recarray)


def arrays(values: Any) -> list[NDArray[Any]]:
    """The arrays of a record, in the declaration's order."""
    found = []
    for name, field in fields(type(values)).items():
        value = getattr(values, name)
        if isinstance(field, Field):
            found.append(value)
        elif _are_numbers(field):
            found.append(flat(value))
        elif field is not None:
            found += arrays(value)
    return found


def count(record: Any) -> int:
    """How many arrays it has."""
    return sum(map(_arrays_of, fields(record).values()))


def _arrays_of(field: Any) -> int:
    if field is None:
        return 0
    return 1 if isinstance(field, Field) or _are_numbers(field) else count(field)


def place(record: Any, name: str) -> int:
    """How many arrays come before a field.

    Raises:
        KeyError: the record has no such field.
    """
    at = 0
    for other, field in fields(record).items():
        if other == name:
            return at
        at += _arrays_of(field)
    raise KeyError(name)


def fresh(record: Any, **names: Any) -> Any:
    """A record of zeros, ``names`` being what the names in its shapes stand for."""
    made = []
    for field in fields(record).values():
        if _are_numbers(field):
            made.append(numbers(field))
        elif isinstance(field, Field):
            item = np.int64 if field.whole else np.float64
            made.append(np.zeros(field.evaluated(names), dtype=item))
        else:
            made.append(fresh(field, **names))
    return record(*made)


def shapes(record: Any, **names: Any) -> list[tuple[int, ...]]:
    """The shapes of a record's arrays, ``names`` being what the names in them stand for."""
    return list(_shapes(record, *names.items()))


@cache
def _shapes(record: Any, *names: tuple[str, Any]) -> tuple[tuple[int, ...], ...]:
    return tuple(field.evaluated(dict(names)) for field in fields(record).values())


def in_array(
    record: Any, sizes: str, **known: Any
) -> tuple[Callable[..., int], Callable[..., Any]]:
    """Kernels for a record of floats that lies in one flat array.

    Args:
        record: which.
        sizes: the names that its shapes depend on, as "m p".
        known: kernels and constants that its shapes use.

    Returns:
        ``length(*sizes)``: its number of entries; and ``views(flat, at, *sizes)``: the record, of
        views into an array from entry ``at`` on.
    """
    lines: list[str] = []
    lengths: list[str] = []
    used: dict[str, Any] = {}
    result = _laid(record, "", lines, lengths, used)
    names = ", ".join(sizes.split())
    text = [f"def length({names}):", f"    return {' + '.join(lengths)}"]
    text += [f"def views(flat, at, {names}):", "    end = at", *lines, f"    return {result}"]
    written = _functions(record, text, {**used, **known, "part": _slice})
    native = _functions(record, text, {**used, **known, "part": part})
    length, views = written["length"], written["views"]
    return kernel(length), kernel_as(native["views"], views)


def _slice(flat: NDArray[Any], begin: int, length: int) -> NDArray[Any]:
    return flat[begin : begin + length]


def _laid(
    record: Any, prefix: str, lines: list[str], lengths: list[str], used: dict[str, Any]
) -> str:
    """Add the lines that view a record's parts; the expression that makes the record."""
    given = []
    kind = f"{prefix}record"
    used[kind] = record
    for name, field in fields(record).items():
        variable = f"{prefix}{name}_"
        if isinstance(field, Field):
            lengths.append(field.size)
            view = "part(flat, begin, end - begin)"
            if len(field.extents) > 1:
                view += f".reshape(({field.shape}))"
        elif _are_numbers(field):
            lengths.append(str(len(names_of(field))))
            view = f"{variable}numbers(flat, begin)"
            used[f"{variable}numbers"] = numbers_in(field)
        else:
            given.append(_laid(field, variable, lines, lengths, used))
            continue
        lines += ["    begin = end", f"    end = begin + {lengths[-1]}", f"    {variable} = {view}"]
        given.append(variable)
    return f"{kind}({', '.join(given)})"


def columns_in(record: Any, first: int) -> Callable[..., Any]:
    """The kernel ``read(parameter block)`` of a record's arrays, flat whatever their shapes."""
    given = ", ".join(f"floats(parameter_block, {first + at})" for at in range(count(record)))
    read: Callable[..., Any] = _define(
        record, ["def read(parameter_block):", f"    return record({given})"], {}
    )["read"]
    return read


def in_parameter_block(record: Any, first: int = 0, **known: Any) -> Callable[..., Any]:
    """The kernel that reads a record from a parameter block.

    Args:
        record: which; in its arrays' shapes ``n`` is the number of entries of the array itself.
        first: the place of its first array in the parameter block.
        known: constants that its shapes use.

    Returns:
        ``read(parameter block, *numbers)``, the numbers being the record's fields that are no
        arrays, and those that its shapes depend on, by name in alphabetical order.
    """
    lines: list[str] = []
    asked: set[str] = set()
    names = dict(known)
    result = _read(record, first, lines, asked, names)
    given = "".join(f", {name}" for name in sorted(asked - set(known)))
    head = f"def read(parameter_block{given}):"
    made = _define(record, [head, *lines, f"    return {result}"], names)
    read: Callable[..., Any] = made["read"]
    return read


def in_numbers(record: Any, at: int, first: int = 0) -> Callable[..., Any]:
    """The kernel ``read(parameter block)`` of a record of whole numbers, in one array of a
    parameter block.

    Args:
        record: which.
        at: the array's place in the parameter block.
        first: the entry that it begins with.
    """
    given = ", ".join(f"n[{first + entry}]" for entry in range(len(record._fields)))
    lines = [
        "def read(parameter_block):",
        f"    n = integers(parameter_block, {at})",
        f"    return record({given})",
    ]
    read: Callable[..., Any] = _define(record, lines, {})["read"]
    return read


def _read(record: Any, first: int, lines: list[str], asked: set[str], names: dict[str, Any]) -> str:
    """Add the lines that read a record's arrays; the expression that makes the record."""
    kind = f"record_{len(names)}"
    names[kind] = record
    given, at = [], first
    for name, field in fields(record).items():
        if isinstance(field, Field):
            variable = f"array_{at}"
            lines.append(
                f"    {variable} = {'integers' if field.whole else 'floats'}(parameter_block, {at})"
            )
            if len(field.extents) > 1:
                lines.append(f"    n = len({variable})")
                lines.append(f"    {variable}_ = shaped({variable}, ({field.shape}))")
                asked |= _names_in(field.shape) - {"n"}
                variable += "_"
            given.append(variable)
            at += 1
        elif _are_numbers(field):
            names[f"numbers_{at}"] = numbers_in(field)
            item = "integers" if are_whole(field) else "floats"
            given.append(f"numbers_{at}({item}(parameter_block, {at}), 0)")
            at += 1
        elif field is None:
            asked.add(name)
            given.append(name)
        else:
            given.append(_read(field, at, lines, asked, names))
            at += count(field)
    asked.discard("parameter_block")
    return f"{kind}({', '.join(given)})"


def _names_in(expression: str) -> set[str]:
    return set(compile(f"({expression})", "shape", "eval").co_names)


def _define(record: Any, lines: list[str], known: dict[str, Any]) -> dict[str, Any]:
    """The functions of a text, as kernels."""
    return {name: kernel(made) for name, made in _functions(record, lines, known).items()}


def _functions(record: Any, lines: list[str], known: dict[str, Any]) -> dict[str, Any]:
    """The functions of a text."""
    made: dict[str, Any] = {
        "__name__": __name__, "record": record, "shaped": shaped, "floats": floats,
        "integers": integers, **known,
    }  # fmt: skip
    functions: dict[str, Any] = {}
    exec(compile("\n".join(lines), f"<layout of {record.__name__}>", "exec"), made, functions)
    return functions
