"""What is certified of systems and why, and how reports and the command tell it."""

import json
from dataclasses import replace

import numpy as np
import pytest
from builders import (
    EQUAL,
    FIVE,
    distributed,
    integrators,
    robot_state,
    robot_system,
)
from theory_systems import (
    STEP,
    coupled,
    osnr,
    partial_robots,
)
from typer.testing import CliRunner

from gne_mj import graph as graphs
from gne_mj.cli import app
from gne_mj.controllers import FullInformation, FullyDistributed
from gne_mj.errors import InvalidInput
from gne_mj.theory import Theorem, certify, report_text


def status(system, label):
    (found,) = (a for a in Theorem(system).assumptions if a.label == label)
    return found.status


def test_the_papers_first_experiment_is_certified():
    theorem = Theorem(robot_system(robot_state(FIVE), engine="mujoco"))
    assert theorem.status == "certified"
    assert theorem.lyapunov
    assert [a.label for a in theorem.assumptions] == [
        "asmp:cost", "asmp:pseudo(a)", "asmp:nonlinearPlant",
    ]  # fmt: skip
    assert "10 affine constraints" in theorem.assumptions[0].why


def test_the_papers_second_experiment_is_certified_for_small_epsilon():
    theorem = Theorem(osnr(distributed(), integrator="rosenbrock"))
    assert theorem.status == "certified for small epsilon"
    assert not theorem.lyapunov
    assert all(a.status == "met" for a in theorem.assumptions)
    assert theorem.gain.least == 0


@pytest.mark.parametrize(
    ("options", "certified"),
    [({"mode": "sampled"}, False), ({"integrator": "euler"}, False), ({}, True)],
)
def test_theorems_are_in_continuous_time(options, certified):
    theorem = Theorem(robot_system(robot_state(FIVE), **options))
    assert theorem.obstacles == ()
    assert theorem.lyapunov is certified
    assert (theorem.status == "certified") is certified


def test_partial_information_needs_a_gain():
    assert Theorem(partial_robots(3.0)).status == "certified"
    weak = Theorem(partial_robots(1.0))
    assert weak.status == "not certified"
    assert not weak.lyapunov
    assert "coupling gain" in weak.obstacles[0]


def test_robots_are_not_certified_under_the_distributed_law():
    law = FullyDistributed(graphs.ring(5), 0.001, 1.0)
    theorem = Theorem(robot_system(robot_state(FIVE), law=law))
    assert theorem.status == "not certified"
    assert status(theorem.system, "asmp:OSSPassive") == "not met"


def test_springs_that_push_are_not_passive():
    numbers = {**EQUAL, "stiffness": [1.0, 1.0, -2.0, 1.0, 1.0]}
    theorem = Theorem(robot_system(robot_state(FIVE), numbers))
    assert status(theorem.system, "asmp:nonlinearPlant") == "not met"
    assert not theorem.lyapunov


def test_sampled_constants_do_not_certify_a_run():
    system = osnr(FullInformation())
    assert Theorem(system).lyapunov
    unknown = replace(system, game=replace(system.game, jacobian_bounds=None))
    assert status(unknown, "asmp:pseudo(a)") == "unknown"
    assert not Theorem(unknown).lyapunov


def test_a_law_of_ones_own_is_covered_by_no_theorem():
    class Own(FullInformation):
        information = "custom"

    theorem = Theorem(robot_system(robot_state(FIVE), law=Own()))
    assert theorem.name is None
    assert theorem.status == "not certified"
    assert not theorem.lyapunov
    assert "\n".join(report_text(certify(theorem.system, STEP))).count("nothing") == 1


def test_a_constraint_that_is_not_convex_is_found():
    system = coupled(0.3)
    (found,) = [a for a in Theorem(system).assumptions if a.label == "asmp:cost"]
    assert found.status == "not met"
    assert "constraint 'product' is not convex" in found.why
    assert not Theorem(system).lyapunov


