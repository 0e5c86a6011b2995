"""The tables ``[[systems.NAME.faults]]``, one a kind of fault, and ``[systems.NAME.margin]``."""

from typing import Any, Literal

import numpy as np
from pydantic import Field

from gne_mj import faults
from gne_mj.errors import InvalidInput
from gne_mj.game import Game
from gne_mj.margins import Disturbance, influence, tightening
from gne_mj.plants.agents import Agents
from gne_mj.scenario_tables.table import PerAgent, Table, per_agent


class _FaultTable(Table):
    agents: list[int] | None = Field(None, description="numbered from 1; all if left out")
    start: float = Field(0.0, ge=0, description="s")
    end: float | None = Field(None, gt=0, description="s; the run's end if left out")

    @property
    def common(self) -> dict[str, Any]:
        """What all faults are given."""
        agents = None if self.agents is None else tuple(i - 1 for i in self.agents)
        return {
            "agents": agents,
            "start": self.start,
            "end": np.inf if self.end is None else self.end,
        }


class PushTable(_FaultTable):
    """A force besides the input."""

    type: Literal["push"]
    force: float = Field(description="in the input's unit")
    profile: Literal["constant", "sine", "square", "random"] = "constant"
    period: float = Field(1.0, gt=0, description="s, of 'sine' and 'square'")

    def build(self) -> faults.Fault:
        """The fault."""
        return faults.Push(
            **self.common, force=self.force, profile=self.profile, period=self.period
        )


class SaturationTable(_FaultTable):
    """Actuators that deliver less."""

    type: Literal["saturation"]
    limit: float = Field(ge=0, description="greatest |u| meanwhile")

    def build(self) -> faults.Fault:
        """The fault."""
        return faults.Saturation(**self.common, limit=self.limit)


class NoiseTable(_FaultTable):
    """Outputs read with noise."""

    type: Literal["noise"]
    amplitude: float = Field(ge=0, description="greatest error, uniform")

    def build(self) -> faults.Fault:
        """The fault."""
        return faults.Noise(**self.common, amplitude=self.amplitude)


class BiasTable(_FaultTable):
    """Outputs read with a constant error."""

    type: Literal["bias"]
    offset: float = Field(description="what is read less what is")

    def build(self) -> faults.Fault:
        """The fault."""
        return faults.Bias(**self.common, offset=self.offset)


class SensorDelayTable(Table):
    """All sensors read what was some periods ago."""

    type: Literal["sensor-delay"]
    periods: int = Field(ge=0, description="control periods")

    def build(self) -> faults.Fault:
        """The fault."""
        return faults.SensorDelay(periods=self.periods)


class _LinksTable(_FaultTable):
    edges: list[tuple[int, int]] | None = Field(
        None, description="of the graph, pairs numbered from 1; all if agents are left out too"
    )

    @property
    def common(self) -> dict[str, Any]:
        """What all faults of messages are given."""
        edges = None if self.edges is None else tuple((i - 1, j - 1) for i, j in self.edges)
        return {**super().common, "edges": edges}


class MessageLossTable(_LinksTable):
    """Messages that do not arrive."""

    type: Literal["message-loss"]
    probability: float = Field(ge=0, le=1)

    def build(self) -> faults.Fault:
        """The fault."""
        return faults.MessageLoss(**self.common, probability=self.probability)


class MessageDelayTable(_LinksTable):
    """Messages that arrive late."""

    type: Literal["message-delay"]
    periods: int = Field(ge=0, description="control periods")

    def build(self) -> faults.Fault:
        """The fault."""
        return faults.MessageDelay(**self.common, periods=self.periods)


class SilenceTable(_LinksTable):
    """Edges or agents that go silent."""

    type: Literal["silence"]

    def build(self) -> faults.Fault:
        """The fault."""
        return faults.Silence(**self.common)


class CorruptionTable(_FaultTable):
    """Estimates shifted once, at the start."""

    type: Literal["estimate-corruption"]
    amplitude: float = Field(ge=0, description="greatest shift, uniform")

    def build(self) -> faults.Fault:
        """The fault."""
        return faults.Corruption(**self.common, amplitude=self.amplitude)


FaultTable = (
    PushTable
    | SaturationTable
    | NoiseTable
    | BiasTable
    | SensorDelayTable
    | MessageLossTable
    | MessageDelayTable
    | SilenceTable
    | CorruptionTable
)


class MarginTable(Table):
    """Bounds on what is not modelled, from which the barrier's tightening follows."""

    push: PerAgent = Field(0.0, description="greatest force besides the input, in its unit")
    noise: PerAgent = Field(0.0, description="greatest error of an output")
    delay: int = Field(0, ge=0, description="of the sensors, in control periods")

    def disturbance(self, game: Game) -> Disturbance:
        """The bounds, for each channel."""
        each = [
            np.repeat(per_agent(f"margin.{key}", getattr(self, key), game.agents), game.sizes)
            for key in ("push", "noise")
        ]
        return Disturbance(each[0], each[1], self.delay)

    def tightened(
        self, game: Game, agents: Agents, timestep: float, integrator: str, period: int
    ) -> Game:
        """The game with a barrier that leaves room for such disturbances."""
        if integrator == "rosenbrock":
            raise InvalidInput("margin", "given", "margins are for the held modes")
        bound = self.disturbance(game)
        effect = influence(agents, timestep, integrator, period, bound.delay)
        return game.tightened(tightening(game, effect.of(bound)))
