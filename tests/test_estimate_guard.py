"""What ends a run or refuses it because of the estimates, and the steps that they allow."""

import numpy as np
import pytest
from builders import (
    UNEQUAL,
    V0,
    clock,
    integrators,
    robot_state,
    robot_system,
    run_loop,
)

import reference
import reference_games
from gne_mj import graph as graphs
from gne_mj.controllers import FullInformation, FullyDistributed, PartialInformation
from gne_mj.errors import InfeasibleStart, InvalidInput
from gne_mj.games import velocity_game
from gne_mj.loops import monitor as watch
from gne_mj.scenario_tables import Scenario
from gne_mj.scenario_tables.clock import SimulationTable
from gne_mj.simulation import Simulation
from gne_mj.system import System
from gne_mj.system.steps import STABLE, largest_step

START = V0 + np.array([-1.0, 0.5, 1.0, -0.5, 0.3])
SHIFT = 20.0


def drifting(engine, mode, epsilon=0.5, h=0.02, integrator="rk4"):
    """Robots that take all others, and filter themselves, to be faster than they are by ``SHIFT``.

    The gaps in their heads are as wide as the true ones, but close at different rates: z in its own
    time, an estimate of a neighbour more slowly, since others of the chain still hold it up.
    """
    law = FullyDistributed(graphs.line(5), epsilon, 0.01)
    shift = SHIFT * np.array([0.0, 1.0, 1.0, 1.0, 1.0])  # the first one compares itself with v_0
    memory = law.initial_memory(START, START + shift[:, None], START + shift)
    system = robot_system(
        robot_state(START), UNEQUAL, law=law, engine=engine, mode=mode, integrator=integrator,
        delta=2.0, memory=memory,
    )  # fmt: skip
    return system, h


@pytest.mark.parametrize(
    "engines", [("mujoco",), pytest.param(("ode", "mujoco"), marks=pytest.mark.slow)]
)
@pytest.mark.parametrize(
    ("mode", "epsilon", "h", "integrator"),
    [
        ("continuous", 0.5, 0.01, "rk4"),
        ("continuous", 0.4, 0.02, "rk4"),
        ("continuous", 0.5, 0.1, "rk4"),
        ("sampled", 0.5, 0.02, "rk4"),
        ("sampled", 0.5, 0.02, "euler"),
    ],
)
def test_an_estimate_that_leaves_ends_the_run(mode, epsilon, h, integrator, engines):
    game = reference_games.VelocityGame(V0, [2.0] * 5)
    seen = []
    for engine in engines:
        system, h = drifting(engine, mode, epsilon, h, integrator)
        loop = system.closed_loop(clock(h, 20.0, 5 * h))
        recorded = loop.advance(1000, 1)
        monitor = loop.monitor
        assert monitor.exit == watch.ESTIMATE_LEFT
        agent, constraint = int(monitor.exit_agent), int(monitor.exit_constraint)
        assert constraint in (agent, agent + 1)
        done, stopped = round(loop.time / h), mode == "continuous"
        if stopped:  # within a step whose pieces became finer and finer, and which was not taken
            assert done * h < monitor.exit_time <= (done + 1) * h + 1e-12
            assert 0 < monitor.smallest_step < h / 64
        else:
            assert monitor.exit_time == pytest.approx(done * h, abs=1e-12)
        assert len(recorded.input) == done + stopped
        stage = 0 if not stopped else 1
        last = loop.finish()
        z, estimates = last.memory[0, 25:], last.memory[0, :25].reshape(5, 5)
        margins = reference.estimate_margins(game, z, estimates)
        if stage == 0:
            assert margins[agent, constraint] == pytest.approx(monitor.exit_value, rel=1e-9)
            assert monitor.exit_value >= 0
        else:  # the state and memory before the step, both inside
            own = [margins[i, [i, i + 1][: 5 - i]] for i in range(5)]
            assert max(map(np.max, own)) < 0
            changed = np.flatnonzero(last.memory[0] != recorded.memory[-1])
            assert set(changed) <= set(range(0, 25, 6)), "own blocks are no estimates"
            assert np.array_equal(last.state[0], recorded.state[-1])
        assert np.all(system.game.constraints(last.state[0, :, 1]) < 0)
        again = loop.advance(5, 1)
        assert loop.time == pytest.approx(done * h)
        assert len(again.input) == 0
        seen.append((agent, constraint, stage, done, last))
    for other in seen[1:]:
        assert other[:4] == seen[0][:4]
        close = 1e-9 if mode == "sampled" else 1e-6  # near a wall rounding decides on pieces
        kept = np.setdiff1d(np.arange(30), range(0, 25, 6))  # own blocks are no estimates
        memories = [each.memory[0, kept] for each in (other[4], seen[0][4])]
        assert np.allclose(*memories, rtol=0, atol=close)
        assert np.allclose(other[4].state, seen[0][4].state, rtol=0, atol=close)


