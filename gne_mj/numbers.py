"""Single numbers in a flat array, read and set by name in native code and in Python.

    class Clock(Numbers):
        step: float
        time: float

    clock_at = numbers_in(Clock)

    @kernel
    def tick(flat, h):
        clock = clock_at(flat, 0)
        clock.step += 1.0

To native code such numbers are an address, as C has a struct; in Python a ``np.record``.
"""

from collections.abc import Callable
from functools import cache
from typing import Any, get_type_hints

import numpy as np
from numba.core import cgutils, types
from numba.core.typing.templates import AttributeTemplate
from numba.extending import (
    infer_getattr,
    intrinsic,
    lower_getattr_generic,
    lower_setattr_generic,
    models,
    overload,
    register_model,
)
from numba.np.arrayobj import make_array
from numpy.typing import NDArray

from gne_mj.native import KERNEL, address_in


class Numbers:
    """Base of single numbers that lie one behind the other, 8 bytes each: float, or all int."""


def names_of(record: type[Numbers]) -> tuple[str, ...]:
    """In the declaration's order.

    Raises:
        TypeError: an array of NumPy has such an attribute, or kinds are mixed.
    """
    hints = get_type_hints(record)
    if taken := [name for name in hints if hasattr(np.recarray, name)]:
        raise TypeError(f"{record.__name__}: {taken[0]} is an attribute of arrays")
    if set(hints.values()) not in ({float}, {int}):
        raise TypeError(f"{record.__name__}: all float or all int")
    return tuple(hints)


def are_whole(record: type[Numbers]) -> bool:
    """Whether they are whole numbers."""
    return int in get_type_hints(record).values()


@cache
def dtype_in(record: type[Numbers]) -> np.dtype[Any]:
    """The numbers' layout for NumPy."""
    item = np.int64 if are_whole(record) else np.float64
    return np.dtype((np.record, [(name, item) for name in names_of(record)]))


def numbers(record: type[Numbers], **values: float) -> Any:
    """Numbers of one's own; those not given are 0."""
    made = np.zeros((), dtype_in(record))[()]  # type: ignore[arg-type]
    for name, value in values.items():
        made[name] = value
    return made


def flat(values: Any) -> NDArray[Any]:
    """Numbers as a flat array, the same memory."""
    array = np.asarray(values).reshape(1)
    return array.view(array.dtype[0])


class _Place(types.Type):
    """The address of some numbers, of the type that the array they lie in has."""

    def __init__(self, record: type[Numbers], item: types.Type) -> None:
        self.names, self.item = names_of(record), item
        super().__init__(name=f"Numbers({record.__module__}.{record.__qualname__}, {item})")


@register_model(_Place)
class _PlaceModel(models.PrimitiveModel):
    def __init__(self, manager: Any, kind: Any) -> None:
        item = manager.lookup(kind.item).get_value_type()
        super().__init__(manager, kind, item.as_pointer())


@infer_getattr
class _PlaceNames(AttributeTemplate):
    key = _Place

    def generic_resolve(self, place: Any, name: str) -> Any:
        return place.item if name in place.names else None


def _entry(builder: Any, kind: Any, place: Any, name: str) -> Any:
    return builder.gep(place, [cgutils.intp_t(kind.names.index(name))])


@lower_getattr_generic(_Place)
def _get(context: Any, builder: Any, kind: Any, place: Any, name: str) -> Any:
    return builder.load(_entry(builder, kind, place, name))


@lower_setattr_generic(_Place)
def _set(context: Any, builder: Any, signature: Any, arguments: Any, name: str) -> None:
    kind, given = signature.args
    value = context.cast(builder, arguments[1], given, kind.item)
    builder.store(value, _entry(builder, kind, arguments[0], name))


@cache
def numbers_in(record: type[Numbers]) -> Callable[..., Any]:
    """The kernel ``found(flat, at)``: numbers that begin at an entry of a flat array, by name."""
    count, dtype = len(names_of(record)), dtype_in(record)  # type: ignore[arg-type]

    def found(flat, at):
        return flat[at : at + count].view(dtype)[0]

    @intrinsic
    def place(typingctx: Any, flat: Any, at: Any) -> Any:
        def codegen(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
            array = make_array(flat)(context, builder, arguments[0])
            return builder.gep(array.data, [arguments[1]])

        return _Place(record, flat.dtype)(flat, types.intp), codegen

    @overload(found, jit_options=KERNEL)
    def _found(flat, at):
        return lambda flat, at: place(flat, at)

    return found


@overload(address_in, jit_options=KERNEL)
def _address_in(numbers):
    return (lambda numbers: _address(numbers)) if isinstance(numbers, _Place) else None


@intrinsic
def _address(typingctx: Any, numbers: Any) -> Any:
    def codegen(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        return builder.ptrtoint(arguments[0], cgutils.intp_t)

    return types.int64(numbers), codegen
