"""Promises that end where inputs are limited, sensors late or inputs not found accurately."""

import numpy as np
import pytest
from builders import (
    EQUAL,
    FIVE,
    UNEQUAL,
    clock,
    distributed,
    osnr_system,
    pi_cascades,
    reference_osnr,
    robot_state,
    robot_system,
    robots,
    run_loop,
)

import reference
from gne_mj import graph as graphs
from gne_mj.barrier import Schedule
from gne_mj.certificate import certify_run
from gne_mj.controllers import FullInformation, FullyDistributed, PartialInformation
from gne_mj.errors import InvalidInput
from gne_mj.faults import (
    Bias,
    Corruption,
    MessageDelay,
    MessageLoss,
    Noise,
    Push,
    Saturation,
    SensorDelay,
    Silence,
)
from gne_mj.games import velocity_game
from gne_mj.margins import influence, tightening
from gne_mj.summary import summary
from gne_mj.system import System
from gne_mj.system.first_input import first_input, law_at_start, limits_at
from gne_mj.theory import Theorem, ZeroOrderHold, certify, report_text
from gne_mj.theory.assumption import ASSUMED, FAILS, MET

H = 0.01
APPENDAGES = [-20.0, 20.0, -20.0, 20.0, -20.0]


def five(**options):
    """Robots that ask for more than 1 N at once."""
    y = np.full(5, 0.5)
    limit = options.pop("limit", np.inf)
    state = robot_state(y, appendage=np.array(APPENDAGES))
    return robot_system(state, limit=limit, **options)


# -------------------------------------------------------------------------------------- inputs


def test_the_law_at_the_start_under_full_information():
    u = law_at_start(robot_system(robot_state(FIVE)))
    np.testing.assert_allclose(u, [4.055, 2, 2.069444, -3, -3.044444], rtol=0, atol=5e-7)
    falling = robot_system(
        robot_state(FIVE), schedule=Schedule("exponential", 0.1, 1e-3, 1.0), rho=1e-3
    )
    np.testing.assert_allclose(law_at_start(falling), u, rtol=1e-12)


@pytest.mark.parametrize("kind", ["partial", "distributed", "messages"])
def test_the_law_at_the_start_with_estimates(kind):
    """Against the first input that a loop holds, whose laws are tested against slow ones."""
    graph = graphs.ring(10)
    law = distributed() if kind == "distributed" else PartialInformation(graph, 2.0)
    faults = (MessageLoss(probability=0.5),) if kind == "messages" else ()
    rng = np.random.default_rng(0)
    y = 0.2 + rng.uniform(-0.02, 0.02, 10)
    memory = law.initial_memory(y, y + rng.uniform(-0.01, 0.01, (10, 10)))
    system = osnr_system(pi_cascades(10), law, y, memory=memory, faults=faults, mode="sampled")
    _, u, *_ = run_loop(system, 1e-4, 1)
    np.testing.assert_allclose(law_at_start(system), u[0], rtol=1e-12)
    if kind == "partial":
        rows = memory.reshape(10, 10)
        slow, _ = reference.partial_information(
            reference_osnr(), 0.1, np.asarray(graph.laplacian), 2.0, 1.0, y, rows
        )
        np.testing.assert_allclose(law_at_start(system), slow, rtol=1e-10)


def test_without_limits_the_largest_input_is_told_as_well():
    report = certify(five(), clock(H)).to_dict()["inputs"]
    assert report["exceeded"] is None
    assert report["limits"] is None
    assert report["largest"] == pytest.approx(5.1818, rel=1e-4)
    assert report["agent"] == 1


