"""Tables of a scenario file: what they are made into, and what is meant where a key is left out."""

import numpy as np
import pytest
from builders import V0

from gne_mj import faults
from gne_mj.barrier import BarrierTable
from gne_mj.errors import InvalidInput
from gne_mj.games import velocity_consensus_game
from gne_mj.games.cournot import CournotTable
from gne_mj.games.osnr import OsnrTable
from gne_mj.games.velocity_consensus import VelocityConsensusTable
from gne_mj.games.velocity_synchronization import VelocityTable
from gne_mj.scenario import load_scenario
from gne_mj.scenario_tables import faults as tables
from gne_mj.toml_table import dimension_of, per_action, per_agent

# Each kind with the keys it needs, all keys, and the faults that they mean
KINDS = {
    "push": (
        tables.PushTable, {"force": 2.0}, faults.Push(force=2.0),
        {"agents": [1, 3], "axis": 2, "profile": "sine", "period": 0.5, "start": 1.0, "end": 4.0},
        faults.Push((0, 2), 1.0, 4.0, 2.0, 1, "sine", 0.5),
    ),
    "saturation": (
        tables.SaturationTable, {"limit": 0.0}, faults.Saturation(limit=0.0),
        {"agents": [2], "limit": 3.0}, faults.Saturation((1,), limit=3.0),
    ),
    "noise": (
        tables.NoiseTable, {"amplitude": 0.1}, faults.Noise(amplitude=0.1),
        {"agents": [2], "end": 2.0}, faults.Noise((1,), 0.0, 2.0, 0.1),
    ),
    "bias": (
        tables.BiasTable, {"offset": -0.1}, faults.Bias(offset=-0.1),
        {"start": 2.0}, faults.Bias(start=2.0, offset=-0.1),
    ),
    "sensor-delay": (
        tables.SensorDelayTable, {"periods": 2}, faults.SensorDelay(periods=2),
        {"periods": 0}, faults.SensorDelay(periods=0),
    ),
    "message-loss": (
        tables.MessageLossTable, {"probability": 0.3}, faults.MessageLoss(probability=0.3),
        {"edges": [(1, 2), (5, 3)]},
        faults.MessageLoss(probability=0.3, edges=((0, 1), (4, 2))),
    ),
    "message-delay": (
        tables.MessageDelayTable, {"periods": 3}, faults.MessageDelay(periods=3),
        {"agents": [4], "edges": [(2, 1)]},
        faults.MessageDelay((3,), periods=3, edges=((1, 0),)),
    ),
    "silence": (
        tables.SilenceTable, {}, faults.Silence(),
        {"edges": [(3, 2)], "start": 0.5, "end": 1.5},
        faults.Silence(None, 0.5, 1.5, ((2, 1),)),
    ),
    "estimate-corruption": (
        tables.CorruptionTable, {"amplitude": 0.2}, faults.Corruption(amplitude=0.2),
        {"agents": [5], "start": 3.0}, faults.Corruption((4,), 3.0, amplitude=0.2),
    ),
}  # fmt: skip


@pytest.mark.parametrize("kind", KINDS)
def test_faults_as_they_are_written(kind):
    """Numbered from 1 there and from 0 here; what is left out is a fault's own default."""
    table, needed, least, more, full = KINDS[kind]
    assert table(type=kind, **needed).build() == least
    assert table(type=kind, **{**needed, **more}).build() == full


def test_a_margin_is_given_for_each_agent():
    game = velocity_consensus_game([(0, 1)], [1.0, 0.0], [1.0, 0.0], 1.5, 2.0)
    nothing = tables.MarginTable().disturbance(game)
    assert (nothing.push.tolist(), nothing.noise.tolist(), nothing.delay) == ([0.0] * 4,) * 2 + (0,)
    given = tables.MarginTable(push=[1.0, 2.0], noise=0.5, delay=3).disturbance(game)
    assert given.push.tolist() == [1.0, 1.0, 2.0, 2.0]
    assert (given.noise.tolist(), given.delay) == ([0.5] * 4, 3)


@pytest.mark.parametrize(
    ("sizes", "dimension"),
    [((1, 1, 1), 1), ((2, 2, 2), 2), ((3,), 3), ((2, 1), 1), ((1, 2), 1), ((2, 2, 3), 1)],
)
def test_agents_have_a_dimension_where_all_have_the_same(sizes, dimension):
    assert dimension_of(sizes) == dimension


