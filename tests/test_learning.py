"""Gymnasium's and PettingZoo's environments, and the barrier as a filter of any policy."""

import json
import runpy
from functools import cache, partial
from math import nan
from pathlib import Path

import gymnasium
import numpy as np
import pytest
from builders import EQUAL, FIVE, V0, clock, robot_state, robot_system
from gymnasium.error import ResetNeeded
from gymnasium.utils.env_checker import check_env
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.testing import assert_array_equal
from pettingzoo.test import parallel_api_test, parallel_seed_test

import gne_mj
from gne_mj.environment import (
    FleetEnv,
    FleetParallelEnv,
    FleetVectorEnv,
    environment_of,
    guarded,
    load_environment,
    load_gymnasium,
    load_pettingzoo,
    load_vector,
    setting_of,
)
from gne_mj.errors import InvalidInput

SHORT = {
    "simulation.control_period": 0.02, "simulation.duration": 0.2, "agents.input_limit": 10.0
}  # fmt: skip
STRONG = SHORT | {"simulation.duration": 2.0, "agents.input_limit": 60.0}
RANDOM = {"start": "random"}


@cache
def vector(strong=False):
    changes = STRONG if strong else SHORT
    return load_vector("velocity-sync", changes, num_envs=5, threads=2, **RANDOM)


# Their projects' own tests


@pytest.mark.filterwarnings("ignore:.*For Box action spaces, we recommend")
def test_gymnasium_finds_nothing_wrong():
    for mode in ("rgb_array", "ansi"):
        made = gymnasium.make(
            "gne_mj/Fleet-v0", scenario="velocity-sync", changes=SHORT, render_mode=mode, **RANDOM
        )
        check_env(made.unwrapped)
        made.close()


@pytest.mark.parametrize("scenario", ["velocity-sync", "planar-sync"])
def test_pettingzoo_finds_nothing_wrong(scenario, capsys):
    def made():
        return load_pettingzoo(scenario, SHORT, information="partial", graph="line", **RANDOM)

    parallel_api_test(made(), num_cycles=25)
    parallel_seed_test(made, num_cycles=10)
    assert "Passed" in capsys.readouterr().out


def test_a_vector_is_gymnasiums_own_vector_of_single_ones_to_the_bit():
    """Seeds, exits, autoreset and what is told besides, against SyncVectorEnv."""
    ours, setting = vector(), vector().setting
    theirs = gymnasium.vector.SyncVectorEnv([lambda: FleetEnv(setting)] * ours.num_envs)
    assert ours.metadata["autoreset_mode"] == theirs.metadata["autoreset_mode"]
    assert ours.observation_space == theirs.observation_space
    assert ours.action_space == theirs.action_space
    rng, ends = np.random.default_rng(0), np.zeros(2)
    for seed in (7, None):
        found, expected = ours.reset(seed=seed), theirs.reset(seed=seed)
        for _ in range(15):
            assert_array_equal(found[0], expected[0])
            assert found[-1].keys() == expected[-1].keys()
            for name in found[-1]:
                assert_array_equal(found[-1][name], expected[-1][name], err_msg=name)
            actions = rng.uniform(-10, 10, size=(5, 5)) * rng.choice([0.1, 1.0, 3.0], size=(5, 1))
            found, expected = ours.step(actions), theirs.step(actions)
            for one, other in zip(found[1:4], expected[1:4], strict=True):
                assert_array_equal(one, other)
            ends += found[2].sum(), found[3].sum()
            assert ours.observation_space.contains(found[0])
    assert np.all(ends > 0), "both kinds of ends were seen"


def test_all_kinds_are_the_same_fleet_to_the_bit():
    options = {"information": "partial", "graph": "line", "exit_cost": 7.0}
    single, parallel, dm = (
        load("velocity-sync", SHORT, **options, **more)
        for load, more in (
            (load_gymnasium, {}), (load_pettingzoo, {}), (load_environment, {"reward": "each"}),
        )
    )  # fmt: skip
    flat = [each.reset(seed=0)[0] for each in (single, parallel)]
    timestep, rng = dm.reset(), np.random.default_rng(1)
    while True:
        seen = timestep.observation
        assert_array_equal(flat[0], np.concatenate([v.ravel() for v in seen.values()]))
        for name, own in flat[1].items():
            parts = [value for key, value in seen.items() if key.startswith(f"{name}/")]
            assert_array_equal(own, np.concatenate(parts))
        assert_array_equal(parallel.state(), flat[0])
        if timestep.last():
            break
        force = rng.uniform(-10.0, 10.0, size=5)
        timestep = dm.step(force)
        parts = {name: force[own] for name, own in parallel.action_entries.items()}
        one, each = single.step(force), parallel.step(parts)
        flat = one[0], each[0]
        assert_array_equal(timestep.reward, list(each[1].values()))
        assert one[1] == np.sum(timestep.reward)
        left = timestep.last() and timestep.discount == 0.0
        assert one[2:4] == (left, timestep.last() and not left)
        assert set(each[2].values()) == {one[2]}
        assert set(each[3].values()) == {one[3]}
    assert parallel.agents == []


