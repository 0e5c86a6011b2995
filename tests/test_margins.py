"""Margins: what disturbances can do within a control period, and barriers that leave room."""

from dataclasses import replace

import numpy as np
import pytest
from builders import (
    EQUAL,
    UNEQUAL,
    V0,
    integrators,
    pi_cascades,
    random_consensus,
    robot_state,
    robots,
)
from hypothesis import given, settings
from hypothesis import strategies as st
from position_games import random_formation

import gne_mj as gm
from gne_mj.controllers import FullInformation
from gne_mj.epsilon import epsilon_bounds
from gne_mj.equilibrium import measured_epsilon, penalised_equilibrium
from gne_mj.errors import InfeasibleStart, InvalidInput
from gne_mj.faults import Noise, Push, SensorDelay
from gne_mj.games import (
    cournot_game,
    formation_game,
    osnr_game,
    platoon_game,
    region_of,
    ten_channels,
    velocity_consensus_game,
    velocity_game,
)
from gne_mj.loops import monitor as watch
from gne_mj.margins import (
    Disturbance,
    influence,
    largest_push,
    of_the_set,
    tightening,
)
from gne_mj.plants.ode import OdePlant
from gne_mj.scenario import load_scenario
from gne_mj.system import Clock, System
from gne_mj.theory import certify, report_text, search_period, search_push


def random_robots(rng, count=5):
    return robots({name: list(np.exp(rng.uniform(-1.2, 1.2, count))) for name in EQUAL})


@given(
    st.integers(0, 2**32 - 1), st.sampled_from(["euler", "rk4"]), st.sampled_from([1, 7, 40]),
    st.sampled_from(["robots", "integrators", "pi"]),
)  # fmt: skip
@settings(max_examples=60)
def test_no_push_and_no_error_of_an_output_does_more(seed, integrator, steps, kind):
    """Any course of pushes within the bound, from any state, through the plant itself."""
    rng, h = np.random.default_rng(seed), 0.005
    agents = {"robots": random_robots(rng), "integrators": integrators(5), "pi": pi_cascades(5)}[
        kind
    ]
    effect = influence(agents, h, integrator, steps)
    state = rng.normal(size=(5, agents.states)) * rng.choice([0.1, 3.0, 30.0])
    u = rng.normal(size=5) * 5.0
    plant = OdePlant(agents, h, integrator)
    plant.reset(state)
    plant.step(u, steps)
    expected = plant.output
    plant.reset(state)
    course = rng.choice([-1.0, 1.0], (steps, 5)) if rng.random() < 0.5 else np.ones((steps, 5))
    for push in course:
        plant.step(u + push)
    assert np.all(np.abs(plant.output - expected) <= effect.push_gain * (1 + 1e-9))
    if np.all(course == 1.0):
        assert np.all(plant.output - expected >= effect.least_slope * (1 - 1e-9))
        if effect.exact:
            assert np.allclose(plant.output - expected, effect.least_slope, rtol=1e-6)
    wrong = state.copy()
    wrong[:, agents.kind.OUTPUT] += 1.0
    plant.reset(wrong)
    plant.step(u, steps)
    assert np.all(np.abs(plant.output - expected) <= effect.noise_gain * (1 + 1e-9) + 1e-12)


def test_bounds_take_the_greater_entries_of_a_spring_at_rest_and_far_out():
    """Against the map's derivatives by differences, whose absolute values are multiplied out."""
    agents, h, steps = robots(UNEQUAL), 0.005, 60
    effect = influence(agents, h, "euler", steps)
    plant, n, out = OdePlant(agents, h, "euler"), agents.states, agents.kind.OUTPUT

    def step_from(state, u):
        plant.reset(state)
        plant.step(u)
        return plant.state

    none, one = np.zeros(5), np.ones(5)
    slopes = []
    for extension, size in ((0.0, 1e-6), (1e7, 1.0)):
        middle = np.zeros((5, n))
        middle[:, 0] = extension
        from_middle = step_from(middle, none)
        slope = np.empty((5, n, n))
        for column in range(n):
            moved = middle.copy()
            moved[:, column] += size
            slope[:, :, column] = (step_from(moved, none) - from_middle) / size
        slopes.append(np.abs(slope))
        push = np.abs(step_from(np.zeros((5, n)), one))
    greater, less = np.maximum(*slopes), np.minimum(*slopes)
    gains = []
    for matrix in (greater, less):
        pushed, read = np.zeros((5, n)), np.zeros((5, n))
        read[:, out] = 1.0
        for _ in range(steps):
            pushed = np.einsum("rij,rj->ri", matrix, pushed) + push
            read = np.einsum("rij,rj->ri", matrix, read)
        gains.append((pushed[:, out], read[:, out]))
    bent = np.array(UNEQUAL["atan_coefficient"]) > 0  # the others are linear, and exact
    assert np.sum(bent) == 4
    assert np.allclose(effect.push_gain[bent], gains[0][0][bent], rtol=1e-5)
    assert np.allclose(effect.noise_gain[bent], gains[0][1][bent], rtol=1e-5)
    assert np.all(effect.noise_gain[bent] > (1.0 + 1e-3) * gains[1][1][bent])


