"""The closed loop in MuJoCo: laws as C callbacks, no Python per step.

MuJoCo evaluates control at every stage of its integrator. The callback counts these evaluations
itself: the first one of each step measures, acts and observes exactly as the ODE loop does
(:func:`gne_mj.loops.ode.begin_step`); later ones, in mode `continuous`, only act. What it keeps
from call to call lies in mjData's ``userdata``, which is part of MuJoCo's state:
[address of the table, calls so far, monitor, input held, scratch].
"""

from functools import cache
from types import ModuleType
from typing import Any

import numpy as np
from numba import carray
from numpy.typing import NDArray

from gne_mj.game import Game, GameData
from gne_mj.graph import GraphData
from gne_mj.loops import monitor as watch
from gne_mj.loops.base import ClosedLoop, Samples
from gne_mj.loops.feedback import Problem, Work, feedback
from gne_mj.loops.ode import CONTINUOUS, Clock, begin_step, measure
from gne_mj.native import address_as_pointer, callback, compiled, copy, kernel, source_key, view
from gne_mj.plants import flexible_robot
from gne_mj.plants.mujoco import (
    ACTUATOR,
    PLANT_TABLE,
    SIZES,
    STAGES,
    MujocoPlant,
    gather,
    passive_callback,
)
from gne_mj.plants.native_mujoco import (
    CALLBACK,
    Offsets,
    Table,
    call,
    callbacks,
    field,
    floats,
    integers,
    offsets,
    pointer_as_address,
    step_address,
    table_of,
)
from gne_mj.plants.ode import Channels

# Behind the plant's arrays: the game's (as in GameData), the graph's, then these
GAME = PLANT_TABLE
GRAPH = GAME + len(GameData._fields)
SETTINGS, LIMIT, PARAMETERS, REST, STEP, CLOCK = range(GRAPH + 2, GRAPH + 8)
TABLE = GRAPH + 8

CALLS, MONITOR = 1, 2  # entries of userdata


@kernel
def userdata_length(m, p, states):
    """Entries of userdata that the callback needs: the list at the top of this module."""
    return MONITOR + watch.length(m, p) + m + 2 * p + 4 * m + m * states


@view
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
    nothing = carray(address_as_pointer(0), (0, 0, 0), np.float64)
    return Problem(data, graph, floats(table, SETTINGS), floats(table, LIMIT), nothing)


