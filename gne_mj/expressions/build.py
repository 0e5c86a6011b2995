"""A game from two Python functions (see docs/expressions.md)."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from gne_mj.bounds import MOST_ACTIONS, check_count
from gne_mj.equality import Equality
from gne_mj.errors import InvalidInput, nearest
from gne_mj.expressions import boxes
from gne_mj.expressions.claims import Claims, box, values
from gne_mj.expressions.intervals import jacobian_bounds
from gne_mj.expressions.nodes import Node
from gne_mj.expressions.tracing import Bound, Fixed, Trace, numbers, sizes_of, trace
from gne_mj.game_model import Game
from gne_mj.quantity import Quantity


class Functions(NamedTuple):
    """What a game of expressions is made of besides its numbers.

    Attributes:
        cost, constraints: as :func:`game` has them.
        others: parameters that are no numbers, by name.
    """

    cost: Callable[..., Any]
    constraints: Callable[..., Any] | None
    others: Mapping[str, Any]


@dataclass(frozen=True, eq=False, repr=False)
class ExpressionGame(Game):
    """A game of expressions, which knows what it was made of.

    Attributes:
        functions: its two functions, and what they are given besides numbers.
        numbers: its parameters that are numbers, by name, as lists.
        words: the other keywords of :func:`game`.
    """

    functions: Functions | None = None
    numbers: Mapping[str, Any] = field(default_factory=dict)
    words: Mapping[str, Any] = field(default_factory=dict)

    def changed(self, **parameters: Any) -> ExpressionGame:
        """The same game with some of its parameters changed.

        Raises:
            InvalidInput: there is no such parameter, or it cannot have that value.
        """
        assert self.functions is not None
        cost, constraints, others = self.functions
        known = {**self.numbers, **others}
        for name, value in parameters.items():
            if name not in known:
                raise InvalidInput(
                    name, value, f"there is no such parameter; {nearest(name, known)}"
                )
        return game(self.agents, cost, constraints, **self.words, **{**known, **parameters})


def fixed(value: Any) -> Fixed:
    """A parameter that functions get as it is, such as a list of edges or a switch."""
    return Fixed(value)


def game(
    count: int,
    cost: Callable[..., Any],
    constraints: Callable[..., Any] | None = None,
    *,
    lower: Any = None,
    upper: Any = None,
    dimension: int | Sequence[int] = 1,
    name: str = "",
    action_name: str = "action",
    action_unit: str = "",
    agent_name: str = "agent",
    axes: tuple[str, ...] = (),
    **parameters: Any,
) -> ExpressionGame:
    """The game of ``count`` agents with these costs and shared constraints.

    The functions are called with numbers that are not known yet: y, the actions, and p, whose
    attributes are the parameters. Everything else that a game has follows from what they compute.

    Args:
        count: N.
        cost: ``cost(i, y, p)``, J_i of agent i = 0..N-1; y[i] is its action, (m_i,) or a number.
        constraints: ``constraints(y, p)`` yields comparisons, each alone or behind its name:
            ``yield "energy", (y**2).sum() <= p.budget``; :func:`private` and :func:`band` declare
            what they are. May be left out where actions have bounds.
        lower: least actions, one number for all, one an agent, or one an entry; -inf for none.
            They become constraints, drawn as bounds of the actions.
        upper: greatest ones, likewise; inf for none.
        dimension: m_i, one number for all or one each.
        name: what the game is called; "own game" if left out.
        action_name: as of :class:`gne_mj.Game`.
        action_unit: likewise.
        agent_name: likewise.
        axes: likewise.
        **parameters: numbers, or arrays of them; anything else, and what :func:`fixed` holds, is
            given to the functions as it is.

    Raises:
        UserCodeError: a function raises, or branches on y; names file and line.
        InvalidInput: a parameter is not finite, or a number does not fit.
    """
    if isinstance(count, bool) or not isinstance(count, int | np.integer) or count < 1:
        raise InvalidInput("count", count, "it must be a positive whole number")
    words = {
        "name": name or "own game",
        "action_name": action_name,
        "action_unit": action_unit,
        "agent_name": agent_name,
        "axes": axes,
    }
    shape = {"dimension": dimension, "lower": lower, "upper": upper}
    return _made(sizes_of(int(count), dimension), cost, constraints, parameters, words, shape)


def _made(
    sizes: tuple[int, ...],
    cost: Callable[..., Any],
    constraints: Callable[..., Any] | None,
    parameters: Mapping[str, Any],
    words: Mapping[str, Any],
    shape: Mapping[str, Any],
) -> ExpressionGame:
    check_count("count", sum(sizes), MOST_ACTIONS, "the actions of all")
    limits = boxes.limits_of(shape["lower"], shape["upper"], sizes)
    labels = boxes.names_of(sizes, words["agent_name"], words["axes"])
    traced = trace(sizes, cost, constraints, parameters, limits, labels)
    given = {key: numbers(value) for key, value in parameters.items()}
    others = {key: value for key, value in parameters.items() if given[key] is None}
    return ExpressionGame(
        functions=Functions(cost, constraints, others),
        numbers={key: value.tolist() for key, value in given.items() if value is not None},
        words={**shape, **words},
        **words,
        sizes=sizes,
        quantities=(
            *_quantities(traced, len(sizes)),
            *boxes.quantities(
                limits, sizes, words["action_name"], words["action_unit"], words["axes"]
            ),
        ),
        tested=True,
        **_found(traced, cost),
    )


def _found(traced: Trace, cost: Callable[..., Any]) -> dict[str, Any]:
    """What follows from the expressions, by the names of a game's fields."""
    from gne_mj.expressions.module import make  # with SymPy, 0.3 s that others need not wait for

    try:
        made, claims = make(traced), Claims(_roots(traced))
    except RecursionError:
        raise InvalidInput("cost", cost, "expressions must not nest so deeply") from None
    owner, bounds = np.repeat(np.arange(len(traced.sizes)), traced.sizes), _all(traced)
    limits = [claims.gap_bound(bound) for bound in bounds]
    gaps = all(limit is not None for limit in limits)
    single = gaps and all(bound.gap is not None for bound in bounds)
    members = [_members(claims, bound, owner) for bound in bounds]
    costs = [_agents(claims, node, owner) for node in traced.costs]
    affine = claims.affine(traced.costs)
    return {
        "kernels": made.kernels,
        "parameters": made.q,
        "constraint_names": tuple(bound.name for bound in bounds),
        "in_cost": [[i, *(j for j in agents if j != i)] for i, agents in enumerate(costs)],
        "in_constraint": members,
        "owners": _owners(bounds, members),
        "equalities": _equalities(bounds),
        "affine": affine,
        "jacobian_bounds": None if affine else jacobian_bounds(made.kernels, made.q, traced.sizes),
        "box": box(bounds, claims, len(owner)),
        "gap_bounds": np.array(limits, dtype=np.float64) if gaps else None,
        "affine_constraints": 2 * len(limits) if single else None,
        "constraint_class": claims.constraint_class(bounds),
        "smooth": claims.smooth,
    }


