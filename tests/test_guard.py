"""Control periods that are cut before they lead outside: ``between = "guarded"``."""

import itertools
from dataclasses import replace

import numpy as np
import pytest
from builders import (
    FIVE,
    UNEQUAL,
    V0,
    distributed,
    robot_state,
    robot_system,
    robots,
    run_loop,
)

import gne_mj as gm
import reference
import reference_games
from gne_mj import graph as graphs
from gne_mj.controllers import PartialInformation
from gne_mj.errors import InvalidInput
from gne_mj.faults import MessageLoss, Push, SensorDelay
from gne_mj.games import velocity_game
from gne_mj.loops import monitor as watch
from gne_mj.margins import Disturbance, errors_ahead, influence, with_margin
from gne_mj.simulation import Simulation
from gne_mj.system import Clock, System
from gne_mj.theory import certify, report_text

RHO, H, PERIOD = 0.1, 0.005, 20
GAME = reference_games.VelocityGame(V0, np.full(5, 3.0))
# so far off that within 0.1 s springs carry robots out and back
WILD = robot_state(
    np.add(V0, [2.9, 0.2, -2.4, 0.3, 2.9]), extension=[20.0, -20, 20, -20, 20],
    appendage=[-15.0, 20, -20, 20, -15],
)  # fmt: skip


def guarded(state=WILD, **options):
    return robot_system(
        state, **{"mode": "implicit", "integrator": "euler", "between": "guarded", **options}
    )


def run(system, periods=20):
    """States, inputs and the loop, every step being recorded."""
    state, u, _, loop = run_loop(system, H, PERIOD * periods, control=H * PERIOD)
    return state, u, loop


def worst(system, state):
    """The greatest g at any recorded step."""
    return np.max(system.game.constraints(state[:, :, 1]))


@pytest.mark.parametrize("decentralised", [False, True])
def test_no_step_is_outside_where_without_a_guard_some_is(decentralised):
    system = guarded(decentralised=decentralised)
    open_loop = run(replace(system, between="watched"))[2]
    assert open_loop.monitor.exit == watch.LEFT_SET
    assert open_loop.monitor.exit_between == 1.0
    state, _, loop = run(system)
    assert loop.monitor.exit == watch.INSIDE
    assert len(state) == 20 * PERIOD + 1
    assert worst(system, state) < 0.0
    assert 0 < loop.monitor.cut < 100
    assert H <= loop.monitor.shortest_period < PERIOD * H
    assert loop.monitor.unsolved == 0


def ends_of(u):
    """The steps at which inputs begin, found from the recorded ones alone."""
    changed = np.any(np.diff(u[:-1], axis=0) != 0.0, axis=1)
    return np.concatenate([[0], 1 + np.flatnonzero(changed), [len(u) - 1]])


def test_the_input_is_the_law_at_the_end_of_the_shortened_period():
    """Against the law in plain Python at what the plant then reaches."""
    state, u, loop = run(guarded())
    ends = ends_of(u)
    assert set(range(0, 20 * PERIOD + 1, PERIOD)) <= set(ends.tolist())  # the clock's own remain
    assert np.min(np.diff(ends)) * H == pytest.approx(loop.monitor.shortest_period)
    assert loop.monitor.solutions == len(ends)  # the last one is the run's end
    for begin, end in itertools.pairwise(ends):
        expected = reference.full_information(GAME, RHO, state[end, :, 1])
        assert np.max(np.abs(u[begin] - expected)) < 2e-5 * np.max(np.abs(expected))
    assert loop.monitor.prediction < 1e-8


def test_where_nothing_is_cut_the_run_is_what_it_is_without_a_guard():
    """Estimates included, which move by a propagator of one step in place of one period's."""
    law = PartialInformation(graphs.ring(5), 2.0, 0.5)
    systems = [
        guarded(robot_state(FIVE), numbers=UNEQUAL, law=law, between=between)
        for between in ("watched", "guarded")
    ]
    (state, u, memory, _), (ours, ours_u, ours_memory, loop) = (
        run_loop(system, H, 10 * PERIOD, control=H * PERIOD) for system in systems
    )
    assert loop.monitor.cut == 0
    for got, expected in ((ours, state), (ours_u, u)):
        np.testing.assert_allclose(got, expected, rtol=1e-9, atol=1e-9)
    at = np.arange(0, 10 * PERIOD + 1, PERIOD)
    np.testing.assert_allclose(ours_memory[at], memory[at], rtol=1e-9, atol=1e-9)


def test_mode_sampled_holds_as_long_as_that_leads_inside_and_ends_before_it_leaves():
    y = np.add(V0, [2.9, 0.2, -2.6, 0.3, 2.9])
    milder = robot_state(y, appendage=np.add(V0, [10.9, -8.0, 8.0, -8.0, 10.9]))
    system = guarded(milder, mode="sampled", rho=0.3)
    state, u, loop = run(system)
    open_loop = run(replace(system, between="watched"))[2]
    assert open_loop.monitor.exit == watch.LEFT_SET
    assert loop.monitor.exit == watch.INSIDE
    assert worst(system, state) < 0.0
    assert loop.monitor.cut > 0
    for begin in ends_of(u)[:-1]:
        expected = reference.full_information(GAME, 0.3, state[begin, :, 1])
        np.testing.assert_allclose(u[begin], expected, rtol=1e-9, atol=1e-9)
    near = robot_state(np.full(5, V0 + 2.9999), extension=200.0)
    timing = Clock(1.0, H, H * PERIOD, H)
    (report,) = Simulation([guarded(near, mode="sampled")], timing).run().reports.values()
    assert report["status"] == "exit_foreseen"
    assert "would violate constraint 'gap of agent 1'" in report["message"]
    assert "mode 'implicit'" in report["message"]
    assert report["exit"]["at_control_instant"]


