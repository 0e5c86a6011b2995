"""One adaptive step of the Rosenbrock loop, and where the loop's numbers lie.

See :mod:`gne_mj.loops.rosenbrock`. Its parts call each other through addresses
(:func:`gne_mj.loops.rosenbrock.parts`), so that each is compiled once.
"""

from typing import Annotated, NamedTuple

import numpy as np

from gne_mj.linear import add_multiple, add_multiples
from gne_mj.loops import monitor as watch
from gne_mj.loops.estimate_modes import Modes, from_modes
from gne_mj.loops.feedback import StepScratch
from gne_mj.loops.layout import (
    SCRATCH,
    channels_in,
    problem_in,
    steps_in,
)
from gne_mj.loops.rodas import ADDING, ORDER, STAGES, Method
from gne_mj.loops.stage_system import (
    Fixed,
    StageSystem,
    linearise,
    parts_of,
    prepare,
)
from gne_mj.native import (
    address_in,
    call_integer,
    call_number,
    copy,
    kernel,
)
from gne_mj.numbers import Numbers, names_of, numbers_in
from gne_mj.parameter_block import floats_at
from gne_mj.records import in_array, in_parameter_block

# How the step is chosen: Gustafsson's predictive controller with the figures of Hairer's RODAS.
SAFETY, GROW, SHRINK = 0.9, 6.0, 0.2
POWER = 1.0 / ORDER
# Step in s, relative to the time from EARLY on, below which a run ends; and how far beyond it is
# looked whether the boundary is why, relative to the time from 1 s on
SMALLEST, EARLY = 1e-12, 1e-6
AHEAD = 1e-6


class Steps(Numbers):
    """How far a run is: the last accepted step runs from start to end."""

    start: float
    end: float
    next: float  # length to be tried, as the others in s
    last_step: float
    last_error: float
    accepted: float
    rejected: float


class RosenbrockState(NamedTuple):
    """Arrays that a step works on, as a parameter block of their own; n entries each."""

    functions: Annotated[np.ndarray, "n", int]  # addresses, in the order below
    state: Annotated[np.ndarray, "n"]  # the flat vector
    trial: Annotated[np.ndarray, "n"]  # at a stage
    k: Annotated[np.ndarray, "stages, n // stages"]
    # states and memory: what the dense output of the last accepted step needs
    dense: Annotated[np.ndarray, "5, n // 5"]
    greatest: Annotated[np.ndarray, "n"]  # each state's greatest magnitude so far
    u: Annotated[np.ndarray, "n"]  # input at a stage
    system: StageSystem
    modes: Modes  # read-only
    method: Method  # read-only


ACT, OBSERVE, SOLVE_STAGE, TRY_STEP = range(4)
_solver_in = in_parameter_block(RosenbrockState, stages=STAGES)
exit_in, EXIT_LENGTH = numbers_in(watch.MonitorNumbers), len(names_of(watch.MonitorNumbers))


class Rows(NamedTuple):
    """What a run has recorded."""

    state: np.ndarray  # (rows, n) states and memory
    u: np.ndarray  # (rows, m)


class Workspace(NamedTuple):
    """What changes in a run besides, in one flat array."""

    progress: Steps
    monitor: watch.Monitor
    exit: watch.MonitorNumbers  # why the last stage failed
    u: Annotated[np.ndarray, "m"]  # input at the last step's start
    work: StepScratch


STEP_SCRATCH = SCRATCH | {"history": 0, "solver": 0, "separation": 0}
workspace_length, _workspace_in = in_array(Workspace, "m p agents", **STEP_SCRATCH)


class Place(NamedTuple):
    """Addresses of where a run's numbers lie."""

    parameter_block: int
    workspace: int
    solver: int


class Run(NamedTuple):
    """What kernels of a run change."""

    progress: Steps
    monitor: watch.MonitorNumbers
    figures: watch.Monitor
    exit: watch.MonitorNumbers
    u: np.ndarray
    work: StepScratch
    solver: RosenbrockState
    place: Place


