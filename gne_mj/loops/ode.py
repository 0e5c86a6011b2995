"""The fixed-step closed loop of ODE agents: any law, any agents, Runge-Kutta 4 or Euler.

In mode `continuous` the law (and the rates of its memory) are evaluated at every stage of the
integrator. In mode `sampled` the law is evaluated once per control period and held; at the next
control instant its memory first moves exactly over the period that has passed, with the outputs
held at their values at the period's start.
"""

from functools import cache
from types import ModuleType
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from gne_mj.loops import monitor as watch
from gne_mj.loops.base import ClosedLoop, Samples
from gne_mj.loops.feedback import Problem, feedback, inside, work
from gne_mj.native import compiled, copy, kernel, source_key
from gne_mj.plants.ode import RK4, Channels, held_step

CONTINUOUS, SAMPLED = 0, 1
MODES = {"continuous": CONTINUOUS, "sampled": SAMPLED}


class Clock(NamedTuple):
    """How a loop steps."""

    h: float  # step in s
    period: int  # steps per control period, mode sampled
    mode: int
    method: int


@kernel
def measure(agent, state, states, y):
    """Fill y (m,) with the outputs of a flat state: the channels' states, then the memory."""
    for r in range(len(y)):
        y[r] = state[r * states + agent.OUTPUT]


@kernel
def stored(agent, channels, state):
    """V^{x*} of all channels."""
    states = channels.rest.shape[1]
    total = 0.0
    for r in range(len(channels.rest)):
        x = state[r * states : (r + 1) * states]
        total += agent.storage(channels.parameters[r], x, channels.rest[r])
    return total


@kernel
def begin_step(
    agent, law, game, problem, channels, clock, step, storage, state, memory, u, monitor, work
):
    """Measure, act and observe at the start of a step; u is changed. False if the run must end.

    storage is V^{x*} of the agents now (see :func:`stored`).
    """
    return look(
        agent, law, game, problem, channels, clock, step * clock.h, step, 0, storage, state,
        memory, u, monitor, work,
    )  # fmt: skip


@kernel
def look(
    agent, law, game, problem, channels, clock, time, step, stage, storage, state, memory, u,
    monitor, work,
):  # fmt: skip
    """The same at any stage of a step: at a later one (mode continuous) only work.u is filled.

    One kernel for both keeps MuJoCo's callback small, which is most of its speed.
    """
    y = work.y
    measure(agent, state, channels.rest.shape[1], y)
    if clock.mode == CONTINUOUS or step % clock.period == 0:
        if clock.mode != CONTINUOUS:
            if work.stands[0] < step:  # a control period has passed
                law.propagate(problem, work.held, memory, work.scratch)
                work.stands[0] = step
            copy(y, work.held)
        if not feedback(law, game, problem, time, stage, y, memory, work, monitor, work.u):
            return False
    else:
        if not inside(game, problem, time, stage, y, work, monitor):
            return False
        copy(u, work.u)
    if stage == 0:
        before = work.u if clock.mode == CONTINUOUS else u
        storage += law.storage(problem, memory)
        watch.observe(monitor, time, y, work.g, work.demand, before, work.u, storage)
        copy(work.u, u)
    return True


@kernel
def rates(agent, law, game, problem, channels, time, stage, state, u, monitor, work, out):
    """Fill out with the rate of the flat state in mode continuous; False if the run must end.

    At the later stages of a step u is first overwritten by the law's action there; at stage 0
    begin_step has just done so.
    """
    m, states = channels.rest.shape
    y, memory = work.y, state[m * states :]
    if stage > 0:
        measure(agent, state, states, y)
        if not feedback(law, game, problem, time, stage, y, memory, work, monitor, u):
            return False
    for r in range(m):
        x, rate = state[r * states : (r + 1) * states], out[r * states : (r + 1) * states]
        agent.rate(channels.parameters[r], x, u[r], rate)
    law.rate(problem, y, memory, out[m * states :])
    return True


@kernel
def runge_kutta_step(
    agent, law, game, problem, channels, time, h, state, u, monitor, work, scratch
):
    """One RK4 step of the whole closed loop, begun by begin_step; False if the run must end."""
    n = len(state)
    # of the state's own length, so that the memory behind the channels has its own too
    k1, k2, k3, k4 = scratch[0, :n], scratch[1, :n], scratch[2, :n], scratch[3, :n]
    trial = scratch[4, :n]
    # at stage 0 the law has acted already, and cannot fail
    rates(agent, law, game, problem, channels, time, 0, state, u, monitor, work, k1)
    for r in range(n):
        trial[r] = state[r] + 0.5 * h * k1[r]
    half = time + 0.5 * h
    if not rates(agent, law, game, problem, channels, half, 1, trial, work.u, monitor, work, k2):
        return False
    for r in range(n):
        trial[r] = state[r] + 0.5 * h * k2[r]
    if not rates(agent, law, game, problem, channels, half, 2, trial, work.u, monitor, work, k3):
        return False
    for r in range(n):
        trial[r] = state[r] + h * k3[r]
    if not rates(
        agent, law, game, problem, channels, time + h, 3, trial, work.u, monitor, work, k4
    ):
        return False
    for r in range(n):
        state[r] += h / 6.0 * (k1[r] + 2.0 * k2[r] + 2.0 * k3[r] + k4[r])
    return True


