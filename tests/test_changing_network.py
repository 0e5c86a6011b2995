"""Runs over graphs that change, against SciPy and plain reckoning, and what they report."""

import json

import numpy as np
import pytest
from builders import EQUAL, FIVE, clock, robot_state, robot_system, run_loop
from commands import gne_here
from numpy.testing import assert_allclose, assert_array_equal
from scipy.integrate import solve_ivp

import gne_mj
from gne_mj.changing_graph import disc, switching
from gne_mj.controllers import FullyDistributed, PartialInformation
from gne_mj.errors import InvalidInput
from gne_mj.faults import MessageLoss
from gne_mj.graph import Graph, complete, line, ring
from gne_mj.simulation import Simulation
from gne_mj.viewer import replay_pack
from gne_mj.viewer.pack import unpack

THREE = (ring(5), line(5), complete(5))
C, TAU = 5.0, 0.1


def partial(graph, state=None, **options):
    law = PartialInformation(graph, coupling=C, time_constant=TAU)
    return robot_system(robot_state(FIVE) if state is None else state, law=law, **options)


def right_hand_side(system, graph):
    """Of robots and estimates together over one graph, from the formulas."""
    game, n = system.game, 5
    laplacian = graph.laplacian

    def rate(time, x):
        state, rows = x[: 4 * n].reshape(n, 4), x[4 * n :].reshape(n, n).copy()
        x1, y, x3 = state[:, 0], state[:, 1], state[:, 2]
        np.fill_diagonal(rows, y)
        pull = np.array([game.pseudo_gradient(rows[i])[i] for i in range(n)])
        barrier = game.constraint_jacobian(y).T @ (system.rho / -game.constraints(y))
        apart = laplacian @ rows
        u = -pull - barrier - C * np.diag(apart)
        spring = x1 + np.arctan(x1) + (y - x3)  # all numbers of EQUAL are 1
        own = np.column_stack([y - x3, u - spring, spring, y])
        moved = -C / TAU * apart
        np.fill_diagonal(moved, 0.0)
        return np.concatenate([own.ravel(), moved.ravel()])

    return rate


def test_a_run_follows_one_graph_after_the_other():
    """Against SciPy at 1e-11, stopped and begun anew at every change."""
    assert all(set(numbers) == {1.0} for numbers in EQUAL.values())
    durations, h = (0.05, 0.1, 0.02), 5e-4
    system = partial(switching(THREE, durations))
    states, _, memories, loop = run_loop(system, h, 800)
    x, time, number = np.concatenate([system.state.ravel(), np.tile(FIVE, 5)]), 0.0, 0
    while time < 0.4 - 1e-9:
        end = min(time + durations[number % 3], 0.4)
        rate = right_hand_side(system, THREE[number % 3])
        x = solve_ivp(rate, (time, end), x, "DOP853", rtol=1e-11, atol=1e-12).y[:, -1]
        time, number = end, number + 1
    assert_allclose(states[-1].ravel(), x[:20], rtol=1e-7, atol=1e-8)
    rows = memories[-1].reshape(5, 5).copy()
    np.fill_diagonal(rows, x[20:].reshape(5, 5).diagonal())
    assert_allclose(rows.ravel(), x[20:], rtol=1e-6, atol=1e-7)
    assert loop.network == {"changes": number - 1, "disconnected": 0.0}


