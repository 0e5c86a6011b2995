"""A game whose numbers stand still, in the place of :mod:`gne_mj.loops.moving`."""

from gne_mj.native import kernel


@kernel
def to_period_end(parts, time):
    """Nothing changes until then."""
    return True


@kernel
def back(parts, time):
    """Nothing has changed."""
