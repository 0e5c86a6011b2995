"""Agents that leave and join, against SciPy on the games of those present, and what runs report."""

import json

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from scipy.integrate import solve_ivp

import gne_mj
from gne_mj.errors import InvalidInput
from gne_mj.scenario import load_scenario

RHO, V0, DELTA = 0.1, 3.0, 3.0
START = np.array([1.0, 0.0, -1.0, 0.5, 2.0])


def scenario(changes, **parts):
    tables = {
        "simulation": {"duration": 1.0, "timestep": 1e-3},
        "recording": {"period": 0.1},
        "systems": {
            "robots": {
                "game": {"type": "velocity-synchronization"},
                "agents": {"type": "integrator", "count": 5},
                "membership": {"changes": changes},
            }
        },
    }
    return load_scenario(tables, parts)


def rate_among(there):
    """y' = u of those present, from the formulas: gaps to who is away are to v_0, unbounded."""

    def rate(_, y):
        full = np.full(6, V0)
        full[1:][there] = y
        u = np.zeros(6)
        for i in range(1, 6):
            if not there[i - 1]:
                continue
            gap = full[i] - full[i - 1]
            u[i] -= 2 * gap
            if i == 1 or there[i - 2]:
                force = 2 * RHO * gap / (DELTA**2 - gap**2)
                u[i] -= force
                u[i - 1] += force
        return u[1:][there]

    return rate


def test_every_interval_is_the_game_of_those_present():
    changes = [
        {"time": 0.25, "leaves": [3]},
        {"time": 0.4, "leaves": [5]},
        {"time": 0.7, "joins": [3], "action": 0.5},
    ]
    run = gne_mj.run(scenario(changes))
    y, there, time = START.copy(), np.ones(5, dtype=bool), 0.0
    data = run.data
    for until, after in ((0.25, [0, 1, 3, 4]), (0.4, [0, 1, 3]), (0.7, [0, 1, 2, 3]), (1.0, None)):
        found = solve_ivp(
            rate_among(there), (time, until), y[there], "DOP853", rtol=1e-12, atol=1e-13,
            dense_output=True,
        )  # fmt: skip
        for at in data["time"].values[
            (data["time"].values >= time) & (data["time"].values < until)
        ]:
            row = data["action"].sel(time=at).values
            assert_allclose(row[there], found.sol(at), rtol=1e-8, atol=1e-9)
            assert_array_equal(np.isnan(row), ~there)
        y[there], time = found.y[:, -1], until
        if after is not None:
            if 2 in after and not there[2]:
                y[2] = 0.5
            there = np.isin(np.arange(5), after)
    assert_allclose(data["action"].values[-1][there], y[there], rtol=1e-8)
    report = run.reports["robots"]
    assert report["lyapunov"]["claimed"]
    assert report["lyapunov"]["monotone"]
    assert [each["there"] for each in report["membership"]["changes"]] == [
        [1, 2, 4, 5], [1, 2, 4], [1, 2, 3, 4],
    ]  # fmt: skip
    assert_array_equal(np.isnan(data["constraint"].values[-1]), [False] * 4 + [True])
    assert_allclose(data["equilibrium"].values[-1], [3, 3, 3, 3, np.nan])


def test_who_is_not_strictly_inside_is_not_admitted():
    changes = [
        {"time": 0.2, "leaves": [3]},
        {"time": 0.5, "joins": [3], "action": -4.0, "retry": 0.1},
    ]
    run = gne_mj.run(scenario(changes))
    report = run.reports["robots"]
    refused = report["membership"]["changes"][-1]
    assert not refused["done"]
    assert refused["tried"] == 5
    assert refused["constraint"] == "gap of agent 4"
    assert refused["value"] > 0
    assert "robot 3 was not admitted at 0.9 s: constraint 'gap of agent 4'" in report["message"]
    assert "1 not admitted" in str(run)
    assert run.holds
    json.dumps(run.report(), allow_nan=False)


@pytest.mark.parametrize(
    ("changes", "more", "key", "words"),
    [
        ([{"time": 0.1005, "leaves": [3]}], {}, "membership.changes.0.time", "multiple"),
        ([{"time": 0.1, "leaves": [6]}], {}, "membership.changes.0.leaves", "from 1 to 5"),
        ([{"time": 0.1, "joins": [3]}, {"time": 0.2, "joins": [3]}], {}, "changes.1.joins", "away"),
        ([{"time": 0.1, "leaves": [1, 2, 3, 4]}], {}, "membership", "constraint of theirs"),
        (
            [{"time": 0.1, "leaves": [3]}],
            {"controller": {"information": "partial", "graph": "line"}},
            "membership.changes.0",
            "must be connected",
        ),
        (
            [{"time": 0.1, "leaves": [3]}],
            {"simulation.integrator": "tsit5"},
            "integrator",
            "where agents leave or join",
        ),
    ],
)
def test_what_cannot_go_on_is_refused(changes, more, key, words):
    with pytest.raises(InvalidInput, match=words) as raised:
        scenario(changes, **more).simulation_object()
    assert key in raised.value.key