def _all(traced: Trace) -> list[Bound]:
    return [*traced.bounds, *traced.boxed]


def _roots(traced: Trace) -> list[Node]:
    gaps = [bound.gap for bound in traced.bounds if bound.gap is not None]
    return [*traced.costs, *(bound.g for bound in _all(traced)), *gaps]


def _owners(bounds: list[Bound], members: list[list[int]]) -> list[list[int]] | None:
    """Whose constraints they are; None where all are shared."""
    if all(bound.owners is None for bound in bounds):
        return None
    found = []
    for bound, inside in zip(bounds, members, strict=True):
        found.append(inside if bound.owners is None else list(bound.owners))
        for i in found[-1]:
            if i not in inside:
                expected = (
                    f"it is private to agent {i + 1}, counted from 1, which must appear in it"
                )
                raise InvalidInput("constraints", bound.name, expected)
    return found


def _equalities(bounds: list[Bound]) -> tuple[Equality, ...]:
    return tuple(
        Equality(bound.name, k, partial(_gap, node=bound.gap), bound.limit.tape.value(bound.limit))
        for k, bound in enumerate(bounds)
        if bound.equality and bound.gap is not None and bound.limit is not None
    )


def _gap(y: NDArray[np.float64], node: Node) -> NDArray[np.float64]:
    return values([node], y)[:, 0]


def _agents(claims: Claims, node: Node, owner: NDArray[np.int64]) -> list[int]:
    return sorted({int(owner[a]) for a in claims.actions[id(node)]})


def _members(claims: Claims, bound: Bound, owner: NDArray[np.int64]) -> list[int]:
    members = _agents(claims, bound.g, owner)
    if not members:
        raise InvalidInput("constraints", bound.name, "every constraint contains an action")
    return members


def _quantities(traced: Trace, agents: int) -> tuple[Quantity, ...]:
    """What constraints bound, recorded and drawn: families of one name, numbers left out."""
    families: dict[str, list[Bound]] = {}
    for bound in traced.bounds:
        stem = re.sub(r"[\d\s(,)]+", " ", bound.name).strip(" -_.:/")
        families.setdefault(stem, []).append(bound)
    found: list[Quantity] = []
    taken: set[str] = set()
    for stem, bounds in families.items():
        kinds = {"": 1, "agent": agents, "constraint": len(_all(traced))}
        each = next((kind for kind, size in kinds.items() if size == len(bounds)), "constraint")
        name = re.sub(r"\W+", "_", stem.lower()).strip("_") or "constraint"
        if name in taken or not name.isidentifier():
            continue
        taken.add(name)
        places = np.arange(len(bounds))
        if each == "constraint":  # perhaps of a part of them: the others have no numbers
            number = {id(bound): k for k, bound in enumerate(traced.bounds)}
            places = np.array([number[id(bound)] for bound in bounds])
        size = kinds.get(each, 1)
        found.append(_quantity(name, stem or "constraint", each, bounds, (places, size)))
    return tuple(found)


def _quantity(
    name: str,
    long_name: str,
    each: str,
    bounds: list[Bound],
    at: tuple[NDArray[np.int64], int],
) -> Quantity:
    """What constraints bound; ``at`` has their places among so many entries."""
    nodes, lower, upper = zip(*map(_shown, bounds), strict=True)
    entries, (places, size) = list(nodes), at

    def placed(columns: NDArray[np.float64]) -> NDArray[np.float64]:
        every = np.full((*columns.shape[:-1], size), np.nan)
        every[..., places] = columns
        return every if each else every[..., 0]

    limits: dict[str, Any] = {
        key: placed(np.array(side, dtype=np.float64))
        for key, side in (("bound", upper), ("lower_bound", lower))
        if None not in side
    }
    return Quantity(name=f"{name}_value", long_name=long_name, unit="",
                    values=lambda y: placed(values(entries, y)), each=each, **limits)  # fmt: skip


def _shown(bound: Bound) -> tuple[Node, float | None, float | None]:
    """What a constraint bounds, from below and above."""
    tape = bound.g.tape
    if bound.gap is not None and bound.limit is not None:
        limit = tape.value(bound.limit)
        return bound.gap, -limit, limit
    assert bound.sides is not None
    less, more = bound.sides
    if not more.varies:
        return less, None, tape.value(more)
    if not less.varies:
        return more, tape.value(less), None
    return bound.g, None, 0.0
