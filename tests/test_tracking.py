"""The distance to an equilibrium that moves, and its bound."""

import numpy as np
import pytest

import gne_mj as gm
from gne_mj.equilibrium_path import EquilibriumPath
from gne_mj.games import velocity_game
from gne_mj.scenario import load_scenario, run
from gne_mj.theory import certify

RAMP = {"type": "ramp", "from": 0.0, "to": 8.0, "start": 1.0, "rate": 0.5}
FAR = 1e6  # a bound that is not felt


def one(agent, mode="continuous", reference=RAMP, **about):
    """One agent that follows a reference, its bound far away: dy/dt = -2 (y - v_0) at rest."""
    return {
        "simulation": {"duration": 6.0, "timestep": 0.01},
        "recording": {"period": 0.05},
        "systems": {
            "a": {
                "game": {"type": "velocity-synchronization", "gap_bound": FAR,
                         "reference_velocity": reference},
                "agents": {"type": agent, "count": 1},
                "initial": {"action": [0.4]},
                "controller": {"mode": mode},
                **about,
            }
        },
    }  # fmt: skip


@pytest.mark.parametrize("mode", ["continuous", "implicit"])
def test_one_integrator_lags_by_the_rate_over_mu_and_its_bound_says_so(mode):
    found = run(one("integrator", mode)).reports["a"]["tracking"]
    assert found["within"]
    assert found["largest_rate"] == pytest.approx(0.5, abs=1e-5)
    assert found["largest_rate_bound"] == pytest.approx(0.5, abs=1e-5)
    assert found["largest_distance"] == pytest.approx(0.4)
    # e' = -2 e - v: 0.25 behind, up to what is left of the start
    assert found["final_distance"] == pytest.approx(0.25, abs=1e-3)
    assert found["final_bound"] == pytest.approx(0.25, abs=1e-3)


def test_cascades_are_within_their_bound():
    swing = {"type": "sine", "mean": 0.0, "amplitude": 1.0, "period": 5.0}
    found = run(one("pi-cascade", reference=swing)).reports["a"]["tracking"]
    assert found["within"]
    assert found["final_bound"] < 10.0 * found["largest_distance"]


@pytest.mark.parametrize(
    ("law", "kept"),
    [({"information": "full"}, True), ({"information": "distributed", "epsilon": 0.1}, False)],
)
def test_certify_speaks_of_a_penalty_that_falls(law, kept):
    """Theorem 6, of laws whose barrier is at the outputs as they are."""
    barrier = {"rho": 1.0, "schedule": "halving", "floor": 1e-3}
    tables = one("integrator", reference=0.0, barrier=barrier)
    tables["systems"]["a"]["controller"] |= law
    scenario = load_scenario(tables)
    found = certify(scenario.system_objects()[0], scenario.clock())
    assert ("in continuous time every shared constraint holds while the penalty falls"
            in found.guaranteed) == kept  # fmt: skip
    assert any(
        "kept while the penalty falls: its barrier" in each for each in found.not_certified
    ) == (not kept)


def test_a_cost_without_bound_at_the_boundary_makes_it_an_assumption():
    """From y = 1, dy/dt = -1/(2 y) + 0.1/y: it does leave."""
    game = gm.game(
        2, lambda i, y, p: 0.5 * np.log(y[i]), lambda y, p: [y[0] >= 0, y[1] >= 0, y.sum() <= 4]
    )
    falls = {"barrier.schedule": "exponential", "barrier.floor": 1e-3}
    made = gm.setup(game, falls, agents=gm.integrators(2), law=gm.full_information(), rho=0.1)
    (kept,) = gm.certify(made).guaranteed
    assert kept.startswith("in continuous time every shared constraint holds while the penalty")
    assert kept.endswith("provided [bounded F] F is bounded over the set, up to its boundary")


def test_of_robots_the_distance_is_told_and_why_there_is_no_bound():
    report = run(one("flexible-robot", "sampled")).reports["a"]
    assert report["tracking"]["within"] is None
    assert "inertia" in report["tracking"]["not_known"]
    assert not report["lyapunov"]["known"]


@pytest.mark.parametrize("schedule", ["exponential", "halving"])
def test_penalties_that_fall_are_followed_within_a_bound(schedule):
    barrier = {"rho": 1.0, "schedule": schedule, "time_constant": 0.5, "floor": 1e-3}
    tables = one("integrator", reference=0.0, barrier=barrier)
    game = tables["systems"]["a"]["game"]
    game |= {"gap_bound": 1.0, "desired_velocity": 2.0, "desired_weight": 1.0}
    found = run(tables).reports["a"]["tracking"]
    assert found["penalty"]
    assert not found["game"]
    assert found["within"]
    assert found["final_bound"] < 0.02


def test_the_rate_of_the_equilibrium_is_that_of_its_differences():
    tables = one("integrator")
    tables["systems"]["a"]["game"] |= {
        "gap_bound": {"type": "sine", "mean": 1.0, "amplitude": 0.3, "period": 3.0},
        "desired_velocity": 3.0, "desired_weight": 1.0, "reference_velocity": 0.0,
    }  # fmt: skip
    path = load_scenario(tables).system_objects()[0].path
    for time in (0.3, 1.0, 2.2):
        moved = np.linalg.norm(path.actions([time + 1e-3])[0] - path.actions([time - 1e-3])[0])
        assert path.at(time).rate == pytest.approx(moved / 2e-3, rel=1e-4)
        assert path.at(time).rate <= path.at(time).push / 4.0  # mu = 2 + 2 w


def test_a_game_that_stands_still_has_a_path_too():
    path = EquilibriumPath(velocity_game(2, 3.0, 1.0), lambda time: 0.1, [2.5, 2.5])
    np.testing.assert_allclose(path.actions([0.0, 1.0]), 3.0, atol=1e-9)
    assert path.at(1.0).rate < 1e-6


def test_certify_speaks_of_the_motion():
    scenario = load_scenario(one("integrator"))
    found = certify(scenario.system_objects()[0], scenario.clock())
    assert found.moving["keys"] == ["reference_velocity"]
    assert found.moving["equilibrium_rate"] == pytest.approx(0.5, abs=1e-5)
    assert found.status == "not certified"
    assert any("finite rates" in sentence for sentence in found.guaranteed)
    assert any("which moves" in sentence for sentence in found.not_certified)
    assert "reference_velocity at up to 0.5 per s" in str(found)
