"""What a step of MuJoCo starts from, late controls above all: looked ahead, kept and put back."""

import ctypes

import mujoco
import numpy as np
import pytest
from builders import V0, clock

from gne_mj.controllers import FullInformation
from gne_mj.environment.physics import FleetPhysics
from gne_mj.games import velocity_game
from gne_mj.loops import monitor as watch
from gne_mj.plants.mjcf_fleet import MjcfPlant
from gne_mj.plants.mjcf_robot import RobotFile, mjcf_robots
from gne_mj.plants.native_mujoco import STATE, state_parts
from gne_mj.system import System

H = 0.005
START = np.array([2.5, 1.5, 2.7])
# A cart with a mast on a spring, whose motor acts 20 ms late
CART = """
<mujoco>
  <option gravity="0 0 0"/>
  <worldbody>
    <body name="cart">
      <joint name="roll" type="slide" axis="1 0 0"/>
      <geom type="box" size="0.3 0.15 0.1" mass="3" contype="0" conaffinity="0"/>
      {mast}
    </body>
  </worldbody>
  <actuator><general name="wheels" joint="roll" delay="0.02" nsample="8" {filter}/></actuator>
</mujoco>
"""
MAST = """
<body name="mast" pos="0 0 0.1">
  <joint name="lean" type="hinge" axis="0 1 0" stiffness="25" damping="2" range="-5 5"/>
  <geom type="sphere" pos="0 0 0.8" size="0.1" mass="1" contype="0" conaffinity="0"/>
</body>"""
FILTER = 'dyntype="filter" dynprm="0.03"'


def carts(folder, count=3, mast=MAST, lag=""):
    path = folder / "cart.xml"
    path.write_text(CART.format(mast=mast, filter=lag))
    return mjcf_robots((RobotFile(path, "roll", "wheels"),) * count, np.full(count, np.inf))


def loop_of(agents, mode, integrator="rk4", control=4 * H, start=START):
    game = velocity_game(len(start), V0, 3.0)
    system = System(
        "carts", game, agents, FullInformation(), 0.1, agents.equilibrium(start),
        engine="mujoco", mode=mode, integrator=integrator,
    )  # fmt: skip
    return system.closed_loop(clock(H, 1.0, control))


def test_what_loops_keep_of_a_step_is_mujocos_own_state(tmp_path):
    """All that mj_getState copies, in its order, where there are late controls and activations."""
    plant = MjcfPlant(carts(tmp_path, lag=FILTER), H, "rk4")
    row = np.random.default_rng(5).normal(size=mujoco.mj_stateSize(plant.model, STATE))
    mujoco.mj_setState(plant.model, plant.data, row, STATE)
    arrays = [
        np.ctypeslib.as_array((ctypes.c_double * length).from_address(address))
        for address, length in state_parts(plant.data).tolist()
    ]
    assert np.array_equal(np.concatenate(arrays), row)


def test_looking_ahead_knows_what_is_still_to_act(tmp_path):
    """The outputs at the end of each period are those predicted, to the last bit."""
    loop = loop_of(carts(tmp_path), "implicit")
    loop.advance(40, 4)
    assert loop.monitor.exit == watch.INSIDE
    assert loop.monitor.solutions == 40
    assert loop.monitor.unsolved == 0
    assert loop.monitor.not_monotone == 0
    assert loop.monitor.prediction == 0.0


def test_a_push_from_outside_is_not_known_ahead(tmp_path):
    agents = carts(tmp_path)
    inputs = []
    for force in (0.0, 5.0):
        loop = loop_of(agents, "implicit")
        loop.push(np.full(3, force))
        inputs.append(loop.advance(2, 4).input)
    assert np.array_equal(inputs[0][0], inputs[1][0])
    assert not np.array_equal(inputs[0][1], inputs[1][1])


@pytest.mark.parametrize("pieces", [1, 40])
def test_a_late_control_acts_after_exactly_its_delay(tmp_path, pieces):
    """v+ = v + h u(t - 4 h) / m by Euler, however the run is cut."""
    loop = loop_of(carts(tmp_path, mast=""), "sampled", "euler")
    rows = [loop.advance(400 // pieces, 1) for _ in range(pieces)]
    inputs = np.concatenate([row.input for row in rows])
    states = np.concatenate([row.state for row in rows])
    late = np.concatenate([np.zeros((4, 3)), inputs[:-4]])
    expected = START + np.cumsum(H / 3.0 * late, axis=0)
    assert np.allclose(states[1:, :, 0], expected[:-1], rtol=0, atol=1e-12)
    assert np.ptp(inputs) > 0.1


def test_plants_and_environments_find_late_controls_as_loops_do(tmp_path):
    """v+ = v + h u(t - 4 h) / m by Euler."""
    agents = carts(tmp_path, mast="")
    plant, other = (MjcfPlant(agents, H, "euler") for _ in range(2))
    plant.reset(agents.equilibrium(START))
    physics = FleetPhysics(other, velocity_game(3, V0, 3.0), agents.equilibrium(START))
    inputs = np.random.default_rng(0).uniform(-1.0, 1.0, (300, 3))
    expected = START + np.cumsum(H / 3.0 * np.concatenate([np.zeros((4, 3)), inputs[:-4]]), axis=0)
    for u, y in zip(inputs, expected, strict=True):
        plant.step(u)
        physics.set_control(u)
        physics.step()
        assert np.allclose(plant.output, y, rtol=0, atol=1e-12)
        assert np.array_equal(physics.output, plant.output)


@pytest.mark.parametrize("lag", ["", FILTER])
def test_an_environment_goes_back_to_the_whole_state(tmp_path, lag):
    agents = carts(tmp_path, lag=lag)
    plant = MjcfPlant(agents, H, "rk4")
    physics = FleetPhysics(plant, velocity_game(3, V0, 3.0), agents.equilibrium(START))

    def state():
        row = np.empty(mujoco.mj_stateSize(physics.model, STATE))
        mujoco.mj_getState(physics.model, physics.data, row, STATE)
        return row

    physics.set_control([1.0, -2.0, 3.0])
    physics.step(7)
    before = state()
    physics.step()
    after = state()
    physics.restore()
    assert np.array_equal(state(), before)
    physics.step()
    assert np.array_equal(state(), after)
