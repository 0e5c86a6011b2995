"""What a law is, seen from Python: its kernels, its numbers, and its memory at the start.

The kernels of a law's module, each given the game's module or the loop's ``problem`` (see
:mod:`gne_mj.loops.feedback`), are the following. ``work`` has ``profile`` (m,), to be overwritten,
and ``now`` (:mod:`gne_mj.controllers.settings`). Laws that know the plant ask its equations by
:mod:`gne_mj.controllers.plant_model`.

=====================================================  =======================================
``action(game, problem, y, weights, memory, work, u)``  fills u; -1, or agent * p + constraint of
                                                        the first estimate that is not inside, or
                                                        RELAXED where bounds had to be soft
``rate(problem, y, memory, out)``                       fills the memory's rate
``propagate(problem, y, memory, scratch)``              the memory over a control period, y held
``storage(problem, memory)``                            the memory's part of the Lyapunov function
=====================================================  =======================================

Laws whose agents all evaluate their costs at y may have ``action_of_all`` besides, which takes
games that have ``pseudo_gradient(q, y, out)`` (:mod:`gne_mj.linked_game`) and does the same. And,
for mode implicit, in which u = -barrier_free - gain * (gradient of the barrier),

===================================================  =========================================
``barrier_free(game, problem, i, a, y, memory)``      entry a of agent i's action, but the barrier
``add_barrier_free_slope(game, problem, i, a, y,     adds its dy to out (m,), in entries of
memory, out)``                                        agents in J_i only; its symmetric part >= 0
``prepare(problem, first, last, y, memory)``          puts these agents' actions where that reads
``own_profile(problem, i, y, memory, profile)``       what agent i's barrier reads, and how much
                                                      its own block moves with its own action
``memory_outputs(prediction, held)``                  may set the outputs (m,) that the memory
                                                      moves with to those of the period's end
===================================================  =========================================
"""

from abc import ABC, abstractmethod
from collections.abc import Iterable
from dataclasses import replace
from types import ModuleType
from typing import ClassVar, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from gne_mj.controllers import settings
from gne_mj.controllers.estimates import given_estimates
from gne_mj.controllers.kept import EVERYTHING, Kept, KeptData
from gne_mj.controllers.propagation import Propagator, no_propagator, propagator
from gne_mj.controllers.theorem import LawTheorem
from gne_mj.errors import InvalidInput, named
from gne_mj.game_model import Game
from gne_mj.graph import Graph, GraphData

_NOBODY = GraphData(np.zeros(1, dtype=np.int64), np.zeros(0, dtype=np.int64))


class MemoryPart(NamedTuple):
    """Some entries of a law's memory, as trajectories show them.

    Attributes:
        name, long_name: of the variable.
        rows: whether it is a row of all actions for each agent, (N, m): what each takes them to
            be, its own entries being no matter; else one row, (m,).
        kept: which of these rows' entries there are, if not all: those of the law's ``kept``, and
            room for a profile behind them.
        dims, shape: of something else than actions: its dimensions, and how long each of them is.
    """

    name: str
    long_name: str
    rows: bool = False
    kept: bool = False
    dims: tuple[str, ...] = ()
    shape: tuple[int, ...] = ()


ESTIMATES = MemoryPart("estimate", "what each agent takes the actions to be", rows=True)
KEPT_ESTIMATES = MemoryPart("estimate", "what an agent takes an action to be", kept=True)


