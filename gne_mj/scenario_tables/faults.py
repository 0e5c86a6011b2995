"""The tables ``[[systems.NAME.faults]]``, one a kind of fault, and ``[systems.NAME.margin]``."""

from typing import Annotated, ClassVar, Literal

import numpy as np
from pydantic import Field

from gne_mj import faults
from gne_mj.game_model import Game
from gne_mj.margins import Disturbance
from gne_mj.registry import FAULTS
from gne_mj.toml_table import ACTION, INPUT, PerAgent, Table, Unit, per_agent


class FaultTable(Table):
    """A fault."""

    fault: ClassVar[type[faults.Fault]]

    def build(self) -> faults.Fault:
        """The fault, its agents and edges numbered from 0."""
        given = self.model_dump(exclude={"type"}, exclude_none=True)
        if "agents" in given:
            given["agents"] = tuple(i - 1 for i in given["agents"])
        if "axis" in given:
            given["axis"] -= 1
        if "edges" in given:
            given["edges"] = tuple((i - 1, j - 1) for i, j in given["edges"])
        return self.fault(**given)


class _SomeTable(FaultTable):
    agents: list[int] | None = Field(
        None, min_length=1, description="numbered from 1; all if left out"
    )
    start: Annotated[float, Unit("s")] = Field(0.0, ge=0, description="from when")
    end: Annotated[float | None, Unit("s", "> start")] = Field(
        None, gt=0, description="until when; the run's end if left out"
    )


@FAULTS.register
class PushTable(_SomeTable):
    """A force besides the input."""

    fault = faults.Push
    type: Literal["push"]
    force: Annotated[float, Unit(INPUT)] = Field(description="its size, with its sign")
    axis: int | None = Field(
        None, ge=1, description="which entry of the agents' actions; all if left out"
    )
    profile: Literal["constant", "sine", "square", "random"] = Field(
        "constant", description="over time; 'random' is anew at every step, uniform up to force"
    )
    period: Annotated[float, Unit("s")] = Field(1.0, gt=0, description="of 'sine' and 'square'")


@FAULTS.register
class SaturationTable(_SomeTable):
    """Actuators that deliver less."""

    fault = faults.Saturation
    type: Literal["saturation"]
    limit: Annotated[float, Unit(INPUT)] = Field(ge=0, description="greatest |u| meanwhile")


@FAULTS.register
class NoiseTable(_SomeTable):
    """Outputs read with noise."""

    fault = faults.Noise
    type: Literal["noise"]
    amplitude: Annotated[float, Unit(ACTION)] = Field(ge=0, description="greatest error, uniform")


@FAULTS.register
class BiasTable(_SomeTable):
    """Outputs read with a constant error."""

    fault = faults.Bias
    type: Literal["bias"]
    offset: Annotated[float, Unit(ACTION)] = Field(description="what is read less what is")


@FAULTS.register
class SensorDelayTable(FaultTable):
    """All sensors read what was some periods ago."""

    fault = faults.SensorDelay
    type: Literal["sensor-delay"]
    periods: Annotated[int, Unit("control periods")] = Field(ge=0, description="how late")


class _LinksTable(_SomeTable):
    edges: list[tuple[int, int]] | None = Field(
        None, description="of the graph, pairs numbered from 1; all if agents are left out too"
    )


@FAULTS.register
class MessageLossTable(_LinksTable):
    """Messages that do not arrive."""

    fault = faults.MessageLoss
    type: Literal["message-loss"]
    probability: float = Field(ge=0, le=1, description="that a message is lost")


@FAULTS.register
class MessageDelayTable(_LinksTable):
    """Messages that arrive late."""

    fault = faults.MessageDelay
    type: Literal["message-delay"]
    periods: Annotated[int, Unit("control periods")] = Field(ge=0, description="how late")


@FAULTS.register
class SilenceTable(_LinksTable):
    """Edges or agents that go silent."""

    fault = faults.Silence
    type: Literal["silence"]


@FAULTS.register
class CorruptionTable(FaultTable):
    """Estimates shifted once, at the start."""

    fault = faults.Corruption
    type: Literal["estimate-corruption"]
    agents: list[int] | None = Field(
        None, min_length=1, description="numbered from 1; all if left out"
    )
    start: Annotated[float, Unit("s")] = Field(0.0, ge=0, description="when")
    amplitude: Annotated[float, Unit(ACTION)] = Field(ge=0, description="greatest shift, uniform")


class MarginTable(Table):
    """Bounds on what is not modelled, from which the barrier's tightening follows."""

    push: Annotated[PerAgent, Unit(INPUT, ">= 0")] = Field(
        0.0, description="greatest force besides the input"
    )
    noise: Annotated[PerAgent, Unit(ACTION, ">= 0")] = Field(
        0.0, description="greatest error of an output"
    )
    delay: Annotated[int, Unit("control periods")] = Field(
        0, ge=0, le=1000, description="of the sensors"
    )

    push_change: Annotated[PerAgent, Unit(INPUT, ">= 0")] = Field(
        0.0,
        description="with controller.observer: the most that the push changes within a control"
        " period; push is then what is not known of it at the start",
    )

    def disturbance(self, game: Game) -> Disturbance:
        """The bounds, for each channel."""
        each = [
            np.repeat(per_agent(key, getattr(self, key), game.agents), game.sizes)
            for key in ("push", "noise", "push_change")
        ]
        return Disturbance(each[0], each[1], self.delay, each[2])
