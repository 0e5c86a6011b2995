"""What certify's report says of each number, sentence by sentence."""

from importlib import import_module

import pytest

from gne_mj.summary import bounds_text

words = import_module("gne_mj.theory.report_text")  # the function of this name hides the module


def constants(**changes):
    known = {"value": 2.5, "label": "exact", "told": "exact", "sampled": None, "convention": "sym"}
    given = {
        "mu": known, "theta_1": known, "theta_2": known, "domain": "everywhere", "box": None,
        "convention": "sym", "under_partial_information": None,
        "c_lambda_2_needed": {"printed": 3.0, "rigorous": 4.0},
    }  # fmt: skip
    return {"constants": given | changes, "system": {"agents": "4"}}


def test_constants_say_how_they_are_known():
    at_least = {"value": 1.25, "label": "bound", "told": "at least", "sampled": 1.5}
    at_most = {"value": 3.0, "label": "bound", "told": "at most", "sampled": 2.75}
    sampled = {"value": None, "label": "sampled", "told": "at least", "sampled": 0.5}
    given = constants(mu=at_least, theta_1=at_most, theta_2=sampled)
    assert list(words._constants(given)) == [
        ("mu", "1.25 (bound, at least; sampled 1.5, at most), sym"),
        ("theta_1", "3 (bound, at most; sampled 2.75, at least)"),
        ("theta_2", "infinite or unknown (sampled, at least)"),
        ("domain", "everywhere: F is affine"),
    ]
    unsampled = {**at_least, "sampled": None}
    assert dict(words._constants(constants(mu=unsampled)))["mu"] == "1.25 (bound, at least), sym"
    assert dict(words._constants(constants()))["theta_1"] == "2.5 (exact)"


def test_constants_say_what_partial_information_would_need():
    instead = {"graph": "own", "quadratic": None, "label": "printed"}
    rows = dict(words._constants(constants(under_partial_information=instead)))
    needed = (
        "partial information would need c lambda_2 > 3 (printed) or 4 (rigorous), where unweighted"
        " graphs reach 4"
    )
    assert rows["if partial"] == needed
    for graph, name in (("own", "its own graph"), ("complete", "the complete graph")):
        quadratic = {"graph": graph, "quadratic": {"least": 0.75}, "label": "block"}
        rows = dict(words._constants(constants(under_partial_information=quadratic)))
        assert rows["if partial"] == f"{needed}; on {name} c > 0.75 (block form) is enough"
    unknown = {"printed": None, "rigorous": None}
    given = constants(under_partial_information=instead, c_lambda_2_needed=unknown)
    assert "if partial" not in dict(words._constants(given))


@pytest.mark.parametrize(
    ("domain", "box", "text"),
    [
        ("everywhere", None, "everywhere: F is affine"),
        ("near", None, "near; no bounds of the actions are known"),
        (
            "the box",
            [[-1.0, -2.0], [3.0, 1.0]],
            "a box within [-2, 3] that holds the feasible set and the estimates' starts",
        ),
        ("the set", [[-1.0], [3.0]], "a box within [-1, 3] that holds the feasible set"),
    ],
)
def test_constants_say_where_they_hold(domain, box, text):
    assert words._domain({"domain": domain, "box": box}) == text


def test_a_coupling_gain_says_which_conditions_it_meets():
    holding = {"least": 2.0, "holds": True, "certified": True}
    doubtful = {"least": None, "holds": True, "certified": False}
    given = {
        "gain": 5.0, "time_constant": 0.2, "label": "printed",
        "printed": {"least": 1.5, "holds": False, "certified": False},
        "rigorous": doubtful, "quadratic": holding,
    }  # fmt: skip
    printed = "mu (c lambda_2 - theta_2) > theta_2^2; no proof, since theta_1 is missing"
    rigorous = "4 mu (c lambda_2 - theta_2) > (theta_1 + theta_2)^2"
    quadratic = "sufficient for V to fall: -dV/dt's quadratic form positive definite (printed)"
    assert list(words._coupling(given)) == [
        ("coupling", "c = 5, tau = 0.2 s"),
        ("  printed", f"does not hold, needs c > 1.5: {printed}"),
        (
            "  rigorous",
            f"holds with constants that are not certain, needs c > infinite or unknown: {rigorous}",
        ),
        ("  quadratic", f"holds, needs c > 2: {quadratic}"),
    ]
    rows = dict(words._coupling({**given, "quadratic": None}))
    assert rows["  quadratic"] == f"not computed: {quadratic}"


