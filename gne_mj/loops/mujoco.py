"""The closed loop in MuJoCo: laws as C callbacks, no Python per step.

MuJoCo evaluates control at every stage of its integrator. The callback counts these evaluations
itself: the first one of each step measures, acts and observes exactly as the ODE loop does
(:func:`gne_mj.loops.ode.begin_step`); later ones, in mode `continuous`, only act. What it keeps
from call to call lies in mjData's ``userdata``, which is part of MuJoCo's state:
[mark, address of the table, arctangents of the springs, step, stage, monitor, input held, scratch].
"""

from functools import cache
from types import ModuleType
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gne_mj.errors import EngineError
from gne_mj.game import Game, GameData
from gne_mj.graph import GraphData
from gne_mj.loops import monitor as watch
from gne_mj.loops.base import ClosedLoop, Samples
from gne_mj.loops.feedback import Problem, Work
from gne_mj.loops.ode import CONTINUOUS, Clock, begin_step, look, stored
from gne_mj.native import callback, compiled, copy, kernel, source_key
from gne_mj.plants import flexible_robot
from gne_mj.plants.mujoco import (
    ACTUATOR,
    ARCTANGENTS,
    ATAN,
    PLACES,
    PLACES_COUNT,
    PLANT_TABLE,
    SIZES,
    STAGES,
    MujocoPlant,
    gather,
    passive_callback,
)
from gne_mj.plants.native_mujoco import (
    CALLBACK,
    LOOP_MARK,
    USERDATA_HEADER,
    Offsets,
    Table,
    address_of,
    call,
    callbacks,
    field,
    floats,
    integers,
    offsets,
    step_address,
    table_of,
)
from gne_mj.plants.ode import Channels

# Behind the plant's arrays: the game's (as in GameData), the graph's, then these
GAME = PLANT_TABLE
GRAPH = GAME + len(GameData._fields)
SETTINGS, LIMIT, PROPAGATORS, PARAMETERS, REST, STEP, CLOCK = range(GRAPH + 2, GRAPH + 9)

# Entries of userdata behind the plant's m arctangents
STEP_NOW, STAGE_NOW, MONITOR = range(ARCTANGENTS, ARCTANGENTS + 3)


@kernel
def userdata_length(m, p, states):
    """Entries of userdata that the callback needs: the list at the top of this module."""
    return 2 + watch.length(m, p) + m + 3 * p + 4 * m + m * states


@kernel
def problem_in(table):
    """What the law reads, from a simulation's table."""
    data = GameData(
        floats(table, GAME),
        integers(table, GAME + 1),
        integers(table, GAME + 2),
        integers(table, GAME + 3),
        integers(table, GAME + 4),
        integers(table, GAME + 5),
        integers(table, GAME + 6),
        integers(table, GAME + 7),
    )
    graph = GraphData(integers(table, GRAPH), integers(table, GRAPH + 1))
    nothing = floats(table, PROPAGATORS).reshape((0, 0, 0))
    return Problem(data, graph, floats(table, SETTINGS), floats(table, LIMIT), nothing)


