"""The trials of the test of passivity: what is tried, how far, and with what error."""

import itertools

import numpy as np
import pytest
from builders import UNEQUAL, integrators, robots
from hypothesis import given
from hypothesis import strategies as st
from passive_plants import NEGATIVE_DAMPING, PRINTED, ode

from gne_mj.passivity import examine
from gne_mj.passivity.excitation import COMBINATIONS, SIGNALS, STRATEGIES, Excitation
from gne_mj.plants.ode import OdePlant


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


def fragile(most):
    """Two integrators whose outputs beyond ``most`` are no numbers."""

    class Fragile(OdePlant):
        @property
        def output(self):
            y = super().output
            return np.where(np.abs(y) > most, np.nan, y)

    return lambda copies, h: Fragile(integrators(2).repeated(copies), h)


def test_amplitudes_at_which_outputs_run_away_say_nothing():
    report = examine(fragile(10.0), 0.02, trials=12, duration=4.0)
    assert report.holds
    assert [r.reach for r in report.ranges] == [1.0]
    assert report.examined == 4.0
    assert "at 30 times the outputs' range an output ran away" in report.message


def test_a_plant_that_is_no_longer_a_number_ends_its_trials():
    report = examine(fragile(5.0), 0.02)
    assert 0 < report.examined < 20
    assert "run away" in report.message


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
