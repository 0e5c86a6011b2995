"""One game with its agents, law, engine and start: everything that a closed loop needs."""

from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from gne_mj.barrier import LogBarrier
from gne_mj.controllers import Law
from gne_mj.controllers.settings import EPSILON
from gne_mj.equilibrium import Equilibrium, penalised_equilibrium
from gne_mj.errors import InfeasibleStart, InvalidInput
from gne_mj.game import Game
from gne_mj.loops.base import ClosedLoop
from gne_mj.loops.feedback import Problem
from gne_mj.loops.ode import MODES, OdeLoop
from gne_mj.loops.ode import Clock as LoopClock
from gne_mj.plants.agents import Agents
from gne_mj.plants.ode import METHODS, Channels

# Largest step times rate of decay that a method is stable for, on the negative real axis
STABLE = {"rk4": 2.785, "euler": 2.0}


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
        self._check_engine()

    def _check_engine(self) -> None:
        key = f"systems.{self.name}.plant"
        static = self.law.graph is None
        if self.engine == "mujoco" and self.agents.kind.NAME != "flexible robot":
            raise InvalidInput(
                f"{key}.engine",
                self.engine,
                f"MuJoCo has models of flexible robots only; run {self.agents.kind.NAME}s on 'ode'",
            )
        if self.integrator == "rosenbrock" and (
            static or self.mode != "continuous" or self.engine != "ode"
        ):
            raise InvalidInput(
                f"{key}.integrator",
                self.integrator,
                "it is for engine 'ode', the distributed law and mode 'continuous'; use 'rk4'",
            )
        if self.engine == "mujoco" and not static:
            raise InvalidInput(
                f"{key}.engine",
                self.engine,
                f"the {self.law.information} law runs on engine 'ode' only",
            )

    def _check_step(self, clock: Clock) -> None:
        """Explicit methods are unstable for estimates beyond a step of about 2 epsilon / lambda."""
        law = self.law
        if law.graph is None or self.mode != "continuous" or self.integrator == "rosenbrock":
            return
        fastest = max(1.0, float(np.linalg.eigvalsh(law.graph.laplacian)[-1]))
        rate = fastest / law.settings(self.rho)[EPSILON]
        largest = STABLE[self.integrator] / rate
        if clock.timestep > largest:
            raise InvalidInput(
                "simulation.timestep",
                clock.timestep,
                f"with epsilon = {law.settings(self.rho)[EPSILON]:g} s the estimates of"
                f" '{self.name}' need at most {largest:.3g} s under '{self.integrator}';"
                " integrator 'rosenbrock' and mode 'sampled' have no such limit",
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
        self._check_step(clock)
        rest = self.agents.equilibrium(self.equilibrium.action)
        problem = Problem(
            data=self.game.data,
            graph=self.law.graph_data,
            settings=self.law.settings(self.rho),
            limit=self.agents.input_limit,
            propagators=(
                self.law.propagators(clock.control_period)
                if self.mode == "sampled"
                else np.zeros((0, 0, 0))
            ),
        )
        laws, game = self.law.kernels, self.game.kernels
        period, mode = clock.steps(clock.control_period), MODES[self.mode]
        if self.engine == "mujoco":
            # Late: MuJoCo is slow to import, and the twins do not need it.
            from gne_mj.loops.mujoco import MujocoLoop, room
            from gne_mj.plants.mujoco import MujocoPlant

            plant = MujocoPlant(
                self.agents, clock.timestep, self.integrator, userdata=room(self.game)
            )
            plant.reset(self.state)
            return MujocoLoop(plant, laws, game, problem, rest, mode, period)
        channels = Channels(self.agents.parameters, rest)
        memory = self.law.initial_memory(self.start)
        kind = self.agents.kind
        if self.integrator == "rosenbrock" and self.law.graph is not None:
            from gne_mj.loops.rosenbrock import RosenbrockLoop

            return RosenbrockLoop(
                kind, laws, game, problem, channels, self.law.graph, clock.timestep,
                self.state, memory,
            )  # fmt: skip
        loop_clock = LoopClock(clock.timestep, period, mode, METHODS[self.integrator])
        return OdeLoop(kind, laws, game, problem, channels, loop_clock, self.state, memory)
