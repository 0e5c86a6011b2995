"""A run without faults: outputs are seen as they are, inputs act as delivered.

A loop is compiled with this module or with :mod:`gne_mj.loops.faults`, so that what a run does
not use costs nothing.
"""

from gne_mj.native import copy, kernel

# Whether the law's action follows from the present state alone, whichever step comes next
KNOWN_AHEAD = True


@kernel
def measured(problem):
    """Whether the law has the outputs as they are."""
    return True


@kernel
def begin(channels, problem, clock, step, stage, state, memory, work):
    """Nothing happens but that the outputs are what the law's memory is held at."""
    if clock.mode != 0:
        copy(work.y, work.held)


@kernel
def choose(y, seen):
    """Of the outputs as they are and as they are seen, those that the law has."""
    return y


@kernel
def sense(problem, clock, step, stage, work, y, seen):
    """The outputs (m,) that the law sees: y, or ``seen``, filled."""
    return y


@kernel
def sense_state(plant, problem, channels, clock, step, work, state, known, scratch):
    """The flat state as the law has it: the state, or ``known``, filled."""
    return state


@kernel
def deliver(problem, clock, step, stage, work):
    """Fill work.u with the demand within the actuators' limits."""
    for r in range(len(work.u)):
        work.u[r] = min(max(work.demand[r], -problem.limit[r]), problem.limit[r])


@kernel
def push(problem, clock, step, u, acts):
    """What acts on the plant under the input u (m,): u, or ``acts``, filled."""
    return u


@kernel
def record(channels, problem, clock, step, state, u, work, seen, acts):
    """Nothing to record: outputs and inputs are what they are."""
