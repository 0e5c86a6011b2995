"""Faults (:mod:`gne_mj.loops.faults`) in a run whose control periods may end early.

Messages are sent, errors of sensors drawn and estimates corrupted at the clock's own control
instants only, so that all of them mean what they mean without a guard.
"""

from gne_mj.loops.faults import (
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
from gne_mj.loops.guarded import begins, elapse

__all__ = [
    "PREDICTION_KNOWN", "RECORDED", "begin", "begins", "choose", "deliver", "elapse", "keep_apart",
    "measured", "push", "push_apart", "record", "sense", "sense_state",
]  # fmt: skip
