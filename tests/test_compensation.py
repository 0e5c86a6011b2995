"""Mode implicit with compensation: what files have of drag and friction shifts nothing."""

import mujoco
import numpy as np
import pytest
from scipy.optimize import brentq

import gne_mj as gm
from gne_mj.errors import InvalidInput

CART = """
<mujoco><option gravity="0 0 0"/><worldbody><body>
  <joint name="x" type="slide" axis="1 0 0" damping="3" frictionloss="{dry}"/>
  <geom size="0.1" mass="2"/>
</body></worldbody><actuator><motor name="push" joint="x"/></actuator></mujoco>
"""
H, PERIOD = 0.002, 0.01


def cost(i, y, p):
    return 0.5 * (y[i] - p.wanted[i]) ** 2


def constraints(y, p):
    yield "fast", y[0] <= p.limit


def run(wanted, dry=0.0, count=1, duration=0.5, **law):
    game = gm.game(count, cost, constraints, wanted=wanted, limit=0.6)
    robots = gm.mjcf_robots(count, CART.format(dry=dry), output="x", input="push")
    return gm.run(
        game, agents=robots, law=gm.full_information(mode="implicit", **law), rho=0.05,
        start=np.zeros(count), duration=duration, timestep=H, control_period=PERIOD,
        sample_period=PERIOD, integrator="euler",
    )  # fmt: skip


@pytest.mark.parametrize("observer", [0.0, pytest.param(0.5, marks=pytest.mark.slow)])
def test_outputs_are_implicit_steps_of_the_law_alone(observer):
    """Against a scalar equation with the slope that bare MuJoCo has; drag is not in it."""
    model = mujoco.MjModel.from_xml_string(CART.format(dry=0.0))
    model.opt.timestep = H
    data = mujoco.MjData(model)
    data.ctrl[0] = 1.0
    mujoco.mj_step(model, data, 5)
    slope, y = data.qvel[0], 0.0  # from rest
    seen = run([1.0], compensation=True, observer=observer).data["action"].values[:, 0]
    for at, found in enumerate(seen[1:]):
        y = brentq(lambda z, y=y: z - y - slope * (1.0 - z - 0.05 / (0.6 - z)), -9.0, 0.6 - 1e-12)
        assert found == pytest.approx(y, abs=1e-9), at


def test_dry_friction_does_not_hold_robots_from_their_equilibrium():
    """From rest, where the law alone asks for less than friction holds."""
    wanted = [0.3, 0.2]
    for compensation in (False, True):
        result = run(wanted, dry=0.7, count=2, duration=20.0, compensation=compensation)
        report = next(iter(result.reports.values()))
        away = report["equilibrium"]["final_distance"]
        assert away < 1e-3 if compensation else away > 0.1
        assert np.all(result.data["action"].values[:, 0] < 0.6)


@pytest.mark.parametrize(
    ("law", "agents", "words"),
    [
        ({"mode": "sampled"}, None, "use mode 'implicit'"),
        ({"mode": "implicit", "between": "guarded"}, None, "between = 'watched'"),
        ({"mode": "implicit"}, gm.integrators(1), "it is for MJCF robots"),
    ],
)
def test_where_nothing_is_predicted_to_stay_it_is_refused(law, agents, words):
    game = gm.game(1, cost, constraints, wanted=[1.0], limit=0.6)
    robots = gm.mjcf_robots(1, CART.format(dry=0.0), output="x", input="push")
    with pytest.raises(InvalidInput, match=words):
        gm.run(
            game, agents=agents or robots, law=gm.full_information(compensation=True, **law),
            duration=0.1, control_period=PERIOD,
        )  # fmt: skip
