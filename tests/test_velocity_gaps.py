"""Regression on the gaps' bounds: shipped starts, random ones, and laws that are wrong."""

import json
from dataclasses import dataclass
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest
import wrong_law
from builders import EQUAL, V0, clock, random_robot_state, robot_system

from gne_mj.controllers import FullInformation
from gne_mj.controllers.settings import RHO
from gne_mj.loops import monitor as watch
from gne_mj.scenario import load_scenario, shipped

GOLDEN = Path(__file__).parent / "golden" / "worst_gaps.json"
RUNS = 200
DURATION = 5.0
H = 0.002


@dataclass(frozen=True, eq=False)
class Scaled(FullInformation):
    """The law with its barrier scaled: 0 leaves it out, -1 turns its sign."""

    factor: float = 0.0

    def settings(self, rho):
        numbers = super().settings(rho)
        numbers[RHO] *= self.factor
        return numbers


@dataclass(frozen=True, eq=False)
class WithoutFollower(FullInformation):
    """The law of an agent that ignores the constraint it shares with its follower."""

    @property
    def kernels(self) -> ModuleType:
        return wrong_law


def random_start(index):
    rng = np.random.default_rng([7, index])
    delta = rng.uniform(1.0, 4.0, 5)
    numbers = {name: rng.uniform(0.5, 2.0, 5) for name in EQUAL}
    return random_robot_state(rng, delta), numbers, delta


def outcome(law, index, engine="mujoco"):
    """Exit code and the worst gap relative to its bound at any step."""
    state, numbers, delta = random_start(index)
    system = robot_system(state, numbers, delta=delta, law=law, engine=engine)
    loop = system.closed_loop(clock(H, DURATION))
    loop.advance(1, round(DURATION / H))
    loop.finish()
    gaps = np.sqrt(loop.monitor.worst + delta**2)
    return int(loop.monitor.exit), float(np.max(gaps / delta))


@pytest.mark.parametrize(
    "runs", [range(40), pytest.param(range(40, RUNS), marks=pytest.mark.slow)], ids=["few", "more"]
)
def test_every_gap_stays_inside_its_bound_at_every_step(runs):
    for index in runs:
        code, worst = outcome(FullInformation(), index, "mujoco")
        assert code == watch.INSIDE, index
        assert worst < 1.0, index


def test_without_the_barrier_many_starts_leave():
    left = sum(outcome(Scaled(factor=0.0), index, "ode")[0] != 0 for index in range(RUNS))
    assert left >= 0.1 * RUNS


def test_a_barrier_of_the_wrong_sign_is_caught():
    left = sum(outcome(Scaled(factor=-1.0), index, "ode")[0] != 0 for index in range(40))
    assert left >= 20


@pytest.mark.slow  # compiles that wrong law
def test_a_missing_follower_term_is_caught():
    """It seldom leaves the set, but its gaps differ from the right law's by far more than 1e-9."""
    differences = [
        abs(outcome(WithoutFollower(), i, "ode")[1] - outcome(FullInformation(), i, "ode")[1])
        for i in range(40)
    ]
    assert np.sum(np.array(differences) > 1e-6) >= 10


def velocity_scenarios():
    for name in shipped():
        scenario = load_scenario(name)
        for key, system in scenario.systems.items():
            if system.game.type in ("velocity-synchronization", "velocity-consensus"):
                if system.agents.type == "mjcf-robot":  # scripts/check-robots looks at these
                    continue
                # of the disturbed one a loop of its own is compiled
                marks = [pytest.mark.slow] if name == "disturbed" else []
                yield pytest.param(name, key, marks=marks)


@pytest.mark.parametrize(("name", "key"), list(velocity_scenarios()))
def test_worst_gaps_of_shipped_starts(name, key):
    report = load_scenario(name).simulation_object().run().reports[key]
    golden = json.loads(GOLDEN.read_text())[f"{name}/{key}"]
    assert report["worst_gap"]["index"] == golden["index"]
    assert report["worst_gap"]["gap"] == pytest.approx(golden["gap"], abs=1e-9)
    assert report["worst_gap"]["each"] == pytest.approx(golden["each"], abs=1e-9)
    assert report["worst_constraint"]["margin"] == pytest.approx(golden["margin"], abs=1e-9)
    assert report["worst_gap"]["gap"] < report["worst_gap"]["bound"]


@pytest.mark.parametrize("engine", ["mujoco", "ode"])
def test_a_start_beside_the_bound_stays_inside(engine):
    gaps = np.array([-2.999, 2.999, -2.999, 2.999, 2.999])
    state = np.zeros((5, 4))
    state[:, 1] = state[:, 2] = V0 + np.cumsum(gaps)
    loop = robot_system(state, engine=engine).closed_loop(clock(1e-4, 1.0))
    loop.advance(1, 10_000)
    assert loop.monitor.exit == watch.INSIDE
    assert np.max(loop.monitor.worst) < 0
