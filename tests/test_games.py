"""Games and their barrier against the slow oracles, over random games of every size."""

import numpy as np
import pytest
from builders import reference_osnr
from hypothesis import given
from hypothesis import strategies as st

import reference
import reference_games
from gne_mj.barrier import LogBarrier
from gne_mj.errors import InvalidInput
from gne_mj.games import cournot_game, osnr_game, ten_channels, velocity_game

RHO = 0.1
PROFILES = 100


def velocity(rng, count):
    v0, delta = rng.uniform(-5, 5), rng.uniform(0.3, 4, count)

    def interior(rows):
        return v0 + np.cumsum(rng.uniform(-0.95, 0.95, (rows, count)) * delta, axis=1)

    return velocity_game(count, v0, delta), reference_games.VelocityGame(v0, delta), interior


def desired_velocity(rng, count):
    _, plain, interior = velocity(rng, count)
    desired, weight = (
        rng.uniform(-5, 5, count),
        rng.uniform(0, 3, count) * rng.integers(0, 2, count),
    )
    game = velocity_game(count, plain.v0, plain.delta, desired, weight)
    return game, reference_games.VelocityGame(plain.v0, plain.delta, desired, weight), interior


def osnr(rng, count):
    parameters = {
        "price": rng.uniform(0.1, 3, count),
        "utility_weight": rng.uniform(0.1, 3, count),
        "gain": rng.uniform(0.3, 5, count),
        "noise_power": rng.uniform(0.05, 1, count),
        "system_matrix": rng.uniform(0, 0.5, (count, count)),
        "total_power_limit": rng.uniform(0.5, 5),
    }

    def interior(rows):
        shares = rng.dirichlet(np.full(count + 1, 3.0), rows)[:, :count]
        return parameters["total_power_limit"] * (0.01 / count + 0.98 * shares)

    return osnr_game(**parameters), reference_osnr(parameters), interior


def cournot(rng, count):
    costs, intercept = rng.uniform(1, 60, count), rng.uniform(10, 600)
    lower = rng.uniform(-5, 10, count)
    upper = lower + rng.uniform(1, 80, count)

    def interior(rows):
        return lower + rng.uniform(0.03, 0.97, (rows, count)) * (upper - lower)

    game = cournot_game(count, costs, intercept, lower, upper)
    return game, reference_games.CournotGame(costs, intercept, lower, upper), interior


any_game = pytest.mark.parametrize("build", [velocity, desired_velocity, osnr, cournot])
sizes = st.integers(1, 8)
seeds = st.integers(0, 2**32 - 1)


def assert_equal_to_rounding(got, expected):
    """Entry by entry to 1e-12, where an entry is not lost in the cancellation of greater ones."""
    expected = np.asarray(expected)
    assert got.shape == expected.shape
    np.testing.assert_allclose(got, expected, rtol=1e-12, atol=1e-14 * np.max(np.abs(expected)))


def differences(function, y, step=1e-5):
    """Jacobian by fourth-order central differences: (outputs, len(y)), or (len(y),) of a scalar."""
    columns = []
    for direction in step * np.eye(len(y)):
        near = function(y + direction) - function(y - direction)
        far = function(y + 2 * direction) - function(y - 2 * direction)
        columns.append((8 * near - far) / (12 * step))
    return np.array(columns).T


@any_game
@given(count=sizes, seed=seeds)
def test_values_equal_the_reference(build, count, seed):
    game, oracle, interior = build(np.random.default_rng(seed), count)
    profiles = interior(PROFILES)
    assert (game.agents, game.actions, game.constraints_count) == (count, count, oracle.p)
    assert_equal_to_rounding(
        game.costs(profiles), [[oracle.cost(i, y) for i in range(count)] for y in profiles]
    )
    assert_equal_to_rounding(
        game.pseudo_gradient(profiles), [reference.pseudo_gradient(oracle, y) for y in profiles]
    )
    assert_equal_to_rounding(
        game.constraints(profiles), [reference.constraints(oracle, y) for y in profiles]
    )
    assert np.all(game.constraints(profiles) < 0)


