"""Where fields lie in MuJoCo's C structs, by the declarations that its package brings along."""

import ctypes
from functools import cache
from typing import Any

import mujoco
from mujoco.introspect import ast_nodes
from mujoco.introspect.structs import STRUCTS

from gne_mj.errors import EngineError

SCALARS: dict[str, Any] = {
    "char": ctypes.c_char, "float": ctypes.c_float, "int": ctypes.c_int,
    "size_t": ctypes.c_size_t, "uint64_t": ctypes.c_uint64, "uintptr_t": ctypes.c_void_p,
    "mjtBool": ctypes.c_bool, "mjtByte": ctypes.c_ubyte, "mjtSize": ctypes.c_int64,
    "mjtNum": ctypes.c_double if mujoco.MJTNUM_DTYPE().itemsize == 8 else ctypes.c_float,
}  # fmt: skip


def unknown_layout(name: str) -> EngineError:
    """For a field that is not where the declarations have it."""
    return EngineError(
        f"MuJoCo {mujoco.__version__} keeps {name} elsewhere than expected, so its simulations"
        " cannot be driven natively"
    )


@cache
def structure(name: str) -> Any:
    """The ctypes.Structure of a struct of MuJoCo's, as "mjData".

    Raises:
        EngineError: there is no such struct, or one of its fields has a type that is not known.
    """
    if name not in STRUCTS:
        raise unknown_layout(name)
    return _structure(STRUCTS[name].fields)


def _structure(fields: Any) -> Any:
    members = [(field.name, _type(field.type)) for field in fields]
    return type("Struct", (ctypes.Structure,), {"_fields_": members})


def _type(declared: Any) -> Any:
    if isinstance(declared, ast_nodes.PointerType):
        return ctypes.c_void_p
    if isinstance(declared, ast_nodes.ArrayType):
        kind = _type(declared.inner_type)
        for extent in reversed(declared.extents):
            kind = kind * extent
        return kind
    if isinstance(declared, ast_nodes.AnonymousStructDecl):
        return _structure(declared.fields)
    if isinstance(declared, ast_nodes.ValueType):
        return SCALARS[declared.name] if declared.name in SCALARS else structure(declared.name)
    raise unknown_layout(f"a field of type {declared}")


def word_of(struct: str, *path: str) -> int:
    """A field's place in a struct, or in a struct within, in 8-byte words from the start.

    Raises:
        EngineError: there is no such field, or it does not take 8 bytes.
    """
    kind, offset = structure(struct), 0
    for name in path:
        if not hasattr(kind, name):
            raise unknown_layout(".".join((struct, *path)))
        offset += getattr(kind, name).offset
        size, kind = getattr(kind, name).size, dict(kind._fields_)[name]
    if size != 8 or offset % 8:
        raise unknown_layout(".".join((struct, *path)))
    return offset // 8


def block_of(struct: str, name: str) -> int:
    """An array's place within a struct, in 8-byte words from the start.

    Raises:
        EngineError: there is no such field, or it is no array of items of 8 bytes.
    """
    kind = structure(struct)
    place, item = getattr(kind, name, None), getattr(dict(kind._fields_).get(name), "_type_", None)
    if place is None or item is None or ctypes.sizeof(item) != 8 or place.offset % 8:
        raise unknown_layout(f"{struct}.{name}")
    return int(place.offset) // 8


def arrays(struct: str) -> list[str]:
    """Names of the fields that point to arrays of numbers (mjtNum)."""
    return [
        field.name
        for field in STRUCTS[struct].fields
        if isinstance(field.type, ast_nodes.PointerType)
        and getattr(field.type.inner_type, "name", "") == "mjtNum"
    ]
