"""A user's two functions, called once each with numbers that are not known yet."""

from collections import Counter
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from gne_mj.errors import GneError, InvalidInput, UserCodeError, nearest
from gne_mj.expressions.boxes import Limits
from gne_mj.expressions.declared import Band, Private
from gne_mj.expressions.entries import check_entries, no_entry
from gne_mj.expressions.nodes import Array, Node, NoEntry, Relation, Tape, objects, words
from gne_mj.expressions.operators import Untraceable


@dataclass(frozen=True)
class Fixed:
    """A parameter that functions get as it is, such as a list of edges."""

    value: Any


class Bound(NamedTuple):
    """One constraint, g <= 0.

    Attributes:
        name: of it.
        g: negative inside.
        gap, limit: of one that reads |gap| <= limit: then g = (gap - limit) (gap + limit).
        sides: of another its two sides, less <= more.
        owners: the agents whose it is, from 0; None for all in it.
        equality: whether it is the band of one.
    """

    name: str
    g: Node
    gap: Node | None = None
    limit: Node | None = None
    sides: tuple[Node, Node] | None = None
    owners: tuple[int, ...] | None = None
    equality: bool = False


class Trace(NamedTuple):
    """What the functions computed; ``boxed`` follows from bounds of actions."""

    tape: Tape
    sizes: tuple[int, ...]
    costs: list[Node]
    bounds: list[Bound]
    boxed: list[Bound]


class Parameters:
    """A game's parameters, by name: numbers that may change, and :class:`Fixed` things."""

    def __init__(self, tape: Tape, given: Mapping[str, Any]) -> None:
        self.__dict__["_known"] = {
            key: _parameter(tape, key, value) for key, value in given.items()
        }
        self.__dict__["_read"] = set()

    def __getattr__(self, name: str) -> Any:
        if name.startswith("__"):
            raise AttributeError(name)
        if name not in self._known:
            raise AttributeError(f"there is no parameter '{name}'; {nearest(name, self._known)}")
        self._read.add(name)
        return self._known[name]

    __getitem__ = __getattr__

    def __setattr__(self, name: str, value: Any) -> None:
        raise AttributeError(f"parameters cannot be set: {name}")

    def __dir__(self) -> list[str]:
        return [*self._known]


def trace(
    sizes: tuple[int, ...],
    cost: Callable[..., Any],
    constraints: Callable[..., Any] | None,
    parameters: Mapping[str, Any],
    limits: Limits,
    names: Sequence[str],
) -> Trace:
    """Call both functions.

    Args:
        sizes: m_i of each agent.
        cost: ``cost(i, y, p)`` of agent i, from 0.
        constraints: ``constraints(y, p)`` gives comparisons, or pairs of a name and one.
        parameters: by name.
        limits: bounds of actions.
        names: of the actions.

    Raises:
        UserCodeError: a function raises, or does what cannot be traced; names its file and line.
        InvalidInput: a parameter is not finite, or a number that nothing reads, or there is no
            constraint.
    """
    tape = Tape(sum(sizes))
    y, p = _profile(tape, sizes), Parameters(tape, parameters)
    costs = [_called(cost, f"for agent {i + 1}", _one, tape, y, p, i) for i in range(len(sizes))]
    bounds = []
    if constraints is not None:
        bounds = _called(constraints, "", _bounds, tape, y, p)
    boxed = _boxed(tape, limits, names)
    _check_read(p, parameters)
    given = {key: numbers(value) for key, value in parameters.items()}
    lists = {key: value for key, value in given.items() if value is not None}
    check_entries(tape, [*costs, *(bound.g for bound in bounds)], lists, len(sizes))
    for name, times in Counter(bound.name for bound in [*bounds, *boxed]).items():
        if times > 1:
            raise InvalidInput("constraints", name, "each needs a name of its own")
    if not bounds and not boxed:
        raise InvalidInput("constraints", "none", "a game has at least one constraint")
    return Trace(tape, sizes, costs, bounds, boxed)


def _check_read(p: Parameters, given: Mapping[str, Any]) -> None:
    """Refuse numbers that nothing reads: a name is misspelt, and changing it would do nothing."""
    for key, value in given.items():
        if key not in p._read and numbers(value) is not None:
            hint = f"; {nearest(key, sorted(p._read))}" if p._read else ""
            raise InvalidInput(key, value, f"no formula reads it{hint}")


def _boxed(tape: Tape, limits: Limits, names: Sequence[str]) -> list[Bound]:
    """lower <= y and y <= upper, of the actions that have such a bound."""
    found = []
    for key, values in zip(("lower", "upper"), limits, strict=True):
        bounded = np.flatnonzero(np.isfinite(values))
        if not len(bounded):
            continue
        numbers = tape.parameter(values[bounded])
        for a, limit in zip(bounded.tolist(), numbers, strict=True):
            sides = (limit, tape.actions[a]) if key == "lower" else (tape.actions[a], limit)
            g = tape.binary("-", *sides)
            found.append(Bound(f"{key} bound of {names[a]}", g, sides=sides))
    return found


