"""MuJoCo's C side, for compiled code: struct fields, functions, and callbacks.

MuJoCo calls plain C functions ``(const mjModel*, mjData*)`` where it evaluates control and passive
forces. What such a callback needs is reached through two pointers: a field's offset inside mjData
is that of MuJoCo's own declarations (:mod:`gne_mj.plants.c_layout`) and is checked by writing and
reading back; everything else lies in a table of arrays. ``userdata`` begins with a
mark that says whose simulation this is, and that table's address. A simulation without the mark is
left alone.
"""

import ctypes
from functools import cache
from pathlib import Path
from types import ModuleType
from typing import Any, NamedTuple

import mujoco
import numpy as np
from numba import types
from numba.core import cgutils
from numba.extending import intrinsic
from numpy.typing import NDArray

from gne_mj.errors import EngineError
from gne_mj.native import (
    array_at,
    callback,
    compiled,
    intrinsic_or,
    kernel,
    load_word,
    source_key,
)
from gne_mj.numbers import Numbers, names_of, numbers_in
from gne_mj.plants.c_layout import arrays, block_of, unknown_layout, word_of

CALLBACK = types.void(types.voidptr, types.voidptr)
ACTIVATION = types.float64(types.voidptr, types.voidptr, types.int32)

_BITS = mujoco.mjtState
# What a step of MuJoCo moves, so that putting it back is as if the step had not been taken
STATE = int(_BITS.mjSTATE_FULLPHYSICS | _BITS.mjSTATE_WARMSTART)
# All that it starts from and a law may know of, to look ahead: not the pushes from outside, and
# not the loops' own userdata
KNOWN_STATE = int(_BITS.mjSTATE_INTEGRATION) & ~int(
    _BITS.mjSTATE_QFRC_APPLIED | _BITS.mjSTATE_XFRC_APPLIED | _BITS.mjSTATE_USERDATA
)


class Header(Numbers):
    """What userdata begins with. All zero, as after a reset, means "not started"."""

    mark: float  # whose simulation this is
    parameter_block: float  # its address


USERDATA_HEADER = len(names_of(Header))
_header_in = numbers_in(Header)
# Marks: numbers that nobody else would write there by chance.
PLANT_MARK, LOOP_MARK = 7.390125461e173, 5.870193424e191


class Offsets(NamedTuple):
    """Where fields lie in MuJoCo's structs, in 8-byte words from the struct's start.

    Attributes:
        nuserdata: of mjModel, as ``timestep`` of its options; all others are mjData's.
    """

    qpos: int
    qvel: int
    ctrl: int
    act: int
    act_dot: int
    qfrc_passive: int
    qacc_warmstart: int
    sensordata: int
    userdata: int
    time: int
    warning: int
    nuserdata: int
    timestep: int


# Of its arrays of numbers about those of Offsets none is empty but a plug-in's state, so that no
# two have the same address
_PROBE = """
<mujoco>
  <size nuserdata="7919"/>
  <worldbody>
    <camera/><light/>
    <body mocap="true"><geom size="1"/></body>
    <body><joint name="j" type="slide"/><geom size="1"/><site/></body>
  </worldbody>
  <tendon><fixed><joint joint="j" coef="1"/></fixed></tendon>
  <actuator><intvelocity joint="j" delay="0.01" nsample="2"/></actuator>
  <sensor><jointvel joint="j"/></sensor>
</mujoco>"""


@cache
def offsets() -> Offsets:
    """The offsets in the MuJoCo that is loaded, checked in it.

    Raises:
        EngineError: a field is not where it is declared, so this MuJoCo cannot be driven.
    """
    result = Offsets(
        **{name: word_of("mjData", name) for name in Offsets._fields[:-3]},
        warning=block_of("mjData", "warning"),
        nuserdata=word_of("mjModel", "nuserdata"),
        timestep=word_of("mjModel", "opt", "timestep"),
    )
    model = mujoco.MjModel.from_xml_string(_PROBE)
    data = mujoco.MjData(model)
    _check_arrays(data)
    for kind in LOST:
        data.warning[kind].number = 1
        pair = ctypes.c_int64.from_address(data._address + 8 * (result.warning + kind)).value
        if pair >> 32 != 1:
            raise unknown_layout("mjData.warning")
        data.warning[kind].number = 0
    if ctypes.c_int64.from_address(model._address + 8 * result.nuserdata).value != 7919:
        raise unknown_layout("mjModel.nuserdata")
    for struct, name, address in (
        (data, "time", data._address + 8 * result.time),
        (model.opt, "timestep", model._address + 8 * result.timestep),
    ):
        number = ctypes.c_double.from_address(address)
        setattr(struct, name, 0.7919)
        seen, number.value = number.value, 0.25
        if seen != 0.7919 or getattr(struct, name) != 0.25:
            raise unknown_layout(name)
    return result