@cache
def build(agent: ModuleType, law: ModuleType, game: ModuleType) -> tuple[Any, Any]:
    """The native loop and its last observation, for an agent type, a law and a game."""
    source = source_key(agent, law, game)

    @compiled
    def advance(
        problem, channels, clock, step, every, state, u, monitor, work, scratch,
        samples_state, samples_u,
    ):  # fmt: skip
        _ = source
        m, states = channels.rest.shape
        memory = state[m * states :]
        for sample in range(len(samples_u)):
            for substep in range(every):
                storage = stored(agent, channels, state)
                if not begin_step(
                    agent, law, game, problem, channels, clock, step, storage, state, memory, u,
                    monitor, work,
                ):  # fmt: skip
                    return sample + (substep > 0), step
                if substep == 0:
                    copy(state, samples_state[sample])
                    copy(u, samples_u[sample])
                if clock.mode == CONTINUOUS and clock.method == RK4:
                    if not runge_kutta_step(
                        agent, law, game, problem, channels, step * clock.h, clock.h, state, u,
                        monitor, work, scratch,
                    ):  # fmt: skip
                        return sample + 1, step
                    step += 1
                    continue
                if clock.mode == CONTINUOUS:
                    law.rate(problem, work.y, memory, scratch[0, : len(memory)])
                held_step(
                    agent, channels.parameters, states, clock.method, clock.h, state, u,
                    scratch[1],
                )  # fmt: skip
                if clock.mode == CONTINUOUS:
                    for r in range(len(memory)):
                        memory[r] += clock.h * scratch[0, r]
                step += 1
        return len(samples_u), step

    @compiled
    def finish(problem, channels, clock, step, state, u, monitor, work):
        _ = source
        m, states = channels.rest.shape
        storage = stored(agent, channels, state)
        return begin_step(
            agent, law, game, problem, channels, clock, step, storage, state, state[m * states :],
            u, monitor, work,
        )  # fmt: skip

    return advance, finish


class OdeLoop(ClosedLoop):
    """The closed loop of ODE agents with a fixed step.

    Args:
        agent, law, game: the three modules of kernels.
        problem: what the law reads.
        channels: the agents' channels.
        clock: how to step.
        state: (m, states) at the start.
        memory: the law's, at the start.
    """

    def __init__(
        self,
        agent: ModuleType,
        law: ModuleType,
        game: ModuleType,
        problem: Problem,
        channels: Channels,
        clock: Clock,
        state: NDArray[np.float64],
        memory: NDArray[np.float64],
    ) -> None:
        self._advance, self._finish = build(agent, law, game)
        self._fixed = (problem, channels, clock)
        self._clock = clock
        self._shape = state.shape
        self._state = np.concatenate([state.ravel(), memory])
        actions, constraints = len(state), len(problem.data.member_pointer) - 1
        self._u = np.zeros(actions)
        self._work = work(actions, constraints, len(problem.data.offsets) - 1)
        self._scratch = np.zeros((5, max(len(self._state), actions, 5 * state.shape[1])))
        self._step = 0
        self.monitor = np.zeros(watch.length(actions, constraints))

    @property
    def time(self) -> float:
        """Time of the present state in s."""
        return self._step * self._clock.h

    def advance(self, samples: int, every: int) -> Samples:
        """See the base class."""
        if self.monitor[watch.EXIT] != watch.INSIDE:
            samples = 0
        states, inputs = np.empty((samples, len(self._state))), np.empty((samples, len(self._u)))
        done, self._step = self._advance(
            *self._fixed, self._step, every, self._state, self._u, self.monitor, self._work,
            self._scratch, states, inputs,
        )  # fmt: skip
        return self._samples(states[:done], inputs[:done])

    def finish(self) -> Samples:
        """See the base class."""
        inside = self._finish(
            *self._fixed, self._step, self._state, self._u, self.monitor, self._work
        )
        u = self._u if inside else np.full_like(self._u, np.nan)
        return self._samples(self._state[None].copy(), u[None].copy())

    def _samples(self, states: NDArray[np.float64], inputs: NDArray[np.float64]) -> Samples:
        size = self._shape[0] * self._shape[1]
        return Samples(
            state=states[:, :size].reshape(-1, *self._shape),
            input=inputs,
            memory=states[:, size:],
        )