@kernel
def run_in(parameter_block, workspace, solver):
    """What does not change in a run, and what does, from the addresses of where it lies."""
    steps = steps_in(parameter_block)
    arrays = _solver_in(solver, steps.agents, steps.actions, steps.states)
    fixed = Fixed(
        problem_in(parameter_block), channels_in(parameter_block), arrays.modes, arrays.method
    )
    sizes = steps.actions, steps.constraints, steps.agents
    found = _workspace_in(floats_at(workspace, workspace_length(*sizes)), 0, *sizes)
    return fixed, Run(
        found.progress, found.monitor.numbers, found.monitor, found.exit, found.u, found.work,
        arrays, Place(parameter_block, workspace, solver),
    )  # fmt: skip


@kernel
def act(run, time, stage, state, latch, u):
    """Measure and act; fill u. False, with the exit in ``latch``, if there is no input."""
    good = call_integer(
        run.solver.functions[ACT],
        (
            run.place.parameter_block, run.place.workspace, run.place.solver, time, stage,
            address_in(state), address_in(latch), address_in(u),
        ),
    )  # fmt: skip
    return good != 0


@kernel
def control_step(run, time, state, latch, u):
    """The same, and observe."""
    good = call_integer(
        run.solver.functions[OBSERVE],
        (
            run.place.parameter_block, run.place.workspace, run.place.solver, time,
            address_in(state), address_in(latch), address_in(u),
        ),
    )  # fmt: skip
    return good != 0


@kernel
def error_of(output, agents, method, states, state, solver):
    """Weighted estimate of the step's error, 1 being what is allowed: the worst of all states.

    A state is compared with its greatest magnitude so far in any channel, z and the estimates
    with that of the output; a column of estimates counts by its root mean square, which is that
    of its modes.
    """
    m = len(solver.u)
    k = solver.k[STAGES - 1]
    at_z = m * states + agents * m
    worst = 0.0
    for a in range(states):
        allowed = method.tolerance[1] + method.tolerance[0] * magnitude(states, state, solver, a)
        for r in range(m):
            error = abs(k[r * states + a])
            if a == output:
                total = 0.0
                for mode in range(at_z + m + r, len(k), m):
                    total += k[mode] ** 2
                error = max(error, abs(k[at_z + r]), np.sqrt(total / max(agents - 1, 1)))
                error += 0.0 * (total + k[at_z + r])  # not a number if one of them is not
            error /= allowed
            if not error < np.inf:
                return np.inf
            worst = max(worst, error)
    return worst


@kernel
def magnitude(states, state, solver, a):
    """Greatest magnitude of the channels' state a so far and at ``state``."""
    greatest = solver.greatest[a]
    for r in range(len(solver.u)):
        greatest = max(greatest, abs(state[r * states + a]))
    return greatest


@kernel
def step_to_trial(fixed, run, time, h):
    """Fill trial with the flat vector after a step of length h; return its weighted error.

    The error is infinite, and run.exit says why, if a stage or the new state is not inside.
    """
    problem, channels, method = fixed.problem, fixed.channels, fixed.method
    solver, agents = run.solver, len(problem.data.offsets) - 1
    state, trial, k, place = solver.state, solver.trial, solver.k, run.place
    run.exit.exit = watch.INSIDE
    if not prepare(fixed, h, solver.system):
        watch.leave(run.exit, watch.DIVERGED, time, -1, -1, np.inf, 1)
        return np.inf
    copy(run.u, solver.u)
    for stage in range(STAGES + 1):
        if stage < ADDING:
            copy(state, trial)
            add_multiples(method.stage[stage], stage, k, 0, trial)
        else:
            add_multiple(1.0, k[stage - 1], trial)
        if stage > 0 and not act(run, time, stage, trial, run.exit, solver.u):
            return np.inf
        if stage < STAGES:
            call_integer(
                solver.functions[SOLVE_STAGE],
                (place.parameter_block, place.workspace, place.solver, h, stage),
            )
    states = channels.equilibrium_state.shape[1]
    error = error_of(channels.output, agents, method, states, trial, solver)
    if not error <= 1.0:  # latched only if the run ends here
        watch.leave(run.exit, watch.DIVERGED, time, -1, -1, error, STAGES)
    return error