def test_estimates_widen_the_box():
    y = np.array(FIVE)
    estimate = np.tile(y, (5, 1))
    estimate[0, 4] = 100.0
    estimate[2, 2] = 500.0  # an own block, which is not an estimate
    system = replace(partial_robots(3.0), memory=estimate.ravel())
    box = Theorem(system).slopes.box
    assert box[1][4] == 100.0
    assert np.array_equal(np.delete(box[1], 4), np.delete(system.game.box[1], 4))
    start = certify(system, STEP).start
    assert start["estimates"]["largest_distance_from_actions"] == 98.0
    assert start["margin"] == pytest.approx(5.0)


def test_estimates_of_the_distributed_law_start_in_a_ball_inside():
    """The total power's plane is 0.5 / sqrt(10) = 0.158 mW away from 0.2 mW in each channel."""
    law = distributed()
    y = np.full(10, 0.2)
    for spread, expected in ((0.0, "met"), (0.15, "met"), (0.17, "unknown")):
        estimate = np.tile(y, (10, 1))
        estimate[0, 1] += spread
        system = replace(osnr(law), memory=law.initial_memory(y, estimate))
        assert status(system, "lemma:centreInv, start") == expected
    assert certify(system, STEP).start["estimates"]["margin"] == pytest.approx(0.2)


@pytest.mark.parametrize(
    "system",
    [
        robot_system(robot_state(FIVE)),
        partial_robots(1.0, mode="sampled"),
        partial_robots(9.0, "complete"),
        osnr(distributed()),
        osnr(FullInformation(), integrators(10)),
        coupled(0.3),
    ],
    ids=["full", "sampled", "partial", "distributed", "integrators", "own game"],
)
def test_reports_survive_json_and_become_words(system):
    report = certify(system, STEP)
    document = report.to_dict()
    assert json.loads(json.dumps(document, allow_nan=False)) == document
    text = report_text(report)
    assert text[0].startswith(f"\n{system.name}: ")
    assert any(line.split() == ["verdict", *report.status.split()] for line in text)
    for heading in ("guaranteed", "only measured", "not certified", "mu"):
        assert any(line.strip().startswith(heading) for line in text), heading


def gne(*arguments):
    return CliRunner().invoke(app, ["certify", *arguments])


def test_the_command_tells_the_papers_authors():
    done = gne("paper")
    assert done.exit_code == 0
    for said in (
        "0.2679492 (exact)", "3.837972 (exact)", "2.828427 (exact)", "lambda_2 = 2.38907",
        "0.1464331 (bounded", "any k > 0", "certified, sufficient",
        "the paper's definition has mu/2",
        "c lambda_2 > 32.6848 (printed) or 44.2923 (rigorous)", "unweighted graphs reach 5",
        "on the complete graph c > 1.38835 (exact form)",
    ):  # fmt: skip
        assert said in done.stdout, said


def test_the_command_prints_json():
    done = gne("paper", "--json")
    document = json.loads(done.stdout)
    assert set(document) == {"robots", "channels"}
    assert document["robots"]["status"] == "certified"
    assert document["robots"]["lyapunov_claimed"]
    epsilon = document["channels"]["epsilon"]
    assert (epsilon["given"], epsilon["search"]) == (0.01, None)
    assert 1e-4 < epsilon["star"] < 0.0119, "what trials find"


@pytest.mark.slow
def test_the_command_searches_epsilon():
    done = gne(
        "paper", "--search-epsilon", "--json", "--set", "simulation.duration=0.1",
        "--set", "channels.controller.gain=1.0",
    )  # fmt: skip
    search = json.loads(done.stdout)["channels"]["epsilon"]["search"]
    assert search["inside"] < search["outside"]
    assert done.stderr == ""  # no progress where there is no terminal


def test_the_command_refuses_a_search_without_an_epsilon():
    done = gne("velocity-sync", "--search-epsilon")
    assert isinstance(done.exception, InvalidInput)
