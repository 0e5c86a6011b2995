"""Mode implicit's kernels as plain Python: agents alone, gains, late sensors, secants."""

from types import SimpleNamespace

import coupled_game
import numpy as np
import pytest
import short_law
from builders import FIVE, UNEQUAL, V0, clock, integrators, robot_state, robot_system
from plain_loops import parts_of, run_plain

import reference
import reference_games
from gne_mj import graph as graphs
from gne_mj.barrier import LogBarrier
from gne_mj.controllers import FullInformation, FullyDistributed, PartialInformation
from gne_mj.controllers.settings import GAIN
from gne_mj.faults import SensorDelay
from gne_mj.game_model import Game
from gne_mj.games import velocity_consensus_game
from gne_mj.loops import implicit, joint, local
from gne_mj.loops import monitor as watch
from gne_mj.loops.newton import OUTSIDE
from gne_mj.plants import integrator, zero_order_hold
from gne_mj.system import System

PENALTY = 0.1
GAME = reference_games.VelocityGame(V0, np.full(5, 3.0))


def alone(game, members, own, now, after):
    """Its barrier's gradient (own entries) where an agent looks along n_l times its own move."""
    total = np.zeros(len(own))
    for k, group in enumerate(members):
        look = now.copy()
        look[own] += len(group) * (after[own] - now[own])
        slope = game.constraint_gradient(k, look)[own]
        total -= PENALTY / game.constraint(k, look) * slope
    return total


@pytest.mark.parametrize("partial", [False, True])
def test_each_agent_alone_keeps_to_its_share(partial):
    """The decentralised law's formula, in plain Python."""
    law = PartialInformation(graphs.ring(5), 2.0, 0.5) if partial else FullInformation()
    system = robot_system(
        robot_state(FIVE), UNEQUAL, law=law, mode="implicit", integrator="euler",
        decentralised=True,
    )  # fmt: skip
    found = run_plain(system, clock(0.01, 1.0, 0.02), 6)
    members = [[0], [0, 1], [1, 2], [2, 3], [3, 4]]
    for k in range(5):
        now, after = found.y[k], found.y[k + 1]
        for i in range(5):
            row = found.memory[k].reshape(5, 5)[i].copy() if partial else now.copy()
            row[i] = after[i]
            expected = -GAME.partial_gradient(i, row) - alone(GAME, members, [i], now, after)[0]
            if partial:
                rows = found.memory[k].reshape(5, 5)
                expected -= 2.0 * sum(after[i] - rows[j, i] for j in ((i - 1) % 5, (i + 1) % 5))
            assert found.u[k, i] == pytest.approx(expected, abs=1e-6)
    assert found.monitor.unsolved == 0
    assert found.monitor.prediction < 1e-8
    assert found.monitor.solver_steps < 40 * found.monitor.solutions


def test_agents_alone_in_the_plane():
    """Two entries for each agent and curved bounds: the whole block is the agent's own."""
    edges, v0, delta = [(0, 1), (1, 2)], np.array([1.0, -0.5]), np.array([1.0, 0.8, 1.5])
    game = velocity_consensus_game(edges, [1.0, 0.0, 0.0], v0, delta[:2], delta[2:])
    oracle = reference_games.VelocityConsensusGame(v0, edges, np.array([1.0, 0.0, 0.0]), delta)
    members = [[0, 1], [1, 2], [0]]
    agents = integrators(6)
    y = np.add(np.tile(v0, 3), [0.9, 0.9, 0.3, 0.7, 0.2, 0.2])
    system = System(
        "plane", game, agents, FullInformation(), PENALTY, agents.equilibrium(y), mode="implicit",
        integrator="euler", decentralised=True,
    )  # fmt: skip
    found = run_plain(system, clock(0.05, 1.0), 5)
    for k in range(4):
        now, after = found.y[k], found.y[k + 1]
        for i in range(3):
            own, prediction = [2 * i, 2 * i + 1], now.copy()
            prediction[own] = after[own]
            expected = [-oracle.partial_gradient(a, prediction) for a in own]
            expected -= alone(oracle, members, own, now, after)
            assert found.u[k, own] == pytest.approx(expected, abs=1e-6)
    assert found.monitor.unsolved == 0


