"""MuJoCo's contacts, for compiled code: how many there are, of which geoms, how deep."""

import ctypes
from functools import cache
from typing import Any, NamedTuple

import mujoco
import numpy as np
from numba import types
from numba.extending import intrinsic

from gne_mj.native import compiled, kernel
from gne_mj.plants.c_layout import structure, unknown_layout, word_of
from gne_mj.plants.native_mujoco import number, word


class ContactOffsets(NamedTuple):
    """Where contacts lie: in bytes, but the pointer to them in 8-byte words as other fields."""

    number: int  # mjData.ncon
    first: int  # mjData.contact
    size: int  # of an mjContact
    distance: int  # within one
    geoms: int  # two, of 4 bytes each


# Three spheres that all overlap each other
_PROBE = """
<mujoco><worldbody>
  <body><freejoint/><geom size="1"/></body>
  <body pos="1 0 0"><freejoint/><geom size="1"/></body>
  <body pos="0.5 0.7 0"><freejoint/><geom size="1"/></body>
</worldbody></mujoco>"""


@cache
def contact_offsets() -> ContactOffsets:
    """The offsets in the MuJoCo that is loaded, checked in it.

    Raises:
        EngineError: contacts are not where they are declared.
    """
    data_struct, contact = structure("mjData"), structure("mjContact")
    if not hasattr(data_struct, "ncon") or not {"dist", "geom"} <= set(dict(contact._fields_)):
        raise unknown_layout("mjData.contact")
    found = ContactOffsets(
        data_struct.ncon.offset,
        word_of("mjData", "contact"),
        ctypes.sizeof(contact),
        contact.dist.offset,
        contact.geom.offset,
    )
    model = mujoco.MjModel.from_xml_string(_PROBE)
    data = mujoco.MjData(model)
    mujoco.mj_fwdPosition(model, data)
    rows = np.full((3, 3), np.nan)
    seen = _reader()(found, data._address, rows)
    expected = np.column_stack([data.contact.geom, data.contact.dist])
    if seen != 3 or not np.array_equal(rows, expected):
        raise unknown_layout("mjData.contact")
    return found


@cache
def _reader() -> Any:
    @compiled
    def read(at, data, rows):
        count = contacts(at, data)
        for k in range(min(count, len(rows))):
            rows[k, 0], rows[k, 1] = geoms(at, data, k)
            rows[k, 2] = distance(at, data, k)
        return count

    return read


@intrinsic
def _short(typingctx: Any, address: Any) -> Any:
    """The 4-byte integer at an address."""

    def codegen(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        from llvmlite import ir

        kind = ir.IntType(32)
        value = builder.load(builder.inttoptr(arguments[0], kind.as_pointer()))
        return builder.sext(value, ir.IntType(64))

    return types.int64(types.int64), codegen


@kernel
def contacts(at, data):
    """How many contacts mjData at an address has."""
    return _short(data + at.number)


@kernel
def geoms(at, data, k):
    """The two geoms of its contact k; negative where a flex is in one's place."""
    pair = word(data, at.first) + k * at.size + at.geoms
    return _short(pair), _short(pair + 4)


@kernel
def distance(at, data, k):
    """Between them in m, negative where they overlap."""
    return number(word(data, at.first) + k * at.size + at.distance, 0)
