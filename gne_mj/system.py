"""One game with its agents, law, engine and start: everything that a closed loop needs."""

from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from gne_mj.barrier import LogBarrier
from gne_mj.controllers import Law, PartialInformation
from gne_mj.controllers.propagation import no_propagator
from gne_mj.equilibrium import Equilibrium, penalised_equilibrium
from gne_mj.errors import InfeasibleStart, InvalidInput
from gne_mj.game import Game
from gne_mj.loops.base import ClosedLoop
from gne_mj.loops.feedback import Problem
from gne_mj.loops.ode import MODES, OdeLoop
from gne_mj.loops.ode import Clock as LoopClock
from gne_mj.plants import flexible_robot
from gne_mj.plants.agents import Agents
from gne_mj.plants.mjcf_robot import MjcfRobots
from gne_mj.plants.ode import METHODS, Channels

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
        control_period: how long an input is held in mode sampled; a multiple of the step.
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
        rho: the barrier's penalty parameter.
        state: (m, states) of the agents' channels at the start; the outputs strictly inside.
        memory: of the law at the start; if left out, estimates and z equal y(0). Under the fully
            distributed law all profiles at which agents evaluate the barrier must be inside.
        mode: "continuous" or "sampled".
        engine: "ode", or "mujoco" for flexible robots.
        integrator: "rk4" or "euler"; for engine "ode" and the fully distributed law in mode
            continuous also "rosenbrock", which is adaptive and does not mind a small epsilon.

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
        if self.mode == "sampled" and not self.law.propagates:
            raise InvalidInput(
                f"systems.{self.name}.controller.mode",
                self.mode,
                "a plain law with a memory runs in mode 'continuous'",
            )
        if not np.all(np.isfinite(self.state)):
            raise InvalidInput(
                f"systems.{self.name}.initial", "nan or inf", "every entry must be finite"
            )
        for quantity in self.game.quantities:  # wrong shapes are better found before a run
            quantity.at(self.start[None], self.game.entries(quantity))
            quantity.bounds(self.game.entries(quantity))
        worst, value = self.game.tightest(self.start)
        if not value < 0.0:
            names = self.game.constraint_names
            raise InfeasibleStart(
                f"systems.{self.name}.initial.action",
                f"initial {self.game.action_name} {np.round(self.start[:6], 4).tolist()}",
                names[worst],
                value,
            )
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

    def _check_memory(self) -> None:
        if not np.all(np.isfinite(self.memory)):
            raise InvalidInput(
                f"systems.{self.name}.initial.estimate", "nan or inf", "every entry must be finite"
            )
        data = self.game.data
        profiles = self.law.barrier_profiles(self.game.agent_of_action, self.memory)
        for i, g in enumerate(self.game.constraints(profiles)):
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
                "it is for engine 'ode', the distributed law and mode 'continuous'; use 'rk4'",
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

    @property
    def start(self) -> NDArray[np.float64]:
        """y(0), shape (m,)."""
        return self.state[:, self.agents.kind.OUTPUT]

    @cached_property
    def equilibrium(self) -> Equilibrium:
        """The penalised equilibrium, from y(0)."""
        return penalised_equilibrium(self.game, self.rho, self.start)

    def closed_loop(self, clock: Clock) -> ClosedLoop:
        """The native loop, at its start.

        Raises:
            InvalidInput: a step that the estimates' dynamics do not allow.
        """
        loop = self._closed_loop(clock)
        loop.keeps = self
        return loop

    def _closed_loop(self, clock: Clock) -> ClosedLoop:
        self._check_step(clock)
        rest = self.agents.equilibrium(self.equilibrium.action)
        problem = Problem(
            data=self.game.data,
            graph=self.law.graph_data,
            settings=self.law.settings(self.rho),
            limit=self.agents.input_limit,
            equilibrium=self.equilibrium.action,
            propagator=(
                self.law.propagator(clock.control_period)
                if self.mode == "sampled"
                else no_propagator()
            ),
        )
        laws, game = self.law.kernels, self.game.kernels
        period, mode = clock.steps(clock.control_period), MODES[self.mode]
        if self.engine == "mujoco":
            # Late: MuJoCo is slow to import, and the twins do not need it.
            from gne_mj.loops.mujoco import MujocoLoop, room

            plant = self._mujoco_plant(
                clock.timestep, *room(self.game, self.agents, len(self.memory), mode)
            )
            return MujocoLoop(plant, laws, game, problem, rest, mode, period, self.memory)
        channels = Channels(self.agents.parameters, rest)
        kind = self.agents.kind
        if self.integrator == "rosenbrock" and self.law.graph is not None:
            from gne_mj.loops.rosenbrock import RosenbrockLoop

            return RosenbrockLoop(
                kind, laws, game, problem, channels, self.law.graph, clock.timestep,
                self.state, self.memory,
            )  # fmt: skip
        loop_clock = LoopClock(clock.timestep, period, mode, METHODS[self.integrator])
        return OdeLoop(kind, laws, game, problem, channels, loop_clock, self.state, self.memory)

    def _mujoco_plant(
        self, timestep: float, userdata: int, memory: int
    ) -> "MujocoPlant | MjcfPlant":
        """The fleet, reset to the start."""
        from gne_mj.plants.mjcf_fleet import MjcfPlant
        from gne_mj.plants.mujoco import MujocoPlant

        if not isinstance(self.agents, MjcfRobots):
            fleet = MujocoPlant(
                self.agents, timestep, self.integrator, userdata=userdata, memory=memory
            )
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


def _rounded_down(value: float) -> float:
    """To three digits: what a message names as the largest must itself be accepted."""
    unit = 10.0 ** (np.floor(np.log10(value)) - 2)
    return float(np.floor(value / unit) * unit)