def test_agents_with_several_actions_have_their_own_entries():
    environment = load_pettingzoo("planar-sync", SHORT)
    entries = list(environment.action_entries.values())
    game = environment.setting.system.game
    assert [np.arange(game.actions)[own].tolist() for own in entries] == [
        np.flatnonzero(game.agent_of_action == i).tolist() for i in range(game.agents)
    ]
    environment.reset(seed=0)
    names = environment.possible_agents
    parts = {name: np.full(2, float(i)) for i, name in enumerate(names)}
    *_, infos = environment.step(parts)
    for name in names:
        assert_array_equal(infos[name]["given"], parts[name])
        assert environment.action_space(name).shape == (2,)


# What is seen


@given(seed=st.integers(0, 2**32 - 1), size=st.sampled_from([1.0, 10.0, 1e3]))
@settings(max_examples=15)
def test_observations_are_within_their_bounds(seed, size):
    """Of states that are, and of ones flung far outside."""
    environment = vector()
    environment.reset(seed=seed)
    rng = np.random.default_rng(seed)
    fleets = environment.episodes.fleets
    fleets.rows.state[:] *= rng.normal(size=fleets.rows.state.shape) * size
    fleets.rows.y[:] = fleets.rows.state[:, 1::4]
    seen = environment.episodes.observed()
    assert environment.observation_space.contains(seen[:, environment.episodes.view.joint])
    table = environment.episodes.view.table(fleets)
    low, high = environment.episodes.bounds
    within = (table >= low) & (table <= high)
    assert_array_equal(seen[within], table[within])
    assert np.all(np.isfinite(low) & np.isfinite(high))


def test_pictures_show_what_is_used():
    environment = FleetEnv(vector().setting, render_mode="rgb_array")
    environment.reset(seed=0)
    far = environment.render()
    assert far.dtype == np.uint8
    while not environment.step(np.array([10.0, -10.0, 10.0, -10.0, 10.0]))[2]:
        pass
    near = environment.render()
    red = np.all(near == (200, 70, 50), axis=2).sum()
    assert far.shape == near.shape
    assert red > 0
    assert not np.any(np.all(far == (200, 70, 50), axis=2))
    text = FleetEnv(vector().setting, render_mode="ansi")
    text.reset(seed=0)
    assert text.render().startswith("0.000 s: y = ")


# The barrier as a filter


@cache
def kept(between="watched", decentralised=False):
    return guarded(vector(strong=True), pull=20.0, between=between, decentralised=decentralised)


