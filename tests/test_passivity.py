"""The empirical test of passivity: it must not cry wolf, and must find every wolf there is."""

import itertools
import json
from types import SimpleNamespace

import numpy as np
import pytest
from builders import EQUAL, UNEQUAL, integrators, pi_cascades, reference_robots, robots
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import quad, solve_ivp
from scipy.linalg import expm
from typer.testing import CliRunner

from gne_mj.cli import app
from gne_mj.errors import InvalidInput
from gne_mj.passivity import CHECKS, examine, plants_of
from gne_mj.passivity.excitation import COMBINATIONS, SIGNALS, STRATEGIES, Excitation
from gne_mj.plants.base import Plant
from gne_mj.plants.ode import OdePlant

PASSIVE = {
    "integrators": integrators(2),
    "PI cascades": pi_cascades(3, 1.3, 1.2),
    "robots": robots(EQUAL),
    "unequal robots": robots(UNEQUAL),
    "robots without dampers": robots({**UNEQUAL, "damping": [0.0] * 5}),
}
PRINTED = {**EQUAL, "stiffness": [1, 1, -1, 1, 1], "atan_coefficient": [1, 1, -1, 1, 1]}
NEGATIVE_DAMPING = {**EQUAL, "damping": [1, 1, -0.02, 1, 1]}


def ode(agents, integrator="rk4"):
    return plants_of(agents, "ode", integrator)


class Appendage(OdePlant):
    """Robots that are driven at the main mass and measured at the appendage."""

    @property
    def output(self):
        return self.state[:, 2]


def agents_of(channels, **more):
    """Agents without a storage function, whose states have no names."""
    kind = SimpleNamespace(STATES=())
    return SimpleNamespace(channels=channels, kind=kind, knows_storage=False, **more)


class Linear(Plant):
    """Channels x' = A x + B u, y = x_0, stepped exactly; at rest at (y, ..., y) unless told."""

    def __init__(self, channels, timestep, a, b):
        n = len(b)
        self.agents = agents_of(channels, equilibrium=lambda y: np.outer(y, np.eye(n)[0]))
        self.timestep, self.x = timestep, np.zeros((channels, n))
        block = np.zeros((n + 1, n + 1))
        block[:n, :n], block[:n, n] = a, b
        self.map = expm(timestep * block)[:n]

    @property
    def state(self):
        return self.x.copy()

    @property
    def output(self):
        return self.x[:, 0].copy()

    def reset(self, state):
        self.x = np.array(state)

    def step(self, u, steps=1):
        for _ in range(steps):
            self.x = np.column_stack([self.x, u]) @ self.map.T


class Scalar(Plant):
    """y' = f(y) + u by RK4; the input -f(y) keeps it at any y."""

    def __init__(self, channels, timestep, f):
        self.agents, self.timestep, self.f = agents_of(channels), timestep, f
        self.y = np.zeros(channels)

    @property
    def state(self):
        return self.y[:, None].copy()

    @property
    def output(self):
        return self.y.copy()

    def reset(self, state):
        self.y = np.array(state)[:, 0]

    def step(self, u, steps=1):
        h = self.timestep
        for _ in range(steps):
            k1 = self.f(self.y) + u
            k2 = self.f(self.y + 0.5 * h * k1) + u
            k3 = self.f(self.y + 0.5 * h * k2) + u
            k4 = self.f(self.y + h * k3) + u
            self.y = self.y + h / 6 * (k1 + 2 * k2 + 2 * k3 + k4)


class Delayed(OdePlant):
    """A plant whose inputs arrive late, by a tenth of a second."""

    def reset(self, state):
        super().reset(state)
        self.queue = [np.zeros(self.agents.channels)] * round(0.1 / self.timestep)

    def step(self, u, steps=1):
        for _ in range(steps):
            self.queue.append(np.array(u))
            super().step(self.queue.pop(0))


def lagging_integrator(lag):
    """y' = v, lag v' = u - v: an actuator that follows its command late."""
    return lambda copies, h: Linear(2 * copies, h, [[0, 1], [0, -1 / lag]], [0, 1 / lag])


def scalars(f):
    return lambda copies, h: Scalar(2 * copies, h, f)


def kept_by(f):
    return lambda y: (y[:, None], -f(y))


