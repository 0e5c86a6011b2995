"""Inputs fed forward: an equilibrium that moves is followed without the lag."""

import pytest
from test_tracking import one

from gne_mj.errors import InvalidInput
from gne_mj.scenario import load_scenario, run

SWING = {"type": "sine", "mean": 0.5, "amplitude": 1.0, "period": 3.0}


def distances(agent, mode, feed, **about):
    """The distance from y*(t) at the end of 6 s, and the whole section of the report."""
    tables = one(agent, mode, SWING, **about)
    tables["systems"]["a"]["controller"] |= {"feed_forward": feed}
    found = run(tables).reports["a"]["tracking"]
    return found["final_distance"], found


@pytest.mark.parametrize(
    ("agent", "mode", "rest"),
    [
        ("integrator", "continuous", 2e-5),
        ("integrator", "implicit", 1e-5),
        ("integrator", "sampled", 2e-2),  # late by a period
        ("pi-cascade", "continuous", 1e-2),  # whose distance falls more slowly
    ],
)
def test_the_lag_is_gone(agent, mode, rest):
    # exp(-2 * 6) of the start is left of what begins away from y*
    with_it, seen = distances(agent, mode, True)
    without, _ = distances(agent, mode, False)
    assert with_it < rest
    assert without > 0.2
    assert seen["within"] in (True, None)


def test_of_robots_with_linear_springs_it_is_gone_too():
    tables = one("flexible-robot", reference=SWING)
    tables["systems"]["a"]["agents"] |= {"atan_coefficient": 0.0, "damping": 2.0}
    tables["simulation"]["duration"] = 20.0
    tables["systems"]["a"]["controller"] |= {"feed_forward": True}
    fed = run(tables).reports["a"]["tracking"]["final_distance"]
    tables["systems"]["a"]["controller"] |= {"feed_forward": False}
    assert fed < 1e-3
    assert run(tables).reports["a"]["tracking"]["final_distance"] > 0.3


def test_a_kink_is_no_obstacle():
    found = run(one("integrator"), {"a.controller.feed_forward": True}).reports["a"]["tracking"]
    assert found["within"]
    assert found["final_distance"] < 1e-4


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"a.game.reference_velocity": 0.0}, "that move"),
        ({"a.agents.type": "flexible-robot", "a.controller.mode": "implicit"}, "integrators"),
    ],
)
def test_where_it_is_not_known_it_is_refused(changes, words):
    given = {"a.controller.feed_forward": True, **changes}
    with pytest.raises(InvalidInput, match=words):
        load_scenario(one("integrator"), given).system_objects()
