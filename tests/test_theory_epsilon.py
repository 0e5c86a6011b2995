"""The search for an epsilon, against runs with what it says."""

from dataclasses import replace

import pytest
from builders import (
    FIVE,
    clock,
    distributed,
    robot_state,
    robot_system,
)
from theory_systems import STEP, osnr

from gne_mj.errors import InvalidInput
from gne_mj.loops import monitor as watch
from gne_mj.theory import search_epsilon


def trial(epsilon, system, timing):
    law = replace(system.law, epsilon=epsilon)
    loop = replace(system, law=law).closed_loop(timing)
    loop.advance(1, timing.steps(timing.duration))
    loop.finish()
    return loop.monitor.exit == watch.INSIDE


@pytest.mark.slow
def test_the_search_brackets_an_epsilon():
    system = osnr(distributed(epsilon=0.05, gain=1.0), integrator="rosenbrock")
    timing = clock(0.01, 0.1)
    said = []
    found = search_epsilon(system, timing, lambda *now: said.append(now))
    assert found.inside < found.outside <= 1.01 * found.inside
    assert trial(found.inside, system, timing)
    assert not trial(found.outside, system, timing)
    assert [done for done, _, _ in said] == list(range(len(said)))
    assert len(said) >= len(found.trials)
    assert found.note is None
    assert all(stayed == trial(epsilon, system, timing) for epsilon, stayed in found.trials)


@pytest.mark.slow
def test_the_search_says_where_it_ends():
    timing = clock(0.002, 0.004)
    endless = search_epsilon(osnr(distributed(epsilon=0.03), integrator="rosenbrock"), timing)
    assert endless.outside is None
    assert "not tried" in endless.note
    assert endless.inside <= 10 * timing.duration < 2 * endless.inside
    # an explicit method's step is too long for a smaller epsilon
    law = distributed(epsilon=0.5, gain=100.0)
    short = search_epsilon(osnr(law), clock(0.05, 1.0))
    assert short.inside is None
    assert "cannot be tried" in short.note


def test_only_the_distributed_law_has_an_epsilon():
    with pytest.raises(InvalidInput, match="only the distributed law"):
        search_epsilon(robot_system(robot_state(FIVE)), STEP)
