"""Runs that go on outside the set, under laws that have an action there.

With ``simulation.on_exit = "continue"`` such a run does not end where a constraint is violated: how
far outside it is, how long and how often, is noted at every step in place of that. Nothing here is
called while outputs are inside.
"""

import numpy as np

from gne_mj.controllers.settings import GOES_ON, OUTSIDE
from gne_mj.native import kernel


@kernel
def goes_on(problem, time, stage, work, monitor):
    """Whether a run goes on whose outputs are not inside, work.g being given.

    Args:
        problem: of the run.
        time: in s.
        stage: of the integrator's step; 0 at its start, where what is seen is noted.
        work: of the loop.
        monitor: numbers, changed at a step's start.
    """
    if problem.settings[OUTSIDE] < GOES_ON:
        return False
    which, largest = -1, -np.inf
    for k in range(len(work.g)):
        value = work.g[k]
        if not np.isfinite(value):
            return False
        if value > largest:
            which, largest = k, value
    if stage == 0:
        note(monitor, time, which, largest)
    return True


@kernel
def note(monitor, time, which, violation):
    """Note that constraint ``which`` is the most violated one at a step's start, by that much.

    A step's end may be noted before the next one's start, and a run's end again when it goes on:
    what was noted of the same time adds nothing. The integral is by the trapezoidal rule from one
    step to the next, those in which a run goes outside included; of those in which it comes back,
    neither time nor integral is counted.
    """
    last, before = max(monitor.time, monitor.outside_time), 0.0
    if monitor.exits > 0.0 and monitor.outside_time >= monitor.time:
        before = monitor.outside_last
    else:
        if monitor.exits == 0.0:
            monitor.outside_first = time
            monitor.outside_constraint = which
            monitor.outside_value = violation
        monitor.exits += 1.0
    elapsed = time - last
    monitor.outside_for += elapsed
    monitor.outside_integral += 0.5 * elapsed * (before + violation)
    monitor.outside_time = time
    monitor.outside_last = violation
