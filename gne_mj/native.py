"""How a law, a game or an agent is compiled once and used by every engine.

A *kernel* is a plain Python function marked with :func:`kernel`. It can be called from Python as
it stands, and numba inlines it into any native loop that uses it. Kernels and loops work on arrays
that they are given and allocate nothing. Games, agents and laws are
modules of kernels with agreed names; a native loop is a function built for such modules by a
factory, so that each rule is written in one place and serves the ODE twin, MuJoCo's callbacks and
the array API alike.

With numba switched off (``NUMBA_DISABLE_JIT=1``) kernels and the loops of ODE agents run as the
plain Python that they are written in, slowly, for whoever debugs a kernel.
"""

import ctypes
import hashlib
import inspect
import math
from collections.abc import Callable
from types import ModuleType
from typing import Any, TypeVar

import numba
import numpy as np
from numba import njit, types
from numba.core import cgutils
from numba.extending import intrinsic, overload, register_jitable
from numba.np.arrayobj import make_array, populate_array

from gne_mj.kernel_cache import package_digest
from gne_mj.kernel_compiler import KernelCompiler, LoopCompiler
from gne_mj.machine_code import kept

F = TypeVar("F", bound=Callable[..., Any])

# Compiled division must give inf or nan, as NumPy does: numba's default raises, and a callback
# that raises can only print. Without numba's run time ("_nrt") nothing can be allocated, which
# the compiler then checks, and array views cost no reference counting (a factor of 20 here).
KERNEL: dict[str, Any] = {
    "error_model": "numpy",
    "_nrt": False,
    "forceinline": True,
    "no_cfunc_wrapper": True,
    "no_cpython_wrapper": True,
    "pipeline_class": KernelCompiler,
}
_CALLBACK: dict[str, Any] = {
    "error_model": "numpy",
    "_nrt": False,
    "pipeline_class": LoopCompiler,
}
_LOOP: dict[str, Any] = {**_CALLBACK, "nogil": True, "no_cfunc_wrapper": True}

INTERPRETED = bool(numba.config.DISABLE_JIT)  # numba is switched off


def kernel(function: F) -> F:
    """Mark ``function`` as usable from native code (it stays an ordinary Python function)."""
    marked: F = register_jitable(**KERNEL)(function)
    marked.is_kernel = True  # type: ignore[attr-defined]
    return marked


def kernel_as(native: Callable[..., Any], function: F) -> F:
    """Mark ``function`` as a kernel that native code has ``native`` for, which does the same."""
    overload(function, jit_options=KERNEL, strict=False)(lambda *_given, **_named: native)
    function.is_kernel = True  # type: ignore[attr-defined]
    return function


def is_kernel(function: Any) -> bool:
    """Whether a function was marked with :func:`kernel`."""
    return bool(getattr(function, "is_kernel", False))


def compiled(function: Callable[..., Any]) -> Any:
    """Compile a native loop; machine code is kept on disk between processes.

    A function that calls kernels of other files must hold :func:`source_key` of them in its
    closure, since numba notices a changed closure but not a changed callee.
    """
    return kept(lambda cache: njit(cache=cache, **_LOOP)(function))


def callback(signature: types.Type, function: Callable[..., Any]) -> Any:
    """Compile a C callback (numba's ``cfunc``), kept on disk as :func:`compiled` does."""
    if INTERPRETED:
        return _Interpreted(function)
    return kept(lambda cache: numba.cfunc(signature, cache=cache, **_CALLBACK)(function))


class _Interpreted:
    """Stands for a compiled callback where numba is switched off; its address is only a number."""

    def __init__(self, function: Callable[..., Any]) -> None:
        def called(*arguments: Any) -> Any:
            with np.errstate(all="ignore"):  # division as in compiled code
                return function(*arguments)

        self.ctypes = called
        self.address = 8 * (len(_interpreted) + 1)  # where no C function is
        _interpreted[self.address] = called


_interpreted: dict[int, Callable[..., Any]] = {}


def intrinsic_or(plain: Callable[..., Any]) -> Callable[[Callable[..., Any]], Any]:
    """Make an intrinsic, of what Python cannot say; or ``plain`` where numba is switched off."""
    return (lambda written: plain) if INTERPRETED else intrinsic


def source_key(*modules: ModuleType) -> str:
    """Digest of this package's sources and of ``modules``' own, for a compiled closure to hold."""
    digest = hashlib.sha256(package_digest().encode())
    for module in modules:
        digest.update(inspect.getsource(module).encode())
    return digest.hexdigest()[:16]


@kernel
def copy(source, target):
    """target[r] = source[r]; unlike a slice assignment it never makes a temporary array."""
    for r in range(len(source)):
        target[r] = source[r]


def load_word(builder: Any, address: Any) -> Any:
    """For intrinsics: LLVM code that reads the 8-byte integer at an address."""
    return builder.load(builder.inttoptr(address, cgutils.intp_t.as_pointer()))


def array_at(context: Any, builder: Any, kind: types.Array, address: Any, length: Any) -> Any:
    """For intrinsics: LLVM code that takes the memory at an address as a contiguous array.

    ``numba.carray`` does the same, but not without numba's run time. The items have 8 bytes.
    """
    array = make_array(kind)(context, builder)
    size = context.get_constant(types.intp, 8)
    populate_array(
        array,
        data=builder.inttoptr(address, array.data.type),
        shape=[length],
        strides=[size],
        itemsize=size,
        meminfo=None,
    )
    return array._getvalue()


