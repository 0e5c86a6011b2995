"""Estimates outside the set are found, and told with their agent and constraint."""

import numpy as np
import pytest
from builders import V0
from law_cases import EPSILON, GAIN, act, case, draw, loop_at, pack_memory

import reference
from gne_mj import graph as graphs
from gne_mj.controllers import FullyDistributed
from gne_mj.games import velocity_game
from gne_mj.loops import monitor as watch


def outside_cases():
    """Which agent's profile is moved, by what, and the constraint that must be named."""
    velocity, osnr = case("velocity", 5), case("osnr", 10)
    return [
        (velocity, 3, 2, 50.0, 3),  # its estimate of its predecessor: its own gap
        (velocity, 1, 2, -50.0, 2),  # its estimate of its follower: the follower's gap
        (velocity, 0, 1, np.nan, 1),
        (osnr, 7, 2, 50.0, 10),  # total power
        (osnr, 9, 9, -0.1, 9),  # its own filtered power
    ]


@pytest.mark.parametrize("number", range(5))
def test_an_estimate_outside_is_reported_with_its_agent_and_constraint(number):
    now, agent, entry, change, constraint = outside_cases()[number]
    law = FullyDistributed(graphs.ring(now.count), EPSILON, GAIN)
    y, estimates, z = draw(now)
    if entry == agent:
        z[agent] = change
    else:
        estimates[agent, entry] += change
    code, u, *_ = act(now.game, law, y, estimates, z)
    assert code == agent * now.game.constraints_count + constraint
    assert np.all(np.isfinite(u[:agent]))

    margins = reference.estimate_margins(now.oracle, z, estimates)
    loop = loop_at(now.game, law, y, pack_memory(estimates, z), h=1e-3)
    assert loop.advance(3, 1).input.shape == (0, now.count)
    monitor = loop.monitor
    finite = np.isfinite(margins[agent, constraint])
    assert monitor.exit == (watch.ESTIMATE_LEFT if finite else watch.DIVERGED)
    assert monitor.exit_agent == agent
    assert monitor.exit_constraint == constraint
    assert monitor.exit_stage == monitor.exit_time == 0
    if finite:
        assert margins[agent, constraint] > 0
        assert monitor.exit_value == pytest.approx(margins[agent, constraint], rel=1e-12)
    assert loop.time == 0
    assert np.all(np.isnan(loop.finish().input))


def test_an_agent_minds_only_constraints_that_contain_its_action():
    now, law = case("velocity", 5), FullyDistributed(graphs.line(5), EPSILON, GAIN)
    y, estimates, z = draw(now)
    code, u, *_ = act(now.game, law, y, estimates, z)
    far = estimates.copy()
    far[0, 3] += 50.0  # agents 4 and 5 are not in the constraints of agent 1
    assert np.any(reference.estimate_margins(now.oracle, z, far)[0] > 0)
    other_code, other_u, *_ = act(now.game, law, y, far, z)
    assert code == other_code == -1
    assert np.array_equal(u, other_u)


def test_exactly_on_the_boundary_an_estimate_has_left():
    game = velocity_game(2, 3.0, 3.0)
    law = FullyDistributed(graphs.line(2), EPSILON, GAIN)
    y, estimates, z = (
        np.array([2.0, 2.0]),
        np.array([[np.nan, 5.0], [2.0, np.nan]]),
        np.full(2, 2.0),
    )
    code, *_ = act(game, law, y, estimates, z)
    assert code == 0 * 2 + 1


def test_the_true_profile_comes_before_the_estimates():
    """Robots outside their set are said to be outside, whatever they take each other to be."""
    now = case("velocity", 5)
    law = FullyDistributed(graphs.line(5), EPSILON, GAIN)
    _, estimates, z = draw(now)
    loop = loop_at(now.game, law, np.full(5, V0 + 50.0), pack_memory(estimates, z))
    loop.advance(1, 1)
    assert loop.monitor.exit == watch.LEFT_SET
    assert loop.monitor.exit_agent == -1
