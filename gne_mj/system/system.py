"""One game with its agents, law, engine and start: everything that a closed loop needs."""

from dataclasses import dataclass, field
from functools import cached_property
from types import ModuleType
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from gne_mj.barrier import LogBarrier, Schedule
from gne_mj.controllers import Law
from gne_mj.controllers.propagation import no_propagator
from gne_mj.controllers.settings import LINKS
from gne_mj.equilibrium import Equilibrium, middle, order, penalised_equilibrium
from gne_mj.errors import InvalidInput, SolverError, named
from gne_mj.faults import (
    Fault,
    for_native,
    links_memory,
    message_delay,
    sensor_delay,
    strikes_messages,
)
from gne_mj.game import Game
from gne_mj.game_check import refuse
from gne_mj.loops import faultless, joint, local
from gne_mj.loops import faults as native_faults
from gne_mj.loops.base import ClosedLoop
from gne_mj.loops.division import sizes_at
from gne_mj.loops.feedback import NO_ORDER, Order, Problem, Sizes
from gne_mj.loops.layout import Clock as LoopClock
from gne_mj.loops.layout import Setup
from gne_mj.loops.link import Implicit, link
from gne_mj.loops.newton import solver_length
from gne_mj.loops.ode import MODES, OdeLoop
from gne_mj.margins import Disturbance
from gne_mj.plants import held_map
from gne_mj.plants.agents import Agents
from gne_mj.plants.functions import METHODS
from gne_mj.plants.mjcf_robot import MjcfRobots
from gne_mj.system import checks, steps
from gne_mj.system.clock import Clock

if TYPE_CHECKING:
    from gne_mj.plants.mjcf_fleet import MjcfPlant
    from gne_mj.plants.mujoco import MujocoPlant


