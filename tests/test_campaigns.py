"""The campaigns' oracle and games: held to the slow ones of reference.py, and to differences."""

import sys
from pathlib import Path

import numpy as np
import pytest
from reference_agents import FlexibleRobot, Integrator, PiCascade

import reference
import reference_games

sys.path.insert(0, str(Path(__file__).parents[1] / "scripts" / "campaigns"))

import continuous
import kills
import kinds
import moving
import positions
import quadratic
import stiff

from gne_mj.time_functions import from_table

AGENTS = 4


def slow_game(game):
    """The game of reference.py with the numbers of one of the product's."""
    q = game.parameters
    if game.name == "velocity synchronisation":
        return reference_games.VelocityGame(q[0], *q[1:].reshape(3, -1))
    if game.name == "Cournot":
        numbers = q[2:].reshape(3, -1)
        return reference_games.CournotGame(numbers[0], q[1], numbers[1], numbers[2])
    if game.name == "OSNR":
        columns = q[2 : 2 + 4 * AGENTS].reshape(4, -1)
        matrix = q[2 + 4 * AGENTS :].reshape(AGENTS, AGENTS)
        return reference_games.OsnrGame(*columns, matrix, q[1])
    d, agents, p = (int(n) for n in q[:3])
    at = 3 + d + agents
    rows = q[at : at + 3 * p].reshape(p, 3)
    edges = [(int(i), int(j)) for i, j, _ in rows if j < agents]
    return reference_games.VelocityConsensusGame(q[3 : 3 + d], edges, q[3 + d : at], rows[:, 2])


def near(rng, both):
    """A profile strictly inside, near its middle."""
    return both.middle + 0.05 * rng.uniform(-1, 1, len(both.middle))


def slow_agents(kind, rng, m):
    """m agents of reference.py, and the channels of the campaigns' oracle."""
    numbers = rng.uniform(0.5, 2.0, (5, m))
    if kind == "robot":
        return FlexibleRobot(*numbers), [("robot", row.tolist()) for row in numbers.T]
    if kind == "integrator":
        return Integrator(), [("integrator", [])] * m
    v, k = numbers[0], numbers[0] * rng.uniform(0.1, 0.9, m)
    return PiCascade(v, k), [("cascade", list(pair)) for pair in zip(v, k, strict=True)]


GAMES = [kinds.lane, kinds.space, kinds.channels, kinds.firms]


@pytest.mark.parametrize("kind", ["robot", "integrator", "cascade"])
@pytest.mark.parametrize("draw", GAMES)
def test_the_oracle_is_that_of_the_papers_equations_under_full_information(draw, kind):
    rng = np.random.default_rng(1)
    both = draw(rng, AGENTS)
    slow = slow_game(both.game)
    agent, channels = slow_agents(kind, rng, slow.N)
    loop = stiff.Loop(both.oracle, stiff.Law("full"), 0.3, channels)
    x = rng.normal(size=(slow.N, agent.n))
    output = int(agent.output(np.tile(np.arange(agent.n), (slow.N, 1)))[0])
    x[:, output] = near(rng, both)
    expected = reference.closed_loop_rate(agent, "full_information", slow, 0.3)(0.0, x.ravel())
    np.testing.assert_allclose(loop.rate(0.0, loop.pack(x)), expected, rtol=1e-12, atol=1e-12)
    check_jacobian(loop, loop.pack(x))


@pytest.mark.parametrize("information", ["partial", "distributed"])
@pytest.mark.parametrize("draw", [kinds.lane, kinds.channels, kinds.firms])
def test_the_oracle_is_that_of_the_papers_equations_with_estimates(draw, information):
    rng = np.random.default_rng(2)
    both = draw(rng, AGENTS)
    slow = slow_game(both.game)
    agent, channels = slow_agents("cascade", rng, slow.N)
    laplacian = reference.laplacian(AGENTS, [(0, 1), (1, 2), (2, 3), (0, 3)])
    x = np.column_stack([near(rng, both), rng.normal(size=AGENTS)])
    estimates = np.array([near(rng, both) for _ in range(AGENTS)])
    if information == "partial":
        law = stiff.Law("partial", laplacian, coupling=3.0, time_constant=0.7)
        loop = stiff.Loop(both.oracle, law, 0.3, channels)
        flat = loop.pack(x, estimates)
        rate = reference.closed_loop_rate(
            agent, "partial_information", slow, 0.3, laplacian=laplacian, c=3.0, tau=0.7
        )
        z = None
    else:
        law = stiff.Law("distributed", laplacian, gain=0.4, epsilon=0.02)
        loop = stiff.Loop(both.oracle, law, 0.3, channels)
        z = near(rng, both)
        flat = loop.pack(x, estimates, z)
        rate = reference.closed_loop_rate(
            agent, "fully_distributed", slow, 0.3, laplacian=laplacian, k=0.4, epsilon=0.02
        )
    expected = reference.unpack(
        rate(0.0, reference.pack(x, z, estimates)), AGENTS, 2, z is not None, True
    )
    found = loop.rate(0.0, flat)
    np.testing.assert_allclose(found[:8].reshape(4, 2), expected[0], rtol=1e-12, atol=1e-12)
    others = ~np.eye(AGENTS, dtype=bool)
    np.testing.assert_allclose(
        found[8:24].reshape(4, 4)[others], expected[2][others], rtol=1e-12, atol=1e-12
    )
    np.testing.assert_array_equal(found[8:24].reshape(4, 4)[~others], 0.0)
    if z is not None:
        np.testing.assert_allclose(found[24:], expected[1], rtol=1e-12, atol=1e-12)
    check_jacobian(loop, flat)


