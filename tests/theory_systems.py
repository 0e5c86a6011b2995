"""Systems and slopes whose guarantees tests look at."""

import coupled_game
import numpy as np
from builders import (
    FIVE,
    V0,
    clock,
    integrators,
    osnr_system,
    pi_cascades,
    robot_state,
    robot_system,
)
from hypothesis import strategies as st

from gne_mj import graph as graphs
from gne_mj.controllers import FullInformation, PartialInformation
from gne_mj.game_model import Game
from gne_mj.games import osnr_game, ten_channels, velocity_game
from gne_mj.system import System
from gne_mj.theory import Slopes

STEP = clock(0.002)


def chain_slopes(agents):
    game = velocity_game(agents, V0, 3.0)
    return Slopes(game, game.box, np.full(agents, V0), feasible=True)


def osnr_slopes(game=None, box=None):
    game = game or osnr_game(**ten_channels())
    box = game.box if box is None else box
    return Slopes(game, box, np.full(game.actions, 0.1), feasible=False)


def partial_robots(gain, graph="ring", **options):
    law = PartialInformation(graphs.NAMED[graph](5), gain)
    return robot_system(robot_state(FIVE), law=law, **options)


def osnr(law, agents=None, **options):
    return osnr_system(agents or pi_cascades(10), law, 0.2, **options)


@st.composite
def monotone_slopes(draw):
    """A random dF/dy with positive definite symmetric part, and whose action each is."""
    agents = draw(st.integers(2, 5))
    rng = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    owner = np.repeat(np.arange(agents), rng.integers(1, 3, agents))
    m = len(owner)
    slope = rng.normal(size=(m, m))
    least = np.linalg.eigvalsh(0.5 * (slope + slope.T))[0]
    return slope + (rng.uniform(0.05, 1.0) - least) * np.eye(m), owner, agents, rng


def coupled(parameter):
    game = Game(
        "coupled", coupled_game, np.array([parameter]), coupled_game.SIZES, [[0, 1, 2]] * 3,
        coupled_game.IN_CONSTRAINT, ("ball", "product"),
    )  # fmt: skip
    state = np.full((4, 1), 0.1)
    return System("coupled", game, integrators(4), FullInformation(), 0.1, state)
