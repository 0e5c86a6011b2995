"""A game whose numbers move, in mode implicit: costs and constraints are those of the period's end.

The outputs of that time are what is solved for, so that they are inside the set as it is then. The
search begins at the present outputs, which must be inside it too: a bound that moves past them
within one period ends the run.
"""

from gne_mj import game_functions as games
from gne_mj.controllers.settings import RHO
from gne_mj.loops import functions
from gne_mj.loops import monitor as watch
from gne_mj.native import kernel


@kernel
def to_period_end(parts, time):
    """Bring game and penalty to the end of the period that begins at a time in s.

    Returns False, with the exit latched, if a bound moves past the present outputs meanwhile.
    """
    problem, clock, work = parts.problem, parts.clock, parts.work
    end = time + clock.period * clock.h
    work.now.penalty = functions.penalty(problem, end, problem.settings[RHO])
    data = problem.data
    for k in range(len(work.g)):
        value = games.constraint(data, k, work.y) + data.tightening[k]
        if not value < 0.0:
            watch.leave(parts.monitor, watch.MOVED_PAST, time, -1, k, value, 0)
            back(parts, time)
            return False
    return True


@kernel
def back(parts, time):
    """Bring them back to a time in s, at which the rest of the step looks at the game."""
    problem = parts.problem
    parts.work.now.penalty = functions.penalty(problem, time, problem.settings[RHO])
