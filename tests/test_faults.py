"""Faults: what strikes, when, whom, and what the law sees of it."""

import numpy as np
import pytest
from builders import EQUAL, FIVE, V0, clock, robot_state, robot_system

import reference
import reference_games
from gne_mj import graph as graphs
from gne_mj.controllers import PartialInformation
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
    for_native,
)
from gne_mj.loops import faults as native
from gne_mj.loops.feedback import Fault
from gne_mj.numbers import dtype_in
from gne_mj.plants.ode import OdePlant
from gne_mj.records import by_name
from gne_mj.simulation import Simulation
from gne_mj.system import Clock

RHO, H = 0.1, 0.01
GAME = reference_games.VelocityGame(V0, np.full(5, 3.0))


def struck(*faults, law=None, mode="sampled", engine="ode", **options):
    return robot_system(
        robot_state(FIVE), law=law, mode=mode, engine=engine, integrator="euler", faults=faults,
        **options,
    )  # fmt: skip


def record(system, steps, control=H):
    loop = system.closed_loop(clock(H, steps * H, control))
    return loop.advance(steps, 1), loop


def test_random_numbers_depend_on_all_four_and_are_uniform():
    with np.errstate(over="ignore"):
        draw = [native.uniform(7, 1, 2, k) for k in range(4000)]
        others = [
            [native.uniform(*key, k) for k in range(50)]
            for key in ((8, 1, 2), (7, 2, 2), (7, 1, 3))
        ]
    assert min(draw) >= 0.0
    assert max(draw) < 1.0
    counts = np.histogram(draw, bins=20, range=(0, 1))[0]
    assert np.sum((counts - 200) ** 2 / 200) < 45  # chi squared of 19 degrees, p about 0.001
    assert abs(np.corrcoef(draw[:-1], draw[1:])[0, 1]) < 0.05
    for other in others:
        assert not np.any(np.isin(other, draw))
        assert abs(np.corrcoef(other, draw[:50])[0, 1]) < 0.5


def test_pushes_noise_and_limits_against_a_loop_in_plain_python():
    """All that a full-information law can meet, step by step."""
    faults = (
        Push(agents=(1,), force=2.0, start=0.1, end=0.3),
        Push(agents=(1, 2), force=1.5, profile="sine", period=0.25),
        Push(force=-1.0, profile="square", period=0.1, start=0.05),
        Push(agents=(4,), force=3.0, profile="random"),
        Noise(amplitude=0.01),
        Bias(agents=(3,), offset=-0.02, start=0.2),
        Saturation(agents=(0,), limit=2.5, start=0.0, end=0.25),
    )
    system = struck(*faults, seed=5)
    recorded, _ = record(system, 60)
    plant = OdePlant(system.agents, H, "euler")
    plant.reset(system.state)
    with np.errstate(over="ignore"):
        for k in range(60):
            time, y = k * H, plant.output
            noise = [0.01 * (2 * native.uniform(5, 4, i, k) - 1) for i in range(5)]
            measurement = y + noise
            if time >= 0.2 - 1e-9:
                measurement[3] -= 0.02
            u = reference.full_information(GAME, RHO, measurement)
            if time < 0.25 - 1e-9:
                u[0] = np.clip(u[0], -2.5, 2.5)
            applied = u.copy()
            if 0.1 - 1e-9 <= time < 0.3 - 1e-9:
                applied[1] += 2.0
            applied[1:3] += 1.5 * np.sin(2 * np.pi * (time + 5e-10) / 0.25)
            if time >= 0.05 - 1e-9:
                half = int(np.floor(2 * (time - 0.05) / 0.1 + 1e-9))
                applied += -1.0 if half % 2 == 0 else 1.0
            applied[4] += 3.0 * (2 * native.uniform(5, 3, 4, k) - 1)
            assert np.allclose(recorded.state[k, :, 1], y, rtol=0, atol=1e-12)
            assert np.allclose(recorded.measurement[k], measurement, rtol=0, atol=1e-12)
            assert np.allclose(recorded.input[k], u, rtol=0, atol=1e-11)
            assert np.allclose(recorded.applied[k], applied, rtol=0, atol=1e-11)
            plant.step(applied)


