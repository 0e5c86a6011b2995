"""What moves the memory of a law that has none, where a loop keeps something behind it."""

from gne_mj.native import kernel


@kernel
def rate(problem, y, memory, out):
    """Nothing moves."""


@kernel
def propagate(problem, y, memory, scratch):
    """Nothing moves."""


@kernel
def storage(problem, memory):
    """Nothing is stored."""
    return 0.0
