"""What is built of a system: its native loop, and all that the loop is given."""

from dataclasses import dataclass
from functools import cached_property
from types import ModuleType
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from gne_mj.barrier import unchanging
from gne_mj.changing_graph import ChangingGraph
from gne_mj.controllers import no_memory
from gne_mj.controllers.propagation import Propagator
from gne_mj.controllers.settings import COMPENSATION, GOES_ON, GUARDED, LINKS, OBSERVER, OUTSIDE
from gne_mj.errors import InvalidInput, named
from gne_mj.faults import for_native, sensor_delay, strikes_messages
from gne_mj.feed_forward import FeedForward, feed_forward
from gne_mj.graph import GraphData
from gne_mj.loops import functions, plant_model
from gne_mj.loops.adaptive import TSIT5, AdaptiveLoop
from gne_mj.loops.base import ClosedLoop
from gne_mj.loops.changing_network import ChangingNetworkLoop
from gne_mj.loops.division import sizes_at
from gne_mj.loops.feedback import NO_MODEL, Order, Problem, Sizes
from gne_mj.loops.layout import LoopClock, Setup
from gne_mj.loops.link import (
    link,
    of_memory,
    penalty,
    penalty_of_moving,
    positions,
    separation,
)
from gne_mj.loops.ode import OdeLoop
from gne_mj.loops.one_loop import OneLoop
from gne_mj.loops.separation import neighbours_length
from gne_mj.membership import There
from gne_mj.motion import STANDING, Frame, Motion, Moving, motion_of
from gne_mj.plants.functions import METHODS
from gne_mj.system import checks, steps
from gne_mj.system.clock import Clock
from gne_mj.system.data import SystemData
from gne_mj.system.guard import room_ahead
from gne_mj.system.membership import Present, check_instants, groups, membership_loop, present_of
from gne_mj.system.modes import mode_of

if TYPE_CHECKING:
    from gne_mj.plants.fleet_plant import FleetPlant


_METHODS = {**METHODS, "tsit5": TSIT5}
_LOOKED_AT = 200  # sample times at which a game that moves must have an interior, at least


