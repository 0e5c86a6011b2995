"""Agents that send when their triggers fire, against a loop in plain Python; what is refused."""

from functools import cache

import numpy as np
import pytest
from builders import clock, integrators

import reference
import reference_games
from gne_mj import graph as graphs
from gne_mj.controllers import FullInformation, FullyDistributed, PartialInformation
from gne_mj.errors import InvalidInput
from gne_mj.faults import EventTrigger, MessageLoss
from gne_mj.games import velocity_game
from gne_mj.scenario import load_scenario
from gne_mj.simulation import Simulation
from gne_mj.system import System
from gne_mj.theory import certify
from gne_mj.theory.theorem import Theorem

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
    everything = {"sent": 1500, "periodic": 1500}  # over 10 links in 150 periods
    assert lossless.reports["agents"]["messages"] == everything


def test_few_messages_reach_the_equilibrium():
    trajectory = run(3000, EventTrigger(threshold=0.5, decay=0.31))
    report = trajectory.reports["agents"]
    assert report["messages"]["sent"] < 0.1 * report["messages"]["periodic"]
    assert report["equilibrium"]["final_distance"] < 1e-3
    assert "messages" in str(trajectory)


def falls(law, rows, others):
    """-dV/dt of integrators without their barrier, agent by agent, y* being 3 for all.

    V is half the squared distance of actions plus tau/2 that of estimates; ``others`` are the rows
    that neighbours hold.
    """
    found, distance = 0.0, rows - 3.0
    for i, row in enumerate(law.graph.laplacian):
        pull = sum(rows[i] - others[j] for j in np.flatnonzero(row < 0))
        rate = -law.coupling * pull  # tau times an estimate's rate
        rate[i] -= GAME.partial_gradient(i, rows[i])
        found -= distance[i] @ rate
    return found


def as_form(law):
    """:func:`falls` as the matrix of a quadratic form in the distance of all rows and the errors of
    what others hold (50, 50), by its values at sums of unit vectors."""

    def at(z):
        rows = 3.0 + z[:25].reshape(5, 5)
        return falls(law, rows, rows + z[25:].reshape(5, 5))

    unit = np.eye(50)
    own = [at(each) for each in unit]
    pairs = np.array([[at(a + b) for b in unit] for a in unit])
    return 0.5 * (pairs - np.add.outer(own, own))


@pytest.mark.parametrize("links", [graphs.ring(5), graphs.line(5)])
def test_what_is_proven_of_triggers(links):
    law = PartialInformation(links, 6.0, 0.1)
    form = as_form(law)
    q = np.linalg.eigvalsh(form[:25, :25])[0]
    disagreement = np.zeros((50, 50))  # sum over links of |e^i - e^j - eps^j|^2
    for i, j in zip(*np.nonzero(links.laplacian < 0), strict=True):
        for r in range(5):
            row = np.zeros(50)
            row[5 * i + r], row[5 * j + r], row[25 + 5 * j + r] = 1.0, -1.0, -1.0
            disagreement += np.outer(row, row)
    own, errors = np.diag([1.0] * 25 + [0.0] * 25), np.diag([0.0] * 25 + [1.0] * 25)

    def least(t, sigma):
        return np.linalg.eigvalsh(form - 0.25 * q * own + t * (errors - sigma * disagreement))[0]

    told = Theorem(system(EventTrigger(), law=law)).triggers.report()
    assert told["form"] == pytest.approx(q, rel=1e-9)
    most = told["largest_sigma"]
    weights = np.geomspace(10.0, 1e5, 400)
    assert max(least(t, 0.98 * most) for t in weights) > -1e-9
    assert max(least(t, 1.02 * most) for t in weights) < -1e-6
    trigger = EventTrigger(sigma=0.5 * most, threshold=0.2, decay=0.5)
    told = Theorem(system(trigger, law=law)).triggers.report()
    t = told["beta"] / 5
    assert told["proven"]
    assert least(1.0001 * t, trigger.sigma) > -1e-9
    assert least(0.99 * t, trigger.sigma) < -1e-7
    assert told["rises"] == pytest.approx(told["beta"] * 0.2**2 / (2.0 * 0.5))
    assert told["ball"] == pytest.approx(np.sqrt(4.0 * told["beta"] / q) * 0.2)
    beyond = Theorem(system(EventTrigger(sigma=1.01 * most), law=law)).triggers
    assert not beyond.report()["proven"]
    assert f"{most:.4g}" in beyond.why_not


def test_the_condition_without_a_matrix_is_a_weaker_one(monkeypatch):
    law = PartialInformation(graphs.complete(5), 9.0, 0.1)
    sharp = Theorem(system(EventTrigger(), law=law)).triggers.report()
    monkeypatch.setattr("gne_mj.theory.coupling._FORM", 0)
    told = Theorem(system(EventTrigger(), law=law)).triggers
    q, c, degree = told.form, 9.0, 4
    assert 0.0 < q <= sharp["form"]
    assert told.largest_sigma <= sharp["largest_sigma"]
    sigma = told.largest_sigma
    assert 16.0 * sigma * c**2 * degree**3 == pytest.approx(q**2 * (1.0 - 2.0 * sigma * degree))
    assert told.beta == pytest.approx(c**2 * degree**2 * 5 / (2.0 * q))


def test_certify_and_reports_say_whether_triggers_are_proven():
    proven = certify(system(EventTrigger(threshold=0.5, decay=0.3)), clock(H, 1.0))
    assert not proven.theorem["obstacles"]
    assert proven.triggers["least_time"] == H
    assert "triggers being looked at at all times" in proven.guaranteed[0]
    assert "V falls in continuous time" in str(proven)
    never = certify(system(EventTrigger(threshold=0.5)), clock(H, 1.0))
    assert "where |e| >" in never.guaranteed[0]
    assert never.to_dict()["triggers"]["rises"] is None
    distributed = system(EventTrigger(sigma=0.1), law=FullyDistributed(graphs.ring(5), 0.1, 1.0))
    (why,) = (each for each in certify(distributed, clock(H, 1.0)).theorem["obstacles"]
              if each.startswith("triggers"))  # fmt: skip
    assert why == "triggers: nothing is proven of them under distributed information"
    told = run(150).reports["agents"]["messages"]["triggers"]
    assert told["proven"] is False
    assert "sigma = 0.01" in told["why_not"]
    assert "not proven to keep V falling" in str(run(150))


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
