"""Shipped fleets of robots with bodies of their own: short random runs, as campaigns draw them."""

import sys
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).parents[1] / "scripts" / "campaigns"))

import robots


def test_what_counts_as_broken():
    """Each fault by itself; a run that did not arrive may say why."""
    sound = {"status": "converged", "message": "", "away": 0.0, "contacts": 0, "too_near": 0,
             "positions": 0}  # fmt: skip
    assert robots.broken(sound) == []
    for key in ("contacts", "too_near", "positions"):
        assert robots.broken({**sound, key: 1}) == [key]
    left = "left_feasible_set"
    assert robots.broken({**sound, "status": left}) == [left]
    away = {**sound, "status": "completed", "away": 0.1, "message": "completed"}
    assert robots.broken(away) == ["not told"]
    assert robots.broken({**away, "message": "completed; held by a load"}) == []
    assert robots.broken(robots.crashed(7, ValueError("x"))) == ["crashed"]
    assert robots.report([sound | {"index": 0, "least": None, "settled": None, "accurate": 0,
                                   "solutions": 0, "not_monotone": 0},
                          robots.crashed(1, ValueError("x"))])[1] == 1  # fmt: skip


@pytest.mark.slow
@pytest.mark.parametrize("name", list(robots.FLEETS))
def test_random_runs_end_inside_without_a_contact_and_arrive(name):
    """By the run's report, and y at its end beside the solver's y*."""
    for index in range(3):
        row = robots.one(name, 0, index)
        assert not robots.broken(row)
        assert row["away"] <= robots.ARRIVED