def test_a_run_repeats_by_its_seed_however_it_is_cut():
    faults = (Noise(amplitude=0.01), Push(force=2.0, profile="random"))

    def states(seed, pieces):
        loop = struck(*faults, seed=seed).closed_loop(clock(H, 1.0))
        parts = [loop.advance(n, 1).state for n in pieces]
        return np.concatenate(parts)

    whole = states(3, [40])
    assert np.array_equal(whole, states(3, [1, 7, 32]))
    assert not np.allclose(whole, states(4, [40]))


@pytest.mark.parametrize("delay", [1, 3])
def test_late_sensors(delay):
    """An explicit law reads what was; mode implicit moves that on by the plant's own map."""
    recorded, _ = record(struck(SensorDelay(periods=delay)), 40)
    y = recorded.state[:, :, 1]
    for k in range(40):
        old = y[max(k - delay, 0)]
        assert np.array_equal(recorded.measurement[k], old)
        assert np.allclose(recorded.input[k], reference.full_information(GAME, RHO, old))


@pytest.mark.slow
def test_mode_implicit_is_not_deceived_by_a_known_delay():
    for steps in (1, 4):
        recorded, _ = record(struck(SensorDelay(periods=2), mode="implicit"), 80, control=steps * H)
        ahead = recorded.state[steps::steps, :, 1]
        expected = [reference.full_information(GAME, RHO, y) for y in ahead]
        assert np.allclose(recorded.input[: len(ahead) * steps : steps], expected, atol=1e-6)
        assert np.array_equal(recorded.measurement[4 * steps], recorded.state[2 * steps, :, 1])


def exchange_oracle(system, periods, seed, loss, delay, silent):
    """Partial information by messages, in plain Python: estimates at the control instants."""
    law, plant = system.law, OdePlant(system.agents, H, "euler")
    plant.reset(system.state)
    neighbours = [list(np.flatnonzero(row < 0)) for row in law.graph.laplacian]
    links = [(i, j) for i in range(5) for j in neighbours[i]]
    rows = np.tile(plant.output, (5, 1))
    inbox = {(i, j): rows[j].copy() for i, j in links}
    sent, found, inputs = [], [], []
    for k in range(periods):
        y = plant.output
        if k:
            for i in range(5):
                mean = np.mean([inbox[i, j] for j in neighbours[i]], axis=0)
                stays = np.exp(-law.coupling / law.time_constant * H * len(neighbours[i]))
                own = rows[i, i]
                rows[i] = mean + stays * (rows[i] - mean)
                rows[i, i] = own
        rows[np.arange(5), np.arange(5)] = y
        sent.append(rows.copy())
        for number, (i, j) in enumerate(links):
            lost = native.uniform(seed, 0, number, k) < loss
            if not lost and k >= delay and not (1 in (i, j) and silent[0] <= k < silent[1]):
                inbox[i, j] = sent[k - delay][j].copy()
        found.append(rows.copy())
        u = []
        for i in range(5):
            heard = sum(y[i] - inbox[i, j][i] for j in neighbours[i])
            gradient = GAME.partial_gradient(i, rows[i])
            u.append(-gradient - reference.barrier_gradient(GAME, RHO, y)[i] - law.coupling * heard)
        inputs.append(u)
        plant.step(np.array(u))
    return np.array(found), np.array(inputs)


@pytest.mark.slow
def test_messages_lost_late_and_silenced_against_plain_python():
    law = PartialInformation(graphs.ring(5), 2.0, 0.5)
    system = struck(
        MessageLoss(probability=0.4),
        MessageDelay(periods=2),
        Silence(agents=(1,), start=0.2, end=0.4),
        law=law, seed=11,
    )  # fmt: skip
    recorded, _ = record(system, 60)
    with np.errstate(over="ignore"):
        rows, inputs = exchange_oracle(system, 60, 11, 0.4, 2, (20, 40))
    got = recorded.memory[:, :25].reshape(60, 5, 5)
    assert np.allclose(got, rows, rtol=0, atol=1e-11)
    assert np.allclose(recorded.input, inputs, rtol=0, atol=1e-10)


