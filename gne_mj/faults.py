"""What can go wrong in a run, as users state it, and as native code reads it.

Faults are deterministic: what is random follows from the run's seed, the fault's place in the list
and the control period (pushes: the integration step).
"""

from abc import ABC
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from gne_mj.errors import InvalidInput
from gne_mj.game_model import Game
from gne_mj.graph import Graph
from gne_mj.loops import faults as native
from gne_mj.loops.feedback import FAULT_KINDS, FaultNumbers, Faults
from gne_mj.numbers import numbers

LARGEST = 1e9  # what a fault may have in any unit

SHAPES = {
    "constant": native.STEADY,
    "sine": native.SINE,
    "square": native.SQUARE,
    "random": native.RANDOM,
}


@dataclass(frozen=True)
class Fault(ABC):
    """One fault.

    Args:
        agents: whom it strikes, numbered from 0; all if left out.
        start, end: from when (s) and until when, the end not included.
    """

    kind: ClassVar[int]
    # The field that says how much, and between which values it may be; None if there is none
    measure: ClassVar[tuple[str, float, float] | None] = None
    needs_graph: ClassVar[str] = ""  # why it strikes only laws with a graph; empty if it does not
    agents: tuple[int, ...] | None = None
    start: float = 0.0
    end: float = np.inf

    def __post_init__(self) -> None:
        if not 0.0 <= self.start < self.end:
            raise InvalidInput(
                "end", self.end, f"it must be later than the start, {self.start:g} s"
            )
        if self.measure is not None:
            key, low, high = self.measure
            if not low <= self.size <= high:
                raise InvalidInput(key, self.size, f"it must be between {low:g} and {high:g}")

    @property
    def size(self) -> float:
        """How much: the column SIZE."""
        return 0.0 if self.measure is None else float(getattr(self, self.measure[0]))

    @property
    def shape(self) -> tuple[float, float]:
        """The columns SHAPE and PERIOD."""
        return 0.0, 0.0

    def targets(self, game: Game, graph: Graph | None) -> list[int]:
        """What it strikes: here all entries of the agents' actions."""
        agents = range(game.agents) if self.agents is None else self.agents
        for agent in agents:
            if not 0 <= agent < game.agents:
                raise InvalidInput("agents", agent + 1, f"agents are numbered 1 to {game.agents}")
        at = game.data.offsets
        return [r for i in agents for r in range(at[i], at[i + 1])]


@dataclass(frozen=True)
class Push(Fault):
    """A force on the agents besides their input, in the input's unit, constant within a step.

    Args:
        force: its size; negative for the other direction.
        profile: "constant", "sine" or "square" (with ``period`` in s), or "random" (uniform
            between -force and force, anew at every integration step).
        period: in s.
        axis: which entry of the agents' actions is pushed, from 0; all if left out.
    """

    kind: ClassVar[int] = native.PUSH
    measure = ("force", -LARGEST, LARGEST)
    force: float = 0.0
    axis: int | None = None
    profile: str = "constant"
    period: float = 1.0

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.profile not in SHAPES:
            raise InvalidInput("profile", self.profile, f"choose from {', '.join(SHAPES)}")
        if not 0.0 < self.period < np.inf:
            raise InvalidInput("period", self.period, "it must be positive and finite")

    def targets(self, game: Game, graph: Graph | None) -> list[int]:
        """Those entries of the agents' actions."""
        entries = super().targets(game, graph)
        if self.axis is None:
            return entries
        if not 0 <= self.axis < min(game.sizes):
            raise InvalidInput("axis", self.axis + 1, f"actions have {min(game.sizes)} entries")
        at, owner = game.data.offsets, game.agent_of_action
        return [r for r in entries if r - at[owner[r]] == self.axis]

    @property
    def shape(self) -> tuple[float, float]:
        """See the base class."""
        return float(SHAPES[self.profile]), self.period


@dataclass(frozen=True)
class Saturation(Fault):
    """Actuators that deliver less than they should.

    Args:
        limit: greatest |u| meanwhile, not negative; zero for none at all.
    """

    kind: ClassVar[int] = native.LIMIT
    measure = ("limit", 0.0, LARGEST)
    limit: float = 0.0


