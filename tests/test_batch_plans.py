"""Sweeps and plans: what is run, and what is refused before anything is."""

import datetime
import json

import numpy as np
import pytest
from batch_plans import (
    ODE,
    all_chunks,
)
from hypothesis import given
from hypothesis import strategies as st

from gne_mj.batches import (
    Plan,
    Sweep,
    make_plan,
    parse_sweep,
    run_batch,
)
from gne_mj.errors import InvalidInput


def test_a_sweep_may_make_the_scenarios_own_start_infeasible():
    bounds = Sweep("game.gap_bound", (0.4, 3.0))
    with_random = make_plan("velocity-sync", ODE, sweeps=[bounds], starts=4)
    assert set(all_chunks(with_random, 1)["status"][1]) == {"completed"}
    own = make_plan("velocity-sync", ODE, sweeps=[bounds])
    found = all_chunks(own, 1)
    assert found["status"][1].tolist() == ["infeasible_start", "completed"]
    assert np.isnan(found["least_margin"][1][0])


@pytest.mark.parametrize(
    ("text", "values"),
    [
        ("barrier.rho=0.01:1:3log", (0.01, 0.1, 1.0)),
        ("barrier.rho=0:1:5", (0.0, 0.25, 0.5, 0.75, 1.0)),
        ("controller.coupling=1,2,5", (1, 2, 5)),
        ("controller.graph=ring,line", ("ring", "line")),
        ("game.gap_bound=[1.0, 2.0],[3.0, 4.0]", ([1.0, 2.0], [3.0, 4.0])),
        ("plant.engine=ode", ("ode",)),
    ],
)
def test_a_sweep_is_read(text, values):
    sweep = parse_sweep(text)
    assert sweep.key == text.partition("=")[0]
    assert sweep.values == values


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("barrier.rho", "it must read KEY"),
        ("barrier.rho=", "it must read KEY"),
        ("barrier.rho=0:1:5log", "must be positive"),
        ("barrier.rho=0:1:1", "at least two"),
        ("barrier.rho=1,1", "once only"),
    ],
)
def test_a_sweep_that_makes_no_sense_is_refused(text, words):
    with pytest.raises(InvalidInput, match=words):
        parse_sweep(text)


@given(st.lists(st.integers(1, 4), max_size=3), st.integers(0, 5))
def test_runs_and_combinations_correspond(lengths, starts):
    keys = ("barrier.rho", "agents.damping", "game.gap_bound")
    sweeps = [
        Sweep(key, [1.0 + n for n in range(length)])
        for key, length in zip(keys, lengths, strict=False)
    ]
    plan = make_plan("velocity-sync", ODE, sweeps=sweeps, starts=starts, chunk=7)
    seen = set()
    labels = plan.labels()
    for run in range(plan.runs):
        number, start = plan.of_run(run)
        changes = plan.changes(number)
        assert all(labels[key][run] == value for key, value in changes.items())
        seen.add((*changes.values(), start))
    assert len(seen) == plan.runs == max(starts, 1) * int(np.prod(lengths))
    again = Plan.from_manifest(json.loads(json.dumps(plan.manifest())))
    assert again.manifest() == plan.manifest()


@pytest.mark.parametrize(
    ("one", "other"),
    [
        ("barrier.rho", "robots.barrier.rho"),
        ("barrier.rho", "systems.robots.barrier.rho"),
        ("barrier", "barrier.rho"),
        ("systems.robots.barrier.rho", "systems.robots.barrier"),
    ],
)
def test_one_key_is_not_swept_twice_under_two_names(one, other):
    values = {True: [1.0, 2.0], False: [{"rho": 1.0}, {"rho": 2.0}]}
    sweeps = [Sweep(key, values[key.endswith("rho")]) for key in (one, other)]
    with pytest.raises(InvalidInput, match="swept already"):
        make_plan("velocity-sync", ODE, sweeps=sweeps)


@pytest.mark.parametrize(
    ("key", "values", "words"),
    [
        ("recording", [{"period": 0.1}, {"period": 0.2}], "same recording period"),
        ("simulation", [{"duration": 1.0}, {"duration": 2.0}], "same duration"),
        ("simulation", [{"duration": 1.0, "seed": 1}, {"duration": 1.0}], "same seed"),
    ],
)
def test_what_runs_share_is_not_swept_by_a_whole_table(key, values, words, tmp_path):
    with pytest.raises(InvalidInput, match=words):
        run_batch("velocity-sync", {key: values}, out=tmp_path / "a")


def test_values_are_pythons_own():
    values = (np.float64(0.5), np.array([1.0, 2.0]), (3, 4), np.int64(2))
    assert Sweep("key", values).values == (0.5, [1.0, 2.0], [3, 4], 2)
    assert Sweep("key", np.array([1.0, 2.0])).values == (1.0, 2.0)


@pytest.mark.parametrize(
    ("values", "words"),
    [
        (0.1, "must be a list"),
        ("ring", "must be a list"),
        ([datetime.date(1979, 5, 27)], "a number, a word, a list or a table"),
        ([float("nan")], "finite"),
        (range(200_000), "at most"),
    ],
)
def test_values_that_no_scenario_can_hold_are_refused(values, words):
    with pytest.raises(InvalidInput, match=words):
        Sweep("barrier.rho", values)


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"runs": "3"}, "^runs: got '3'"),
        ({"runs": 2.5}, "^runs: got 2.5"),
        ({"runs": 10**12}, "10000000 runs at most"),
        ({"seed": -1}, "^seed: got -1"),
        ({"record": "some"}, "^record: got 'some'"),
        ({"record": 1.5}, "^record: got 1.5"),
        ({"spread": "0.5"}, "^spread"),
        ({"threads": -1}, "^threads: got -1"),
        ({"seed": -1, "cluster": "tcp://nobody.invalid"}, "^seed: got -1"),  # nobody is asked
    ],
)
def test_options_that_make_no_sense_are_refused(options, words, tmp_path):
    with pytest.raises(InvalidInput, match=words):
        run_batch("velocity-sync", changes=ODE, out=tmp_path / "a", **options)


def test_numpys_whole_numbers_will_do(tmp_path):
    runs = run_batch(
        "velocity-sync", changes=ODE, out=tmp_path / "a", runs=np.int64(2), seed=np.int64(3)
    )
    assert runs.sizes["run"] == 2


def test_rows_in_memory_are_bounded():
    fine = {**ODE, "simulation.duration": 600.0, "recording.period": 0.01}
    plan = make_plan("velocity-sync", fine, starts=100_000)
    assert 1 <= plan.chunk < 20
    assert make_plan("velocity-sync", ODE, starts=100_000).chunk == 782


@pytest.mark.parametrize(
    ("sweep", "words"),
    [
        (Sweep("barrier.roh", (1.0,)), "did you mean 'rho'"),
        (Sweep("barrier.rho", (0.1, -1.0)), "greater than 0.*with barrier.rho = -1"),
        (Sweep("simulation.duration", (1.0, 2.0)), "last as long"),
        (Sweep("agents.count", (5, 6)), "agents|same ones"),
    ],
)
def test_a_sweep_that_does_not_fit_is_refused_before_anything_is_written(sweep, words, tmp_path):
    with pytest.raises(InvalidInput, match=words):
        run_batch("velocity-sync", {sweep.key: sweep.values}, changes=ODE, out=tmp_path / "a")
    assert list(tmp_path.iterdir()) == []


def test_of_several_systems_one_must_be_named():
    with pytest.raises(InvalidInput, match="robots, channels"):
        make_plan("paper")
    assert make_plan("paper", system="channels").name == "channels"
