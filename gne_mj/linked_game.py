"""The place of a game whose functions come as LLVM code, and their linking with what calls them.

Numba takes seconds to compile what calls a game's functions, nearly all of it to find types. For
games that bring their functions as LLVM code (a text, ``game.llvm``) it does so once for all of
them, with this module in the game's place: its kernels are symbols without a body. LLVM then links,
inlines and optimises a game's own functions with these in a tenth of the time.
"""

import ctypes
import sys
from collections.abc import Callable
from functools import cache
from itertools import count
from types import ModuleType
from typing import Any, NamedTuple

import llvmlite.binding as llvm
from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.core.compiler_lock import global_compiler_lock
from numba.core.registry import cpu_target
from numba.extending import intrinsic

from gne_mj.native import INTERPRETED

# What a game's functions are called and take: q, y and out are arrays, in LLVM code their address,
# scale is a number, all others whole
FUNCTIONS = {
    "cost": ("q", "i", "y"),
    "cost_gradient": ("q", "i", "a", "y"),
    "add_cost_hessian": ("q", "i", "a", "y", "scale", "out"),
    "constraint": ("q", "l", "y"),
    "constraint_gradient": ("q", "l", "a", "y"),
    "constraint_hessian": ("q", "l", "a", "b", "y"),
}
# And what games that bring LLVM code have besides
KNOWN = {**FUNCTIONS, "pseudo_gradient": ("q", "y", "out")}
NUMBER, WHOLE = ir.DoubleType(), ir.IntType(64)
_numbers = count()


def symbol(name: str) -> str:
    """What a function is called in LLVM code."""
    return f"gne_mj_game_{name}"


def declared(module: ir.Module, name: str) -> ir.Function:
    """One of the functions, in a module of LLVM code."""
    kinds = {**dict.fromkeys(("q", "y", "out"), NUMBER.as_pointer()), "scale": NUMBER}
    result = ir.VoidType() if "out" in KNOWN[name] else NUMBER
    kind = ir.FunctionType(result, [kinds.get(each, WHOLE) for each in KNOWN[name]])
    return cgutils.get_or_insert_function(module, kind, symbol(name))


def _calling(name: str, given: tuple[types.Type, ...]) -> Any:
    """The signature of a call, and what writes it."""

    def codegen(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        values = [
            cgutils.create_struct_proxy(kind)(context, builder, value=value).data
            if isinstance(kind, types.Array)
            else value
            for kind, value in zip(signature.args, arguments, strict=True)
        ]
        found = builder.call(declared(builder.module, name), values)
        return context.get_dummy_value() if "out" in KNOWN[name] else found

    kinds = [kind if isinstance(kind, types.Array) else
             types.float64 if each == "scale" else types.int64
             for each, kind in zip(KNOWN[name], given, strict=True)]  # fmt: skip
    result = types.none if "out" in KNOWN[name] else types.float64
    return result(*kinds), codegen


@intrinsic
def cost(typingctx: Any, q: Any, i: Any, y: Any) -> Any:
    """J_i(y)."""
    return _calling("cost", (q, i, y))


@intrinsic
def cost_gradient(typingctx: Any, q: Any, i: Any, a: Any, y: Any) -> Any:
    """dJ_i/dy_a."""
    return _calling("cost_gradient", (q, i, a, y))


@intrinsic
def pseudo_gradient(typingctx: Any, q: Any, y: Any, out: Any) -> Any:
    """Fill out (m,) with F(y), what all agents' costs share being formed once."""
    return _calling("pseudo_gradient", (q, y, out))


@intrinsic
def add_cost_hessian(typingctx: Any, q: Any, i: Any, a: Any, y: Any, scale: Any, out: Any) -> Any:
    """out[b] += scale * d2J_i/dy_a dy_b."""
    return _calling("add_cost_hessian", (q, i, a, y, scale, out))


@intrinsic
def constraint(typingctx: Any, q: Any, l: Any, y: Any) -> Any:  # noqa: E741 - as games call it
    """g_l(y)."""
    return _calling("constraint", (q, l, y))


@intrinsic
def constraint_gradient(typingctx: Any, q: Any, l: Any, a: Any, y: Any) -> Any:  # noqa: E741
    """dg_l/dy_a."""
    return _calling("constraint_gradient", (q, l, a, y))


@intrinsic
def constraint_hessian(typingctx: Any, q: Any, l: Any, a: Any, b: Any, y: Any) -> Any:  # noqa: E741
    """d2g_l/dy_a dy_b."""
    return _calling("constraint_hessian", (q, l, a, b, y))


class Linked(NamedTuple):
    """A C function, and what keeps its machine code."""

    address: int
    library: Any


def compiled_for(game: ModuleType, make: Callable[..., list[Any]], *others: Any) -> list[Any]:
    """The C functions that ``make(game, *others)`` compiles, each with its ``address``.

    Args:
        game: module of kernels.
        make: a function of a file, which compiles kernels that call the game's; the same ones for
            every game.
        others: what else it takes, such as modules of kernels.
    """
    code = getattr(game, "llvm", None)
    if code is None or INTERPRETED:
        return make(game, *others)
    return _linked(code, _without_game(make, *others))


@cache
def _without_game(make: Callable[..., list[Any]], *others: Any) -> list[Any]:
    # Machine code of symbols without a body is never run, but must be able to be loaded
    never = ctypes.cast(ctypes.pythonapi.Py_FatalError, ctypes.c_void_p).value
    for name in KNOWN:
        llvm.add_symbol(symbol(name), never)
    return make(sys.modules[__name__], *others)


@global_compiler_lock
def _linked(code: str, callers: list[Any]) -> list[Any]:
    """Callers' C functions with the game's functions inlined."""
    library = cpu_target.target_context.codegen().create_library(f"gne_mj_game_{next(_numbers)}")
    module, own = library._final_module, llvm.parse_assembly(code)
    own.triple = module.triple
    library.add_llvm_module(own)
    for caller in callers:
        calling = caller._library._get_module_for_linking().clone()
        calling.get_function(caller.native_name).linkage = "external"  # else it is left out
        module.link_in(calling)
    names = {caller.native_name: f"{library.name}.{k}" for k, caller in enumerate(callers)}
    for function in [each for each in module.functions if not each.is_declaration]:
        # Symbols are known everywhere: all but the entries are this game's own
        known = names.get(function.name)
        function.linkage = "internal" if known is None else "external"
        if known is not None:
            function.name = known
    library.finalize()
    return [Linked(library.get_pointer_to_function(name), library) for name in names.values()]