@pytest.mark.slow
def test_estimates_corrupted_once():
    law = PartialInformation(graphs.ring(5), 2.0, 0.5)
    clean, _ = record(struck(Noise(amplitude=0.0), law=law), 20)
    bad, _ = record(struck(Corruption(agents=(2,), start=0.095, amplitude=0.3), law=law), 20)
    assert np.array_equal(clean.memory[:10], bad.memory[:10])
    shift = (bad.memory[10] - clean.memory[10]).reshape(5, 5)
    assert np.all(shift[[0, 1, 3, 4]] == 0)
    assert shift[2, 2] == 0
    others = np.delete(shift[2], 2)
    assert np.all(others != 0)
    assert np.max(np.abs(others)) <= 0.3
    later = (bad.memory[11] - clean.memory[11]).reshape(5, 5)
    assert np.max(np.abs(later[2])) < np.max(np.abs(shift[2])), "it fades, and is not repeated"


@pytest.mark.slow
@pytest.mark.parametrize("mode", ["sampled", "implicit"])
def test_engines_agree_under_all_faults(mode):
    faults = (
        MessageLoss(probability=0.4), MessageDelay(periods=1), Noise(amplitude=1e-3),
        Push(force=1.0, profile="random"), Corruption(amplitude=0.05, start=0.1),
        Saturation(limit=3.0, end=0.2), SensorDelay(periods=1),
    )  # fmt: skip
    law = PartialInformation(graphs.ring(5), 2.0, 0.5)
    ode, _ = record(struck(*faults, law=law, mode=mode), 60, control=2 * H)
    mujoco, _ = record(struck(*faults, law=law, mode=mode, engine="mujoco"), 60, control=2 * H)
    for name in ("state", "input", "memory", "measurement", "applied"):
        assert np.allclose(getattr(ode, name), getattr(mujoco, name), rtol=0, atol=1e-8), name


@pytest.mark.slow
@pytest.mark.parametrize("engine", ["ode", "mujoco"])
def test_continuous_runs_record_what_was_seen_at_the_start_of_a_step(engine):
    system = robot_system(
        robot_state(FIVE), engine=engine, faults=(Noise(amplitude=0.01), Push(force=1.0)), seed=2
    )
    recorded, _ = record(system, 30)
    with np.errstate(over="ignore"):
        noise = [[0.01 * (2 * native.uniform(2, 0, i, k) - 1) for i in range(5)] for k in range(30)]
    assert np.allclose(recorded.measurement, recorded.state[:, :, 1] + noise, rtol=0, atol=1e-12)
    expected = [reference.full_information(GAME, RHO, y) for y in recorded.measurement]
    assert np.allclose(recorded.input, expected, rtol=0, atol=1e-10)
    assert np.allclose(recorded.applied, recorded.input + 1.0)


def test_the_trajectory_tells_what_the_law_saw():
    system = struck(Noise(amplitude=0.01), Push(agents=(0,), force=0.5))
    data = Simulation([system], Clock(0.5, H, H, H)).run()["robots"]
    error = np.abs(data["measurement"] - data["action"])
    assert 0.001 < float(error.max()) <= 0.01
    pushed = (data["acting_input"] - data["input"]).isel(time=slice(0, -1))
    assert np.allclose(pushed.sel(agent=1), 0.5)
    assert np.allclose(pushed.sel(agent=[2, 3, 4, 5]), 0.0)


def test_a_measured_profile_outside_is_no_exit_of_the_true_one():
    y = np.array([V0 - 2.99, *FIVE[1:]])
    system = robot_system(
        robot_state(y),
        mode="sampled",
        integrator="euler",
        faults=(Bias(agents=(0,), offset=-2.0, start=0.05),),
    )
    trajectory = Simulation([system], Clock(1.0, H, H, H)).run()
    report = trajectory.reports["robots"]
    assert trajectory.status == "estimate_left_feasible_set"
    assert report["message"].startswith("the measured profile violated constraint 'gap of agent 1'")
    assert report["worst_constraint"]["margin"] > 0


@pytest.mark.parametrize(
    ("fault", "options", "words"),
    [
        (Push(agents=(5,), force=1.0), {}, ["faults.0.agents", "6", "1 to 5"]),
        (MessageLoss(probability=0.5), {}, ["full-information law sends no messages"]),
        (
            Silence(edges=((0, 2),)),
            {"law": PartialInformation(graphs.ring(5))},
            ["faults.0.edges", "[1, 3]", "no such edge"],
        ),
        (Corruption(amplitude=1.0), {}, ["no estimates"]),
        (SensorDelay(periods=1), {"mode": "continuous"}, ["'sampled' or 'implicit'"]),
    ],
)
def test_faults_that_cannot_be(fault, options, words):
    with pytest.raises(InvalidInput) as error:
        struck(fault, **options)
    for word in ("faults", *words):
        assert word in str(error.value)


