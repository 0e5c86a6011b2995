"""Laws with those estimates only that matter, against the same with all and a masked reference."""

import numpy as np
import pytest
from builders import FIVE, V0, clock, integrators, random_consensus, robot_state, robot_system
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.linalg import expm
from test_keepers import random_graph

import gne_mj as gm
import reference
from gne_mj import graph as graphs
from gne_mj.controllers import FullyDistributed, PartialInformation
from gne_mj.controllers.keepers import Keepers, fewest, readers
from gne_mj.controllers.kept import Kept
from gne_mj.controllers.propagation import no_propagator, scratch_length
from gne_mj.faults import Corruption, MessageDelay, MessageLoss, Silence
from gne_mj.games import velocity_game
from gne_mj.loops import functions
from gne_mj.loops.feedback import Problem, work
from gne_mj.loops.layout import LoopClock, Setup, problem_and_parameter_block
from gne_mj.loops.link import link
from gne_mj.simulation import Simulation
from gne_mj.system import System
from gne_mj.system.steps import largest_step
from gne_mj.theory.coupling import least_coupling
from gne_mj.viewer import replay_pack
from gne_mj.viewer.pack import unpack

RHO, COUPLING, TAU, EPSILON, GAIN = 0.1, 1.7, 0.3, 0.05, 0.7
GAME = velocity_game(5, V0, 3.0)


def all_of(graph, game):
    """Kept estimates that are all there are."""
    everyone = np.arange(graph.agents)
    rows = tuple(np.concatenate([[j], np.delete(everyone, j)]) for j in everyone)
    return Kept(graph, game.data.offsets, Keepers(rows, np.ones(graph.agents, dtype=bool)))


def needed(graph, game, constraints=False):
    keepers = fewest(graph, readers(game.data, constraints=constraints))
    return Kept(graph, game.data.offsets, keepers)


def masked(kept, rows):
    """Estimates (N, m) with NaN where an agent keeps none; and the memory of the same."""
    seen = np.full(rows.shape, np.nan)
    seen[kept.holder, kept.action] = rows[kept.holder, kept.action]
    return seen, np.concatenate([rows[kept.holder, kept.action], np.full(rows.shape[1], np.nan)])


def reference_rates(kept, owner, seen):
    """sum_l (e - e_l) over neighbours that keep an estimate of the same action, (N, m)."""
    found = np.zeros(seen.shape)
    for i in range(len(seen)):
        for j in np.flatnonzero(kept.graph.laplacian[i] < 0):
            both = np.isfinite(seen[i]) & np.isfinite(seen[j])
            found[i, both] += seen[i, both] - seen[j, both]
    return found


class Called:
    """A law's functions, called as loops call them."""

    def __init__(self, game, law, held=False, period=0.02):
        self.game, self.m = game, game.actions
        addresses = link(law.kernels, game.kernels, memory=True, held=held)
        problem = Problem(
            game.data, law.graph_data, law.settings(RHO), np.full(self.m, np.inf),
            np.zeros(self.m), law.propagator(period) if held else no_propagator(),
            kept=law.kept_data, functions=addresses,
        )  # fmt: skip
        self.length = len(law.initial_memory(np.zeros(self.m)))
        setup = Setup(problem, np.zeros((self.m, 1)), LoopClock(1.0, 1, int(held), 0))
        made = problem_and_parameter_block(setup, integrators(self.m), self.length)
        self.problem, self._block = made

    def action(self, y, memory):
        u, now = np.zeros(self.m), work(self.m, self.game.constraints_count, self.game.agents)
        now.now.penalty = RHO
        weights = RHO / -self.game.constraints(y)
        code = functions.action(self.problem, y, weights, memory, now, u)
        return code, u

    def rate(self, y, memory):
        out = np.full(self.length, np.nan)
        functions.rate(self.problem, y, memory, out)
        return out

    def propagate(self, y, memory):
        functions.propagate(self.problem, y, memory, np.zeros(scratch_length(self.game.agents)))
        return memory


def own_in(rows, y, owner):
    rows[owner, np.arange(len(y))] = y
    return rows


@settings(max_examples=25)
@given(st.integers(0, 2**32 - 1))
def test_the_law_is_that_of_a_masked_reference(seed):
    """Random sparse games of agents in the plane on random graphs: what is not kept is NaN."""
    rng = np.random.default_rng(seed)
    drawn = random_consensus(seed, 2)
    game, oracle, owner = drawn.game, drawn.oracle, drawn.game.agent_of_action
    graph = random_graph(rng, game.agents, 2 if game.agents > 1 else 0)
    y = drawn.interior()
    rows = own_in(y + rng.normal(size=(game.agents, game.actions)), y, owner)
    kept = needed(graph, game)
    seen, memory = masked(kept, rows)
    coupled = reference_rates(kept, owner, seen)
    called = Called(game, PartialInformation(graph, COUPLING, TAU, kept))
    code, u = called.action(y, memory)
    slopes = np.array([oracle.partial_gradient(a, seen[owner[a]]) for a in range(len(y))])
    barrier = reference.barrier_gradient(oracle, RHO, y)
    expected = -slopes - barrier - COUPLING * coupled[owner, np.arange(len(y))]
    assert code == -1
    np.testing.assert_allclose(u, expected, rtol=1e-12, atol=1e-12)
    rates = -COUPLING / TAU * coupled
    rates[owner, np.arange(len(y))] = 0.0
    found = called.rate(y, memory)
    np.testing.assert_allclose(found[: kept.size], rates[kept.holder, kept.action], atol=1e-12)
    assert not np.any(found[kept.size :])