@view
def channels_in(table, m, states):
    """The agents' channels, from a simulation's table."""
    parameters = floats(table, PARAMETERS)
    rest = floats(table, REST)
    return Channels(parameters.reshape((m, len(parameters) // m)), rest.reshape((m, states)))


@view
def parts_of(userdata, m, p, states):
    """The views into userdata: monitor, input held, scratch, flat state."""
    at = MONITOR + watch.length(m, p)
    monitor = userdata[MONITOR:at]
    u = userdata[at : at + m]
    at += m
    g, weights = userdata[at : at + p], userdata[at + p : at + 2 * p]
    at += 2 * p
    work = Work(
        g,
        weights,
        userdata[at : at + m],
        userdata[at + m : at + 2 * m],
        userdata[at + 2 * m : at + 3 * m],
        userdata[at + 3 * m : at + 4 * m],
    )
    at += 4 * m
    return monitor, u, work, userdata[at : at + m * states]


@cache
def build(at: Offsets, law: ModuleType, game: ModuleType) -> tuple[Any, Any, Any]:
    """The control callback, the native loop and its last observation, for a law and a game."""
    agent = flexible_robot
    source = source_key(agent, law, game)

    def control(model, data):
        _ = source
        struct = pointer_as_address(data)
        table = table_of(at, pointer_as_address(model), struct, TABLE)
        if len(table) == 0:
            return
        sizes, steps = integers(table, SIZES), integers(table, STEP)
        ctrl = field(struct, at.ctrl, sizes[2])
        userdata = field(struct, at.userdata, sizes[3])
        actuator = integers(table, ACTUATOR)
        m, p, states = len(actuator), steps[0], len(agent.STATES)
        stages, period, mode = steps[1], steps[2], steps[3]
        monitor, u, work, state = parts_of(userdata, m, p, states)
        evaluation = np.int64(userdata[CALLS])
        userdata[CALLS] += 1.0
        step, stage = evaluation // stages, evaluation % stages
        if stage > 0 and mode != CONTINUOUS:
            return
        h = floats(table, CLOCK)[0]
        problem = problem_in(table)
        gather(at, struct, table, state)
        acts = monitor[watch.EXIT] == watch.INSIDE
        if acts and stage == 0:
            acts = begin_step(
                agent, law, game, problem, channels_in(table, m, states),
                Clock(h, period, mode, 0), step, state, u, monitor, work,
            )  # fmt: skip
            for r in range(m):
                ctrl[actuator[r]] = u[r] if acts else 0.0
        elif acts:
            measure(agent, state, states, work.y)
            time = (step + (1.0 if stage == 3 else 0.5)) * h
            acts = feedback(
                law, game, problem, time, stage, work.y, state[m * states :], work, monitor, work.u
            )
            for r in range(m):
                ctrl[actuator[r]] = work.u[r] if acts else 0.0

    def advance(mj_step, model, data, qpos, qvel, userdata, m, p, every, before, states, inputs):
        _ = source
        monitor, u, work, state = parts_of(userdata, m, p, len(agent.STATES))
        done = 0
        for sample in range(len(inputs)):
            for substep in range(every):
                copy(qpos, before[0])
                copy(qvel, before[1])
                call(mj_step, model, data)
                if monitor[watch.EXIT] != watch.INSIDE:
                    copy(before[0], qpos)
                    copy(before[1], qvel)
                    return sample, done
                if substep == 0:
                    copy(u, inputs[sample])
                    copy(before[0], states[sample, 0])
                    copy(before[1], states[sample, 1])
                done += 1
        return len(inputs), done

    def finish(model, data, step):
        _ = source
        table = table_of(at, model, data, TABLE)
        sizes, steps = integers(table, SIZES), integers(table, STEP)
        m, p, states = len(integers(table, ACTUATOR)), steps[0], len(agent.STATES)
        userdata = field(data, at.userdata, sizes[3])
        monitor, u, work, state = parts_of(userdata, m, p, states)
        gather(at, data, table, state)
        return begin_step(
            agent, law, game, problem_in(table), channels_in(table, m, states),
            Clock(floats(table, CLOCK)[0], steps[2], steps[3], 0), step, state, u, monitor, work,
        )  # fmt: skip

    return (
        callback(CALLBACK, control),
        compiled(advance, views=True),
        compiled(finish, views=True),
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
                np.ascontiguousarray(plant.agents.parameters),
                np.ascontiguousarray(rest),
                np.array([self._p, stages, period, mode], dtype=np.int64),
                np.array([plant.timestep]),
            ]
        )
        data = plant.data
        data.userdata[:] = 0.0
        data.userdata[0] = self._table.address
        self._step = 0
        length = int(watch.length(self._m, self._p))
        self.monitor = data.userdata[MONITOR : MONITOR + length]
        self._u = data.userdata[MONITOR + length : MONITOR + length + self._m]
        self._before = np.zeros((2, plant.model.nq))
        self._stages = stages

    @property
    def time(self) -> float:
        """Time of the present state in s."""
        return self._step * self.plant.timestep

    def advance(self, samples: int, every: int) -> Samples:
        """See the base class."""
        data = self.plant.data
        rows, inputs = np.empty((samples, *self._before.shape)), np.empty((samples, self._m))
        # The callback counts evaluations; a step that ended in an exit is not one of them.
        data.userdata[CALLS] = self._step * self._stages
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
        inside = self._finish(self.plant.model._address, data._address, self._step)
        u = self._u if inside else np.full(self._m, np.nan)
        return self._samples(np.stack([data.qpos, data.qvel])[None], u[None].copy())

    def _samples(self, rows: NDArray[np.float64], inputs: NDArray[np.float64]) -> Samples:
        main_q, appendage_q, main_v, appendage_v = self.plant.table_arrays[:4]
        qpos, qvel = rows[:, 0], rows[:, 1]
        columns = (
            qpos[:, main_q] - qpos[:, appendage_q],
            qvel[:, main_v],
            qvel[:, appendage_v],
            qpos[:, main_q],
        )
        memory = np.empty((len(rows), 0))
        return Samples(state=np.stack(columns, axis=2), input=inputs, memory=memory)