@any_game
@given(count=sizes, seed=seeds)
def test_derivatives_equal_the_complex_step(build, count, seed):
    rng = np.random.default_rng(seed)
    game, oracle, interior = build(rng, count)
    barrier = LogBarrier(game, RHO)
    for y in interior(4):
        weights = rng.uniform(-2, 2, oracle.p)

        def weighted(point, weights=weights):
            rows = [w * oracle.constraint_gradient(k, point) for k, w in enumerate(weights)]
            return np.sum(rows, axis=0)

        constraint_jacobian = [oracle.constraint_gradient(k, y) for k in range(oracle.p)]
        pairs = [
            (game.pseudo_gradient_jacobian(y), reference.pseudo_gradient_jacobian(oracle, y)),
            (game.constraint_jacobian(y), constraint_jacobian),
            (
                game.constraint_jacobian(y),
                reference.complex_step_jacobian(lambda x: reference.constraints(oracle, x), y),
            ),
            (
                game.weighted_constraint_hessian(y, weights),
                reference.complex_step_jacobian(weighted, y),
            ),
            (barrier.gradient(y), reference.barrier_gradient(oracle, RHO, y)),
            (barrier.hessian(y), reference.barrier_hessian(oracle, RHO, y)),
            (np.array(barrier.value(y)), reference.barrier(oracle, RHO, y)),
            (barrier.weights(y), RHO / -reference.constraints(oracle, y)),
        ]
        for got, expected in pairs:
            assert_equal_to_rounding(got, expected)


@any_game
@given(count=sizes, seed=seeds)
def test_derivatives_equal_differences_of_the_values(build, count, seed):
    """The product against itself: what the reference says is not asked here."""
    rng = np.random.default_rng(seed)
    game, _, interior = build(rng, count)
    centre = interior(400).mean(axis=0)
    y = centre + 0.5 * (interior(1)[0] - centre)
    barrier = LogBarrier(game, RHO)
    weights = rng.uniform(-2, 2, game.constraints_count)
    pairs = [
        (game.pseudo_gradient(y), np.diag(differences(game.costs, y))),
        (game.pseudo_gradient_jacobian(y), differences(game.pseudo_gradient, y)),
        (game.constraint_jacobian(y), differences(game.constraints, y)),
        (
            game.weighted_constraint_hessian(y, weights),
            differences(lambda x: weights @ game.constraint_jacobian(x), y),
        ),
        (barrier.gradient(y), differences(barrier.value, y)),
        (barrier.hessian(y), differences(barrier.gradient, y)),
    ]
    for got, expected in pairs:
        scale = max(1.0, np.max(np.abs(expected)))
        np.testing.assert_allclose(got, expected, rtol=1e-7, atol=1e-7 * scale)


@any_game
def test_many_profiles_at_once(build):
    game, _, interior = build(np.random.default_rng(1), 4)
    profiles = interior(24).reshape(2, 3, 4, 4)
    for function, width in (
        (game.costs, 4),
        (game.pseudo_gradient, 4),
        (game.constraints, game.constraints_count),
    ):
        together = function(profiles)
        assert together.shape == (2, 3, 4, width)
        for at in np.ndindex(2, 3, 4):
            assert np.array_equal(function(profiles[at]), together[at])
        assert function(profiles[:, :0]).shape == (2, 0, 4, width)
        assert np.array_equal(function(profiles[..., ::1][::-1]), together[::-1])
        assert np.array_equal(function(profiles[0, 0, 0].tolist()), together[0, 0, 0])
        with pytest.raises(ValueError, match="4 actions"):
            function(profiles[..., :3])


@any_game
def test_arrays_that_cannot_be_written(build):
    """They are never changed, and what a game holds cannot be."""
    game, _, interior = build(np.random.default_rng(2), 3)
    y = interior(1)[0]
    before = y.copy()
    writable = [f(y) for f in (game.costs, game.constraints, game.constraint_jacobian)]
    y.flags.writeable = False
    weights = np.ones(game.constraints_count)
    weights.flags.writeable = False
    read_only = [f(y) for f in (game.costs, game.constraints, game.constraint_jacobian)]
    for first, second in zip(writable, read_only, strict=True):
        assert np.array_equal(first, second)
    game.pseudo_gradient_jacobian(y)
    game.weighted_constraint_hessian(y, weights)
    LogBarrier(game, RHO).hessian(y)
    assert np.array_equal(y, before)
    for array in game.data:
        with pytest.raises(ValueError, match="read-only"):
            array[...] = 0


