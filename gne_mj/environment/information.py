"""Who may see what: the paper's three information structures, as a learner's observations."""

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from gne_mj.errors import InvalidInput, nearest
from gne_mj.game_model import Game
from gne_mj.graph import Graph

Structure = Literal["full", "partial", "distributed"]
STRUCTURES = ("full", "partial", "distributed")


@dataclass(frozen=True, eq=False)
class Information:
    """What each agent is told, besides its own state.

    Args:
        structure: "full", everything; "partial", the neighbours' outputs, and how far each
            constraint that the agent takes part in is from its bound, which the paper has
            measured; "distributed", the neighbours' outputs, and of those constraints the ones
            that contain nobody else, since an agent works these out from what it hears.
        heard: for each agent the entries of a profile whose values it is told, by owner.
        constraints: for each agent the constraints whose values it is told.
    """

    structure: Structure
    heard: tuple[NDArray[np.int64], ...]
    constraints: tuple[NDArray[np.int64], ...]


def information_of(game: Game, structure: str, graph: Graph | None) -> Information:
    """The structure for a game.

    Args:
        game: which game.
        structure: one of STRUCTURES.
        graph: who hears whom; not looked at where everybody knows everything.

    Raises:
        InvalidInput: another structure, or a graph that is missing or of other agents.
    """
    if structure not in STRUCTURES:
        raise InvalidInput("structure", structure, nearest(str(structure), STRUCTURES))
    agents = range(game.agents)
    if structure == "full":
        hears = [[j for j in agents if j != i] for i in agents]
    elif graph is None:
        raise InvalidInput("graph", None, f"information '{structure}' needs who hears whom")
    elif graph.agents != game.agents:
        raise InvalidInput("graph", f"{graph.agents} agents", f"the game has {game.agents} agents")
    else:
        at, neighbour = graph.data
        hears = [neighbour[at[i] : at[i + 1]].tolist() for i in agents]
    heard, constraints = [], []
    for i in agents:
        heard.append(np.flatnonzero(np.isin(game.agent_of_action, hears[i])))
        own = [k for k, owners in enumerate(game.owned_by) if i in owners]
        if structure == "distributed":
            own = [k for k in own if set(game.in_constraint[k]) <= {i, *hears[i]}]
        constraints.append(np.array(own, dtype=np.int64))
    return Information(structure, tuple(heard), tuple(constraints))  # type: ignore[arg-type]
