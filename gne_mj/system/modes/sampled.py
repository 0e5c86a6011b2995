"""Mode ``sampled``: the law is evaluated once in a control period, and its input held.

Estimates and z move exactly over the period, by the outputs at its start. Nothing is promised: a
period that is too long for the barrier's push leaves the set.
"""

from gne_mj.loops.ode import SAMPLED
from gne_mj.system.modes.mode import Mode


class Sampled(Mode):
    """See the module."""

    name = "sampled"
    native = SAMPLED
