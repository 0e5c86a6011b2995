"""MJCF robots of one's own whose outputs are positions with a look-ahead."""

import numpy as np
import pytest
from builders import UNEQUAL, position_robots, relative_error, run_loop, with_damping
from mjcf_files import MOTOR, flexible

from gne_mj.controllers import FullInformation, PartialInformation
from gne_mj.errors import InvalidInput
from gne_mj.games import velocity_game
from gne_mj.graph import ring
from gne_mj.loops import monitor as watch
from gne_mj.plants import mjcf_position
from gne_mj.plants.mjcf_fleet import MjcfPlant
from gne_mj.plants.mjcf_robot import MjcfRobots, RobotFile
from gne_mj.system import System

TAU, V_0, COUNT = 0.7, 3.0, 5
LINEAR = {**UNEQUAL, "atan_coefficient": [0.0] * COUNT}
Y, Q = np.array([1.0, 0.2, -0.6, 0.4, 1.1]), np.array([0.4, 0.5, -0.9, 0.1, 1.4])
V = (Y - Q) / TAU


def fleet(folder, output="front", actuator=MOTOR):
    robots = []
    for i in range(COUNT):
        numbers = {name: values[i] for name, values in LINEAR.items()}
        path = folder / f"robot{i}.xml"
        path.write_text(flexible(numbers, actuator=actuator))
        robots.append(RobotFile(path, output, "push"))
    table = np.column_stack([*with_damping(LINEAR, TAU), np.full(COUNT, V_0)])
    return MjcfRobots(mjcf_position, table, np.full(COUNT, np.inf), robots=tuple(robots))


def system_of(agents, state, **options):
    game = velocity_game(COUNT, 0.0, 3.0)
    law = options.pop("law", None) or FullInformation()
    return System("robots", game, agents, law, 0.1, state, engine="mujoco", **options)


def builtin_state():
    """What a user's robot starts from: its rear rests, in the world, where the front begins."""
    return np.column_stack([Q, Y, np.full(COUNT, -V_0), Q])


MODES = [("rk4", "continuous"), ("euler", "sampled"), ("euler", "implicit"), ("rk4", "implicit")]


@pytest.mark.parametrize(("integrator", "mode"), MODES)
def test_a_copy_of_the_builtin_robot_moves_as_it_does(tmp_path, integrator, mode):
    """In mode implicit the prediction has the robots' own damping too, or outputs would differ."""
    h, steps, options = 0.005, 400, {"integrator": integrator, "mode": mode}
    own = system_of(fleet(tmp_path), np.column_stack([Y, Q]), **options)
    got, inputs, _, loop = run_loop(own, h, steps, 2 * h)
    assert loop.monitor.exit == watch.INSIDE
    assert loop.monitor.positions == steps + 1
    assert loop.monitor.positions_outside == 0
    if mode == "implicit":
        assert loop.monitor.prediction < 1e-9
    expected, forces, *_ = run_loop(
        system_of(position_robots(LINEAR, TAU), builtin_state(), **options), h, steps, 2 * h
    )
    tolerance = 1e-11 if mode != "implicit" else 1e-8  # where inputs are solved for
    assert relative_error(got[:, :, 0], expected[:, :, 1]) < tolerance
    assert relative_error(got[:, :, 1], expected[:, :, 3]) < tolerance
    assert relative_error(inputs, forces) < 100 * tolerance


def test_estimates_ride_along(tmp_path):
    options = {"law": PartialInformation(ring(COUNT), 2.0, 0.05), "mode": "sampled"}
    own = system_of(fleet(tmp_path), np.column_stack([Y, Q]), **options)
    got, _, memory, _ = run_loop(own, 0.005, 200)
    builtin = system_of(position_robots(LINEAR, TAU), builtin_state(), **options)
    expected, _, others, _ = run_loop(builtin, 0.005, 200)
    assert relative_error(got[:, :, 0], expected[:, :, 1]) < 1e-11
    assert relative_error(memory, others) < 1e-11


def test_a_plant_alone_is_damped_too(tmp_path):
    agents = fleet(tmp_path)
    plant, u = MjcfPlant(agents, 0.002, "euler"), np.linspace(-1, 1, COUNT)
    plant.reset(np.column_stack([Y, Q]))
    assert np.allclose(plant.state, np.column_stack([Y, Q]), atol=1e-14)
    plant.step(u)
    M, d = np.array(LINEAR["main_mass"]), agents.parameters[:, 1]
    link = np.array(LINEAR["stiffness"]) * Q + np.array(LINEAR["damping"]) * (V + V_0)
    v = V + 0.002 * (u - d * V - link) / M
    q = Q + 0.002 * v
    assert np.allclose(plant.state, np.column_stack([q + TAU * v, q]), atol=1e-13)


@pytest.mark.parametrize("sensor", ["tendon_speed", "actuator_speed"])
def test_outputs_must_be_joints(tmp_path, sensor):
    with pytest.raises(InvalidInput, match=r"^agents.output: got '.*'.*lookahead.*joint"):
        MjcfPlant(fleet(tmp_path, sensor), 0.01)
    assert MjcfPlant(fleet(tmp_path, "joint_speed"), 0.01).outputs == ["joint_speed"] * COUNT
