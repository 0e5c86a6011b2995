"""Games and laws of plain Python functions against the same ones as kernels, in every loop."""

import gc
from types import ModuleType

import coupled_game
import numpy as np
import pytest
from builders import (
    FIVE,
    UNEQUAL,
    V0,
    clock,
    distributed,
    integrators,
    relative_error,
    robot_state,
    robots,
    run_loop,
)

import reference
from gne_mj.barrier import LogBarrier
from gne_mj.controllers import FullInformation, PlainLaw
from gne_mj.equilibrium import penalised_equilibrium, variational_equilibrium
from gne_mj.errors import GneError, InvalidInput, UserCodeError
from gne_mj.game_model import Game
from gne_mj.games import velocity_game
from gne_mj.games import velocity_synchronization as velocity
from gne_mj.native import is_kernel
from gne_mj.plain import FUNCTIONS
from gne_mj.simulation import Simulation
from gne_mj.system import System

HESSIANS = ("add_cost_hessian", "constraint_hessian")
START = np.array([0.3, -0.4, 0.5, -0.2])


def plain_module(kernels, without=(), **changed):
    """A module of plain functions that call the kernels' Python; some left out or changed."""
    module = ModuleType("plain")
    for name in FUNCTIONS:
        if name not in without:
            function = changed.get(name, getattr(kernels, name))
            setattr(module, name, lambda *given, function=function: function(*given))
            assert not is_kernel(getattr(module, name))
    return module


def coupled(kernels=coupled_game, **changes):
    given = {
        "name": "coupled",
        "kernels": kernels,
        "parameters": np.array([0.7]),
        "sizes": coupled_game.SIZES,
        "in_cost": [(0, 1, 2)] * 3,
        "in_constraint": coupled_game.IN_CONSTRAINT,
        "constraint_names": ("ball", "product"),
    }
    return Game(**{**given, **changes})


def follow(kernels, count=5):
    """The velocity game with other kernels."""
    own = velocity_game(count, V0, 3.0)
    names = ("name", "parameters", "sizes", "in_cost", "in_constraint", "constraint_names")
    return Game(kernels=kernels, **{name: getattr(own, name) for name in names})


PLAIN, BARE = plain_module(coupled_game), plain_module(coupled_game, HESSIANS)


def test_arrays_of_a_game():
    game, plain, bare = coupled(), coupled(PLAIN), coupled(BARE)
    profiles = np.random.default_rng(0).uniform(-0.6, 0.6, (40, 4))
    for name in ("costs", "pseudo_gradient", "constraints"):
        expected = getattr(game, name)(profiles)
        assert np.allclose(getattr(plain, name)(profiles), expected, rtol=1e-14, atol=1e-15)
    weights = np.array([0.7, 1.3])
    for y in profiles:
        for name, given in (
            ("pseudo_gradient_jacobian", ()),
            ("constraint_jacobian", ()),
            ("weighted_constraint_hessian", (weights,)),
        ):
            expected = getattr(game, name)(y, *given)
            assert np.allclose(getattr(plain, name)(y, *given), expected, rtol=1e-14, atol=1e-15)
            # central differences: h^2 f''' / 6 and rounding / h, both some 1e-11 here
            assert np.allclose(getattr(bare, name)(y, *given), expected, rtol=0, atol=1e-9)


def test_differences_stay_accurate_for_great_actions():
    """The step grows with the action: d2/dy2 of y^4 q_0 / 4 at 1e4 is 2.1e8, to nine digits."""
    y = np.array([1e4, 0.1, -0.2, 0.3])
    expected = coupled().pseudo_gradient_jacobian(y)
    got = coupled(BARE).pseudo_gradient_jacobian(y)
    assert got[0, 0] == pytest.approx(expected[0, 0], rel=1e-9)


def test_equilibria():
    game, bare = coupled(), coupled(BARE)
    for find in (
        lambda g: penalised_equilibrium(g, 0.1, START),
        lambda g: variational_equilibrium(g, START),
    ):
        expected, got = find(game), find(bare)
        assert np.allclose(got.action, expected.action, rtol=0, atol=1e-10)
        assert got.residual < 1e-10


@pytest.mark.parametrize(
    ("integrator", "mode"), [("rk4", "continuous"), ("euler", "continuous"), ("rk4", "sampled")]
)
def test_ode_loops(integrator, mode):
    def run(kernels):
        game, agents = coupled(kernels), integrators(4)
        state = agents.equilibrium(START)
        system = System(
            "s", game, agents, FullInformation(), 0.1, state, mode=mode, integrator=integrator
        )
        return run_loop(system, 0.01, 100, 0.02)

    for got, expected in zip(run(BARE)[:2], run(coupled_game)[:2], strict=True):
        assert relative_error(got, expected) < 1e-13