@pytest.mark.parametrize("integrator", ["rk4", "euler"])
@pytest.mark.parametrize("storage", ["agents", None])
@pytest.mark.parametrize("name", PASSIVE)
def test_passive_plants_pass(name, storage, integrator):
    report = examine(
        ode(PASSIVE[name], integrator), 0.02, storage=storage, outputs=(-10.0, 2.0),
        reaches=(1.0, 1e3),
    )  # fmt: skip
    assert report.holds, report.message
    assert report.status == "no violation found"
    assert "no proof" in report.message
    assert report.counterexample is None
    assert report.examined == report.duration == 20.0
    assert {f.check for f in report.findings} == set(CHECKS[: 3 if storage else 1])
    assert all(finding.excess <= finding.error for finding in report.findings)


@settings(max_examples=8)
@given(
    seed=st.integers(0, 2**32 - 1),
    name=st.sampled_from(sorted(PASSIVE)),
    integrator=st.sampled_from(["rk4", "euler"]),
    timestep=st.sampled_from([0.01, 0.05, 0.1]),
    storage=st.sampled_from(["agents", None]),
)
def test_no_false_alarm_whatever_the_seed_and_step(seed, name, integrator, timestep, storage):
    agents = PASSIVE[name]
    report = examine(ode(agents, integrator), timestep, duration=10.0, seed=seed, storage=storage)
    assert report.holds, report.message


def test_equilibria_with_a_constant_input():
    """A leaky integrator rests under u* = 2 y*, and is passive about each such equilibrium."""

    def leak(y):
        return -2 * y

    assert examine(scalars(leak), 0.02, equilibrium=kept_by(leak)).holds
    quadratic = examine(
        scalars(leak), 0.02, equilibrium=kept_by(leak),
        storage=lambda state, rest: 0.5 * (state[:, 0] - rest[:, 0]) ** 2,
    )  # fmt: skip
    assert quadratic.holds
    assert quadratic.storage


def test_passive_about_one_equilibrium_only():
    """y' = -y (y - 2)^2 + u loses energy about 0, but about 1 its slope is the wrong way."""

    def f(y):
        return -y * (y - 2) ** 2

    near_zero = (-0.01, 0.01)
    assert examine(
        scalars(f), 0.02, equilibrium=kept_by(f), outputs=near_zero, reaches=(1.0,)
    ).holds
    report = examine(scalars(f), 0.02, equilibrium=kept_by(f), outputs=(-2.0, 2.0))
    assert not report.holds
    assert 2 / 3 < report.counterexample.finding.rest_output < 2


def test_a_wrong_storage_function_is_refuted_though_the_plant_is_passive():
    def twice(state, rest):
        return (state[:, 0] - rest[:, 0]) ** 2

    report = examine(ode(integrators(2)), 0.02, storage=twice)
    assert {f.check for f in report.findings if f.violated} == {"storage risen"}


def violators():
    return {
        "printed psi": (ode(robots(PRINTED)), {3}),
        "negative damping": (ode(robots(NEGATIVE_DAMPING)), {3}),
        "non-collocated": (
            lambda copies, h: Appendage(robots(EQUAL).repeated(copies), h), {1, 2, 3, 4, 5}
        ),
        "delay": (lambda copies, h: Delayed(integrators(2).repeated(copies), h), {1, 2}),
        "delayed robots": (
            lambda copies, h: Delayed(robots(EQUAL).repeated(copies), h), {1, 2, 3, 4, 5}
        ),
    }  # fmt: skip


@pytest.mark.parametrize("storage", ["agents", None])
@pytest.mark.parametrize("name", violators())
def test_violators_are_found(name, storage):
    build, guilty = violators()[name]
    report = examine(build, 0.02, storage=storage)
    assert report.status == "violated"
    assert {f.agent for f in report.findings if f.violated} == guilty
    worst = report.counterexample.finding
    assert report.counterexample.confirmed
    # Energy drawn from rest refutes the plant itself, not only a storage function.
    assert worst.check == "energy extracted"
    assert worst.excess > 10 * worst.error
    assert f"agent {worst.agent}: energy extracted" in "\n".join(report.summary())


@pytest.mark.parametrize("lag", [0.5, 0.05, 0.01])
def test_even_a_short_lag_is_found(lag):
    assert not examine(lagging_integrator(lag), 0.02).holds


