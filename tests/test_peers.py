"""Our results beside those of other packages, which come by other methods to the same ones.

Variational equilibria beside NashOpt's, closed loops beside MJX's and diffrax's, and cbfpy's filter
as scripts/benchmark runs it. Needs the extra `peers`, whose compilers take their time.
"""

import importlib
import warnings
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from gne_mj.equilibrium import variational_equilibrium
from gne_mj.games import osnr_game, ten_channels, velocity_game

pytestmark = [pytest.mark.slow, pytest.mark.filterwarnings("ignore")]


@pytest.fixture(scope="module")
def peer():
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # of its dependencies, at import
        nashopt = pytest.importorskip("nashopt")
        jax_numpy = pytest.importorskip("jax.numpy")
    return SimpleNamespace(nashopt=nashopt, jnp=jax_numpy)


def test_osnr(peer):
    numbers = ten_channels()
    columns = [np.array(numbers[key]) for key in ("price", "utility_weight", "gain", "noise_power")]
    price, weight, gain, noise = columns
    matrix = np.array(numbers["system_matrix"])
    np.fill_diagonal(matrix, 0.0)
    limit, start = numbers["total_power_limit"], np.full(10, 0.2)

    def cost(i):
        def of(y):
            ratio = gain[i] * y[i] / (noise[i] + matrix[i] @ y)
            return price[i] * y[i] - weight[i] * peer.jnp.log(1.0 + ratio)

        return of

    game = peer.nashopt.GNEP(
        [1] * 10, [cost(i) for i in range(10)],
        g=lambda y: peer.jnp.array([peer.jnp.sum(y) - limit]), ng=1,
        lb=np.zeros(10), ub=np.full(10, np.inf), variational=True,
    )  # fmt: skip
    theirs = game.solve(x0=start, solver="lm", verbose=0)
    ours = variational_equilibrium(osnr_game(**numbers), start)
    assert np.linalg.norm(theirs.res) < 1e-12
    assert np.allclose(ours.action, theirs.x, rtol=0, atol=1e-10)
    assert ours.multipliers[-1] == pytest.approx(theirs.lam[0][0], rel=1e-9)


def linear_quadratic(v0, delta, desired, weight):
    """Q_i and c_i of the desired-velocity game, and its gaps' bounds as A y <= b."""
    count = len(delta)
    quadratic, linear = np.zeros((count, count, count)), np.zeros((count, count))
    for i in range(count):
        quadratic[i, i, i] = 2.0 + 2.0 * weight[i]
        linear[i, i] = -2.0 * weight[i] * desired[i]
        if i == 0:
            linear[i, i] -= 2.0 * v0
        else:
            quadratic[i, i, i - 1] = quadratic[i, i - 1, i] = -2.0
            quadratic[i, i - 1, i - 1] = 2.0
    gaps, first = np.eye(count) - np.eye(count, k=-1), np.zeros(count)
    first[0] = v0
    rows, bounds = np.vstack([gaps, -gaps]), np.concatenate([delta + first, delta - first])
    return list(quadratic), list(linear), rows, bounds


@pytest.mark.parametrize("method", ["lemke_dual", "dr_daqp"])
@pytest.mark.parametrize("count", [5, 40])
def test_desired_velocities_with_affine_bounds(peer, method, count):
    rng = np.random.default_rng(count)
    delta, weight = rng.uniform(0.2, 0.8, count), rng.uniform(0.5, 2.0, count)
    desired = 3.0 + 1.5 * rng.normal(size=count)
    quadratic, linear, rows, bounds = linear_quadratic(3.0, delta, desired, weight)
    theirs = peer.nashopt.GNEP_LQ(
        [1] * count, quadratic, linear, A=rows, b=bounds, variational=True, solver=method
    ).solve()
    game = velocity_game(count, 3.0, delta, desired, weight)
    ours = variational_equilibrium(game, np.full(count, 3.0 - 1e-3))
    assert np.allclose(ours.action, theirs.x, rtol=0, atol=1e-8)
    multipliers = np.asarray(theirs.lam)[: 2 * count]
    assert np.count_nonzero(multipliers > 1e-9) >= 0.2 * count
    # of the squared gap's bound: grad g = 2 gap (e_i - e_{i-1})
    gap = np.diff(ours.action, prepend=3.0)
    assert np.allclose(
        2.0 * gap * ours.multipliers, multipliers[:count] - multipliers[count:], atol=1e-7
    )