@dataclass(frozen=True)
class Noise(Fault):
    """Outputs that are read with noise, uniform and independent from control period to period.

    Args:
        amplitude: greatest error, in the output's unit.
    """

    kind: ClassVar[int] = native.NOISE
    measure = ("amplitude", 0.0, LARGEST)
    amplitude: float = 0.0


@dataclass(frozen=True)
class Bias(Fault):
    """Outputs that are read with a constant error.

    Args:
        offset: what is read less what is, in the output's unit.
    """

    kind: ClassVar[int] = native.BIAS
    measure = ("offset", -LARGEST, LARGEST)
    offset: float = 0.0


@dataclass(frozen=True)
class SensorDelay(Fault):
    """All sensors of the system read what was some control periods ago, for the whole run.

    Args:
        periods: how many, a whole number.
    """

    kind: ClassVar[int] = -1  # no rows: it strikes everyone
    measure = ("periods", 0, 1000)
    periods: int = 1

    def __post_init__(self) -> None:
        super().__post_init__()
        for key, whole in (("agents", None), ("start", 0.0), ("end", np.inf)):
            given = getattr(self, key)
            if given != whole:
                raise InvalidInput(key, given, "sensors are late for all agents and a whole run")


@dataclass(frozen=True)
class _OnLinks(Fault):
    """A fault of messages: over the links of ``edges``, and of all edges of ``agents``.

    Args:
        edges: pairs of agents, numbered from 0, both directions.
    """

    needs_graph = "the full-information law sends no messages"
    edges: tuple[tuple[int, int], ...] | None = None

    def targets(self, game: Game, graph: Graph | None) -> list[int]:
        """The links it strikes: entries of the graph's neighbour lists."""
        if graph is None:
            raise InvalidInput("graph", None, self.needs_graph)
        super().targets(game, graph)
        known = set(graph.edges)
        for i, j in self.edges or ():
            if (min(i, j), max(i, j)) not in known:
                raise InvalidInput("edges", [i + 1, j + 1], "the graph has no such edge")
        everyone = self.agents is None and self.edges is None
        struck = {frozenset(edge) for edge in self.edges or ()}
        whom = set(self.agents or ())
        links = []
        data = graph.data
        for i in range(graph.agents):
            for link in range(data.pointer[i], data.pointer[i + 1]):
                j = int(data.neighbour[link])
                if everyone or frozenset((i, j)) in struck or i in whom or j in whom:
                    links.append(link)
        return links


@dataclass(frozen=True)
class MessageLoss(_OnLinks):
    """Messages that do not arrive, each one with a probability; the receiver keeps the last one.

    Args:
        probability: between 0 and 1.
    """

    kind: ClassVar[int] = native.LOSS
    measure = ("probability", 0.0, 1.0)
    probability: float = 0.5


@dataclass(frozen=True)
class MessageDelay(_OnLinks):
    """Messages that arrive some control periods late.

    Args:
        periods: how many, a whole number.
    """

    kind: ClassVar[int] = native.LATE
    measure = ("periods", 0, 1000)
    periods: int = 1


@dataclass(frozen=True)
class Silence(_OnLinks):
    """Edges over which nothing comes, or agents who neither send nor hear, for a while."""

    kind: ClassVar[int] = native.SILENCE


@dataclass(frozen=True)
class Corruption(Fault):
    """The agents' estimates shifted once, at ``start``, each by a random number.

    Args:
        amplitude: greatest shift, in the action's unit.
    """

    kind: ClassVar[int] = native.CORRUPTION
    measure = ("amplitude", 0.0, LARGEST)
    needs_graph = "the full-information law has no estimates"
    amplitude: float = 0.0

    def targets(self, game: Game, graph: Graph | None) -> list[int]:
        """The agents themselves."""
        if graph is None:
            raise InvalidInput("graph", None, self.needs_graph)
        super().targets(game, graph)
        return list(range(game.agents) if self.agents is None else self.agents)