@pytest.mark.parametrize("mode", ["continuous", "sampled"])
def test_mujoco_loop(mode):
    def run(kernels):
        system = System(
            "s", follow(kernels), robots(UNEQUAL), FullInformation(), 0.1, robot_state(FIVE),
            mode=mode, engine="mujoco",
        )  # fmt: skip
        return run_loop(system, 0.01, 60, 0.02)

    bare = plain_module(velocity, HESSIANS)
    for got, expected in zip(run(bare)[:2], run(velocity)[:2], strict=True):
        assert relative_error(got, expected) < 1e-13


@pytest.mark.slow
def test_rosenbrock_by_differences():
    """Its steps take Jacobians; those by differences cost no accuracy that its tolerance shows."""

    def run(kernels):
        agents = integrators(4)
        system = System(
            "s", coupled(kernels), agents, distributed("ring", 0.05, count=3), 0.1,
            agents.equilibrium(START), integrator="rosenbrock",
        )  # fmt: skip
        return run_loop(system, 0.05, 40)

    expected, got = run(coupled_game), run(BARE)
    assert relative_error(got[0], expected[0]) < 1e-6
    with_hessians = run(PLAIN)
    assert relative_error(with_hessians[0], expected[0]) < 1e-11


def law(game, **functions):
    """Full information as plain functions, or others."""

    def action(game, rho, y, memory):
        return -game.pseudo_gradient(y) - LogBarrier(game, rho).gradient(y)

    return PlainLaw(game, **{"action": action, **functions})


def ode_system(game, plain, mode="continuous"):
    agents = integrators(4)
    return System("s", game, agents, plain, 0.1, agents.equilibrium(START), mode=mode)


@pytest.mark.parametrize("mode", ["continuous", "sampled"])
@pytest.mark.parametrize(
    "kernels",
    [
        pytest.param(coupled_game, id="kernels", marks=pytest.mark.slow),
        pytest.param(BARE, id="plain"),
    ],
)
def test_a_plain_law(kernels, mode):
    game = coupled(kernels)
    got, inputs, *_ = run_loop(ode_system(game, law(game), mode), 0.01, 50, 0.02)
    kernel_law = ode_system(coupled(), FullInformation(), mode)
    expected, forces, *_ = run_loop(kernel_law, 0.01, 50, 0.02)
    assert relative_error(got, expected) < 1e-13
    assert relative_error(inputs, forces) < 1e-13


def test_a_loop_keeps_plain_functions_alive():
    """It knows them by address only."""

    def loop():
        game = coupled(plain_module(coupled_game))
        return ode_system(game, law(game)).closed_loop(clock(0.01))

    left = loop()
    gc.collect()
    samples = left.advance(20, 1)
    expected, *_ = run_loop(ode_system(coupled(), FullInformation()), 0.01, 20)
    assert relative_error(samples.state, expected[:-1]) < 1e-13


def broken_gradient(limit):
    """The gradient, which raises once y_1 has fallen below a limit."""

    def cost_gradient(q, i, a, y):
        if y[0] < limit:
            raise KeyError("too low")
        return coupled_game.cost_gradient(q, i, a, y)

    return cost_gradient


def test_exceptions_surface_where_they_happen():
    """y_1 falls from 0.3 to about 0: the run begins well and then raises."""
    module = plain_module(coupled_game)
    module.cost_gradient = broken_gradient(-10.0)  # for the equilibrium
    game = coupled(module)
    system = ode_system(game, FullInformation())
    assert system.equilibrium.action[0] < 0.25

    broken = coupled(plain_module(coupled_game), name="broken")
    broken_system = ode_system(broken, law(broken, action=lambda g, rho, y, memory: 1 / 0))
    with pytest.raises(UserCodeError, match=r"test_plain.py, line \d+, in <lambda>: ZeroDivision"):
        Simulation([broken_system], clock(0.01)).step()

    def action(game, rho, y, memory):
        if y[0] < 0.25:
            raise KeyError("too low")
        return -game.pseudo_gradient(y)

    late = Simulation([ode_system(game, law(game, action=action))], clock(0.01, 5.0))
    late.step()
    with pytest.raises(UserCodeError, match=r"in action: KeyError: 'too low'") as caught:
        late.run()
    assert isinstance(caught.value.__cause__, KeyError)
    # nothing is left over for the next one
    game.pseudo_gradient(START)


def test_exceptions_in_arrays_and_solvers():
    module = plain_module(coupled_game)
    module.cost_gradient = broken_gradient(0.25)
    game = coupled(module)
    assert np.all(np.isfinite(game.pseudo_gradient(START)))
    with pytest.raises(UserCodeError, match=r"in cost_gradient: KeyError: 'too low'"):
        penalised_equilibrium(game, 0.1, START)
    for name, call in {
        "add_cost_hessian": lambda g: g.pseudo_gradient_jacobian(START),
        "constraint_gradient": lambda g: g.constraint_jacobian(START),
        "constraint_hessian": lambda g: g.weighted_constraint_hessian(START, [1.0, 1.0]),
        "cost": lambda g: g.costs(START),
    }.items():
        module = plain_module(coupled_game)
        setattr(module, name, lambda *_: 1 / 0)
        with pytest.raises(UserCodeError, match="ZeroDivisionError") as caught:
            call(coupled(module))
        assert isinstance(caught.value.__cause__, ZeroDivisionError)
        assert isinstance(caught.value, GneError)