@pytest.mark.parametrize(
    ("given", "sizes", "expected"),
    [
        (0.5, (2, 1), [0.5, 0.5, 0.5]),
        ([1.0, 2.0], (1, 1), [1.0, 2.0]),
        ([1.0, 2.0], (2, 2), [1.0, 2.0, 1.0, 2.0]),
        ([[1.0, 2.0], [3.0, 4.0]], (2, 2), [1.0, 2.0, 3.0, 4.0]),
        ([[1.0, 2.0], [3.0]], (2, 1), [1.0, 2.0, 3.0]),
        ([[1.0], [3.0]], (1, 1), [1.0, 3.0]),
    ],
)
def test_numbers_for_actions(given, sizes, expected):
    assert per_action("k", given, sizes).tolist() == expected


@pytest.mark.parametrize(
    ("given", "sizes", "words"),
    [
        ([1.0], (2, 2), "one list of 2 for all agents, or a list of 2 lists"),
        ([1.0, 2.0], (2, 1), "one number, a list of 2 lists"),
        ([[1.0, 2.0]], (2, 2), "a list of 2 lists"),
        ([1.0, 2.0, 3.0], (1, 1), "a list of 2, one for each agent"),
    ],
)
def test_numbers_for_other_actions_are_refused(given, sizes, words):
    with pytest.raises(InvalidInput, match=words):
        per_action("k", given, sizes)


def test_numbers_for_agents():
    assert per_agent("k", 2.0, 3).tolist() == [2.0] * 3
    assert per_agent("k", [0.0, 1.0], 2).tolist() == [0.0, 1.0]
    for given in (0.0, [1.0, 0.0], [1.0, -1.0]):
        with pytest.raises(InvalidInput, match="must be positive"):
            per_agent("k", given, 2, positive=True)


def test_default_starts():
    cournot = CournotTable(type="cournot", lower_bound=[2.0, 4.0, 6.0], upper_bound=10.0)
    assert cournot.default_start(3).tolist() == [6.0, 7.0, 8.0]
    assert CournotTable(type="cournot").default_start(2).tolist() == [53.5, 53.5]
    line = VelocityTable(type="velocity-synchronization", gap_bound=[2.0, 9.0])
    assert line.default_start(2).tolist() == [V0 - 1.0] * 2
    assert line.default_start(5).tolist() == [1.0, 0.0, -1.0, 0.5, 2.0]
    plane = VelocityConsensusTable(type="velocity-consensus", leader_gap_bound=[4.0, 2.0])
    assert plane.default_start(2).tolist() == [0.0, 1.0, 0.0, 1.0]
    assert OsnrTable(type="osnr", total_power_limit=5.0).default_start(4).tolist() == [1.0] * 4
    assert OsnrTable(type="osnr").default_start(10) == pytest.approx(np.full(10, 0.2))


@pytest.mark.parametrize("name", ["velocity-sync", "cournot", "planar-sync"])
def test_the_defaults_of_the_shipped_games_begin_inside(name):
    scenario = load_scenario(name)
    for system in scenario.system_objects():
        assert np.all(system.game.constraints(system.start) < 0)


def test_the_barriers_defaults():
    table = BarrierTable()
    assert (table.rho, table.schedule, table.build(1e-3)) == (0.1, None, None)
    (system,) = load_scenario(
        {"systems": {"robots": {"game": {"type": "velocity-synchronization"},
                                "agents": {"type": "flexible-robot", "count": 2}}}}
    ).system_objects()  # fmt: skip
    assert (system.rho, system.schedule) == (0.1, None)
    falling = BarrierTable(schedule="halving").build(1e-3)
    assert (falling.start, falling.floor, falling.time_constant) == (0.1, 1e-3, 1.0)
    given = BarrierTable(schedule="halving", floor=1e-4, time_constant=3.0).build(1e-3)
    assert (given.floor, given.time_constant) == (1e-4, 3.0)
    assert BarrierTable(schedule="halving", rho=1e-5).build(1e-3).floor == 1e-5
    for key in ("floor", "time_constant"):
        with pytest.raises(InvalidInput, match=f"^{key}: got 1.0"):
            BarrierTable(**{key: 1.0}).build(1e-3)
