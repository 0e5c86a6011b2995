"""Observers of loads: what besides inputs moves agents is estimated, and taken into account."""

import numpy as np
import pytest
from builders import FIVE, UNEQUAL, V0, clock, robot_state, robot_system, robots, run_loop

import gne_mj as gm
from gne_mj.errors import InvalidInput
from gne_mj.faults import Noise, Push, SensorDelay
from gne_mj.games import velocity_game
from gne_mj.load_margins import beyond_estimates, shrinking
from gne_mj.loops import monitor as watch
from gne_mj.margins import Disturbance, influence, with_margin
from gne_mj.simulation import Simulation
from gne_mj.system import Clock
from gne_mj.theory import certify, report_text
from gne_mj.theory.disturbances import greatest_change, unknown_at_start

H, STEPS = 0.002, 5
SIGNS = (1.0, -1.0, 1.0, -1.0, 1.0)


def pushes(size=5.0, **course):
    return tuple(Push(agents=(i,), force=size * sign, **course) for i, sign in enumerate(SIGNS))


def observed(state=None, **options):
    state = robot_state(FIVE) if state is None else state
    given = {"mode": "implicit", "integrator": "euler", "observer": 1.0, "faults": pushes()}
    return robot_system(state, **{**given, **options})


def run(system, periods, steps=STEPS):
    state, u, memory, loop = run_loop(system, H, periods * steps, control=H * steps)
    return state, u, memory[:, -5:], loop


@pytest.mark.parametrize("gain", [1.0, 0.3])
def test_constant_pushes_are_removed_without_a_margin(gain):
    """5 N on each of five robots, held for 10 ms: without an observer the set is left."""
    system = observed(observer=gain)
    state, u, loads, loop = run(system, 3000)
    assert loop.monitor.exit == watch.INSIDE
    assert np.max(np.abs(state[-1, :, 1] - system.equilibrium.action)) < 1e-6
    np.testing.assert_allclose(loads[-1], np.multiply(5.0, SIGNS), rtol=1e-6)
    np.testing.assert_allclose(u[-2], -loads[-2], atol=1e-5)  # which is all that inputs do at last
    assert loop.monitor.load == pytest.approx(5.0, rel=0.2)
    left = robot_system(
        robot_state(FIVE), mode="implicit", integrator="euler", faults=system.faults
    )
    assert run_loop(left, H, 2000, control=H * STEPS)[3].monitor.exit == watch.LEFT_SET


def test_of_one_euler_step_the_first_innovation_tells_the_load():
    """s = h / M exactly, whatever the spring does."""
    state = robot_state(FIVE, extension=[0.5, -1, 0, 2, 0.3], appendage=np.add(FIVE, 1.0))
    _, _, loads, loop = run(observed(state, numbers=UNEQUAL, observer=0.25), 8, steps=1)
    expected = np.multiply(5.0, SIGNS) * (1.0 - 0.75 ** np.arange(8))[:, None]
    # a row is written when its instant is over
    np.testing.assert_allclose(loads[:8], expected, rtol=1e-9, atol=1e-9)
    assert loop.monitor.load_change == pytest.approx(1.25)


def test_a_load_that_is_known_at_the_start_is_no_surprise():
    known = np.multiply(5.0, SIGNS)
    _, _, loads, loop = run(observed(load=known), 50)
    assert loop.monitor.prediction < 1e-9
    np.testing.assert_allclose(loads, np.tile(known, (len(loads), 1)), rtol=1e-8)


def test_what_an_actuator_does_not_deliver_is_no_load():
    state = robot_state(FIVE, appendage=np.add(FIVE, [9.0, -9, 9, -9, 9]))
    _, u, loads, loop = run(observed(state, limit=0.5, faults=pushes(0.0)), 100)
    assert loop.monitor.saturated == 1.0
    assert np.max(np.abs(u[:-1])) == 0.5
    assert np.max(np.abs(loads)) < 1e-3  # of a spring's slope, by which the shares differ


@pytest.mark.parametrize("gain", [1.0, 0.5])
@pytest.mark.parametrize("seed", range(4))
def test_loads_within_a_margin_are_foreseen_as_well_as_it_says(gain, seed):
    """Slow pushes of any size, noise, springs that swing: the theorem's bound, and the set."""
    rng, agents = np.random.default_rng(seed), robots(UNEQUAL)
    slow = pushes(8.0, profile="sine", period=float(rng.uniform(2.0, 5.0)))
    faults = (*slow, Noise(amplitude=1e-5))
    change = 2 * np.pi * 8.0 / slow[0].period * H * STEPS
    bound = Disturbance(np.zeros(5), np.full(5, 1e-5), 0, np.full(5, change))
    unforeseen = beyond_estimates(agents, H, "euler", STEPS, bound, gain)
    game = with_margin(velocity_game(5, V0, 3.0), agents, unforeseen, H, "euler", STEPS)
    y = V0 + np.cumsum(np.sqrt(9.0 - game.margins) * rng.uniform(-0.99, 0.99, 5))
    state = robot_state(y, extension=rng.normal(size=5), appendage=y + rng.normal(size=5))
    one = observed(state, numbers=UNEQUAL, observer=gain, faults=faults, seed=seed)
    system = type(one)(
        "robots", game, agents, one.law, 0.1, one.state, mode="implicit", integrator="euler",
        observer=gain, faults=faults, disturbance=bound, seed=seed,
    )  # fmt: skip
    told = certify(system, Clock(1.0, H, H * STEPS, 0.1))
    assert told.held["promised"]
    loop = system.closed_loop(clock(H, 4.0, H * STEPS))
    rows = loop.advance(2000, 1)
    assert loop.monitor.exit == watch.INSIDE
    assert np.max(velocity_game(5, V0, 3.0).constraints(rows.state[:, :, 1])) < 0.0
    off = np.abs(rows.applied - rows.input - rows.memory[:, -5:])
    assert np.all(off <= unforeseen.push * (1 + 1e-9))
    assert np.max(off) > 0.05 * np.max(unforeseen.push)  # which is not far from what happens