@pytest.mark.slow  # compiles, or starts programs, for seconds
def test_pushes_within_a_margin_lead_outside_at_no_step():
    """Against an adversary, whichever way it pushes; and what is left out without noise is told."""
    rng, agents = np.random.default_rng(3), robots(UNEQUAL)
    bound = Disturbance(np.full(5, 2.0), np.full(5, 1e-3))
    game = with_margin(velocity_game(5, V0, 3.0), agents, bound, H, "euler", PERIOD, True)
    pushes = tuple(
        Push(agents=(i,), force=2.0 * rng.choice([-1, 1]), profile="square", period=0.4)
        for i in range(5)
    )
    state = robot_state(V0 + np.cumsum([1.5, -1.5, 1.5, -1.5, 1.5]), appendage=[9.0, -5, 9, -5, 9])
    one = guarded(state)
    system = System(
        "robots", game, agents, one.law, RHO, state, mode="implicit", integrator="euler",
        between="guarded", disturbance=bound, faults=pushes,
    )  # fmt: skip
    states, _, loop = run(system, 40)
    assert loop.monitor.exit == watch.INSIDE
    assert np.max(game.constraints(states[:, :, 1])) < 0.0
    assert certify(system, Clock(1.0, H, H * PERIOD, 0.1)).held["promised"]


def test_errors_on_the_way_grow_into_those_of_the_period():
    bound = Disturbance(np.full(5, 2.0), np.full(5, 0.1))
    for integrator in ("euler", "rk4"):
        ahead = errors_ahead(robots(UNEQUAL), H, integrator, 7, bound)
        for steps in (1, 4, 7):
            expected = influence(robots(UNEQUAL), H, integrator, steps).of(bound)
            np.testing.assert_allclose(ahead[steps - 1], expected, rtol=1e-12)


@pytest.mark.slow
def test_mujoco_and_the_ode_agree():
    got, expected = (run(guarded(engine=engine), 5)[:2] for engine in ("mujoco", "ode"))
    for ours, theirs in zip(got, expected, strict=True):
        np.testing.assert_allclose(ours, theirs, rtol=1e-6, atol=1e-6)


@pytest.mark.slow
def test_messages_that_are_lost_are_those_of_the_clocks_own_instants():
    """With and without a guard: the same arrive, and what was heard stays within a period."""
    law = PartialInformation(graphs.ring(5), 2.0, 0.5)
    system = guarded(law=law, faults=(MessageLoss(probability=0.5),), seed=4)
    _, _, memory, loop = run_loop(system, H, 20 * PERIOD, control=H * PERIOD)
    assert loop.monitor.cut > 0
    assert loop.monitor.exit == watch.INSIDE
    heard = memory[:, 25:75].reshape(-1, 10, 5)  # ten links, a row of five each
    changed = np.any(np.diff(heard, axis=0) != 0.0, axis=2)
    assert set(np.flatnonzero(changed.any(axis=1)) + 1) <= set(range(0, 401, PERIOD))
    assert 0.3 < np.mean(changed[PERIOD - 1 :: PERIOD]) < 0.7


def test_what_is_certified_and_reported():
    timing = Clock(2.0, H, H * PERIOD, 0.1)
    told = certify(guarded(), timing)
    assert told.held["promised"]
    assert "at every integration step" in told.guaranteed[0]
    assert "an integration step, down to which periods are cut" in "\n".join(report_text(told))
    assert any("between two integration steps" in line for line in told.not_certified)
    sampled = certify(guarded(mode="sampled"), timing)
    assert "exit_foreseen" in sampled.guaranteed[0]
    trajectory = Simulation([guarded()], timing).run()
    report = trajectory.reports["robots"]
    assert report["between"]["periods_cut"] > 0
    assert report["between"]["first_cut"] == pytest.approx(0.1)
    assert H <= report["between"]["shortest_period"] < H * PERIOD
    assert "cut before they led outside" in str(trajectory)
    calm = Simulation([guarded(robot_state(FIVE))], timing).run().reports["robots"]["between"]
    assert calm == {"periods_cut": 0, "first_cut": None, "shortest_period": None}


@pytest.mark.parametrize(
    ("options", "what"),
    [
        ({"mode": "continuous"}, "modes 'sampled' and 'implicit'"),
        ({"between": "watchful"}, "'watched' or 'guarded'"),
        ({"faults": (SensorDelay(periods=1),)}, "late sensors"),
        ({"disturbance": Disturbance(np.ones(5), np.ones(5), 1)}, "late sensors"),
        ({"law": distributed("ring", count=5)}, "full and partial information"),
    ],
)
def test_what_loses_its_meaning_is_refused(options, what):
    with pytest.raises(InvalidInput, match=what) as error:
        guarded(robot_state(FIVE), **options)
    assert error.value.key == "between"


def test_the_key_of_a_file_is_named_and_stays_during_a_run():
    with pytest.raises(InvalidInput, match=r"systems\.robots\.controller\.between"):
        gm.load_scenario("velocity-sync", {"controller.between": "guarded"}).simulation_object()
    held = {"controller.mode": "implicit", "simulation.control_period": 0.1}
    simulation = gm.load_scenario("velocity-sync", held).simulation_object()
    with pytest.raises(InvalidInput, match="it stays as it is"):
        simulation.change({"controller.between": "guarded"})
