"""An agent's best response: its own path of minimisers, from its action and from lines through it.

Paths are followed from the profile itself and from the least costs on lines through it
(:mod:`gne_mj.lines`): for an action of one entry that is the whole feasible interval. The best end
counts.
"""

import numpy as np

from gne_mj import game_functions as games
from gne_mj import lines
from gne_mj.native import call_integer, copy, kernel
from gne_mj.solver_memory import FOLLOW

CONVERGED = 0  # see gne_mj.interior_point
TOLERANCE = 1e-12


@kernel
def respond(block, memory, holes, i):
    """Fill memory.best and memory.response with agent i's best response to memory.start.

    Where the set may have ``holes``, the parts of lines beyond them count too.
    """
    data, response, point, y = memory.data, memory.response, memory.point, memory.start
    first, last = data.offsets[i], data.offsets[i + 1]
    own = data.own_index[data.own_pointer[i] : data.own_pointer[i + 1]]
    response.cost, response.found, response.failures = np.inf, 0.0, 0.0
    for a in range(first, last):
        memory.alone[a] = a - first
    copy(y, point.y)
    attempt(block, memory, i, 0.0)
    for line in range(memory.pointer[i], memory.pointer[i + 1], last - first):
        for a in range(first, last):
            memory.direction[a] = memory.lines[line + a - first]
        lines.lowest(data, i, own, holes, y, memory.direction, memory.work.trial.y, response)
        worth = response.line_place != 0.0
        if last - first == 1 and response.found > 0.0:
            # By the lemma a response is only so far from the least cost of its own valley.
            room = 2.0 * len(own) * memory.best_report.rho
            worth = worth and response.line_cost <= response.cost - room
        if worth:
            # A barrier that outweighs what there is to gain might lead back out of the valley.
            gain = response.cost - response.line_cost if response.found > 0.0 else 0.0
            copy(y, point.y)
            for a in range(first, last):
                point.y[a] += response.line_place * memory.direction[a]
            attempt(block, memory, i, max(gain, 0.0) / len(own) if len(own) > 0 else 0.0)
        for a in range(first, last):
            memory.direction[a] = 0.0
    for a in range(first, last):
        memory.alone[a] = -1


@kernel
def attempt(block, memory, i, rho):
    """Follow agent i's own path from point.y, from a rho at most (0 for any); keep the best."""
    response, point, report = memory.response, memory.point, memory.report
    ended = call_integer(memory.functions[FOLLOW], (block, i, 0, rho, 0.0, TOLERANCE))
    if ended != CONVERGED:
        if response.failures == 0.0:
            response.ended = ended
            response.iterations, response.error = report.iterations, report.error
            copy(point.y, memory.failed)
        response.failures += 1.0
        return
    reached = games.cost(memory.data, i, point.y)
    if response.found == 0.0 or reached < response.cost:
        response.cost, response.found = reached, 1.0
        keep(memory, i)


@kernel
def keep(memory, i):
    """Make the point the best one."""
    data, point, best = memory.data, memory.point, memory.best
    report, kept = memory.report, memory.best_report
    for a in range(data.offsets[i], data.offsets[i + 1]):
        best.y[a] = point.y[a]
    for k in range(data.own_pointer[i + 1] - data.own_pointer[i]):
        best.multipliers[k] = point.multipliers[k]
    kept.iterations, kept.error, kept.stationarity = (
        report.iterations, report.error, report.stationarity,
    )  # fmt: skip
    kept.complementarity, kept.rho = report.complementarity, report.rho
