"""The closed loop in MuJoCo against independent integrations of the ODE."""

import ctypes

import mujoco
import numpy as np
import pytest
from builders import (
    EQUAL,
    FIVE,
    UNEQUAL,
    V0,
    clock,
    random_robot_state,
    reference_robots,
    relative_error,
    robot_state,
    robot_system,
    run_loop,
)

import reference
import reference_games
from gne_mj.errors import EngineError, InvalidInput
from gne_mj.loops import monitor as watch
from gne_mj.plants.callbacks import callbacks
from gne_mj.plants.mujoco import MujocoPlant

DELTA = np.full(5, 3.0)


def starts():
    rng = np.random.default_rng(1)
    named = robot_state(FIVE)
    return [named, *(random_robot_state(rng, 0.5 * DELTA, spread=2.0) for _ in range(4))]


def reference_rate(numbers, rho=0.1, delta=DELTA):
    game = reference_games.VelocityGame(V0, delta)
    return reference.closed_loop_rate(reference_robots(numbers), "full_information", game, rho)


@pytest.mark.parametrize("start", range(5))
@pytest.mark.parametrize("numbers", [EQUAL, UNEQUAL], ids=["equal", "unequal"])
def test_continuous_equals_a_plain_rk4_of_the_ode(numbers, start):
    state, h, steps = starts()[start], 0.005, 2000
    expected = reference.rk4_fixed(reference_rate(numbers), state[:, :3].ravel(), h, steps)
    system = robot_system(state, numbers, engine="mujoco")
    states, _, _, loop = run_loop(system, h, steps)
    assert loop.monitor.exit == watch.INSIDE
    assert loop.monitor.divided == 0
    assert relative_error(states[:, :, :3].reshape(len(expected), -1), expected) < 1e-11


def test_continuous_is_close_to_dop853_at_one_millisecond():
    times = np.linspace(0.0, 20.0, 201)
    for state in starts()[:2]:
        exact = reference.dop853(reference_rate(UNEQUAL), state[:, :3].ravel(), times)
        system = robot_system(state, UNEQUAL, engine="mujoco")
        states, *_ = run_loop(system, 1e-3, 20_000, every=100)
        assert relative_error(states[:, :, :3].reshape(len(exact), -1), exact) < 1e-9


def test_continuous_is_of_fourth_order():
    times = np.array([0.0, 2.0])
    state = robot_state(FIVE)
    exact = reference.dop853(reference_rate(UNEQUAL), state[:, :3].ravel(), times)[-1]
    errors = []
    for h in (0.04, 0.02, 0.01, 0.005):
        states, *_ = run_loop(robot_system(state, UNEQUAL, engine="mujoco"), h, round(2 / h))
        errors.append(np.max(np.abs(states[-1, :, :3].ravel() - exact)))
    orders = np.log2(np.array(errors[:-1]) / errors[1:])
    assert np.all(np.abs(orders[1:] - 4.0) < 0.35), (errors, orders)


@pytest.mark.parametrize("numbers", [EQUAL, UNEQUAL], ids=["equal", "unequal"])
def test_euler_is_semi_implicit(numbers):
    h, steps, state = 0.005, 2000, starts()[1]
    game = reference_games.VelocityGame(V0, DELTA)
    robot = reference_robots(numbers)

    def law(_time, x):
        return reference.full_information(game, 0.1, x[:, 1])

    expected, _ = reference.semi_implicit_euler_robot(robot, law, state[:, :3], h, steps)
    for engine in ("mujoco", "ode"):
        system = robot_system(state, numbers, engine=engine, integrator="euler")
        states, *_ = run_loop(system, h, steps)
        assert relative_error(states[:, :, :3], expected) < 1e-11


@pytest.mark.parametrize("engine", ["mujoco", "ode"])
@pytest.mark.parametrize("numbers", [EQUAL, UNEQUAL], ids=["equal", "unequal"])
def test_sampled_holds_the_input_over_the_control_period(numbers, engine):
    h, steps, per_period, state = 0.002, 5000, 5, starts()[0]
    robot, game = reference_robots(numbers), reference_games.VelocityGame(V0, DELTA)
    law = reference.full_information_of_state(robot, game, 0.1)
    expected, inputs = reference.rk4_sampled(
        reference.held_input_rate(robot, 5), law, state[:, :3].ravel(), h, steps, per_period
    )
    system = robot_system(state, numbers, engine=engine, mode="sampled")
    states, u, *_ = run_loop(system, h, steps, control=per_period * h)
    assert relative_error(states[:, :, :3].reshape(len(expected), -1), expected) < 1e-11
    assert np.all(u[:per_period] == u[0])
    held = np.repeat(np.asarray(inputs).reshape(-1, 5), per_period, axis=0)
    if len(held) > steps:  # one entry a step
        held = np.asarray(inputs).reshape(-1, 5)
    assert relative_error(u[:-1], held[: len(u) - 1]) < 1e-11


