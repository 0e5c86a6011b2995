"""The tables ``[systems.NAME.controller]``, one an information structure."""

from typing import Annotated, Any, Literal

from pydantic import Field

from gne_mj import graph as graphs
from gne_mj.controllers import FullInformation, FullyDistributed, Law, PartialInformation
from gne_mj.game import Game
from gne_mj.scenario_tables.table import Fills, Table
from gne_mj.user_files import load_law


class _ControllerTable(Table):
    mode: Literal["continuous", "sampled", "implicit"] = "continuous"
    decentralised: bool = Field(
        False, description="mode implicit: each agent keeps to its share of every bound's slack"
    )


class FullController(_ControllerTable):
    """[eq:nonlinFIfeedback]"""

    information: Literal["full"]

    def build(self, game: Game) -> Law:
        """The law."""
        return FullInformation()


class _NetworkController(_ControllerTable):
    graph: Annotated[
        Literal["line", "ring", "complete", "printed", "caption"] | list[tuple[int, int]],
        Fills("edges"),
    ] = Field("ring", description="a name, or edges as pairs of agents numbered from 1")

    def network(self, count: int) -> graphs.Graph:
        """The communication graph."""
        if isinstance(self.graph, str):
            return graphs.NAMED[self.graph](count)
        return graphs.Graph(count, tuple((i - 1, j - 1) for i, j in self.graph))


class PartialController(_NetworkController):
    """[eq:nonlinearPIFeedback]"""

    information: Literal["partial"]
    coupling: float = Field(1.0, gt=0, description="c; the paper has 1")
    time_constant: float = Field(1.0, gt=0, description="tau of the estimates in s; the paper's 1")

    def build(self, game: Game) -> Law:
        """The law."""
        return PartialInformation(self.network(game.agents), self.coupling, self.time_constant)


class DistributedController(_NetworkController):
    """[eq:CenterFeedback]"""

    information: Literal["distributed"]
    epsilon: float = Field(gt=0, description="time constant of estimates and z in s")
    gain: float = Field(1.0, gt=0, description="k")

    def build(self, game: Game) -> Law:
        """The law."""
        return FullyDistributed(self.network(game.agents), self.epsilon, self.gain)


class CustomController(_NetworkController):
    """A law of the user's own."""

    information: Literal["custom"]
    file: Annotated[str, Fills("path")] = Field(
        description="Python file that defines law(game, graph, ...) or action(...)"
    )
    parameters: dict[str, Any] = Field({}, description="handed to it")

    def build(self, game: Game) -> Law:
        """The law."""
        return load_law(self.file, game, self.network(game.agents), self.parameters)