def test_fully_distributed_agents_look_where_z_will_be():
    """Alone at their estimates, z_i moved on with their own next output, all times the gain."""
    law = FullyDistributed(graphs.ring(5), 0.05, 0.7)
    system = robot_system(robot_state(FIVE), law=law, mode="implicit", integrator="euler")
    found = run_plain(system, clock(0.01), 6)
    stays = np.exp(-0.01 / 0.05)
    for k in range(5):
        rows, z, after = found.memory[k][:25].reshape(5, 5), found.memory[k][25:], found.y[k + 1]
        for i in range(5):
            own, filtered = rows[i].copy(), rows[i].copy()
            own[i], filtered[i] = after[i], after[i] + stays * (z[i] - after[i])
            expected = GAME.partial_gradient(i, own)
            for constraint in (i, i + 1):
                if constraint < 5:
                    slope = GAME.constraint_gradient(constraint, filtered)[i]
                    expected -= PENALTY / GAME.constraint(constraint, filtered) * slope
            assert found.u[k, i] == pytest.approx(-0.7 * expected, abs=1e-6)


def test_a_prediction_that_moves_far_is_checked_where_it_arrives():
    """Maps of an affine plant in a period: two for slopes, one to begin, one more if it is far."""
    maps = {}
    for h in (1e-5, 0.1):
        maps[h] = 0

        def predict(*arguments, h=h):
            maps[h] += 1
            zero_order_hold.predict(*arguments)

        counted = SimpleNamespace(
            predict=predict,
            is_affine=zero_order_hold.is_affine,
            roll=zero_order_hold.roll,
            is_coupled=zero_order_hold.is_coupled,
        )
        system = robot_system(robot_state(FIVE), UNEQUAL, mode="implicit", integrator="euler")
        run_plain(system, clock(h), 1, counted)
    assert maps == {1e-5: 3, 0.1: 4}


@pytest.mark.parametrize("steps", [1, 3])
def test_a_known_delay_does_not_deceive_mode_implicit(steps):
    """A state of two periods ago is moved on under the inputs since: the law at what comes next."""
    start = robot_state(FIVE, extension=[0.5, -1, 0, 2, 0.3], appendage=np.add(FIVE, 1.0))
    system = robot_system(
        start, UNEQUAL, mode="implicit", integrator="euler", faults=(SensorDelay(periods=2),)
    )
    found = run_plain(system, clock(0.01, 1.0, 0.01 * steps), 9)
    expected = [reference.full_information(GAME, PENALTY, y) for y in found.y[1:]]
    assert found.u[:-1] == pytest.approx(np.array(expected), abs=1e-6)
    for k in range(9):
        assert np.array_equal(found.measurement[k], found.y[max(k - 2, 0)])


class ShortLaw(FullInformation):
    @property
    def kernels(self):
        return short_law


def test_a_law_of_ones_own_needs_no_kernel_of_agents_alone():
    given = {"mode": "implicit", "integrator": "euler"}
    expected = run_plain(robot_system(robot_state(FIVE), **given), clock(0.01), 3)
    found = run_plain(robot_system(robot_state(FIVE), law=ShortLaw(), **given), clock(0.01), 3)
    assert np.array_equal(found.u, expected.u)


# ------------------------------------------------------------------------------- one equation


def coupled_system(tightening=0.0, **options):
    """The game of two, one and one entries."""
    game = Game(
        name="coupled", kernels=coupled_game, parameters=np.array([0.7]), sizes=coupled_game.SIZES,
        in_cost=[(0, 1, 2)] * 3, in_constraint=coupled_game.IN_CONSTRAINT,
        constraint_names=("ball", "product"),
    )  # fmt: skip
    agents = integrators(4)
    y = np.array([0.3, -0.4, 0.5, -0.2])
    return System(
        "s", game.tightened(np.full(2, tightening)), agents, FullInformation(), PENALTY,
        agents.equilibrium(y), mode="implicit", integrator="euler", **options,
    )  # fmt: skip


def equation_of(equation, system, seed, gain=1.0):
    """Its residual as a function of the trial (m,), agent by agent, and what it works on."""
    parts = parts_of(system, clock(0.05))
    problem, work, solver = parts.problem, parts.work, parts.solver
    problem.settings[GAIN] = gain
    rng, m = np.random.default_rng(seed), system.game.actions
    solver.anchor[:], solver.base[:] = system.start, system.start + rng.normal(size=m)
    solver.own[:], solver.mixed[:] = system.start, system.start
    solver.stiff[:] = rng.uniform(5, 30, m)
    solver.numbers.rho, solver.numbers.moves = 0.2, 1.0
    work.profile[:] = system.start

    def residual(first, last, trial):
        solver.trial[:] = trial
        solver.mixed[:] = solver.anchor
        solver.residual[:] = np.nan
        good = equation.residual(problem, first, last, np.zeros(0), work, solver)
        at = problem.data.offsets
        return good, solver.residual[at[first] : at[last]].copy()

    return residual, parts


