"""Mode implicit: the held input is the law at the outputs that it produces."""

import numpy as np
import pytest
from builders import (
    EQUAL,
    FIVE,
    UNEQUAL,
    V0,
    clock,
    integrators,
    osnr_system,
    pi_cascades,
    reference_osnr,
    robot_state,
    robot_system,
    run_loop,
)
from hypothesis import given, settings
from hypothesis import strategies as st

import reference
import reference_games
from gne_mj import banded
from gne_mj import graph as graphs
from gne_mj.controllers import FullInformation, FullyDistributed, PartialInformation
from gne_mj.errors import InvalidInput
from gne_mj.games import velocity_game
from gne_mj.loops import monitor as watch
from gne_mj.simulation import Simulation
from gne_mj.system import Clock, System

RHO = 0.1
GAME = reference_games.VelocityGame(V0, np.full(5, 3.0))


def instants(system, h, periods, steps):
    """States and inputs at the control instants, the last state included, and the loop."""
    state, u, memory, loop = run_loop(system, h, periods * steps, control=h * steps, every=1)
    return state[::steps], u[: periods * steps : steps], memory[::steps], loop


@pytest.mark.parametrize(
    ("integrator", "h", "steps"),
    [("euler", 0.002, 1), ("euler", 0.005, 20), ("rk4", 0.01, 1), ("rk4", 0.01, 8)],
)
def test_the_input_is_the_law_at_the_next_outputs(integrator, h, steps):
    """Against the law in plain Python at what the plant itself then reaches."""
    start = robot_state(
        FIVE, extension=[0.5, -1, 0, 2, 0.3], appendage=np.add(FIVE, [1, -2, 3, 0, -1])
    )
    system = robot_system(start, UNEQUAL, mode="implicit", integrator=integrator)
    state, u, _, loop = instants(system, h, 60, steps)
    assert loop.monitor.exit == watch.INSIDE
    expected = [reference.full_information(GAME, RHO, y) for y in state[1:, :, 1]]
    assert np.max(np.abs(u - expected)) < 2e-6 * np.max(np.abs(expected))
    assert loop.monitor.unsolved == 0
    assert loop.monitor.not_monotone == 0
    assert loop.monitor.prediction < 1e-8
    assert loop.monitor.solutions == 61


@pytest.mark.slow
def test_mujoco_and_the_ode_agree():
    start = robot_state(FIVE, appendage=np.add(FIVE, [1, -2, 3, 0, -1]))
    got, expected = (
        instants(robot_system(start, UNEQUAL, mode="implicit", integrator="euler", engine=e),
                 0.005, 60, 4)[:2]
        for e in ("mujoco", "ode")
    )  # fmt: skip
    for ours, theirs in zip(got, expected, strict=True):
        assert np.max(np.abs(ours - theirs)) < 1e-7


@pytest.mark.slow
@pytest.mark.parametrize("steps", [1, 4])
def test_curved_bounds_in_the_plane(steps):
    """Two axes for each agent, |gap| bounded, in MuJoCo: the law in plain Python at what comes."""
    from gne_mj.games import velocity_consensus_game
    from gne_mj.plants import flexible_robot
    from gne_mj.plants.agents import Agents

    edges, v0, delta = [(0, 1), (1, 2)], np.array([1.0, -0.5]), np.array([1.0, 0.8, 1.5])
    game = velocity_consensus_game(edges, [1.0, 0.0, 0.0], v0, delta[:2], delta[2:])
    oracle = reference_games.VelocityConsensusGame(v0, edges, np.array([1.0, 0.0, 0.0]), delta)
    agents = Agents(flexible_robot, np.ones((6, 5)), np.full(6, np.inf), 2)
    y = np.add(np.tile(v0, 3), [0.9, 0.9, 0.3, 0.7, 0.2, 0.2])
    state = agents.equilibrium(y)
    state[:, 2] += [5.0, -5.0, 3.0, 0.0, -4.0, 2.0]
    system = System(
        "plane", game, agents, FullInformation(), RHO, state, mode="implicit", engine="mujoco",
        integrator="euler",
    )  # fmt: skip
    states, u, _, loop = instants(system, 0.005, 40, steps)
    assert loop.monitor.exit == watch.INSIDE
    expected = [reference.full_information(oracle, RHO, row) for row in states[1:, :, 1]]
    assert np.max(np.abs(u - expected)) < 1e-6 * np.max(np.abs(expected))


