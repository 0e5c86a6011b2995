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

import hashlib
import inspect
from collections.abc import Callable
from functools import cache
from pathlib import Path
from types import ModuleType
from typing import Any, TypeVar

import numba
import numpy as np
from numba import njit, types
from numba.core import cgutils
from numba.extending import intrinsic, register_jitable
from numba.np.arrayobj import make_array, populate_array

from gne_mj.machine_code import kept

F = TypeVar("F", bound=Callable[..., Any])

# Compiled division must give inf or nan, as NumPy does: numba's default raises, and a callback
# that raises can only print. Without numba's run time ("_nrt") nothing can be allocated, which
# the compiler then checks, and array views cost no reference counting (a factor of 20 here).
_KERNEL: dict[str, Any] = {"error_model": "numpy", "_nrt": False, "forceinline": True}
_LOOP: dict[str, Any] = {"error_model": "numpy", "_nrt": False, "nogil": True}

INTERPRETED = bool(numba.config.DISABLE_JIT)  # numba is switched off


def kernel(function: F) -> F:
    """Mark ``function`` as usable from native code (it stays an ordinary Python function)."""
    marked: F = register_jitable(**_KERNEL)(function)
    marked.is_kernel = True  # type: ignore[attr-defined]
    return marked


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
    options: dict[str, Any] = {"error_model": "numpy", "_nrt": False}
    return kept(lambda cache: numba.cfunc(signature, cache=cache, **options)(function))


class _Interpreted:
    """Stands for a compiled callback where numba is switched off: only Python calls it."""

    def __init__(self, function: Callable[..., Any]) -> None:
        def called(*arguments: Any) -> Any:
            with np.errstate(all="ignore"):  # division as in compiled code
                return function(*arguments)

        self.ctypes = self.address = called


def intrinsic_or(plain: Callable[..., Any]) -> Callable[[Callable[..., Any]], Any]:
    """Make an intrinsic, of what Python cannot say; or ``plain`` where numba is switched off."""
    return (lambda written: plain) if INTERPRETED else intrinsic


@cache
def _package_digest() -> str:
    """Digest of all files that can hold kernels, loops or constants that are baked into them."""
    digest = hashlib.sha256()
    root = Path(__file__).parent
    native = [path for path in root.glob("*.py") if b"gne_mj.native" in path.read_bytes()]
    for folder in ("controllers", "games", "plants", "loops"):
        native.extend((root / folder).glob("*.py"))
    for path in sorted([*native, Path(__file__)]):
        digest.update(path.read_bytes())
    return digest.hexdigest()


def source_key(*modules: ModuleType) -> str:
    """Digest of this package's sources and of ``modules``' own, for a compiled closure to hold."""
    digest = hashlib.sha256(_package_digest().encode())
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


@intrinsic_or(lambda function, table, room, steps: function(table, room, steps))
def call_loop(typingctx: Any, function: Any, table: Any, room: Any, steps: Any) -> Any:
    """Call a native loop, a C function of three integers, at an address; returns an integer."""

    def codegen(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        from llvmlite import ir

        kind = ir.FunctionType(cgutils.intp_t, [cgutils.intp_t] * 3)
        return builder.call(builder.inttoptr(arguments[0], kind.as_pointer()), arguments[1:])

    return types.int64(types.int64, types.int64, types.int64, types.int64), codegen