@pytest.mark.parametrize("mode", ["continuous", "sampled", "implicit"])
def test_a_limit_that_the_start_exceeds_is_told_with_its_factor(mode):
    integrator = "euler" if mode == "implicit" else "rk4"
    system = five(limit=1.0, mode=mode, integrator=integrator)
    report = certify(system, clock(H))
    loop = system.closed_loop(clock(H))
    loop.finish()
    assert loop.monitor.saturated  # what a run of it sees at once
    peaks = loop.monitor.peak
    np.testing.assert_allclose(report.inputs["each"], peaks, rtol=1e-12)
    assert report.inputs["largest"] == pytest.approx(np.max(peaks))
    assert report.inputs["largest_factor"] == pytest.approx(np.max(peaks))
    assert report.status == "not certified"
    assert not report.lyapunov_claimed
    assert f"{np.max(peaks):.3g} times its limit 1" in "\n".join(report_text(report))
    assert any("times its limit" in text for text in report.not_certified)


@pytest.mark.parametrize("mode", ["continuous", "implicit"])
def test_a_limit_that_the_start_keeps_is_a_condition(mode):
    system = five(limit=6.0, mode=mode, integrator="euler" if mode == "implicit" else "rk4")
    report = certify(system, clock(H))
    assert report.status == (
        "certified" if mode == "continuous" else "certified at control instants"
    )
    assert "as long as no input limit is met" in report.guaranteed[0]
    assert 0.8 < report.inputs["largest_factor"] < 1.0
    assert "of a limit; limits of at least" in "\n".join(report_text(report))


def test_only_some_agents_have_limits():
    agents = robots(EQUAL)
    some = np.array([np.inf, np.inf, 0.1, np.inf, np.inf])
    object.__setattr__(agents, "input_limit", some)
    y = np.full(5, 0.5)
    y[2] = 0.9
    system = System(
        "robots", velocity_game(5, 3.0, 3.0), agents, FullInformation(), 0.1, robot_state(y)
    )
    assert "agent 3" in Theorem(system).commanded_input.exceeded
    assert Theorem(system).status == "not certified"


def held(faults=(), decentralised=False, law=None, limit=np.inf, **options):
    system = five(
        limit=limit, mode="implicit", integrator="euler", faults=tuple(faults), law=law,
        decentralised=decentralised, **options,
    )  # fmt: skip
    return ZeroOrderHold(system, clock(H))


def condition(found, label):
    (one,) = [c for c in found.conditions if c.label == label]
    return one


def test_saturation_at_the_start_and_later():
    now = condition(held([Saturation(agents=(0,), limit=2.0)]), "inputs")
    assert now.status == FAILS
    assert "agent 1" in now.why
    assert "its limit 2" in now.why
    nothing = condition(held([Saturation(agents=(0,), limit=0.0)]), "inputs")
    assert "its limit being 0" in nothing.why
    later = held([Saturation(agents=(0,), limit=2.0, start=1.0)])
    assert condition(later, "inputs").status == ASSUMED
    system = later.system
    assert np.all(limits_at(system, 0.0) == np.inf)
    assert limits_at(system, 1.0).tolist() == [2.0, *[np.inf] * 4]


def test_a_period_that_no_run_may_have_has_no_first_input():
    numbers = {**EQUAL, "appendage_mass": [8.0] * 5, "damping": [0.1] * 5}
    numbers["atan_coefficient"] = [0.0] * 5
    system = robot_system(robot_state(FIVE), numbers, limit=10.0, mode="implicit", integrator="rk4")
    assert np.all(np.isnan(first_input(system, clock(H, 10.0, 4.2, 4.2))))
    report = certify(system, clock(H, 10.0, 4.2, 4.2))
    assert report.to_dict()["inputs"]["largest"] is None
    assert "has none" in "\n".join(report_text(report))
    assert report.status == "not certified"


# -------------------------------------------------------------------------------------- faults


def test_late_sensors_and_agents_alone_are_refused():
    with pytest.raises(InvalidInput, match="inputs that all others had meanwhile"):
        held([SensorDelay(periods=4)], decentralised=True)
    held([SensorDelay(periods=4)])  # all together have them
    held(decentralised=True)


GRAPH = PartialInformation(graphs.ring(5), 5.0)


