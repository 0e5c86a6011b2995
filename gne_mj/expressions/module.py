"""From a trace to a module of kernels and its numbers."""

import hashlib
import linecache
import sys
from collections.abc import Callable
from types import ModuleType
from typing import Any, NamedTuple

import numpy as np

from gne_mj.expressions import source
from gne_mj.expressions.nodes import Node
from gne_mj.expressions.structure import Analysis, Instance, Layout, Program, Tables
from gne_mj.expressions.tracing import Trace

_modules: dict[str, ModuleType] = {}
_HEAD = '''"""Kernels made of a game's expressions."""

import numpy as np

from gne_mj.native import kernel
'''


class Kind(NamedTuple):
    """What agents, or constraints, of one program are."""

    program: Program
    size: int  # of the agent's action; 0 of constraints
    members: dict[int, Instance]


class Made(NamedTuple):
    """A game's kernels and numbers.

    Attributes:
        kernels: the module.
        q: its numbers.
        in_cost, in_constraint: which actions appear in each cost and constraint.
    """

    kernels: ModuleType
    q: list[float]
    costs: list[Kind]
    bounds: list[Kind]


def make(trace: Trace) -> Made:
    """The kernels of traced expressions."""
    analysis, at = Analysis(), np.concatenate([[0], np.cumsum(trace.sizes)]).tolist()
    own = [range(at[i], at[i + 1]) for i in range(len(trace.sizes))]
    costs = _kinds(analysis, trace.costs, own)
    bounds = _kinds(analysis, [bound.g for bound in trace.bounds], [()] * len(trace.bounds))
    tables = Tables(trace.tape.q)
    of_costs = [tables.layout(kind.program, kind.members) for kind in costs]
    of_bounds = [tables.layout(kind.program, kind.members) for kind in bounds]
    cost_kind, bound_kind = _dispatch(tables, costs), _dispatch(tables, bounds)
    text = [_HEAD]

    def write(head: str, place: str, kinds: list[Kind], layouts: list[Layout],
              dispatch: Callable[[int], str], body: Callable[..., None]) -> None:  # fmt: skip
        writer = source.Writer()
        writer.add("\n\n@kernel")
        with writer.block(f"def {head}:"):
            for n, (kind, layout) in enumerate(zip(kinds, layouts, strict=True)):
                scope = source.Scope(writer, kind.program, layout, [place], {}, {})
                more = (kind.size, scope.index(0)) if kind.size and body in _OWN else ()
                if n < len(kinds) - 1:
                    with writer.block(f"if {dispatch(n)}:"):
                        scope = source.Scope(writer, kind.program, layout, [place], {}, {})
                        body(scope, *more)
                        if body is source.own_row:
                            writer.add("return")
                else:
                    scope = source.Scope(writer, kind.program, layout, [place], {}, {})
                    body(scope, *more)
                    if writer.lines[-1].endswith(":"):
                        writer.add("pass")
            writer.add("pass" if body is source.own_row else "")
        text.append("\n".join(writer.lines))

    shared = (bounds, of_bounds, bound_kind)
    write("cost(q, i, y)", "i", costs, of_costs, cost_kind, source.value)
    write("cost_gradient(q, i, a, y)", "i", costs, of_costs, cost_kind, source.own_gradient)
    write("add_cost_hessian(q, i, a, y, scale, out)", "i", costs, of_costs, cost_kind,
          source.own_row)  # fmt: skip
    write("constraint(q, l, y)", "l", *shared, source.value)
    write("constraint_gradient(q, l, a, y)", "l", *shared, source.shared_gradient)
    write("constraint_hessian(q, l, a, b, y)", "l", *shared, source.shared_hessian)
    return Made(_module("\n".join(text) + "\n"), tables.q, costs, bounds)


_OWN = (source.own_gradient, source.own_row)


def _kinds(analysis: Analysis, nodes: list[Node], own: Any) -> list[Kind]:
    found: dict[Any, Kind] = {}
    for n, node in enumerate(nodes):
        program, instance = analysis.program(node, own[n])
        kind = found.setdefault((program, len(own[n])), Kind(program, len(own[n]), {}))
        kind.members[n] = instance
    return list(found.values())


def _dispatch(tables: Tables, kinds: list[Kind]) -> Callable[[int], str]:
    """The condition under which a number is one of the n-th kind's and of none before."""
    place = "i" if kinds[0].size else "l"
    ends = [max(kind.members) for kind in kinds]
    if all(min(kind.members) > end for kind, end in zip(kinds[1:], ends, strict=False)):
        return lambda n: f"{place} < {ends[n] + 1}"
    which = {member: n for n, kind in enumerate(kinds) for member in kind.members}
    at = len(tables.q)
    tables.q += [float(which[member]) for member in sorted(which)]
    return lambda n: f"q[{at} + {place}] == {float(n)}"


def _module(text: str) -> ModuleType:
    digest = hashlib.sha256(text.encode()).hexdigest()[:16]
    if digest not in _modules:
        name = f"gne_mj_expressions_{digest}"
        file = f"<{name}>"
        linecache.cache[file] = (len(text), None, text.splitlines(keepends=True), file)
        module = ModuleType(name, "Kernels made of a game's expressions.")
        module.__file__ = file
        sys.modules[name] = module  # where numba looks for it
        exec(compile(text, file, "exec"), module.__dict__)
        _modules[digest] = module
    return _modules[digest]