@intrinsic
def _address(typingctx: Any, array: Any) -> Any:
    def codegen(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        found = cgutils.create_struct_proxy(array)(context, builder, value=arguments[0])
        return builder.ptrtoint(found.data, cgutils.intp_t)

    return types.int64(array), codegen


def address_in(array):
    """The address of an array's first entry, or of numbers (:mod:`gne_mj.numbers`)."""
    return np.asarray(array).ctypes.data


@overload(address_in, jit_options=KERNEL)
def _address_in(array):
    return (lambda array: _address(array)) if isinstance(array, types.Array) else None


@intrinsic_or(lambda array, begin, length: array[begin : begin + length])
def part(typingctx: Any, array: Any, begin: Any, length: Any) -> Any:
    """So many entries of a contiguous array from one on; neither number is looked at.

    A slice is made to fit into its array, which takes native code longer than the view itself.
    """

    def codegen(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        data = make_array(array)(context, builder, arguments[0]).data
        address = builder.ptrtoint(builder.gep(data, [arguments[1]]), cgutils.intp_t)
        return array_at(context, builder, array, address, arguments[2])

    return array(array, types.intp, types.intp), codegen


@intrinsic_or(lambda array, shape: array[: math.prod(shape)].reshape(shape))
def shaped(typingctx: Any, array: Any, shape: Any) -> Any:
    """A contiguous array's first entries with other dimensions; their number is not looked at."""
    kind = types.Array(array.dtype, len(shape), "C")

    def codegen(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        old = make_array(array)(context, builder, arguments[0])
        new = make_array(kind)(context, builder)
        sizes = cgutils.unpack_tuple(builder, arguments[1])
        strides = [old.itemsize]
        for size in reversed(sizes[1:]):
            strides.insert(0, builder.mul(strides[0], size))
        populate_array(
            new, data=old.data, shape=sizes, strides=strides, itemsize=old.itemsize, meminfo=None
        )
        return new._getvalue()

    return kind(array, shape), codegen


def _of_c(builder: Any, name: str, result: Any, argument: Any, given: Any) -> Any:
    """For intrinsics: LLVM code that calls a function of the C library."""
    from llvmlite import ir

    kind = ir.FunctionType(result, [argument])
    return builder.call(cgutils.get_or_insert_function(builder.module, kind, name), [given])


@intrinsic_or(lambda length: np.zeros(length))
def reserved(typingctx: Any, length: Any) -> Any:
    """Room for so many floats, whatever they are, until :func:`released`.

    For the few kernels whose scratch no loop has: it costs a call of the C library.
    """
    kind = types.Array(types.float64, 1, "C")

    def codegen(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        word = cgutils.intp_t
        size = builder.mul(arguments[0], word(8))
        found = _of_c(builder, "malloc", cgutils.voidptr_t, word, size)
        address = builder.ptrtoint(found, word)
        return array_at(context, builder, kind, address, arguments[0])

    return kind(types.int64), codegen


@intrinsic_or(lambda array: None)
def released(typingctx: Any, array: Any) -> Any:
    """Give back what :func:`reserved` gave."""

    def codegen(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        from llvmlite import ir

        data = make_array(array)(context, builder, arguments[0]).data
        room = builder.bitcast(data, cgutils.voidptr_t)
        _of_c(builder, "free", ir.VoidType(), cgutils.voidptr_t, room)
        return context.get_dummy_value()

    return types.none(array), codegen


def call(result: Any, function: int, arguments: tuple[Any, ...]) -> Any:
    """Call the C function at an address from Python: whole numbers are int64_t, others double.

    Args:
        result: the ctypes type of what it returns.
        function: its address.
        arguments: what it is given.
    """
    if int(function) in _interpreted:
        return _interpreted[int(function)](*arguments)
    real = [isinstance(value, float) for value in arguments]
    kinds = (ctypes.c_double if each else ctypes.c_int64 for each in real)
    given = (v if each else int(v) for v, each in zip(arguments, real, strict=True))
    return ctypes.CFUNCTYPE(result, *kinds)(int(function))(*given)


def _calling(result: types.Type) -> Any:
    """The intrinsic that calls the C function at an address with a tuple of int64_t and double."""

    @intrinsic
    def called(typingctx: Any, function: Any, arguments: Any) -> Any:
        def codegen(context: Any, builder: Any, signature: Any, given: Any) -> Any:
            from llvmlite import ir

            values = cgutils.unpack_tuple(builder, given[1])
            kind = ir.FunctionType(context.get_value_type(result), [v.type for v in values])
            return builder.call(builder.inttoptr(given[0], kind.as_pointer()), values)

        return result(types.int64, arguments), codegen

    return called


_integer, _number = _calling(types.int64), _calling(types.float64)


def call_integer(function, arguments):
    """Call the C function at an address with a tuple of int64_t and double; it returns int64_t."""
    return call(ctypes.c_int64, function, arguments)


def call_number(function, arguments):
    """The same for a function that returns a double."""
    return call(ctypes.c_double, function, arguments)


@overload(call_integer, jit_options=KERNEL)
def _call_integer(function, arguments):
    return lambda function, arguments: _integer(function, arguments)


@overload(call_number, jit_options=KERNEL)
def _call_number(function, arguments):
    return lambda function, arguments: _number(function, arguments)