@dataclass(frozen=True, eq=False)
class System:
    """A game that agents play under a law.

    Args:
        name: what the system is called in messages and files.
        game: the game.
        agents: one channel for each action of the game.
        law: the feedback law.
        rho: the barrier's penalty parameter; with a schedule the value that it falls to.
        state: (m, states) of the agents' channels at the start; the outputs strictly inside.
        memory: of the law at the start; if left out, estimates and z equal y(0). Under the fully
            distributed law all profiles at which agents evaluate the barrier must be inside.
        mode: "continuous", "sampled" or "implicit".
        engine: "ode", or "mujoco" for flexible robots.
        integrator: "rk4" or "euler"; for engine "ode" and the fully distributed law in mode
            continuous also "rosenbrock", which is adaptive and does not mind a small epsilon.
        schedule: how the penalty falls to rho in time; None if it does not change.
        decentralised: mode implicit: each agent finds its input alone and keeps to its share of
            what is left of every bound (:mod:`gne_mj.loops.local`).
        faults: what goes wrong (:mod:`gne_mj.faults`).
        seed: of what is random in the faults.
        disturbance: what the game's tightening is meant to cover; None if nothing is declared.

    Raises:
        InvalidInput: parts that do not fit together.
        InfeasibleStart: an initial action on or outside the boundary.
    """

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
    decentralised: bool = False
    faults: tuple[Fault, ...] = ()
    seed: int = 0
    disturbance: Disturbance | None = None
    barrier: LogBarrier = field(init=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "barrier", LogBarrier(self.game, self.rho))
        checks.check_parts(self)
        checks.check_start(self)
        refuse(self.game, self.start)
        checks.check_estimates(self.game, self.law)
        expected = self.law.initial_memory(self.start)
        if not len(self.memory):
            object.__setattr__(self, "memory", expected)
        elif self.memory.shape != expected.shape:
            raise InvalidInput(
                "memory",
                f"shape {self.memory.shape}",
                f"the {self.law.information} law's memory has shape {expected.shape}",
            )
        checks.check_memory(self)
        checks.check_engine(self)
        checks.check_faults(self)

    @property
    def equation(self) -> ModuleType | None:
        """In mode implicit the module that says who solves together."""
        if self.mode != "implicit":
            return None
        return local if self.decentralised or self.law.alone else joint

    @cached_property
    def rows(self) -> Order:
        """Rows of the matrices of mode implicit; one agent's at a time if agents act alone."""
        if self.equation is None:
            return NO_ORDER
        if self.equation is local:
            position, half_band = np.arange(self.game.actions), max(self.game.sizes) - 1
        else:
            position, half_band = order(self.game)
        band = np.array([half_band, int(self.decentralised)])
        start, column = self.game.actions_in_constraints
        within = np.repeat(np.arange(self.game.constraints_count), np.diff(start))
        return Order(position, band, start, column, within)

    @property
    def start(self) -> NDArray[np.float64]:
        """y(0), shape (m,)."""
        return self.state[:, self.agents.kind.OUTPUT]

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

    def closed_loop(self, clock: Clock, plant: "MujocoPlant | None" = None) -> ClosedLoop:
        """The native loop, at its start.

        Args:
            clock: how to step.
            plant: engine "mujoco": a fleet of the same robots with the same room, such as an
                earlier loop's, to use once more in place of a new one. Its step becomes the
                clock's.

        Raises:
            InvalidInput: a step that the estimates' dynamics do not allow, or a control period
                over which an agent's output does not rise with its input, mode implicit.
        """
        loop = self._closed_loop(clock, plant)
        loop.keeps = self
        return loop

    def _closed_loop(self, clock: Clock, plant: "MujocoPlant | None") -> ClosedLoop:
        setup = self.setup(clock)
        memory = self.loop_memory
        if self.engine == "mujoco":
            # Late: MuJoCo is slow to import, and the twins do not need it.
            from gne_mj.loops.mujoco import MujocoLoop
            from gne_mj.plants.fleet import MANY

            fleet: MujocoPlant | MjcfPlant
            if plant is None:
                fleet = self.mujoco_plant(clock, decorated=self.agents.count <= MANY)
                if self.mode == "implicit" and isinstance(self.agents, MjcfRobots):
                    steps.try_slopes(self, fleet, clock)
            else:
                fleet = plant
                plant.model.opt.timestep = plant.timestep = clock.timestep
                plant.reset(self.state)
            return MujocoLoop(fleet, setup, memory, self.fault_kernels)
        if self.integrator == "rosenbrock" and self.law.graph is not None:
            from gne_mj.loops.rosenbrock import RosenbrockLoop

            return RosenbrockLoop(self.agents, setup, self.law.graph, self.state, self.memory)
        return OdeLoop(self.agents, setup, self.state, memory, self.fault_kernels)

    @property
    def fault_kernels(self) -> ModuleType:
        """The module of what goes wrong in this system's loops."""
        return native_faults if self.faults else faultless

    @property
    def _ahead(self) -> Implicit | None:
        if self.equation is None:
            return None
        if not isinstance(self.agents, MjcfRobots):
            return Implicit(self.equation, held_map, self.fault_kernels)
        from gne_mj.plants import mjcf_ahead, native_mujoco  # late: MuJoCo is slow to import

        return Implicit(self.equation, mjcf_ahead, self.fault_kernels, native_mujoco.offsets())

    @property
    def functions(self) -> NDArray[np.int64]:
        """The addresses of the law's functions, see :mod:`gne_mj.loops.functions`."""
        return link(
            self.law.kernels, self.game.kernels,
            memory=bool(len(self.loop_memory)), ahead=self._ahead,
        )  # fmt: skip

    @property
    def recorded(self) -> int:
        """Numbers that are kept of one sample."""
        return self.agents.channels * (self.agents.states + 3) + len(self.loop_memory)

    @property
    def loop_memory(self) -> NDArray[np.float64]:
        """What a loop's memory begins with, see :meth:`with_links`."""
        return self.with_links(self.memory)

    def with_links(self, memory: NDArray[np.float64]) -> NDArray[np.float64]:
        """A law's memory, and where messages can fail behind it what was heard over each link."""
        if not strikes_messages(self.faults):
            return memory
        assert self.law.graph is not None
        m = self.game.actions
        heard = links_memory(self.law.graph, m, memory, message_delay(self.faults))
        return np.concatenate([memory, heard])

    def setup(self, clock: Clock) -> Setup:
        """What a loop of this system is made of, besides its plant, its start and its kernels.

        Raises:
            InvalidInput: see :meth:`closed_loop`; and a law's graph or propagator that does not
                fit the game.
        """
        steps.check_step(self, clock)
        steps.check_slopes(self, clock)
        settings = self.law.settings(self.rho)
        if strikes_messages(self.faults):
            settings[LINKS] = len(self.memory)
        with named(period="clock.control_period"):
            propagator = (
                no_propagator()
                if self.mode == "continuous"
                else self.law.propagator(clock.control_period)
            )
        problem = Problem(
            data=self.game.data,
            graph=self.law.graph_data,
            settings=settings,
            limit=self.agents.input_limit,
            equilibrium=self.centre,
            size=self.typical_sizes,
            propagator=propagator,
            schedule=np.zeros(4) if self.schedule is None else self.schedule.numbers,
            order=self.rows,
            functions=self.functions,
            faults=for_native(self.faults, self.game, self.law.graph, self.seed),
        )
        checks.check_lists(self, problem)
        return Setup(
            problem,
            self.agents.equilibrium(self.centre),
            LoopClock(
                clock.timestep,
                clock.steps(clock.control_period),
                MODES[self.mode],
                METHODS.get(self.integrator, -1),  # the Rosenbrock loop has no use for it
            ),
            *self._sizes,
        )

    @property
    def typical_sizes(self) -> NDArray[np.float64]:
        """Of outputs and slacks (1 + p,), at the equilibrium."""
        return sizes_at(self.centre, -self.game.constraints(self.centre) - self.game.margins)

    @property
    def _sizes(self) -> Sizes:
        m, late = self.game.actions, sensor_delay(self.faults)
        return Sizes(
            history=(late + 1) * m * (self.agents.states + 1) if late else 0,
            solver=0 if self.equation is None else solver_length(
                m, self.game.constraints_count,
                len(self.game.actions_in_constraints[1]), self.agents.states,
                int(self.rows.band[0]),
            ),
        )  # fmt: skip

    def mujoco_plant(self, clock: Clock, *, decorated: bool = True) -> "MujocoPlant | MjcfPlant":
        """The fleet, reset to the start, with room for this system's loop.

        Args:
            clock: how to step.
            decorated: keep what is for the eye only; MJCF robots keep all in any case.
        """
        from gne_mj.loops.mujoco import room
        from gne_mj.plants.mjcf_fleet import MjcfPlant
        from gne_mj.plants.mujoco import MujocoPlant

        userdata, memory = room(
            self.game, self.agents, len(self.loop_memory), MODES[self.mode], self._sizes
        )
        timestep = clock.timestep
        if not isinstance(self.agents, MjcfRobots):
            fleet = MujocoPlant(
                self.agents, timestep, self.integrator, userdata=userdata, memory=memory,
                decorated=decorated,
            )  # fmt: skip
            fleet.reset(self.state)
            return fleet
        plant = MjcfPlant(self.agents, timestep, self.integrator, userdata=userdata, memory=memory)
        plant.reset(self.state)
        if (
            not plant.measures_every_stage
            and self.mode == "continuous"
            and (self.integrator != "euler")
        ):
            raise InvalidInput(
                "agents.output",
                [robot.output for robot in self.agents.robots],
                "a tendon's or actuator's sensor is read once a step: use mode 'sampled', or"
                " integrator 'euler', or name a joint",
            )
        return plant
