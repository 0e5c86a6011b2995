"""The law's memory as part of MuJoCo's state: saved, set again, reset, copied and batched."""

import mujoco
import numpy as np
import pytest
from builders import FIVE, UNEQUAL, clock, robot_state, robot_system
from mujoco.batch import Batch

from gne_mj import graph as graphs
from gne_mj.controllers import FullyDistributed, PartialInformation, PlainLaw
from gne_mj.errors import EngineError
from gne_mj.games import velocity_game
from gne_mj.loops import monitor as watch
from gne_mj.loops.layout import steps_of
from gne_mj.loops.mujoco_workspace import workspace_of
from gne_mj.plants.callbacks import callbacks

WHOLE = mujoco.mjtState.mjSTATE_INTEGRATION
H = 0.005
START = 3.0 + 0.3 * (FIVE - 1.0)


def law_of(information):
    if information == "partial":
        return PartialInformation(graphs.ring(5), 2.0, 0.5)
    return FullyDistributed(graphs.ring(5), 0.1, 0.2)


def loop_of(information, mode="continuous", integrator="rk4", memory=None, start=START):
    law, state = law_of(information), robot_state(start)
    if memory is None:
        memory = law.initial_memory(state[:, 1], state[:, 1] + np.linspace(-0.1, 0.1, 5))
    system = robot_system(
        state, UNEQUAL, law=law, engine="mujoco", mode=mode, integrator=integrator, memory=memory
    )
    return system.closed_loop(clock(H, 1.0, 4 * H))


def saved(loop):
    model = loop.plant.model
    row = np.empty(mujoco.mj_stateSize(model, WHOLE))
    mujoco.mj_getState(model, loop.plant.data, row, WHOLE)
    return row


def installed(loop):
    return callbacks(control=loop._control, passive=loop.plant.passive, activation=loop._remember)


def assert_same(first, second):
    for name in ("state", "input", "memory"):
        assert np.array_equal(getattr(first, name), getattr(second, name))


LAWS = pytest.mark.parametrize("information", ["partial", "distributed"])
MODES = pytest.mark.parametrize(
    ("mode", "integrator"),
    [("continuous", "rk4"), ("continuous", "euler"), ("sampled", "rk4"), ("sampled", "euler")],
)


@LAWS
@MODES
def test_a_state_that_is_set_again_goes_on_bitwise(information, mode, integrator):
    loop = loop_of(information, mode, integrator)
    model = loop.plant.model
    start = saved(loop)
    first = loop.advance(30, 1)
    middle = saved(loop)  # within a control period
    second = loop.advance(41, 1)
    monitor, time = loop.monitor.copy(), loop.time
    assert time == pytest.approx(71 * H)
    assert np.ptp(first.memory, axis=0).max() > 1e-3

    mujoco.mj_setState(model, loop.plant.data, middle, WHOLE)
    assert loop.time == pytest.approx(30 * H)
    assert_same(loop.advance(41, 1), second)
    assert np.array_equal(loop.monitor, monitor)
    assert loop.time == time

    mujoco.mj_setState(model, loop.plant.data, start, WHOLE)
    assert loop.time == 0.0
    assert_same(loop.advance(30, 1), first)

    # into other data, stepped by MuJoCo alone
    data = mujoco.MjData(model)
    mujoco.mj_setState(model, data, middle, WHOLE)
    copy = mujoco.MjData(model)
    mujoco.mj_copyData(copy, model, loop.plant.data)
    with installed(loop):
        mujoco.mj_step(model, data, 41)
        mujoco.mj_step(model, copy, 41)
    loop.advance(41, 1)
    mujoco.mj_setState(model, loop.plant.data, middle, WHOLE)
    loop.advance(41, 1)
    for other in (data, copy):
        assert np.array_equal(other.qvel, loop.plant.data.qvel)
        assert np.array_equal(others_of(other.act), others_of(loop.plant.data.act))
        if mode == "sampled":
            assert np.array_equal(other.userdata, loop.plant.data.userdata)
        else:  # but what the loop keeps to divide steps, which MuJoCo alone does not
            sizes = steps_of(loop._parameter_block)
            workspace = workspace_of(other.userdata, loop.plant.sizes.workspace, sizes).loop
            assert workspace.monitor == loop.monitor


