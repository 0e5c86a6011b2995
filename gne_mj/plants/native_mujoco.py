"""MuJoCo's C side, for compiled code: struct fields, mj_step, and callbacks.

MuJoCo calls plain C functions ``(const mjModel*, mjData*)`` where it evaluates control and passive
forces. What such a callback needs is reached through two pointers: a field's offset inside mjData
is found at start-up by looking for its array's address in the struct's memory and is checked by
writing and reading back; everything else lies in a table of arrays. ``userdata`` begins with a
mark that says whose simulation this is, and that table's address. A simulation without the mark is
left alone.
"""

import ctypes
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from functools import cache
from pathlib import Path
from typing import Any, NamedTuple

import mujoco
import numpy as np
from numba import types
from numba.core import cgutils
from numba.extending import intrinsic

from gne_mj.errors import EngineError
from gne_mj.native import array_at, callback, compiled, kernel, load_word

CALLBACK = types.void(types.voidptr, types.voidptr)
ACTIVATION = types.float64(types.voidptr, types.voidptr, types.int32)
_FUNCTION = ctypes.CFUNCTYPE(None, ctypes.c_void_p, ctypes.c_void_p)
_DYNAMICS = ctypes.CFUNCTYPE(ctypes.c_double, ctypes.c_void_p, ctypes.c_void_p, ctypes.c_int)
_WARNING = ctypes.CFUNCTYPE(None, ctypes.c_void_p)


# What userdata begins with. All zero, as after a reset, means "not started".
MARK, TABLE_ADDRESS, USERDATA_HEADER = range(3)
# Marks: numbers that nobody else would write there by chance.
PLANT_MARK, LOOP_MARK = 7.390125461e173, 5.870193424e191


class Offsets(NamedTuple):
    """Where fields lie in MuJoCo's structs, in 8-byte words from the struct's start."""

    qpos: int
    qvel: int
    ctrl: int
    act: int
    act_dot: int
    qfrc_passive: int
    qacc_warmstart: int
    sensordata: int
    userdata: int
    time: int  # a number in mjData itself
    nuserdata: int  # in mjModel
    timestep: int  # mjModel.opt.timestep, a number in mjModel itself


@cache
def offsets() -> Offsets:
    """Find and check the offsets in the MuJoCo that is loaded.

    Raises:
        EngineError: a field is not where its address says, so this MuJoCo cannot be driven.
    """
    size = 7919  # a number that no other size of the probe model has
    model = mujoco.MjModel.from_xml_string(
        f"""<mujoco><size nuserdata="{size}"/><worldbody><body><joint name="j" type="slide"/>
        <geom size="1"/></body></worldbody><actuator><intvelocity joint="j"/></actuator>
        <sensor><jointvel joint="j"/></sensor></mujoco>"""
    )
    data = mujoco.MjData(model)
    names = [name for name in Offsets._fields if name not in ("time", "nuserdata", "timestep")]
    found = {name: _find(data._address, getattr(data, name).ctypes.data) for name in names}
    data.time = model.opt.timestep = 0.7919
    result = Offsets(
        **found,
        time=_find(data._address, _bits(0.7919)),
        nuserdata=_find(model._address, size),
        timestep=_find(model._address, _bits(0.7919)),
    )
    read_back = _read_back()
    for mark, name in enumerate(names, start=1):
        array = getattr(data, name)
        array[0] = mark
        if read_back(data._address, getattr(result, name)) != mark or array[0] != -mark:
            raise _unknown_layout(f"mjData.{name}")
    other = mujoco.MjModel.from_xml_string('<mujoco><size nuserdata="6133"/></mujoco>')
    if ctypes.c_int64.from_address(other._address + 8 * result.nuserdata).value != 6133:
        raise _unknown_layout("mjModel.nuserdata")
    ctypes.c_double.from_address(data._address + 8 * result.time).value = 0.25
    ctypes.c_double.from_address(model._address + 8 * result.timestep).value = 0.5
    if data.time != 0.25 or model.opt.timestep != 0.5:
        raise _unknown_layout("mjData.time or mjModel.opt.timestep")
    return result


