"""What the tables ``[systems.NAME.controller]`` have in common; each law's is beside it."""

from abc import abstractmethod
from collections.abc import Mapping
from types import MappingProxyType
from typing import Annotated, ClassVar, Literal

from pydantic import Field

from gne_mj.changing_graph import ChangingGraph, disc, switching
from gne_mj.controllers.keepers import fewest, given, readers
from gne_mj.controllers.kept import Kept
from gne_mj.controllers.law import Law
from gne_mj.errors import InvalidInput
from gne_mj.game_model import Game
from gne_mj.graph import NAMED, Graph
from gne_mj.registry import MODES
from gne_mj.toml_table import ACTION, Fills, Table, Unit


class LawTable(Table):
    """A law and how it acts.

    Attributes:
        tuned: its gains, each with the values that a comparison of laws may choose among; at most
            three of its keys, or dotted keys of the system as ``barrier.rho``.
    """

    tuned: ClassVar[Mapping[str, tuple[float, ...]]] = MappingProxyType({})

    mode: Annotated[str, MODES] = Field(
        "continuous",
        description="when it acts: at every stage of the integrator, or once a period and held",
    )
    decentralised: bool = Field(
        False, description="mode implicit: each agent keeps to its share of every bound's slack"
    )
    between: Literal["watched", "guarded"] = Field(
        "watched",
        description="between control instants: every step is watched, or a period of modes implicit"
        " and sampled is cut before it leads outside",
    )
    feed_forward: bool = Field(
        False, description="add the input that an equilibrium which moves needs to be followed"
    )

    observer: float = Field(
        0.0,
        ge=0,
        le=1,
        description="mode implicit: gain of each agent's observer of loads, the part of what was"
        " not predicted that it takes for one; 0: none",
    )
    compensation: bool = Field(
        False,
        description="mode implicit, MJCF robots: add the input that holds the outputs against what"
        " the files have of gravity, drag and friction, so that these do not shift the equilibrium",
    )

    @abstractmethod
    def build(self, game: Game) -> Law:
        """The law."""


class HeldTable(LawTable):
    """A law that acts once a control period."""

    mode: Annotated[str, MODES] = Field("sampled", description="only 'sampled': once a period")


GraphKey = Literal["line", "ring", "star", "complete", "printed", "caption"] | list[tuple[int, int]]


class SwitchingTable(Table):
    """One graph after the other, over and over."""

    type: Literal["switching"]
    graphs: list[GraphKey] = Field(description="each a name or edges, and connected")
    every: Annotated[float | list[float], Unit("s", "positive, whole steps or control periods")] = (
        Field(description="how long each of them is there: one number, or one each")
    )
    order: Literal["given", "random"] = Field(
        "given", description="'random': the next one is drawn by simulation.seed"
    )

    def build(self, count: int) -> Graph:
        """The graph."""
        return switching(
            [_fixed(each, count) for each in self.graphs],
            self.every,
            random=self.order == "random",
        )


class DiscTable(Table):
    """Agents hear those within a radius."""

    type: Literal["disc"]
    radius: Annotated[float, Unit("m")] = Field(gt=0, description="how far agents hear each other")
    interval: Annotated[float, Unit("s")] = Field(
        0.1, gt=0, description="how often distances are looked at"
    )

    def build(self, count: int) -> Graph:
        """The graph."""
        return disc(count, self.radius, self.interval)


class NetworkTable(LawTable):
    """A law over a communication graph."""

    graph: Annotated[
        GraphKey | Annotated[SwitchingTable | DiscTable, Field(discriminator="type")],
        Fills("edges"),
        Fills(""),
    ] = Field(
        "ring", description="a name, edges as pairs of agents numbered from 1, or one that changes"
    )

    def network(self, count: int) -> Graph:
        """The communication graph."""
        if isinstance(self.graph, Table):
            return self.graph.build(count)
        return _fixed(self.graph, count)


def _fixed(given: GraphKey, count: int) -> Graph:
    if isinstance(given, str):
        return NAMED[given](count)
    return Graph(count, tuple((i - 1, j - 1) for i, j in given))


class EventTable(Table):
    """Agents send when their triggers fire, at most once a control period."""

    type: Literal["event"]
    sigma: float = Field(
        0.0, ge=0, le=1e9, description="share of the disagreement that a message may be off by"
    )
    threshold: Annotated[float, Unit(ACTION)] = Field(
        ge=0, le=1e9, description="how far what was sent last may be off besides, at the start"
    )
    decay: Annotated[float, Unit("1/s")] = Field(
        0.0, ge=0, le=1e9, description="a: the threshold falls as exp(-a t)"
    )


class EstimatesTable(NetworkTable):
    """A law whose agents keep estimates of one another."""

    communication: Annotated[EventTable | None, Fills("")] = Field(
        None,
        description="modes sampled and implicit: when agents send what they know to neighbours;"
        " once a control period if left out",
    )

    estimates: Literal["all", "needed"] | list[list[int]] = Field(
        "all",
        description="of whom agents keep estimates: all, those that costs (and barriers at"
        " estimates) need and what must be passed on of them, or a list of agents numbered from 1"
        " for each agent",
    )

    def kept_of(self, game: Game, graph: Graph, *, constraints: bool) -> Kept | None:
        """What agents keep; None where that is everything.

        Args:
            game: what is played.
            graph: over which agents communicate.
            constraints: whether agents' own constraints are at estimates too.

        Raises:
            InvalidInput: lists of one's own that do not do.
        """
        if self.estimates == "all":
            return None
        if isinstance(graph, ChangingGraph):
            raise InvalidInput(
                "estimates",
                self.estimates,
                "who must pass on what changes with the graph: it must be 'all' over a graph that"
                " changes",
            )
        wanted = readers(game.data, constraints=constraints)
        if self.estimates == "needed":
            keepers = fewest(graph, wanted)
        else:
            keepers = given(graph, wanted, [[j - 1 for j in row] for row in self.estimates])
        return None if keepers.everyone else Kept(graph, game.data.offsets, keepers)