@any_game
@pytest.mark.parametrize("count", [1, 2, 6])
def test_who_appears_where(build, count):
    """The index lists are the sparsity of the derivatives, no more and no less."""
    game, oracle, interior = build(np.random.default_rng(3), count)
    y = interior(1)[0]
    for k, members in enumerate(game.in_constraint):
        assert set(members) == set(np.flatnonzero(oracle.constraint_gradient(k, y)))
    for i, members in enumerate(game.in_cost):
        gradient = differences(lambda x, i=i: np.array(oracle.cost(i, x)), y)
        assert set(np.flatnonzero(np.abs(gradient) > 1e-6)) <= set(members)
    own = [sum(i in members for members in game.in_constraint) for i in range(count)]
    assert game.own_constraints.tolist() == own
    assert len(game.constraint_names) == len(set(game.constraint_names)) == oracle.p


def test_the_velocity_games_constants():
    """Strong monotonicity and the Lipschitz constant of the paper's five robots."""
    jacobian = velocity_game(5, 3.0, 3.0).pseudo_gradient_jacobian(np.zeros(5))
    mu, theta_1, theta_2 = reference.affine_constants(jacobian)
    assert mu == pytest.approx(0.267949, abs=5e-7)
    assert mu == pytest.approx(2 - np.sqrt(3))
    assert theta_1 == pytest.approx(3.837972, abs=5e-7)
    assert theta_2 == pytest.approx(2 * np.sqrt(2))


@given(count=sizes, seed=seeds)
def test_the_velocity_game_is_strongly_monotone(count, seed):
    game, _, interior = velocity(np.random.default_rng(seed), count)
    a, b = interior(PROFILES), interior(PROFILES)
    product = np.sum((a - b) * (game.pseudo_gradient(a) - game.pseudo_gradient(b)), axis=1)
    mu = 2 - 2 * np.cos(np.pi / (count + 1))
    assert np.all(product >= (mu - 1e-12) * np.sum((a - b) ** 2, axis=1))


def test_the_shipped_osnr_game_is_monotone_where_it_is_played():
    rng = np.random.default_rng(4)
    game = osnr_game(**ten_channels())
    limit = ten_channels()["total_power_limit"]
    for y in limit * rng.dirichlet(np.ones(11), PROFILES)[:, :10]:
        jacobian = game.pseudo_gradient_jacobian(y)
        assert np.linalg.eigvalsh(jacobian + jacobian.T)[0] > 0


@any_game
def test_the_barrier_ends_at_the_boundary(build):
    game, oracle, interior = build(np.random.default_rng(5), 4)
    barrier = LogBarrier(game, RHO)
    inside = interior(1)[0]
    assert barrier.margin(inside) == -np.max(game.constraints(inside)) > 0
    outside = inside.copy()
    outside[0] += 100.0
    assert barrier.margin(outside) < 0
    for y in (outside, np.full(4, np.nan), np.array([*inside[:3], np.nan])):
        assert barrier.value(y) == np.inf
        for function in (barrier.gradient, barrier.hessian, barrier.weights):
            with pytest.raises(ValueError, match="no gradient"):
                function(y)
    worst, value = game.tightest(outside)
    assert value == np.max(reference.constraints(oracle, outside))
    with pytest.raises(ValueError, match=game.constraint_names[worst]):
        barrier.gradient(outside)


def test_exactly_on_the_boundary_is_outside():
    cases = [
        (velocity_game(2, 3.0, 3.0), [0.0, 0.0], "gap of agent 1"),
        (velocity_game(2, 3.0, 3.0), [6.0, 6.0], "gap of agent 1"),
        (osnr_game([1, 1], [1, 1], [1, 1], [1, 1], np.zeros((2, 2)), 1.0), [0.5, 0.5], "total"),
        (osnr_game([1, 1], [1, 1], [1, 1], [1, 1], np.zeros((2, 2)), 1.0), [0.5, 0.0], "channel 2"),
    ]
    for game, y, name in cases:
        barrier = LogBarrier(game, RHO)
        assert barrier.value(y) == np.inf
        assert barrier.margin(y) == 0
        with pytest.raises(ValueError, match=name):
            barrier.gradient(y)


