"""Every law on every plant and graph against plain integrations of the same closed loop.

The whole matrix is marked slow: compiling its loops takes minutes.
"""

from dataclasses import dataclass

import numpy as np
import pytest
from builders import (
    UNEQUAL,
    V0,
    integrators,
    pi_cascades,
    random_robot_state,
    reference_osnr,
    reference_pi,
    reference_robots,
    relative_error,
    robots,
    run_loop,
)
from reference_agents import Integrator
from scipy.linalg import expm

import reference
import reference_games
from gne_mj import graph as graphs
from gne_mj.controllers import FullInformation, FullyDistributed, PartialInformation
from gne_mj.games import osnr_game, ten_channels, velocity_game
from gne_mj.loops import monitor as watch
from gne_mj.system import System

COUPLING, TAU, EPSILON, GAIN = 2.0, 0.5, 0.1, 0.1
LAWS = ("full", "partial", "distributed")
PLANTS = (
    "robots in MuJoCo", "robots", "integrators in a line", "integrators as channels",
    "PI cascades",
)  # fmt: skip


@dataclass
class Case:
    """A system of the product, and the same for the reference."""

    plant: str
    law: str
    graph: str

    def __post_init__(self):
        channels = self.plant in PLANTS[3:]
        self.count = 10 if channels or self.graph == "printed" else 5
        self.network = graphs.NAMED[self.graph](self.count)
        self.laplacian = reference.laplacian(self.count, self.network.edges)
        rng = np.random.default_rng(len(self.plant + self.law + self.graph))
        self.rho = 0.1
        if channels:
            # more room for power, since the ten channels' own wants steps too short for Python
            numbers = {**ten_channels(), "total_power_limit": 10.0}
            self.game, self.oracle = osnr_game(**numbers), reference_osnr(numbers)
            y = 0.7 * self.oracle.power_limit * rng.dirichlet(np.full(10, 20.0))
            spread = 0.01
        else:
            delta = np.full(self.count, 3.0)
            self.game = velocity_game(self.count, V0, delta)
            self.oracle = reference_games.VelocityGame(V0, delta)
            y = V0 + np.cumsum(rng.uniform(-0.7, 0.7, self.count) * delta)
            spread = 0.1
        if self.plant.startswith("robots"):
            numbers = {name: values * (self.count // 5) for name, values in UNEQUAL.items()}
            self.agents, self.agent = robots(numbers), reference_robots(numbers)
            self.state = random_robot_state(rng, 0.4 * delta, spread=0.5)
            y = self.state[:, 1]
        elif self.plant.startswith("integrators"):
            self.agents, self.agent = integrators(self.count), Integrator()
            self.state = y[:, None].copy()
        else:
            self.agents, self.agent = pi_cascades(self.count), reference_pi(self.count)
            self.state = self.agents.equilibrium(y)
        self.z = y + spread * rng.uniform(-1, 1, self.count)
        self.estimates = y + spread * rng.uniform(-1, 1, (self.count, self.count))
        self.numbers = {
            "full": {},
            "partial": {"laplacian": self.laplacian, "c": COUPLING, "tau": TAU},
            "distributed": {"laplacian": self.laplacian, "k": GAIN, "epsilon": EPSILON},
        }[self.law]

    def system(self, **options):
        law, memory = {
            "full": (FullInformation(), np.zeros(0)),
            "partial": (PartialInformation(self.network, COUPLING, TAU), self.estimates.ravel()),
            "distributed": (
                FullyDistributed(self.network, EPSILON, GAIN),
                np.concatenate([self.estimates.ravel(), self.z]),
            ),
        }[self.law]
        engine = "mujoco" if self.plant == "robots in MuJoCo" else "ode"
        return System(
            "case", self.game, self.agents, law, self.rho, self.state, memory=memory, engine=engine,
            **options,
        )  # fmt: skip

    def law_at(self, y, z, estimates):
        """u, the rates of z and of the estimates, by the reference (None where there is none)."""
        if self.law == "full":
            return reference.full_information(self.oracle, self.rho, y), None, None
        if self.law == "partial":
            u, rates = reference.partial_information(
                self.oracle, self.rho, y=y, estimates=estimates, **self.numbers
            )
            return u, None, rates
        return reference.fully_distributed(
            self.oracle, self.rho, y=y, z=z, estimates=estimates, **self.numbers
        )

    @property
    def rate(self):
        name = {
            "full": "full_information",
            "partial": "partial_information",
            "distributed": "fully_distributed",
        }[self.law]
        return reference.closed_loop_rate(self.agent, name, self.oracle, self.rho, **self.numbers)

    @property
    def start(self):
        return self.pack(self.state, self.z, self.estimates)

    def pack(self, x, z, estimates):
        return reference.pack(
            x[:, : self.agent.n],
            z if self.law == "distributed" else None,
            estimates if self.law != "full" else None,
        )

    def flat(self, states, memories):
        """Rows of the product's states and memories in the reference's layout."""
        size = self.count**2
        return np.array(
            [
                self.pack(x, memory[size:], memory[:size].reshape(self.count, -1))
                if len(memory)
                else self.pack(x, None, None)
                for x, memory in zip(states, memories, strict=True)
            ]
        )

    def run(self, h, steps, control=None, every=1, **options):
        states, u, memory, loop = run_loop(self.system(**options), h, steps, control, every)
        assert loop.monitor.exit == watch.INSIDE
        self.divided = loop.monitor.divided
        return self.flat(states, memory), u

    def memories(self, step):
        """How z and the estimates move over ``step`` with y held: exactly, and by Euler."""
        rate = {"partial": COUPLING / TAU, "distributed": 1 / EPSILON}[self.law]
        maps = []
        for j in range(self.count):
            rates = -rate * self.laplacian
            rates[j] = 0.0
            maps.append(expm(step * rates))

        def exactly(y, z, estimates):
            new = estimates.copy()
            for j in range(self.count):
                column = estimates[:, j].copy()
                column[j] = y[j]
                new[:, j] = maps[j] @ column
            return y + np.exp(-step / EPSILON) * (z - y), new

        def by_euler(y, z, estimates):
            _, z_rate, rates = self.law_at(y, z, estimates)
            return z if z_rate is None else z + step * z_rate, estimates + step * rates

        return exactly, by_euler


class Remembering:
    """law(time, x) with a memory, called once a control period; keeps what it had each time."""

    def __init__(self, case, move):
        self.case, self.move = case, move
        self.z, self.estimates = case.z.copy(), case.estimates.copy()
        self.kept = []

    def __call__(self, time, x):
        case = self.case
        y = case.agent.output(np.reshape(x, (case.count, -1)))
        self.kept.append((self.z, self.estimates))
        u, _, _ = case.law_at(y, self.z, self.estimates)
        self.z, self.estimates = self.move(y, self.z, self.estimates)
        return u


def matrix():
    for plant in PLANTS:
        names = ("line", "ring", "complete", "printed")  # the last one with ten agents
        yield plant, "full", "line"
        for law in LAWS[1:]:
            for graph in names:
                yield plant, law, graph


SMALL = [("robots in MuJoCo", "partial", "ring"), ("robots in MuJoCo", "distributed", "ring")]


def cells(*, full):
    """All plants, laws and graphs, but for a few marked slow."""
    return pytest.mark.parametrize(
        ("plant", "law", "graph"),
        [
            pytest.param(*cell, marks=[] if cell in SMALL else pytest.mark.slow)
            for cell in matrix()
            if full or cell[1] != "full"
        ],
    )


def rk4_difference(plant, law, graph, h=0.0025, duration=5.0):
    """With steps that are short enough for the fastest estimates not to be divided."""
    case = Case(plant, law, graph)
    steps = round(duration / h)
    expected = reference.rk4_fixed(case.rate, case.start, h, steps)
    got, _ = case.run(h, steps)
    assert np.max(np.abs(expected[-1] - expected[0])) > 1e-2
    # states and memories by themselves, so that neither hides the other
    split = case.count * case.agent.n
    parts = [slice(0, split)] + ([slice(split, None)] if law != "full" else [])
    return max(relative_error(got[:, part], expected[:, part]) for part in parts)


@cells(full=True)
def test_continuous_equals_a_plain_rk4(plant, law, graph):
    assert rk4_difference(plant, law, graph) < 1e-11


def dop853_errors(plant, law, graph, steps=(0.01, 0.005, 0.0025), duration=1.0):
    """Greatest relative error of the whole state at the end, and steps divided, for each step."""
    case = Case(plant, law, graph)
    times = np.array([0.0, duration])
    exact = reference.dop853(case.rate, case.start, times, rtol=3e-14, atol=1e-15)[-1]
    errors, divided = [], []
    for h in steps:
        got, _ = case.run(h, round(duration / h), every=round(duration / h))
        errors.append(relative_error(got[-1], exact))
        divided.append(case.divided)
    return np.array(errors), np.array(divided)


@cells(full=True)
def test_continuous_is_of_fourth_order(plant, law, graph):
    errors, divided = dop853_errors(plant, law, graph)
    orders = np.log2(errors[:-1] / errors[1:])
    assert errors[-1] < 1e-7
    # the last halving of whole steps whose error is above rounding and DOP853's own error
    whole = (divided[:-1] == 0) & (errors[1:] > 1e-12)
    measurable = orders[whole].tolist()
    assert errors[-1] < 1e-10 or measurable
    assert all(3.5 < order < 4.6 for order in measurable[-1:]), (errors, orders)


def held_difference(case, mode, integrator, substeps, h=0.005, steps=200):
    """Against a plain loop that holds inputs for some steps and moves the memory by itself."""
    exactly, by_euler = case.memories(h * substeps)
    remembering = Remembering(case, exactly if mode == "sampled" else by_euler)
    if integrator == "rk4":
        rate = reference.held_input_rate(case.agent, case.count)
        start = case.state[:, : case.agent.n].ravel()
        x, u = reference.rk4_sampled(rate, remembering, start, h, steps, substeps)
        x = x.reshape(len(x), case.count, -1)
    else:
        x, u = reference.semi_implicit_euler_robot(
            case.agent, remembering, case.state[:, :3], h, steps, substeps
        )
    kept = [*remembering.kept, (remembering.z, remembering.estimates)]
    expected = np.array([case.pack(x[n], *kept[n // substeps]) for n in range(steps + 1)])
    got, inputs = case.run(h, steps, control=h * substeps, mode=mode, integrator=integrator)
    return max(relative_error(got, expected), relative_error(inputs[:-1], np.array(u)))


@pytest.mark.parametrize("substeps", [1, 4])
@cells(full=False)
def test_sampled_equals_a_plain_loop(plant, law, graph, substeps):
    assert held_difference(Case(plant, law, graph), "sampled", "rk4", substeps) < 1e-11


@pytest.mark.parametrize(("mode", "substeps"), [("sampled", 4), ("continuous", 1)])
@pytest.mark.parametrize("law", LAWS[1:])
def test_euler_in_mujoco_equals_a_plain_loop(law, mode, substeps):
    assert held_difference(Case(PLANTS[0], law, "ring"), mode, "euler", substeps) < 1e-11


@pytest.mark.slow
@pytest.mark.parametrize("law", LAWS[1:])
@pytest.mark.parametrize("plant", PLANTS[1:])
def test_euler_of_ode_agents(plant, law):
    case, h, steps = Case(plant, law, "ring"), 0.005, 200
    if plant == "robots":  # symplectic, as in MuJoCo
        assert held_difference(case, "continuous", "euler", 1) < 1e-11
        return
    flat, expected = case.start, [case.start]
    for _ in range(steps):
        flat = flat + h * case.rate(0.0, flat)
        expected.append(flat)
    got, _ = case.run(h, steps, integrator="euler")
    assert relative_error(got, np.array(expected)) < 1e-11


@pytest.mark.parametrize("law", LAWS[1:])
def test_actions_see_nothing_of_other_states(law):
    """Same outputs and memory, other extensions, appendages and positions: the same forces."""
    case, other = Case("robots in MuJoCo", law, "ring"), Case("robots in MuJoCo", law, "ring")
    other.state = case.state.copy()
    other.state[:, [0, 2, 3]] += np.random.default_rng(0).uniform(-3, 3, (5, 3))
    inputs = [run_loop(one.system(), 1e-3, 1)[1][0] for one in (case, other)]
    assert np.array_equal(*inputs)