@pytest.mark.parametrize("decentralised", [False, True])
@pytest.mark.parametrize("gain", [1.0, 0.6])
def test_an_agents_own_matrix_is_the_derivative_of_its_equation(decentralised, gain):
    system = coupled_system(decentralised=True)
    residual, parts = equation_of(local, system, 3, gain)
    parts.problem.order.band[1] = int(decentralised)
    at, b = parts.problem.data.offsets, int(parts.problem.order.band[0])
    y = system.start + np.array([0.02, -0.01, 0.03, 0.02])
    for i in range(3):
        assert residual(i, i + 1, y)[0]
        local.assemble(parts.problem, i, i + 1, b, np.zeros(0), parts.work, parts.solver)
        for a in range(at[i], at[i + 1]):
            h = np.where(np.arange(4) == a, 1e-6, 0.0)
            slope = (residual(i, i + 1, y + h)[1] - residual(i, i + 1, y - h)[1]) / 2e-6
            for c in range(at[i], at[i + 1]):
                entry = parts.solver.band[c - at[i], a - c + b]
                assert entry == pytest.approx(slope[c - at[i]], rel=1e-6, abs=1e-6)
        assert np.all(parts.solver.row == 0.0)


@pytest.mark.parametrize("gain", [1.0, 0.6])
def test_all_agents_matrix_is_the_derivative_of_their_equation(gain):
    system = coupled_system()
    residual, parts = equation_of(joint, system, 3, gain)
    position, b = parts.problem.order.position, int(parts.problem.order.band[0])
    y = system.start + np.array([0.02, -0.01, 0.03, 0.02])
    assert residual(0, 3, y)[0]
    joint.assemble(parts.problem, 0, 3, b, np.zeros(0), parts.work, parts.solver)
    matrix = np.zeros((4, 4))
    for a in range(4):
        for c in range(4):
            offset = position[c] - position[a] + b
            if 0 <= offset <= 2 * b:
                matrix[a, c] = parts.solver.band[position[a], offset]
    slope = np.zeros((4, 4))
    for c in range(4):
        h = np.where(np.arange(4) == c, 1e-6, 0.0)
        slope[:, c] = (residual(0, 3, y + h)[1] - residual(0, 3, y - h)[1]) / 2e-6
    assert matrix == pytest.approx(slope, rel=1e-6, abs=1e-6)


def test_an_agent_without_an_action_says_at_which_constraint():
    system = coupled_system(decentralised=True)
    residual, parts = equation_of(local, system, 3)
    good, _ = residual(0, 1, np.array([1.95, 1.2, 0.5, -0.2]))
    assert not good
    assert parts.work.now.tightened == 0.0
    # the ball's three members: looked at three times as far from the anchor
    look = system.start.copy()
    look[:2] += 3.0 * (np.array([1.95, 1.2]) - system.start[:2])
    assert parts.work.now.tightened_value == pytest.approx(look @ look - 4.0)
    parts.problem.order.band[1] = 0  # without shares
    residual(0, 1, np.array([1.95, 1.2, 0.5, -0.2]))
    assert parts.work.now.tightened_value == pytest.approx(1.95**2 + 1.2**2 + 0.25 + 0.04 - 4.0)


def test_all_agents_without_actions_say_at_which_constraint():
    residual, parts = equation_of(joint, coupled_system(), 3)
    outside = np.array([1.95, 1.2, 0.5, -0.2])
    assert not residual(0, 3, outside)[0]
    assert parts.work.now.tightened == 0.0
    assert parts.work.now.tightened_value == pytest.approx(outside @ outside - 4.0)


def test_a_steps_length_is_measured_where_the_agent_looks():
    """The greatest relative change of a slack, n_l times the own move, curvature included."""
    system = coupled_system(decentralised=True)
    residual, parts = equation_of(local, system, 3)
    assert residual(1, 2, system.start)[0]
    step = np.array([0.01])
    got = local.local_length(parts.problem, 1, 2, np.zeros(0), step, parts.solver)
    ball, product = 4.0 - system.start @ system.start, 1.0 - system.start[1] * system.start[2]
    of_ball = (2 * 0.5 * 0.03 / ball) ** 2 + 2 * 0.03**2 / ball
    of_product = (-0.4 * 0.02 / product) ** 2
    assert got == pytest.approx(np.sqrt(max(of_ball, of_product)))
    parts.problem.order.band[1] = 0
    residual(1, 2, system.start)
    alone = local.local_length(parts.problem, 1, 2, np.zeros(0), step, parts.solver)
    assert alone == pytest.approx(np.sqrt((0.01 / ball) ** 2 + 2 * 0.01**2 / ball))