GOOD = {
    "price": [1.0, 2.0],
    "utility_weight": [1.0, 2.0],
    "gain": [1.0, 2.0],
    "noise_power": [0.1, 0.2],
    "system_matrix": [[0.0, 0.1], [0.2, 0.0]],
    "total_power_limit": 1.0,
}
BAD_VECTORS = ([1.0, 0.0], [1.0, -1.0], [1.0, np.nan], [np.inf, 1.0], [1.0, 1.0, 1.0], 1.0)
BAD = [
    *((key, bad) for key in ("utility_weight", "gain", "noise_power") for bad in BAD_VECTORS),
    *(("price", bad) for bad in BAD_VECTORS[:4]),
    ("system_matrix", [[0.0, -0.1], [0.2, 0.0]]),
    ("system_matrix", [[0.0, np.nan], [0.2, 0.0]]),
    ("system_matrix", [[0.0, 0.1]]),
    ("system_matrix", [0.0, 0.1]),
    *(("total_power_limit", bad) for bad in (0.0, -1.0, np.nan, np.inf)),
]


@pytest.mark.parametrize(("key", "bad"), BAD, ids=str)
def test_bad_osnr_parameters(key, bad):
    osnr_game(**GOOD)
    with pytest.raises(InvalidInput) as caught:
        osnr_game(**{**GOOD, key: bad})
    assert caught.value.key == key


@pytest.mark.parametrize(
    "bad", [0.0, -1.0, np.nan, np.inf, [1.0, 0.0, 1.0], [1.0, 1.0, np.nan]], ids=str
)
def test_bad_gap_bounds(bad):
    with pytest.raises(InvalidInput) as caught:
        velocity_game(3, 3.0, bad)
    assert caught.value.key == "gap_bound"


@pytest.mark.parametrize(
    ("key", "bad"),
    [("desired_velocity", np.nan), ("desired_velocity", [1.0, np.inf, 0.0])]
    + [("desired_weight", bad) for bad in (-1.0, np.nan, np.inf, [0.0, 0.0, -1e-9])],
    ids=str,
)
def test_bad_desires(key, bad):
    with pytest.raises(InvalidInput) as caught:
        velocity_game(3, 3.0, 1.0, **{key: bad})
    assert caught.value.key == key


def test_a_desired_velocity_of_no_weight_changes_no_bit():
    rng = np.random.default_rng(6)
    game, _, interior = velocity(rng, 6)
    v0, delta = game.parameters[0], game.gap_bounds
    other = velocity_game(6, v0, delta, rng.uniform(-9, 9, 6), 0.0)
    for y in interior(20):
        gap = np.diff(y, prepend=v0)
        assert np.array_equal(other.costs(y), gap**2)
        assert np.array_equal(other.pseudo_gradient(y), 2.0 * gap)
        assert np.array_equal(game.pseudo_gradient(y), 2.0 * gap)
        assert np.array_equal(game.costs(y), gap**2)
        assert np.array_equal(game.pseudo_gradient_jacobian(y), 2.0 * (np.eye(6) - np.eye(6, k=-1)))


def test_the_crosstalk_of_a_channel_with_itself_is_not_used():
    matrix = np.array(GOOD["system_matrix"])
    filled = osnr_game(**{**GOOD, "system_matrix": matrix + np.diag([7.0, -9.0])})
    y = np.array([0.3, 0.4])
    assert np.array_equal(filled.costs(y), osnr_game(**GOOD).costs(y))
    assert np.array_equal(
        filled.pseudo_gradient_jacobian(y), osnr_game(**GOOD).pseudo_gradient_jacobian(y)
    )


@pytest.mark.parametrize("rho", [0.0, -0.1, np.nan, np.inf])
def test_bad_rho(rho):
    with pytest.raises(InvalidInput, match="rho"):
        LogBarrier(velocity_game(1, 0.0, 1.0), rho)