def test_ctrl_c_inside_a_function_is_no_error_of_the_user():
    module = plain_module(coupled_game)

    def cost(q, i, y):
        raise KeyboardInterrupt

    module.cost = cost
    with pytest.raises(KeyboardInterrupt):
        coupled(module).costs(START)


def test_what_a_function_is_given_is_read_only():
    def cost(q, i, y):
        y[0] = 7.0
        return 0.0

    module = plain_module(coupled_game)
    module.cost = cost
    y = START.copy()
    with pytest.raises(UserCodeError, match="read-only"):
        coupled(module).costs(y)
    assert np.all(y == START)


@pytest.mark.parametrize(
    ("value", "words"),
    [(None, "not None"), ("a", "str 'a'"), (np.zeros(2), "not ndarray"), (1j, "complex")],
)
def test_values_that_are_no_number(value, words):
    module = plain_module(coupled_game)
    module.cost = lambda q, i, y: value
    with pytest.raises(UserCodeError) as caught:
        coupled(module).costs(START)
    assert words in str(caught.value)


@pytest.mark.parametrize(
    ("changes", "key"),
    [
        ({"sizes": ()}, "sizes"),
        ({"sizes": (2, 0, 1)}, "sizes"),
        ({"in_cost": [(0, 1, 2)] * 2}, "in_cost"),
        ({"in_cost": [(0, 1, 3)] * 3}, "in_cost"),
        ({"in_cost": [(0, 1, 1)] * 3}, "in_cost"),
        ({"in_constraint": [(0, 1), (-1, 2)]}, "in_constraint"),
        ({"in_constraint": [(0, 1), ()]}, "in_constraint"),
        ({"in_constraint": [(0, 1)]}, "in_constraint"),
        ({"in_constraint": [], "constraint_names": ()}, "in_constraint"),
        ({"kernels": plain_module(coupled_game, ("cost",))}, "kernels"),
        ({"kernels": plain_module(coupled_game, HESSIANS, cost=lambda q, y: 0)}, None),
    ],
)
def test_games_that_do_not_fit_together(changes, key):
    """They would have native code read beyond its arrays."""
    if key is None:  # the module's functions take anything: what they call does not
        with pytest.raises(UserCodeError, match="TypeError"):
            coupled(**changes).costs(START)
        return
    with pytest.raises(InvalidInput) as caught:
        coupled(**changes)
    assert caught.value.key == key


def test_laws_that_do_not_fit_together():
    game = coupled()
    with pytest.raises(InvalidInput, match="both of these functions"):
        law(game, memory=lambda y: y)
    with_memory = law(game, memory=lambda y: y, rate=lambda game, rho, y, memory: 0 * y)
    with pytest.raises(InvalidInput, match=r"^mode: got 'sampled'"):
        ode_system(game, with_memory, "sampled")
    for memory in (lambda y: 3.0, lambda y: [], lambda y: [[1.0]], lambda y: "a"):
        bad = law(game, memory=memory, rate=lambda game, rho, y, memory: memory)
        with pytest.raises(UserCodeError, match="must return"):
            ode_system(game, bad)


@pytest.mark.parametrize("size", [1, 4])
def test_a_plain_law_with_a_memory_moves_it_by_its_rate(size):
    """Against RK4 in plain Python; as long as the action, it could be taken for that unseen."""
    game = coupled(BARE)

    def action(game, rho, y, memory):
        return -game.pseudo_gradient(y) - LogBarrier(game, rho).gradient(y) - 0.3 * memory[0]

    def rate(game, rho, y, memory):
        return np.resize(y, size) - (1.0 + rho) * memory + 0.1 * np.arange(size)

    plain = law(game, action=action, rate=rate, memory=lambda y: np.full(size, 0.5))
    states, inputs, memory, _ = run_loop(ode_system(game, plain), 0.02, 10)

    def closed(_time, x):
        y, own = x[:4], x[4:]
        return np.concatenate([action(game, 0.1, y, own), rate(game, 0.1, y, own)])

    start = np.concatenate([START, np.full(size, 0.5)])
    expected = reference.rk4_fixed(closed, start, 0.02, 10)
    assert relative_error(states[:, :, 0], expected[:, :4]) < 1e-12
    assert relative_error(memory, expected[:, 4:]) < 1e-12
    assert relative_error(inputs[-1], action(game, 0.1, *np.split(expected[-1], [4]))) < 1e-12
