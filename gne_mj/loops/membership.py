"""A closed loop whose agents leave and join: loops of those present, one after the other.

Rows are those of all agents, not numbers for those that are away. What is measured at every step is
handed from loop to loop, so that it is of the whole run; V is another game's after a change, and is
not compared across it.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, Protocol, get_args, get_type_hints

import numpy as np
from numpy.typing import NDArray

from gne_mj.errors import EngineError, InfeasibleStart, Refusal
from gne_mj.loops import monitor as watch
from gne_mj.loops.base import ClosedLoop, Present, Samples
from gne_mj.loops.layout import Setup
from gne_mj.loops.pieces import LoopInPieces
from gne_mj.membership import Change, There

Array = NDArray[np.float64]
Indices = NDArray[np.int64]

NEVER = 2**62  # steps until there is no change any more
# Of which list a monitor's arrays have entries; and numbers that name one of these lists' entries
_LISTS = {
    name: get_args(hint)[1]
    for name, hint in get_type_hints(watch.Monitor, include_extras=True).items()
    if get_args(hint)
}
_NAMES = {
    "exit_agent": "agents", "exit_constraint": "p", "saturated_action": "m",
    "positions_constraint": "p", "contact_agent": "agents", "contact_other": "agents",
    "nearest_first": "agents", "nearest_second": "agents",
}  # fmt: skip


@dataclass(frozen=True, eq=False)
class Part:
    """The loop of those present.

    Attributes:
        loop: theirs, going on from a step.
        there: (N,) who they are.
        actions, constraints, memory: which of the whole run's its own are, in their order.
    """

    loop: ClosedLoop
    there: There
    actions: Indices
    constraints: Indices
    memory: Indices

    def number(self, kind: str) -> Indices:
        """Of actions ("m"), constraints ("p") or agents of its own, those of the whole run."""
        known = {"m": self.actions, "p": self.constraints}
        return known.get(kind, np.flatnonzero(self.there))


class Company(Protocol):
    """Who can be there, and how loops of those present are made."""

    def part(self, there: There, state: Array, memory: Array, step: int) -> Part:
        """The loop of those that are there, from all agents' states and memories at a step.

        Raises:
            InfeasibleStart: these are not strictly inside.
            InvalidInput: they cannot go on by themselves.
        """

    def welcome(
        self, change: Change, there: There, state: Array, memory: Array
    ) -> tuple[Array, Array]:
        """All agents' states and memories with those who join, ``there`` being there before."""


@dataclass
class _Due:
    """A change and at which step it is made."""

    step: int
    change: Change
    again: bool = False  # those who join were not admitted before

    def of(self, agents: Sequence[int]) -> bool:
        """Whether some of these agents try again to join."""
        return self.again and bool(set(self.change.joins) & set(agents))


