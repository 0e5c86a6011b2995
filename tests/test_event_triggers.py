"""Agents that send when their triggers fire, against a loop in plain Python; what is refused."""

from functools import cache

import numpy as np
import pytest
from builders import clock, integrators

import reference
import reference_games
from gne_mj import graph as graphs
from gne_mj.controllers import FullInformation, PartialInformation
from gne_mj.errors import InvalidInput
from gne_mj.faults import EventTrigger, MessageLoss
from gne_mj.games import velocity_game
from gne_mj.scenario import load_scenario
from gne_mj.simulation import Simulation
from gne_mj.system import System

RHO, H, START = 0.1, 0.01, np.array([1.0, 0.0, -1.0, 0.5, 2.0])
GAME = reference_games.VelocityGame(3.0, np.full(5, 3.0))


def system(*faults, law=None, mode="sampled"):
    law = law or PartialInformation(graphs.ring(5), 3.0, 0.1)
    return System(
        "agents", velocity_game(5, 3.0, 3.0), integrators(5), law, RHO, START[:, None], mode=mode,
        integrator="euler", faults=faults,
    )  # fmt: skip


def oracle(law, trigger, periods):
    """Estimates at the control instants, and how many messages came over links."""
    neighbours = [list(np.flatnonzero(row < 0)) for row in law.graph.laplacian]
    y, rows = START.copy(), np.tile(START, (5, 1))
    sent, found, messages, greatest = rows.copy(), [], 0, 0.0
    for k in range(periods):
        for i in range(5 if k else 0):
            mean = np.mean([sent[j] for j in neighbours[i]], axis=0)
            stays = np.exp(-law.coupling / law.time_constant * H * len(neighbours[i]))
            rows[i] = mean + stays * (rows[i] - mean)
        rows[np.arange(5), np.arange(5)] = y
        before = sent.copy()
        for i in range(5):
            apart = sum(np.sum((rows[i] - before[j]) ** 2) for j in neighbours[i])
            allowed = (trigger.threshold * np.exp(-trigger.decay * k * H)) ** 2
            if np.sum((rows[i] - before[i]) ** 2) > trigger.sigma * apart + allowed:
                sent[i] = rows[i]
                messages += len(neighbours[i])
            bound = trigger.sigma * apart + allowed
            greatest = max(greatest, np.sum((rows[i] - sent[i]) ** 2) - bound)
        found.append(rows.copy())
        u = [
            -GAME.partial_gradient(i, rows[i])
            - reference.barrier_gradient(GAME, RHO, y)[i]
            - law.coupling * sum(y[i] - sent[j][i] for j in neighbours[i])
            for i in range(5)
        ]
        y = y + H * np.array(u)
    return np.array(found), messages, greatest


TRIGGER = EventTrigger(sigma=0.01, threshold=0.2, decay=0.5)


@cache
def run(periods, trigger=TRIGGER, mode="sampled"):
    simulation = Simulation([system(trigger, mode=mode)], clock(H, periods * H, sample=H))
    return simulation.run()


def test_triggers_against_plain_python():
    trajectory = run(150)
    rows, messages, greatest = oracle(PartialInformation(graphs.ring(5), 3.0, 0.1), TRIGGER, 151)
    got = trajectory["agents"]["estimate"].to_numpy()
    assert np.max(np.abs(got[:150] - rows[:150])) < 1e-12
    report = trajectory.reports["agents"]["messages"]
    assert 0 < report["sent"] <= messages  # the last instant may have some more
    assert report["sent"] >= messages - 10
    assert report["periodic"] in (1500, 1510)
    assert greatest <= 0.0  # what neighbours hold is never off by more than the trigger allows


def test_without_a_threshold_all_is_sent_and_nothing_changes():
    always = run(150, EventTrigger())
    lossless = Simulation([system(MessageLoss(probability=0.0))], clock(H, 1.5, sample=H)).run()
    for name in ("action", "estimate"):
        np.testing.assert_array_equal(
            always["agents"][name].to_numpy(), lossless["agents"][name].to_numpy()
        )
    messages = always.reports["agents"]["messages"]
    assert messages["periodic"] - messages["sent"] <= 20
    assert lossless.reports["agents"]["messages"] is None


def test_few_messages_reach_the_equilibrium():
    trajectory = run(3000, EventTrigger(threshold=0.5, decay=0.31))
    report = trajectory.reports["agents"]
    assert report["messages"]["sent"] < 0.1 * report["messages"]["periodic"]
    assert report["equilibrium"]["final_distance"] < 1e-3
    assert "messages" in str(trajectory)


@pytest.mark.parametrize(
    ("faults", "options", "words"),
    [
        ((EventTrigger(), MessageLoss()), {}, "no other faults of messages"),
        ((EventTrigger(),), {"mode": "continuous"}, "use mode 'sampled' or 'implicit'"),
        ((EventTrigger(),), {"law": FullInformation()}, "sends no messages"),
    ],
)
def test_where_there_are_no_triggers(faults, options, words):
    with pytest.raises(InvalidInput, match=words):
        system(*faults, **options)


@pytest.mark.parametrize("key", ["sigma", "threshold", "decay"])
def test_numbers_of_a_trigger(key):
    with pytest.raises(InvalidInput, match=key):
        EventTrigger(**{key: -1.0})


def test_a_scenario_says_when_agents_send():
    changes = {
        "controller": {
            "information": "partial",
            "mode": "sampled",
            "communication": {"type": "event", "threshold": 0.1, "decay": 0.2},
        }
    }
    (made,) = load_scenario("velocity-sync", changes).simulation_object().systems
    assert made.faults == (EventTrigger(threshold=0.1, decay=0.2),)
