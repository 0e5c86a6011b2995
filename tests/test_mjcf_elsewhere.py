"""Robots that other packages ship, by name; and what their files have that ours do not."""

import sys
from types import SimpleNamespace

import mujoco
import numpy as np
import pytest

import gne_mj
from gne_mj import extras
from gne_mj.errors import InvalidInput, MissingExtra
from gne_mj.plants import mjcf_file
from gne_mj.plants.callbacks import quiet
from gne_mj.plants.mjcf_fleet import MjcfPlant
from gne_mj.plants.mjcf_input import Input
from gne_mj.plants.mjcf_robot import RobotFile, mjcf_robots
from gne_mj.plants.mjcf_source import located

ALONG = {"body": "torso", "axes": ["x"]}
# Of each the output, the input and its limit, or the sentence in which its fleet ends
FLEETS = {
    "dm_control:cartpole": ("slider", "slide", 10.0),
    "dm_control:cheetah": ("bthigh", "bthigh", 120.0),
    "dm_control:finger": ("proximal", "proximal", 30.0),
    "dm_control:fish": (ALONG, ALONG, None),
    "dm_control:quadruped": (ALONG, "yaw_front_left", "it is a position servo of stiffness 1000"),
    "dm_control:swimmer": ("rootx", {"body": "head"}, None),
    "gymnasium:ant": ("hip_1", "hip_1", 150.0),
    "gymnasium:half_cheetah": ("bthigh", "bthigh", 120.0),
    "gymnasium:hopper": ("thigh_joint", "thigh_joint", 200.0),
    "gymnasium:pusher": ("r_shoulder_pan_joint", "r_shoulder_pan_joint", 2.0),
}


def plant_of(name, output, drives, robots=2):
    robot = RobotFile(located(name), output, drives)
    return MjcfPlant(mjcf_robots((robot,) * robots, np.ones(robots)), 0.002)


def _cost(i, y, p):
    return 0.5 * (y[i] - p.wanted[i]) ** 2


def _constraints(y, p):
    for i in range(1, len(y)):
        yield f"gap {i}", abs(y[i] - y[i - 1]) <= p.gap


@pytest.mark.slow
@pytest.mark.parametrize("name", FLEETS)
def test_ten_bodies_run_as_fleets_of_four_or_say_what_is_missing(name, capfd):
    """Those of the table in docs/robots.md; MuJoCo says nothing meanwhile."""
    output, drives, end = FLEETS[name]
    game = gne_mj.game(4, _cost, _constraints, wanted=[0.2, 0.3, 0.4, 0.5], gap=1.0)
    refused = isinstance(end, str)
    robots = gne_mj.mjcf_robots(
        4, name, output=output, input=drives, input_limit=None if refused else end
    )
    if refused:
        with pytest.raises(InvalidInput, match=end):
            gne_mj.run(game, agents=robots, rho=0.01, duration=2.0, timestep=0.002)
    else:
        run = gne_mj.run(game, agents=robots, rho=0.01, duration=2.0, timestep=0.002)
        assert run.status == "completed"
    assert capfd.readouterr() == ("", "")


def test_a_package_that_ships_no_such_robot_names_the_nearest():
    with pytest.raises(InvalidInput, match="no such robot; did you mean 'walker'"):
        located("dm_control:walkr")
    assert located("gymnasium:ant") == located("gymnasium:ant.xml")


@pytest.mark.parametrize(
    ("name", "extra"),
    [
        ("dm_control:walker", "learning"),
        ("gymnasium:ant", "learning"),
        ("menagerie:x", "menagerie"),
    ],
)
def test_a_package_that_is_not_there_is_told_with_its_extra(monkeypatch, name, extra):
    monkeypatch.setattr(extras, "find_spec", lambda package: None)
    with pytest.raises(MissingExtra) as caught:
        located(name)
    assert str(caught.value).startswith(f"the robot {name} needs ")
    assert f"pip install 'gne-mj[{extra}]'" in str(caught.value)


@pytest.fixture
def menagerie(monkeypatch, tmp_path):
    """A stand-in of the package, with one robot that is there once its folder is."""
    robot = SimpleNamespace(
        entry_names=("scene", "hand"),
        xml=lambda entry, cache: tmp_path / f"{entry or 'scene'}.xml",
    )
    cache = SimpleNamespace(root=None, is_cached=lambda robot: (tmp_path / "there").is_dir())
    module = SimpleNamespace(
        names=lambda: ["arm"], get={"arm": robot}.__getitem__, Cache=lambda: cache
    )
    monkeypatch.setitem(sys.modules, "mujoco_menagerie", module)
    monkeypatch.setattr(extras, "find_spec", lambda package: True)
    return tmp_path


def test_a_menagerie_robot_is_never_downloaded_unasked(menagerie):
    with pytest.raises(InvalidInput, match="first: mujoco-menagerie prefetch arm"):
        located("menagerie:arm")
    (menagerie / "there").mkdir()
    assert located("menagerie:arm") == menagerie / "scene.xml"
    assert located("menagerie:arm/hand") == menagerie / "hand.xml"
    for wrong in ("menagerie:harm", "menagerie:arm/hnd"):
        with pytest.raises(InvalidInput, match="did you mean"):
            located(wrong)


def test_each_robot_has_the_mass_that_its_file_asks_for():
    """The cheetah asks for a total: MuJoCo alone gives it the same masses and inertias."""
    path = located("gymnasium:half_cheetah")
    with quiet():
        alone = mujoco.MjModel.from_xml_path(str(path))
    fleet = plant_of("gymnasium:half_cheetah", "bthigh", "bthigh").model
    for robot in (1, 2):
        bodies = [
            fleet.body(f"robot_{robot}/{alone.body(k).name}").id for k in range(1, alone.nbody)
        ]
        np.testing.assert_allclose(fleet.body_mass[bodies], alone.body_mass[1:], rtol=1e-12)
        np.testing.assert_allclose(fleet.body_inertia[bodies], alone.body_inertia[1:], rtol=1e-12)
    assert alone.body_mass.sum() == pytest.approx(14.0)


def test_actuators_without_a_name_are_called_by_what_they_drive():
    names = [actuator.name for actuator in mjcf_file.read(located("gymnasium:ant")).actuators]
    assert {"hip_1", "ankle_1", "hip_4"} < set(names)


def test_a_force_at_a_body_is_none_of_the_files_defaults():
    """The swimmer's motors are limited to 1 by its defaults."""
    push = Input(kind="body", name="head", axis=0)
    model = plant_of("dm_control:swimmer", "rootx", push).model
    assert not model.actuator_ctrllimited.any()
    assert np.all(np.isin(model.actuator_gear, (0.0, 1.0)))