@dataclass(frozen=True, eq=False)
class Assembly(SystemData):
    """A system's data, and how its loop is built of them."""

    @property
    def equation(self) -> ModuleType | None:
        """The module that says who solves together, where inputs are solved for."""
        return mode_of(self).equation(self)

    @cached_property
    def rows(self) -> Order:
        """Rows of the matrices of what is solved."""
        return mode_of(self).rows(self)

    def closed_loop(self, clock: Clock, plant: "FleetPlant | None" = None) -> ClosedLoop:
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
        setup = self.setup(clock)
        if self.membership is not None:
            loop: ClosedLoop = membership_loop(self, clock)
            loop.kept_alive = self
            return loop
        loop = self._closed_loop(setup, clock, plant)
        if isinstance(self.law.graph, ChangingGraph):
            loop.kept_alive = self
            loop = self._over_changing_network(loop, setup, clock)
        loop.kept_alive = self
        return loop

    def among(self, there: There, y: NDArray[np.float64] | None = None) -> Present:
        """Those that are there by themselves; made once, in a run or here.

        Args:
            there: (N,) who is.
            y: (m,) outputs at which they rest then; those of the start if left out.
        """
        key = there.tobytes()
        if key not in self._present:
            state = self.agents.equilibrium(self.start if y is None else y)
            self.keep_among(there, present_of(self, there, state))
        return self._present[key]

    def keep_among(self, there: There, present: Present) -> None:
        """Let this be what :meth:`among` knows of these, unless it does already."""
        self._present.setdefault(there.tobytes(), present)

    @cached_property
    def _present(self) -> dict[bytes, Present]:
        return {}

    def equilibria_among(
        self, times: NDArray[np.float64], y: NDArray[np.float64]
    ) -> NDArray[np.float64]:
        """What outputs y (samples, m) at times (samples,) are judged by: y* of those present.

        Not numbers where it is not known, and for who is away.
        """
        if self.membership is None:
            return self.equilibria(times)
        found = np.full(y.shape, np.nan)
        for there, rows in groups(self, y):
            present = self.among(there, y[np.argmax(rows)])
            found[np.ix_(rows, present.among.actions)] = present.system.equilibria(times[:1])[0]
        return found

    def _over_changing_network(self, loop: ClosedLoop, setup: Setup, clock: Clock) -> ClosedLoop:
        law, held = self.law, mode_of(self).held
        assert isinstance(law.graph, ChangingGraph)

        def propagator(lists: GraphData) -> Propagator:
            return law.propagator(self._moved_by(clock), lists)

        return ChangingNetworkLoop(
            loop, setup, law.graph, self.places, propagator if held else None, self.seed
        )

    def _closed_loop(self, setup: Setup, clock: Clock, plant: "FleetPlant | None") -> ClosedLoop:
        memory = self.loop_memory
        if self.engine == "mujoco":
            # Late: MuJoCo is slow to import, and the twins do not need it.
            from gne_mj.loops.mujoco_loop import MujocoLoop

            if plant is None:
                plant = self.mujoco_plant(clock)
                mode_of(self).try_plant(self, plant, clock)
            else:
                plant.model.opt.timestep = plant.timestep = clock.timestep
                plant.reset(self.state)
            return MujocoLoop(plant, setup, memory, self.fault_kernels)
        if self.integrator == "rosenbrock" and self.law.graph is not None:
            from gne_mj.loops.rosenbrock import RosenbrockLoop

            return RosenbrockLoop(
                self.agents, setup, self.law.graph, self.state, self.memory,
                rtol=self.rtol, atol=1e-3 * self.rtol,
                affine=self.game.constraint_class == "affine",
            )  # fmt: skip
        return self.ode_loop(self.agents, setup, self.state, memory, self.fault_kernels)

    @property
    def ode_loop(self) -> type[OneLoop]:
        """What runs on engine "ode", but for integrator "rosenbrock"."""
        return AdaptiveLoop if self.integrator == "tsit5" else OdeLoop

    @property
    def _others(self) -> dict[int, Any]:
        found = dict(mode_of(self).prediction(self))
        fall = unchanging if self.schedule is None else self.schedule.fall
        if motion_of(self.game) is not None or self.feed_forward:
            found[functions.PENALTY] = penalty_of_moving(fall)
        elif self.schedule is not None:
            found[functions.PENALTY] = penalty(fall)
        if self.start_positions is not None:
            found[functions.POSITIONS] = positions()
        if self.agents.contacts:
            from gne_mj.loops.contacts import counter  # late: MuJoCo is slow to import

            found[functions.CONTACTS] = counter()
        if self.separation is not None:
            found |= separation(mode_of(self).held, (0.0,) * self.agents.dimension)
        return found

    @property
    def _behind(self) -> dict[int, Any]:
        """What moves the memory of a loop whose law has none."""
        alone = len(self.loop_memory) > 0 and not len(self.memory)
        return of_memory(no_memory, mode_of(self).held) if alone else {}

    @property
    def functions(self) -> NDArray[np.int64]:
        """The addresses of the law's functions, see :mod:`gne_mj.loops.functions`."""
        return link(
            self.law.kernels, self.game.kernels,
            memory=bool(len(self.memory)), held=mode_of(self).held, driven=self.feed_forward,
            others={**self._behind, **self._others},
        )  # fmt: skip

    @property
    def plant_model(self) -> NDArray[np.int64]:
        """The addresses of the plant's equations, for a law that asks for them."""
        return plant_model.addresses() if self.law.knows_plant else NO_MODEL

    def law_settings(self, rho: float) -> NDArray[np.float64]:
        """The law's numbers, with what they take from the rest of the system."""
        settings = self.law.settings(rho)
        if strikes_messages(self.faults):
            settings[LINKS] = len(self.memory)
        settings[OBSERVER] = self.observer
        settings[COMPENSATION] = float(self.compensation)
        if self.goes_on:
            settings[OUTSIDE] = GOES_ON
        if self.game.private:  # which others can push an agent out of
            settings[GUARDED] = 0.0
        return settings

    def setup(self, clock: Clock) -> Setup:
        """What a loop of this system is made of, besides its plant, its start and its kernels.

        Raises:
            InvalidInput: see :meth:`closed_loop`; and a law's graph or propagator that does not
                fit the game.
        """
        steps.check_step(self, clock)
        steps.check_network(self, clock)
        check_instants(self, clock, held=mode_of(self).held)
        mode = mode_of(self)
        mode.check_period(self, clock)
        settings = self.law_settings(self.rho)
        with named(period="clock.control_period"):
            moved = self._moved_by(clock)
            held = mode.held
            move = self.law.propagator if held else self.law.step_propagator
            propagator = move(moved if held else clock.timestep)
        motion = motion_of(self.game)
        frame = None if motion is None else motion.frame()
        if motion is not None:
            self._check_motion(clock, motion)
        problem = Problem(
            graph=self.graph_at_start,
            data=self.game.data if frame is None else frame.data,
            motion=self._moving(clock, frame),
            settings=settings,
            limit=self.agents.input_limit,
            equilibrium=self.centre,
            size=self.typical_sizes,
            propagator=propagator,
            kept=self.law.kept_data,
            model=self.plant_model,
            schedule=self._penalty_numbers,
            order=self.rows,
            separation=np.zeros(3) if self.separation is None else self.separation.numbers,
            ahead=room_ahead(self, clock),
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
                mode.native_of(self),
                _METHODS.get(self.integrator, -1),  # the Rosenbrock loop has no use for it
            ),
            *self._sizes,
            rtol=self.rtol,
            kept_alive=frame,
        )

    def _moved_by(self, clock: Clock) -> float:
        """How long in s a law's memory moves at once in the held modes."""
        return clock.timestep if self.guarded else clock.control_period

    def _check_motion(self, clock: Clock, motion: Motion) -> None:
        """Refuse sets that are known to be empty at some time of a run, with the time."""
        every = max(1, round(clock.duration / clock.sample_period) // _LOOKED_AT)
        times = np.arange(0.0, clock.duration, every * clock.sample_period).tolist()
        for time in sorted({*times, *(t for t in motion.knots if t <= clock.duration)}):
            self.path.equilibrium(time)

    @property
    def _penalty_numbers(self) -> NDArray[np.float64]:
        if self.schedule is not None:
            return self.schedule.numbers
        moves = motion_of(self.game) is not None or self.feed_forward
        return np.array([self.rho, 0.0, 0.0]) if moves else np.zeros(3)

    def _moving(self, clock: Clock, frame: Frame | None) -> Moving:
        moving = STANDING if frame is None else frame.moving
        if not self.feed_forward:
            return moving
        feed = self.fed(clock)
        return moving._replace(
            input=feed.input.ravel(),
            spacing=np.array([feed.spacing]),
            now=np.zeros(self.game.actions),
        )

    def fed(self, clock: Clock) -> FeedForward:
        """What is fed forward in a run on a clock."""
        if clock not in self._fed:
            mode = mode_of(self)
            self._fed[clock] = feed_forward(
                self.path, self.agents, clock, held=mode.held, ahead=mode.promises
            )
        return self._fed[clock]

    @cached_property
    def _fed(self) -> dict[Clock, FeedForward]:
        return {}

    @property
    def typical_sizes(self) -> NDArray[np.float64]:
        """Of outputs and slacks (1 + p,), at the equilibrium."""
        return sizes_at(self.centre, -self.game.constraints(self.centre) - self.game.margins)

    @property
    def _sizes(self) -> Sizes:
        m, late = self.game.actions, sensor_delay(self.faults)
        return Sizes(
            history=(late + 1) * m * (self.agents.states + 1) if late else 0,
            solver=mode_of(self).solver_length(self, self.rows),
            separation=0
            if self.separation is None
            else neighbours_length(self.game.agents, self.agents.dimension),
        )

    def mujoco_plant(self, clock: Clock) -> "FleetPlant":
        """The fleet, reset to the start, with room for this system's loop.

        Flexible robots are without decoration, which no step needs: whoever draws them has a model
        of its own (:mod:`gne_mj.viewer.fleet`). MJCF robots keep all that is in their files.
        """
        from gne_mj.loops.mujoco_workspace import entries_needed
        from gne_mj.plants.fleet_plant import build_fleet

        mode = mode_of(self)
        userdata, memory = entries_needed(
            self.game, self.agents, len(self.loop_memory), mode.native_of(self), self._sizes
        )
        plant = build_fleet(
            self.agents, clock.timestep, self.integrator, userdata=userdata, memory=memory,
            decorated=False,
        )  # fmt: skip
        plant.reset(self.state)
        if mode.measures_stages(self) and not plant.measures_every_stage:
            raise InvalidInput(
                "agents.output",
                plant.outputs,
                "such a sensor is read once a step: use mode 'sampled', or integrator 'euler', or"
                " name the joint, body or site",
            )
        return plant
