"""The law as its formula reads, evaluated at what is seen now: modes continuous and sampled.

A module for acting (this, :mod:`gne_mj.loops.joint` or :mod:`gne_mj.loops.local`) has
``solver_length`` and ``act``.
"""

from gne_mj.loops.feedback import explicit_law
from gne_mj.native import kernel


def solver_length(actions: int, constraints: int, entries: int, states: int, b: int) -> int:
    """Entries of ``work.solver``: none."""
    return 0


@kernel
def act(
    acting, faults, plant, context, agent, law, game, problem, channels, clock, time, step, stage,
    state, memory, work, monitor,
):  # fmt: skip
    """Fill work.demand; False, with the exit latched, if the law has no action there."""
    seen = faults.sense(game, problem, clock, step, stage, work, work.y, work.seen)
    return explicit_law(law, game, problem, time, stage, seen, memory, work, monitor)
