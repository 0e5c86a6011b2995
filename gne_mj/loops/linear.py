"""Vectors, for native loops that allocate nothing."""

from gne_mj.native import kernel


@kernel
def add_multiple(scale, source, target):
    """target += scale * source, over the length of target."""
    for r in range(len(target)):
        target[r] += scale * source[r]
