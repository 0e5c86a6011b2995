"""What a system is: one game with its agents, law, engine and start, as data."""

from dataclasses import dataclass, field
from functools import cached_property
from types import ModuleType

import numpy as np
from numpy.typing import NDArray

from gne_mj.barrier import LogBarrier, Schedule
from gne_mj.changing_graph import ChangingGraph
from gne_mj.controllers import Law
from gne_mj.equilibrium import (
    Equilibrium,
    middle,
    penalised_equilibrium,
    variational_equilibrium,
)
from gne_mj.equilibrium_path import EquilibriumPath
from gne_mj.errors import GneError, SolverError
from gne_mj.faults import Fault, links_memory, message_delay, strikes_messages, triggered
from gne_mj.game_model import Game
from gne_mj.graph import GraphData
from gne_mj.loops import (
    faultless,
    faultless_apart,
    guarded,
    guarded_faults,
    moving,
    standing,
)
from gne_mj.loops import faults as native_faults
from gne_mj.margins import Disturbance, of_the_set
from gne_mj.membership import Membership
from gne_mj.motion import motion_of
from gne_mj.plain import forgive_pending
from gne_mj.plants.agent_type import followed_position, placed_state
from gne_mj.plants.agents import Agents
from gne_mj.separation import Separation

ADAPTIVE = ("tsit5", "rosenbrock")  # integrators that choose their steps
# What is done between two control instants: every step is watched; or a period that would lead
# outside is cut before it begins
WATCHED, GUARDED = "watched", "guarded"
# What a run does where it leaves the set: it ends, or goes on if its law has an action there
STOP, CONTINUE = "stop", "continue"


