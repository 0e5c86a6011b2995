"""What is told, promised and refused of agents that keep apart."""

import numpy as np
import pytest
from batch_plans import all_chunks
from separation_fleets import MODES, swap, system_of

from gne_mj import kept_apart
from gne_mj.batches.plan import make_plan
from gne_mj.batches.sweep import Sweep
from gne_mj.environment import load_environment
from gne_mj.errors import InfeasibleStart, InvalidInput
from gne_mj.exit_map import Grid, exit_map
from gne_mj.scenario import load_scenario
from gne_mj.separation import Separation
from gne_mj.summary import summary
from gne_mj.theory import certify


def pushed(size, **changes):
    """Two robots next to each other, one of which is pushed at the other."""
    push = {"type": "push", "agents": [1], "force": size, "axis": 1, "start": 0.1}
    pair = {"game__desired_place": [[-0.5, 0], [0.5, 0]], "agents__count": 2}
    return swap(
        **pair, initial__action=[[-0.5, 0], [0.5, 0]], simulation__duration=1.0, faults=[push],
        **changes,
    )  # fmt: skip


def test_agents_that_are_pushed_too_near_end_the_run():
    run = pushed(200.0).simulation_object().run()
    assert run.status == "too_near"
    report = run.reports["robots"]
    assert "agents 1 and 2" in report["message"]
    assert report["separation"]["too_near"] in (0, 1)
    assert report["exit"]["agents"] == [1, 2]
    assert report["exit"]["constraint"] is None
    assert "separation" in summary(report)


@pytest.mark.slow
def test_a_deadlock_is_told_with_the_pair_that_holds():
    """Two robots head on whose half-planes do not turn."""
    head_on = {
        "game__desired_place": [[2, 0], [-2, 0]], "agents__count": 2, "separation__turn": 0.0,
        "initial__action": [[-2, 0], [2, 0]], "agents__appendage_mass": 0.1,
    }  # fmt: skip
    run = swap(**head_on).simulation_object().run()
    assert run.status == "completed"
    report = run.reports["robots"]
    told = "at rest, away from equilibrium: held by the separation of agents 1 and 2"
    assert told in report["message"]
    assert report["separation"]["held_by"] == [[1, 2]]
    assert swap(**{**head_on, "separation__turn": 0.3}).simulation_object().run().status == (
        "converged"
    )


@pytest.mark.parametrize("held", [False, True])
def test_agents_that_something_else_holds_are_not_told_as_held(held):
    """Robots far from each other, one of which is pushed off its place all the time; a deadlock."""
    place, push = (2, {}) if held else (-2, {"type": "push", "agents": [1], "force": 0.5})
    scenario = swap(
        agents__count=2, game__desired_place=[[place, 0], [-place, 0]], separation__turn=0.0,
        initial__action=[[-2, 0], [2, 0]], agents__appendage_mass=0.1,
        faults=[push] if push else [],
    )  # fmt: skip
    run = scenario.simulation_object().run()
    assert run.status == "completed"
    assert bool(run.reports["robots"]["separation"]["held_by"]) is held
    assert all_chunks(make_plan(scenario, starts=0), 1)["held"][1].tolist() == [float(held)]


PARTIAL = {"information": "partial", "graph": "ring", "mode": "implicit"}


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"controller__mode": "sampled"}, r"separation: .*'sampled'.*'continuous' or 'implicit'"),
        ({"controller__decentralised": True}, r"separation: .*full and partial"),
        (
            {"controller": {"information": "distributed", "graph": "ring", "mode": "implicit",
                            "epsilon": 0.1, "gain": 1.0}},
            r"separation: .*full and partial",
        ),
        ({"faults": [{"type": "noise", "amplitude": 0.1}]}, r"separation: .*sensors"),
        ({"margin": {"push": 0.1}}, r"separation: .*margin"),
        ({"separation__reach": 0.5}, r"separation\.reach: .*more than the distance, 0\.6 m"),
        ({"separation": {"distance": 0.6, "gap": 1.0}}, r"gap"),
    ],
)  # fmt: skip
def test_what_it_is_not_for_is_refused(changes, words):
    with pytest.raises(InvalidInput, match=words):
        system_of(**changes)


