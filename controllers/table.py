"""What the tables ``[systems.NAME.controller]`` have in common; each law's is beside it."""

from abc import abstractmethod
from typing import Annotated, Literal

from pydantic import Field

from gne_mj import graph as graphs
from gne_mj.controllers.law import Law
from gne_mj.game_model import Game
from gne_mj.registry import MODES
from gne_mj.toml_table import Fills, Table


class LawTable(Table):
    """A law and how it acts."""

    mode: Annotated[str, MODES] = Field(
        "continuous",
        description="when it acts: at every stage of the integrator, or once a period and held",
    )
    decentralised: bool = Field(
        False, description="mode implicit: each agent keeps to its share of every bound's slack"
    )

    @abstractmethod
    def build(self, game: Game) -> Law:
        """The law."""


class NetworkTable(LawTable):
    """A law over a communication graph."""

    graph: Annotated[
        Literal["line", "ring", "star", "complete", "printed", "caption"] | list[tuple[int, int]],
        Fills("edges"),
    ] = Field("ring", description="a name, or edges as pairs of agents numbered from 1")

    def network(self, count: int) -> graphs.Graph:
        """The communication graph."""
        if isinstance(self.graph, str):
            return graphs.NAMED[self.graph](count)
        return graphs.Graph(count, tuple((i - 1, j - 1) for i, j in self.graph))
