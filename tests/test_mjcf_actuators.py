"""What actuators of a user's robot do: made a force, or refused in one sentence."""

import mujoco
import numpy as np
import pytest

from gne_mj.errors import InvalidInput
from gne_mj.plants.mjcf_fleet import MjcfPlant
from gne_mj.plants.mjcf_robot import RobotFile, mjcf_robots

MASS = 3.0
CART = """
<mujoco>
  <option gravity="0 0 0">{flags}</option>
  <worldbody>
    <body name="cart">
      <joint name="x" type="slide" axis="1 0 0" {joint}/>
      <geom size="0.1" mass="2" contype="0" conaffinity="0"/>
      <site name="front"/>
      <body><joint name="lean" axis="0 1 0" stiffness="9"/><site name="top" pos="0 0 1"/>
        <geom size="0.1" mass="1" contype="0" conaffinity="0"/></body>
    </body>
  </worldbody>
  <tendon><fixed name="cable" {tendon}><joint joint="x" coef="2"/></fixed></tendon>
  <actuator>{before}{actuator}</actuator>
  <sensor>
    <actuatorvel name="own" actuator="u"/>
    <tendonvel name="winding" tendon="cable"/>
    {sensor}
  </sensor>
</mujoco>
"""
NOTHING = {"flags": "", "joint": "", "tendon": "", "before": "", "sensor": ""}


def cart(folder, actuator, output="x", limit=np.inf, count=1, **more):
    path = folder / "cart.xml"
    path.write_text(CART.format(**{**NOTHING, **more}, actuator=actuator))
    robots = (RobotFile(path, output, "u"),) * count
    return MjcfPlant(mjcf_robots(robots, np.full(count, limit)), 0.001, "euler")


FORCES = [
    ('<motor name="u" joint="x"/>', "x", 1.0),
    ('<motor name="u" joint="x" gear="-4"/>', "x", 1.0),
    ('<general name="u" joint="x" gainprm="5" gear="0.5"/>', "x", 1.0),
    ('<general name="u" joint="x" gaintype="affine" gainprm="5 0 0" gear="2"/>', "x", 1.0),
    ('<motor name="u" jointinparent="x" gear="7"/>', "x", 1.0),
    ('<motor name="u" joint="x" gear="10"/>', "own", 10.0),
    ('<motor name="u" tendon="cable" gear="3"/>', "winding", 2.0),
    ('<motor name="u" tendon="cable" gear="3"/>', "own", 6.0),
    ('<general name="u" site="front" gainprm="6" gear="1 0 0 0 0 0"/>', "x", 1.0),
    ('<position name="u" joint="x" kp="5" kv="2"/>', "x", 1.0),  # servos, inverted
    ('<velocity name="u" joint="x" kv="2" gear="-3"/>', "x", 1.0),
    ('<velocity name="u" tendon="cable" kv="2"/>', "winding", 2.0),
]


@pytest.mark.parametrize(("actuator", "output", "lever"), FORCES)
def test_an_input_is_the_force_that_goes_with_the_output(tmp_path, actuator, output, lever):
    """A cart of 3 kg: y = lever * velocity and u y is the power, so that a force is lever * u."""
    plant = cart(tmp_path, actuator, output)
    plant.reset([[0.6, 0.0]])
    u = 1.7
    plant.step([u], 200)
    expected = 0.6 + lever * (lever * u / MASS) * 0.2
    assert plant.output[0] == pytest.approx(expected, rel=1e-7)
    power = plant.data.qfrc_actuator @ plant.data.qvel
    assert power == pytest.approx(u * expected, rel=1e-5)


def test_a_force_that_follows_with_a_lag(tmp_path):
    """A cylinder fills by itself: u is the force that it comes to."""
    plant = cart(tmp_path, '<cylinder name="u" joint="x" area="0.02" timeconst="0.05"/>')
    plant.reset([[0.0, 0.0]])
    plant.step([2.0], 1000)
    assert plant.data.qfrc_actuator[0] == pytest.approx(2.0, rel=1e-6)


