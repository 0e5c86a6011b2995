"""A run without faults: outputs are seen as they are, inputs act as delivered.

A loop is compiled with this module, or with one in its place (:mod:`gne_mj.loops.faults`,
:mod:`gne_mj.loops.faultless_apart`, :mod:`gne_mj.loops.guarded`,
:mod:`gne_mj.loops.guarded_faults`), so that what a run does not use costs nothing.
"""

from gne_mj.loops import functions
from gne_mj.native import copy, kernel

# Whether the law's action follows from the present state alone, whichever step comes next
PREDICTION_KNOWN = True
RECORDED = False  # whether rows have what was seen and what acted


@kernel
def measured(problem):
    """Whether the law has the outputs as they are."""
    return True


@kernel
def begins(clock, now, step):
    """Whether a control period begins with this step, in the held modes."""
    return step % clock.period == 0


@kernel
def elapse(problem, step, work, memory):
    """Move the law's memory over the period that has passed, in the held modes."""
    functions.propagate(problem, work.held, memory, work.scratch)


@kernel
def begin(parts, at, state, memory):
    """Nothing happens but that the outputs are what the law's memory is held at."""
    if parts.clock.mode != 0:
        copy(parts.work.y, parts.work.held)


@kernel
def choose(y, measurement):
    """Of the outputs as they are and as they are seen, those that the law has."""
    return y


@kernel
def sense(problem, work, y, measurement):
    """The outputs (m,) that the law sees: work.y or work.measurement, both given, which it fills.

    Native code returns no arrays but those that it was given as such.
    """
    return y


@kernel
def sense_state(plant, parts, step, state, known, scratch):
    """The flat state as the law has it: the state, or ``known``, filled."""
    return state


@kernel
def keep_apart(problem, place, at, state):
    """Agents are where they are."""
    return True


@kernel
def push_apart(problem, place, at):
    """Nothing is added to work.commanded."""
    return True


@kernel
def deliver(problem, clock, step, work):
    """Fill work.u with the commanded input within the actuators' limits."""
    limit = problem.limit
    for r in range(len(work.u)):
        work.u[r] = min(max(work.commanded[r], -limit[r]), limit[r])


@kernel
def push(problem, clock, step, u, applied):
    """What acts on the plant under the input u (m,): u, or ``applied``, filled."""
    return u


@kernel
def record(parts, step, state, measurement, applied):
    """Nothing to record: outputs and inputs are what they are."""