@pytest.mark.parametrize(
    ("least", "rate", "text"),
    [
        (None, None, "k = 0.5; no k* can be given"),
        (0, None, "k = 0.5; any k > 0 meets k >= beta/mu"),
        (
            0.25,
            0.125,
            "k = 0.5; any k > 0.25 meets k >= beta/mu. As epsilon -> 0, V falls at least by"
            " exp(-r t) with r = 0.125 /s (k: r is 0.5: 0.125, 1: 0.0625); alpha = 2 with"
            " beta = k mu",
        ),
    ],
)
def test_a_gain_says_what_it_must_be(least, rate, text):
    rates = [(0.5, 0.125), (1.0, 0.0625)]
    gain = {"gain": 0.5, "least": least, "decay_rate": rate, "rates": rates, "alpha": 2.0}
    assert words._gain(gain) == text


def test_epsilon_says_what_was_tried():
    none = {"given": 0.05, "star": None, "no_star": None, "search": None}
    assert words._epsilon(none) == "0.05 s given (--search-epsilon tries)"
    assert words._epsilon(none | {"no_star": "y* was not found"}) == (
        "0.05 s given; no epsilon* is computed: y* was not found (--search-epsilon tries)"
    )
    star = {
        "star": 0.0025, "label": "certified, sufficient", "fast_weight": 3.0,
        "kept": {"floor": [0.5, 0.25], "constraint": "gap"},
    }  # fmt: skip
    assert words._epsilon(none | star) == (
        "0.05 s given; epsilon* = 0.0025 s (certified, sufficient): for all up to it"
        " W = V + 3 V_fast falls, and no slack falls below 0.25 (gap) (--search-epsilon tries)"
    )
    search = {"inside": None, "outside": 0.0125, "trials": [1], "note": ""}
    end = "values between and beyond those tried are not known"
    assert words._epsilon(none | {"search": search}) == (
        "0.05 s given. By 1 trial run from this start: none stayed inside, 0.0125 s does not;"
        f" {end}"
    )
    search = {"inside": 0.01, "outside": None, "trials": [1, 2], "note": "stopped"}
    assert words._epsilon(none | {"search": search}) == (
        f"0.05 s given. By 2 trial runs from this start: 0.01 s stays inside; {end} (stopped)"
    )


@pytest.mark.parametrize(
    ("estimates", "text"),
    [
        ({"margin": 0.5}, "all inside, least margin 0.5 (agent 2, gap)"),
        ({"margin": 0.0}, "not all inside, least margin 0 (agent 2, gap)"),
        ({"largest_distance_from_actions": 0.0}, "they equal y(0)"),
        (
            {"largest_distance_from_actions": 0.75},
            "at most 0.75 from y(0); under partial information they need not lie inside",
        ),
    ],
)
def test_estimates_say_where_they_start(estimates, text):
    given = estimates | ({"agent": 2, "constraint": "gap"} if "margin" in estimates else {})
    assert words._estimates(given) == text


def test_inputs_say_what_the_first_one_asks_for():
    given = {
        "of": "the first input", "largest": None, "agent": 3, "exceeded": None,
        "largest_factor": None,
    }  # fmt: skip
    assert words._inputs(given) == "the first input has none"
    given["largest"] = 12.5
    met = "limits of at least 12.5 are not met there, at y* none is"
    asks = "the first input asks for up to 12.5 (agent 3)"
    assert words._inputs(given) == f"{asks}; {met}"
    given["largest_factor"] = 0.5
    assert words._inputs(given) == f"{asks}, up to 0.5 of a limit; {met}"
    given["exceeded"] = "agent 3 is at its limit"
    assert words._inputs(given) == f"agent 3 is at its limit; {met}"


def periods(held=None, penalised=0.1, **changes):
    none = {"start": None, "equilibrium": None}
    given = {
        "push": none, "linear": none, "control_period": None, "timestep": 0.001,
        "largest_timestep_for_estimates": None,
    }  # fmt: skip
    return {
        "periods": given | changes, "held": held, "equilibrium": {"penalised": penalised},
        "system": {"integrator": "rk4"},
    }  # fmt: skip


