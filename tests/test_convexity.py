"""What is said of convexity and monotonicity, against second derivatives worked out by hand."""

import math
import re
from dataclasses import replace

import numpy as np
import own_games
import pytest
from builders import FIVE, V0, clock, integrators, osnr_system, pi_cascades, robot_state
from builders import robot_system as robots_of
from own_games import boxed, plain_game, quadratic, ring

from gne_mj import graph as graphs
from gne_mj.controllers import FullInformation, PartialInformation
from gne_mj.games import osnr_game, ten_channels, velocity_game
from gne_mj.system import System
from gne_mj.theory import Slopes, Theorem, certify, report_text
from gne_mj.theory.constants import told
from gne_mj.theory.convexity import convex_constraints, counterexample

STEP = clock(0.01, 1.0, 0.1)


def of(game, start, law=None, **options):
    law = law or FullInformation()
    return own_games.system(game, integrators(game.actions), law, start, **options)


def assumption(system, label):
    (found,) = [a for a in Theorem(system).assumptions if a.label == label]
    return found


def condition(system, label):
    (found,) = [c for c in certify(system, STEP).held["conditions"] if c["label"] == label]
    return found


def profile_of(sentence):
    return np.array([float(v) for v in re.search(r"y = \[([^\]]*)\]", sentence)[1].split(",")])


# --------------------------------------------------------------------------------- constraints


@pytest.mark.parametrize("decentralised", [False, True])
def test_a_ring_is_not_certified_at_control_instants(decentralised):
    """0.9 - |y|^2 has the second derivative -2 everywhere."""
    system = of(ring(), [0.97, 0.05], mode="implicit", decentralised=decentralised)
    report = certify(system, STEP)
    assert report.status == "not certified"
    assert not report.held["promised"]
    found = condition(system, "convex constraints")
    assert found["status"] == "not met"
    assert "constraint 'inner' is not convex" in found["why"]
    assert "eigenvalue -2 " in found["why"]
    y = profile_of(found["why"])
    assert 0.9 - 1e-3 < y @ y < 1.0 + 1e-3  # to the digits shown
    assert assumption(system, "asmp:cost").why == found["why"]
    assert report.guaranteed == ["nothing"]


def test_declaring_it_does_not_make_it_convex():
    """What a game says is looked at, also of one that says it is tested."""
    game = ring(constraint_class="convex", tested=True)
    found = convex_constraints(of(game, [0.97, 0.05]))
    assert found.status == "not met"
    assert "'inner'" in found.why


def test_a_set_of_two_parts_is_seen_though_constraints_are_affine_inside():
    """g = 1 - |y| is affine wherever it is negative, and not convex."""
    functions = {
        "cost": lambda q, i, y: y[0] ** 2,
        "cost_gradient": lambda q, i, a, y: 2 * y[0],
        "constraint": lambda q, k, y: 1 - abs(y[0]) if k else y[0] ** 2 - 9,
        "constraint_gradient": lambda q, k, a, y: -np.sign(y[0]) if k else 2 * y[0],
        "constraint_hessian": lambda q, k, a, b, y: 0.0 if k else 2.0,
    }
    game = plain_game(functions, (1,), [[0]], [[0], [0]], box=(np.array([-3.0]), np.array([3.0])))
    found = counterexample(game, np.array([[2.0], [-1.5]]))
    assert found.constraint == 1
    assert found.eigenvalue is None
    assert found.profile[0] == pytest.approx(0.25)
    assert found.above == pytest.approx(0.75 - 0.5 * (-1.0 - 0.5))


def test_tested_games_meet_what_they_declare_and_others_only_assume_it():
    chain = robots_of(robot_state(FIVE))
    assert convex_constraints(chain).status == "met"
    assert assumption(chain, "asmp:cost").status == "met"
    own = replace(chain, game=replace(chain.game, tested=False))
    found = convex_constraints(own)
    assert found.status == "assumed"
    assert "declared to be bounds on gaps" in found.why
    assert "which is no proof" in found.why
    silent = replace(own, game=replace(velocity_game(5, V0, 3.0), tested=False, gap_bounds=None,
                     affine_constraints=None, constraint_class=None))  # fmt: skip
    assert convex_constraints(silent).status == "assumed"
    assert "declared" not in convex_constraints(silent).why


