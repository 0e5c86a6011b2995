"""Shipped fleets of robots with bodies of their own: short random runs, as campaigns draw them."""

import sys
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).parents[1] / "scripts" / "campaigns"))

import robots


@pytest.mark.slow
@pytest.mark.parametrize("name", list(robots.FLEETS))
def test_random_runs_end_inside_without_a_contact_and_arrive(name):
    for index in range(3):
        row = robots.one(name, 0, index)
        assert not robots.broken(row)
        assert row["away"] <= robots.ARRIVED