@dataclass(frozen=True, eq=False)
class SystemData:
    """A game that agents play under a law; :class:`gne_mj.system.System` says what each part is."""

    name: str
    game: Game
    agents: Agents
    law: Law
    rho: float
    state: NDArray[np.float64]
    mode: str = "continuous"
    engine: str = "ode"
    integrator: str = "rk4"
    memory: NDArray[np.float64] = field(default_factory=lambda: np.zeros(0))
    schedule: Schedule | None = None
    feed_forward: bool = False
    decentralised: bool = False
    between: str = WATCHED
    faults: tuple[Fault, ...] = ()
    seed: int = 0
    disturbance: Disturbance | None = None
    separation: Separation | None = None
    rtol: float = 1e-6
    observer: float = 0.0
    compensation: bool = False
    load: NDArray[np.float64] | None = None
    on_exit: str = STOP
    membership: Membership | None = None
    barrier: LogBarrier = field(init=False)

    @property
    def guarded(self) -> bool:
        """Whether control periods end early where they would lead outside."""
        return self.between == GUARDED

    @property
    def goes_on(self) -> bool:
        """Whether runs go on where they leave the set."""
        return self.on_exit == CONTINUE and self.law.acts_outside

    @property
    def start(self) -> NDArray[np.float64]:
        """y(0), shape (m,)."""
        return self.state[:, self.agents.kind.OUTPUT]

    @property
    def start_positions(self) -> NDArray[np.float64] | None:
        """q(0), shape (m,), of agents whose positions follow their outputs; None of others."""
        at = followed_position(self.agents.kind)
        return None if at < 0 else self.state[:, at]

    def places(self, state: NDArray[np.float64]) -> NDArray[np.float64] | None:
        """Where agents are, (..., N, d) in m, in states (..., m, states); None without places."""
        placed = placed_state(self.agents.kind)
        if placed is None:
            return None
        at = [name for name, _ in self.agents.kind.STATES].index(placed)
        return state[..., at].reshape(*state.shape[:-2], self.game.agents, -1)

    @property
    def graph_at_start(self) -> GraphData:
        """Who hears whom at the start; nobody hears anybody without a graph."""
        graph = self.law.graph
        if isinstance(graph, ChangingGraph):
            return graph.lists_at(0.0, self.places(self.state), self.seed)
        return self.law.graph_data

    @property
    def equilibrium(self) -> Equilibrium:
        """The penalised equilibrium, from y(0); where that is too near a bound, from the middle.

        Raises:
            SolverError: none was found.
        """
        if isinstance(self._solved, SolverError):
            raise self._solved
        return self._solved

    @property
    def known_equilibrium(self) -> Equilibrium | None:
        """The same; None where none was found, and a run is still possible."""
        return None if isinstance(self._solved, SolverError) else self._solved

    @property
    def centre(self) -> NDArray[np.float64]:
        """A profile strictly inside, about which V is taken: y*, or y(0) if y* is not known."""
        known = self.known_equilibrium
        return self.start if known is None else known.action

    @cached_property
    def _solved(self) -> Equilibrium | SolverError:
        try:
            return penalised_equilibrium(self.game, self.rho, self.start)
        except SolverError:
            try:
                return penalised_equilibrium(self.game, self.rho, middle(self.game, self.start))
            except SolverError as error:
                return error

    @cached_property
    def variational(self) -> Equilibrium | None:
        """The variational equilibrium of the set itself, whatever keeps farther away from it; None
        where none was found, and of a game that moves."""
        known = self.known_equilibrium
        if known is None or motion_of(self.game) is not None:
            return None
        try:
            return variational_equilibrium(of_the_set(self.game), known)
        except SolverError:
            return None

    @property
    def fault_kernels(self) -> ModuleType:
        """The module of what goes wrong in this system's loops."""
        if self.guarded:
            return guarded_faults if self.faults else guarded
        if self.faults:
            return native_faults
        return faultless if self.separation is None else faultless_apart

    @property
    def moves(self) -> bool:
        """Whether its game or its penalty changes in time."""
        return self.schedule is not None or motion_of(self.game) is not None

    @cached_property
    def path(self) -> EquilibriumPath:
        """Where the penalised equilibrium is while game or penalty move."""
        falling = self.schedule

        def penalty(time: float) -> float:
            return self.rho if falling is None else float(falling.at(time))

        return EquilibriumPath(self.game, penalty, self.start)

    def game_at(self, time: float) -> Game:
        """The game at a time in s, until it is asked for at another one."""
        return self.game if motion_of(self.game) is None else self.path.game(time)

    def equilibrium_at(self, time: float) -> Equilibrium | None:
        """What runs are judged by at a time in s: y*, of a game that moves that of the time."""
        still = motion_of(self.game) is None
        return self.known_equilibrium if still else self.path.equilibrium(time)

    def equilibria(self, times: NDArray[np.float64]) -> NDArray[np.float64]:
        """The same of times (samples,): (samples, m), not a number where it is not known."""
        if motion_of(self.game) is not None:
            return self.path.actions(times)
        known = self.known_equilibrium
        middle = np.full(self.game.actions, np.nan) if known is None else known.action
        return np.broadcast_to(middle, (len(times), self.game.actions))

    @cached_property
    def constraint_room(self) -> NDArray[np.float64]:
        """(p,) -g(0), how far each constraint's bound is from where nothing is done; not a number
        where that is not inside, and of games that move."""
        game = self.game
        if motion_of(game) is not None:
            return np.full(game.constraints_count, np.nan)
        try:
            room = -of_the_set(game).constraints(np.zeros(game.actions))
            forgive_pending()
        except GneError:  # functions of a user's own may not be defined there
            return np.full(game.constraints_count, np.nan)
        return np.where(np.isfinite(room) & (room > 0.0), room, np.nan)

    @property
    def measures_storage(self) -> bool:
        """Whether runs show V: it is known of the agents and proven to fall under the law, about
        a y* that stands still."""
        proven = self.law.theorem is not None
        return proven and self.agents.knows_storage and not self.moves and self.membership is None

    @property
    def game_kernels(self) -> ModuleType:
        """The module that brings the game to a period's end in this system's loops."""
        still = motion_of(self.game) is None and not self.feed_forward
        return standing if still else moving

    @property
    def recorded(self) -> int:
        """Numbers that are kept of one sample."""
        return self.agents.channels * (self.agents.states + 3) + len(self.loop_memory)

    @property
    def loop_memory(self) -> NDArray[np.float64]:
        """What a loop's memory begins with, see :meth:`with_links`."""
        return self.with_links(self.memory)

    def with_links(self, memory: NDArray[np.float64]) -> NDArray[np.float64]:
        """A law's memory with what a loop keeps behind it.

        Where messages can fail, what was heard over each link; where agents send by triggers, how
        many messages of each came over links; with an observer, what agents take their loads to be.
        """
        parts, m = [memory], self.game.actions
        if strikes_messages(self.faults):
            assert self.law.graph is not None
            delay, kept = message_delay(self.faults), self.law.kept
            parts.append(
                links_memory(self.law.graph, m, memory, delay, self.law.sent_besides)
                if kept is None
                else kept.heard(memory, delay)
            )
        if triggered(self.faults):
            parts.append(np.zeros(self.game.agents))
        if self.observer > 0.0:
            parts.append(np.zeros(m) if self.load is None else self.load)
        return np.concatenate(parts) if len(parts) > 1 else memory