@kernel
def look_ahead(run, time, h):
    """Tell in run.exit if the boundary is why even the smallest step has failed.

    Next to the boundary the demand grows so fast that no step is accurate. The trial vector is
    moved on along the step of length h, until it is outside or a microsecond away.
    """
    state, trial = run.solver.state, run.solver.trial
    while h < AHEAD * max(1.0, time):
        h *= 2.0
        for r in range(len(trial)):
            trial[r] += trial[r] - state[r]
        why = run.exit.exit
        run.exit.exit = watch.INSIDE
        good = act(run, time, STAGES, trial, run.exit, run.solver.u)
        if not good and run.exit.exit != watch.DIVERGED:
            return
        run.exit.exit = why


@kernel
def accept(fixed, run, h):
    """Move to the trial state, and keep what the dense output of the step needs."""
    channels, modes, method = fixed.channels, fixed.modes, fixed.method
    progress, solver = run.progress, run.solver
    states, state = channels.equilibrium_state.shape[1], solver.state
    m, n = len(solver.u), solver.dense.shape[1]
    copy(state[:n], solver.dense[0])
    copy(solver.trial, state)
    # anew from the modes, so that rounding does not add up in the estimates
    now = parts_of(state, fixed)
    from_modes(modes.vectors, now.w, now.e)
    for r in range(m):
        now.e[modes.owner[r], r] = now.x[r, channels.output]
    copy(state[:n], solver.dense[1])
    for line in range(len(method.dense)):
        out = solver.dense[2 + line]
        for r in range(n):
            out[r] = 0.0
        add_multiples(method.dense[line], STAGES, solver.k, 0, out)
    for a in range(states):
        solver.greatest[a] = magnitude(states, state, solver, a)
    progress.start = progress.end
    progress.end += h
    progress.accepted += 1.0


@kernel
def step_on(fixed, run):
    """Take one accepted step from its end; False, with the exit latched, if there is none."""
    progress, monitor, state = run.progress, run.monitor, run.solver.state
    time = progress.end
    if not control_step(run, time, state, monitor, run.u):
        return False
    monitor.steps = progress.accepted
    linearise(fixed, state, run.u, run.work, run.solver.system)
    h, retried = progress.next, False
    while True:
        smallest = SMALLEST * max(EARLY, time)
        if not h > smallest:
            h = smallest
        error = call_number(
            run.solver.functions[TRY_STEP],
            (run.place.parameter_block, run.place.workspace, run.place.solver, time, h),
        )
        if error <= 1.0:
            break
        if h == smallest:
            why = run.exit
            if why.exit == watch.DIVERGED:
                look_ahead(run, time, h)
            watch.leave(
                monitor, int(why.exit), time, why.exit_agent, why.exit_constraint,
                why.exit_value, why.exit_stage,
            )  # fmt: skip
            return False
        progress.rejected += 1.0
        retried = True
        h *= max(SHRINK, SAFETY * error**-POWER) if error < np.inf else 0.5
    accept(fixed, run, h)
    error = max(error, 1e-12)
    factor = min(GROW, SAFETY * error**-POWER)
    if progress.last_step > 0.0:
        trend = SAFETY * h / progress.last_step
        factor = min(factor, trend * (progress.last_error / error**2) ** POWER)
    factor = max(factor, SHRINK)
    progress.next = h * (min(factor, 1.0) if retried else factor)
    progress.last_step = h
    progress.last_error = max(error, 0.01)
    return True


@kernel
def interpolate(progress, time, dense, out):
    """Fill out (n,) with states and memory at a time in the last accepted step."""
    length = progress.end - progress.start
    theta = (time - progress.start) / length if length > 0.0 else 1.0
    rest = 1.0 - theta
    for r in range(len(out)):
        bend = dense[2, r] + theta * (dense[3, r] + theta * dense[4, r])
        out[r] = rest * dense[0, r] + theta * (dense[1, r] + rest * bend)