def _profile(tape: Tape, sizes: tuple[int, ...]) -> Any:
    nodes: list[Any] = tape.actions
    if len(set(sizes)) == 1:
        shape = (len(sizes),) if sizes[0] == 1 else (len(sizes), sizes[0])
        return Array(tape, objects(nodes, shape))
    at = np.concatenate([[0], np.cumsum(sizes)])
    parts = [nodes[at[i] : at[i + 1]] for i in range(len(sizes))]
    return tuple(part[0] if len(part) == 1 else Array(tape, objects(part, (len(part),)))
                 for part in parts)  # fmt: skip


def numbers(value: Any) -> NDArray[Any] | None:
    """A parameter's numbers, which may change; None of one that functions get as it is."""
    try:
        array = np.asarray(value)
    except ValueError:
        return None
    return array if array.dtype.kind in "fiu" and not isinstance(value, Fixed) else None


def _parameter(tape: Tape, key: str, value: Any) -> Any:
    array = numbers(value)
    if array is None:
        return value.value if isinstance(value, Fixed) else value
    if not np.all(np.isfinite(array)):
        raise InvalidInput(key, value, "every number must be finite")
    return tape.parameter(array.astype(np.float64), key)


def _called(
    owner: Callable[..., Any], at: str, call: Callable[..., Any],
    tape: Tape, y: Any, p: Parameters, *agent: int,
) -> Any:  # fmt: skip
    try:
        return call(tape, owner, *agent, y, p)
    except (KeyboardInterrupt, GneError):
        raise
    except RecursionError as error:
        raise UserCodeError(owner, "it calls itself too deeply", at) from error
    except BaseException as error:
        failed = UserCodeError(owner, error, at)
        if isinstance(error, NoEntry) and error.parameter:
            raise no_entry(error, len(y), f"{failed.where},", at) from error
        raise failed from error


def _one(tape: Tape, cost: Callable[..., Any], i: int, y: Any, p: Parameters) -> Node:
    value = cost(i, y, p)
    if isinstance(value, Array) and value.size == 1:
        value = value.nodes.ravel()[0]
    if isinstance(value, Array | Relation) or value is None:
        raise Untraceable(f"a cost is one number, not {_kind(value)}")
    return tape.constant(value)


def _bounds(tape: Tape, function: Callable[..., Any], y: Any, p: Parameters) -> list[Bound]:
    given = function(y, p)
    if isinstance(given, Mapping):
        given = given.items()
    elif isinstance(given, Relation | Array | Private | Band) or given is None:
        given = [] if given is None else [given]
    found: list[Bound] = []
    for entry in given:
        pair = type(entry) is tuple and len(entry) == 2 and isinstance(entry[0], str)
        name, relation = entry if pair else (f"constraint {len(found) + 1}", entry)
        found += _named(tape, name, relation)
    for name, times in Counter(bound.name for bound in found).items():
        if times > 1:
            raise Untraceable(f"{times} constraints are named '{name}'")
    return found


def _named(tape: Tape, name: str, relation: Any) -> Iterable[Bound]:
    if isinstance(relation, Array):
        many = relation.nodes.ravel()
        for k, each in enumerate(many):
            yield from _named(tape, f"{name} {k + 1}" if len(many) > 1 else name, each)
    elif isinstance(relation, Private):
        if isinstance(relation.relation, Private):
            raise Untraceable(f"constraint '{name}' is private twice")
        for bound in _named(tape, name, relation.relation):
            yield bound._replace(owners=relation.agents)
    elif isinstance(relation, Band):
        for bound in _named(tape, name, relation.relation):
            if bound.gap is None:
                raise Untraceable(f"constraint '{name}': the width of a band is a number")
            yield bound._replace(equality=True)
    elif isinstance(relation, Relation):
        yield from _lowered(tape, name, relation)
    elif isinstance(relation, bool | np.bool_):
        raise Untraceable(f"constraint '{name}' contains no action")
    else:
        raise Untraceable(f"constraint '{name}' is a comparison such as a <= b, not "
                          f"{_kind(relation)}")  # fmt: skip


def _lowered(tape: Tape, name: str, relation: Relation) -> Iterable[Bound]:
    less, more = relation.less, relation.more
    if more.op == "abs" and more.varies:
        raise Untraceable(f"constraint '{name}', abs(...) >= {words(less)}, is two separate sets")
    if less.op != "abs":
        yield Bound(name, tape.binary("-", less, more), sides=(less, more))
        return
    gap = less.args[0]
    if more.varies:
        for side, each in (("below", tape.unary("neg", gap)), ("above", gap)):
            yield Bound(f"{name} ({side})", tape.binary("-", each, more), sides=(each, more))
        return
    if not tape.value(more) > 0.0:
        raise Untraceable(f"constraint '{name}': the bound of abs(...) must be positive, not "
                          f"{tape.value(more):g}")  # fmt: skip
    # As a product, so that little is lost close to the bound
    product = tape.binary("*", tape.binary("-", gap, more), tape.binary("+", gap, more))
    yield Bound(name, product, gap, more)


def _kind(value: Any) -> str:
    if isinstance(value, Array):
        return f"an array of shape {value.shape}"
    return "None" if value is None else f"a {type(value).__name__}"


def sizes_of(count: int, dimension: int | Sequence[int]) -> tuple[int, ...]:
    """m_i of each agent, from one number for all or one each."""
    sizes = (dimension,) * count if isinstance(dimension, int) else tuple(map(int, dimension))
    if len(sizes) != count or min(sizes, default=0) < 1:
        raise InvalidInput("dimension", dimension, "it must be a positive number, or one an agent")
    return sizes