@pytest.mark.parametrize(
    ("make", "key"),
    [
        (lambda: Push(force=np.inf), "force"),
        (lambda: Push(force=1.0, profile="saw"), "profile"),
        (lambda: Noise(amplitude=-1.0), "amplitude"),
        (lambda: MessageLoss(probability=1.5), "probability"),
        (lambda: Push(force=1.0, start=2.0, end=1.0), "end"),
        (lambda: SensorDelay(periods=1, agents=(0,)), "agents"),
        (lambda: SensorDelay(periods=1, start=1.0), "start"),
        (lambda: SensorDelay(periods=1, end=1.0), "end"),
    ],
)
def test_faults_are_checked_where_they_are_made(make, key):
    with pytest.raises(InvalidInput) as caught:
        make()
    assert caught.value.key == key


@pytest.mark.slow
def test_what_the_sensors_say_is_what_the_memory_moves_with():
    """A biased output is what an agent sends, held or continuous, with messages or without."""
    law = PartialInformation(graphs.complete(5), 2.0, 0.2)
    for mode in ("sampled", "continuous"):
        system = robot_system(
            robot_state(FIVE), law=law, mode=mode, integrator="euler",
            faults=(Bias(agents=(2,), offset=0.3),),
        )  # fmt: skip
        recorded, _ = record(system, 100)
        rows = recorded.memory[-1, :25].reshape(5, 5)
        others = np.delete(rows[:, 2], 2)
        measurement, y = recorded.measurement[-1, 2], recorded.state[-1, 2, 1]
        assert measurement == pytest.approx(y + 0.3)
        assert np.max(np.abs(others - measurement)) < 0.1 < np.min(np.abs(others - y)), mode


@pytest.mark.slow
def test_robots_of_ones_own_can_be_pushed():
    from gne_mj.scenario import run

    trajectory = run(
        "examples/robot/scenario.toml",
        {
            "controller": {"information": "full", "mode": "implicit"},
            "simulation.duration": 0.3,
            "faults": [{"type": "push", "force": 0.5, "agents": [1]}],
        },
    )
    (report,) = trajectory.reports.values()
    assert trajectory.holds
    assert report["implicit"]["periods_not_monotone"] == 0
    (name,) = trajectory.reports
    data = trajectory[name]
    pushed = (data["acting_input"] - data["input"]).isel(time=slice(0, -1))
    assert np.allclose(pushed.sel(agent=1), 0.5)


def rows_of(faults):
    """What native code has of each fault, by name."""
    dtype = dtype_in(Fault)
    return by_name(faults.rows.reshape(-1, len(dtype)), dtype)


def test_a_push_along_one_axis():
    from gne_mj.faults import steady_push
    from gne_mj.games import velocity_consensus_game

    game = velocity_consensus_game([(0, 1)], [1.0, 0.0], [0.0, 0.0], 1.0, 1.0)
    pushes = steady_push(game, np.array([1.0, 0.0, -2.0, 3.0]))
    rows = rows_of(for_native(pushes, game, None, 0))
    assert set(zip(rows.target, rows.amount, strict=True)) == {(0, 1.0), (2, -2.0), (3, 3.0)}
    with pytest.raises(InvalidInput, match=r"^axis"):
        for_native((Push(force=1.0, axis=2),), game, None, 0)


def test_links_of_agents_and_edges():
    game = robot_system(robot_state(FIVE), EQUAL).game
    graph = graphs.ring(5)

    def targets(**options):
        rows = rows_of(for_native((Silence(**options),), game, graph, 0))
        pointer, neighbour = graph.data
        pairs = [(i, int(j)) for i in range(5) for j in neighbour[pointer[i] : pointer[i + 1]]]
        return {pairs[int(target)] for target in rows.target}

    assert targets(edges=((1, 0),)) == {(0, 1), (1, 0)}
    assert targets(agents=(2,)) == {(1, 2), (2, 1), (2, 3), (3, 2)}
    assert len(targets()) == 10
