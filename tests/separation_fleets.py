"""Fleets that keep apart, for tests: robots in the plane that swap places, balloons in space."""

import numpy as np

from gne_mj.interface.agents import path_of
from gne_mj.scenario import load_scenario

R, REACH, TURN = 0.6, 1.5, 0.5


def swap(**changes):
    """The scenario with keys of its system changed."""
    keys = {key.replace("__", "."): value for key, value in changes.items()}
    keys = {"plant.engine": "ode", **keys}
    return load_scenario("swap", {"agents.contacts": keys["plant.engine"] == "mujoco", **keys})


def system_of(**changes):
    return swap(**changes).system_objects()[0]


BALLOON = """<mujoco><option gravity="0 0 0"/><worldbody><body name="balloon">
  <joint name="x" type="slide" axis="1 0 0"/><joint name="y" type="slide" axis="0 1 0"/>
  <joint name="z" type="slide"/><geom size="0.3" mass="2"/></body></worldbody>
  <actuator><motor name="east" joint="x"/><motor name="north" joint="y"/>
  <motor name="up" joint="z"/></actuator></mujoco>"""
CUBE = np.array([[i, j, k] for i in (-1.0, 1.0) for j in (-1.0, 1.0) for k in (-1.0, 1.0)])


def in_the_air(place=-CUBE, **changes):
    """Eight balloons at the corners of a cube, each of which wants its place, within a ball."""
    count = len(place)
    game = {
        "type": "expressions", "dimension": 3, "action_name": "position", "action_unit": "m",
        "cost": "((y[i] - place[i])**2).sum()", "constraints": {"ball": "(y[i]**2).sum() <= 16.0"},
        "parameters": {"place": place.tolist()},
    }  # fmt: skip
    agents = {
        "type": "mjcf-robot", "file": path_of(BALLOON), "count": count, "output": ["x", "y", "z"],
        "input": ["east", "north", "up"], "lookahead": 0.5, "local_damping": 6.0,
    }  # fmt: skip
    start = (-place).tolist()
    tables = {"game": game, "agents": agents, "initial": {"action": start}, **changes}
    return load_scenario("swap", tables)


def cloud(rng, agents, axes=2):
    """Points more than R apart, shape (agents, axes)."""
    points = []
    while len(points) < agents:
        point = rng.uniform(-2.5, 2.5, axes)
        if all(np.linalg.norm(point - other) > 1.02 * R for other in points):
            points.append(point)
    return np.array(points)


def least_distance(states):
    """Of all positions at all samples, in m."""
    points = states[:, :, 3].reshape(len(states), -1, 2)
    i, j = np.triu_indices(points.shape[1], 1)
    return np.min(np.linalg.norm(points[:, i] - points[:, j], axis=2))


MODES = {
    "implicit": {},
    "continuous": {"controller__mode": "continuous", "plant__integrator": "rk4"},
    "euler": {"controller__mode": "continuous"},
}