@pytest.fixture(scope="module")
def script():
    """A module of scripts/benchmarks, by name and by the packages that it needs."""
    with pytest.MonkeyPatch.context() as patch:
        patch.syspath_prepend(Path(__file__).parents[1] / "scripts" / "benchmarks")

        def load(name, *packages):
            with warnings.catch_warnings():
                warnings.simplefilter("ignore")
                for package in packages:
                    pytest.importorskip(package)
                return importlib.import_module(name)

        yield load


@pytest.mark.parametrize("integrator", ["euler", "rk4"])
def test_closed_loops_in_mjx(script, integrator):
    mjx = script("peer_mjx", "mujoco.mjx")
    states = mjx.common.starts(6)
    _, theirs = mjx.Batch(integrator, 100).run(states)()
    _, mine = mjx.ours(integrator, 100, states)()
    assert np.max(np.abs(mine - states[:, :, 1])) > 0.1
    assert np.allclose(mine, theirs, rtol=0, atol=1e-12)


def test_robots_in_diffrax(script):
    peer = script("peer_diffrax", "diffrax")
    states = peer.common.starts(4)
    fine = 20 * peer.STEPS  # steps that are not divided
    _, theirs = peer.batch(peer.fixed(peer.Rk4())(fine), states[:, :, :3])()
    _, mine = peer.ours(peer.of_robots(), fine, states)()
    assert np.allclose(mine, theirs, rtol=0, atol=1e-12)
    _, theirs = peer.batch(peer.adaptive(peer.diffrax.Dopri8())(1e-10), states[:, :, :3])()
    assert np.allclose(mine, theirs, rtol=0, atol=1e-8)


@pytest.mark.parametrize("kind", ["integrator", "pi_cascade"])
def test_channels_in_diffrax(script, kind):
    peer = script("peer_diffrax", "diffrax")
    of = peer.of_channels(getattr(peer, kind))
    states = of.starts(4)
    fine = 4 * of.steps  # steps that are not divided
    _, theirs = peer.batch(peer.fixed(peer.Rk4(), of.rate, of.end)(fine), states)()
    _, mine = peer.ours(of, fine, states)()
    assert np.max(np.abs(mine - states)) > 0.01
    assert np.allclose(mine, theirs, rtol=0, atol=1e-12)


def test_stiff_twin_in_diffrax(script):
    peer = script("peer_diffrax", "diffrax")
    case = peer.twin.Twin(peer.pi_cascade, 0.1, 1e-2)
    _, theirs = peer.stiff(case, peer.diffrax.Kvaerno3())(1e-7)
    _, mine = case.ours(1e-7)
    assert np.allclose(mine, theirs, rtol=0, atol=1e-6)


def test_filter_of_cbfpy(script):
    peer = script("peer_cbfpy", "cbfpy", "elastiqp")
    states = peer.common.starts(20, 0.99)
    for solver in peer.SOLVERS:
        control = peer.jax.jit(peer.law(solver))
        for state in states[:, :, :3]:
            gap, u = (
                np.diff(state[:, 1], prepend=peer.common.V0),
                np.asarray(control(state.ravel())),
            )
            pull = state[:, 0] + np.arctan(state[:, 0]) + state[:, 1] - state[:, 2]
            rate = -2.0 * gap * np.diff(u - pull, prepend=0.0)
            assert np.all(rate >= -(peer.common.DELTA**2 - gap**2) - 1e-2)  # h' >= -h, and relaxed
    assert np.all(peer.filtered(states[:3], 0.001, 0.1) > 0)