@kernel
def channels_in(table, m, states):
    """The agents' channels, from a simulation's table."""
    parameters = floats(table, PARAMETERS)
    rest = floats(table, REST)
    return Channels(parameters.reshape((m, len(parameters) // m)), rest.reshape((m, states)))


@kernel
def parts_of(userdata, m, p, states):
    """The views into userdata: monitor, input held, scratch, flat state."""
    at = MONITOR + m + watch.length(m, p)
    monitor = userdata[MONITOR + m : at]
    u = userdata[at : at + m]
    at += m
    g = userdata[at : at + p]
    weights, own = userdata[at + p : at + 2 * p], userdata[at + 2 * p : at + 3 * p]
    at += 3 * p
    work = Work(
        g,
        weights,
        own,
        userdata[at : at + m],
        userdata[at + m : at + 2 * m],
        userdata[at + 2 * m : at + 3 * m],
        userdata[at + 3 * m : at + 4 * m],
    )
    at += 4 * m
    return monitor, u, work, userdata[at : at + m * states]


@kernel
def stored_given(channels, state, userdata):
    """V^{x*} of all robots, with the arctangents that the passive callback has just kept."""
    total = 0.0
    for r in range(len(channels.rest)):
        x = state[4 * r : 4 * r + 4]
        total += flexible_robot.storage_given(
            channels.parameters[r], x, channels.rest[r], userdata[ARCTANGENTS + r]
        )
    return total


@cache
def build(at: Offsets, law: ModuleType, game: ModuleType) -> tuple[Any, Any, Any]:
    """The control callback, the native loop and its last observation, for a law and a game."""
    agent = flexible_robot
    source = source_key(agent, law, game)

    def control(model, data):
        _ = source
        struct = address_of(data)
        table = table_of(at, address_of(model), struct)
        if table <= 0:
            return
        sizes, steps = integers(table, SIZES), integers(table, STEP)
        ctrl = field(struct, at.ctrl, sizes[2])
        userdata = field(struct, at.userdata, sizes[3])
        places = integers(table, PLACES)
        m, p, states = len(places) // PLACES_COUNT, steps[0], len(agent.STATES)
        stages, period, mode = steps[1], steps[2], steps[3]
        monitor, u, work, state = parts_of(userdata, m, p, states)
        step, stage = np.int64(userdata[STEP_NOW + m]), np.int64(userdata[STAGE_NOW + m])
        last = stage + 1 == stages
        userdata[STEP_NOW + m] = step + 1 if last else step
        userdata[STAGE_NOW + m] = 0 if last else stage + 1
        if stage > 0 and mode != CONTINUOUS:
            return
        h = floats(table, CLOCK)[0]
        time = step * h
        if stage > 0:
            time += h if stage == 3 else 0.5 * h
        gather(at, struct, table, state)
        channels = channels_in(table, m, states)
        storage = stored_given(channels, state, userdata) if stage == 0 else 0.0
        acts = monitor[watch.EXIT] == watch.INSIDE and look(
            agent, law, game, problem_in(table), channels, Clock(h, period, mode, 0), time, step,
            stage, storage, state, u, monitor, work,
        )  # fmt: skip
        for r in range(m):
            ctrl[places[r * PLACES_COUNT + ACTUATOR]] = work.u[r] if acts else 0.0

    def advance(mj_step, model, data, qpos, qvel, userdata, m, p, every, before, states, inputs):
        _ = source
        monitor, u, _work, _state = parts_of(userdata, m, p, len(agent.STATES))
        done = 0
        for sample in range(len(inputs)):
            for substep in range(every):
                copy(qpos, before[0])
                copy(qvel, before[1])
                call(mj_step, model, data)
                if monitor[watch.EXIT] != watch.INSIDE:
                    copy(before[0], qpos)
                    copy(before[1], qvel)
                    # a step that began inside has its row, even if a later stage left
                    if substep == 0 and monitor[watch.EXIT_STAGE] > 0:
                        copy(u, inputs[sample])
                        copy(before[0], states[sample, 0])
                        copy(before[1], states[sample, 1])
                        return sample + 1, done
                    return sample + (substep > 0), done
                if substep == 0:
                    copy(u, inputs[sample])
                    copy(before[0], states[sample, 0])
                    copy(before[1], states[sample, 1])
                done += 1
        return len(inputs), done

    def finish(model, data, step):
        _ = source
        table = table_of(at, model, data)
        sizes, steps = integers(table, SIZES), integers(table, STEP)
        m, p, states = len(floats(table, ATAN)), steps[0], len(agent.STATES)
        userdata = field(data, at.userdata, sizes[3])
        monitor, u, work, state = parts_of(userdata, m, p, states)
        gather(at, data, table, state)
        channels = channels_in(table, m, states)
        return begin_step(
            agent, law, game, problem_in(table), channels,
            Clock(floats(table, CLOCK)[0], steps[2], steps[3], 0), step,
            stored(agent, channels, state), state, u, monitor, work,
        )  # fmt: skip

    return (
        callback(CALLBACK, control),
        compiled(advance),
        compiled(finish),
    )


def room(game: Game) -> int:
    """How many entries of userdata a plant must leave for this game's loop."""
    return int(userdata_length(game.actions, game.constraints_count, len(flexible_robot.STATES)))


class MujocoLoop(ClosedLoop):
    """The closed loop of a fleet in MuJoCo, under a static law.

    Args:
        plant: the fleet, reset to its start and with :func:`room` in its userdata.
        law, game: modules of kernels.
        problem: what the law reads.
        rest: (m, states) equilibrium, from which V is measured.
        mode: CONTINUOUS or SAMPLED of :mod:`gne_mj.loops.ode`.
        period: steps per control period, mode sampled.
    """

    def __init__(
        self,
        plant: MujocoPlant,
        law: ModuleType,
        game: ModuleType,
        problem: Problem,
        rest: NDArray[np.float64],
        mode: int,
        period: int,
    ) -> None:
        self.plant = plant
        self._m = plant.agents.channels
        self._p = len(problem.data.member_pointer) - 1
        at = offsets()
        self._control, self._advance, self._finish = build(at, law, game)
        self._passive = passive_callback(at)
        stages = STAGES[plant.integrator]
        self._table = Table(
            [
                *plant.table_arrays,
                *problem.data,
                *problem.graph,
                problem.settings,
                problem.limit,
                np.zeros(0),
                np.ascontiguousarray(plant.agents.parameters),
                np.ascontiguousarray(rest),
                np.array([self._p, stages, period, mode], dtype=np.int64),
                np.array([plant.timestep]),
            ]
        )
        data = plant.data
        data.userdata[:] = 0.0
        self._step = 0
        length = int(watch.length(self._m, self._p))
        start = MONITOR + self._m
        self.monitor = data.userdata[start : start + length]
        self._u = data.userdata[start + length : start + length + self._m]
        self._before = np.zeros((2, plant.model.nq))

    @property
    def time(self) -> float:
        """Time of the present state in s."""
        return self._step * self.plant.timestep

    def advance(self, samples: int, every: int) -> Samples:
        """See the base class."""
        if self.monitor[watch.EXIT] != watch.INSIDE:
            samples = 0
        data = self.plant.data
        rows, inputs = np.empty((samples, *self._before.shape)), np.empty((samples, self._m))
        self._mark()
        # The callback counts steps and stages; a step that ended in an exit is not one of them.
        data.userdata[STEP_NOW + self._m] = self._step
        data.userdata[STAGE_NOW + self._m] = 0.0
        with callbacks(control=self._control, passive=self._passive):
            done, steps = self._advance(
                step_address(), self.plant.model._address, data._address, data.qpos, data.qvel,
                data.userdata, self._m, self._p, every, self._before, rows, inputs,
            )  # fmt: skip
        self._step += steps
        data.time = self.time
        return self._samples(rows[:done], inputs[:done])

    def finish(self) -> Samples:
        """See the base class."""
        data = self.plant.data
        self._mark()
        inside = self._finish(self.plant.model._address, data._address, self._step)
        u = self._u if inside else np.full(self._m, np.nan)
        return self._samples(np.stack([data.qpos, data.qvel])[None], u[None].copy())

    def _mark(self) -> None:
        """Mark the data as this loop's: the plant's own step, or a reset, may have come between."""
        if self._step > 0 and self.monitor[watch.STARTED] == 0.0:
            raise EngineError(
                "the loop's MuJoCo data was reset: make a new loop to start from there"
            )
        self.plant.data.userdata[:USERDATA_HEADER] = LOOP_MARK, self._table.address

    def _samples(self, rows: NDArray[np.float64], inputs: NDArray[np.float64]) -> Samples:
        state = self.plant.states_of(rows[:, 0], rows[:, 1])
        memory = np.empty((len(rows), 0))
        return Samples(state=state, input=inputs, memory=memory)