@settings(max_examples=25)
@given(st.integers(0, 2**32 - 1))
def test_the_distributed_law_keeps_what_its_barriers_read(seed):
    rng = np.random.default_rng(seed)
    drawn = random_consensus(seed, 2)
    game, owner, m = drawn.game, drawn.game.agent_of_action, drawn.game.actions
    graph = random_graph(rng, game.agents, 2 if game.agents > 1 else 0)
    y, z = drawn.interior(0.5), drawn.interior(0.5)
    rows = own_in(np.tile(0.5 * (y + z), (game.agents, 1)), y, owner)
    kept = needed(graph, game, constraints=True)
    _, memory = masked(kept, rows)
    some = Called(game, FullyDistributed(graph, EPSILON, GAIN, kept))
    full = Called(game, FullyDistributed(graph, EPSILON, GAIN))
    memory, whole = np.concatenate([memory, z]), np.concatenate([rows.ravel(), z])
    code, u = some.action(y, memory)
    expected_code, expected = full.action(y, whole)
    assert code == expected_code
    if code < 0:
        np.testing.assert_array_equal(u, expected)
    np.testing.assert_allclose(some.rate(y, memory)[-m:], (y - z) / EPSILON, rtol=1e-12)


@pytest.mark.parametrize("period", [1e-3, 0.3, 500.0])
@pytest.mark.parametrize("count", [6, 70])
def test_kept_estimates_move_by_matrix_exponentials(count, period):
    """Short and long periods: by the series (of many keepers) and by matrices."""
    rng = np.random.default_rng(count)
    game = velocity_game(count, V0, 3.0)
    graph = random_graph(rng, count, count // 2)
    must = [{j, *map(int, rng.choice(count, count // 3, replace=False))} for j in range(count)]
    kept = Kept(graph, game.data.offsets, fewest(graph, must))
    law = PartialInformation(graph, COUPLING, TAU, kept)
    called = Called(game, law, held=True, period=period)
    y = rng.normal(size=count)
    rows = own_in(rng.normal(size=(count, count)), y, np.arange(count))
    seen, memory = masked(kept, rows)
    moved = called.propagate(y, memory.copy())
    for j in range(count):
        keepers = kept.keepers.of[j]
        laplacian = kept.among(j).laplacian[1:, 1:]
        errors = seen[keepers[1:], j] - y[j]
        expected = y[j] + expm(-COUPLING / TAU * period * laplacian) @ errors
        begin = kept.data.place[kept.data.pointer[j]]
        np.testing.assert_allclose(moved[begin + 1 :][: len(errors)], expected, atol=1e-11)


def rows_of(system, samples):
    """Estimates (samples, N, m) of either kind of memory; of those not kept NaN."""
    memory, kept, agents, m = samples.memory, system.law.kept, system.game.agents, 5
    if kept is None:
        return memory[:, : agents * m].reshape(len(memory), agents, m)
    found = np.full((len(memory), agents, m), np.nan)
    found[:, kept.holder, kept.action] = memory[:, : kept.size]
    return found


FAULTS = (
    MessageLoss(probability=0.4), MessageDelay(periods=2, edges=((1, 2),)),
    Silence(agents=(3,), start=0.2, end=0.5), Corruption(amplitude=0.3, start=0.1),
)  # fmt: skip


@pytest.mark.parametrize(
    ("engine", "mode", "faults"),
    [
        ("ode", "continuous", ()),
        ("ode", "sampled", ()),
        ("ode", "sampled", FAULTS),
        ("ode", "implicit", ()),
        ("mujoco", "sampled", FAULTS),
        ("mujoco", "continuous", ()),
    ],
)  # fmt: skip
def test_where_all_are_kept_a_run_is_that_of_all_estimates(engine, mode, faults):
    """To the last bit where estimates move in the same order of operations."""
    graph, found = graphs.ring(5), []
    for kept in (None, all_of(graph, GAME)):
        law = PartialInformation(graph, 2.0, 0.2, kept)
        system = robot_system(
            robot_state(FIVE), law=law, mode=mode, engine=engine, faults=faults, seed=3
        )
        loop = system.closed_loop(clock(0.01, 1.0))
        samples = loop.advance(80, 1)
        assert loop.monitor.exit == 0
        found.append((samples.state, samples.input, rows_of(system, samples)))
    exactly = bool(faults) or mode == "continuous"
    for all_kept, some in zip(*found, strict=True):
        np.testing.assert_allclose(some, all_kept, rtol=0, atol=0 if exactly else 1e-12)


def test_losses_strike_what_is_kept():
    """With every message lost from the start estimates stay where they were."""
    graph = graphs.line(5)
    law = PartialInformation(graph, 2.0, 0.2, needed(graph, GAME))
    system = robot_system(
        robot_state(FIVE), law=law, mode="sampled", faults=(MessageLoss(probability=1.0),)
    )
    samples = system.closed_loop(clock(0.01, 1.0)).advance(50, 1)
    others = law.kept.estimated
    assert np.ptp(samples.memory[:, : law.kept.size][:, others], axis=0).max() == 0.0
    assert len(system.loop_memory) == law.kept.size + 5 + law.kept.heard_size + law.kept.size


@pytest.mark.parametrize("seeds", [range(5), pytest.param(range(400), marks=pytest.mark.slow)])
def test_v_never_rises_above_the_least_gain(seeds):
    """Random games and graphs, gains just above what the certificate asks for, wrong estimates."""
    for seed in seeds:
        drawn, rng = random_consensus(seed, 1 + seed % 2), np.random.default_rng(seed)
        game, y = drawn.game, drawn.interior(0.95)
        if game.agents == 1:
            continue
        graph = random_graph(rng, game.agents, int(rng.integers(0, 3)))
        kept, slope = needed(graph, game), game.pseudo_gradient_jacobian(y)
        least = least_coupling(slope, graph, game.agent_of_action, kept=kept)
        law = PartialInformation(graph, 1.02 * least + 0.01, 10 ** rng.uniform(-1, 0.5), kept)
        memory = law.initial_memory(y, y + rng.normal(size=(game.agents, game.actions)))
        system = System(
            "random", game, integrators(game.actions), law, RHO, y.reshape(-1, 1), memory=memory
        )
        h = 2.0 ** np.floor(np.log2(min(2e-3, 0.3 * largest_step(system))))
        report = Simulation([system], clock(h, 2.0, sample=0.5)).run().reports["random"]
        assert report["status"] in ("converged", "completed")
        assert report["lyapunov"]["claimed"]
        assert report["lyapunov"]["monotone"]


LAW = {"information": "partial", "graph": "line", "coupling": 5.0, "time_constant": 0.1}


@pytest.fixture(scope="module")
def run():
    law = {**LAW, "estimates": "needed"}
    return gm.run("velocity-sync", {"controller": law, "plant.engine": "ode",
                                    "simulation.duration": 30.0})  # fmt: skip


def test_a_certified_run_keeps_its_promise(run):
    report = run.reports["robots"]
    assert report["lyapunov"]["claimed"]
    assert report["lyapunov"]["monotone"]
    assert run.status == "converged"


def test_the_trajectory_has_what_is_kept(run):
    robots = run["robots"]
    assert robots["estimate"].dims == ("time", "kept")
    assert robots["by_agent"].values.tolist() == [2, 3, 4, 5]
    assert robots["of_agent"].values.tolist() == [1, 2, 3, 4]
    last = robots["estimate"].values[-1]
    np.testing.assert_allclose(last, robots["action"].values[-1, :4], atol=1e-2)
    assert robots["estimate"].values[0].tolist() == FIVE[:4].tolist()


def test_it_is_shown_and_shown_again(run, tmp_path):
    again = gm.Trajectory.load(run.save(tmp_path / "run"))
    assert again["robots"]["estimate"].equals(run["robots"]["estimate"])
    for trajectory in (run, again):
        meta, found = unpack(replay_pack(trajectory))
        assert "robots/action" in found
        values = trajectory["robots"]["estimate"].values
        np.testing.assert_allclose(found["robots/estimate"], values, atol=1e-3)
        assert meta["systems"][0]["kept"] == {"by": [2, 3, 4, 5], "action": [0, 1, 2, 3]}


@pytest.mark.parametrize("more", [
    {"estimates": "needed"},
    {"communication": {"type": "event", "threshold": 0.1, "decay": 0.2}},
])  # fmt: skip
def test_batches_have_the_bits_of_runs_alone(tmp_path, more):
    controller = {"information": "partial", "mode": "sampled", "coupling": 3.0, **more}
    scenario = gm.load_scenario("velocity-sync", {
        "agents": {"type": "integrator", "count": 5}, "controller": controller,
        "plant.engine": "ode", "simulation.duration": 0.5,
    })  # fmt: skip
    found = gm.batch(scenario, {"barrier.rho": [0.1, 0.4]}, runs=2, out=tmp_path / "batch")
    for rho, start, last in zip(
        found["barrier.rho"].values, found["initial_action"].values, found["final_action"].values,
        strict=True,
    ):  # fmt: skip
        changes = {"initial.action": start.tolist(), "barrier.rho": float(rho)}
        alone = gm.run(scenario, changes)["robots"]["action"].values[-1]
        np.testing.assert_array_equal(last, alone)
