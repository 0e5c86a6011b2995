"""A law written for one agent, of what that agent knows: its own action, its memory, its mail.

The functions are called for each agent in turn with an :class:`Agent` and nothing else, so what the
communication graph does not bring cannot be used by mistake. :func:`joined` makes of them the
functions of a :class:`gne_mj.controllers.plain_law.PlainLaw`, whose memory is the agents' memories
one behind the other.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property, partial
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from gne_mj.errors import UserCodeError
from gne_mj.game_model import Game
from gne_mj.graph import Graph
from gne_mj.ownership import own_slopes

Array = NDArray[np.float64]
Functions = Mapping[str, Callable[..., Any]]


@dataclass(frozen=True, eq=False)
class Neighbour:
    """What an agent sends to those who hear it.

    Attributes:
        index: i, from 0.
        y: its action, (m_i,).
        memory: its memory, as long as it made it; empty at the start.
        block: where its own action stands in a profile (m,).
    """

    index: int
    y: Array
    memory: Array
    block: slice

    def completed(self, estimates: ArrayLike) -> Array:
        """A profile (m,) with the agent's own action in its place."""
        profile = np.array(estimates, dtype=np.float64)
        profile[self.block] = self.y
        return profile


@dataclass(frozen=True, eq=False)
class Agent(Neighbour):
    """What an agent knows besides: its own cost, its own constraints, and what it hears.

    Attributes:
        rho: the penalty.
        neighbours: what the agents that it hears have sent.
    """

    rho: float
    neighbours: tuple[Neighbour, ...]
    _game: Game
    _measured: Array

    def cost_gradient(self, profile: ArrayLike) -> Array:
        """dJ_i/dy_i (m_i,) at a profile (m,), which may be estimated."""
        return self._game.pseudo_gradient(profile)[self.block]

    def barrier_gradient(self, profile: ArrayLike | None = None) -> Array:
        """dphi/dy_i (m_i,) of the agent's own constraints.

        Args:
            profile: (m,), which may be estimated; what is measured if left out.

        Raises:
            ValueError: one of them does not hold strictly.
        """
        game, at = self._game, self._measured if profile is None else profile
        g = (game.constraints(at) + game.margins)[self._constraints]
        if not np.all(g < 0):
            worst = self._constraints[int(np.argmax(np.where(np.isnan(g), np.inf, g)))]
            raise ValueError(
                f"the barrier of agent {self.index + 1} has no gradient outside:"
                f" {game.constraint_names[worst]}"
            )
        return (self.rho / -g) @ own_slopes(game, at)[self._constraints, self.block]

    @cached_property
    def _constraints(self) -> NDArray[np.int64]:
        data = self._game.data
        first, last = data.own_pointer[self.index : self.index + 2]
        return data.own_index[first:last]


def is_local(functions: Functions) -> bool:
    """Whether functions are one agent's: those whose first argument is called ``agent``."""
    code = getattr(functions["action"], "__code__", None)
    return code is not None and code.co_varnames[: code.co_argcount][:1] == ("agent",)


def joined(functions: Functions, game: Game, graph: Graph) -> dict[str, Callable[..., Any]]:
    """The functions of all agents together, as a plain law has them.

    Args:
        functions: ``action(agent)`` returns u_i (m_i,); with a memory ``rate(agent)`` its rate and
            ``initial_memory(agent)`` what it is at the start, of any length.
        game: what is played.
        graph: who hears whom.
    """
    fleet = _Fleet(game, graph)
    calls: dict[str, Callable[..., Array]] = {
        "action": fleet.actions, "rate": fleet.rates, "initial_memory": fleet.start
    }  # fmt: skip
    return {name: partial(calls[name], function) for name, function in functions.items()}


class _Fleet:
    """All agents, and where each one's memory stands."""

    def __init__(self, game: Game, graph: Graph) -> None:
        self._game, self._graph = game, graph
        self.cuts = np.zeros(game.agents + 1, dtype=np.int64)

    def actions(
        self, function: Callable[..., ArrayLike], game: Game, rho: float, y: Array, memory: Array
    ) -> Array:
        """u (m,)."""
        return self._each(function, self._agents(rho, y, memory), game.sizes)

    def rates(
        self, function: Callable[..., ArrayLike], game: Game, rho: float, y: Array, memory: Array
    ) -> Array:
        """The rates of all memories, one behind the other."""
        return self._each(function, self._agents(rho, y, memory), np.diff(self.cuts))

    def start(self, function: Callable[..., ArrayLike], y: Array) -> Array:
        """All memories at the start, whose lengths are theirs from now on."""
        self.cuts[:] = 0
        found = [_row(function, agent) for agent in self._agents(np.nan, y, np.zeros(0))]
        np.cumsum([len(row) for row in found], out=self.cuts[1:])
        return np.concatenate(found)

    @staticmethod
    def _each(
        function: Callable[..., ArrayLike],
        agents: list[Agent],
        sizes: Sequence[int] | NDArray[np.int64],
    ) -> Array:
        found = [_row(function, agent) for agent in agents]
        for i, (row, size) in enumerate(zip(found, sizes, strict=True)):
            if len(row) != size:
                raise UserCodeError(
                    function, f"it must return {size} numbers for agent {i + 1}, not {len(row)}"
                )
        return np.concatenate(found)

    def _agents(self, rho: float, y: Array, memory: Array) -> list[Agent]:
        at, graph = self._game.data.offsets, self._graph.data
        blocks = [slice(a, b) for a, b in pairwise(at)]
        sent = [
            Neighbour(i, y[block], memory[self.cuts[i] : self.cuts[i + 1]], block)
            for i, block in enumerate(blocks)
        ]
        heard = [
            tuple(sent[j] for j in graph.neighbour[graph.pointer[i] : graph.pointer[i + 1]])
            for i in range(len(blocks))
        ]
        return [
            Agent(own.index, own.y, own.memory, own.block, rho, near, self._game, y)
            for own, near in zip(sent, heard, strict=True)
        ]


def _row(function: Callable[..., ArrayLike], agent: Agent) -> Array:
    value = np.asarray(function(agent))
    if value.dtype.kind not in "fiub" or value.ndim > 1:
        raise UserCodeError(
            function, f"it must return a row of numbers for agent {agent.index + 1}, not {value!r}"
        )
    return np.atleast_1d(value).astype(np.float64)