class Law(ABC):
    """A feedback law of one information structure.

    What other modules ask of a law is here, so that none of them has to know which laws there are.

    Attributes:
        information: name of the information structure; "custom" if it is none of the paper's.
        proven: what is proven of the law; a subclass, which may change the law, says it again.
        promise: of a law that is not the paper's, what its own source promises, in words.
        graph: over which agents communicate; None if they need not.
        gain: k, the factor of the penalised pseudo-gradient in the input.
        coupling: c, the factor of the Laplacian of all profiles in the input; 0 without.
        time_constant: tau of the estimates in s, where the input has a Laplacian.
        epsilon: time constant of fast estimates in s; None without.
        fast_weight: weight of their squared errors in the Lyapunov function; 0 without.
        memory_parts: what its memory begins with, one part after the other.
        alone: in mode implicit, whether each agent solves alone because its barrier is at what it
            takes for the profile. Others may (``decentralised``), or solve all together.
        rosenbrock: whether integrator rosenbrock knows its Jacobian.
        kept: the estimates that it keeps, where these are not all.
        sent_besides: entries of each of the two rows an agent that stand behind all estimates and
            are sent with them; 0 for none.
        propagates: whether its memory can be propagated, as mode sampled needs.
        guarded: whether the barrier's whole gradient at the measured outputs is part of the input,
            so that outputs which are measured and driven as they should be cannot leave the set in
            continuous time, whatever the agents do.
        acts_outside: whether the law has an action where constraints are violated, as one without
            a barrier: with ``simulation.on_exit = "continue"`` its runs go on there.
        knows_plant: whether it asks for the agents' own equations and their whole state.
        of_period: whether an input that is held depends on for how long that is.
    """

    information: ClassVar[str] = "custom"
    proven: ClassVar[LawTheorem | None] = None
    promise: ClassVar[str] = ""
    graph: Graph | None = None
    gain: float = 1.0
    coupling: float = 0.0
    time_constant: float = 1.0
    epsilon: float | None = None
    fast_weight: float = 0.0
    memory_parts: ClassVar[tuple[MemoryPart, ...]] = ()
    alone: ClassVar[bool] = False
    rosenbrock: ClassVar[bool] = False
    kept: Kept | None = None
    sent_besides: int = 0
    propagates: bool = True
    guarded: ClassVar[bool] = False
    acts_outside: ClassVar[bool] = False
    knows_plant: ClassVar[bool] = False
    of_period: ClassVar[bool] = False

    @property
    def theorem(self) -> LawTheorem | None:
        """What is proven of this very law; None if nothing is."""
        found: LawTheorem | None = vars(type(self)).get("proven")
        return found

    @property
    def has_estimates(self) -> bool:
        """Whether agents hold estimates of each other's actions."""
        return any(part.rows or part.kept for part in self.memory_parts)

    @property
    def implicit(self) -> bool:
        """Whether its kernels have what mode implicit solves with."""
        return hasattr(self.kernels, "add_barrier_free_slope")

    @property
    @abstractmethod
    def kernels(self) -> ModuleType:
        """The module of kernels."""

    @property
    def graph_data(self) -> GraphData:
        """The graph for native code; nobody hears anybody without one."""
        return self.graph.data if self.graph is not None else _NOBODY

    @property
    def kept_data(self) -> KeptData:
        """Which estimates it keeps, for native code; empty where these are all, or none."""
        return EVERYTHING if self.kept is None else self.kept.data

    @property
    def listeners(self) -> NDArray[np.int64]:
        """How many neighbours each agent's action is coupled to, (N,)."""
        assert self.graph is not None
        return np.diff(self.graph.data.pointer) if self.kept is None else self.kept.links

    def estimates_in(
        self, memory: NDArray[np.float64], owner: NDArray[np.int64]
    ) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
        """All estimates in a memory, (k,): of which entry of a profile each is, and what it says.

        Args:
            memory: the law's.
            owner: the agent that each entry of a profile belongs to, (m,).
        """
        if self.kept is not None:
            others = self.kept.estimated
            return self.kept.action[others], memory[: self.kept.size][others]
        agents, m = int(owner[-1]) + 1, len(owner)
        others = owner != np.arange(agents)[:, None]
        rows = memory[: agents * m].reshape(agents, m)
        return np.broadcast_to(np.arange(m), (agents, m))[others], rows[others]

    @property
    def estimate_rate(self) -> float:
        """What multiplies the Laplacian in the estimates' dynamics, in 1/s; 0 without estimates."""
        return 0.0

    def settings(self, rho: float) -> NDArray[np.float64]:
        """The law's numbers for native code (see :mod:`gne_mj.controllers.settings`)."""
        numbers = np.ones(settings.COUNT)
        numbers[settings.RHO] = rho
        numbers[settings.GAIN], numbers[settings.RATE] = self.gain, self.estimate_rate
        numbers[settings.LINKS] = 0.0
        numbers[settings.OBSERVER] = numbers[settings.COMPENSATION] = 0.0
        numbers[settings.BESIDES] = self.sent_besides
        numbers[settings.GUARDED] = float(self.guarded)
        numbers[settings.OUTSIDE] = settings.ENDS if self.acts_outside else settings.NO_ACTION
        return numbers

    def initial_memory(
        self,
        y: NDArray[np.float64],
        estimate: ArrayLike | None = None,
        filtered: ArrayLike | None = None,
    ) -> NDArray[np.float64]:
        """The memory at the start.

        Args:
            y: initial profile (m,).
            estimate: what the agents take the actions to be: one number, a profile (m,) that all
                hold, or one row for each agent (N, m); y if left out.
            filtered: z(0), one number or (m,); y if left out.
        """
        if estimate is not None:
            raise InvalidInput("estimate", "given", f"the {self.information} law has no estimates")
        if filtered is not None:
            raise InvalidInput("filtered", "given", f"the {self.information} law has no z")
        return self.first_memory(y)

    def first_memory(self, y: NDArray[np.float64]) -> NDArray[np.float64]:
        """The memory at the start of a law without estimates and z: none, of most.

        Args:
            y: initial profile (m,).
        """
        return np.zeros(0)

    def among(self, there: NDArray[np.bool_]) -> "Law":
        """The law of those agents that are there, (N,).

        Raises:
            InvalidInput: it does not say what that is, or their graph is not connected.
        """
        raise InvalidInput(
            "law", self.information, "it does not say how it goes on among fewer agents"
        )

    def _over_fewer(self, there: NDArray[np.bool_]) -> "Law":
        """:meth:`among` of a law that is a dataclass with a graph."""
        if self.kept is not None:
            expected = "agents must keep all estimates where some leave or join: use 'all'"
            raise InvalidInput("law.estimates", "some", expected)
        assert self.graph is not None
        fewer: Law = replace(self, graph=self.graph.among(there))  # type: ignore[type-var]
        return fewer

    def without_links(self, lost: Iterable[tuple[int, int]]) -> "Law":
        """The law of agents between whom these links, pairs from 0, are lost; all others are there.

        Raises:
            InvalidInput: its graph stays as it is, or it has none; names ``lost``.
        """
        lost = list(lost)
        pairs = [[first + 1, second + 1] for first, second in lost]
        if self.graph is None:
            raise InvalidInput("lost", pairs, f"the {self.information} law has no links to lose")
        if self.graph.changes:
            raise InvalidInput("lost", pairs, "its graph changes by itself already")
        if self.kept is not None:
            raise InvalidInput("lost", pairs, "agents must keep all estimates: estimates = 'all'")
        if not hasattr(self, "__dataclass_fields__"):
            raise InvalidInput("lost", pairs, "a law of one's own keeps its links")
        fewer: Law = replace(self, graph=self.graph.without(lost))  # type: ignore[type-var]
        return fewer

    def memory_storage(
        self,
        memory: NDArray[np.float64],
        owner: NDArray[np.int64],
        equilibrium: NDArray[np.float64],
    ) -> NDArray[np.float64]:
        """The memory's part of the Lyapunov function, (samples,), as the kernel ``storage`` has it.

        Args:
            memory: (samples, entries), with agents' own actions in place.
            owner: the agent that each entry of a profile belongs to, (m,).
            equilibrium: y*, (m,).
        """
        return np.zeros(len(memory))

    def barrier_profiles(
        self, game_actions: NDArray[np.int64], memory: NDArray[np.float64]
    ) -> NDArray[np.float64]:
        """The profiles of their own at which agents evaluate the barrier, (N, m); none: (0, m).

        Args:
            game_actions: which agent each entry of a profile belongs to, (m,).
            memory: the law's memory.
        """
        return np.zeros((0, len(game_actions)))

    def propagator(self, period: float, lists: GraphData | None = None) -> Propagator:
        """What ``propagate`` needs for a control period in s.

        Args:
            period: in s.
            lists: who hears whom meanwhile; by the law's graph if left out.
        """
        if self.graph is None:
            return no_propagator()
        with named(duration="period"):
            if self.kept is not None:
                return self.kept.propagator(self.estimate_rate * period)
            return propagator(lists or self.graph.data, self.estimate_rate * period)

    def room(self, game: Game) -> float:
        """How many numbers an evaluation of it works on, where these are many."""
        return 0.0

    def step_propagator(self, timestep: float) -> Propagator:
        """What ``rate`` needs to know of the timestep in s, mode continuous: nothing, of most laws.

        Args:
            timestep: in s.
        """
        return no_propagator()


def check_positive(law: Law, *keys: str) -> None:
    """Refuse a law with one of these numbers not positive and finite.

    Raises:
        InvalidInput: names the first such key.
    """
    for key in keys:
        value = getattr(law, key)
        if not (np.isfinite(value) and value > 0):
            raise InvalidInput(key, value, "it must be positive and finite")


def initial_estimates(
    agents: int, y: NDArray[np.float64], estimate: ArrayLike | None
) -> NDArray[np.float64]:
    """All agents' estimates at the start, flat (N m,); see :meth:`Law.initial_memory`."""
    given = given_estimates(agents, y, estimate)
    return np.broadcast_to(given, (agents, len(y))).astype(np.float64).ravel()