def check_jacobian(loop, x):
    step = 1e-6
    for column, slope in enumerate(loop.jacobian(0.0, x).T):
        shift = step * np.eye(len(x))[column]
        found = (loop.rate(0.0, x + shift) - loop.rate(0.0, x - shift)) / (2 * step)
        np.testing.assert_allclose(slope, found, rtol=1e-5, atol=1e-5 * np.max(np.abs(found) + 1))


def test_the_oracle_has_no_rate_outside():
    rng = np.random.default_rng(3)
    both = kinds.firms(rng, 2)
    _, channels = slow_agents("integrator", rng, 2)
    loop = stiff.Loop(both.oracle, stiff.Law("full"), 0.1, channels)
    assert np.all(loop.rate(0.0, both.game.box[1] + 0.1) == stiff.OUTSIDE)


def test_both_solvers_follow_a_known_solution_from_next_to_a_bound():
    """y' = -rho/(1 - y), an integrator without a cost below 1: (1 - y)^2 grows by 2 rho t."""
    game = stiff.Game(
        np.zeros(1, int), stiff.Affine(np.zeros((1, 1)), np.zeros(1)), np.ones((1, 1)), np.ones(1),
        np.zeros((0, 1, 1)), np.zeros((0, 1)), np.zeros(0),
    )  # fmt: skip
    loop = stiff.Loop(game, stiff.Law("full"), 1e-3, [("integrator", [])])
    times = np.linspace(0.0, 1.0, 11)
    expected = 1.0 - np.sqrt(1e-18 + 2e-3 * times)
    for follow in (stiff.follow, stiff.follow_by_radau):
        found = follow(loop, np.array([1.0 - 1e-9]), times, 1e-8)
        np.testing.assert_allclose(found[:, 0], expected, rtol=0, atol=1e-7)


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_the_quadratic_games_derivatives_are_those_of_its_values(sign):
    rng = np.random.default_rng(4)
    numbers, _ = kinds.quadratic_numbers(rng, 3)
    while not len(numbers.disc):
        numbers, _ = kinds.quadratic_numbers(rng, 3)
    numbers.sign = sign * numbers.sign
    game = quadratic.quadratic_game(numbers)
    q, m = game.parameters, game.actions
    y, step = 0.1 * rng.normal(size=m), 1e-5
    shift = step * np.eye(m)
    for a, i in enumerate(game.agent_of_action):
        up, down = (quadratic.cost(q, i, y + s) for s in (shift[a], -shift[a]))
        found = quadratic.cost_gradient(q, i, a, y)
        assert found == pytest.approx((up - down) / (2 * step), rel=1e-6, abs=1e-6)
        row = np.zeros(m)
        quadratic.add_cost_hessian(q, i, a, y, 2.0, row)
        np.testing.assert_allclose(row, 2.0 * numbers.slope[a])
    for l in range(game.constraints_count):  # noqa: E741
        for a in range(m):
            up, down = (quadratic.constraint(q, l, y + s) for s in (shift[a], -shift[a]))
            found = quadratic.constraint_gradient(q, l, a, y)
            assert found == pytest.approx((up - down) / (2 * step), rel=1e-6, abs=1e-6)
            for b in range(m):
                up, down = (
                    quadratic.constraint_gradient(q, l, a, y + s) for s in (shift[b], -shift[b])
                )
                found = quadratic.constraint_hessian(q, l, a, b, y)
                assert found == pytest.approx((up - down) / (2 * step), rel=1e-6, abs=1e-6)
    oracle = stiff.Game(
        game.agent_of_action, stiff.Affine(numbers.slope, numbers.offset), numbers.line,
        numbers.bound, numbers.disc, numbers.center, numbers.radius, numbers.sign,
    )  # fmt: skip
    found = [-quadratic.constraint(q, l, y) for l in range(game.constraints_count)]  # noqa: E741
    np.testing.assert_allclose(oracle.slacks(y[None])[0], found, rtol=1e-12, atol=1e-12)