def test_units_of_a_constraint_do_not_decide():
    for scale in (1e-12, 1.0, 1e12):
        functions = {
            "cost": lambda q, i, y: y[i] ** 2,
            "cost_gradient": lambda q, i, a, y: 2 * y[i],
            "constraint": lambda q, k, y, s=scale: s * (y @ y - 1),
            "constraint_gradient": lambda q, k, a, y, s=scale: 2 * s * y[a],
        }
        game = plain_game(functions, (1, 1), [[0], [1]], [[0, 1]])
        system = of(game, [0.3, 0.2])
        assert convex_constraints(system).status == "assumed", scale
        assert assumption(system, "asmp:cost").status == "assumed", scale


# ---------------------------------------------------------------------------- own convexity, mu


def test_convex_costs_whose_f_is_not_monotone():
    """J_i = y_i^2 + 3 y_1 y_2: each convex in y_i; dF/dy = [[2, 3], [3, 2]] has -1."""
    system = of(quadratic([[2, 3], [3, 2]]), [0.3, 0.4])
    assert assumption(system, "asmp:cost").status == "assumed"  # the box is not declared
    assert "costs convex in own actions" in assumption(system, "asmp:cost").why
    assert assumption(system, "asmp:pseudo(a)").status == "not met"
    assert Theorem(system).slopes.mu.value == pytest.approx(-1.0)
    (obstacle,) = Theorem(system).obstacles
    assert obstacle.startswith("[asmp:pseudo(a)] not met")


def test_a_maximum_is_no_convex_cost():
    system = of(quadratic([[-2, 0], [0, 3]]), [0.3, 0.4])
    found = assumption(system, "asmp:cost")
    assert found.status == "not met"
    assert "J_1 is not convex in y_1" in found.why
    assert "-2" in found.why
    # an F that is not affine: cos 3 y has the second derivative -9 cos 3 y
    bent = of(boxed(lambda i, y: np.cos(3 * y[i]), lambda i, y: -3 * np.sin(3 * y[i]), 6.0),
              [2.0, 2.0])  # fmt: skip
    found = assumption(bent, "asmp:cost")
    assert found.status == "not met"
    i = int(re.search(r"J_(\d) is not convex", found.why)[1]) - 1
    value = float(re.search(r"eigenvalue (\S+)", found.why)[1])
    assert value == pytest.approx(-9 * np.cos(3 * profile_of(found.why)[i]), abs=0.05)


@pytest.mark.parametrize("scale", [1e-9, 1.0, 1e9])
@pytest.mark.parametrize("given", [True, False])
def test_a_merely_monotone_game(scale, given):
    """J_i = s (y_1 + y_2 - 2)^2: mu = 0, also where differences say 1e-10."""

    def second(i, y, weight, out):
        out += 2 * scale * weight

    game = boxed(
        lambda i, y: scale * (y[0] + y[1] - 2) ** 2, lambda i, y: 2 * scale * (y[0] + y[1] - 2),
        3.0, second=second if given else None, affine=True,
    )  # fmt: skip
    system = of(game, [0.5, 0.5])
    slopes = Theorem(system).slopes
    assert slopes.mu.value == 0.0
    assert slopes.label == "exact"
    assert slopes.merely_monotone
    assert not slopes.monotone
    assert not slopes.refuted
    found = assumption(system, "asmp:pseudo(a)")
    assert found.status == "not met"
    assert "mu = 0" in found.why
    assert "merely monotone: the equilibrium need not be unique" in found.why
    assert assumption(system, "asmp:cost").status == "assumed"
    assert "sampled profiles only" not in found.why


def pole(estimate, mode="implicit"):
    law = PartialInformation(graphs.printed(10), 1.0, 1000.0)
    system = osnr_system(pi_cascades(10), law, 0.2, mode=mode)
    memory = law.initial_memory(system.start, estimate)
    return replace(system, memory=memory)


