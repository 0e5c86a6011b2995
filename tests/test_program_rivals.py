"""Rivals that solve quadratic programs: right-hand sides by SciPy, and what they keep."""

import numpy as np
import pytest
from builders import UNEQUAL, clock, integrators, pi_cascades, robots
from random_games import RandomGame
from scipy.optimize import minimize, root

from gne_mj.controllers import (
    CbfFilter,
    DiscreteCbfFilter,
    ProjectedGradient,
    RecedingHorizon,
    SafeMonotoneFlow,
)
from gne_mj.equilibrium import variational_equilibrium
from gne_mj.errors import InvalidInput
from gne_mj.plants.ode import OdePlant
from gne_mj.system import System
from gne_mj.system.first_input import law_at_start

N = 5
H = 0.02


def nearest(goal, g, slope, start=None):
    """The point nearest to goal with g(x) <= 0: by SLSQP, then what binds as equations."""
    found = minimize(
        lambda x: 0.5 * np.sum((x - goal) ** 2), goal if start is None else start,
        jac=lambda x: x - goal, method="SLSQP",
        constraints={"type": "ineq", "fun": lambda x: -g(x), "jac": lambda x: -slope(x)},
        options={"maxiter": 500, "ftol": 1e-14},
    ).x  # fmt: skip
    binding, n = np.flatnonzero(g(found) > -1e-6), len(goal)
    multipliers = np.linalg.lstsq(slope(found)[binding].T, goal - found, rcond=None)[0]

    def equations(z):
        x, rows = z[:n], slope(z[:n])[binding]
        return np.concatenate([x - goal + rows.T @ z[n:], g(x)[binding]])

    z = root(equations, np.concatenate([found, multipliers]), tol=1e-14).x
    rows = slope(z[:n])[binding]  # of what is affine the rest is one step
    system = np.block([[np.eye(n), rows.T], [rows, np.zeros((len(binding),) * 2)]])
    z -= np.linalg.lstsq(system, equations(z), rcond=None)[0]
    assert np.all(z[n:] >= -1e-9)
    assert np.max(g(z[:n])) < 1e-9
    return z[:n]


def system_of(made, law, agents, y, state=None, **options):
    rest = agents.equilibrium(y)
    return System("s", made.game, agents, law, 0.1, rest if state is None else state, **options)


def draw(seed, curved, agents=None):
    """A random game, outputs strictly inside, and a state of these agents with such outputs."""
    made, rng = (
        RandomGame(seed, agents=N, constraints=4, curved=curved),
        np.random.default_rng(seed),
    )
    y = rng.normal(size=N)
    while np.max(made.g(y)) > -0.02:
        y *= 0.8
    agents = agents or integrators(N)
    state = agents.equilibrium(y)
    state += rng.normal(size=state.shape) * (np.arange(state.shape[1]) != agents.kind.OUTPUT)
    return made, y, state


ROBOTS = robots(UNEQUAL)


@pytest.mark.parametrize("curved", [pytest.param(False, marks=pytest.mark.slow), True])
def test_the_continuous_laws_are_their_programs(curved):
    """Of robots with y' = (u - spring - damper)/M; J_g is zero where a gap's square is least."""
    mass = np.array(UNEQUAL["main_mass"])
    for seed in range(10):
        made, y, state = draw(seed, curved, ROBOTS)
        goal, g, J = -1.7 * made.F(y), made.g(y), made.J(y)
        u = law_at_start(system_of(made, SafeMonotoneFlow(1.7, 2.5), ROBOTS, y, state))
        expected = nearest(goal, lambda x: J @ x + 2.5 * g, lambda x: J)  # noqa: B023
        np.testing.assert_allclose(u, expected, rtol=0, atol=1e-12 * (1 + np.max(np.abs(goal))))
        x = state[:, 0]
        force = np.array(UNEQUAL["stiffness"]) * x + np.array(
            UNEQUAL["atan_coefficient"]
        ) * np.arctan(x)
        force = force + np.array(UNEQUAL["damping"]) * (state[:, 1] - state[:, 2])
        u = law_at_start(system_of(made, CbfFilter(1.7, 2.5), ROBOTS, y, state))
        expected = nearest(
            goal, lambda x: J @ ((x - force) / mass) + 2.5 * g, lambda x: J / mass  # noqa: B023
        )  # fmt: skip
        np.testing.assert_allclose(u, expected, rtol=0, atol=1e-12 * (1 + np.max(np.abs(expected))))


