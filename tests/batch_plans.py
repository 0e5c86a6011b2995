"""Plans of batches that several tests run, and how their results are compared."""

from pathlib import Path

import numpy as np
from builders import UNEQUAL

from gne_mj.batches import Store, Sweep, make_plan
from gne_mj.batches.chunk import Runner
from gne_mj.batches.summary import join

SHORT = {"simulation.duration": 1.0, "simulation.timestep": 0.01, "recording.period": 0.1}
ODE = {**SHORT, "plant.engine": "ode"}
ROOT = Path(__file__).parent.parent

UNEQUAL_ROBOTS = {"type": "flexible-robot", "count": 5, "input_limit": 40.0, **UNEQUAL}

# name: scenario, changes, sweeps. Between them all engines, laws, modes, faults and dimensions.
CASES = {
    "robots": (
        "velocity-sync",
        SHORT,
        [
            Sweep("barrier.rho", (0.1, 1.0)),
            Sweep("agents", ({"type": "flexible-robot", "count": 5}, UNEQUAL_ROBOTS)),
            Sweep("game.gap_bound", (3.0, [3.0, 2.5, 2.0, 3.5, 4.0])),
            Sweep("game.reference_velocity", (3.0, 2.0)),
        ],
    ),
    "periods that leave": (
        "velocity-sync",
        {**SHORT, "controller.mode": "sampled", "simulation.duration": 2.0},
        [Sweep("simulation.control_period", (0.01, 0.5, 1.0))],
    ),
    "steps": (
        "velocity-sync",
        {**SHORT, "controller.mode": "sampled", "simulation.control_period": 0.1},
        [Sweep("simulation.timestep", (0.01, 0.005))],
    ),
    "divided steps": (
        "desired-velocity",
        {"simulation.duration": 0.1, "plant.engine": "ode"},
        [Sweep("barrier.rho", (0.1, 0.2))],
    ),
    "twin": ("velocity-sync", ODE, [Sweep("controller.mode", ("continuous", "sampled"))]),
}
SLOW = {
    "a start's seed is the scenario's": (
        "disturbed",
        {"simulation.duration": 0.5, "simulation.seed": 1153240287915889},
        [Sweep("barrier.rho", (0.1,))],
    ),
    "partial information": (
        "velocity-sync",
        {**SHORT, "controller": {"information": "partial", "graph": "ring"}},
        [Sweep("controller.coupling", (1.0, 2.0)), Sweep("controller.graph", ("ring", "line"))],
    ),
    "implicit": (
        "velocity-sync",
        {**SHORT, "controller.mode": "implicit", "simulation.control_period": 0.05},
        [Sweep("barrier.rho", (0.1, 1.0)), Sweep("controller.mode", ("implicit", "sampled"))],
    ),
    "faults": ("disturbed", {"simulation.duration": 1.0}, [Sweep("barrier.rho", (0.1, 1.0))]),
    "plane": ("planar-sync", {"simulation.duration": 1.0}, [Sweep("agents.main_mass", (1.0, 2.0))]),
    "adaptive steps": ("osnr", {"simulation.duration": 1.0}, [Sweep("barrier.rho", (0.1, 0.2))]),
    "firms": ("cournot", {"simulation.duration": 1.0}, [Sweep("barrier.rho", (1.0, 2.0))]),
    "own robots": (
        str(ROOT / "examples" / "robot" / "scenario.toml"),
        {"simulation.duration": 0.5},
        [Sweep("barrier.rho", (0.1, 0.2))],
    ),
    "own robots, implicit": (
        str(ROOT / "examples" / "robot" / "scenario.toml"),
        {"simulation.duration": 0.5, "controller.mode": "implicit"},
        [Sweep("barrier.rho", (0.1, 0.2))],
    ),
}


def plan_of(name, **options):
    source, changes, sweeps = {**CASES, **SLOW}[name]
    return make_plan(source, changes, sweeps=sweeps, **{"starts": 3, "record": 1, **options})


def all_chunks(plan, threads):
    runner = Runner(plan, threads)
    return join([runner.run(chunk) for chunk in range(plan.chunks)])


def assert_same(one, two):
    assert one.keys() == two.keys()
    for name in one:
        assert one[name][0] == two[name][0]
        np.testing.assert_array_equal(one[name][1], two[name][1], err_msg=name)


def small(tmp_path, name="a", **options):
    plan = make_plan(
        "velocity-sync", ODE, sweeps=[Sweep("barrier.rho", (0.1, 0.3, 1.0))],
        **{"starts": 4, "chunk": 5, **options},
    )  # fmt: skip
    return Store.create(tmp_path / name, plan)


def contents(folder):
    """Every file of a store, with its bytes."""
    return {
        str(path.relative_to(folder)): path.read_bytes()
        for path in sorted(folder.rglob("*"))
        if path.is_file()
    }
