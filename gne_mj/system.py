"""One game with its agents, law, engine and start: everything that a closed loop needs."""

from dataclasses import dataclass, field
from functools import cached_property
from types import ModuleType
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from gne_mj.barrier import LogBarrier, Schedule
from gne_mj.controllers import Law, PartialInformation
from gne_mj.controllers.propagation import no_propagator
from gne_mj.controllers.settings import LINKS
from gne_mj.equilibrium import Equilibrium, order, penalised_equilibrium
from gne_mj.errors import InfeasibleStart, InvalidInput, SolverError
from gne_mj.faults import (
    Bias,
    Fault,
    Noise,
    SensorDelay,
    for_native,
    links_memory,
    message_delay,
    sensor_delay,
    strikes_messages,
)
from gne_mj.game import Game
from gne_mj.loops import explicit, faultless, joint, local
from gne_mj.loops import faults as native_faults
from gne_mj.loops.base import ClosedLoop
from gne_mj.loops.feedback import NO_ORDER, Order, Problem, Sizes
from gne_mj.loops.layout import Clock as LoopClock
from gne_mj.loops.layout import Setup
from gne_mj.loops.ode import MODES, OdeLoop
from gne_mj.margins import Disturbance, influence
from gne_mj.plants import flexible_robot
from gne_mj.plants.agents import Agents
from gne_mj.plants.base import Plant
from gne_mj.plants.mjcf_robot import MjcfRobots
from gne_mj.plants.ode import METHODS, Channels, OdePlant

if TYPE_CHECKING:
    from gne_mj.plants.mjcf_fleet import MjcfPlant
    from gne_mj.plants.mujoco import MujocoPlant

# Largest step times rate of decay that a method is stable for, on the negative real axis
STABLE = {"rk4": 2.785, "euler": 2.0}
# The Rosenbrock loop keeps the estimates' dense eigenbases, N x N x N numbers
ROSENBROCK_AGENTS = 200


