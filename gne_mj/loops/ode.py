"""The fixed-step closed loop of ODE agents: any law, any agents, Runge-Kutta 4 or Euler.

In mode `continuous` the law (and the rates of its memory) are evaluated at every stage of the
integrator. In the held modes, `sampled` and `implicit`, an input is found once per control period
and held; at the next control instant the law's memory first moves exactly over the period that has
passed, with the outputs held at their values at the period's start.
"""

from functools import cache
from types import ModuleType
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from gne_mj.loops import explicit, faultless
from gne_mj.loops import monitor as watch
from gne_mj.loops.base import ClosedLoop, Samples
from gne_mj.loops.feedback import NO_SIZES, Problem, Sizes, inside, work
from gne_mj.native import compiled, copy, kernel, source_key
from gne_mj.plants import held_map
from gne_mj.plants.ode import RK4, Channels, held_step

# Mode implicit is held like sampled; what differs is how the input is found, a module of its own
CONTINUOUS, HELD = 0, 1
MODES = {"continuous": CONTINUOUS, "sampled": HELD, "implicit": HELD}


class Clock(NamedTuple):
    """How a loop steps."""

    h: float  # step in s
    period: int  # steps per control period, held modes
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
def look(
    acting, faults, plant, context, agent, law, game, problem, channels, clock, time, step, stage,
    storage, state, memory, u, monitor, work,
):  # fmt: skip
    """Measure and act at a stage of a step, and at its start (stage 0) observe; fill work.u.

    One kernel for all stages keeps loops and MuJoCo's callback small, which is most of their speed
    and of the time to compile them.

    Args:
        acting: module that finds the law's input, :mod:`gne_mj.loops.explicit` and its like.
        faults: :mod:`gne_mj.loops.faultless` or :mod:`gne_mj.loops.faults`.
        plant: module that predicts, :mod:`gne_mj.plants.held_map` and its like.
        context: what that module needs of the engine.
        agent, law, game: modules of kernels.
        problem, channels, clock: as the loop has them.
        time: at the stage, in s.
        step: which step this is.
        stage: 0 at its start; later ones are looked at in mode continuous only.
        storage: V^{x*} of the agents now (see :func:`stored`); read at stage 0.
        state: flat, channel after channel, at the stage.
        memory: the law's at the stage; own actions are written into it, and in the held modes it
            moves on when a control period has passed.
        u: (m,) input that acts; changed at stage 0.
        monitor, work: changed.

    Returns:
        False if the run must end; the exit is then latched in the monitor.
    """
    y = work.y
    measure(agent, state, channels.rest.shape[1], y)
    instant = clock.mode == CONTINUOUS or step % clock.period == 0
    if not inside(game, problem, time, stage, y, work, monitor):
        if not instant:
            monitor[watch.EXIT_BETWEEN] = 1.0
        return False
    if instant:
        if clock.mode != CONTINUOUS and work.stands[0] < step:  # a control period has passed
            law.propagate(problem, work.held, memory, work.scratch)
            work.stands[0] = step
        faults.begin(agent, problem, clock, step, stage, state, memory, work)
        if not acting.act(
            acting, faults, plant, context, agent, law, game, problem, channels, clock, time, step,
            stage, state, memory, work, monitor,
        ):  # fmt: skip
            return False
        faults.deliver(problem, clock, step, stage, work)
    else:
        copy(u, work.u)
    if stage == 0:
        before = work.u if clock.mode == CONTINUOUS else u
        storage += law.storage(problem, memory)
        watch.observe(monitor, time, y, work.g, work.demand, before, work.u, storage)
        copy(work.u, u)
    return True


@kernel
def rates(agent, law, problem, channels, state, u, y, out):
    """Fill out with the rate of the flat state under u (m,), the law having acted at y (m,)."""
    m, states = channels.rest.shape
    for r in range(m):
        x, rate = state[r * states : (r + 1) * states], out[r * states : (r + 1) * states]
        agent.rate(channels.parameters[r], x, u[r], rate)
    law.rate(problem, y, state[m * states :], out[m * states :])


@kernel
def stage_state(stage, h, state, k, trial):
    """Fill trial with the flat state at a stage of RK4, given the rates at the stages before it."""
    length = h if stage == 3 else 0.5 * h
    for r in range(len(state)):
        trial[r] = state[r] + length * k[stage - 1, r]