@pytest.mark.parametrize("frequency", [1e3, 1e4])
def test_motion_that_the_step_does_not_resolve_is_no_violation(frequency):
    """Two masses joined by a spring so stiff that they oscillate many times within a step."""
    k = 0.5 * frequency**2
    a = [[-0.5, -1, 0.5], [k, 0, -k], [0.5, 1, -0.5]]

    def build(copies, timestep):
        plant = Linear(copies, timestep, a, [1, 0, 0])
        plant.agents.equilibrium = lambda y: np.column_stack([y, 0 * y, y])
        return plant

    report = examine(build, 0.01)
    assert report.status == "step too long"
    assert not report.holds
    assert "does not resolve" in report.message
    assert examine(build, 0.01 * 20 / frequency, duration=400 / frequency).holds


def test_energy_of_a_spring_that_pushes_apart_obeys_the_balance_but_is_negative():
    report = examine(ode(robots(PRINTED)), 0.02)
    assert {f.check for f in report.findings if f.violated} == {
        "energy extracted",
        "storage negative",
    }


@pytest.mark.parametrize(("stiffness", "reach"), [(-0.02, 1e3), (-0.0005, 1e4)])
def test_springs_that_push_from_far_out_only_are_found(stiffness, reach):
    """psi = k s + atan(s): its energy is negative beyond some 3/|k| m, 150 and 6000 here."""
    build = ode(robots({**EQUAL, "stiffness": [stiffness] * 5}))
    near = examine(build, 0.02, duration=10.0, reaches=(1.0,))
    assert near.holds
    report = examine(build, 0.02, duration=10.0)
    assert report.status == "violated"
    assert [r.reach for r in report.ranges] == [r for r in (1.0, 30.0, 1e3, 1e4) if r <= reach]
    assert report.counterexample.finding.reach == reach
    assert report.counterexample.confirmed
    farthest = report.ranges[-1].states["extension"]
    assert quad(lambda s: stiffness * s + np.arctan(s), 0, farthest, limit=500)[0] < 0
    assert farthest > 3 / abs(stiffness) > near.ranges[0].states["extension"]


def test_an_error_that_fades_with_the_step_is_no_violation():
    """Springs without dampers at a thousand times the range: their kink is within one step."""
    undamped = robots({**UNEQUAL, "damping": [0.0] * 5})
    report = examine(ode(undamped), 0.02, duration=10.0, trials=9, seed=564)
    assert report.status == "no violation found"
    assert [r.reach for r in report.ranges] == [1.0, 30.0]
    assert "at 1000 times the outputs' range" in report.message


def test_the_ranges_are_those_that_were_tried():
    """By hand, from the trials' own starts and inputs: integrators only move with their input."""
    report = examine(ode(integrators(2)), 0.02, trials=4, duration=4.0, outputs=(-1.0, 2.0))
    assert [r.reach for r in report.ranges] == [1.0, 30.0, 1e3]
    for tried in report.ranges:
        assert set(tried.states) == {"action"}
        assert 0 < tried.input <= 3 * 3.0 * tried.reach
        assert tried.output == pytest.approx(tried.states["action"], rel=0.2)
        assert tried.output <= 4.0 * tried.input + 1e-9  # from rest, in 4 s
    words = "\n".join(report.summary())
    assert "at 3 amplitudes" in words
    assert f"tried up to {report.ranges[-1].output:.3g} from y*" in words
    assert report.to_dict()["ranges"][2]["reach"] == 1e3


def test_amplitudes_at_which_outputs_run_away_say_nothing():
    class Fragile(OdePlant):
        @property
        def output(self):
            y = super().output
            return np.where(np.abs(y) > 10.0, np.nan, y)

    report = examine(
        lambda copies, h: Fragile(integrators(2).repeated(copies), h), 0.02, trials=12, duration=4.0
    )
    assert report.holds
    assert [r.reach for r in report.ranges] == [1.0]
    assert report.examined == 4.0
    assert "at 30 times the outputs' range an output ran away" in report.message


def repeated_by_scipy(example, numbers, output):
    """Energy taken out of one reference robot under a counter-example's inputs, by DOP853."""
    robot = reference_robots({key: values[:1] for key, values in numbers.items()})
    x, taken = np.array([*example.initial_state[:3], 0.0]), 0.0
    for u in example.input:

        def rate(time, x, u=u):
            supplied = (x[output] - example.finding.rest_output) * (u - example.rest_input)
            return [*robot.rate(x[None, :3], np.array([u]))[0], supplied]

        x = solve_ivp(rate, (0, example.hold), x, method="DOP853", rtol=1e-11, atol=1e-13).y[:, -1]
        taken = -x[3]
    return taken