def test_both_entries_of_an_action_count_in_its_length():
    system = coupled_system(decentralised=True)
    residual, parts = equation_of(local, system, 3)
    assert residual(0, 1, system.start)[0]
    step = np.array([0.001, -0.02])
    got = local.local_length(parts.problem, 0, 1, np.zeros(0), step, parts.solver)
    ball, product = 4.0 - system.start @ system.start, 1.0 - system.start[1] * system.start[2]
    of_ball = (2 * 0.4 * 0.06 / ball) ** 2 + 2 * 0.06**2 / ball
    of_product = (0.5 * 0.04 / product) ** 2
    assert got == pytest.approx(np.sqrt(max(of_ball, of_product)))


# ------------------------------------------------------------------------------------- secants


ALONE = zero_order_hold
COUPLED = SimpleNamespace(is_coupled=lambda: True)


def secant_solver(u, held, reached, prediction):
    arrays = {"u": u, "held": held, "reached": reached, "prediction": prediction}
    return SimpleNamespace(
        **{name: np.array(values, dtype=float) for name, values in arrays.items()},
        slope=np.full(len(u), 0.5), stiff=np.full(len(u), 2.0),
    )  # fmt: skip


def test_slopes_become_the_secants_and_the_least_one_is_told():
    solver = secant_solver([1.0, 3.0, 2.0], [0.0, 1.0, 1.0], [4.0, 3.0, 1.0], [2.0, 2.5, 0.75])
    assert implicit.correct_slopes(ALONE, solver, solver.held, solver.prediction) == 0.25
    assert solver.slope.tolist() == [2.0, 0.25, 0.25]
    assert solver.stiff.tolist() == [0.5, 4.0, 4.0]


@pytest.mark.parametrize("way", [-1.0, 1.0])
def test_a_slope_that_is_not_positive_is_seen_and_not_taken(way):
    solver = secant_solver([1.0, way], [0.0, 0.0], [2.0, -way], [0.0, 0.0])
    assert implicit.correct_slopes(ALONE, solver, solver.held, solver.prediction) == -1.0
    assert solver.slope.tolist() == [2.0, 0.5]
    assert solver.stiff.tolist() == [0.5, 2.0]


def test_of_a_short_way_no_secant_is_taken():
    """Rounding is all that is seen, and nothing is known of an input that stayed."""
    solver = secant_solver([1.0, 1.0], [0.0, 1.0], [5.0 + 5e-9, 2.0], [5.0, 1.0])
    assert implicit.correct_slopes(ALONE, solver, solver.held, solver.prediction) == np.inf
    assert solver.slope.tolist() == [0.5, 0.5]
    near = secant_solver([1.0], [0.0], [5.0 + 7e-9], [5.0])
    assert implicit.correct_slopes(ALONE, near, near.held, near.prediction) == pytest.approx(7e-9)


def test_where_channels_are_coupled_a_small_move_is_not_taken_for_its_own_input():
    """The map is y = A u: a secant of the second output is its slope where it moves enough."""
    slopes = np.array([[1.0, 0.0], [0.02, 1.0]])
    for own, taken in ((0.005, False), (0.5, True)):
        u = np.array([1.0, own])
        solver = secant_solver(u, [0.0, 0.0], slopes @ u, [0.0, 0.0])
        implicit.correct_slopes(COUPLED, solver, solver.held, solver.prediction)
        assert solver.slope[0] == 1.0
        assert solver.slope[1] == (pytest.approx(1.0, rel=0.05) if taken else 0.5)
        implicit.correct_slopes(ALONE, solver, solver.held, solver.prediction)
        assert solver.slope[1] == pytest.approx((0.02 + own) / own)