REFUSED = [
    ('<position name="u" joint="x" kp="5" timeconst="1"/>', "a position servo of stiffness 5"),
    (
        '<position name="u" joint="x" ctrlrange="-1 1"/>',
        "ctrlrange of a position servo would clamp",
    ),
    ('<velocity name="u" joint="x" kv="2" ctrlrange="-1 1"/>', "ctrlrange of a velocity servo"),
    ('<velocity name="u" joint="x" kv="2" delay="0.01" nsample="9"/>', "velocity servo of gain 2"),
    ('<intvelocity name="u" joint="x" kp="2"/>', "an integrated-velocity servo of stiffness 2"),
    ('<damper name="u" joint="x" kv="2" ctrlrange="0 1"/>', "depends on its length or velocity"),
    ('<cylinder name="u" joint="x" timeconst="1" bias="1 0 0"/>', "it has a bias force"),
    ('<muscle name="u" tendon="cable" lengthrange="0 1"/>', "it is a muscle"),
    ('<adhesion name="u" body="cart" ctrlrange="0 1"/>', "adhesion of a body"),
    ('<general name="u" cranksite="front" slidersite="top" cranklength="2"/>', "a slider-crank"),
    ('<dcmotor name="u" joint="x" motorconst="1" resistance="1"/>', "driven by a voltage"),
    ('<pid name="u" joint="x" kp="1"/>', "a PID servo"),
    ('<general name="u" joint="x" dyntype="integrator"/>', "the rate of its force"),
    ('<general name="u" joint="x" dyntype="user" actdim="1"/>', "dynamics of its own"),
    ('<general name="u" joint="x" biastype="user"/>', "its bias force is no number"),
    ('<general name="u" joint="x" gaintype="user"/>', "its gain is user code's"),
    ('<motor name="u" joint="x" gear="0"/>', "gain or gear is 0"),
    ('<general name="u" joint="x" gainprm="0"/>', "gain or gear is 0"),
]


@pytest.mark.parametrize(("actuator", "words"), REFUSED)
def test_what_is_no_force_is_refused(tmp_path, actuator, words):
    with pytest.raises(InvalidInput) as caught:
        cart(tmp_path, actuator)
    said = str(caught.value)
    assert caught.value.key == "agents.input"
    assert "in cart.xml" in said
    assert words in said
    assert "make it a <motor>" in said
    assert len(said) < 400


def test_an_actuator_that_is_switched_off_is_refused(tmp_path):
    motor = '<motor name="u" joint="x" group="2"/>'
    with pytest.raises(InvalidInput, match="options disable it"):
        cart(tmp_path, motor, flags='<flag actuation="disable"/>')
    path = tmp_path / "group.xml"
    text = CART.format(**NOTHING, actuator=motor).replace(
        "<option ", '<option actuatorgroupdisable="2" '
    )
    path.write_text(text)
    with pytest.raises(InvalidInput, match="options disable it"):
        MjcfPlant(mjcf_robots((RobotFile(path, "x", "u"),), np.full(1, np.inf)), 0.001)


CLAMPS = [
    ('<motor name="u" joint="x" gear="-4" ctrlrange="-2 3"/>', {}, 8.0),
    ('<motor name="u" joint="x" gear="-4" forcerange="-9 10"/>', {}, 36.0),
    ('<motor name="u" joint="x" gear="4"/>', {"joint": 'actuatorfrcrange="-5 6"'}, 5.0),
    ('<motor name="u" tendon="cable" gear="4"/>', {"joint": 'actuatorfrcrange="-5 6"'}, 2.5),
    ('<motor name="u" tendon="cable" gear="4"/>', {"tendon": 'actuatorfrcrange="-5 6"'}, 20.0),
    ('<cylinder name="u" joint="x" area="2" timeconst="1e-3" ctrlrange="-1 1"/>', {}, 2.0),
    (
        '<general name="u" joint="x" dyntype="filterexact" dynprm="1e-4" gainprm="3"'
        ' actrange="-2 2" ctrlrange="-9 9"/>',
        {},
        6.0,
    ),
]