def test_bounds_are_close_for_short_periods():
    effect = influence(robots(EQUAL), 0.002, "euler", 5)
    assert np.allclose(effect.push_gain, 0.01, rtol=0.01)
    assert np.allclose(effect.least_slope, 0.01, rtol=0.01)
    assert np.allclose(effect.noise_gain, 1.0, rtol=0.02)
    exact = influence(integrators(2), 0.01, "rk4", 30)
    assert np.allclose(exact.push_gain, 0.3)
    assert exact.exact


def test_a_delay_lengthens_the_horizon():
    one, three = (influence(robots(EQUAL), 0.002, "euler", 5, delay) for delay in (0, 2))
    direct = influence(robots(EQUAL), 0.002, "euler", 15)
    assert np.array_equal(three.push_gain, direct.push_gain)
    assert np.array_equal(three.least_slope, one.least_slope), "an input is held for one period"


def test_sensors_less_late_than_they_may_be_are_covered():
    """Errors of a reading fade on their way, so that the worst delay need not be the longest."""
    effect = influence(pi_cascades(2, v=8.0, k=0.5), 0.1, "euler", 1, 3)
    without = influence(pi_cascades(2, v=8.0, k=0.5), 0.1, "euler", 1, 0)
    assert np.all(effect.noise_gain >= without.noise_gain)
    assert np.all(effect.noise_gain >= 0.2 * (1 - 1e-9))


def test_constraints_that_only_look_affine_in_one_point_are_refused():
    from types import SimpleNamespace

    game = SimpleNamespace(
        name="cubic", actions=1, box=None, gap_bounds=None, constraint_class=None,
        constraints_count=1,
        weighted_constraint_hessian=lambda y, w: np.array([[6.0 * y[0] * w[0]]]),
        constraint_jacobian=lambda y: np.array([[3.0 * y[0] ** 2]]),
    )  # fmt: skip
    with pytest.raises(InvalidInput, match="affine constraints and bounds on gaps"):
        tightening(game, np.array([0.3]))


GAMES = {
    "line": lambda: velocity_game(3, V0, [3.0, 2.0, 1.0]),
    "plane": lambda: velocity_consensus_game([(0, 1)], [1.0, 0.0], [1.0, 0.0], 1.5, 2.0),
    "OSNR": lambda: osnr_game(**ten_channels()),
    "Cournot": lambda: cournot_game(3),
    "platoon": lambda: platoon_game(4),
    # sides are affine, links and discs bounds on gaps
    "formation": lambda: random_formation(8, count=3).game,
}


@pytest.mark.parametrize("name", GAMES)
def test_inside_the_tightened_set_no_such_error_leads_out(name):
    game = GAMES[name]()
    rng = np.random.default_rng(len(name))
    error = rng.uniform(0.0, 0.05, game.actions)
    t = tightening(game, error)
    center, reach = 0.5 * (game.box[0] + game.box[1]), game.box[1] - game.box[0]
    if name == "OSNR":
        center = np.full(10, 0.12)
    closest = np.inf
    for _ in range(300):
        ray = rng.normal(size=game.actions) * reach
        low, high = 0.0, 1.0
        for _ in range(60):
            middle = 0.5 * (low + high)
            inside = np.all(game.constraints(center + middle * ray) + t < 0)
            low, high = (middle, high) if inside else (low, middle)
        y = center + low * ray
        for corner in rng.choice([-1.0, 1.0], (40, game.actions)):
            worst = np.max(game.constraints(y + corner * error) + 0 * t)
            assert worst <= 1e-9
            closest = min(closest, -worst / np.max(t))
    assert closest < 0.35, "and no more is given away than needed"