@pytest.mark.parametrize("curved", [False, True])
def test_the_discrete_law_meets_its_condition_at_the_periods_end(curved):
    """The plant's own map, which is not affine, moved by another program than the law's."""
    for seed in range(6):
        made, y, state = draw(seed, curved, ROBOTS)
        one = system_of(made, DiscreteCbfFilter(1.7, 0.3), ROBOTS, y, state, mode="sampled")
        loop = one.closed_loop(clock(H / 4, control=H))
        u = loop.advance(1, 1).input[0]
        plant = OdePlant(ROBOTS, H / 4)

        def ahead(u, plant=plant, state=state):
            plant.reset(state)
            plant.step(u, 4)
            return plant.output

        def slope(u):
            at, steps = ahead(u), 1e-4 * np.eye(N)
            rises = np.array([ahead(u + step) - ahead(u - step) for step in steps]).T / 2e-4
            return made.J(at) @ rises  # noqa: B023

        bound = 0.7 * made.g(y)
        expected = nearest(
            -1.7 * made.F(y), lambda u: made.g(ahead(u)) - bound, slope  # noqa: B023
        )  # fmt: skip
        np.testing.assert_allclose(u, expected, rtol=0, atol=1e-7 * (1 + np.max(np.abs(u))))
        assert np.max(made.g(ahead(u)) - bound) < 1e-10


def test_the_discrete_law_of_integrators_is_its_program():
    for seed in range(6):
        made, y, _ = draw(seed, curved=True)
        one = system_of(made, DiscreteCbfFilter(1.0, 1.0), integrators(N), y, mode="sampled")
        u = one.closed_loop(clock(H)).advance(1, 1).input[0]
        expected = nearest(
            -made.F(y), lambda u: made.g(y + H * u), lambda u: H * made.J(y + H * u)  # noqa: B023
        )  # fmt: skip
        np.testing.assert_allclose(u, expected, rtol=0, atol=1e-10 * (1 + np.max(np.abs(u))))


def at_the_end(made, law, h, duration, **options):
    """Outputs of integrators that begin at 0, at a run's end, and the greatest g on the way."""
    one = system_of(made, law, integrators(N), np.zeros(N), **options)
    loop = one.closed_loop(clock(h))
    loop.advance(1, round(duration / h))
    return loop.present().state[:, 0], np.max(loop.monitor.worst)


@pytest.mark.parametrize(
    ("law", "options"),
    [
        (SafeMonotoneFlow(1.0, 0.7), {}),
        (CbfFilter(1.0, 0.7), {}),
        (DiscreteCbfFilter(1.0, 0.03), {"mode": "sampled"}),
    ],
    ids=lambda given: getattr(given, "information", ""),
)
def test_integrators_stay_inside_and_end_at_the_variational_equilibrium(law, options):
    """Slacks fall as exp(-alpha t) at most, so that none is gone when bounds are reached."""
    made, duration = RandomGame(3, agents=N, constraints=4, curved=True), 20.0
    y, worst = at_the_end(made, law, H, duration, **options)
    found = variational_equilibrium(made.game, np.zeros(N))
    assert np.max(found.multipliers) > 0.1
    np.testing.assert_allclose(y, found.action, rtol=0, atol=1e-6)
    assert worst < 0
    assert np.max(made.g(y)) > -1e-5