def test_periods_say_what_inputs_that_are_held_need():
    assert words._periods(periods()) == (
        "held inputs need periods below (heuristics): no rule known for these agents"
    )
    given = periods(
        push={"start": 0.25, "equilibrium": None}, linear={"start": 0.5, "equilibrium": 0.75},
        control_period=0.02, largest_timestep_for_estimates=0.005, held={}, penalised=None,
    )  # fmt: skip
    assert words._periods(given) == (
        "an explicit law would need periods below (heuristics): one push 0.25 s at the start;"
        " linearisation 0.5 s at the start, 0.75 s at y*; y* was not found; the period here is"
        " 0.02 s. Estimates under rk4: steps up to 0.005 s, here 0.001 s"
    )


@pytest.mark.parametrize(
    ("start", "there", "ends", "text"),
    [
        (1, 4, None, "whole at the start, divided into about 4 at y*"),
        (
            None,
            1,
            "step_too_small",
            "would have to be divided more finely than into 1024 at the start, whole at y*",
        ),
        (2, 1, "diverged", "the run ends in the first, diverged, at the start, whole at y*"),
    ],
)
def test_steps_say_how_they_are_divided(start, there, ends, text):
    division = {"start": start, "equilibrium": there, "ends": ends, "finest": 1024}
    assert words._division(division) == text


HELD = {
    "conditions": [], "disturbance": None, "largest_push": None, "push_search": None,
    "period_search": None, "observer": None,
}  # fmt: skip


def test_held_inputs_say_what_a_margin_covers():
    condition = {"label": "B", "status": "met", "why": "known"}
    bound = {"push": [1.0, 2.0], "noise": [0.25, 0.125], "delay": 3}
    given = HELD | {
        "conditions": [condition], "disturbance": bound, "prediction_error": [0.5, 0.75],
        "tightening": [0.0, 0.375], "largest_push": 2.5,
    }  # fmt: skip
    assert list(words._held(given)) == [
        ("[B]", "met: known"),
        (
            "margin",
            "covers a push of 2, noise of 0.25 and a delay of 3 periods: outputs off by at most"
            " 0.75, constraints tightened by up to 0.375",
        ),
        ("largest push", "2.5 on every agent at once is covered"),
    ]
    assert list(words._held(HELD | {"largest_push": 0.0})) == [
        ("largest push", "none is covered without a margin")
    ]
    assert list(words._held(HELD)) == []


@pytest.mark.parametrize(
    ("least", "covered", "text"),
    [
        (0.0, None, "the run leaves the set without any push"),
        (None, 1.0, "none up to 8 leaves the set"),
        (4.0, 1.0, "4 leaves the set (all one way); the certified push is 25% of it"),
        (4.0, 0.0, "4 leaves the set (all one way)"),
    ],
)
def test_a_search_for_pushes_says_what_it_found(least, covered, text):
    search = {
        "smallest_breaking_push": least, "largest_tried": 8.0, "pattern": "all one way", "runs": 9
    }  # fmt: skip
    rows = dict(words._held(HELD | {"push_search": search, "largest_push": covered}))
    assert rows["adversarial search"] == f"{text}, by 9 runs from this start"


@pytest.mark.parametrize(
    ("inside", "outside", "text"),
    [
        (None, 0.5, "none tried stays inside between the instants too, with 0.5 s it does not"),
        (0.25, None, "up to 0.25 s the run stays inside between the instants too"),
    ],
)
def test_a_search_for_periods_says_what_it_found(inside, outside, text):
    search = {"inside": inside, "outside": outside, "note": "by halves"}
    rows = dict(words._held(HELD | {"period_search": search}))
    assert rows == {"period, by trial": f"{text} (by halves)"}


@pytest.mark.parametrize(
    ("changes", "text"),
    [
        ({"refuted": "F is not monotone"}, "no bound, since the lemma does not hold: F is not"),
        ({"bound": None}, "no bound is known, since y* was not found"),
        ({}, "at most 0.5 = p rho, and 0.25 by each agent's own constraints"),
        ({"of_margin": 0.125}, "at most 0.5 = p rho + 0.125 for the margin, and 0.25 by"),
    ],
)
def test_bounds_on_epsilon_are_told(changes, text):
    bounds = {"refuted": None, "bound": 0.5, "of_margin": 0.0, "largest_own_bound": 0.25}
    assert bounds_text(bounds | changes).startswith(text)
