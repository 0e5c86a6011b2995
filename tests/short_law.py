"""A law with the kernels that mode implicit needs of all, and not those of agents alone."""

from gne_mj.controllers.full_information import (
    action,
    add_barrier_free_slope,
    barrier_free,
    memory_outputs,
    prepare,
    propagate,
    rate,
    storage,
)

__all__ = [
    "action",
    "add_barrier_free_slope",
    "barrier_free",
    "memory_outputs",
    "prepare",
    "propagate",
    "rate",
    "storage",
]
