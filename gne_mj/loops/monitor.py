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
EXIT_STAGE = 6  # 0: at a step's start; more: at a stage within the step that began then
STEPS = 7
TIME = 8  # of the last observation
STORAGE = 9  # V at the last observation
STORAGE_START = 10
STORAGE_RISE = 11  # greatest rise of V from one step to the next
STORAGE_RISE_TIME = 12
SATURATED = 13  # 1 once an input was limited
SATURATED_TIME = 14  # when that was first
SATURATED_ACTION = 15
SATURATED_DEMAND = 16
HEADER = 17

INSIDE, LEFT_SET, ESTIMATE_LEFT, DIVERGED = 0, 1, 2, 3


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
    worst, when = monitor[HEADER : HEADER + p], monitor[HEADER + p : HEADER + 2 * p]
    base = HEADER + 2 * p
    peak, peak_time = monitor[base : base + m], monitor[base + m : base + 2 * m]
    square, energy = monitor[base + 2 * m : base + 3 * m], monitor[base + 3 * m : base + 4 * m]
    last_y, last_u = monitor[base + 4 * m : base + 5 * m], monitor[base + 5 * m : base + 6 * m]
    if first:
        monitor[STARTED] = 1.0
        monitor[STORAGE_START] = storage
        for k in range(p):
            worst[k] = -np.inf
    else:
        elapsed = time - monitor[TIME]
        if elapsed > 0.0:  # the end of a run may be observed again when it goes on
            monitor[STEPS] += 1.0
        rise = storage - monitor[STORAGE]
        if rise > monitor[STORAGE_RISE]:
            monitor[STORAGE_RISE] = rise
            monitor[STORAGE_RISE_TIME] = time
        for r in range(m):
            square[r] += 0.5 * elapsed * (last_u[r] * last_u[r] + before[r] * before[r])
            energy[r] += 0.25 * elapsed * (last_u[r] + before[r]) * (last_y[r] + y[r])
    monitor[TIME] = time
    monitor[STORAGE] = storage
    for k in range(p):
        if g[k] > worst[k]:
            worst[k] = g[k]
            when[k] = time
    for r in range(m):
        magnitude = abs(demand[r])
        if magnitude > peak[r]:
            peak[r] = magnitude
            peak_time[r] = time
        if u[r] != demand[r]:
            if monitor[SATURATED] == 0.0:
                monitor[SATURATED_TIME] = time
                monitor[SATURATED_ACTION] = r
                monitor[SATURATED_DEMAND] = demand[r]
            monitor[SATURATED] = 1.0
        last_y[r] = y[r]
        last_u[r] = u[r]