@dataclass(frozen=True)
class Clock:
    """The clock that all systems of a run share; times in s.

    Args:
        duration: how long to run.
        timestep: integration step.
        control_period: how long an input is held in the held modes; a multiple of the step.
        sample_period: between recorded samples; a multiple of the step.
    """

    duration: float
    timestep: float
    control_period: float
    sample_period: float

    def __post_init__(self) -> None:
        for key in ("duration", "timestep", "control_period", "sample_period"):
            value = getattr(self, key)
            if not (np.isfinite(value) and value > 0):
                raise InvalidInput(f"simulation.{key}", value, "it must be positive and finite")
        for key in ("control_period", "sample_period", "duration"):
            steps = getattr(self, key) / self.timestep
            if round(steps) < 1 or abs(steps - round(steps)) > 1e-6:
                raise InvalidInput(
                    f"simulation.{key}",
                    getattr(self, key),
                    f"it must be a multiple of the timestep {self.timestep:g} s",
                )

    def steps(self, time: float) -> int:
        """Integration steps in a time."""
        return round(time / self.timestep)


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
        m = self.game.actions
        if self.agents.channels != m:
            raise InvalidInput(
                f"systems.{self.name}.agents.count",
                self.agents.channels,
                f"the {self.game.name} game has {m} actions",
            )
        if self.state.shape != (m, self.agents.states):
            raise InvalidInput(
                f"systems.{self.name}.initial",
                self.state.shape,
                f"the state's shape must be ({m}, {self.agents.states})",
            )
        if self.law.graph is not None and self.law.graph.agents != self.game.agents:
            raise InvalidInput(
                f"systems.{self.name}.controller.graph",
                self.law.graph.agents,
                f"the game has {self.game.agents} agents",
            )
        if self.mode != "continuous" and not self.law.propagates:
            raise InvalidInput(
                f"systems.{self.name}.controller.mode",
                self.mode,
                "a plain law with a memory runs in mode 'continuous'",
            )
        if self.mode == "implicit" and not hasattr(self.law.kernels, "add_pull_slope"):
            raise InvalidInput(
                f"systems.{self.name}.controller.mode",
                self.mode,
                "this law does not define 'pull' and its derivative, which mode 'implicit' solves"
                " with; use mode 'sampled'",
            )
        if self.decentralised and (
            self.mode != "implicit" or self.law.information not in ("full", "partial")
        ):
            raise InvalidInput(
                f"systems.{self.name}.controller.decentralised",
                True,
                "it is for mode 'implicit' under full or partial information",
            )
        if not np.all(np.isfinite(self.state)):
            raise InvalidInput(
                f"systems.{self.name}.initial", "nan or inf", "every entry must be finite"
            )
        for quantity in self.game.quantities:  # wrong shapes are better found before a run
            quantity.at(self.start[None], self.game.entries(quantity))
            quantity.bounds(self.game.entries(quantity))
        self._check_start()
        expected = self.law.initial_memory(self.start)
        if not len(self.memory):
            object.__setattr__(self, "memory", expected)
        elif self.memory.shape != expected.shape:
            raise InvalidInput(
                f"systems.{self.name}.memory",
                f"shape {self.memory.shape}",
                f"the {self.law.information} law's memory has shape {expected.shape}",
            )
        self._check_memory()
        self._check_engine()
        self._check_faults()

    def _check_faults(self) -> None:
        key = f"systems.{self.name}.faults"
        if self.faults and self.integrator == "rosenbrock":
            raise InvalidInput(key, "given", "integrator 'rosenbrock' knows none; use 'rk4'")
        for number, fault in enumerate(self.faults):
            try:
                for_native((fault,), self.game, self.law.graph, self.seed)
            except InvalidInput as error:
                where = error.key.replace("faults", f"{key}.{number}", 1)
                raise InvalidInput(where, error.value, error.expected) from None
        held = strikes_messages(self.faults) or sensor_delay(self.faults) > 0
        if held and self.mode == "continuous":
            raise InvalidInput(
                key,
                "messages or late sensors",
                "they go by control periods: use mode 'sampled' or 'implicit'",
            )
        if self.mode == "implicit" and isinstance(self.agents, MjcfRobots):
            for fault in self.faults:
                if isinstance(fault, Noise | Bias | SensorDelay):
                    raise InvalidInput(
                        key,
                        type(fault).__name__.lower(),
                        "mode 'implicit' predicts MJCF robots from their whole true state, which"
                        " such sensors would not tell; use mode 'sampled'",
                    )

    def _check_start(self) -> None:
        key = f"systems.{self.name}.initial.action"
        what = f"initial {self.game.action_name} {np.round(self.start[:6], 4).tolist()}"
        worst, value = self.game.tightest(self.start)
        if not value < 0.0:
            raise InfeasibleStart(key, what, self.game.constraint_names[worst], value)
        tight = self.game.constraints(self.start) + self.game.margins
        worst = int(np.argmax(tight))
        if not tight[worst] < 0.0:
            name = (
                f"{self.game.constraint_names[worst]}, tightened by {self.game.margins[worst]:g},"
            )
            raise InfeasibleStart(key, what, name, float(tight[worst]))

    def _check_memory(self) -> None:
        if not np.all(np.isfinite(self.memory)):
            raise InvalidInput(
                f"systems.{self.name}.initial.estimate", "nan or inf", "every entry must be finite"
            )
        data = self.game.data
        profiles = self.law.barrier_profiles(self.game.agent_of_action, self.memory)
        for i, g in enumerate(self.game.constraints(profiles) + self.game.margins):
            own = data.own_index[data.own_pointer[i] : data.own_pointer[i + 1]]
            outside = own[~(g[own] < 0.0)]
            if len(outside):
                raise InfeasibleStart(
                    f"systems.{self.name}.initial.estimate",
                    f"initial estimates of agent {i + 1}",
                    self.game.constraint_names[outside[0]],
                    float(g[outside[0]]),
                )

    def _check_engine(self) -> None:
        key = f"systems.{self.name}.plant"
        if self.schedule is not None and self.integrator == "rosenbrock":
            raise InvalidInput(
                f"{key}.integrator",
                self.integrator,
                "it is for a penalty that does not change in time; use 'rk4'",
            )
        own_model = isinstance(self.agents, MjcfRobots)
        if self.engine == "mujoco" and not own_model and self.agents.kind is not flexible_robot:
            raise InvalidInput(
                f"{key}.engine",
                self.engine,
                f"MuJoCo has models of flexible robots and of a user's MJCF files; run"
                f" {self.agents.kind.NAME}s on 'ode'",
            )
        if self.engine == "ode" and own_model:
            raise InvalidInput(f"{key}.engine", self.engine, "MJCF robots run on 'mujoco'")
        if self.integrator == "rosenbrock" and self.game.agents > ROSENBROCK_AGENTS:
            raise InvalidInput(
                f"{key}.integrator",
                self.integrator,
                f"it keeps N x N x N numbers and is for up to {ROSENBROCK_AGENTS} agents, not"
                f" {self.game.agents}; use mode 'sampled'",
            )
        if self.integrator == "rosenbrock" and (
            self.law.information != "distributed"
            or self.mode != "continuous"
            or self.engine != "ode"
        ):
            raise InvalidInput(
                f"{key}.integrator",
                self.integrator,
                "it is for engine 'ode', the distributed law and mode 'continuous'; use 'rk4' or"
                " 'euler'",
            )

    def largest_step(self) -> float:
        """Largest step in s that the estimates allow under the integrator, mode continuous.

        Explicit methods are stable for c lambda_max / tau (or lambda_max / epsilon) times the step
        up to a constant of the method; lambda_max bounds the grounded Laplacians' eigenvalues.
        Under partial information the action pulls an agent of mass M as an estimate of mass tau is
        pulled, so that the lesser of both counts.
        """
        law = self.law
        if law.graph is None or law.estimate_rate == 0.0 or self.mode != "continuous":
            return np.inf
        if self.integrator == "rosenbrock":
            return np.inf
        # z has the rate of an eigenvalue 1, which a graph with an edge exceeds
        fastest = max(1.0, law.graph.largest_eigenvalue)
        rate = law.estimate_rate
        if isinstance(law, PartialInformation) and self.agents.mobility is not None:
            rate = max(rate, law.coupling * float(np.max(self.agents.mobility)))
        return STABLE[self.integrator] / (fastest * rate)

    def _check_step(self, clock: Clock) -> None:
        largest = self.largest_step()
        if clock.timestep > largest:
            others = "in mode 'sampled' estimates have no such limit"
            if self.law.information == "distributed" and self.engine == "ode":
                others = "integrator 'rosenbrock' and mode 'sampled' have no such limit"
            raise InvalidInput(
                "simulation.timestep",
                clock.timestep,
                f"the estimates of '{self.name}' follow each other at up to"
                f" {STABLE[self.integrator] / largest:.4g} /s, which '{self.integrator}' can follow"
                f" with steps of at most {_rounded_down(largest):.3g} s; {others}",
            )

    def _check_slopes(self, clock: Clock) -> None:
        """Refuse periods over which dy+/du is not positive: exactly, or else from this start."""
        if self.mode != "implicit" or isinstance(self.agents, MjcfRobots):
            return
        effect = influence(
            self.agents, clock.timestep, self.integrator, clock.steps(clock.control_period)
        )
        if effect.exact:
            self._refuse_slopes(effect.least_slope, clock)
        elif not np.all(effect.least_slope > 0):
            self._try_slopes(OdePlant(self.agents, clock.timestep, self.integrator), clock)

    def _try_slopes(self, plant: Plant, clock: Clock) -> None:
        """The same by moving a plant under two inputs from the start; it is reset afterwards."""
        reached = []
        for u in (0.0, 1.0):
            plant.reset(self.state)
            plant.step(np.full(self.game.actions, u), clock.steps(clock.control_period))
            reached.append(plant.output)
        plant.reset(self.state)
        self._refuse_slopes(reached[1] - reached[0], clock)

    def _refuse_slopes(self, slope: NDArray[np.float64], clock: Clock) -> None:
        worst = int(np.argmin(slope))
        if not slope[worst] > 0:
            agent = int(self.game.agent_of_action[worst]) + 1
            raise InvalidInput(
                "simulation.control_period",
                clock.control_period,
                f"over it the output of agent {agent} of '{self.name}' does not rise with its input"
                f" (dy+/du = {slope[worst]:.4g}), which mode 'implicit' needs",
            )

    @property
    def acting(self) -> ModuleType:
        """The module that finds the law's input."""
        if self.mode != "implicit":
            return explicit
        # Agents that know others by estimates only cannot but act by themselves.
        return local if self.decentralised or self.law.information == "distributed" else joint

    @cached_property
    def rows(self) -> Order:
        """Rows of the matrices of mode implicit; one agent's at a time if agents act alone."""
        if self.acting is explicit:
            return NO_ORDER
        if self.acting is local:
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

    @cached_property
    def equilibrium(self) -> Equilibrium:
        """The penalised equilibrium, from y(0); where that is too near a bound, from the middle."""
        try:
            return penalised_equilibrium(self.game, self.rho, self.start)
        except SolverError:
            return penalised_equilibrium(self.game, self.rho, _middle(self.game, self.start))

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
        laws, game, memory = self.law.kernels, self.game.kernels, self.loop_memory
        if self.engine == "mujoco":
            # Late: MuJoCo is slow to import, and the twins do not need it.
            from gne_mj.loops.mujoco import MujocoLoop

            fleet: MujocoPlant | MjcfPlant
            if plant is None:
                fleet = self.mujoco_plant(clock)
                if self.mode == "implicit" and isinstance(self.agents, MjcfRobots):
                    self._try_slopes(fleet, clock)
            else:
                fleet = plant
                plant.model.opt.timestep = plant.timestep = clock.timestep
                plant.reset(self.state)
            return MujocoLoop(fleet, laws, game, setup, memory, self.acting, self.fault_kernels)
        if self.integrator == "rosenbrock" and self.law.graph is not None:
            from gne_mj.loops.rosenbrock import RosenbrockLoop

            return RosenbrockLoop(
                self.agents.kind, laws, game, setup.problem,
                Channels(self.agents.parameters, setup.rest), self.law.graph, clock.timestep,
                self.state, self.memory,
            )  # fmt: skip
        return OdeLoop(
            self.agents, laws, game, setup, self.state, memory, self.acting, self.fault_kernels
        )

    @property
    def fault_kernels(self) -> ModuleType:
        """The module of what goes wrong in this system's loops."""
        return native_faults if self.faults else faultless

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
            InvalidInput: see :meth:`closed_loop`.
        """
        self._check_step(clock)
        self._check_slopes(clock)
        settings = self.law.settings(self.rho)
        if strikes_messages(self.faults):
            settings[LINKS] = len(self.memory)
        problem = Problem(
            data=self.game.data,
            graph=self.law.graph_data,
            settings=settings,
            limit=self.agents.input_limit,
            equilibrium=self.equilibrium.action,
            propagator=(
                no_propagator()
                if self.mode == "continuous"
                else self.law.propagator(clock.control_period)
            ),
            schedule=np.zeros(4) if self.schedule is None else self.schedule.numbers,
            order=self.rows,
            faults=for_native(self.faults, self.game, self.law.graph, self.seed),
        )
        return Setup(
            problem,
            self.agents.equilibrium(self.equilibrium.action),
            LoopClock(
                clock.timestep,
                clock.steps(clock.control_period),
                MODES[self.mode],
                METHODS.get(self.integrator, -1),  # the Rosenbrock loop has no use for it
            ),
            *self._sizes,
        )

    @property
    def _sizes(self) -> Sizes:
        m, late = self.game.actions, sensor_delay(self.faults)
        return Sizes(
            history=(late + 1) * m * (self.agents.states + 1) if late else 0,
            solver=self.acting.solver_length(
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
        try:
            plant = MjcfPlant(
                self.agents, timestep, self.integrator, userdata=userdata, memory=memory
            )
            plant.reset(self.state)
        except InvalidInput as error:
            raise InvalidInput(
                f"systems.{self.name}.{error.key}", error.value, error.expected
            ) from None
        if (
            not plant.measures_every_stage
            and self.mode == "continuous"
            and (self.integrator != "euler")
        ):
            raise InvalidInput(
                f"systems.{self.name}.agents.output",
                [robot.output for robot in self.agents.robots],
                "a tendon's or actuator's sensor is read once a step: use mode 'sampled', or"
                " integrator 'euler', or name a joint",
            )
        return plant


def _middle(game: Game, y: NDArray[np.float64]) -> NDArray[np.float64]:
    """A profile well inside, from one strictly inside: the middle along each action in turn."""
    y = y.copy()
    for a in np.tile(np.arange(game.actions), 3):
        ends = []
        for sign in (-1.0, 1.0):
            low, high = 0.0, 1e-9
            ahead = y.copy()
            while high < 1e6:
                ahead[a] = y[a] + sign * high
                if not np.all(game.constraints(ahead) + game.margins < 0):
                    break
                low, high = high, 2.0 * high
            ends.append(sign * low)
        y[a] += 0.5 * sum(ends)
    return y


def _rounded_down(value: float) -> float:
    """To three digits: what a message names as the largest must itself be accepted."""
    unit = 10.0 ** (np.floor(np.log10(value)) - 2)
    return float(np.floor(value / unit) * unit)