def test_a_quadratic_constraint_is_a_bound_on_a_gap_that_is_found():
    """The same set as bounds on gaps that are declared, beside sides that are affine."""
    numbers = {
        "desired_place": np.zeros((3, 2)), "edges": [(0, 1), (2, 1)], "place_weight": [1, 0, 0],
        "link_length": [1.5, 2.5],
    }  # fmt: skip
    disc = {"center": [0.3, -0.2], "radius": 4.0}
    error = np.random.default_rng(0).uniform(0.0, 0.3, 6)
    declared = tightening(formation_game(region=region_of(**disc), **numbers), error)
    mixed = formation_game(region=region_of(box=[[-9, -9], [9, 9]], **disc), **numbers)
    assert mixed.gap_bounds is None
    found = tightening(mixed, error)
    curved = [0, 1, 6, 11, 16]
    np.testing.assert_allclose(found[curved], declared, rtol=1e-12)
    np.testing.assert_allclose(found[[2, 3, 4, 5]], error[[1, 0, 1, 0]], rtol=1e-12)


def test_a_parabola_has_no_margin():
    """y_1^2 <= y_2 is convex and quadratic, and no bound on a gap: it goes on for ever."""

    def constraints(y, p):
        yield "parabola", y[0] ** 2 - y[1] <= 0.0
        yield "top", y[1] <= p.top

    game = gm.game(2, lambda i, y, p: y[i] ** 2, constraints, top=4.0)
    assert game.constraint_class == "quadratic"
    with pytest.raises(InvalidInput, match="affine constraints and bounds on gaps"):
        tightening(game, np.array([0.1, 0.1]))


def test_an_error_beyond_a_bound_is_refused():
    with pytest.raises(InvalidInput, match=r"error: got .?2.*gap of agent 2.*shorter control"):
        tightening(velocity_game(2, V0, [9.0, 1.5]), np.array([1.0, 1.0]))


def test_the_largest_push_is_the_one_that_the_tightening_was_made_for():
    game, effect = velocity_game(5, V0, 3.0), influence(robots(EQUAL), 0.002, "euler", 5)
    bound = Disturbance(np.full(5, 2.5), np.full(5, 0.01))
    t = tightening(game, effect.of(bound))
    assert largest_push(game, effect, bound, t) == pytest.approx(2.5, rel=1e-9)
    assert largest_push(game, effect, bound, np.zeros(5)) == 0.0
    assert largest_push(game, effect, Disturbance(np.zeros(5), np.full(5, 9.0)), t) == 0.0


def disturbed(seed, **options):
    """Robots with a margin and disturbances within it."""
    rng = np.random.default_rng(seed)
    push, noise, delay = rng.uniform(0.5, 20.0), rng.uniform(0.0, 0.02), int(rng.integers(0, 3))
    steps = int(rng.integers(1, 6))
    agents = random_robots(rng)
    bound = Disturbance(np.full(5, push), np.full(5, noise), delay)
    game = velocity_game(5, V0, 3.0)
    effect = influence(agents, 0.002, "euler", steps, delay)
    try:
        game = game.tightened(tightening(game, effect.of(bound)))
    except InvalidInput:
        return None
    gaps = np.sqrt(9.0 - game.margins) * rng.uniform(-0.999, 0.999, 5)
    y = V0 + np.cumsum(gaps)
    profile = str(rng.choice(["constant", "square", "random"]))
    pushes = tuple(
        Push(
            agents=(i,), force=push * rng.choice([-1, 1]), profile=profile,
            period=0.002 * steps * int(rng.integers(1, 30)),
        )
        for i in range(5)
    )  # fmt: skip
    faults = (*pushes, Noise(amplitude=noise), *([SensorDelay(periods=delay)] if delay else []))
    system = System(
        "robots", game, agents, FullInformation(), 10.0 ** rng.uniform(-3, 0), robot_state(y),
        mode="implicit", integrator="euler", faults=faults, seed=seed, disturbance=bound,
    )  # fmt: skip
    return system, Clock(0.4 * steps, 0.002, 0.002 * steps, 0.4 * steps)