def test_the_factor_by_which_errors_shrink():
    effect = influence(robots(UNEQUAL), H, "euler", 1)
    for gain in (1.0, 0.4):
        q, kappa = shrinking(effect, gain)
        np.testing.assert_allclose(kappa, 1.0, rtol=1e-9)
        np.testing.assert_allclose(q, 1.0 - gain, atol=1e-9)
    bound = Disturbance(np.full(5, 3.0), np.zeros(5), 0, np.full(5, 0.5))
    found = beyond_estimates(robots(UNEQUAL), H, "euler", 1, bound, 1.0)
    np.testing.assert_allclose(found.push, 3.5)  # the start's error, and a change
    quiet = Disturbance(np.zeros(5), np.zeros(5), 0, np.full(5, 0.5))
    found = beyond_estimates(robots(UNEQUAL), H, "euler", 1, quiet, 1.0)
    np.testing.assert_allclose(found.push, 1.5, rtol=1e-9)
    assert beyond_estimates(robots(UNEQUAL), H, "euler", 1, quiet, 0.0) is quiet
    with pytest.raises(InvalidInput, match="a smaller gain or a shorter control period"):
        beyond_estimates(robots(UNEQUAL), H, "euler", 400, quiet, 1.0)


def test_what_pushes_do_at_the_start_and_in_a_period():
    system = observed(faults=(Push(force=2.0), Push(force=1.0, profile="square", start=1.0),
                              Push(force=3.0, profile="sine", period=10.0)),
                      load=np.full(5, 1.5))  # fmt: skip
    np.testing.assert_allclose(unknown_at_start(system), 0.5)
    np.testing.assert_allclose(greatest_change(system, 0.01), 2.0 + 2 * np.pi * 3.0 * 0.01 / 10.0)


def test_what_is_certified_and_reported():
    keys = {
        "controller.mode": "implicit", "simulation.control_period": 0.01,
        "simulation.integrator": "euler", "simulation.duration": 5.0, "plant.engine": "ode",
        "controller.observer": 1.0, "margin": {"push": 5.0, "push_change": 0.1},
        "faults": [{"type": "push", "force": 5.0}],
    }  # fmt: skip
    scenario = gm.load_scenario("velocity-sync", keys)
    told = certify(scenario.system_objects()[0], scenario.clock())
    assert told.held["promised"]
    assert told.held["observer"]["shrinks"] < 0.1
    text = "\n".join(report_text(told))
    assert "estimated by each agent with gain 1; constant ones are removed" in text
    sudden = {**keys, "faults": [{"type": "push", "force": 1.0, "start": 2.0}]}
    scenario = gm.load_scenario("velocity-sync", sudden)
    told = certify(scenario.system_objects()[0], scenario.clock())
    assert not told.held["promised"]
    assert any("a change of a push in a period of 1" in line for line in told.not_certified)
    trajectory = Simulation([observed()], Clock(2.0, H, H * STEPS, 0.1)).run()
    data = trajectory["robots"]
    assert data["load"].dims == ("time", "agent")
    assert data["load"].attrs["units"] == "N"
    np.testing.assert_allclose(data["load"].values[-1], np.multiply(5.0, SIGNS), rtol=1e-3)
    assert "memory" not in data
    report = trajectory.reports["robots"]["implicit"]
    assert report["largest_load"] == pytest.approx(5.0, rel=0.05)
    assert "loads of up to" in str(trajectory)


@pytest.mark.parametrize(
    ("options", "key", "what"),
    [
        ({"mode": "sampled"}, "observer", "use mode 'implicit'"),
        ({"observer": 1.5}, "observer", "from 0"),
        ({"faults": (SensorDelay(periods=1),)}, "observer", "late sensors"),
        ({"load": np.ones(3)}, "load", "5 finite numbers"),
        ({"load": np.ones(5), "observer": 0.0}, "load", "controller.observer"),
        ({"observer": 0.0, "disturbance": Disturbance(np.ones(5), np.ones(5), 0, np.ones(5))},
         "disturbance", "push_change"),
    ],
)  # fmt: skip
def test_what_loses_its_meaning_is_refused(options, key, what):
    with pytest.raises(InvalidInput, match=what) as error:
        observed(**options)
    assert error.value.key == key
