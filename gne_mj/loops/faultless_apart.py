"""A run without faults of agents that keep apart."""

from gne_mj.loops.faultless import (
    RECORDED,
    begin,
    begins,
    choose,
    deliver,
    elapse,
    measured,
    push,
    record,
    sense,
    sense_state,
)
from gne_mj.loops.functions import keep_apart, push_apart

__all__ = [
    "PREDICTION_KNOWN", "RECORDED", "begin", "begins", "choose", "deliver", "elapse", "keep_apart",
    "measured", "push", "push_apart", "record", "sense", "sense_state",
]  # fmt: skip

# Half-planes are renewed at every piece of a step
PREDICTION_KNOWN = False