class MembershipLoop(LoopInPieces):
    """Loops of those present, one after the other.

    Args:
        company: makes them.
        changes: by their times.
        first: the loop of those there at the start.
        start: all agents' states (m, states) and memory.
        constraints: p.
        h: length of a step in s.

    Attributes:
        membership: who was there at the start, and what became of each change.
    """

    def __init__(
        self,
        company: Company,
        changes: Sequence[Change],
        first: Part,
        start: tuple[Array, Array],
        constraints: int,
        h: float,
    ) -> None:
        self._company, self._part, self._h = company, first, h
        self._states, self._memory = (np.full(each.shape, np.nan) for each in start)
        self._due = [_Due(round(change.time / h), change) for change in changes]
        self._seen = watch.fresh(len(start[0]), constraints)
        self._seen.worst[:] = -np.inf
        self._seen.least_distance = np.inf
        self._force = np.zeros(len(start[0]))
        self._changes: list[dict[str, Any]] = []
        self._at_start = _numbers(first.there)

    @property
    def membership(self) -> dict[str, Any]:  # type: ignore[override]
        """See the base class."""
        return {"at_start": self._at_start, "changes": self._changes}

    @property
    def network(self) -> dict[str, Any] | None:  # type: ignore[override]
        """See the base class; of the graph among those that are there now."""
        return self._part.loop.network

    @property
    def monitor(self) -> Any:
        """Of the whole run, a copy."""
        found, own, part = self._seen.copy(), self._part.loop.monitor, self._part
        for name in own.dtype.names:
            if name in _LISTS:
                found[name][part.number(_LISTS[name])] = own[name]
            elif name in _NAMES:
                found[name] = _named(float(own[name]), part.number(_kind(own, name)))
            else:
                found[name] = own[name]
        return found

    @property
    def _inside(self) -> bool:
        return bool(self._part.loop.monitor.exit == watch.INSIDE)

    @property
    def time(self) -> float:
        """Time of the present state in s."""
        return self._part.loop.time

    @property
    def _step(self) -> int:
        return round(self.time / self._h)

    def finish(self) -> Samples:
        """See the base class."""
        return self._spread(self._part.loop.finish())

    def present(self) -> Present:
        """See the base class; not numbers for those that are away."""
        now = self._part.loop.present()
        state, memory = self._states.copy(), self._memory.copy()
        state[self._part.actions], memory[self._part.memory] = now.state, now.memory
        return Present(state, memory, now.configuration)

    def push(self, force: Array) -> None:
        """See the base class."""
        self._part.loop.push(force[self._part.actions])
        self._force = force

    def push_unit(self, channel: int) -> str:
        """See the base class; of one that is there."""
        return self._part.loop.push_unit(int(np.searchsorted(self._part.actions, channel)))

    def _adopt(self, setup: Setup) -> None:
        raise EngineError("numbers stay as they are where agents leave and join")

    def _go(self, samples: int, every: int) -> Samples:
        return self._spread(self._part.loop.advance(samples, every))

    def _spread(self, rows: Samples) -> Samples:
        part, count = self._part, len(rows.input)
        state = np.full((count, *self._states.shape), np.nan)
        u = np.full((count, len(self._states)), np.nan)
        memory = np.full((count, len(self._memory)), np.nan)
        state[:, part.actions], u[:, part.actions] = rows.state, rows.input
        memory[:, part.memory] = rows.memory
        return Samples(state, u, memory, rows.measurement, rows.applied, rows.configuration)

    def _look(self) -> int:
        step = self._step
        while self._due and self._due[0].step <= step and self._inside:
            self._make(self._due.pop(0).change, step)
        return self._due[0].step - step if self._due else NEVER

    def _make(self, change: Change, step: int) -> None:
        """Let some leave, then some join."""
        self._part.loop.finish()  # so that memories are of now
        if not self._inside:
            return
        there = self._part.there
        for agents, comes in ((change.leaves, False), (change.joins, True)):
            able = [i for i in agents if bool(there[i]) != comes]
            if not comes:  # nor does any of them try again
                self._due = [due for due in self._due if not due.of(agents)]
            if not able:
                continue
            after, present = there.copy(), self.present()
            after[able] = comes
            state, memory = present.state, present.memory
            if comes:
                state, memory = self._company.welcome(change, there, state, memory)
            refused = self._turn(after, state, memory, step)
            there = self._part.there
            self._note(step, able, comes, refused)
            if refused is not None and comes and change.retry > 0.0:
                others = replace(change, leaves=())
                again = _Due(step + round(change.retry / self._h), others, again=True)
                self._due = sorted([*self._due, again], key=lambda due: due.step)

    def _turn(self, there: There, state: Array, memory: Array, step: int) -> Refusal | None:
        """Go on among these; the reason if they cannot."""
        seen = self.monitor
        try:
            part = self._company.part(there, state, memory, step)
        except Refusal as error:
            return error
        monitor = part.loop.monitor
        for name in monitor.dtype.names:
            if name in _LISTS:
                monitor[name][:] = seen[name][part.number(_LISTS[name])]
            elif name in _NAMES:
                monitor[name] = -2.0 - seen[name]  # it may be of somebody who is away now
            else:
                monitor[name] = seen[name]
        monitor.storage = np.nan  # of another game
        self._seen, self._part = seen, part
        if np.any(self._force):
            self.push(self._force)
        return None

    def _note(self, step: int, agents: list[int], comes: bool, refused: Refusal | None) -> None:
        note: dict[str, Any] = {
            "time": step * self._h,
            "what": "joined" if comes else "left",
            "agents": [int(i) + 1 for i in agents],
            "done": refused is None,
            "there": _numbers(self._part.there),
            "constraint": None,
            "value": None,
            "why": None if refused is None else refused.about,
        }
        if isinstance(refused, InfeasibleStart):
            note |= {"constraint": refused.constraint, "value": float(refused.value)}
        last = self._changes[-1] if self._changes else {}
        tried = (note["what"], note["agents"], False)
        if not note["done"] and tried == tuple(last.get(k) for k in ("what", "agents", "done")):
            note["tried"] = last.get("tried", 1) + 1  # again; the last attempt is kept
            self._changes.pop()
        self._changes.append(note)


def _numbers(there: There) -> list[int]:
    """Agents from 1."""
    return [int(i) + 1 for i in np.flatnonzero(there)]


def _kind(monitor: Any, name: str) -> str:
    """Of which list a number names an entry: of two agents that are near both are agents."""
    of_two = monitor.exit in (watch.TOO_NEAR, watch.STEP_TOO_SMALL) and monitor.exit_agent >= 0
    if name == "exit_constraint" and of_two:
        return "agents"
    return _NAMES[name]


def _named(value: float, numbers: Indices) -> float:
    """An entry's number in the whole run: noted in a loop before, or in this one, or none."""
    if value <= -2.0:
        return -2.0 - value
    return value if value < 0.0 else float(numbers[int(value)])
