"""What the arena consists of: problems, conditions, seeds. Which law is for which, laws say."""

from typing import Any, NamedTuple

VERSION = "1.0"  # of problems, conditions, seeds and figures; results of one version are comparable
SEED = 20261128  # of random starts; those for tuning follow from it
RUNS, BUDGET = 10, 6  # random starts of each law; combinations of gains that are tried for each

PERIOD = 0.02  # s, of held inputs
LOSS = 0.3  # of messages


class Problem(NamedTuple):
    """A shipped scenario, as the arena has it.

    Attributes:
        title: in tables.
        scenario: its name.
        changes: of its keys, for all conditions.
        push, noise: in the third condition, of every input and of every output, in their units.
    """

    title: str
    scenario: str
    changes: dict[str, Any]
    push: float
    noise: float


_ODE = {"plant.engine": "ode", "plant.integrator": "rk4", "barrier.rho": 0.01}
_POSITIONS = {**_ODE, "agents.contacts": False}  # which MuJoCo alone has

PROBLEMS = {
    "velocity": Problem(
        "Velocities", "velocity-sync", {**_ODE, "simulation.duration": 15.0}, 0.5, 0.005
    ),
    "osnr": Problem("OSNR", "osnr", {**_ODE, "simulation.duration": 15.0}, 0.005, 0.0005),
    "cournot": Problem(
        "Cournot", "cournot", {**_ODE, "simulation.duration": 8.0, "simulation.timestep": 0.002},
        0.5, 0.005,
    ),
    "platoon": Problem(
        "Platoon", "platoon", {**_POSITIONS, "simulation.duration": 12.0}, 0.1, 0.002
    ),
    "formation": Problem(
        "Formation", "formation", {**_POSITIONS, "simulation.duration": 12.0}, 0.1, 0.002
    ),
    "desired": Problem(
        "Desired velocities", "desired-velocity", {**_ODE, "simulation.duration": 10.0}, 0.2, 0.002
    ),
}  # fmt: skip


def ideal(problem: Problem) -> dict[str, Any]:
    """In continuous time, as the theorems have it."""
    return {"controller.mode": "continuous"}


def sampled(problem: Problem) -> dict[str, Any]:
    """Inputs are found once a period and held; laws that can solve for inputs do (`implicit`)."""
    return {"controller.mode": "implicit", "simulation.control_period": PERIOD}


def rough(problem: Problem) -> dict[str, Any]:
    """The same with random pushes and noise, for which a margin is declared, and lost messages."""
    faults = [
        {"type": "push", "force": problem.push, "profile": "random"},
        {"type": "noise", "amplitude": problem.noise},
        {"type": "message-loss", "probability": LOSS},
    ]
    margin = {"push": problem.push, "noise": problem.noise}
    return {**sampled(problem), "faults": faults, "margin": margin}


CONDITIONS = {"ideal": ideal, "sampled": sampled, "rough": rough}
