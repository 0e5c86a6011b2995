"""What a step of robots in MuJoCo costs beside mj_step, part by part, each timed by itself.

Euler's method, full information, mode continuous: every part once a step. Each is called very often
in a native loop, on the numbers of a closed loop that runs. docs/internals.md has what this says.
"""

import argparse
import statistics
import time
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

from gne_mj.controllers import FullInformation
from gne_mj.games import velocity_game
from gne_mj.loops import division, feedback, functions
from gne_mj.loops import monitor as watch
from gne_mj.loops.layout import Parts, parts_in, steps_in
from gne_mj.loops.mujoco import Machine, save
from gne_mj.loops.mujoco_loop import MujocoLoop
from gne_mj.loops.mujoco_workspace import place_of, workspace_at
from gne_mj.native import compiled, kernel, source_key
from gne_mj.plants import flexible_robot
from gne_mj.plants import mujoco as fleet
from gne_mj.plants.agents import Agents
from gne_mj.plants.native_mujoco import field, offsets
from gne_mj.system import Clock, System

H = 1e-3


class Here(NamedTuple):
    """A running loop, as its callbacks see it."""

    at: Any
    block: int
    machine: Machine
    parts: Parts
    state: np.ndarray
    userdata: np.ndarray
    time: float


def views(here):
    """Addresses and views alone: all others have them too."""
    here.parts.work.held[0] = here.time


def gather(here):
    """The state from qpos and qvel."""
    fleet.gather(here.at, here.machine.data, here.block, here.state)


def springs(here):
    """The springs' forces, an arctangent each."""
    fleet.add_forces(here.at, here.machine.data, here.block)


def lyapunov(here):
    """The Lyapunov function, a logarithm each."""
    here.parts.work.held[0] = fleet.stored(here.parts.channels, here.state, here.userdata)


def inside(here):
    """Constraints, the barrier's weights, and whether a bound is left."""
    work, parts = here.parts.work, here.parts
    feedback.inside(parts.problem, here.time, 0, work.y, work, parts.monitor)


def law(here):
    """The law."""
    work = here.parts.work
    functions.action(here.parts.problem, work.y, work.weights, here.state[:0], work, work.commanded)


def monitor(here):
    """What is measured at every step."""
    parts, work = here.parts, here.parts.work
    watch.observe(parts.monitor, parts.figures, here.time, work, parts.u, work.u, 1.0)


def start(here):
    """A step's start, kept."""
    save(here.machine, here.machine.saved[0])


def judge(here):
    """Whether the step may stand."""
    work = here.parts.work
    work.held[0] = division.judge(1, H, here.parts.problem, work)


PARTS = (views, gather, springs, lyapunov, inside, law, monitor, start, judge)


def timed(part: Callable[[Here], None]) -> Any:
    """A native loop of so many turns of a part."""
    at, source, part = offsets(), source_key(), kernel(part)

    def run(machine, block, turns):
        _ = source
        for turn in range(turns):
            place = place_of(at, block, machine.model, machine.data)
            workspace = workspace_at(place, steps_in(block))
            userdata = field(machine.data, at.userdata, place.sizes.nuserdata)
            parts = parts_in(block, workspace.loop)
            part(Here(at, block, machine, parts, workspace.state, userdata, H * turn))

    return compiled(run)


def loop_of(count: int) -> MujocoLoop:
    """A loop that has run for a while."""
    table = np.ones((count, len(flexible_robot.PARAMETERS)))
    agents = Agents(flexible_robot, table, np.full(count, np.inf))
    state = agents.equilibrium(3.0 - np.linspace(0.0, 2.0, count))
    game, law = velocity_game(count, 3.0, 3.0), FullInformation()
    system = System("robots", game, agents, law, 0.1, state, engine="mujoco", integrator="euler")
    loop = system.closed_loop(Clock(1.0, H, H, 100 * H))
    loop.advance(1, 100)
    assert isinstance(loop, MujocoLoop)
    return loop


def main() -> None:
    """Parse the arguments, measure and print."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--robots", type=int, default=5, help="how many")
    parser.add_argument("--runs", type=int, default=9, help="turns of which the median counts")
    options = parser.parse_args()
    loop, turns = loop_of(options.robots), 3_000_000 // options.robots
    for part in PARTS:
        run, times = timed(part), []
        for _ in range(options.runs + 1):
            began = time.thread_time()
            run(loop._machine, loop._parameter_block.address, turns)
            times.append(1e9 * (time.thread_time() - began) / turns)
        print(f"{statistics.median(times[1:]):8.1f} ns  {part.__doc__}", flush=True)


if __name__ == "__main__":
    main()
