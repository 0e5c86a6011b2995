"""Runs that go on outside the set: what is noted, against closed forms; what is told of them."""

import numpy as np
import pytest
from builders import integrators
from numpy.testing import assert_allclose

import gne_mj as gm
from gne_mj.controllers import FullInformation
from gne_mj.controllers.plain_law import PlainLaw, PlainLawOutside
from gne_mj.epsilon import epsilon_at
from gne_mj.errors import InvalidInput
from gne_mj.expressions import game
from gne_mj.outside import parts_of_bounds
from gne_mj.simulation import Simulation
from gne_mj.system import Clock, System

WANTED, START, BOUND = 2.0, 0.0, 1.0
EXIT = np.log((WANTED - START) / (WANTED - BOUND))  # of y = WANTED (1 - exp(-t)), 0.693 s


def one(**given):
    """Agents that go to WANTED as exp(-t), the first one past BOUND at EXIT."""
    return game(
        2, lambda i, y, p: 0.5 * (y[i] - p.wanted[i]) ** 2,
        lambda y, p: [("bound", y[0] <= BOUND), ("apart", y[1] - y[0] <= 5.0)],
        wanted=[WANTED, 0.0],
    )  # fmt: skip


GAME = one()


def descent(game, rho, y, memory):
    return -game.pseudo_gradient(y)


def system(law=None, on_exit="continue", **given):
    state = integrators(2).equilibrium(np.array([START, 0.0]))
    law = PlainLawOutside(GAME, descent) if law is None else law
    return System("s", given.pop("game", GAME), integrators(2), law, 0.01, state,
                  on_exit=on_exit, **given)  # fmt: skip


def run(system, duration=3.0, step=0.001, period=0.001):
    return Simulation([system], Clock(duration, step, period, 0.01)).run().reports["s"]


@pytest.mark.parametrize("how", [{}, {"mode": "sampled"}, {"integrator": "tsit5"},
                                 {"integrator": "euler"}], ids=str)  # fmt: skip
def test_how_far_and_how_long_against_the_closed_form(how):
    """g = 1 - 2 exp(-t) after EXIT; its integral is t + 2 exp(-t)."""
    report = run(system(**how))
    seen, end = report["outside"], 3.0
    assert report["status"] == "went_outside"
    within = 0.002 if "tsit5" not in str(how) else 0.02  # rows are 0.01 s apart
    assert_allclose(seen["first"], EXIT, rtol=0, atol=within)
    assert_allclose(seen["duration"], end - EXIT, rtol=0, atol=within)
    integral = end - EXIT + WANTED * (np.exp(-end) - np.exp(-EXIT))
    assert_allclose(seen["integral"], integral, rtol=0, atol=5e-3)
    assert_allclose(seen["largest"], BOUND - WANTED * np.exp(-end), rtol=0, atol=2e-3)
    assert_allclose(seen["of_bound"], seen["largest"] / BOUND)
    assert (seen["exits"], seen["constraint"], seen["at_end"]) == (1, "bound", True)
    assert report["division"] is None or report["division"]["divided_steps"] == 0
    assert "outside the set for 2.3" in report["message"]
    assert "at its end" in report["message"]


def test_a_run_that_comes_back_and_one_that_is_cut_into_calls():
    """A square push carries the outputs out and lets them come back, twice."""
    law = PlainLawOutside(GAME, lambda game, rho, y, memory: -game.pseudo_gradient(y) * [0, 1])
    faults = (gm.push(1.0, agents=[1], profile="sine", period=4.0).build(),)
    made = system(law, faults=faults, game=GAME)
    clock = Clock(8.0, 0.001, 0.001, 0.01)
    whole = Simulation([made], clock).run()
    seen = whole.reports["s"]["outside"]
    # y = (2 / pi) (1 - cos(pi t / 2)) > 1 where cos(pi t / 2) < 1 - pi / 2
    first = 2 / np.pi * np.arccos(1 - np.pi / 2)
    assert seen["exits"] == 2
    assert not seen["at_end"]
    assert_allclose(seen["first"], first, rtol=0, atol=0.002)
    assert_allclose(seen["duration"], 2 * (4 - 2 * first), rtol=0, atol=0.005)
    assert_allclose(seen["until"], 8 - first, rtol=0, atol=0.002)
    parts = Simulation([made], clock)
    for steps in (1, 1500, 777, 2000):
        parts.advance(steps)
        parts.trajectory()
    assert parts.run().reports["s"]["outside"] == seen
    assert "back inside after 6." in str(whole)


