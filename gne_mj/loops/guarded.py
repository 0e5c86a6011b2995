"""A run without faults whose control periods may end early (:mod:`gne_mj.loops.guard`)."""

from gne_mj.loops import functions
from gne_mj.loops.faultless import (
    PREDICTION_KNOWN,
    RECORDED,
    begin,
    choose,
    deliver,
    keep_apart,
    measured,
    push,
    push_apart,
    record,
    sense,
    sense_state,
)
from gne_mj.native import kernel

__all__ = [
    "PREDICTION_KNOWN", "RECORDED", "begin", "begins", "choose", "deliver", "elapse", "keep_apart",
    "measured", "push", "push_apart", "record", "sense", "sense_state",
]  # fmt: skip


@kernel
def begins(clock, now, step):
    """Whether a control period begins with this step: where the last one was found to end."""
    return step >= now.next_instant


@kernel
def elapse(problem, step, work, memory):
    """Move the law's memory over the period that has passed, by a propagator of one step."""
    for _ in range(int(step - work.now.memory_step)):
        functions.propagate(problem, work.held, memory, work.scratch)