@pytest.mark.parametrize("mode", ["continuous", "sampled"])
def test_the_status_names_agent_and_constraint(mode):
    system, h = drifting("mujoco", mode)
    trajectory = Simulation([system], clock(h, 20.0, 5 * h, 5 * h)).run()
    report = trajectory.reports["robots"]
    assert report["status"] == "estimate_left_feasible_set"
    assert not trajectory.holds
    agent = report["message"].split("'s estimates")[0]
    assert agent in {f"agent {i}" for i in range(2, 6)}
    assert "violated constraint 'gap of agent" in report["message"]


# ----------------------------------------------------------------------------------- the start


def test_estimates_outside_are_refused_at_the_start():
    law = FullyDistributed(graphs.ring(5), 0.1)
    state = robot_state(START)
    for memory, agent in (
        (law.initial_memory(START, 0.0), 2),  # agent 1 takes itself to be near v_0
        (law.initial_memory(START, filtered=[*START[:3], 9.0, START[4]]), 4),
    ):
        with pytest.raises(InfeasibleStart, match=f"initial estimates of agent {agent}"):
            robot_system(state, law=law, memory=memory)
    # under partial information estimates may start anywhere
    partial = PartialInformation(graphs.ring(5))
    robot_system(state, law=partial, memory=partial.initial_memory(START, 0.0))


def test_a_memory_of_another_shape_is_refused():
    state = robot_state(START)
    for law, memory in (
        (PartialInformation(graphs.ring(5)), np.zeros(30)),
        (FullyDistributed(graphs.ring(5), 0.1), np.zeros(25)),
        (FullInformation(), np.zeros(5)),
    ):
        with pytest.raises(InvalidInput, match="law's memory has shape"):
            robot_system(state, law=law, memory=memory)


def scenario(controller, initial):
    return Scenario.model_validate(
        {
            "systems": {
                "robots": {
                    "game": {"type": "velocity-synchronization"},
                    "agents": {"type": "flexible-robot", "count": 5},
                    "controller": controller,
                    "initial": {"action": START.tolist(), **initial},
                }
            }
        }
    )


def built(controller, initial):
    table = scenario(controller, initial).systems["robots"]
    return table.build("robots", SimulationTable(integrator="rk4"))


PARTIAL = {"information": "partial", "graph": "ring", "coupling": 2.0, "time_constant": 0.5}
DISTRIBUTED = {"information": "distributed", "graph": "ring", "epsilon": 0.1, "gain": 0.5}


@pytest.mark.parametrize("controller", [PARTIAL, DISTRIBUTED])
def test_estimates_in_scenarios(controller):
    rows = (START + np.linspace(-0.1, 0.1, 25).reshape(5, 5)).tolist()
    profile = (START + 0.05).tolist()
    for given, expected in (
        ({}, np.tile(START, (5, 1))),
        ({"estimate": 3.0}, np.full((5, 5), 3.0)),
        ({"estimate": profile}, np.tile(profile, (5, 1))),
        ({"estimate": rows}, rows),
    ):
        memory = built(controller, given).memory
        assert np.array_equal(memory[:25].reshape(5, 5), expected)
        if controller is DISTRIBUTED:
            assert np.array_equal(memory[25:], START)
    if controller is DISTRIBUTED:
        z = built(controller, {"filtered": profile}).memory[25:]
        assert np.array_equal(z, profile)
        assert np.array_equal(built(controller, {"filtered": 3.0}).memory[25:], np.full(5, 3.0))
    law = built(controller, {}).law
    numbers = {"partial": ("coupling", "time_constant"), "distributed": ("epsilon", "gain")}
    for key in numbers[controller["information"]]:
        assert getattr(law, key) == controller[key]


@pytest.mark.parametrize(
    ("controller", "initial", "sentence"),
    [
        (
            PARTIAL,
            {"estimate": [1.0, 2.0]},
            r"initial\.estimate.*\(2,\).*list of 5, or 5 lists",
        ),
        (PARTIAL, {"estimate": [[1.0] * 5] * 4}, r"initial\.estimate.*\(4, 5\).*5 lists of 5"),
        (PARTIAL, {"estimate": [[1.0] * 5, [1.0]]}, r"initial\.estimate.*different lengths"),
        (PARTIAL, {"filtered": 3.0}, r"initial\.filtered.*partial law has no z"),
        (
            DISTRIBUTED,
            {"filtered": [3.0]},
            r"initial\.filtered.*\[3\.0\].*one number or a list of 5",
        ),
        ({"information": "full"}, {"estimate": 3.0}, r"initial\.estimate.*no estimates"),
        ({"information": "full"}, {"filtered": 3.0}, r"initial\.filtered.*no z"),
    ],
)
def test_misshapen_estimates_are_refused_in_one_sentence(controller, initial, sentence):
    with pytest.raises(InvalidInput, match=sentence) as caught:
        built(controller, initial)
    assert str(caught.value).startswith("systems.robots.initial.")
    assert "\n" not in str(caught.value)


