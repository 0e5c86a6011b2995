"""How a law, a game or an agent is compiled once and used by every engine.

A *kernel* is a plain Python function marked with :func:`kernel`. It can be called from Python as
it stands, and numba inlines it into any native loop that uses it. Kernels and loops work on arrays
that they are given and allocate nothing. Games, agents and laws are
modules of kernels with agreed names; a native loop is a function built for such modules by a
factory, so that each rule is written in one place and serves the ODE twin, MuJoCo's callbacks and
the array API alike.
"""

import hashlib
import inspect
from collections.abc import Callable
from functools import cache
from pathlib import Path
from types import ModuleType
from typing import Any, TypeVar

import numba
from numba import njit, types
from numba.core import cgutils
from numba.extending import intrinsic, register_jitable

F = TypeVar("F", bound=Callable[..., Any])

# Compiled division must give inf or nan, as NumPy does: numba's default raises, and a callback
# that raises can only print. Without numba's run time ("_nrt") nothing can be allocated, which
# the compiler then checks, and array views cost no reference counting (a factor of 20 here).
_KERNEL: dict[str, Any] = {"error_model": "numpy", "_nrt": False, "forceinline": True}
_LOOP: dict[str, Any] = {"error_model": "numpy", "_nrt": False, "nogil": True}


def kernel(function: F) -> F:
    """Mark ``function`` as usable from native code (it stays an ordinary Python function)."""
    return register_jitable(**_KERNEL)(function)


def view(function: F) -> F:
    """Mark a kernel that returns views of memory, which numba's run time must be there for.

    Only functions compiled with ``views=True`` and callbacks can use it; they should make their
    views first and leave the work to kernels.
    """
    return register_jitable(error_model="numpy")(function)


def compiled(function: Callable[..., Any], *, views: bool = False) -> Any:
    """Compile a native loop; machine code is kept on disk between processes.

    A function that calls kernels of other files must hold :func:`source_key` of them in its
    closure, since numba notices a changed closure but not a changed callee.
    """
    options = {**_LOOP, "_nrt": views}
    return njit(cache=True, **options)(function)


def callback(signature: types.Type, function: Callable[..., Any]) -> Any:
    """Compile a C callback (numba's ``cfunc``), kept on disk as :func:`compiled` does."""
    return numba.cfunc(signature, cache=True, error_model="numpy")(function)


@cache
def _package_digest() -> str:
    digest = hashlib.sha256()
    root = Path(__file__).parent
    for folder in (root, root / "controllers", root / "games", root / "plants", root / "loops"):
        for path in sorted(folder.glob("*.py")):
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


@intrinsic
def address_as_pointer(typingctx: Any, address: Any) -> Any:
    """Turn an integer address into the ``void *`` that ``numba.carray`` takes."""

    def codegen(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        return builder.inttoptr(arguments[0], cgutils.voidptr_t)

    return types.voidptr(types.int64), codegen
