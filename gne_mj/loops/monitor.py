"""What is measured at every integration step of a run, in one flat array for native code.

The array is a header (entries below), then per constraint its greatest value and when, then per
action the peak of |u| and when, the integral of u^2, the energy, and the last output and input.
All zero means "not started", so that a reset simulation starts afresh.
"""

import numpy as np

from gne_mj.native import kernel

STARTED = 0
EXIT = 1  # one of the codes below
EXIT_TIME = 2
EXIT_AGENT = 3  # whose estimate left; -1 for the true profile
EXIT_CONSTRAINT = 4
EXIT_VALUE = 5
EXIT_STAGE = 6  # 0: at a step's start; more: at a later stage of a step, EXIT_TIME being its time
STEPS = 7  # pieces of divided steps included
TIME = 8  # of the last observation
STORAGE = 9  # V at the last observation
STORAGE_START = 10
STORAGE_RISE = 11  # greatest rise of V from one step to the next
STORAGE_RISE_TIME = 12
SATURATED = 13  # 1 once an input was limited
SATURATED_TIME = 14  # when that was first
SATURATED_ACTION = 15
SATURATED_DEMAND = 16
EXIT_BETWEEN = 17  # 1: the exit was not at a control instant
# Mode implicit
SOLUTIONS = 18  # inputs that were solved for
SOLVER_STEPS = 19  # of Newton's method, in all
MOST_STEPS = 20  # for one input
UNSOLVED = 21  # solutions that are not accurate (though inside)
UNSOLVED_TIME = 22  # when that was first
PREDICTION = 23  # greatest |y - predicted y| at a control instant
PREDICTION_TIME = 24
NOT_MONOTONE = 25  # periods with dy+/du not positive in some channel
NOT_MONOTONE_TIME = 26
# Mode continuous, see gne_mj.loops.division
DIVIDED = 27  # steps that were divided
SMALLEST_STEP = 28  # length in s of the shortest piece of one; 0 if none was divided
HEADER = 29

# STEP_TOO_SMALL: the boundary is so near that even the finest pieces of a step do not do
# FORCES_LOST: MuJoCo has left out forces; EXIT_VALUE says which of its warnings told so
INSIDE, LEFT_SET, ESTIMATE_LEFT, DIVERGED, STEP_TOO_SMALL, FORCES_LOST = range(6)


@kernel
def length(actions, constraints):
    """Length of the flat array."""
    return HEADER + 2 * constraints + 6 * actions


@kernel
def worst_at(constraints):
    """Where the constraints' greatest values start; the times follow them."""
    return HEADER


@kernel
def inputs_at(constraints):
    """Where the inputs' figures start: peak, its time, integral of u^2, energy, last y, last u."""
    return HEADER + 2 * constraints


@kernel
def leave(monitor, code, time, agent, constraint, value, stage):
    """Latch the first exit."""
    if monitor[EXIT] == INSIDE:
        monitor[EXIT] = code
        monitor[EXIT_TIME] = time
        monitor[EXIT_AGENT] = agent
        monitor[EXIT_CONSTRAINT] = constraint
        monitor[EXIT_VALUE] = value
        monitor[EXIT_STAGE] = stage


@kernel
def forget_exit(monitor):
    """Take a latched exit back: the piece of a step that it was seen in is not taken."""
    for entry in range(EXIT, EXIT_STAGE + 1):
        monitor[entry] = 0.0


@kernel
def compare(monitor, time, y, ahead):
    """Note how far the outputs y (m,) are from those predicted for this control instant."""
    for r in range(len(y)):
        distance = abs(y[r] - ahead[r])
        if not distance <= monitor[PREDICTION]:
            monitor[PREDICTION] = distance
            monitor[PREDICTION_TIME] = time


@kernel
def count_solution(monitor, time, steps, accurate, least):
    """Note one solution of mode implicit: Newton steps, accuracy, least secant over slope."""
    monitor[SOLUTIONS] += 1.0
    monitor[SOLVER_STEPS] += steps
    monitor[MOST_STEPS] = max(monitor[MOST_STEPS], steps)
    if not accurate:
        if monitor[UNSOLVED] == 0.0:
            monitor[UNSOLVED_TIME] = time
        monitor[UNSOLVED] += 1.0
    if not least > 0.0:
        if monitor[NOT_MONOTONE] == 0.0:
            monitor[NOT_MONOTONE_TIME] = time
        monitor[NOT_MONOTONE] += 1.0


@kernel
def observe(monitor, time, y, g, demand, before, u, storage):
    """Take one observation at the start of a step (or at the end of the run).

    Args:
        monitor: the flat array, changed.
        time: now, in s.
        y: outputs (m,).
        g: constraint values (p,).
        demand: what the law asks for (m,).
        before: the input that acted until now (m,); used only if there was an earlier observation.
        u: the input that acts from now on (m,), demand within the actuators' limits.
        storage: V now.
    """
    p, m = len(g), len(y)
    first = monitor[STARTED] == 0.0
    elapsed = 0.0 if first else time - monitor[TIME]
    if first:
        monitor[STARTED] = 1.0
        monitor[STORAGE_START] = storage
        for k in range(p):
            monitor[HEADER + k] = -np.inf
    else:
        if elapsed > 0.0:  # the end of a run may be observed again when it goes on
            monitor[STEPS] += 1.0
        rise = storage - monitor[STORAGE]
        if rise > monitor[STORAGE_RISE]:
            monitor[STORAGE_RISE] = rise
            monitor[STORAGE_RISE_TIME] = time
    monitor[TIME] = time
    monitor[STORAGE] = storage
    for k in range(HEADER, HEADER + p):
        value = g[k - HEADER]
        if value > monitor[k]:
            monitor[k] = value
            monitor[k + p] = time
    base = HEADER + 2 * p
    for r in range(m):
        at = base + r  # of the peak; m further on its time, and so on
        last_y, last_u = monitor[at + 4 * m], monitor[at + 5 * m]
        monitor[at + 2 * m] += 0.5 * elapsed * (last_u * last_u + before[r] * before[r])
        monitor[at + 3 * m] += 0.25 * elapsed * (last_u + before[r]) * (last_y + y[r])
        monitor[at + 4 * m] = y[r]
        monitor[at + 5 * m] = u[r]
        magnitude = abs(demand[r])
        if magnitude > monitor[at]:
            monitor[at] = magnitude
            monitor[at + m] = time
        if u[r] != demand[r] and monitor[SATURATED] == 0.0:
            monitor[SATURATED] = 1.0
            monitor[SATURATED_TIME] = time
            monitor[SATURATED_ACTION] = r
            monitor[SATURATED_DEMAND] = demand[r]