@LAWS
def test_a_reset_simulation_is_not_started(information):
    loop = loop_of(information)
    loop.advance(5, 1)
    model, data = loop.plant.model, loop.plant.data
    mujoco.mj_resetData(model, data)
    with installed(loop):
        mujoco.mj_step(model, data)
    assert np.all(data.act == 0.0)
    assert np.all(data.ctrl == 0.0)
    assert np.all(data.userdata == 0.0)
    for use in (lambda: loop.advance(1, 1), loop.finish):
        with pytest.raises(EngineError, match="was reset"):
            use()


def others_of(memory):
    """A memory without the agents' own actions, which are written whenever the law acts."""
    own = 6 * np.arange(5)
    return np.delete(memory, own) if len(memory) else memory


def memory_in(data, loop, mode):
    """Where a simulation keeps the law's memory: in act, or, mode sampled, last in userdata."""
    place = data.act if mode == "continuous" else data.userdata
    return place[len(place) - loop._memory.size :]


@pytest.mark.parametrize("mode", ["continuous", "sampled"])
@LAWS
def test_a_batch_of_rows_equals_single_runs(information, mode):
    """One model and one law, rows with starts and estimates of their own."""
    loops = [loop_of(information, mode, start=START + 0.1 * row, memory=None) for row in range(3)]
    first = loops[0]
    batch = Batch(first.plant.model, nsim=3, nthread=2)
    for row, loop in enumerate(loops):
        other = saved(first)
        data = mujoco.MjData(first.plant.model)
        mujoco.mj_setState(first.plant.model, data, other, WHOLE)
        data.qpos[:], data.qvel[:] = loop.plant.data.qpos, loop.plant.data.qvel
        memory_in(data, first, mode)[:] = memory_in(loop.plant.data, first, mode)
        mujoco.mj_getState(first.plant.model, data, batch.state[row], WHOLE)
    with installed(first):
        batch.step(nstep=50)
    for row, loop in enumerate(loops):
        loop.advance(50, 1)
        assert np.array_equal(batch.bind("qvel")[row], loop.plant.data.qvel)
        whole = mujoco.MjData(first.plant.model)
        mujoco.mj_setState(first.plant.model, whole, batch.state[row], WHOLE)
        got = memory_in(whole, loop, mode)
        assert np.array_equal(others_of(got), others_of(memory_in(loop.plant.data, loop, mode)))
        assert np.ptp(got) > 0.1


@pytest.mark.slow
@pytest.mark.parametrize("integrator", ["rk4", "euler"])
def test_a_memory_of_a_single_entry_moves(integrator):
    """MuJoCo takes the rate of a single activation from the callback's result, not from act_dot."""
    game = velocity_game(5, 3.0, 3.0)

    def action(game, rho, y, memory):
        return 0.1 * memory[0] - y + 3.0

    law = PlainLaw(game, action, lambda game, rho, y, memory: y[0] - memory, lambda y: [1.0])
    state = robot_state(START)
    systems = [
        robot_system(state, law=law, engine=engine, integrator=integrator)
        for engine in ("ode", "mujoco")
    ]
    runs = []
    for system in systems:
        loop = system.closed_loop(clock(H))
        loop.advance(100, 1)
        assert loop.monitor.exit == watch.INSIDE
        runs.append(loop.finish())
    assert abs(runs[0].memory[0, 0] - 1.0) > 0.1
    if integrator == "rk4":
        assert np.allclose(runs[0].memory, runs[1].memory, rtol=1e-11)
        assert np.allclose(runs[0].state, runs[1].state, rtol=0, atol=1e-11)
    else:
        assert np.allclose(runs[0].memory, runs[1].memory, rtol=1e-2)