@cache
def build(
    agent: ModuleType,
    law: ModuleType,
    game: ModuleType,
    acting: ModuleType = explicit,
    faults: ModuleType = faultless,
) -> Any:
    """The native loop for an agent type, a law and a game.

    With ``every`` = 0 it observes the present state, and does not move on.
    """
    source = source_key(agent, law, game)

    @compiled
    def advance(
        problem, channels, clock, step, every, state, u, monitor, work, scratch,
        samples_state, samples_u, samples_seen, samples_acts,
    ):  # fmt: skip
        _ = source
        m, states = channels.rest.shape
        n, h = len(state), clock.h
        stages = 4 if clock.mode == CONTINUOUS and clock.method == RK4 else 1
        # of the state's own length, so that the memory behind the channels has its own too
        k, trial = scratch[:4], scratch[4, :n]
        for sample in range(len(samples_u)):
            for substep in range(max(every, 1)):
                storage = stored(agent, channels, state)
                for stage in range(stages):
                    now = state
                    if stage > 0:
                        stage_state(stage, h, state, k, trial)
                        now = trial
                    time = step * h + (0.0, 0.5 * h, 0.5 * h, h)[stage]
                    if not look(
                        acting, faults, held_map, (), agent, law, game, problem, channels, clock,
                        time, step, stage, storage, now, now[m * states :], u, monitor, work,
                    ):  # fmt: skip
                        # a step that began inside has its row, even if a later stage left
                        return sample + (substep > 0 or stage > 0), step
                    if substep == 0 and stage == 0:
                        copy(state, samples_state[sample])
                        copy(u, samples_u[sample])
                        faults.record(
                            agent, states, problem, clock, step, state, u, work,
                            samples_seen[sample], samples_acts[sample],
                        )  # fmt: skip
                    if clock.mode == CONTINUOUS and every > 0:
                        acts = faults.push(problem, clock, step, work.u, work.acts)
                        seen = faults.choose(work.y, work.seen)
                        rates(agent, law, problem, channels, now, acts, seen, k[stage, :n])
                if every == 0:
                    return sample + 1, step
                if stages == 4:
                    for r in range(n):
                        rise = k[0, r] + 2.0 * k[1, r] + 2.0 * k[2, r] + k[3, r]
                        state[r] += h / 6.0 * rise
                else:
                    acts = faults.push(problem, clock, step, u, work.acts)
                    held_step(
                        agent, channels.parameters, states, clock.method, h, state, acts, scratch[4]
                    )
                    if clock.mode == CONTINUOUS:  # Euler's method for the memory
                        for r in range(m * states, n):
                            state[r] += h * k[0, r]
                step += 1
        return len(samples_u), step

    return advance


class OdeLoop(ClosedLoop):
    """The closed loop of ODE agents with a fixed step.

    Args:
        agent, law, game: the three modules of kernels.
        problem: what the law reads.
        channels: the agents' channels.
        clock: how to step.
        state: (m, states) at the start.
        memory: the law's, at the start.
        acting, faults: modules of kernels, see :func:`look`.
        sizes: of the scratch arrays that they need.
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
        acting: ModuleType = explicit,
        faults: ModuleType = faultless,
        sizes: Sizes = NO_SIZES,
    ) -> None:
        self._advance = build(agent, law, game, acting, faults)
        self._fixed = (problem, channels, clock)
        self._clock = clock
        self._shape = state.shape
        self._state = np.concatenate([state.ravel(), memory])
        actions, constraints = len(state), len(problem.data.member_pointer) - 1
        self._u = np.zeros(actions)
        self._faulty = int(faults is not faultless)
        self._work = work(actions, constraints, len(problem.data.offsets) - 1, sizes)
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
        return self._samples(*self._record(samples, every))

    def finish(self) -> Samples:
        """See the base class."""
        rows = self._record(1, 0)
        if len(rows[0]):
            return self._samples(*rows)
        nothing = (np.full((1, row.shape[1]), np.nan) for row in rows[1:])
        return self._samples(self._state[None].copy(), *nothing)

    def _record(self, samples: int, every: int) -> list[NDArray[np.float64]]:
        """Rows of states, inputs, and where there are faults of what was seen and what acted."""
        m = len(self._u)
        widths = (len(self._state), m, m * self._faulty, m * self._faulty)
        rows = [np.empty((samples, width)) for width in widths]
        done, self._step = self._advance(
            *self._fixed, self._step, every, self._state, self._u, self.monitor, self._work,
            self._scratch, *rows,
        )  # fmt: skip
        return [row[:done] for row in rows]

    def _samples(
        self,
        states: NDArray[np.float64],
        inputs: NDArray[np.float64],
        seen: NDArray[np.float64],
        acts: NDArray[np.float64],
    ) -> Samples:
        size = self._shape[0] * self._shape[1]
        return Samples(
            state=states[:, :size].reshape(-1, *self._shape),
            input=inputs,
            memory=states[:, size:],
            seen=seen,
            acts=acts,
        )
