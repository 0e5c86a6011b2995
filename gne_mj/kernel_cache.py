"""Translated kernels on disk, so that a loop's first compilation finds what others have translated.

numba keeps loops and C callbacks; what is inlined into them it translates anew in every process.
A kernel of this package is kept too, as LLVM code that is not optimised yet, with all that it
calls; a loop that calls it is optimised and made machine code of as ever. It lies beside the loops
in numba's cache, and is found for the same types of arguments as long as no source has changed.
"""

import hashlib
import inspect
import itertools
import secrets
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any

import llvmlite.binding as llvm
from numba import _dynfunc, types
from numba.core.bytecode import FunctionIdentity
from numba.core.caching import Cache, CompileResultCacheImpl
from numba.core.codegen import JITCodeLibrary
from numba.core.compiler import CompileResult, compile_result

from gne_mj.machine_code import older_versions_ignored

# Symbols are numbered, by numba from 1 in every process: code of several would mix them up.
FunctionIdentity._unique_ids = itertools.count(secrets.randbits(60))


@cache
def package_digest() -> str:
    """Digest of all files that can hold kernels, loops or constants that are baked into them."""
    digest = hashlib.sha256()
    root = Path(__file__).parent
    native = [path for path in root.glob("*.py") if b"gne_mj.native" in path.read_bytes()]
    for folder in ("controllers", "games", "plants", "loops"):
        native.extend((root / folder).glob("*.py"))
    own = [root / f"{name}.py" for name in ("native", "kernel_compiler", "kernel_cache")]
    for path in sorted({*native, *own}):
        digest.update(path.read_bytes())
    return digest.hexdigest()


class KernelLibrary(JITCodeLibrary):
    """Code that is optimised where it is inlined, and of which there is no machine code."""

    def _optimize_final_module(self) -> None:
        pass

    def _finalize_final_module(self) -> None:
        self._finalized = True


def entry_of(context: Any, library: KernelLibrary, described: Any, environment: Any) -> Any:
    """What callers know a kernel by: a function object of its own, that cannot be called."""
    entry = _dynfunc.make_function(
        described.lookup_module(), library.name, "", 0, environment, (library,)
    )
    context.insert_user_function(entry, described, [library])
    return entry


class _Kept(CompileResultCacheImpl):
    """What is kept of a kernel."""

    def check_cachable(self, found: CompileResult) -> bool:
        """As numba's caches have it."""
        found.library._ensure_finalized()  # linked with what it calls
        globals = (each.name for each in found.library._final_module.global_variables)
        return not any(name.startswith("numba.dynamic.globals") for name in globals)

    def reduce(self, found: CompileResult) -> Any:
        """As numba's caches have it."""
        described, library = found.fndesc, found.library
        described.typemap = described.calltypes = None  # not needed, and large
        code = library._final_module.as_bitcode()
        return library.name, code, described, found.environment, found.signature

    def rebuild(self, context: Any, kept: Any) -> CompileResult:
        """As numba's caches have it."""
        name, code, described, environment, signature = kept
        library = KernelLibrary(context.codegen(), name)
        library._final_module = llvm.parse_bitcode(code)
        library._finalized = True
        return compile_result(
            typing_context=context.typing_context,
            target_context=context,
            entry_point=entry_of(context, library, described, environment),
            typing_error=None,
            type_annotation=None,
            signature=signature,
            objectmode=False,
            lifted=(),
            fndesc=described,
            library=library,
            environment=environment,
        )


class KernelCache(Cache):
    """The kept translations of one kernel."""

    _impl_class = _Kept

    def _index_key(self, signature: Any, codegen: Any) -> Any:
        return (*super()._index_key(signature, codegen), package_digest())


@cache
def _cache_of(function: Callable[..., Any]) -> KernelCache | None:
    module = inspect.getmodule(function)
    if module is None or getattr(module, function.__name__, None) is not function:
        return None  # made by another function, for what it was given
    try:
        with older_versions_ignored():
            return KernelCache(function)
    except RuntimeError:  # no folder can be written, or the function is of no file
        return None


def cache_for(function: Callable[..., Any], arguments: tuple[Any, ...]) -> KernelCache | None:
    """Where translations of a kernel for arguments of these types are kept; None if nowhere.

    Only this package's digest is known, so what users' modules have a part in is not kept.
    """
    modules = [each.pymod.__name__ for each in arguments if isinstance(each, types.Module)]
    names = [function.__module__, *modules]
    known = all(name.partition(".")[0] == __package__ for name in names)
    known = known and not any(isinstance(each, types.Callable) for each in arguments)
    return _cache_of(function) if known else None