def _check_arrays(data: mujoco.MjData) -> None:
    """Write into every array up to the last one of Offsets, and read it back natively."""
    names = arrays("mjData")
    names = names[: 1 + max(names.index(name) for name in Offsets._fields if name in names)]
    read_back = _read_back()
    for mark, name in enumerate(names, start=1):
        array = getattr(data, name).reshape(-1)
        if not array.size:
            if name in Offsets._fields:
                raise unknown_layout(f"mjData.{name}")
            continue
        at = word_of("mjData", name)
        if ctypes.c_int64.from_address(data._address + 8 * at).value != array.ctypes.data:
            raise unknown_layout(f"mjData.{name}")
        array[0] = mark
        if read_back(data._address, at) != mark or array[0] != -mark:
            raise unknown_layout(f"mjData.{name}")


@cache
def _read_back() -> Any:
    @compiled
    def read_back(struct, offset):
        array = field(struct, offset, 1)
        mark = array[0]
        array[0] = -mark
        return mark

    return read_back


@intrinsic
def word(typingctx: Any, struct: Any, offset: Any) -> Any:
    """The 8-byte integer at an offset in the struct at an address."""

    def codegen(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        return load_word(builder, _at_word(context, builder, *arguments))

    return types.int64(types.int64, types.int64), codegen


@intrinsic
def field(typingctx: Any, struct: Any, offset: Any, length: Any) -> Any:
    """The double array of a length that a pointer field of the struct at an address points to."""
    kind = types.Array(types.float64, 1, "C")

    def codegen(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        pointer = load_word(builder, _at_word(context, builder, *arguments[:2]))
        return array_at(context, builder, kind, pointer, arguments[2])

    return kind(types.int64, types.int64, types.int64), codegen


@intrinsic
def number(typingctx: Any, struct: Any, offset: Any) -> Any:
    """The double at an offset in the struct at an address."""

    def codegen(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        kind = context.get_value_type(types.float64)
        place = _at_word(context, builder, *arguments)
        return builder.load(builder.inttoptr(place, kind.as_pointer()))

    return types.float64(types.int64, types.int64), codegen


@intrinsic
def set_number(typingctx: Any, struct: Any, offset: Any, number: Any) -> Any:
    """Set the double at an offset in the struct at an address."""

    def codegen(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        place = _at_word(context, builder, *arguments[:2])
        builder.store(arguments[2], builder.inttoptr(place, arguments[2].type.as_pointer()))
        return context.get_dummy_value()

    return types.void(types.int64, types.int64, types.float64), codegen


def _at_word(context: Any, builder: Any, struct: Any, offset: Any) -> Any:
    return builder.add(struct, builder.mul(offset, context.get_constant(types.intp, 8)))


@intrinsic
def address_of(typingctx: Any, pointer: Any) -> Any:
    """A ``void *`` as an integer address."""

    def codegen(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        return builder.ptrtoint(arguments[0], cgutils.intp_t)

    return types.int64(types.voidptr), codegen


def _called(function: int, model: int, data: int) -> None:
    ctypes.CFUNCTYPE(None, ctypes.c_void_p, ctypes.c_void_p)(int(function))(int(model), int(data))


@intrinsic_or(_called)
def call(typingctx: Any, function: Any, model: Any, data: Any) -> Any:
    """Call the C function at an address with two struct addresses."""

    def codegen(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        _call(builder, arguments[0], arguments[1:])
        return context.get_dummy_value()

    return types.void(types.int64, types.int64, types.int64), codegen


@intrinsic
def call_state(
    typingctx: Any, function: Any, model: Any, source: Any, target: Any, parts: Any
) -> Any:
    """Call mj_getState, mj_setState or mj_copyState at an address.

    Args:
        function: its address.
        model, source, target: addresses, in the order that the function has them.
        parts: bits of mjtState.
    """

    def codegen(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        parts = builder.trunc(arguments[4], cgutils.int32_t)
        _call(builder, arguments[0], arguments[1:4], parts)
        return context.get_dummy_value()

    return types.void(*[types.int64] * 5), codegen


def _call(builder: Any, function: Any, pointers: Any, *more: Any) -> None:
    from llvmlite import ir

    pointer = cgutils.voidptr_t
    kinds = [pointer] * len(pointers) + [value.type for value in more]
    target = builder.inttoptr(function, ir.FunctionType(ir.VoidType(), kinds).as_pointer())
    builder.call(target, [builder.inttoptr(a, pointer) for a in pointers] + list(more))


@cache
def state_functions() -> tuple[int, int, int]:
    """What loops take steps back with: addresses of mj_getState and mj_setState, and STATE."""
    return step_address("mj_getState"), step_address("mj_setState"), STATE


# The arrays of STATE, besides the time
_STATE_ARRAYS = ("qpos", "qvel", "act", "history", "qacc_warmstart", "plugin_state")


def state_parts(data: mujoco.MjData) -> NDArray[np.int64]:
    """(k, 2) addresses and lengths of what STATE consists of, wherever it has an entry."""
    arrays = [array for name in _STATE_ARRAYS if (array := getattr(data, name)).size]
    time = data._address + 8 * offsets().time
    return np.array([(time, 1), *((array.ctypes.data, array.size) for array in arrays)])


@cache
def library() -> ctypes.CDLL:
    """The MuJoCo library in use."""
    folder = Path(mujoco.__file__).parent
    for path in sorted([*folder.glob("libmujoco.*"), *folder.glob("mujoco.dll")]):
        return ctypes.CDLL(str(path))
    raise EngineError(f"the MuJoCo library is not in the package's folder {folder}")


@cache
def step_address(function: str = "mj_step") -> int:
    """Address of mj_step, or of another function (model, data), in the library in use."""
    return ctypes.cast(getattr(library(), function), ctypes.c_void_p).value or 0


@kernel
def timed_step(at, mj_step, model, data):
    """One step of MuJoCo from a time that is its multiple to the bit, given addresses.

    By these times late controls are found in their history; a sum of steps would miss them.
    """
    h = number(model, at.timestep)
    set_number(data, at.time, np.rint(number(data, at.time) / h) * h)
    call(mj_step, model, data)


@kernel
def parameter_block_of(at, model, data):
    """Address of a simulation's table, given both structs' addresses.

    0 for a simulation that is not ours; negative for that of a plant without a loop.
    """
    if word(model, at.nuserdata) < USERDATA_HEADER:
        return np.int64(0)
    header = _header_in(field(data, at.userdata, USERDATA_HEADER), 0)
    if header.mark == LOOP_MARK:
        return np.int64(header.parameter_block)
    if header.mark == PLANT_MARK:
        return -np.int64(header.parameter_block)
    return np.int64(0)


@cache
def passive_callback(at: Offsets, fleet: ModuleType) -> Any:
    """The C callback of a fleet's passive forces; simulations that are not ours are left alone.

    Args:
        at: MuJoCo's own offsets.
        fleet: the module that has the kernel ``add_forces(at, data, parameter_block)``, which adds
            to mjData's qfrc_passive (N, N m), given the addresses of mjData and parameter block.
    """
    source = source_key()

    def passive(model, data):
        _ = source
        struct = address_of(data)
        parameter_block = abs(parameter_block_of(at, address_of(model), struct))
        if parameter_block != 0:
            fleet.add_forces(at, struct, parameter_block)

    return callback(CALLBACK, passive)


# MuJoCo's warnings that what follows is not the model's motion; what else it warns of shows in runs
LOST = {
    int(mujoco.mjtWarning.mjWARN_INERTIA): "met an inertia that is nearly singular, took another",
    int(mujoco.mjtWarning.mjWARN_CONTACTFULL): "ran out of memory, left out contacts",
    int(mujoco.mjtWarning.mjWARN_CNSTRFULL): "ran out of memory, left out constraints",
}
_LOST = tuple(LOST)
_DIVERGED = int(mujoco.mjtWarning.mjWARN_BADQACC)  # accelerations that are no numbers, or huge


def lost_text(kind: int) -> str:
    """What has become of a motion after one of these warnings, and what to do."""
    return (
        f"MuJoCo {LOST[kind]}, so that what follows would not be the model's motion: see to its"
        " contacts and masses, or give more <size memory>"
    )


@kernel
def forces_lost(at, data, nv):
    """Of which of LOST MuJoCo has warned, or -1. A warning is a pair of int: what of, how often.

    -1 too where accelerations were huge or velocities (nv) are no longer finite: then that is the
    reason, as thousands of contacts of what flies through itself may be.
    """
    for kind in _LOST:
        if word(data, at.warning + kind) >> 32 != 0:
            if word(data, at.warning + _DIVERGED) >> 32 != 0:
                return -1
            qvel = field(data, at.qvel, nv)
            for r in range(nv):
                if not np.isfinite(qvel[r]):
                    return -1
            return kind
    return -1


def check_warnings(data: mujoco.MjData) -> None:
    """Refuse to go on where MuJoCo has left out forces, and not for numbers that are not finite.

    Raises:
        EngineError: contacts or constraints did not fit, or an inertia is singular.
    """
    diverged = data.warning[_DIVERGED].number or not np.all(np.isfinite(data.qvel))
    for kind in LOST:
        if data.warning[kind].number and not diverged:
            raise EngineError(f"by {data.time:.6g} s {lost_text(kind)}")