@pytest.mark.slow
def test_partial_information_is_implicit_in_the_true_outputs():
    law = PartialInformation(graphs.ring(5), 2.0, 0.5)
    system = robot_system(robot_state(FIVE), law=law, mode="implicit", integrator="euler")
    states, u, memory, loop = instants(system, 0.01, 40, 1)
    assert loop.monitor.exit == watch.INSIDE
    laplacian = reference.laplacian(5, law.graph.edges)
    for k in range(40):
        y = states[k + 1, :, 1]
        rows = memory[k].reshape(5, 5)
        for i in range(5):
            own = rows[i].copy()
            own[i] = y[i]
            heard = np.flatnonzero(laplacian[i] < 0)
            expected = (
                -GAME.partial_gradient(i, own)
                - reference.barrier_gradient(GAME, RHO, y)[i]
                - 2.0 * sum(y[i] - rows[j, i] for j in heard)
            )
            assert u[k, i] == pytest.approx(expected, abs=1e-6)


@pytest.mark.slow
@pytest.mark.parametrize("partial", [False, True])
def test_each_agent_alone_keeps_to_its_share(partial):
    """The decentralised law's formula, in plain Python."""
    law = PartialInformation(graphs.ring(5), 2.0, 0.5) if partial else FullInformation()
    system = robot_system(
        robot_state(FIVE), UNEQUAL, law=law, mode="implicit", integrator="euler",
        decentralised=True,
    )  # fmt: skip
    states, u, memory, loop = instants(system, 0.01, 40, 2)
    assert loop.monitor.exit == watch.INSIDE
    for k in range(40):
        now, after = states[k, :, 1], states[k + 1, :, 1]
        for i in range(5):
            row = memory[k].reshape(5, 5)[i].copy() if partial else now.copy()
            row[i] = after[i]
            expected = -GAME.partial_gradient(i, row)
            for constraint in (i, i + 1):
                if constraint < 5:
                    share = 1 if constraint == 0 else 2
                    look = now.copy()
                    look[i] += share * (after[i] - now[i])
                    slope = GAME.constraint_gradient(constraint, look)[i]
                    expected += RHO / GAME.constraint(constraint, look) * slope
            if partial:
                rows = memory[k].reshape(5, 5)
                heard = ((i - 1) % 5, (i + 1) % 5)
                expected -= 2.0 * sum(after[i] - rows[j, i] for j in heard)
            assert u[k, i] == pytest.approx(expected, abs=1e-6)


@pytest.mark.slow
def test_an_agent_alone_needs_nothing_of_agents_it_shares_no_bound_or_cost_with():
    def inputs(last):
        y = np.array([1.0, 0.0, -1.0, 0.5, last])
        system = robot_system(
            robot_state(y), mode="implicit", integrator="euler", decentralised=True
        )
        return run_loop(system, 0.01, 1)[1][0]

    assert np.array_equal(inputs(2.0)[:3], inputs(-2.0)[:3])
    assert inputs(2.0)[3] != inputs(-2.0)[3]


@pytest.mark.slow
def test_fully_distributed_looks_where_z_will_be():
    """Agents solve alone at their estimates, z_i being moved on with their own next output."""
    law = FullyDistributed(graphs.ring(5), 0.05, 0.7)
    system = robot_system(robot_state(FIVE), law=law, mode="implicit", integrator="euler")
    states, u, memory, loop = instants(system, 0.01, 20, 1)
    assert loop.monitor.exit == watch.INSIDE
    stays = np.exp(-0.01 / 0.05)
    for k in range(20):
        rows, z = memory[k][:25].reshape(5, 5), memory[k][25:]
        after = states[k + 1, :, 1]
        for i in range(5):
            own, filtered = rows[i].copy(), rows[i].copy()
            own[i], filtered[i] = after[i], after[i] + stays * (z[i] - after[i])
            expected = GAME.partial_gradient(i, own)
            for constraint in (i, i + 1):
                if constraint < 5:
                    slope = GAME.constraint_gradient(constraint, filtered)[i]
                    expected -= RHO / GAME.constraint(constraint, filtered) * slope
            assert u[k, i] == pytest.approx(-0.7 * expected, abs=1e-6)


ALONE = [
    False,
    pytest.param(True, marks=pytest.mark.slow),
]  # of which a loop of its own is compiled