def test_a_run_from_an_ordinary_start_is_what_the_oracle_says(monkeypatch):
    monkeypatch.setattr(kinds, "CLOSEST", 0.5)
    monkeypatch.setattr(kinds, "STEPS", (5e-4, 1e-3))
    drawn = continuous.draw
    monkeypatch.setattr(continuous, "draw", lambda rng: drawn(rng, "lane robots"))
    found = continuous.one(5, 10, share=1.0)
    assert found["status"] in ("completed", "converged")
    assert found["reference_error"] < 1e-8
    assert found["error"] < 1e-7
    assert found == continuous.one(5, 10, share=1.0)


def test_the_kill_script_notices_what_is_half_written(tmp_path, monkeypatch):
    """Each fault that it is to find is made on purpose, after a command that was not killed."""
    reference = tmp_path / "reference"
    for name in ("run", "paper"):
        (reference / name).mkdir(parents=True)
        (reference / name / "file").write_text("whole")
    (reference / "mine.txt").write_text("mine")
    monkeypatch.setattr(kills, "_paper", lambda *_: iter(()))
    monkeypatch.setitem(kills.COMMANDS, "view --html", ())
    program = "import sys; sys.exit(0)"
    for fault, words in (
        ("pass", "no result"),
        ("open('out', 'w').write('half')", "not what it is without a kill"),
        ("open('mine.txt', 'w').write('theirs')", "mine.txt is not as it was"),
        ("open('run/more', 'w').write('more')", "run is not as it was"),
        ("import os; os.mkdir('.gne-mj-x-1')", "hidden folders stayed"),
        ("open('table.csv.part', 'w')", "that is no result"),
        ("import subprocess; subprocess.Popen(['sleep', '60'], stdout=-3, stderr=-3)", "stayed"),
    ):
        (reference / "out of view --html").write_text("whole")
        monkeypatch.setattr(kills, "GNE", (sys.executable, "-c", f"{fault}; {program}"))
        known = kills.Reference(reference, dict.fromkeys(kills.COMMANDS, 100.0))
        index = 5 + 9 * 2  # view --html, SIGTERM
        monkeypatch.setattr(kills, "ATTEMPTS", 1)
        name, _, ended, found = kills.kill(tmp_path / "kill", known, 0, index)
        assert name == "view --html"
        assert ended == "before"
        assert any(words in each for each in found), (fault, found)


@pytest.mark.parametrize("draw", [positions.platoon, positions.formation])
def test_the_positions_formulas_are_the_games(draw):
    rng = np.random.default_rng(5)
    for _ in range(10):
        place = draw(rng)
        profiles = place.middle + rng.normal(size=(50, place.game.actions))
        inside = np.all(place.values(profiles) < 0, axis=1)
        assert np.array_equal(inside, np.all(place.game.constraints(profiles) < 0, axis=1))
        assert np.all(place.values(place.middle[None]) < 0)


@pytest.mark.slow
def test_random_platoons_and_formations_keep_their_positions(monkeypatch):
    monkeypatch.setattr(positions, "CLOSEST", 1e-2)
    rows = [positions.one(6, index) for index in (0, 1, 2, 3, 13, 23)]
    assert {(row["kind"], row["mode"]) for row in rows} == {
        (kind, mode) for kind in positions.KINDS for mode in positions.MODES
    }
    lines, broken = positions.report(rows)
    assert broken == 0, lines
    assert all(row["told_outside"] == row["outside"] == 0 for row in rows)
    for key in ("outside", "contacts", "outputs_outside"):
        assert positions.broken({**rows[0], key: 1}) == [key]
    assert positions.broken(positions.crashed(7, ValueError("x"))) == ["crashed"]


@pytest.mark.parametrize("seed", range(40))
def test_functions_of_time_are_those_of_the_campaigns_formulas(seed):
    rng = np.random.default_rng(seed)
    given = moving.moving(rng, rng.uniform(-3, 3), rng.uniform(0.1, 2.0))
    made = from_table(given).build()
    for time in [0.0, *rng.uniform(0.0, 4.0, 10)]:
        assert made.at(time) == pytest.approx(moving.value(given, time), abs=1e-12)
