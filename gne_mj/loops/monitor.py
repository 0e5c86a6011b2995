"""What is measured at every integration step of a run, in one flat array for native code.

All zero means "not started", so that a reset simulation starts afresh.
"""

from typing import Annotated, Any, NamedTuple

import numpy as np

from gne_mj.native import kernel
from gne_mj.numbers import Numbers
from gne_mj.records import dtype_of


class MonitorNumbers(Numbers):
    """A monitor's single numbers; times in s."""

    started: float  # 1 once something was observed
    exit: float  # one of the codes below
    exit_time: float
    exit_agent: float  # whose estimate left; -1 for the true profile
    exit_constraint: float
    exit_value: float
    exit_stage: float  # 0: at a step's start; more: at a later stage, exit_time being its time
    steps: float  # pieces of divided steps included
    time: float  # of the last observation
    storage: float  # V at the last observation
    storage_start: float
    storage_rise: float  # greatest rise of V from one step to the next
    storage_rise_time: float
    saturated: float  # 1 once an input was limited
    saturated_time: float  # when that was first
    saturated_action: float
    saturated_command: float
    relaxed: float  # evaluations of a law whose bounds were soft, nothing keeping them all
    exit_between: float  # 1: the exit was not at a control instant
    # Runs that go on outside the set, see gne_mj.loops.outside
    exits: float  # how often it went outside
    outside_first: float  # when first
    outside_constraint: float  # which one was violated most then
    outside_value: float  # and its value
    outside_time: float  # of the last observation outside
    outside_last: float  # the greatest value of a constraint then
    outside_for: float  # for how long, in all
    outside_integral: float  # of the greatest value of a constraint, over that time
    # Mode implicit
    solutions: float  # inputs that were solved for
    solver_steps: float  # of Newton's method, in all
    most_steps: float  # for one input
    unsolved: float  # solutions that are not accurate (though inside)
    unsolved_time: float  # when that was first
    prediction: float  # greatest |y - predicted y| at a control instant
    prediction_time: float
    not_monotone: float  # periods with dy+/du not positive in some channel
    not_monotone_time: float
    # Loads, see gne_mj.loops.loads
    load: float  # greatest |estimate|
    load_time: float
    load_change: float  # greatest change of one at a control instant
    load_change_time: float
    # Control periods that may end early, see gne_mj.loops.guard
    cut: float  # periods that did
    cut_time: float  # the first one's start
    shortest_period: float  # length in s of the shortest of these; 0 if none did
    # Mode continuous, see gne_mj.loops.division
    divided: float  # steps that were divided
    smallest_step: float  # length in s of the shortest piece of one; 0 if none was divided
    # Messages over links, where agents send by triggers
    messages: float
    message_instants: float  # at which there could have been one over each
    # Positions that follow outputs, see gne_mj.loops.positions
    positions: float  # observations of them
    positions_outside: float  # of these, those with a constraint that is violated there
    positions_worst: float  # the greatest value of a constraint at them
    positions_worst_time: float
    positions_constraint: float  # which one
    # Contacts between agents in MuJoCo, see gne_mj.loops.contacts
    contacts: float  # all, of all observations
    touching: float  # observations with one
    contact_time: float  # of the first one
    contact_agent: float  # and whose it was
    contact_other: float
    contact_depth: float  # greatest overlap in m
    # Agents that keep apart, see gne_mj.loops.separation
    apart: float  # observations of them
    least_distance: float  # in m, of the positions of two agents; infinite if none were near
    least_distance_time: float
    nearest_first: float  # which two
    nearest_second: float
    too_near: float  # observations with two that were too near
    most_pairs: float  # that were near at once


class Monitor(NamedTuple):
    """A monitor in native code; in Python the numbers are beside the arrays (:func:`fresh`)."""

    numbers: MonitorNumbers
    worst: Annotated[np.ndarray, "p"]  # each constraint's greatest value
    worst_time: Annotated[np.ndarray, "p"]
    peak: Annotated[np.ndarray, "m"]  # of |u| that was asked for
    peak_time: Annotated[np.ndarray, "m"]
    square: Annotated[np.ndarray, "m"]  # integral of u^2
    energy: Annotated[np.ndarray, "m"]  # integral of u y
    last_y: Annotated[np.ndarray, "m"]
    last_u: Annotated[np.ndarray, "m"]


# STEP_TOO_SMALL: the boundary is so near that even the finest pieces of a step do not do
# FORCES_LOST: MuJoCo has left out forces; EXIT_VALUE says which of its warnings told so
# TOO_NEAR: two agents are; exit_agent and exit_constraint say which, as they do where a step is too
# small for two agents
# FORESEEN: the input that there is leads outside within one step, and is not given
# MOVED_PAST: a bound moves past the outputs within the control period that begins at exit_time
INSIDE, LEFT_SET, ESTIMATE_LEFT, DIVERGED, STEP_TOO_SMALL, FORCES_LOST, TOO_NEAR, FORESEEN = range(
    8
)
MOVED_PAST = 8