@pytest.mark.parametrize(
    ("law", "mode", "overshoot"),
    [
        (ProjectedGradient(), "continuous", 0.1),  # of a step that meets a bound: 0.02 s
        (ProjectedGradient(), "sampled", 1e-12),
        (RecedingHorizon(4), "sampled", 1e-11),
    ],
    ids=lambda given: getattr(given, "information", str(given)),
)
def test_integrators_on_bounds_end_at_the_variational_equilibrium(law, mode, overshoot):
    made = RandomGame(3, agents=N, constraints=4, curved=True)
    y, worst = at_the_end(made, law, H, 20.0, mode=mode, on_exit="continue")
    found = variational_equilibrium(made.game, np.zeros(N))
    np.testing.assert_allclose(y, found.action, rtol=0, atol=1e-6)
    assert -1e-11 < worst < overshoot


def test_projected_play_is_a_projection_on_the_cone_and_on_the_set():
    for seed in range(6):
        made, inside, _ = draw(seed, curved=True)
        y = np.random.default_rng(seed).normal(size=N)
        y += 0.5 * made.A.sum(axis=0)  # some way outside
        goal, g, J = -1.7 * made.F(y), made.g(y), made.J(y)
        rows = g >= 0
        assert np.any(rows)
        law, agents = ProjectedGradient(1.7, 3.0), integrators(N)
        loop = system_of(made, law, agents, inside, on_exit="continue").closed_loop(clock(H))
        loop._workspace.vectors.state[:] = y
        u = loop.advance(1, 1).input[0]
        expected = nearest(goal, lambda x: (J @ x + 3.0 * g)[rows], lambda x: J[rows])  # noqa: B023
        np.testing.assert_allclose(u, expected, rtol=0, atol=1e-12 * (1 + np.max(np.abs(goal))))
        one = system_of(made, law, agents, inside, mode="sampled")
        u = one.closed_loop(clock(0.5)).advance(1, 1).input[0]
        goal = inside - 0.5 * 1.7 * made.F(inside)
        np.testing.assert_allclose(
            inside + 0.5 * u, nearest(goal, made.g, made.J, inside), atol=1e-9
        )


def test_a_plan_is_an_open_loop_equilibrium_of_the_linear_plant():
    """By another method, from responses to pulses at each knot of the plant."""
    agents, knots, periods, effort = pi_cascades(N), 5, 3, 0.2
    plant = OdePlant(agents, H)

    def outputs(plan, state):
        plant.reset(state)
        rows = []
        for u in plan:
            plant.step(u, periods)
            rows.append(plant.output)
        return np.array(rows)

    for seed in range(4):
        made, y, state = draw(seed, seed % 2, agents)
        law = RecedingHorizon(knots, periods, effort)
        one = system_of(made, law, agents, y, state, mode="sampled")
        u = one.closed_loop(clock(H)).advance(1, 1).input[0]
        zero = outputs(np.zeros((knots, N)), state)
        pulses = np.eye(knots)[:, :, None] * np.ones(N)
        rise = np.array([outputs(pulse, state) - zero for pulse in pulses])  # of j by i
        plan, multipliers = open_loop(made, zero, rise, effort)
        np.testing.assert_allclose(u, plan[0], rtol=0, atol=1e-8 * (1 + np.max(np.abs(u))))
        assert np.max(multipliers) > 0.0


def open_loop(made, zero, rise, effort):
    """The plan and its multipliers: from the smoothed complementarity of Fischer and Burmeister,
    sqrt(l^2 + g^2 + 2 t) - l + g = 0, which tells what binds; then of these alone."""
    knots, m = zero.shape
    p, n = len(made.b), knots * m

    def parts(x):
        U, l = x[:n].reshape(knots, m), x[n:].reshape(knots, p)  # noqa: E741
        Y = zero + np.einsum("ija,ia->ja", rise, U)
        slopes = np.array([made.F(y) + made.J(y).T @ each for y, each in zip(Y, l, strict=True)])
        G = np.einsum("ija,ja->ia", rise, slopes) + effort * U
        return G.ravel(), l.ravel(), np.array([made.g(y) for y in Y]).ravel()

    def smoothed(x, t):
        G, l, g = parts(x)  # noqa: E741
        return np.concatenate([G, np.sqrt(l**2 + g**2 + 2 * t) - l + g])

    x = np.concatenate([np.zeros(n), np.ones(knots * p)])
    for t in 10.0 ** -np.arange(0, 14, 1.0):
        x = root(smoothed, x, args=(t,)).x
    _, l, g = parts(x)  # noqa: E741
    binding = l > -g

    def exact(x):
        G, l, g = parts(x)  # noqa: E741
        return np.concatenate([G, np.where(binding, g, l)])

    x = root(exact, x, tol=1e-13).x
    _, l, g = parts(x)  # noqa: E741
    assert np.min(l) > -1e-9
    assert np.max(g) < 1e-9
    return x[:n].reshape(knots, m), l


