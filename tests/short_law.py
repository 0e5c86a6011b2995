"""A law with the kernels that mode implicit needs of all, and not those of agents alone."""

from gne_mj.controllers.full_information import (
    action,
    add_pull_slope,
    prepare,
    propagate,
    pull,
    rate,
    settle,
    storage,
)

__all__ = [
    "action", "add_pull_slope", "prepare", "propagate", "pull", "rate", "settle", "storage",
]  # fmt: skip