@pytest.mark.parametrize("decentralised", ALONE)
@given(seed=st.integers(0, 2**32 - 1), steps=st.sampled_from([1, 3, 20, 100]))
@settings(max_examples=60)
def test_no_start_leaves_at_a_control_instant(decentralised, seed, steps):
    """Kicked robots, close to their bounds, periods up to 0.5 s: inside at every instant."""
    rng = np.random.default_rng(seed)
    gaps = 3.0 * rng.uniform(-0.95, 0.95, 5)
    gaps[rng.integers(5)] = rng.choice([-3, 3]) * (1 - 10.0 ** rng.uniform(-9, -1))
    y = V0 + np.cumsum(gaps)
    start = robot_state(y, rng.uniform(-5, 5, 5), y + rng.uniform(-20, 20, 5))
    numbers = {name: list(np.exp(rng.uniform(-1.2, 1.2, 5))) for name in EQUAL}
    system = robot_system(
        start, numbers, mode="implicit", integrator="euler", decentralised=decentralised
    )
    loop = system.closed_loop(clock(0.005, 0.005 * steps * 20, 0.005 * steps))
    loop.advance(1, 20 * steps)
    loop.finish()
    left = loop.monitor.exit != watch.INSIDE
    assert not left or loop.monitor.exit_between == 1.0


def test_a_start_near_the_bound_is_kept_where_the_explicit_law_leaves():
    y = np.array([V0 - 3.0 * (1 - 1e-9), *FIVE[1:]])
    start = robot_state(y)
    sampled = Simulation(
        [robot_system(start, mode="sampled", integrator="euler")], Clock(1.0, 0.002, 0.01, 0.01)
    ).run()
    report = sampled.reports["robots"]
    assert sampled.status == "left_feasible_set"
    assert report["exit"]["time"] == pytest.approx(0.002)
    assert not report["exit"]["at_control_instant"]
    assert "between two control instants" in report["message"]
    assert report["exit"]["last_input"] == pytest.approx(
        reference.full_information(GAME, RHO, y), rel=1e-5
    )
    assert (report["exit"]["mode"], report["exit"]["information"]) == ("sampled", "full")
    implicit = Simulation(
        [robot_system(start, mode="implicit", integrator="euler")], Clock(1.0, 0.002, 0.01, 0.01)
    ).run()
    assert implicit.status == "completed"
    assert implicit.reports["robots"]["exit"] is None
    assert implicit.reports["robots"]["implicit"]["not_accurate"] == 0
    assert implicit.reports["robots"]["worst_constraint"]["time"] == 0.0


@pytest.mark.slow
@pytest.mark.parametrize(
    ("agents", "steps"), [(integrators(10), 50), (pi_cascades(10), 30), (pi_cascades(10), 1)]
)
def test_powers_of_the_channels(agents, steps):
    """A full matrix; the plants' maps are affine over any number of steps."""
    system = osnr_system(agents, FullInformation(), 0.2499, mode="implicit", integrator="euler")
    states, u, _, loop = instants(system, 0.01, 20, steps)
    assert loop.monitor.exit == watch.INSIDE
    oracle = reference_osnr()
    expected = [reference.full_information(oracle, RHO, row) for row in states[1:, :, 0]]
    assert np.max(np.abs(u - expected)) < 1e-6


@pytest.mark.parametrize("decentralised", ALONE)
def test_the_equilibrium_is_the_same(decentralised):
    system = robot_system(
        robot_state(FIVE), mode="implicit", integrator="euler", decentralised=decentralised
    )
    trajectory = Simulation([system], Clock(40.0, 0.005, 0.05, 0.1)).run()
    assert trajectory.status == "converged"
    assert trajectory.reports["robots"]["equilibrium"]["final_distance"] < 1e-4


def test_looking_at_a_run_does_not_change_it():
    def loop_of():
        system = robot_system(robot_state(FIVE), mode="implicit", integrator="euler")
        return system.closed_loop(clock(0.01, 1.0))

    whole, cut = loop_of(), loop_of()
    expected = whole.advance(40, 1)
    parts = []
    for _ in range(4):
        parts.append(cut.advance(10, 1))
        cut.finish()
    whole.finish()
    assert np.array_equal(np.concatenate([p.state for p in parts]), expected.state)
    assert np.array_equal(np.concatenate([p.input for p in parts]), expected.input)
    for entry in ("solutions", "prediction", "not_monotone"):
        assert cut.monitor[entry] == whole.monitor[entry]


