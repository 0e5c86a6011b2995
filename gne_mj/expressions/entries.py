"""Entries of lists that no formula reads, and entries that there are not.

A list of the wrong length is a mistake that nothing else shows: one too many changes nothing, and
where one is wanting Python knows the place in it but not the list. Lists need not have an entry for
each agent; what is asked is that each entry is read. Of lists that have as many entries as there
are agents some need not be: they are each agent's, and the first may have no use for its own.
"""

from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gne_mj.errors import InvalidInput
from gne_mj.expressions.nodes import Node, NoEntry, Tape, by_shape


def check_entries(
    tape: Tape, roots: Iterable[Node], given: Mapping[str, NDArray[Any]], agents: int
) -> None:
    """Refuse lists with entries that no formula reads.

    Args:
        tape: of the formulas; knows which numbers decided what they are.
        roots: the formulas.
        given: the parameters that are numbers, by name.
        agents: N.

    Raises:
        InvalidInput: names the list, and which of its entries those are.
    """
    others = {name: value for name, value in given.items() if {*value.shape} - {agents}}
    if not others:
        return
    read = np.zeros(len(tape.q), dtype=bool)
    read[[*tape.decided, *(node.args[0] for node in ordered(roots) if node.op == "q")]] = True
    for name, value in others.items():
        first = tape.places[name]
        used = read[first : first + value.size].reshape(value.shape)
        for axis, length in enumerate(value.shape):
            idle = np.flatnonzero(~used.any(axis=tuple({*range(value.ndim)} - {axis})))
            if length != agents and len(idle):
                raise InvalidInput(name, value.tolist(), _idle(value.shape, axis, idle, agents))


def no_entry(error: NoEntry, agents: int, where: str, at: str) -> InvalidInput:
    """The refusal of a list that has no entry which a formula reads.

    Args:
        error: that the formula came to.
        agents: N.
        where: which formula.
        at: of which agent, as "for agent 2", or "".
    """
    right = f"; with one for each agent it has {agents}" if error.shape[0] < agents else ""
    entry = f"[{error.key}] (from 0) {at}".strip()
    expected = f"{where} reads its entry {entry}, and it has {by_shape(error.shape)}{right}"
    return InvalidInput(error.parameter, error.given, expected)


def ordered(roots: Iterable[Node]) -> list[Node]:
    """All nodes of expressions, each behind its arguments."""
    found: dict[int, Node] = {}
    waiting = list(roots)
    while waiting:
        node = waiting[-1]
        args = () if node.op in "yqc" else node.args
        missing = [arg for arg in args if id(arg) not in found]
        if id(node) in found or not missing:
            found.setdefault(id(node), node)
            waiting.pop()
        else:
            waiting += missing
    return list(found.values())


def _idle(shape: tuple[int, ...], axis: int, idle: NDArray[np.int64], agents: int) -> str:
    which = ", ".join(f"[{':, ' * axis}{k}]" for k in idle[:3]) + ", ..." * (len(idle) > 3)
    found = f"no formula reads its {'entry' if len(idle) == 1 else 'entries'} {which} (from 0)"
    needed = shape[axis] - len(idle)
    if idle[0] < needed:  # between others
        return found
    each = ", one for each agent" if needed == agents else ""
    return f"{found}: it has {by_shape(shape)} and must have {needed}{' there' * (axis > 0)}{each}"
