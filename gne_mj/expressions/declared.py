"""What constraints can be declared to be: private, or a band that stands for an equality."""

from collections.abc import Iterable
from typing import Any, NamedTuple

import numpy as np

from gne_mj.expressions.operators import Untraceable


class Private(NamedTuple):
    """A constraint that is these agents' alone."""

    agents: tuple[int, ...]
    relation: Any


class Band(NamedTuple):
    """The two-sided bound that stands for an equality."""

    relation: Any


def private(agent: int | Iterable[int], relation: Any) -> Private:
    """A constraint of one agent (or of some) alone, which others that appear in it need not keep.

    ``yield "demand", private(i, y[i] + y[j] <= p.most)``

    Args:
        agent: its number from 0, or several.
        relation: a comparison, an array of them, or a :func:`band`.
    """
    numbers: tuple[Any, ...] = tuple(agent) if isinstance(agent, Iterable) else (agent,)
    whole = all(isinstance(n, int | np.integer) and not isinstance(n, bool) for n in numbers)
    if not numbers or not whole:
        raise Untraceable(f"private(agent, ...): an agent's number from 0, not {agent!r:.40}")
    return Private(tuple(sorted({int(n) for n in numbers})), relation)


def band(value: Any, target: Any, width: Any) -> Band:
    """The equality value = target, kept up to a width: abs(value - target) <= width.

    A barrier needs an inside, which an equality has not. The report on equilibria has the
    equality's own multiplier, of either sign; as the width falls to 0 it tends to the exact one.

    Args:
        value: an expression.
        target: what it is to equal, an expression, number or array.
        width: positive number, in their unit.
    """
    return Band(abs(value - target) <= width)