@pytest.mark.slow
def test_within_the_bounds_nothing_leaves():
    """And beyond them something does, with the same margins: they are not idle."""
    tried = left = 0
    for seed in range(40):
        drawn = disturbed(seed)
        if drawn is None:
            continue
        system, clock = drawn
        tried += 1
        loop = system.closed_loop(clock)
        loop.advance(1, clock.steps(clock.duration))
        assert loop.monitor.exit == watch.INSIDE, seed
        assert certify(system, clock).held["promised"]
        if tried <= 15:
            stronger = tuple(
                replace(f, force=8.0 * f.force)
                if isinstance(f, Push) else f for f in system.faults
            )  # fmt: skip
            beyond = System(
                "robots", system.game, system.agents, system.law, system.rho, system.state,
                mode="implicit", integrator="euler", faults=stronger, seed=seed,
                disturbance=system.disturbance,
            )  # fmt: skip
            loop = beyond.closed_loop(clock)
            loop.advance(1, clock.steps(clock.duration))
            left += loop.monitor.exit != watch.INSIDE
            assert not certify(beyond, clock).held["promised"]
    assert tried >= 25
    assert left >= 5


MARGIN = {
    "controller.mode": "implicit", "plant": {"engine": "ode", "integrator": "euler"},
    "simulation.timestep": 0.01, "simulation.duration": 2.0, "margin": {"push": 3.0},
}  # fmt: skip


def test_a_scenario_declares_bounds_and_certify_tells_what_they_cost():
    scenario = load_scenario("velocity-sync", MARGIN)
    (system,) = scenario.system_objects()
    error = 2 * 0.01 * 3.0  # both robots of a gap, unit masses, one Euler step
    expected = 2 * 3.0 * error - error**2
    assert np.allclose(system.game.margins, [expected - 0, *[expected] * 4], rtol=0.51)
    assert system.game.margins[1] == pytest.approx(expected)
    report = certify(system, scenario.clock())
    held = report.held
    assert report.status == "certified at control instants"
    assert held["promised"]
    assert held["largest_push"] == pytest.approx(3.0)
    assert held["prediction_error"] == pytest.approx([0.03] * 5)
    assert "at every control instant every shared constraint holds" in report.guaranteed[0]
    assert report.to_dict()["held"]["disturbance"]["push"] == [3.0] * 5


@pytest.mark.parametrize(
    ("changes", "label", "words"),
    [
        ({"faults": [{"type": "push", "force": 4.0}]}, "disturbances", "covers 3"),
        ({"faults": [{"type": "sensor-delay", "periods": 1}]}, "disturbances", "1 periods late"),
        ({"controller.decentralised": True}, "disturbances", "no room for disturbances"),
        (
            {"controller": {"information": "distributed", "epsilon": 0.1, "mode": "implicit"}},
            "law", "at estimates",
        ),
        ({"agents.input_limit": 10.0}, "inputs", "input limit"),
        ({"simulation.control_period": 2.0, "margin": {"push": 0.01}}, "dy+/du > 0", "checked"),
    ],
)  # fmt: skip
def test_what_is_not_covered_is_named(changes, label, words):
    scenario = load_scenario("velocity-sync", {**MARGIN, **changes})
    (system,) = scenario.system_objects()
    report = certify(system, scenario.clock())
    (condition,) = [c for c in report.held["conditions"] if c["label"] == label]
    assert words in condition["why"]
    assert condition["status"] != "met"
    assert report.held["promised"] == (condition["status"] == "assumed")


def test_a_margin_promises_nothing_in_other_modes():
    with pytest.raises(InvalidInput, match=r"systems.robots.margin: .*mode 'implicit'"):
        load_scenario("velocity-sync", {**MARGIN, "controller.mode": "sampled"}).system_objects()


@pytest.mark.slow
def test_what_agents_could_gain_is_asked_of_the_set_itself():
    from gne_mj.scenario import run

    report = run("velocity-sync", {**MARGIN, "simulation.duration": 0.1}).reports["robots"]
    epsilon = report["epsilon"]
    assert epsilon["measured"] <= epsilon["largest_own_bound"] <= epsilon["bound"]
    assert epsilon["bound"] == epsilon["p_rho"] + epsilon["of_margin"]
    assert epsilon["of_margin"] > 0


def tightened_game(rng):
    """A game with a margin, each in its turn, and a profile inside what is left."""
    kind = int(rng.integers(3))
    if kind == 0:
        n = int(rng.integers(2, 6))
        wishes = rng.uniform(-9, 9, n)
        game = velocity_game(
            n, V0, 3.0, desired_velocity=wishes, desired_weight=rng.uniform(0.5, 5, n)
        )
        return game.tightened(rng.uniform(0, 8.9, n)), np.full(n, V0)
    if kind == 1:
        drawn = random_consensus(int(rng.integers(2**31)), 2)
        game = drawn.game
        t = rng.uniform(0, 0.9) * game.gap_bounds**2
        return game.tightened(t), np.tile(drawn.oracle.v0, game.agents)
    n = int(rng.integers(2, 5))
    price, noise = rng.uniform(0.2, 1, n), rng.uniform(0.05, 0.5, n)
    game = osnr_game(
        price, rng.uniform(1, 3, n), rng.uniform(0.3, 1, n), noise, rng.uniform(0, 0.02, (n, n)),
        2.0,
    )  # fmt: skip
    t = np.append(rng.uniform(0, 0.1, n), rng.uniform(0, 1.0))
    return game.tightened(t), np.full(n, 0.9 / n)