@pytest.mark.parametrize("name", ["non-collocated", "negative damping"])
def test_a_counterexample_repeats_in_an_independent_simulation(name):
    build, _ = violators()[name]
    numbers = {**EQUAL, "damping": [-0.02]} if name == "negative damping" else EQUAL
    report = examine(build, 0.02, storage=None)
    example = report.counterexample
    taken = repeated_by_scipy(example, numbers, 2 if name == "non-collocated" else 1)
    assert taken > 0
    assert abs(taken - example.finding.excess) <= example.finding.error
    assert len(example.input) * example.hold == pytest.approx(example.finding.time)


@pytest.mark.parametrize("integrator", ["rk4", "euler"])
def test_the_error_estimate_holds(integrator):
    """Against the same trials at a step eight times finer, held inputs equal by construction."""
    from gne_mj.passivity.trials import Extent, Subject, Trials

    def trials(timestep):
        build = ode(robots(UNEQUAL), integrator)
        subject = Subject(build, np.full(5, -1.0), np.full(5, 1.0), np.arange(5))
        return Trials(subject, Extent(24, timestep, 5.0, 0), range(24))

    coarse = trials(0.01)
    error = 2 * np.maximum.accumulate(np.abs(coarse.supplied[0] - coarse.supplied[1]))
    plant = ode(robots(UNEQUAL), integrator)(24, 0.01 / 16)
    plant.reset(coarse.initial_state)
    supplied = 0.0
    for k, u in enumerate(coarse.input):
        integral, _ = coarse._hold(plant, k, slice(None), coarse.substeps * 16)
        supplied = supplied + u * integral
        excess = (
            np.abs(coarse.supplied[1, k + 1] - supplied) - error[k + 1] - coarse.rounding[k + 1]
        )
        if k > 20:
            assert np.all(excess <= 0)


def test_trials_repeat_and_more_trials_add_to_them():
    build = ode(robots(NEGATIVE_DAMPING))
    first, again = (examine(build, 0.02, seed=5, trials=30) for _ in range(2))
    assert first.to_dict() == again.to_dict()
    worst = first.counterexample.finding
    alone = examine(build, 0.02, seed=5, trials=worst.trial + 1)
    assert worst in alone.findings
    assert examine(build, 0.02, seed=6).counterexample != first.counterexample


def test_many_agents_are_examined_in_batches():
    numbers = {key: np.tile(values, 60) for key, values in NEGATIVE_DAMPING.items()}
    report = examine(ode(robots(numbers)), 0.02, trials=12, duration=10.0)
    assert {f.agent for f in report.findings if f.violated} <= set(range(3, 300, 5))
    alone = examine(ode(robots(NEGATIVE_DAMPING)), 0.02, trials=12, duration=10.0)
    assert {f.channel for f in report.findings} == set(range(1, 301))
    assert report.agents == 300
    assert not alone.holds
    assert not report.holds
    assert len(report.counterexample.input) > 0


def test_channels_of_one_agent():
    report = examine(ode(robots(PRINTED)), 0.02, owners=[0, 0, 1, 1, 2])
    guilty = {(f.agent, f.channel) for f in report.findings if f.violated}
    assert (guilty, report.agents) == ({(2, 3)}, 3)


def test_a_plant_that_is_no_longer_a_number_ends_its_trials():
    class Fragile(OdePlant):
        @property
        def output(self):
            y = super().output
            return np.where(np.abs(y) > 5.0, np.nan, y)

    report = examine(lambda copies, h: Fragile(integrators(2).repeated(copies), h), 0.02)
    assert 0 < report.examined < 20
    assert "run away" in report.message


def test_mujoco_gives_what_the_ode_gives():
    options = {"duration": 4.0, "trials": 13, "seed": 3, "reaches": (1.0,)}
    twin = examine(ode(robots(UNEQUAL)), 0.02, **options)
    fleet = examine(plants_of(robots(UNEQUAL), "mujoco", "rk4"), 0.02, **options)
    assert twin.holds
    assert fleet.holds
    for one, other in zip(twin.findings, fleet.findings, strict=True):
        assert other.excess == pytest.approx(one.excess, abs=1e-9)


def test_violators_in_mujoco():
    build = plants_of(robots(PRINTED), "mujoco", "euler")
    report = examine(build, 0.02, duration=10.0, trials=12)
    assert {f.agent for f in report.findings if f.violated} == {3}
    assert report.counterexample.finding.check == "energy extracted"


