"""What laws share that solve quadratic programs (:mod:`gne_mj.quadratic_program`).

All of them look for the input nearest to that of gradient play, -k F(y), among those that keep
constraints in some sense. None has a barrier.
"""

import numpy as np
from numpy.typing import NDArray

from gne_mj import game_functions as games
from gne_mj import quadratic_program
from gne_mj.controllers.rival import Rival
from gne_mj.controllers.settings import GAIN
from gne_mj.controllers.settings import RELAXED as BOUNDS_SOFT
from gne_mj.game_model import Game
from gne_mj.native import kernel
from gne_mj.quadratic_program import QUADRATIC, RELAXED, UNBOUNDED, program_length, solve

SOLVER = -1  # entry of the settings, behind the law's own numbers: DAQP's address


class ProgramLaw(Rival):
    """A rival that solves a quadratic program."""

    def __post_init__(self) -> None:
        super().__post_init__()
        quadratic_program.solver()

    def settings(self, rho: float) -> NDArray[np.float64]:
        """See the base class, and DAQP's address behind these."""
        return np.append(super().settings(rho), quadratic_program.solver())

    def room(self, game: Game) -> float:
        """A program of all inputs; see the base class."""
        return room_of(game.actions, game.constraints_count)


def room_of(unknown: int, rows: int) -> float:
    """How many numbers a program takes, and DAQP for as much again."""
    return 2.0 * program_length(unknown, rows, unknown, 1)


@kernel
def gradient_play(problem, y, out):
    """Fill out (m,) with -k F(y)."""
    games.gradients(problem.data, problem.data.everyone, y, out)
    for a in range(len(y)):
        out[a] *= -problem.settings[GAIN]


@kernel
def linearised(problem, y, values, jacobian):
    """Fill values (p,) with g(y) + t, t the barrier's margin, and jacobian (p, m), which is zero
    before, with dg/dy."""
    data = problem.data
    at = data.offsets
    games.values(data, data.all_constraints, y, values)
    for k in range(len(values)):
        values[k] += data.tightening[k]
        for entry in range(data.member_pointer[k], data.member_pointer[k + 1]):
            i = data.member_index[entry]
            for a in range(at[i], at[i + 1]):
                jacobian[k, a] = games.constraint_gradient(data, k, a, y)


@kernel
def solver_in(problem):
    """DAQP's address."""
    return np.int64(problem.settings[SOLVER])


@kernel
def nearest_direction(problem, program, goal, u):
    """Fill u (m,) with the xi nearest to goal (m,) with A xi <= upper, which is overwritten; not a
    number where there is none. What an action returns."""
    for k in range(len(program.upper)):  # the unknown is xi - goal
        if program.upper[k] < UNBOUNDED:
            for a in range(len(goal)):
                program.upper[k] -= program.matrix[k, a] * goal[a]
    return give(program, solve(solver_in(problem), program, QUADRATIC), goal, u)


@kernel
def give(program, ended, goal, u):
    """Fill u (m,) with goal + x, x the solution; not a number where there is none. What an action
    returns."""
    for a in range(len(u)):
        u[a] = goal[a] + program.x[a] if ended > 0 else np.nan
    return told(ended, u)


@kernel
def told(ended, u):
    """What an action returns whose last program ended so; not a number where it has no solution."""
    if ended <= 0:
        u[0] = np.nan
    return BOUNDS_SOFT if ended == RELAXED else -1
