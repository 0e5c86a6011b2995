"""What the interior-point method reads of a game and works on, reached by one address.

One block of arrays (:mod:`gne_mj.parameter_block`) is made once for a game; a call then hands over
an address and some numbers, and allocates nothing.
"""

from typing import Annotated, NamedTuple

import numpy as np

from gne_mj.game_model import Game, GameData
from gne_mj.native import kernel
from gne_mj.numbers import Numbers
from gne_mj.primal_dual import Free, Iterate, NewtonScratch
from gne_mj.records import fresh, in_numbers, in_parameter_block

FOLLOW = 0  # entry of ``functions``: the path of equilibria, gne_mj.interior_point
# Random lines for each entry of an action of several, on which a best response is looked for
RANDOM_LINES = 4


class Sizes(NamedTuple):
    """What a game is like, in whole numbers."""

    actions: int  # m
    half_band: int  # of Newton's matrix
    holes: int  # 1: the set is not declared convex


class Report(Numbers):
    """How a path was followed."""

    iterations: float
    error: float
    stationarity: float
    complementarity: float
    rho: float


class Response(Numbers):
    """How an agent's best response was found."""

    cost: float  # of the best one
    found: float  # 1 if there is one
    failures: float  # attempts that found none
    ended: float  # and of the first of these how it ended, in how many steps, with what error
    iterations: float
    error: float
    line_cost: float  # least on the last line that was looked at, and where, see gne_mj.lines
    line_place: float


class SolverMemory(NamedTuple):
    """A game's data and the method's arrays."""

    sizes: Annotated[np.ndarray, "n", int]  # those of Sizes
    functions: Annotated[np.ndarray, "n", int]  # addresses
    data: GameData
    everyone: Free
    alone: Annotated[np.ndarray, "m", int]  # the position of one agent's actions; -1 between uses
    start: Annotated[np.ndarray, "m"]  # the profile that is responded to
    point: Iterate
    report: Report
    best: Iterate  # response so far, and its report
    best_report: Report
    failed: Annotated[np.ndarray, "m"]  # where the first attempt that failed ended
    response: Response
    direction: Annotated[np.ndarray, "m"]  # of a line; zero between uses
    # lines of agent i from pointer[i] on, each as many numbers as its action
    lines: Annotated[np.ndarray, "total"]
    pointer: Annotated[np.ndarray, "N + 1", int]
    work: NewtonScratch


sizes_in = in_numbers(Sizes, 0)
memory_in = in_parameter_block(SolverMemory)


@kernel
def free_in(memory, agent):
    """Everyone, or one agent alone; -1 stands for everyone."""
    data = memory.data
    agents, constraints = memory.everyone.agents[:], memory.everyone.constraints[:]
    position = memory.everyone.position
    if agent >= 0:
        agents = data.everyone[agent : agent + 1]
        constraints = data.own_index[data.own_pointer[agent] : data.own_pointer[agent + 1]]
        position = memory.alone
    return Free(agents, constraints, position)


def solver_memory(game: Game, position: np.ndarray, half_band: int, follow: int) -> SolverMemory:
    """Fresh memory for a game.

    Args:
        game: which.
        position, half_band: of Newton's matrix, as :func:`gne_mj.equilibrium.order` finds them.
        follow: address of the function that follows a path.
    """
    m, p = game.actions, game.constraints_count
    own = np.asarray(game.sizes)
    # an action of one entry has one line, others lines along each entry and random ones besides
    rows = np.where(own > 1, (1 + RANDOM_LINES) * own, own)
    pointer = np.concatenate([[0], np.cumsum(rows * own)])
    sizes = Sizes(m, half_band, int(game.constraint_class is None))
    made: SolverMemory = fresh(
        SolverMemory, n=m * (3 * half_band + 1), m=m, q=p, p=p, N=game.agents,
        entries=len(game.actions_in_constraints[1]), total=pointer[-1],
    )  # fmt: skip
    made.alone[:] = -1
    made.work.curved[:] = game.constraint_class != "affine"
    return made._replace(
        sizes=np.array(sizes, dtype=np.int64),
        functions=np.array([follow], dtype=np.int64),
        data=game.data,
        everyone=Free(game.data.everyone, game.data.all_constraints, position),
        pointer=pointer.astype(np.int64),
    )


def draw_lines(memory: SolverMemory) -> None:
    """Fill the lines on which best responses are looked for: the same ones for each game."""
    at = memory.data.offsets
    for i in range(len(at) - 1):
        own = int(at[i + 1] - at[i])
        lines = np.eye(own)
        if own > 1:
            random = np.random.default_rng(i).normal(size=(RANDOM_LINES * own, own))
            lines = np.concatenate([lines, random])
        memory.lines[memory.pointer[i] : memory.pointer[i + 1]] = lines.ravel()
