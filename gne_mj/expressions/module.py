"""From a trace to a module of kernels and its numbers."""

import hashlib
import linecache
import sys
from collections.abc import Callable
from types import ModuleType
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from gne_mj.expressions import source
from gne_mj.expressions.llvm import llvm
from gne_mj.expressions.nodes import Node
from gne_mj.expressions.structure import Analysis, Instance, Program, Tables
from gne_mj.expressions.tracing import Trace

_modules: dict[str, ModuleType] = {}
_HEAD = '''"""Kernels made of a game's expressions."""

import numpy as np

from gne_mj.native import kernel
'''


class Kind(NamedTuple):
    """What agents, or constraints, of one program are."""

    program: Program
    size: int  # of the agent's action; of constraints the greatest of any agent's
    members: dict[int, Instance]


class Made(NamedTuple):
    """A game's kernels and numbers.

    Attributes:
        kernels: the module.
        q: its numbers.
    """

    kernels: ModuleType
    q: NDArray[np.float64]


class Part:
    """Costs, or constraints: their kinds, and the text of a function of each.

    Args:
        tables: where their numbers go.
        kinds: which.
        place: what the number of an agent, or constraint, is called in the text.
    """

    def __init__(self, tables: Tables, kinds: list[Kind], place: str) -> None:
        self.kinds, self.place = kinds, place
        self.layouts = [tables.layout(kind.program, kind.members) for kind in kinds]
        self.conditions, self.only = _conditions(tables, kinds, place)

    def function(self, head: str, body: Callable[[source.Scope, int], None]) -> str:
        """The text of a kernel; ``body`` writes what it does for one kind."""
        writer = source.Writer()
        writer.add("\n\n@kernel")
        with writer.block(f"def {head}:"):
            for n, kind in enumerate(self.kinds):
                with writer.block(f"if {self.conditions[n]}:"):
                    body(self._scope(writer, n, {}), kind.size)
        return "\n".join(writer.lines)

    def of_all(self, head: str, body: Callable[[source.Scope, int], None]) -> str:
        """The text of a kernel that does it for all; sums that are the same for all come first."""
        writer = source.Writer()
        writer.add("\n\n@kernel")
        with writer.block(f"def {head}:"):
            shared = self._shared(writer)
            members = sum(len(kind.members) for kind in self.kinds)
            with writer.block(f"for {self.place} in range({members}):"):
                for n, kind in enumerate(self.kinds):
                    with writer.block(f"if {self.only[n]}:"):
                        body(self._scope(writer, n, shared[n]), kind.size)
        return "\n".join(writer.lines)

    def _scope(self, writer: source.Writer, n: int, known: dict[str, str]) -> source.Scope:
        kind, layout = self.kinds[n], self.layouts[n]
        return source.Scope(writer, kind.program, layout, [self.place], {}, {}, known)

    def _shared(self, writer: source.Writer) -> list[dict[str, str]]:
        """Of each kind the local names of its rolls that have the same terms for all."""
        names: dict[int, str] = {}  # by the list of terms
        found: list[dict[str, str]] = []
        for n, kind in enumerate(self.kinds):
            found.append({})
            for r, roll in enumerate(kind.program.rolls):
                lists = {id(member.rolls[r]) for member in kind.members.values()}
                if len(lists) > 1 or any(outer >= 0 for outer in roll.outer):
                    continue
                (terms,) = lists
                if terms not in names:
                    names[terms] = self._scope(writer, n, {})[f"r{r}"]
                found[n][f"r{r}"] = names[terms]
        return found


def make(trace: Trace) -> Made:
    """The kernels of traced expressions."""
    analysis, at = Analysis(), np.concatenate([[0], np.cumsum(trace.sizes)]).tolist()
    own = [range(at[i], at[i + 1]) for i in range(len(trace.sizes))]
    tables = Tables(trace.tape.q)
    costs = Part(tables, _kinds(analysis, trace.costs, own), "i")
    nodes = [bound.g for bound in [*trace.bounds, *trace.boxed]]
    most = max(trace.sizes)
    bounds = Part(tables, _kinds(analysis, nodes, [()] * len(nodes), most), "l")
    text = [
        _HEAD,
        costs.function("cost(q, i, y)", source.value),
        costs.function("cost_gradient(q, i, a, y)", source.own_gradient),
        costs.of_all("pseudo_gradient(q, y, out)", source.own_gradients),
        costs.function("add_cost_hessian(q, i, a, y, scale, out)", source.own_row),
        bounds.function("constraint(q, l, y)", source.value),
        bounds.function("constraint_gradient(q, l, a, y)", source.shared_gradient),
        bounds.function("constraint_hessian(q, l, a, b, y)", source.shared_hessian),
    ]
    return Made(_module("\n".join(text) + "\n"), np.array(tables.q, dtype=np.float64))


def _kinds(analysis: Analysis, nodes: list[Node], own: Any, size: int = 0) -> list[Kind]:
    found: dict[Any, Kind] = {}
    for n, node in enumerate(nodes):
        program, instance = analysis.program(node, own[n])
        key = (program, size or len(own[n]))
        found.setdefault(key, Kind(*key, {})).members[n] = instance
    return list(found.values())


def _conditions(tables: Tables, kinds: list[Kind], place: str) -> tuple[list[str], list[str]]:
    """Under which a number is one of each kind's: if it is none of those before, and in any case.

    The last one of the former, and of a single kind both, are "True".
    """
    ends = [max(kind.members) for kind in kinds]
    if all(min(kind.members) > end for kind, end in zip(kinds[1:], ends, strict=False)):
        only = [f"{min(kind.members)} <= {place} <= {max(kind.members)}" for kind in kinds]
        found = [f"{place} <= {end}" for end in ends]
    else:
        which = {member: n for n, kind in enumerate(kinds) for member in kind.members}
        at = len(tables.q)
        tables.q += [float(which[member]) for member in sorted(which)]
        found = only = [f"q[{at} + {place}] == {float(n)}" for n in range(len(kinds))]
    return [*found[:-1], "True"], only if len(kinds) > 1 else ["True"]


def _module(text: str) -> ModuleType:
    digest = hashlib.sha256(text.encode()).hexdigest()[:16]
    if digest not in _modules:
        name = f"gne_mj_expressions_{digest}"
        file = f"<{name}>"
        linecache.cache[file] = (len(text), None, text.splitlines(keepends=True), file)
        module = ModuleType(name, "Kernels made of a game's expressions.")
        module.__file__ = file
        module.__dict__["llvm"] = llvm(text)
        sys.modules[name] = module  # where numba looks for it
        exec(compile(text, file, "exec"), module.__dict__)
        _modules[digest] = module
    return _modules[digest]
