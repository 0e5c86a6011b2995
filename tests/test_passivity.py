"""The empirical test of passivity: it must not cry wolf, and must find every wolf there is."""

import json

import numpy as np
import pytest
from builders import EQUAL, UNEQUAL, integrators, reference_robots, robots
from hypothesis import given, settings
from hypothesis import strategies as st
from passive_plants import (
    PASSIVE,
    PRINTED,
    Linear,
    kept_by,
    lagging_integrator,
    ode,
    scalars,
    violators,
)
from scipy.integrate import quad, solve_ivp
from typer.testing import CliRunner

from gne_mj.cli import app
from gne_mj.errors import InvalidInput
from gne_mj.passivity import CHECKS, examine, plants_of


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
