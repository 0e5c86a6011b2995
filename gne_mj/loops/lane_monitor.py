"""The monitor's observation of eight runs at once: :func:`gne_mj.loops.monitor.observe` in lanes.

It comes when a step stands, of what was seen at its start, for those runs that have taken it.
"""

import numpy as np

from gne_mj.lanes import where
from gne_mj.native import kernel


@kernel
def observe(figures, time, work, asked, inputs, storage, runs):
    """Take one observation of the lanes in the mask ``runs``.

    Args:
        figures: the monitor, changed.
        time: in s, of the step's start.
        work: of the loop; its stages' first rows have the outputs and constraint values then.
        asked: (m,) what the law asked for.
        inputs: that until now and from now on, (m,) each, within the actuators' limits.
        storage: V.
        runs: which have taken the step.
    """
    monitor, y, g = figures.numbers, work.stages.y, work.stages.g
    before, u = inputs
    first = runs & (monitor.started == 0.0)
    later = runs & (not first)
    elapsed = where(first, 0.0, time - monitor.time)
    rise = storage - monitor.storage
    monitor.started = where(runs, 1.0, monitor.started)
    monitor.storage_start = where(first, storage, monitor.storage_start)
    monitor.steps = where(later & (elapsed > 0.0), monitor.steps + 1.0, monitor.steps)
    rising = later & (rise > monitor.storage_rise)
    monitor.storage_rise = where(rising, rise, monitor.storage_rise)
    monitor.storage_rise_time = where(rising, time, monitor.storage_rise_time)
    monitor.time = where(runs, time, monitor.time)
    monitor.storage = where(runs, storage, monitor.storage)
    for k in range(len(figures.worst)):
        worst = where(first, -np.inf, figures.worst[k])
        worse = runs & (g[k] > worst)
        figures.worst[k] = where(worse, g[k], worst)
        figures.worst_time[k] = where(worse, time, figures.worst_time[k])
    for r in range(len(u)):
        last_y, last_u = figures.last_y[r], figures.last_u[r]
        square = figures.square[r] + 0.5 * elapsed * (last_u * last_u + before[r] * before[r])
        energy = figures.energy[r] + 0.25 * elapsed * (last_u + before[r]) * (last_y + y[r])
        figures.square[r] = where(runs, square, figures.square[r])
        figures.energy[r] = where(runs, energy, figures.energy[r])
        figures.last_y[r] = where(runs, y[r], last_y)
        figures.last_u[r] = where(runs, u[r], last_u)
        magnitude = abs(asked[r])
        higher = runs & (magnitude > figures.peak[r])
        figures.peak[r] = where(higher, magnitude, figures.peak[r])
        figures.peak_time[r] = where(higher, time, figures.peak_time[r])
        limited = runs & (u[r] != asked[r]) & (monitor.saturated == 0.0)
        monitor.saturated = where(limited, 1.0, monitor.saturated)
        monitor.saturated_time = where(limited, time, monitor.saturated_time)
        monitor.saturated_action = where(limited, 1.0 * r, monitor.saturated_action)
        monitor.saturated_command = where(limited, asked[r], monitor.saturated_command)