def test_what_stops_all_the_same():
    stopped = run(system(on_exit="stop"))
    assert stopped["status"] == "left_feasible_set"
    assert stopped["outside"]["exits"] == 1
    assert stopped["outside"]["duration"] == 0.0
    law = PlainLaw(GAME, descent)  # which does not say that it acts outside
    report = run(system(law))
    assert report["status"] == "left_feasible_set"
    assert "certified until then, 0.69" in report["message"]
    inside = run(system(FullInformation()))
    assert inside["status"] == "converged"
    assert inside["outside"]["exits"] == 0


def test_a_margin_is_no_obstacle_for_a_law_that_acts_outside():
    tight = GAME.tightened(0.5)
    seen = run(system(PlainLawOutside(tight, descent), game=tight))
    assert seen["status"] == "went_outside"
    refused = run(system(PlainLaw(tight, descent), game=tight))
    assert refused["status"] == "estimate_left_feasible_set"


def test_what_is_refused():
    with pytest.raises(InvalidInput, match="on_exit: got 'carry on', but it must be 'stop' or"):
        system(on_exit="carry on")
    with pytest.raises(InvalidInput, match="this law acts outside too: leave it out"):
        system(mode="sampled", between="guarded")


def test_parts_of_bounds():
    g = np.array([[0.25, 0.0], [-1.0, -5.0]])
    assert_allclose(parts_of_bounds(GAME, g), [[0.25, 0.0], [-1.0, -1.0]])
    gaps = game(2, lambda i, y, p: y[i] ** 2, lambda y, p: [("gap", abs(y[0] - y[1]) <= 2.0)])
    assert_allclose(parts_of_bounds(gaps, np.array([[5.0]])), [[0.5]])  # a gap of 3
    signs = game(1, lambda i, y, p: y[i] ** 2, lower=0.0)
    assert np.all(np.isnan(parts_of_bounds(signs, np.array([[0.1]]))))


def test_batches_have_the_same_figures(tmp_path):
    law = gm.own_law(descent, acts_outside=True)
    scenario = gm.setup(GAME, {"simulation.on_exit": "continue"}, law=law, start=[0.0, 0.0],
                        duration=3.0, timestep=0.001, sample_period=0.01)  # fmt: skip
    runs = gm.batch(scenario, runs=0, out=tmp_path / "b")
    report = next(iter(gm.run(scenario).reports.values()))
    for name, key in (("largest_violation", "largest"), ("time_outside", "duration"),
                      ("violation_integral", "integral"), ("exits", "exits")):  # fmt: skip
        assert float(runs[name][0]) == report["outside"][key]
    assert str(runs["status"].values[0]) == "went_outside"
    settled = report["equilibrium"]["settling_time_to_variational"]
    assert settled is None
    assert np.isnan(float(runs["settling_time_to_variational"][0]))


def test_what_agents_could_gain_where_a_run_ends():
    """In closed form: within bounds, and beyond one, which is then as wide as that."""

    def cost(i, y, p):
        return 0.5 * (y[i] - p.wanted[i]) ** 2

    def constraints(y, p):
        for i in range(2):
            yield f"bound {i + 1}", abs(y[i]) <= 1.0

    bounded = game(2, cost, constraints, wanted=[2.0, 0.3])
    assert_allclose(epsilon_at(bounded, np.array([0.5, 0.0])), 0.5 * (1.5**2 - 1.0), rtol=1e-6)
    assert_allclose(epsilon_at(bounded, np.array([1.2, 0.0])), 0.5 * 0.3**2, rtol=1e-6)
    assert_allclose(epsilon_at(bounded, np.array([1.0, 0.3])), 0.0, atol=1e-6)


@pytest.mark.parametrize("weight", [0.0, 1e-3])
def test_a_gain_that_cannot_be_computed_is_not_known(weight):
    """Within wider bounds is a place at which the cost's logarithm has no value."""

    def cost(i, y, p):
        return y[0] - p.weight * np.log(y[0] + 1.2) if i == 0 else 0.5 * y[1] ** 2

    bounded = game(2, cost, lambda y, p: [(y[0] - y[1]) ** 2 <= 1.0, y[1] >= 0.0], weight=weight)
    assert epsilon_at(bounded, np.array([0.5, 0.0])) == pytest.approx(1.5, rel=2e-3)
    assert epsilon_at(bounded, np.array([2.0, 0.0])) is None