# ------------------------------------------------------------------------------------ the step


def clock_of(h):
    return clock(h, 100 * h)


def line_of_integrators(law, count, mode="continuous", integrator="rk4", engine="ode"):
    game = velocity_game(count, V0, 3.0)
    y = np.full(count, V0)
    errors = 1e-3 * np.random.default_rng(0).normal(size=(count, count))
    memory = law.initial_memory(y, y + errors)
    if engine == "mujoco":
        return robot_system(
            robot_state(y), {key: [1.0] * count for key in UNEQUAL}, law=law, engine=engine,
            mode=mode, integrator=integrator, memory=memory,
        )  # fmt: skip
    return System(
        "line", game, integrators(count), law, 0.1, y[:, None], mode=mode, integrator=integrator,
        memory=memory,
    )  # fmt: skip


def growth(system, h, steps=1000):
    """Of the estimates' errors over so many steps, whatever the product thinks of the step."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("gne_mj.system.steps.check_step", lambda system, clock: None)
        _, _, memory, loop = run_loop(system, h, steps, every=steps)
    count = system.game.agents
    others = ~np.eye(count, dtype=bool)
    first, last = (row[: count**2].reshape(count, count)[others] - V0 for row in memory)
    return np.max(np.abs(last)) / np.max(np.abs(first)), loop.monitor.divided


@pytest.mark.parametrize("integrator", ["rk4", "euler"])
@pytest.mark.parametrize("kind", ["partial", "distributed"])
@pytest.mark.parametrize("graph", ["ring", "complete"])
def test_the_largest_step_is_stable_and_a_tenth_more_is_not(kind, graph, integrator):
    network = graphs.NAMED[graph](6)
    if kind == "partial":
        law, rate = PartialInformation(network, 2.0, 0.02), 2.0 / 0.02
    else:
        law, rate = FullyDistributed(network, 0.01, 0.1), 1 / 0.01
    system = line_of_integrators(law, 6, integrator=integrator)
    largest = largest_step(system)
    values = np.linalg.eigvalsh(reference.laplacian(6, network.edges))
    assert largest == pytest.approx(STABLE[integrator] / (rate * values[-1]), rel=1e-12)
    grown, divided = growth(system, largest)
    assert grown < 1.0
    assert divided == 0
    grown, divided = growth(system, 1.1 * largest)
    assert grown > 100.0 or divided > 0  # until outputs sway, and steps are divided


@pytest.mark.parametrize(("method", "name"), [("rk4", 2.785293563405282), ("euler", 2.0)])
def test_the_methods_limits(method, name):
    """|R(-z)| <= 1 up to the limit and not beyond: RK4's real root of R = 1, and 2."""
    assert STABLE[method] <= name
    assert STABLE[method] == pytest.approx(name, rel=2e-4)


@pytest.mark.parametrize("engine", ["ode", "mujoco"])
@pytest.mark.parametrize("kind", ["partial", "distributed"])
@pytest.mark.parametrize("count", [2, 5, 7])
def test_a_step_outside_is_refused_and_the_named_one_is_accepted(count, kind, engine):
    network = graphs.complete(count)
    law = (
        PartialInformation(network, 2.0, 0.2)
        if kind == "partial"
        else FullyDistributed(network, 0.1)
    )
    system = line_of_integrators(law, count, engine=engine)
    with pytest.raises(InvalidInput, match="mode 'sampled'") as caught:
        system.closed_loop(clock_of(1.01 * largest_step(system)))
    message = str(caught.value)
    assert message.startswith("clock.timestep")
    assert ("rosenbrock" in message) == (kind == "distributed" and engine == "ode")
    named = float(message.split("steps of at most ")[1].split(" s;")[0])
    system.closed_loop(clock_of(named))
    assert named == pytest.approx(largest_step(system), rel=1e-2)
    assert largest_step(line_of_integrators(law, count, "sampled", engine=engine)) == np.inf


def test_light_agents_limit_the_step_as_light_estimates_do():
    """With M < tau the pull on the agents is the faster one: by the column's own matrix."""
    law = PartialInformation(graphs.complete(5), coupling=2000.0, time_constant=10.0)
    laplacian = graphs.complete(5).laplacian
    column = np.diag([1.0, 0.1, 0.1, 0.1, 0.1]) @ (
        2000.0 * laplacian
    )  # agent 1 and estimates of it
    fastest = np.max(np.linalg.eigvals(column).real)
    largest = largest_step(line_of_integrators(law, 5))
    assert largest <= 2.785 / fastest
    assert largest > 0.5 * 2.785 / fastest


def test_refused_when_the_loop_is_made():
    system = line_of_integrators(FullyDistributed(graphs.ring(5), 1e-3), 5)
    with pytest.raises(InvalidInput, match=r"^clock\.timestep"):
        system.closed_loop(clock(0.01))