def test_first_slopes_are_what_a_unit_input_adds():
    """Of integrators, exactly the control period; of robots, the map's derivative at rest."""
    for system, steps in (
        (coupled_system(), 3),
        (robot_system(robot_state(FIVE), UNEQUAL, mode="implicit", integrator="rk4"), 4),
    ):
        parts = parts_of(system, clock(0.05, 0.05 * steps, 0.05 * steps))
        state, agent = system.state.ravel(), system.agents.kind
        implicit.find_slopes(zero_order_hold, (), parts.channels, parts.clock, state, parts.solver)
        assert np.all(parts.solver.slope * parts.solver.stiff == pytest.approx(1.0))
        if agent is integrator:
            assert parts.solver.slope == pytest.approx(0.05 * steps)
        reached = np.zeros((2, len(system.start)))
        for row, size in zip(reached, (0.0, 1.0), strict=True):
            moved = state.copy()
            u = np.full(len(row), size)
            zero_order_hold.roll(parts.channels, parts.clock, moved, u, np.zeros(20))
            row[:] = moved.reshape(parts.channels.equilibrium_state.shape)[:, agent.OUTPUT]
        assert parts.solver.slope == pytest.approx(reached[1] - reached[0])


def test_a_prediction_agrees_if_no_distance_to_a_bound_differs():
    parts = parts_of(coupled_system(0.5), clock(0.05))
    near = np.array([1.0, 1.4, 0.0, 0.7])
    near *= np.sqrt((3.5 - 1e-6) / (near @ near))  # just inside of the tightened ball
    for change, agree in ((0.0, True), (1e-15, True), (1e-11, False), (-1e-11, False)):
        parts.solver.y[:] = near
        parts.solver.reached[:] = near + change
        assert implicit.agrees(parts.problem, parts.solver) == agree


class Bent:
    """A plant of integrators whose outputs move by bend(u) in a period; counts its predictions."""

    def __init__(self, bend):
        self.bend, self.count = bend, 0

    def is_coupled(self):
        return False

    def is_affine(self, clock):
        return False

    def roll(self, channels, clock, state, u, scratch):
        state[: len(u)] += self.bend(u)

    def predict(self, context, channels, clock, state, u, out, trial, scratch):
        self.count += 1
        out[:] = state[: len(u)] + self.bend(u)


@pytest.mark.parametrize("decentralised", [False, True])
def test_secants_find_the_law_on_a_map_that_bends(decentralised):
    bent = Bent(lambda u: 0.02 * u + 0.004 * u**3)
    system = coupled_system(decentralised=decentralised)
    found = run_plain(system, clock(0.05), 6, bent)
    assert found.monitor.unsolved == found.monitor.not_monotone == 0
    assert found.monitor.prediction < 1e-6
    assert bent.count <= 2 + 6 * 6
    if not decentralised:
        barrier = LogBarrier(system.game, PENALTY)
        for u, y in zip(found.u, found.y[1:], strict=False):
            expected = -system.game.pseudo_gradient(y) - barrier.gradient(y)
            assert u == pytest.approx(expected, abs=1e-5)


def test_a_map_that_falls_is_told():
    found = run_plain(coupled_system(), clock(0.05), 3, Bent(lambda u: 0.05 * np.sin(7.0 * u)))
    assert found.monitor.not_monotone > 0


def test_the_worst_way_in_which_an_agent_ended_is_told(monkeypatch):
    system = coupled_system(decentralised=True)
    parts = parts_of(system, clock(0.05))
    for codes, worst, asked in (((1, 2, 0), 2, 3), ((0, 0, 0), 0, 3), ((1, OUTSIDE, 0), 3, 2)):
        ways = list(codes)
        monkeypatch.setattr(local, "newton", lambda *_, ways=ways: ways.pop(0))
        given = parts.problem, np.zeros(0), parts.work, parts.solver
        assert local.solve(*given) == worst
        assert len(codes) - len(ways) == asked, "nobody is asked once one has no action"


# ------------------------------------------------------------------------------------- monitor


def test_what_a_solution_showed_is_counted():
    monitor = watch.fresh(2, 1)
    for time, steps, accurate, least in (
        (0.0, 3.0, True, 0.5), (0.1, 7.0, False, -0.1), (0.2, 2.0, True, np.inf),
        (0.3, 1.0, False, 0.0), (0.4, 1.0, True, np.nan),
    ):  # fmt: skip
        watch.count_solution(monitor, time, steps, accurate, least)
    names = ("SOLUTIONS", "SOLVER_STEPS", "MOST_STEPS", "UNSOLVED", "UNSOLVED_TIME",
             "NOT_MONOTONE", "NOT_MONOTONE_TIME")  # fmt: skip
    found = [monitor[name.lower()] for name in names]
    assert found == [5.0, 14.0, 7.0, 2.0, 0.1, 3.0, 0.1]