def fresh(actions: int, constraints: int, *runs: int) -> Any:
    """Monitors that have seen nothing: of one run, or an array of so many (a ``np.recarray``)."""
    made = np.zeros(runs, dtype_of(Monitor, m=actions, p=constraints))
    return made.view(np.recarray) if runs else made[()]


def together(monitors: list[Any]) -> Any:
    """The monitors of some runs as one array (runs,), in which every entry is one of arrays."""
    return np.stack(monitors).view(np.recarray)


@kernel
def leave(monitor, code, time, agent, constraint, value, stage):
    """Latch the first exit."""
    if monitor.exit == INSIDE:
        monitor.exit = code
        monitor.exit_time = time
        monitor.exit_agent = agent
        monitor.exit_constraint = constraint
        monitor.exit_value = value
        monitor.exit_stage = stage


@kernel
def forget_exit(monitor):
    """Take a latched exit back: the piece of a step that it was seen in is not taken."""
    monitor.exit = monitor.exit_time = monitor.exit_agent = 0.0
    monitor.exit_constraint = monitor.exit_value = monitor.exit_stage = 0.0


@kernel
def compare(monitor, time, y, prediction):
    """Note how far the outputs y (m,) are from those predicted for this control instant."""
    for r in range(len(y)):
        distance = abs(y[r] - prediction[r])
        if not distance <= monitor.prediction:
            monitor.prediction = distance
            monitor.prediction_time = time


@kernel
def count_solution(monitor, time, steps, accurate, least):
    """Note one solution of mode implicit: Newton steps, accuracy, least secant over slope."""
    monitor.solutions += 1.0
    monitor.solver_steps += steps
    monitor.most_steps = max(monitor.most_steps, steps)
    if not accurate:
        if monitor.unsolved == 0.0:
            monitor.unsolved_time = time
        monitor.unsolved += 1.0
    if not least > 0.0:
        if monitor.not_monotone == 0.0:
            monitor.not_monotone_time = time
        monitor.not_monotone += 1.0


@kernel
def note_load(monitor, time, load, change):
    """Note an estimated load, and by how much it changed."""
    if abs(load) > monitor.load:
        monitor.load, monitor.load_time = abs(load), time
    if abs(change) > monitor.load_change:
        monitor.load_change, monitor.load_change_time = abs(change), time


@kernel
def count_cut(monitor, time, length):
    """Note that the control period which begins now lasts only ``length`` s."""
    if monitor.cut == 0.0:
        monitor.cut_time = time
    if monitor.cut == 0.0 or length < monitor.shortest_period:
        monitor.shortest_period = length
    monitor.cut += 1.0


@kernel
def observe(monitor, figures, time, work, before, u, storage):
    """Take one observation at the start of a step (or at the end of the run).

    Args:
        monitor: numbers, changed.
        figures: the whole of it, changed.
        time: now, in s.
        work: of the loop, with outputs y (m,), constraint values g (p,) and what the law asks
            for, the commanded one (m,).
        before: the input that acted until now (m,); used only if there was an earlier observation.
        u: the input that acts from now on (m,), the commanded one within the actuators' limits.
        storage: V now.
    """
    first = monitor.started == 0.0
    elapsed = 0.0 if first else time - monitor.time
    if first:
        monitor.started = 1.0
        monitor.storage_start = storage
        for k in range(len(figures.worst)):
            figures.worst[k] = -np.inf
    else:
        if elapsed > 0.0:  # the end of a run may be observed again when it goes on
            monitor.steps += 1.0
        rise = storage - monitor.storage
        if rise > monitor.storage_rise:
            monitor.storage_rise = rise
            monitor.storage_rise_time = time
    monitor.time = time
    monitor.storage = storage
    for k in range(len(figures.worst)):
        if work.g[k] > figures.worst[k]:
            figures.worst[k] = work.g[k]
            figures.worst_time[k] = time
    for r in range(len(u)):
        y, last_y, last_u = work.y[r], figures.last_y[r], figures.last_u[r]
        figures.square[r] += 0.5 * elapsed * (last_u * last_u + before[r] * before[r])
        figures.energy[r] += 0.25 * elapsed * (last_u + before[r]) * (last_y + y)
        figures.last_y[r] = y
        figures.last_u[r] = u[r]
        magnitude = abs(work.commanded[r])
        if magnitude > figures.peak[r]:
            figures.peak[r] = magnitude
            figures.peak_time[r] = time
        if u[r] != work.commanded[r] and monitor.saturated == 0.0:
            monitor.saturated = 1.0
            monitor.saturated_time = time
            monitor.saturated_action = r
            monitor.saturated_command = work.commanded[r]