@pytest.mark.parametrize("count", [1, 2, pytest.param(500, marks=pytest.mark.slow)])
def test_any_number_of_robots(count):
    rng = np.random.default_rng(count)
    numbers = {name: rng.uniform(0.5, 2.0, count) for name in EQUAL}
    state = random_robot_state(rng, np.full(count, 2.0))
    h, steps = 0.002, 50
    ode, *_ = run_loop(robot_system(state, numbers, delta=2.0), h, steps)
    system = robot_system(state, numbers, delta=2.0, engine="mujoco")
    states, _, _, loop = run_loop(system, h, steps)
    assert loop.plant.model.nv == 2 * count
    assert relative_error(states, ode) < 1e-11


def test_open_loop_under_random_forces():
    rng = np.random.default_rng(2)
    state = random_robot_state(rng, DELTA)
    from gne_mj.plants.ode import OdePlant

    for integrator in ("rk4", "euler"):
        agents = robot_system(state, UNEQUAL).agents
        plants = [kind(agents, 0.002, integrator) for kind in (MujocoPlant, OdePlant)]
        for plant in plants:
            plant.reset(state)
        for _ in range(2000):
            force = rng.normal(0.0, 5.0, 5)
            for plant in plants:
                plant.step(force)
        assert np.allclose(plants[0].output, plants[1].output, rtol=0, atol=1e-8)
        assert relative_error(plants[0].state, plants[1].state) < 1e-8


@pytest.mark.parametrize("integrator", ["rk4", "euler"])
def test_what_no_step_needs_changes_no_bit(integrator):
    agents, state = robot_system(starts()[2], UNEQUAL).agents, starts()[2]
    plants = [MujocoPlant(agents, 0.004, integrator, decorated=kept) for kept in (True, False)]
    forces = np.random.default_rng(3).normal(0.0, 5.0, (100, 5))
    for plant in plants:
        plant.reset(state)
        for force in forces:
            plant.step(force)
    assert np.array_equal(plants[0].state, plants[1].state)
    assert plants[1].model.nbody < plants[0].model.nbody
    assert plants[1].model.nsensor == plants[1].model.ngeom == 0


def test_momentum_is_conserved_without_input():
    state = random_robot_state(np.random.default_rng(3), DELTA)
    agents = robot_system(state, UNEQUAL).agents
    plant = MujocoPlant(agents, 0.01)
    plant.reset(state)
    mass, appendage = agents.parameters[:, 0], agents.parameters[:, 1]

    def momentum():
        return mass * plant.state[:, 1] + appendage * plant.state[:, 2]

    before = momentum()
    plant.step(np.zeros(5), 1000)
    assert np.allclose(momentum(), before, rtol=1e-12, atol=1e-12)


def test_callbacks_are_restored_and_do_not_nest():
    calls = []

    def mine(model, data):
        calls.append(1)

    function = ctypes.CFUNCTYPE(None, ctypes.c_void_p, ctypes.c_void_p)(lambda m, d: None)
    loop = robot_system(robot_state(FIVE), engine="mujoco").closed_loop(clock(0.01))
    mujoco.set_mjcb_control(mine)
    mujoco.set_mjcb_passive(function)
    try:
        loop.advance(10, 1)
        assert mujoco.get_mjcb_control() is mine
        assert mujoco.get_mjcb_passive() is function
        assert not calls
        with pytest.raises(RuntimeError, match="inner"), callbacks():
            raise RuntimeError("inner")
        assert mujoco.get_mjcb_control() is mine
        with callbacks(), pytest.raises(EngineError, match="one at a time"), callbacks():
            pass
        assert mujoco.get_mjcb_control() is mine
    finally:
        mujoco.set_mjcb_control(None)
        mujoco.set_mjcb_passive(None)


def test_mujoco_times_its_stages_before_and_after_a_loop_advances_but_not_meanwhile():
    loop = robot_system(starts()[0], UNEQUAL, engine="mujoco").closed_loop(clock(0.005, 1.0, 0.05))
    model, data = loop.plant.model, loop.plant.data
    step = mujoco.mjtTimer.mjTIMER_STEP
    loop.advance(2, 10)
    assert data.timer[step].number >= 20
    assert data.timer[step].duration == 0.0
    other = mujoco.MjData(model)
    mujoco.mj_step(model, other, 20)
    assert other.timer[step].duration > 0.0