def test_agents_on_a_lane_and_those_of_velocities_are_refused():
    for name in ("platoon", "planar-sync"):
        with pytest.raises(InvalidInput, match=r"separation: .*in the plane or in space"):
            load_scenario(name, {"separation": {"distance": 0.1}}).system_objects()


def test_a_start_too_near_names_the_agents():
    start = swap().systems["robots"].initial.action
    near = [list(place) for place in start]
    near[3] = [start[2][0] + 0.5, start[2][1]]
    with pytest.raises(InfeasibleStart, match="separation of agents 3 and 4"):
        system_of(initial__action=near)
    ahead = [list(place) for place in start]
    ahead[0], ahead[4] = ahead[4], ahead[0]  # outputs run past each other
    with pytest.raises(InfeasibleStart, match="separation of agents"):
        system_of(initial={"action": ahead, "position": start})


def test_certificates_promise_safety_and_no_arrival():
    scenario = swap()
    ticks = scenario.clock()
    found = certify(scenario.system_objects()[0], ticks)
    kept = "the positions of any two agents are at least 0.6 m apart"
    assert any(kept in text and "every integration step" in text for text in found.guaranteed)
    assert any("that agents arrive" in text for text in found.not_certified)
    assert not found.lyapunov_claimed
    assert "separation" in str(found)
    found = certify(system_of(**MODES["continuous"]), ticks)
    whole = "in continuous time every shared constraint holds for all time"
    assert found.guaranteed == [whole, f"{kept} in continuous time"]
    assert not found.lyapunov_claimed
    assert not any("tends to" in text for text in found.guaranteed)
    for changes in ({"agents__local_damping": 0.1, **MODES["continuous"]}, MODES["euler"],
                    {"plant__integrator": "rk4"}, {"agents__input_limit": 1.0}):  # fmt: skip
        found = certify(system_of(**changes), ticks)
        assert not found.separation["promised"]
        assert not any(kept in text for text in found.guaranteed)
        assert any("that agents keep 0.6 m apart" in text for text in found.not_certified)


def test_batches_draw_starts_that_are_apart_and_keep_distances():
    scenario = swap(simulation__duration=0.5)
    plan = make_plan(scenario, sweeps=[Sweep("separation.distance", (0.5, 0.6))], starts=3, seed=4)
    rows = all_chunks(plan, 1)
    least = rows["least_distance"][1]
    assert np.all((least >= np.repeat([0.5, 0.6], 3)) | np.isnan(least))
    assert np.all(rows["too_near"][1] == 0)
    for run in range(plan.runs):
        system = plan.alone(run).system_objects()[0]
        assert np.array_equal(system.start, system.start_positions)


def test_maps_and_environments_say_why_they_are_none():
    system = system_of()
    with pytest.raises(InvalidInput, match=r"system\.separation: .*gne-mj batch"):
        exit_map(system, 0.01, Grid((0.01,), (0.5,)))
    with pytest.raises(InvalidInput, match=r"systems\.robots\.separation: .*environment"):
        load_environment("swap")


def test_numbers_that_make_no_sense_are_refused():
    for numbers in ((0.0, 1.0, 0.1), (1.0, 1.0, 0.1), (1.0, 2.0, 2.0), (np.nan, 2.0, 0.1)):
        with pytest.raises(InvalidInput):
            Separation(*numbers)


def test_sentences_name_the_first_pairs_and_count_the_rest():
    pairs = [(0, k) for k in range(1, 8)]
    assert kept_apart.pairs_text(pairs).endswith("agents 1 and 6 and 2 pairs more")