@pytest.mark.parametrize("mode", ["continuous", "sampled", "implicit"])
def test_how_a_run_is_cut_into_pieces_does_not_matter(mode):
    system = partial(switching(THREE, (0.004, 0.01, 0.006)), mode=mode, integrator="euler")
    once = run_loop(system, 1e-3, 60, 2e-3)
    for every in (7, 20):
        other = run_loop(system, 1e-3, 60, 2e-3, every=every)
        rows = slice(0, 60 // every * every, every)
        for got, expected in zip(other[:3], once[:3], strict=True):
            assert_array_equal(got[: 60 // every], expected[rows])
    assert other[3].network == once[3].network
    simulation = Simulation([system], clock(1e-3, 0.06, 2e-3))
    for _ in range(60):
        simulation.step()
    present = simulation.runs["robots"].loop.present()
    assert_array_equal(present.state, once[0][-1])


def test_of_one_graph_again_and_again_it_is_that_graphs_run():
    alone = run_loop(partial(ring(5), mode="sampled"), 1e-3, 40, 2e-3)
    found = run_loop(partial(switching((ring(5), ring(5)), 0.01), mode="sampled"), 1e-3, 40, 2e-3)
    for got, expected in zip(found[:3], alone[:3], strict=True):
        assert_array_equal(got, expected)
    assert found[3].network["changes"] == 0


def test_under_fast_switching_v_falls_and_the_run_stays_inside():
    """The theorem of docs/networks.md, each graph being certified for this gain."""
    system = partial(switching(THREE, 0.02, random=True), seed=3)
    simulation = Simulation([system], clock(1e-3, 3.0, sample=0.1))
    certificate = simulation.run().report()["systems"]["robots"]
    assert certificate["lyapunov"]["claimed"]
    assert certificate["lyapunov"]["monotone"]
    assert certificate["lyapunov"]["final"] < 0.6 * certificate["lyapunov"]["start"]
    assert certificate["network"]["changes"] > 80


def test_the_fully_distributed_law_switches_too():
    law = FullyDistributed(switching(THREE, 0.05), 0.01, 1.0)
    system = robot_system(robot_state(FIVE), law=law)
    *_, loop = run_loop(system, 1e-3, 300)
    assert loop.monitor.exit == 0
    assert loop.network["changes"] == 6


def test_agents_that_drive_apart_lose_each_other():
    """One robot starts far behind: nobody hears it, and its estimates rest until they meet."""
    places = np.array([0.0, 1.0, 2.0, 3.0, -6.0])
    system = partial(disc(5, 1.5, 0.1), robot_state(FIVE, position=places))
    states, _, memories, loop = run_loop(system, 1e-3, 500)
    q = states[::100, :, 3]
    alone = np.min(np.abs(q[:, :4] - q[:, 4:]), axis=1) > 1.5
    assert alone.all()
    rows = memories.reshape(len(memories), 5, 5)
    assert_array_equal(rows[-1, 4, :4], rows[0, 4, :4])
    assert np.max(np.abs(rows[-1, 0, 1:4] - rows[0, 0, 1:4])) > 0.01
    assert_allclose(loop.network["disconnected"], 0.5)


def test_a_disc_wide_enough_is_the_complete_graph():
    far = run_loop(partial(disc(5, 100.0, 0.01)), 1e-3, 50)
    all_of_them = run_loop(partial(complete(5)), 1e-3, 50)
    assert_array_equal(far[0], all_of_them[0])


def test_scenario_certificate_report_and_results(tmp_path):
    graph = '{type="switching", graphs=["ring","line","complete"], every=0.5}'
    keys = ["--set", f"controller={{information='partial', coupling=5.0, graph={graph}}}"]
    keys += ["--set", "simulation.duration=2", "--set", "plant.engine=ode"]
    told = json.loads(gne_here("certify", "velocity-sync", *keys, "--json").stdout)
    theory = told["robots"]
    assert theory["graph"]["changes"]
    assert theory["graph"]["lambda_2"] == line(5).algebraic_connectivity
    assert "each of the 3 graphs" in json.dumps(theory["theorem"])
    done = gne_here("run", "velocity-sync", *keys, "--out", tmp_path / "run")
    assert "became another one 4 times, connected throughout" in " ".join(done.stdout.split())
    trajectory = gne_mj.Trajectory.load(tmp_path / "run" / "trajectory.zarr")
    data = trajectory.tree["robots"]
    found = data["linked"].sel(time=[0.0, 0.5, 1.0, 1.5], method="nearest").sum("edge")
    assert_array_equal(found, [5, 4, 10, 5])
    assert data["edge"].to_numpy().tolist()[:2] == ["1-2", "1-3"]
    meta, arrays = unpack(replay_pack(trajectory, "robots"))  # a page has results alone
    (about,) = meta["systems"]
    assert about["links"][:2] == [[1, 2], [2, 1]], "both of each edge"
    assert about["message_period"] is None
    every = arrays["robots/linked"].reshape(-1, len(about["edges"]))
    assert set(every.sum(axis=1).astype(int)) == {4, 5, 10}


def test_batches_do_the_same(tmp_path):
    graph = {"type": "switching", "graphs": ["ring", "line"], "every": 0.25}
    scenario = gne_mj.load_scenario(
        "velocity-sync",
        {
            "controller": {"information": "partial", "coupling": 5.0, "graph": graph},
            "plant.engine": "ode",
            "simulation.duration": 1.0,
        },
    )
    found = gne_mj.batch(scenario, {"barrier.rho": [0.1, 0.2]}, runs=0, out=tmp_path / "batch")
    alone = scenario.simulation_object().run()["robots"]["action"].to_numpy()[-1]
    assert_array_equal(found["final_action"].to_numpy()[0], alone)
    with pytest.raises(InvalidInput, match=r"^systems\.robots\.controller\.graph: .*multiple of"):
        gne_mj.batch(scenario, {"controller.graph.every": [0.0003]}, runs=0, out=tmp_path / "no")


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"faults": (MessageLoss(probability=0.1),), "mode": "sampled"}, "faults of messages"),
        ({"integrator": "rosenbrock"}, "rosenbrock"),
    ],
)
def test_what_goes_with_one_graph_only_is_refused(change, words):
    with pytest.raises(InvalidInput, match=words):
        partial(switching(THREE, 0.1), **change)


def test_it_changes_between_steps_and_stays_what_it_is():
    with pytest.raises(InvalidInput, match=r"0\.0005 s.*multiple of the timestep 0\.001 s"):
        partial(switching(THREE, 0.0005)).closed_loop(clock(1e-3))
    with pytest.raises(InvalidInput, match=r"0\.003 s.*multiple of the control period 0\.002 s"):
        partial(switching(THREE, 0.003), mode="sampled").closed_loop(clock(1e-3, control=2e-3))
    simulation = Simulation([partial(switching(THREE, 0.1))], clock(1e-3))
    with pytest.raises(InvalidInput, match="stays what it is"):
        simulation.change(partial(Graph(5, ring(5).edges)))