@pytest.mark.parametrize(
    ("fault", "law", "status", "text"),
    [
        (SensorDelay(periods=3), None, MET, "3 periods late"),
        (MessageLoss(probability=0.3), GRAPH, MET, "no fault pushes"),
        (MessageDelay(periods=2), GRAPH, MET, "no fault pushes"),
        (Silence(agents=(1,)), GRAPH, MET, "no fault pushes"),
        (Corruption(amplitude=1.0), GRAPH, MET, "no fault pushes"),
        (Push(force=1.0), None, FAILS, "no [margin]"),
        (Noise(amplitude=0.1), None, FAILS, "no [margin]"),
        (Bias(offset=-0.1), None, FAILS, "no [margin]"),
        (Saturation(limit=50.0), None, MET, "no fault pushes"),
    ],
)
def test_every_fault_against_the_promise(fault, law, status, text):
    found = condition(held([fault], law=law), "disturbances")
    assert found.status == status
    assert text in found.why


def test_late_sensors_alone_move_nothing():
    """What "met" rests on: with late sensors a run is the one without, to rounding."""
    runs = []
    for faults in ((), (SensorDelay(periods=3),)):
        system = held(faults).system
        runs.append(run_loop(system, H, 60)[0])
    np.testing.assert_allclose(runs[1], runs[0], rtol=0, atol=1e-7)


def test_faults_widen_the_box_of_the_estimates():
    faults = (
        Noise(agents=(0,), amplitude=0.25), Bias(agents=(0,), offset=-0.5),
        Corruption(amplitude=2.0), Corruption(agents=(3,), amplitude=1.0),
    )  # fmt: skip
    plain = Theorem(robot_system(robot_state(FIVE), law=GRAPH)).slopes.box
    system = robot_system(robot_state(FIVE), law=GRAPH, mode="sampled", faults=faults)
    lower, upper = Theorem(system).slopes.box
    np.testing.assert_allclose(plain[0] - lower, [3.75, 3, 3, 3, 3])
    np.testing.assert_allclose(upper - plain[1], [3.75, 3, 3, 3, 3])


def test_the_largest_push_counts_what_sensors_do_besides():
    agents, steps = robots(UNEQUAL), 5
    game = velocity_game(5, 3.0, 3.0)
    effect = influence(agents, H, "euler", steps)
    game = game.tightened(tightening(game, effect.push_gain * 2.0))
    each = []
    for faults in ((), (Noise(amplitude=0.01),), (SensorDelay(periods=2),)):
        system = System(
            "robots", game, agents, FullInformation(), 0.1, robot_state(np.full(5, 3.0)),
            mode="implicit", integrator="euler", faults=faults,
        )  # fmt: skip
        each.append(ZeroOrderHold(system, clock(H, 1.0, steps * H)).largest_push())
    assert each[0] == pytest.approx(2.0)
    assert 0.0 < each[1] < 2.0
    assert 0.0 < each[2] < 1.0


# ------------------------------------------------------------------------------------- accuracy


def test_periods_that_are_not_accurate_are_excepted():
    system = held().system
    report = certify(system, clock(H))
    assert report.status == "certified at control instants"
    assert "not_accurate" in report.guaranteed[0]
    loop = system.closed_loop(clock(H))
    loop.advance(1, 20)
    rows = loop.finish()
    monitor = loop.monitor.copy()
    told = []
    for unsolved in (0.0, 3.0):
        monitor.unsolved, monitor.unsolved_time = unsolved, 0.07
        y = rows.state[:, :, system.agents.kind.OUTPUT]
        found = certify_run(
            system, np.array([0.2]), y, rows.input, monitor, tolerance=1e-3, duration=0.2,
            wall_time=0.0, interrupted=False, intervened=False,
        )  # fmt: skip
        solutions = found.of_modes["implicit"]["solutions"]
        assert found.of_modes["implicit"]["covered"] == solutions - unsolved
        told.append(summary(found.to_dict())["held inputs"])
    assert "promised" not in told[0]
    assert "3 not accurate, at whose periods' ends nothing is promised (first at 0.07 s)" in told[1]


def test_the_law_that_acts_at_estimates_has_no_promise():
    law = FullyDistributed(graphs.ring(5), 0.1, 1.0)
    assert condition(held(law=law), "law").status == FAILS
