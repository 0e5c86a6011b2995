"""The shipped fleets with quadrotors: what their rotors give, and that they arrive as declared."""

import mujoco
import numpy as np
import pytest

import gne_mj as gm
from gne_mj.plants.fleet import read_model
from gne_mj.scenario import load_scenario
from gne_mj.theory import certify


def test_a_drone_hovers_on_equal_thrusts_and_each_rotor_turns_it_as_its_place_says():
    """Newton and Euler by hand: forces at arms, and drag moments of rotors that turn in turn."""
    model = mujoco.MjModel.from_xml_string(read_model("drone.xml"))
    data = mujoco.MjData(model)
    hover = 0.38 * 9.81 / 4
    data.ctrl[:] = hover
    mujoco.mj_forward(model, data)
    np.testing.assert_allclose(data.qacc, 0.0, atol=1e-12)
    for k, (x, y, turn) in enumerate([(1, 1, 1), (-1, 1, -1), (-1, -1, 1), (1, -1, -1)]):
        data.ctrl[:] = hover
        data.ctrl[k] += 0.5
        mujoco.mj_forward(model, data)
        moment = 0.5 * np.array([0.078 * y, -0.078 * x, 0.012 * turn])
        expected = [0, 0, 0.5 / 0.38, *(moment / [0.00095, 0.00095, 0.0017])]
        np.testing.assert_allclose(data.qacc, expected, atol=1e-9)


def test_without_wind_drones_agree_on_a_velocity_and_the_prediction_is_the_run():
    still = {"simulation.duration": 4.0, "faults": []}
    report = gm.run("drones", still).reports["drones"]
    assert report["status"] == "converged"
    assert report["implicit"]["largest_prediction_error"] < 1e-12
    scenario = load_scenario("drones")
    found = certify(scenario.system_objects()[0], scenario.clock())
    assert found.guaranteed == ["nothing"]  # of lags and thrusts nothing is proven


@pytest.mark.slow
@pytest.mark.parametrize("name", ["drones", "drones-apart", "mixed"])
def test_shipped_fleets_arrive_inside_and_touch_nothing(name):
    run = gm.run(name)
    (report,) = run.reports.values()
    assert report["status"] == "converged"
    assert report["contacts"]["count"] == 0
    if name == "drones-apart":
        assert report["separation"]["least_distance"] > 0.7
        assert report["separation"]["too_near"] == 0
