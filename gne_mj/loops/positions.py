"""Where positions stand that follow outputs: the same constraints, evaluated at them.

Where outputs are y = q + tau v, what a set of outputs promises is promised of the positions q too
(docs/positions.md). So they are looked at wherever outputs are.
"""

from gne_mj import game_functions as games
from gne_mj.native import kernel


@kernel
def observe(problem, channels, positions, g, monitor, time, state):
    """Note the constraints' values at the positions of a flat state.

    Before :func:`gne_mj.loops.monitor.observe`: the same instant is not looked at twice, as where a
    piece of a step is taken again.

    Args:
        problem, channels: of the run.
        positions: (m,), overwritten with them.
        g: (p,), overwritten with the constraints' values there.
        monitor: numbers, changed.
        time: in s.
        state: flat.
    """
    if monitor.positions > 0.0 and not time > monitor.time:
        return
    data = problem.data
    states = channels.equilibrium_state.shape[1]
    for r in range(len(positions)):
        positions[r] = state[r * states + channels.position]
    games.values(data, data.all_constraints, positions, g)
    outside = False
    for k in range(len(g)):
        if not g[k] <= 0.0:
            outside = True
        if (monitor.positions == 0.0 and k == 0) or not g[k] <= monitor.positions_worst:
            monitor.positions_worst, monitor.positions_worst_time = g[k], time
            monitor.positions_constraint = k
    monitor.positions += 1.0
    if outside:
        monitor.positions_outside += 1.0
