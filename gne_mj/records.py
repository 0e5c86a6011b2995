"""Records of arrays for native code: where each array lies follows from one declaration.

A record is a NamedTuple whose fields say their shape, and that they hold whole numbers if so:

    class Work(NamedTuple):
        g: Annotated[np.ndarray, "p"]
        band: Annotated[np.ndarray, "m, 2 * b + 1"]
        index: Annotated[np.ndarray, "m", int]

A field that is a record itself stands for its arrays; one that is a plain number is given by
whoever reads. :func:`in_array` lays a record of floats out in one flat array, :func:`in_table`
finds one in a table (:mod:`gne_mj.table`). Both write the kernels that a hand would write, so that
neither compiling nor running costs more.
"""

import ast
from collections.abc import Callable
from typing import Annotated, Any, NamedTuple, get_args, get_origin, get_type_hints

import numpy as np
from numpy.typing import NDArray

from gne_mj.native import kernel, shaped
from gne_mj.table import floats, integers


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


def fields(record: Any) -> dict[str, Any]:
    """By name: a :class:`Field`, another record, or None for a plain number."""
    found: dict[str, Any] = {}
    for name, kind in get_type_hints(record, include_extras=True).items():
        if get_origin(kind) is Annotated:
            _, shape, *more = get_args(kind)
            found[name] = Field(name, shape, int in more)
        else:
            found[name] = kind if hasattr(kind, "_fields") else None
    return found


def arrays(values: Any) -> list[NDArray[Any]]:
    """The arrays of a record, in the declaration's order."""
    found = []
    for name, field in fields(type(values)).items():
        value = getattr(values, name)
        if isinstance(field, Field):
            found.append(value)
        elif field is not None:
            found += arrays(value)
    return found


def count(record: Any) -> int:
    """How many arrays it has."""
    nested = fields(record).values()
    return sum(1 if isinstance(f, Field) else 0 if f is None else count(f) for f in nested)


def place(record: Any, name: str) -> int:
    """How many arrays come before a field.

    Raises:
        KeyError: the record has no such field.
    """
    at = 0
    for other, field in fields(record).items():
        if other == name:
            return at
        at += 1 if isinstance(field, Field) else 0 if field is None else count(field)
    raise KeyError(name)


def fresh(record: Any, **names: Any) -> Any:
    """A record of zeros, ``names`` being what the names in its shapes stand for."""
    made = []
    for field in fields(record).values():
        shape = eval(f"({field.shape},)", names)  # of our own declarations
        made.append(np.zeros(shape, dtype=np.int64 if field.whole else np.float64))
    return record(*made)


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
    parts, names = list(fields(record).values()), ", ".join(sizes.split())
    lines = [f"def length({names}):", f"    return {' + '.join(part.size for part in parts)}"]
    lines += [f"def views(flat, at, {names}):", "    end = at"]
    for part in parts:
        view = "flat[begin:end]"
        lines += ["    begin = end", f"    end = begin + {part.size}"]
        if len(part.extents) > 1:
            view += f".reshape(({part.shape}))"
        lines.append(f"    {part.name}_ = {view}")
    given = ", ".join(f"{part.name}_" for part in parts)
    lines.append(f"    return record({given})")
    made = _define(record, lines, known)
    return made["length"], made["views"]


def in_table(record: Any, first: int = 0, **known: Any) -> Callable[..., Any]:
    """The kernel that reads a record from a table.

    Args:
        record: which; in its arrays' shapes ``n`` is the number of entries of the array itself.
        first: the place of its first array in the table.
        known: constants that its shapes use.

    Returns:
        ``read(table, *numbers)``, the numbers being the record's fields that are no arrays, and
        those that its shapes depend on, by name in alphabetical order.
    """
    lines: list[str] = []
    numbers: set[str] = set()
    names = dict(known)
    result = _read(record, first, lines, numbers, names)
    given = "".join(f", {name}" for name in sorted(numbers - set(known)))
    head = f"def read(table{given}):"
    made = _define(record, [head, *lines, f"    return {result}"], names)
    read: Callable[..., Any] = made["read"]
    return read


def in_numbers(record: Any, at: int) -> Callable[..., Any]:
    """The kernel ``read(table)`` of a record of whole numbers, which are one array of a table."""
    given = ", ".join(f"n[{entry}]" for entry in range(len(record._fields)))
    lines = ["def read(table):", f"    n = integers(table, {at})", f"    return record({given})"]
    read: Callable[..., Any] = _define(record, lines, {})["read"]
    return read


def _read(
    record: Any, first: int, lines: list[str], numbers: set[str], names: dict[str, Any]
) -> str:
    """Add the lines that read a record's arrays; the expression that makes the record."""
    kind = f"record_{len(names)}"
    names[kind] = record
    given, at = [], first
    for name, field in fields(record).items():
        if isinstance(field, Field):
            variable = f"array_{at}"
            lines.append(f"    {variable} = {'integers' if field.whole else 'floats'}(table, {at})")
            if len(field.extents) > 1:
                lines.append(f"    n = len({variable})")
                lines.append(f"    {variable}_ = shaped({variable}, ({field.shape}))")
                numbers |= _names_in(field.shape) - {"n"}
                variable += "_"
            given.append(variable)
            at += 1
        elif field is None:
            numbers.add(name)
            given.append(name)
        else:
            given.append(_read(field, at, lines, numbers, names))
            at += count(field)
    numbers.discard("table")
    return f"{kind}({', '.join(given)})"


def _names_in(expression: str) -> set[str]:
    return set(compile(f"({expression})", "shape", "eval").co_names)


def _define(record: Any, lines: list[str], known: dict[str, Any]) -> dict[str, Any]:
    """The functions of a text, as kernels."""
    made: dict[str, Any] = {
        "__name__": __name__, "record": record, "shaped": shaped, "floats": floats,
        "integers": integers, **known,
    }  # fmt: skip
    functions: dict[str, Any] = {}
    exec(compile("\n".join(lines), f"<layout of {record.__name__}>", "exec"), made, functions)
    return {name: kernel(function) for name, function in functions.items()}
