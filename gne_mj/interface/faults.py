"""What goes wrong, as objects: one function a kind of fault.

``agents`` are numbered from 1, all if left out; a fault lasts from ``start`` to ``end`` in s, to
the run's end if that is None. ``edges`` are pairs of agents.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Literal

from gne_mj.arguments import answering
from gne_mj.interface.tables import made
from gne_mj.scenario_tables import faults as tables
from gne_mj.scenario_tables.faults import FaultTable

Agents = Sequence[int] | None
Edges = Sequence[tuple[int, int]] | None


@answering
def push(
    force: float,
    *,
    agents: Agents = None,
    start: float = 0.0,
    end: float | None = None,
    axis: int | None = None,
    profile: Literal["constant", "sine", "square", "random"] = "constant",
    period: float = 1.0,
) -> FaultTable:
    """A force besides the input, in its unit; ``axis`` says along which entry of the actions,
    from 1, and ``period`` is in s, of the profiles "sine" and "square"."""
    return made(tables.PushTable, type="push", **locals())


@answering
def saturation(
    limit: float, *, agents: Agents = None, start: float = 0.0, end: float | None = None
) -> FaultTable:
    """Actuators that deliver no more than the limit, in absolute value, meanwhile."""
    return made(tables.SaturationTable, type="saturation", **locals())


@answering
def noise(
    amplitude: float, *, agents: Agents = None, start: float = 0.0, end: float | None = None
) -> FaultTable:
    """Outputs read with uniform errors of up to the amplitude."""
    return made(tables.NoiseTable, type="noise", **locals())


@answering
def bias(
    offset: float, *, agents: Agents = None, start: float = 0.0, end: float | None = None
) -> FaultTable:
    """Outputs read with a constant error, what is read less what is."""
    return made(tables.BiasTable, type="bias", **locals())


@answering
def sensor_delay(periods: int) -> FaultTable:
    """All sensors read what was so many control periods ago."""
    return made(tables.SensorDelayTable, type="sensor-delay", **locals())


@answering
def message_loss(
    probability: float,
    *,
    agents: Agents = None,
    edges: Edges = None,
    start: float = 0.0,
    end: float | None = None,
) -> FaultTable:
    """Messages that do not arrive, each with this probability."""
    return made(tables.MessageLossTable, type="message-loss", **locals())


@answering
def message_delay(
    periods: int,
    *,
    agents: Agents = None,
    edges: Edges = None,
    start: float = 0.0,
    end: float | None = None,
) -> FaultTable:
    """Messages that arrive so many control periods late."""
    return made(tables.MessageDelayTable, type="message-delay", **locals())


@answering
def silence(
    *, agents: Agents = None, edges: Edges = None, start: float = 0.0, end: float | None = None
) -> FaultTable:
    """Edges or agents that go silent."""
    return made(tables.SilenceTable, type="silence", **locals())


@answering
def estimate_corruption(
    amplitude: float, *, agents: Agents = None, start: float = 0.0
) -> FaultTable:
    """Estimates shifted once, at the start, by uniform numbers of up to the amplitude."""
    return made(tables.CorruptionTable, type="estimate-corruption", **locals())