@given(seed=st.integers(0, 2**32 - 1), kind=st.sampled_from(["noise", "corner", "square", "bound"]))
@settings(max_examples=12)
@pytest.mark.parametrize("decentralised", [False, True])
def test_no_policy_leaves_under_the_barrier(decentralised, seed, kind):
    """Noise, a steady corner, one that turns about, and one that pushes gaps to their bounds."""
    environment, rng = kept("watched", decentralised), np.random.default_rng(seed)
    observed, _ = environment.reset(seed=seed % 1000)
    corner = rng.choice([-20.0, 20.0], size=(5, 5))
    for step in range(60):
        if kind == "noise":
            pull = rng.uniform(-20.0, 20.0, size=(5, 5))
        elif kind == "corner":
            pull = corner
        elif kind == "square":
            pull = corner * (1 if step // 7 % 2 else -1)
        else:  # away from whoever is nearest to a bound
            gaps = observed[:, -5:]
            pull = 20.0 * np.sign(gaps - np.append(gaps[:, 1:], np.zeros((5, 1)), axis=1))
        observed, _, left, _, infos = environment.step(pull)
        assert not np.any(left)
        assert not np.any(infos["limited"])


def test_what_acts_solves_the_barriers_equation():
    """u = pull - dphi(y+), at the outputs of the period's end that are then measured."""
    environment = guarded(load_environment("velocity-sync", STRONG), pull=20.0)
    system = environment.task.system
    timestep, rng = environment.reset(), np.random.default_rng(3)
    nearest = np.inf
    for _ in range(40):
        pull = rng.uniform(-20.0, 20.0, size=5)
        timestep = environment.step(pull)
        y = timestep.observation["all/output"]
        gaps = np.diff(y, prepend=V0)
        weight = 2 * system.rho * gaps / (9.0 - gaps**2)  # by hand: of agent i's gap, and the next
        expected = pull - weight + np.append(weight[1:], 0.0)
        np.testing.assert_allclose(environment.physics.given, expected, rtol=0, atol=1e-5)
        nearest = min(nearest, 3.0 - np.abs(gaps).max())
    assert nearest < 0.1, "the barrier had something to do"


def test_a_policy_is_a_law_under_the_same_barrier():
    """A run in mode implicit is the guarded environment's episode."""

    def policy(y):
        return 15.0 * np.sin(2.0 * y + np.arange(len(y)))

    scenario = gne_mj.load_scenario("velocity-sync", STRONG | {"recording.period": 0.02})
    law = gne_mj.own_law(lambda game, rho, y, memory: policy(y), mode="implicit", filtered=True)
    run = gne_mj.run(scenario, law=law)
    assert run.status == "completed"
    environment = guarded(load_environment("velocity-sync", STRONG))
    timestep, given, seen = environment.reset(), [], []
    while not timestep.last():
        y = timestep.observation["all/output"]
        timestep = environment.step(policy(y))
        seen.append(y), given.append(environment.physics.given)
    robots = run["robots"].isel(time=slice(0, -1))
    np.testing.assert_allclose(robots["action"], seen, rtol=0, atol=1e-6)
    np.testing.assert_allclose(robots["input"], given, rtol=0, atol=1e-4)
    assert "certified at control instants" in str(gne_mj.certify(run))


def test_every_kind_is_kept_inside_by_the_same_input():
    def made(load, **more):
        return guarded(load("velocity-sync", STRONG, **more), pull=20.0)

    dm, single, parallel = map(made, (load_environment, load_gymnasium, load_pettingzoo))
    many = guarded(load_vector("velocity-sync", STRONG, num_envs=2, threads=2), pull=20.0)
    dm.reset(), single.reset(seed=0), parallel.reset(seed=0), many.reset(seed=0)
    for step in range(30):
        pull = 20.0 * np.sign(np.sin(0.3 * step + np.arange(5.0)))
        parts = {name: pull[own] for name, own in parallel.action_entries.items()}
        y = dm.step(pull).observation["all/output"]
        told = single.step(pull)[-1], many.step(np.tile(pull, (2, 1)))[-1]
        infos = parallel.step(parts)[-1]
        given = dm.physics.given
        assert_array_equal(told[0]["given"], given)
        assert_array_equal(told[1]["given"], [given, given])
        assert_array_equal(np.concatenate([infos[n]["given"] for n in parts]), given)
        for each in (single, parallel, many):
            assert_array_equal(each.episodes.fleets.rows.y[-1], y)
    assert dm.action_spec().maximum.tolist() == [20.0] * 5
    assert isinstance(single, FleetEnv)
    assert isinstance(parallel, FleetParallelEnv)
    assert isinstance(many, FleetVectorEnv)


@pytest.mark.slow  # compiles, or starts programs, for seconds
def test_long_periods_are_cut_before_they_lead_outside():
    """Springs throw robots out between instants of 0.8 s, unless that is foreseen."""
    changes = {
        "simulation.control_period": 0.8, "simulation.timestep": 0.01, "simulation.duration": 8.0
    }  # fmt: skip
    exits = {}
    for between in ("watched", "guarded"):
        environment = load_vector("velocity-sync", changes, num_envs=8, threads=1, **RANDOM)
        environment = guarded(environment, pull=20.0, between=between)
        environment.reset(seed=0)
        rng, exits[between] = np.random.default_rng(0), 0
        for _ in range(15):
            *_, left, _, _ = environment.step(rng.choice([-20.0, 20.0], size=(8, 5)))
            exits[between] += left.sum()
    assert exits["guarded"] == 0
    assert exits["watched"] > 0


def test_where_actuators_cannot_deliver_it_is_told():
    environment = guarded(load_gymnasium("velocity-sync", SHORT | {"agents.input_limit": 0.5}))
    environment.reset(seed=0)
    *_, info = environment.step(np.full(5, 0.5))
    assert info["limited"] == 1, "the shipped start asks for more than half a newton"
    assert np.abs(info["given"]).max() == 0.5


def test_what_cannot_be_is_refused_in_one_sentence():
    single, parallel = (
        load_gymnasium("velocity-sync", SHORT),
        load_pettingzoo("velocity-sync", SHORT),
    )
    system = robot_system(robot_state(FIVE), EQUAL, engine="mujoco")
    setting = setting_of(system, clock(0.01, 1.0))
    for call, said in (
        (
            lambda: guarded(gymnasium.wrappers.ClipAction(single)),
            "environment: got 'ClipAction', but it must be one of this package's",
        ),
        (lambda: guarded(single, pull=0.0), "pull: got 0.0, but it must be positive"),
        (lambda: guarded(single, between="garded"), "between: got 'garded', but"),
        (lambda: FleetEnv(setting, render_mode="human"), "render_mode: got 'human', but"),
        (lambda: FleetVectorEnv(setting, 0), "num_envs: got 0, but it must be a whole number"),
        (lambda: FleetEnv(setting, bound=nan), "bound: got nan, but it must be positive"),
        (lambda: vector().reset(seed=[1, 2]), "seed: got '2 seeds', but there are 5 fleets"),
        (lambda: parallel.step({}), "actions: got [], but reset first"),
        (lambda: single.step(np.zeros(4)), "action: got 'shape (4,)', but its shape must be (5,)"),
    ):
        with pytest.raises(InvalidInput) as caught:
            call()
        assert said in str(caught.value)
    parallel.reset(seed=0)
    with pytest.raises(InvalidInput, match=r"actions.agent_2: got 'shape \(3,\)'"):
        parallel.step({name: np.zeros(1 if name != "agent_2" else 3) for name in parallel.agents})
    assert gne_mj.environment.guarded is guarded
    assert environment_of(system, clock(0.01, 1.0)).setting.guard is None


def test_nothing_is_done_before_a_reset_and_closing_loses_nothing():
    for made in (load_gymnasium, partial(load_vector, num_envs=2, threads=2), load_pettingzoo):
        environment = made("velocity-sync", SHORT, render_mode="ansi")
        refused = [environment.render]
        if made is load_pettingzoo:
            refused.append(environment.state)
        else:
            refused.append(lambda made=environment: made.step(np.zeros(made.action_space.shape)))
        for call in refused:
            with pytest.raises(ResetNeeded, match="reset"):
                call()
        first, _ = environment.reset(seed=0)
        environment.close()
        environment.close()
        again, _ = environment.reset(seed=0)
        assert str(first) == str(again)
        assert "0.000 s: y = 1.000 0.000" in str(environment.render())


@pytest.mark.slow
def test_the_recipe_trains_a_policy_that_is_a_law(monkeypatch, tmp_path, capsys):
    folder = Path(__file__).parents[1] / "examples" / "learning"
    monkeypatch.syspath_prepend(folder)
    train = runpy.run_path(str(folder / "train.py"))
    out = tmp_path / "policy.json"
    arguments = ["--generations=2", "--starts=1", "--episodes=4", f"--out={out}"]
    monkeypatch.setattr("sys.argv", ["train.py", *arguments])
    train["main"]()
    lines = capsys.readouterr().out.splitlines()
    assert lines[0].startswith("without it: inside ")
    assert lines[1].startswith("under the barrier: inside 4 of 4")
    numbers = np.array(json.loads(out.read_text()))
    y, policy = np.array([FIVE, FIVE + 0.5]), train["force"]
    assert_array_equal(policy(numbers, y)[1], policy(numbers, y[1]))
    assert_array_equal(policy(np.stack([numbers, 2 * numbers]), y)[0], policy(numbers, y[0]))
    for file, mode in (("policy.py", "sampled"), ("policy_filtered.py", "implicit")):
        law = {"information": "custom", "file": str(folder / file), "mode": mode}
        changes = SHORT | {f"systems.robots.controller.{key}": each for key, each in law.items()}
        run = gne_mj.run(gne_mj.load_scenario("velocity-sync", changes))
        assert run.status == "completed"