@dataclass(frozen=True)
class EventTrigger(Fault):
    """No fault: agents that send when their triggers fire, and not once a control period.

    What an agent would send is its row of all actions, its own among them. Its trigger fires where
    |row - row sent last|^2 > sigma (sum over its links of |row - row heard last|^2) +
    (threshold exp(-decay t))^2. Until the next message neighbours hold the last one.

    Args:
        sigma: share of the disagreement, not negative.
        threshold: in the action's unit, at the start.
        decay: in 1/s, not negative.
    """

    kind: ClassVar[int] = native.TRIGGER
    measure = ("threshold", 0.0, LARGEST)
    needs_graph = "the full-information law sends no messages"
    sigma: float = 0.0
    threshold: float = 0.0
    decay: float = 0.0

    def __post_init__(self) -> None:
        super().__post_init__()
        for key in ("sigma", "decay"):
            value = getattr(self, key)
            if not 0.0 <= value <= LARGEST:
                raise InvalidInput(key, value, f"it must be between 0 and {LARGEST:g}")

    @property
    def shape(self) -> tuple[float, float]:
        """See the base class."""
        return self.sigma, self.decay

    def targets(self, game: Game, graph: Graph | None) -> list[int]:
        """All agents."""
        if graph is None:
            raise InvalidInput("graph", None, self.needs_graph)
        return list(range(game.agents))


MESSAGES = (MessageLoss, MessageDelay, Silence, EventTrigger)


def sensor_delay(faults: Sequence[Fault]) -> int:
    """By how many control periods sensors are late."""
    return max((fault.periods for fault in faults if isinstance(fault, SensorDelay)), default=0)


def message_delay(faults: Sequence[Fault]) -> int:
    """By how many control periods messages are late at most."""
    return max((fault.periods for fault in faults if isinstance(fault, MessageDelay)), default=0)


def steady_push(game: Game, forces: NDArray[np.float64], **course: Any) -> tuple[Push, ...]:
    """Pushes of so much on every entry of the profile, forces of (m,), zeros left out."""
    at, owner = game.data.offsets, game.agent_of_action
    return tuple(
        Push(agents=(int(owner[r]),), axis=int(r - at[owner[r]]), force=float(force), **course)
        for r, force in enumerate(forces)
        if force
    )


def strikes_messages(faults: Sequence[Fault]) -> bool:
    """Whether what agents hear must be kept link by link."""
    return any(isinstance(fault, MESSAGES) for fault in faults)


def triggered(faults: Sequence[Fault]) -> bool:
    """Whether agents send by triggers."""
    return any(isinstance(fault, EventTrigger) for fault in faults)


def for_native(faults: Sequence[Fault], game: Game, graph: Graph | None, seed: int) -> Faults:
    """The faults as a run reads them; their random numbers follow from ``seed``."""
    rows: list[list[float]] = []
    counts = np.zeros(FAULT_KINDS, dtype=np.int64)
    for kind in range(FAULT_KINDS):
        for stream, fault in enumerate(faults):
            if fault.kind != kind:
                continue
            for target in fault.targets(game, graph):
                rows.append([target, fault.start, fault.end, fault.size, *fault.shape, stream])
                counts[kind] += 1
    pointer = np.concatenate([[0], np.cumsum(counts)]).astype(np.int64)
    about = numbers(
        FaultNumbers, seed=seed, sensor_delay=sensor_delay(faults),
        message_delay=message_delay(faults),
    )  # fmt: skip
    return Faults(np.array(rows, dtype=np.float64).ravel(), pointer, about)


def links_memory(
    graph: Graph, actions: int, memory: NDArray[np.float64], delay: int, besides: int = 0
) -> NDArray[np.float64]:
    """What a law's memory needs behind it where messages can be lost or late, flat.

    Over every link the sender's row, as if it had come just before the start; then room for the
    rows sent during the last ``delay`` + 1 control periods. ``besides`` is the law's
    ``sent_besides``.
    """
    agents = graph.agents
    sent = memory[: agents * (actions + 2 * besides)]
    estimates, others = sent[: agents * actions], sent[agents * actions :]
    blocks = estimates.reshape(agents, -1), *others.reshape(2, agents, -1)
    rows = np.concatenate(blocks, axis=1)
    return np.concatenate([rows[graph.data.neighbour].ravel(), np.tile(sent, delay + 1)])