def test_where_no_input_will_do_limits_are_kept_and_bounds_are_soft():
    """A spring pulls the robot towards its bound, harder than its motor can hold, or away."""
    made, limit = RandomGame(3, agents=1, constraints=1), 2.0
    agents = robots({name: numbers[:1] for name, numbers in UNEQUAL.items()}, limit)
    y = 0.99 * made.b / made.A[0]
    state = agents.equilibrium(y)
    for extension, expected in ((-8.0, -limit), (8.0, min(-made.F(y)[0], limit))):
        state[:, 0] = extension
        for law in (CbfFilter(), DiscreteCbfFilter(), RecedingHorizon(2, 1, 1e-6)):
            mode = (
                "sampled" if isinstance(law, DiscreteCbfFilter | RecedingHorizon) else "continuous"
            )
            one = system_of(made, law, agents, y, state, mode=mode)
            loop = one.closed_loop(clock(H))
            u = loop.advance(1, 1).input[0]
            if extension < 0 or mode != "sampled" or isinstance(law, DiscreteCbfFilter):
                assert u[0] == pytest.approx(expected, rel=1e-9)
            assert (loop.monitor.relaxed > 0) == (extension < 0)


@pytest.mark.parametrize("law", [CbfFilter(), RecedingHorizon(3)], ids=lambda law: law.information)
def test_in_mujoco_the_laws_find_the_same_state(law):
    made, y, state = draw(1, True, ROBOTS)
    mode = "sampled" if law.information == "receding-horizon" else "continuous"
    first = []
    for engine in ("ode", "mujoco"):
        one = system_of(made, law, ROBOTS, y, state, mode=mode, engine=engine, integrator="euler")
        first.append(one.closed_loop(clock(H)).advance(1, 1).input[0])
    np.testing.assert_allclose(*first, rtol=0, atol=1e-9)


def test_laws_of_periods_are_for_held_modes_and_numbers_are_looked_at():
    made = RandomGame(0, agents=N, constraints=4)
    with pytest.raises(InvalidInput, match="use 'sampled'"):
        system_of(made, DiscreteCbfFilter(), integrators(N), np.zeros(N))
    with pytest.raises(InvalidInput, match="must be above 0 and at most 1"):
        DiscreteCbfFilter(alpha=1.5)
    for law in (SafeMonotoneFlow, CbfFilter):
        with pytest.raises(InvalidInput, match="alpha"):
            law(alpha=0.0)
        with pytest.raises(InvalidInput, match="gain"):
            law(gain=-1.0)
    with pytest.raises(InvalidInput, match=r"knots: got 2.5, .* a whole number from 1 to 100"):
        RecedingHorizon(knots=2.5)


def test_plans_that_fill_the_memory_are_refused():
    """90 agents, 100 knots: a square matrix of 9100 unknowns has 83 million numbers."""
    made = RandomGame(0, agents=90, constraints=4)
    with pytest.raises(InvalidInput, match=r"agents.count: got 90, but what the receding-horizon"):
        system_of(made, RecedingHorizon(100), integrators(90), np.zeros(90), mode="sampled")


def test_what_a_law_asks_for_at_the_start_is_not_told_where_periods_matter():
    made = RandomGame(0, agents=N, constraints=4)
    for mode, told in (("continuous", True), ("sampled", False)):
        one = system_of(made, ProjectedGradient(), integrators(N), np.zeros(N), mode=mode)
        assert np.all(np.isfinite(law_at_start(one))) == told