def test_a_plant_must_rest_where_it_is_said_to():
    falling = scalars(lambda y: -9.81 + 0 * y)
    with pytest.raises(InvalidInput, match="must rest") as caught:
        examine(falling, 0.02, equilibrium=lambda y: (y[:, None], 0 * y))
    assert caught.value.key == "equilibrium"


@pytest.mark.parametrize(
    ("key", "bad"),
    [
        ("trials", 0),
        ("seed", -1),
        ("duration", 0.1),
        ("duration", np.inf),
        ("outputs", (1.0, 1.0)),
        ("outputs", (0.0, np.inf)),
        ("owners", [0]),
    ],
)
def test_bad_numbers(key, bad):
    with pytest.raises(InvalidInput) as caught:
        examine(ode(integrators(2)), 0.02, **{key: bad})
    assert caught.value.key == key


@pytest.mark.parametrize("bad", [0.0, -1.0, np.nan])
def test_bad_steps(bad):
    with pytest.raises(InvalidInput, match="timestep"):
        examine(ode(integrators(2)), bad)


@given(seed=st.integers(0, 2**32 - 1), trial=st.integers(0, 3 * COMBINATIONS))
def test_inputs_stay_within_their_amplitude_and_oppose_when_they_should(seed, trial):
    rng = np.random.default_rng(seed)
    program = Excitation.draw(rng, trial, np.array([1.0, 5.0, 0.1]), 0.02, 20.0)
    for time in rng.uniform(0, 20, 50):
        deviation = rng.normal(size=3) * [1.0, 0.0, 10.0]
        u = program.input(time, deviation)
        assert np.all(np.abs(u) <= program.amplitude * (1 + 1e-12))
        if STRATEGIES[program.strategy[0]] in ("opposing", "damping"):
            assert np.all((u * deviation <= 0) | (time < program.free))


def test_trials_count_through_all_combinations():
    rng, seen = np.random.default_rng(0), set()
    for trial in range(COMBINATIONS):
        program = Excitation.draw(rng, trial, np.ones(1), 0.02, 20.0)
        seen.add((SIGNALS[program.signal[0]], STRATEGIES[program.strategy[0]]))
    assert seen == set(itertools.product(SIGNALS, STRATEGIES))


def test_signals_have_the_time_scales_they_are_said_to_have():
    """The chirp's turning points: from one period in the trial up to one in eight holds."""
    rng = np.random.default_rng(1)
    program = Excitation.draw(rng, SIGNALS.index("chirp"), np.ones(1), 0.02, 20.0)
    times = np.arange(0, 20, 1e-3)
    u = np.array([program.input(t, np.zeros(1))[0] for t in times])
    turns = times[1:-1][np.diff(np.sign(np.diff(u))) != 0]
    assert turns[-1] - turns[-2] == pytest.approx(0.5 * 8 * 0.02, rel=0.05)
    assert turns[1] - turns[0] > 1.0


RUN = ("passivity", "cournot", "--set", "simulation.duration=2", "--trials", "3")


def test_command_says_what_it_found():
    done = CliRunner().invoke(app, RUN)
    assert done.exit_code == 0
    assert "firms\n  no violation found: 3 trials of 2 s for each of 10 agents" in done.output
    assert "energy extracted" in done.output


def test_command_in_json_and_its_exit_status():
    arguments = ("passivity", "velocity-sync", "--json", "--trials", "12", "--seed", "1",
                 "--set", "plant.engine=ode", "--set", "simulation.duration=10",
                 "--set", "agents.stiffness=[1,-1,1,1,1]",
                 "--set", "agents.atan_coefficient=[1,-1,1,1,1]")  # fmt: skip
    done = CliRunner().invoke(app, arguments)
    assert done.exit_code == 1
    report = json.loads(done.output)["robots"]
    assert (report["status"], report["seed"], report["trials"]) == ("violated", 1, 12)
    assert report["counterexample"]["finding"]["agent"] == 2
    assert {f["agent"] for f in report["findings"] if f["excess"] > f["error"]} == {2}


def test_command_for_one_system():
    chosen = (*RUN[2:], "--system", "channels", "--json")
    done = CliRunner().invoke(app, ("passivity", "paper", *chosen))
    assert (done.exit_code, set(json.loads(done.output))) == (0, {"channels"})
    wrong = CliRunner().invoke(app, (*RUN, "--system", "firm"))
    assert isinstance(wrong.exception, InvalidInput)
    assert "did you mean 'firms'?" in str(wrong.exception)