def test_a_pole_among_the_estimates():
    """1 + c y_i / (n0 + sum Gamma y_j) is negative where others are taken for -3 mW."""
    system = pole(-3.0)
    for found in (assumption(system, "asmp:cost").__dict__,
                  condition(system, "costs convex in own actions")):  # fmt: skip
        assert found["status"] == "not met"
        assert "is not a number" in found["why"]
        assert "box that holds the estimates" in found["why"]
    assert certify(system, STEP).status == "not certified"
    inside = pole(0.1)
    assert assumption(inside, "asmp:cost").status == "met"
    assert condition(inside, "costs convex in own actions")["status"] == "met"


def test_a_function_that_fails_at_the_estimates():
    """J_i = y_i^2 + y_i log y_j, with Python's log, others being taken for -1."""
    game = boxed(
        lambda i, y: y[i] ** 2 + y[i] * math.log(y[1 - i]),
        lambda i, y: 2 * y[i] + math.log(y[1 - i]), 3.0,
        box=(np.zeros(2), np.full(2, 3.0)),
    )  # fmt: skip
    law = PartialInformation(graphs.complete(2), 9.0)
    for estimate, status in ((-1.0, "not met"), (0.5, "assumed")):
        start = np.array([1.0, 2.0])
        system = of(game, start, law, memory=law.initial_memory(start, estimate))
        found = assumption(system, "asmp:cost")
        assert found.status == status
        assert ("is not a number" in found.why) == (status == "not met")


def test_own_rows_hold_over_all_of_the_box_where_f_need_not_be_monotone():
    """d2J_i/dy_i^2 = b c^2 / R^2 > 0 wherever R > 0, whatever the crosstalk is."""
    p = ten_channels()
    p["system_matrix"] = (40.0 * np.array(p["system_matrix"])).tolist()
    game = osnr_game(**p)
    system = System("o", game, pi_cascades(10), FullInformation(), 0.1,
                    pi_cascades(10).equilibrium(np.full(10, 0.1)))  # fmt: skip
    assert not Theorem(system).slopes.monotone
    assert assumption(system, "asmp:cost").status == "met"


# --------------------------------------------------------------------------- how values are told


def test_how_constants_are_to_be_read():
    assert [told("mu", label) for label in ("exact", "bounded", "sampled")] == [
        "exact", "at least", "at most",
    ]  # fmt: skip
    assert [told("theta_1", label) for label in ("exact", "bounded", "sampled")] == [
        "exact", "at most", "at least",
    ]  # fmt: skip


def test_sampled_constants_are_told_as_what_they_are():
    """F = y + y^3: dF/dy = 1 + 3 y^2, from 1 to 13 over 0 <= y <= 2."""
    game = boxed(
        lambda i, y: 0.5 * y[i] ** 2 + 0.25 * y[i] ** 4, lambda i, y: y[i] + y[i] ** 3, 2.0
    )
    report = certify(of(game, [1.0, 1.5]), STEP)
    mu, theta = report.constants["mu"], report.constants["theta_1"]
    assert (mu["label"], mu["told"]) == ("sampled", "at most")
    assert 1.0 - 1e-6 <= mu["value"] < 2.0
    assert (theta["label"], theta["told"]) == ("sampled", "at least")
    assert 10.0 < theta["value"] <= 13.0 + 1e-6
    assert report.to_dict()["constants"]["c_lambda_2_needed"] == {"printed": None, "rigorous": None}
    text = "\n".join(report_text(report))
    assert "if partial" not in text
    assert re.search(r"mu +1[.\d]* \(sampled, at most\)", text)
    assert re.search(r"theta_1 +1\d[.\d]* \(sampled, at least\)", text)
    bounded = certify(osnr_system(integrators(10), FullInformation(), 0.1), STEP)
    assert bounded.constants["mu"]["told"] == "at least"
    assert "(bounded, at least; sampled 0.14" in "\n".join(report_text(bounded))


def test_bounds_that_samples_contradict_are_not_relied_upon():
    """Bounds of a game that says it is tested, a tenth too narrow."""
    game = osnr_game(**ten_channels())
    narrow = replace(game, jacobian_bounds=lambda box: tuple(
        bound * factor for bound, factor in zip(game.jacobian_bounds(box), (1.0, 0.5), strict=True)
    ))  # fmt: skip
    assert Slopes(game, game.box, np.full(10, 0.1), feasible=True).label == "bounded"
    assert Slopes(narrow, game.box, np.full(10, 0.1), feasible=True).label == "sampled"