@pytest.mark.parametrize(("actuator", "more", "least"), CLAMPS)
def test_the_limit_is_the_force_that_just_passes(tmp_path, actuator, more, least):
    output = "winding" if "tendon" in actuator else "x"
    with pytest.raises(InvalidInput, match=rf"agents.input_limit: got inf.*at most {least:g}$"):
        cart(tmp_path, actuator, output, **more)
    plant = cart(tmp_path, actuator, output, limit=least, **more)
    lever = 2.0 if output == "winding" else 1.0

    def delivered(u):
        plant.reset([[0.0, 0.0]])
        plant.step([u], 5)
        return plant.data.qfrc_actuator[0] / lever

    for sign in (-1.0, 1.0):
        assert delivered(sign * least) == pytest.approx(sign * least, rel=1e-9)
    beyond = [abs(delivered(sign * 1.5 * least)) for sign in (-1.0, 1.0)]
    assert min(beyond) == pytest.approx(least, rel=1e-9)


def test_clamps_that_do_not_act_and_ranges_of_one_sign(tmp_path):
    motor = '<motor name="u" joint="x" ctrlrange="-2 3"/>'
    plant = cart(tmp_path, motor, flags='<flag clampctrl="disable"/>')
    plant.reset([[0.0, 0.0]])
    plant.step([50.0])
    assert plant.data.qfrc_actuator[0] == 50.0
    with pytest.raises(InvalidInput, match="forces of both signs"):
        cart(tmp_path, '<motor name="u" joint="x" ctrlrange="0 3"/>')


def test_controls_are_not_counted_by_actuators(tmp_path):
    """A PID servo has two controls, so that the motor behind it has the third."""
    before = '<pid name="servo" joint="lean" kp="1"/>'
    plant = cart(tmp_path, '<motor name="u" joint="x"/>', before=before, count=2)
    assert plant.model.nu == 6
    plant.reset([[0.0, 0.0], [0.0, 0.0]])
    plant.step([6.0, -3.0], 100)
    assert np.allclose(plant.output, [0.2, -0.1], rtol=1e-6)


@pytest.mark.parametrize(
    "sensor",
    ['cutoff="1"', 'delay="0.01" nsample="4"', 'interval="0.01" nsample="4"'],
)
def test_a_sensor_that_tells_another_velocity_is_refused(tmp_path, sensor):
    motor = '<motor name="u" joint="x"/>'
    for kind in ('jointvel name="s" joint="x"', 'tendonvel name="s" tendon="cable"'):
        with pytest.raises(InvalidInput, match=r"agents.output.*cutoff, delay and interval"):
            cart(tmp_path, motor, "s", sensor=f"<{kind} {sensor}/>")


def test_sensors_that_are_switched_off_are_refused(tmp_path):
    motor, off = '<motor name="u" joint="x"/>', '<flag sensor="disable"/>'
    with pytest.raises(InvalidInput, match="switch sensors off"):
        cart(tmp_path, motor, "winding", flags=off)
    assert cart(tmp_path, motor, flags=off).output.shape == (1,)


def test_other_actuators_stay_as_they_are(tmp_path):
    before = '<position name="hold" joint="lean" kp="8"/>'
    plant = cart(tmp_path, '<motor name="u" joint="x" gear="3"/>', before=before)
    alone = mujoco.MjModel.from_xml_path(str(tmp_path / "cart.xml"))
    for name in ("gainprm", "biasprm"):
        own = getattr(plant.model, f"actuator_{name}")[0]
        assert np.array_equal(own, getattr(alone, f"actuator_{name}")[0])