def test_no_agent_can_gain_more_than_the_bound_whatever_the_margin():
    beyond_p_rho = 0
    for seed in range(40):
        rng = np.random.default_rng(seed)
        game, y = tightened_game(rng)
        found = penalised_equilibrium(game, 10.0 ** rng.uniform(-4, 0), y)
        bounds = epsilon_bounds(game, found.rho, found)
        gains = measured_epsilon(of_the_set(game), found.action)
        own = np.array(bounds["own_bound"])
        assert np.all(gains <= own * (1 + 1e-9) + 1e-9), seed
        assert np.max(own) == bounds["largest_own_bound"]
        assert np.max(own) <= bounds["bound"] * (1 + 1e-12)
        # by hand, agent by agent
        for i in range(game.agents):
            mine = [k for k, who in enumerate(game.in_constraint) if i in who]
            by_hand = sum(found.rho + found.multipliers[k] * game.margins[k] for k in mine)
            assert own[i] == pytest.approx(by_hand, rel=1e-12)
        beyond_p_rho += np.max(gains) > bounds["p_rho"]
    assert beyond_p_rho > 5  # p rho alone would be wrong


def test_certify_tells_what_the_margin_costs():
    changes = {**MARGIN, "margin": {"push": 4.0}, "initial.action": 3.0}
    scenario = load_scenario("desired-velocity", changes)
    (system,) = scenario.system_objects()
    report = certify(system, scenario.clock())
    bounds = report.to_dict()["equilibrium"]
    lost = float(system.equilibrium.multipliers @ system.game.margins)
    assert lost > 0.1
    assert bounds["of_margin"] == pytest.approx(lost)
    assert bounds["bound"] == pytest.approx(bounds["p_rho"] + lost)
    gains = measured_epsilon(of_the_set(system.game), system.equilibrium.action)
    assert np.max(gains) <= bounds["largest_own_bound"] <= bounds["bound"]
    assert f"{bounds['bound']:.4g} = p rho" in "\n".join(report_text(report))


def test_a_start_within_the_tightening_is_refused():
    with pytest.raises(InfeasibleStart, match="gap of agent 1, tightened by"):
        load_scenario(
            "velocity-sync", {**MARGIN, "initial.action": [0.01, 0.0, -1.0, 0.5, 2.0]}
        ).system_objects()


@pytest.mark.slow
def test_an_adversary_finds_a_push_that_breaks_it_and_not_far_above_the_certified_one():
    scenario = load_scenario("velocity-sync", {**MARGIN, "simulation.duration": 3.0})
    (system,) = scenario.system_objects()
    found = search_push(system, scenario.clock())
    assert found.smallest_breaking_push is not None
    assert found.pattern is not None
    assert 1.0 <= found.smallest_breaking_push / 3.0 <= 4.0
    weaker = Push(agents=(0, 1, 2, 3, 4), force=3.0)
    assert weaker.force < found.smallest_breaking_push


@pytest.mark.slow
def test_the_longest_safe_period_is_found_by_trial():
    scenario = load_scenario(
        "velocity-sync",
        {**MARGIN, "margin": {"push": 0.0}, "initial.appendage_velocity": [30, -30, 30, -30, 30],
         "simulation.duration": 4.0},
    )  # fmt: skip
    (system,) = scenario.system_objects()
    found = search_period(system, scenario.clock())
    assert found.inside is not None
    assert found.outside is not None
    assert 0.01 <= found.inside < found.outside <= 1.05 * found.inside + 0.011
    assert dict(found.trials)[found.inside]
    assert not dict(found.trials)[found.outside]


def test_a_controller_that_does_not_say_what_it_knows_knows_all():
    scenario = load_scenario(
        {
            "systems": {
                "robots": {
                    "game": {"type": "velocity-synchronization"},
                    "agents": {"type": "flexible-robot", "count": 2},
                    "controller": {"mode": "implicit"},
                }
            }
        }
    )
    (system,) = scenario.system_objects()
    assert (system.law.information, system.mode) == ("full", "implicit")