def _bits(number: float) -> int:
    """A double as the 8-byte integer of the same bits."""
    return int(np.float64(number).view(np.int64))


def _unknown_layout(name: str) -> EngineError:
    return EngineError(
        f"MuJoCo {mujoco.__version__} keeps {name} elsewhere than expected, so its simulations"
        " cannot be driven natively"
    )


def _find(struct: int, word: int) -> int:
    """Index of the first 8-byte word with this content; the struct is known to contain it."""
    block = 64  # read little past a match: pointers are followed by hundreds of other fields
    for start in range(0, 2**17, block):
        words = (ctypes.c_int64 * block).from_address(struct + 8 * start)
        for index, content in enumerate(words):
            if content == word:
                return start + index
    raise _unknown_layout("a field")


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


@intrinsic
def call(typingctx: Any, function: Any, model: Any, data: Any) -> Any:
    """Call the C function at an address with two struct addresses."""

    def codegen(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        from llvmlite import ir

        pointer = cgutils.voidptr_t
        kind = ir.FunctionType(ir.VoidType(), [pointer, pointer])
        target = builder.inttoptr(arguments[0], kind.as_pointer())
        builder.call(target, [builder.inttoptr(a, pointer) for a in arguments[1:]])
        return context.get_dummy_value()

    return types.void(types.int64, types.int64, types.int64), codegen


@cache
def step_address(function: str = "mj_step") -> int:
    """Address of mj_step, or of another function (model, data), in the library in use."""
    folder = Path(mujoco.__file__).parent
    for path in sorted([*folder.glob("libmujoco.*"), *folder.glob("mujoco.dll")]):
        library = ctypes.CDLL(str(path))
        return ctypes.cast(getattr(library, function), ctypes.c_void_p).value or 0
    raise EngineError(f"the MuJoCo library is not in the package's folder {folder}")


@kernel
def table_of(at, model, data):
    """Address of a simulation's table, given both structs' addresses.

    0 for a simulation that is not ours; negative for that of a plant without a loop.
    """
    if word(model, at.nuserdata) < USERDATA_HEADER:
        return np.int64(0)
    userdata = field(data, at.userdata, USERDATA_HEADER)
    if userdata[MARK] == LOOP_MARK:
        return np.int64(userdata[TABLE_ADDRESS])
    if userdata[MARK] == PLANT_MARK:
        return -np.int64(userdata[TABLE_ADDRESS])
    return np.int64(0)


@cache
def _silence() -> Any:
    def ignore(message):
        pass

    return callback(types.void(types.voidptr), ignore)


_installed = threading.Lock()


@contextmanager
def callbacks(
    *, control: Any = None, passive: Any = None, activation: Any = None
) -> Iterator[None]:
    """Install C callbacks (numba ``cfunc`` objects) for a while; always restores what was there.

    MuJoCo's warnings are silenced meanwhile: they would be written to a log file in the working
    folder, and what they warn of is in the monitor.

    Raises:
        EngineError: callbacks are global to the process, and ours are installed already.
    """
    if not _installed.acquire(blocking=False):
        raise EngineError(
            "MuJoCo's callbacks are global to the process and already in use by another"
            " simulation that is stepping right now: step one at a time"
        )
    try:
        before = (
            mujoco.get_mjcb_control(),
            mujoco.get_mjcb_passive(),
            mujoco.get_mjcb_act_dyn(),
            mujoco.get_mju_user_warning(),
        )
        try:
            mujoco.set_mjcb_control(control and _FUNCTION(control.address))
            mujoco.set_mjcb_passive(passive and _FUNCTION(passive.address))
            mujoco.set_mjcb_act_dyn(activation and _DYNAMICS(activation.address))
            mujoco.set_mju_user_warning(_WARNING(_silence().address))
            yield
        finally:
            mujoco.set_mjcb_control(before[0])
            mujoco.set_mjcb_passive(before[1])
            mujoco.set_mjcb_act_dyn(before[2])
            mujoco.set_mju_user_warning(before[3])
    finally:
        _installed.release()
