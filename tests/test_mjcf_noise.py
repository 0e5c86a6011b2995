"""Noisy sensors of robots that MuJoCo alone predicts, in mode implicit, and their margin."""

from dataclasses import replace

import numpy as np
import pytest
from builders import FIVE, V0, clock, integrators, relative_error, run_loop

from gne_mj.controllers import FullInformation
from gne_mj.errors import InvalidInput
from gne_mj.faults import Bias, Noise, Push, SensorDelay
from gne_mj.games import velocity_game
from gne_mj.load_margins import beyond_estimates
from gne_mj.loops import monitor as watch
from gne_mj.margins import Disturbance, tightening, with_margin
from gne_mj.plants.mjcf_robot import RobotFile, mjcf_robots
from gne_mj.system import System

H, PERIOD = 0.005, 0.02
SLED = """
<mujoco><option gravity="0 0 0"/>
  <worldbody><body name="sled">
    <joint name="along" type="slide" axis="1 0 0" damping="{damping}"/>
    <geom type="sphere" size="0.1" mass="1"/>
  </body></worldbody>
  <actuator><motor name="push" joint="along"/></actuator>
</mujoco>
"""
NOISE = Noise(amplitude=0.05)
WRONG = {"noise": (NOISE,), "noise and bias": (NOISE, Bias(agents=(1, 3), offset=-0.02))}


@pytest.fixture
def sleds(tmp_path):
    def made(damping=0.0):
        path = tmp_path / "sled.xml"
        path.write_text(SLED.format(damping=damping))
        return mjcf_robots((RobotFile(path, "along", "push"),) * 5, np.full(5, np.inf))

    return made


def system_of(agents, state, rho=0.1, **options):
    given = {"mode": "implicit", "integrator": "euler", **options}
    return System(
        "sleds", velocity_game(5, V0, 3.0), agents, FullInformation(), rho, state, **given
    )


def sled_system(agents, y=FIVE, **options):
    state = agents.equilibrium(np.asarray(y, dtype=float))
    return system_of(agents, state, engine="mujoco", **options)


def run(system, periods=200):
    steps = round(PERIOD / H)
    return run_loop(system, H, periods * steps, control=PERIOD, every=steps)


@pytest.mark.parametrize("observer", [0.0, 0.5])
@pytest.mark.parametrize("wrong", WRONG)
def test_a_mass_of_1_kg_is_the_integrator_with_the_same_errors(sleds, wrong, observer):
    """y+ = y + T u either way: an error of a reading stays as it is over a period."""
    options = {"faults": (*WRONG[wrong], Push(agents=(2,), force=0.3)), "observer": observer}
    got, inputs, *_ = run(sled_system(sleds(), **options))
    own = system_of(integrators(5), np.array(FIVE, dtype=float)[:, None], **options)
    expected, given, *_ = run(own)
    assert np.max(np.abs(inputs - run(sled_system(sleds()))[1])) > 0.1  # errors do something
    assert relative_error(got[:, :, 0], expected[:, :, 0]) < 1e-9
    assert relative_error(inputs, given) < 1e-9


def test_predictions_are_wrong_by_what_readings_are(sleds):
    """Also where the robot answers otherwise than a mass: with damping errors would fade."""
    system = sled_system(sleds(damping=8.0), faults=(NOISE,))
    loop = system.closed_loop(clock(H, 4.0, PERIOD))
    rows = loop.advance(200, round(PERIOD / H))
    errors = rows.measurement - rows.state[:, :, 0]
    assert 0.04 < np.max(np.abs(errors)) <= 0.05
    # of the last period's error no instant has told yet
    assert loop.monitor.prediction == pytest.approx(np.max(np.abs(errors[:-1])), rel=1e-6)


def at_the_bounds(agents, game, observer=0.0, **options):
    """How a run under noise ends whose agents want to be farther apart than bounds allow."""
    system = sled_system(agents, rho=1e-3, faults=(NOISE,), observer=observer)
    return run(replace(system, game=game, **options))[3].monitor.exit


@pytest.mark.parametrize("observer", [0.0, 0.5])
def test_a_margin_covers_noise(sleds, observer):
    agents, errors = sleds(damping=1.0), Disturbance(np.zeros(5), np.full(5, 0.05))
    bare = velocity_game(5, V0, 3.0, [3.0, 9.0, 9.0, -3.0, 3.0], 2.0)
    unforeseen = beyond_estimates(agents, H, "euler", 4, errors, observer)
    game = with_margin(bare, agents, unforeseen, H, "euler", 4)
    carried = 0.15 if observer else 0.05  # the estimate's error is up to twice the reading's
    np.testing.assert_allclose(game.margins, tightening(bare, np.full(5, carried)))
    assert at_the_bounds(agents, game, observer, disturbance=errors) == watch.INSIDE
    assert at_the_bounds(agents, bare, observer) == watch.LEFT_SET


@pytest.mark.parametrize(
    ("options", "said"),
    [
        ({"faults": (SensorDelay(periods=1),)}, "faults: got 'late sensors'"),
        ({"faults": (NOISE,), "between": "guarded"}, "between: got 'guarded'.*truly are"),
    ],
)
def test_what_predictions_cannot_know_is_refused(sleds, options, said):
    with pytest.raises(InvalidInput, match=said):
        sled_system(sleds(), **options)


@pytest.mark.parametrize(
    ("push", "delay", "guarded", "said"),
    [
        (1.0, 0, False, "disturbance: got 'pushes'"),
        (0.0, 1, False, "disturbance: got 'late sensors'"),
        (0.0, 0, True, "guarded: got 'guarded'"),
    ],
)
def test_a_margin_of_such_robots_is_for_noise_alone(sleds, push, delay, guarded, said):
    declared = Disturbance(np.full(5, push), np.full(5, 0.05), delay)
    with pytest.raises(InvalidInput, match=said):
        beyond_estimates(sleds(), H, "euler", 4, declared, 0.0, guarded)
