"""How numba compiles kernels and loops: once each, and not more than is run.

By itself numba optimises each function that another calls, with all that is inlined into it, and
makes machine code of it, at every level anew; it compiles a function again for callers with other
options; and it hands over records number by number. Most of a loop's time to compile went there.
What is compiled, and from what, stays the same.
"""

import gc
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from numba import types
from numba.core.compiler import CompilerBase, DefaultPassBuilder, Flags
from numba.core.compiler_machinery import register_pass
from numba.core.datamodel.models import TupleModel, UniTupleModel
from numba.core.typed_passes import NativeLowering
from numba.extending import register_model

from gne_mj.kernel_cache import KernelLibrary, cache_for, entry_of


@contextmanager
def _uncollected() -> Iterator[None]:
    """Without the garbage collector, which finds next to nothing in what a compiler makes.

    It would take a tenth of the time.
    """
    enabled = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if enabled:
            gc.enable()


class _Inherited(Flags):
    """The options that what a kernel or loop calls is compiled with: the same for all callers.

    They are looked up with each call that is translated, so that comparing them must cost nothing.
    """

    __slots__ = ()
    __hash__ = object.__hash__

    def __eq__(self, other: object) -> bool:
        return self is other


_INHERITED = _Inherited()
_INHERITED.nrt, _INHERITED.error_model, _INHERITED.forceinline = False, "numpy", True


class _Own(Flags):
    """The options of one kernel or loop."""

    __slots__ = ()

    def copy(self) -> Flags:
        """What numba hands on to what is called."""
        return _INHERITED


class LoopCompiler(CompilerBase):
    """Compiles loops and C callbacks."""

    def __init__(self, *arguments: Any) -> None:
        super().__init__(*arguments)
        self.state.flags = _Own(self.state.flags)

    def compile_extra(self, function: Any) -> Any:
        """As numba's compilers have it."""
        with _uncollected():
            return super().compile_extra(function)

    def define_pipelines(self) -> list[Any]:
        """As numba's compilers have it."""
        return [DefaultPassBuilder.define_nopython_pipeline(self.state)]


class KernelCompiler(LoopCompiler):
    """Compiles kernels, of which nothing but their part of a loop is ever run."""

    def compile_extra(self, function: Any) -> Any:
        """As numba's compilers have it."""
        arguments = tuple(self.state.args)
        kept = cache_for(function, arguments)
        found = kept.load_overload(arguments, self.state.targetctx) if kept else None
        if found is None:
            found = super().compile_extra(function)
            if kept:
                kept.save_overload(arguments, found)
        return found

    def define_pipelines(self) -> list[Any]:
        """As numba's compilers have it."""
        (passes,) = super().define_pipelines()
        passes.passes = [
            (_KernelLowering if each is NativeLowering else each, words)
            for each, words in passes.passes
        ]
        return [passes]


@register_pass(mutates_CFG=True, analysis_only=False)
class _KernelLowering(NativeLowering):
    """To code that loops are linked with."""

    _name = "kernel_lowering"

    def run_pass(self, state: Any) -> bool:
        """As numba's passes have it."""
        context, name = state.targetctx, state.func_id.func_qualname
        state.library = KernelLibrary(context.codegen(), name)
        state.flags.no_compile = True
        super().run_pass(state)
        lowered = state["cr"]
        entry = entry_of(context, state.library, lowered.fndesc, lowered.env)
        state["cr"] = lowered._replace(cfunc=entry)
        return True


def _handed_over_whole(plain: Any) -> Any:
    """The model of numba's ``plain`` where it is a record of this package, as one argument."""

    class Whole(plain):
        def get_argument_type(self) -> Any:
            return self.get_value_type()

        def as_argument(self, _builder: Any, value: Any) -> Any:
            return value

        def from_argument(self, _builder: Any, value: Any) -> Any:
            return value

        def as_return(self, builder: Any, value: Any) -> Any:
            same = self.get_data_type() == self.get_value_type()
            return value if same else super().as_return(builder, value)

        def from_return(self, builder: Any, value: Any) -> Any:
            same = self.get_data_type() == self.get_value_type()
            return value if same else super().from_return(builder, value)

    def model(manager: Any, kind: Any) -> Any:
        ours = kind.instance_class.__module__.partition(".")[0] == __package__
        return (Whole if ours else plain)(manager, kind)

    return model


register_model(types.NamedTuple)(_handed_over_whole(TupleModel))
register_model(types.NamedUniTuple)(_handed_over_whole(UniTupleModel))