def test_a_push_from_rest_where_all_gaps_vanish_is_solved_for():
    """There the bounds' first derivatives vanish too, and a long step looks short by them."""
    rest = np.full(5, V0)
    start = robot_state(rest, appendage=np.add(rest, [60.0, -60.0, 60.0, -60.0, 60.0]))
    system = robot_system(start, mode="implicit", integrator="euler")
    states, u, _, loop = instants(system, 0.005, 30, 20)
    assert loop.monitor.exit_between or loop.monitor.exit == watch.INSIDE
    y = states[1 : len(u) + 1, :, 1]
    expected = [reference.full_information(GAME, RHO, row) for row in y]
    assert np.max(np.abs(u[: len(y)] - expected)) < 2e-6 * np.max(np.abs(expected))


def test_a_period_over_which_outputs_fall_with_their_inputs_is_refused():
    """M = 1, m = 8, gamma = 0.1 and a linear spring: -0.17 at 4.2 s."""
    numbers = {
        **EQUAL, "appendage_mass": [8.0] * 5, "damping": [0.1] * 5, "atan_coefficient": [0.0] * 5,
    }  # fmt: skip
    system = robot_system(robot_state(FIVE), numbers, mode="implicit", integrator="euler")
    with pytest.raises(InvalidInput, match=r"^clock.control_period: got 4\.2.*-0\.17") as error:
        system.closed_loop(clock(0.002, 42.0, 4.2))
    assert "agent 1" in str(error.value)
    system.closed_loop(clock(0.002, 4.0, 1.0))
    nearly = robot_system(
        robot_state(FIVE), {**numbers, "atan_coefficient": [0.01] * 5}, mode="implicit",
        integrator="euler",
    )  # fmt: skip
    with pytest.raises(InvalidInput, match="does not rise with its input"):
        nearly.closed_loop(clock(0.002, 42.0, 4.2))


def test_laws_without_what_the_mode_needs_are_refused():
    from gne_mj.scenario import load_scenario

    with pytest.raises(InvalidInput, match="'barrier_free'"):
        load_scenario(
            "examples/law/scenario.toml",
            {"controller.mode": "implicit", "controller.file": "examples/law/damped_fast.py"},
        ).system_objects()


@pytest.mark.slow
def test_pushes_that_no_margin_covers_are_seen_where_they_leave():
    from gne_mj.faults import Push

    system = robot_system(
        robot_state(FIVE), mode="implicit", integrator="euler",
        faults=(Push(agents=(2,), force=60.0, start=0.5),),
    )  # fmt: skip
    trajectory = Simulation([system], Clock(3.0, 0.01, 0.01, 0.01)).run()
    report = trajectory.reports["robots"]
    assert trajectory.status == "left_feasible_set"
    assert 0.5 < report["exit"]["time"] < 1.5
    assert report["exit"]["at_control_instant"]
    assert report["implicit"]["largest_prediction_error"] == pytest.approx(0.6, rel=0.02)


@given(st.integers(0, 2**32 - 1), st.integers(1, 9), st.integers(0, 8))
def test_factors_without_pivoting(seed, n, b):
    rng, b = np.random.default_rng(seed), min(b, n - 1)
    matrix = rng.normal(size=(n, n))
    matrix = np.where(np.abs(np.subtract.outer(np.arange(n), np.arange(n))) <= b, matrix, 0.0)
    least = np.linalg.eigvalsh(0.5 * (matrix + matrix.T))[0]
    matrix += (rng.uniform(0.1, 1.0) - least) * np.eye(n)
    band = np.zeros((n, 2 * b + 1))
    for r in range(n):
        for c in range(max(0, r - b), min(n, r + b + 1)):
            band[r, c - r + b] = matrix[r, c]
    x = rng.normal(size=n)
    expected = np.linalg.solve(matrix, x)
    assert banded.factorise_definite(band, n, b)
    banded.solve_definite(band, n, b, x)
    assert np.allclose(x, expected, rtol=1e-9, atol=1e-9)
    indefinite = -np.ones((1, 1))
    assert not banded.factorise_definite(indefinite, 1, 0)


def test_velocity_game_is_what_the_oracles_take_it_to_be():
    assert np.allclose(
        velocity_game(5, V0, 3.0).constraints(FIVE), reference.constraints(GAME, FIVE)
    )