def test_other_simulations_are_left_alone_by_installed_callbacks():
    text = """<mujoco><worldbody><body><joint type="slide"/><geom size="1"/></body></worldbody>
    <size nuserdata="{}"/></mujoco>"""
    system = robot_system(robot_state(FIVE), engine="mujoco")
    loop = system.closed_loop(clock(0.01))
    for size, content in ((0, None), (1, 1.0), (4, 0.0), (4, 1.0), (4, np.nan)):
        model = mujoco.MjModel.from_xml_string(text.format(size))
        data = mujoco.MjData(model)
        data.userdata[:] = content
        with callbacks(control=loop._control, passive=loop.plant.passive):
            mujoco.mj_step(model, data, 10)
        assert data.time == pytest.approx(10 * model.opt.timestep)
        assert np.array_equal(data.userdata, np.full(size, content or 0.0), equal_nan=True)


def test_stepping_or_resetting_a_loops_own_plant():
    loop = robot_system(robot_state(FIVE), engine="mujoco").closed_loop(clock(0.01))
    loop.plant.step(np.ones(5), 3)  # before the start: the loop starts from there
    assert len(loop.advance(4, 1).input) == 4
    loop.plant.step(np.ones(5), 3)
    moved = loop.plant.state
    assert np.array_equal(loop.advance(1, 1).state[0], moved)
    loop.plant.reset(robot_state(FIVE))
    with pytest.raises(EngineError, match="was reset"):
        loop.advance(1, 1)
    with pytest.raises(EngineError, match="was reset"):
        loop.finish()


def test_a_reset_simulation_is_not_started():
    system = robot_system(robot_state(FIVE), engine="mujoco")
    loop = system.closed_loop(clock(0.01))
    loop.advance(5, 1)
    mujoco.mj_resetData(loop.plant.model, loop.plant.data)
    assert loop.monitor.started == 0.0
    with callbacks(control=loop._control, passive=loop.plant.passive):
        mujoco.mj_step(loop.plant.model, loop.plant.data)
    assert np.all(loop.plant.data.ctrl == 0.0)


def test_a_copy_of_the_data_goes_on_by_itself():
    system = robot_system(robot_state(FIVE), engine="mujoco")
    loop = system.closed_loop(clock(0.01))
    loop.advance(10, 1)
    model, copy = loop.plant.model, mujoco.MjData(loop.plant.model)
    mujoco.mj_copyData(copy, model, loop.plant.data)
    with callbacks(control=loop._control, passive=loop.plant.passive):
        for _ in range(20):
            mujoco.mj_step(model, copy)
    loop.advance(20, 1)
    assert np.array_equal(copy.qvel, loop.plant.data.qvel)


def test_leaving_the_set_is_seen_at_its_step_and_the_state_before_it_is_kept():
    state = robot_state(FIVE, appendage=FIVE - 9.0 * np.array([1, 0, 0, 0, 0]))
    for engine in ("mujoco", "ode"):
        system = robot_system(
            state, engine=engine, mode="sampled", integrator="euler", delta=2.2, rho=1e-3
        )
        loop = system.closed_loop(clock(0.05, control=0.5))
        recorded = loop.advance(400, 1)
        monitor = loop.monitor
        assert monitor.exit == watch.LEFT_SET
        at = len(recorded.input)
        assert monitor.exit_time == pytest.approx(0.05 * at)
        assert loop.time == pytest.approx(0.05 * at)
        last = loop.finish()
        y = last.state[0, :, 1]
        g = system.game.constraints(y)
        assert g[int(monitor.exit_constraint)] == monitor.exit_value >= 0
        assert np.all(np.isnan(last.input))
        assert np.all(system.game.constraints(recorded.state[:, :, 1]) < 0)
        again = loop.advance(5, 1)
        assert len(again.input) == 0


@pytest.mark.parametrize(("mass", "verb"), [(1e-16, "compile"), (5e-324, "read")])
def test_masses_that_mujoco_does_not_take_are_refused_in_one_sentence(mass, verb):
    agents = robot_system(robot_state(FIVE), {**EQUAL, "main_mass": [mass] * 5}).agents
    with pytest.raises(InvalidInput, match=f"MuJoCo must {verb} it: .*mass") as caught:
        MujocoPlant(agents, 0.01)
    assert "\n" not in str(caught.value)
