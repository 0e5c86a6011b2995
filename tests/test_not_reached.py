"""Why y* was not reached: each reason by a tiny MJCF that has exactly that fault."""

import numpy as np
import pytest

import gne_mj as gm

CART = """
<mujoco>
  <option gravity="0 0 {gravity}" density="0"/>
  <worldbody>
    <body name="cart" euler="0 {slope} 0">
      <joint name="x" type="slide" axis="1 0 0" damping="{damping}" frictionloss="{friction}"
             {more}/>
      <geom type="box" size=".2 .1 .1" mass="{mass}" contype="0" conaffinity="0"/>
    </body>
  </worldbody>
  <actuator><motor name="drive" joint="x"/></actuator>
</mujoco>
"""
SOUND = {"gravity": 0, "slope": 0, "damping": 0, "friction": 0, "more": "", "mass": 1}
ROLLER = """
<mujoco>
  <worldbody>
    <geom type="plane" size="9 9 1" friction="0.1 0.005 0.0001"/>
    <body name="car" pos="0 0 .1">
      <joint name="x" type="slide" axis="1 0 0"/><joint name="z" type="slide" axis="0 0 1"/>
      <geom type="box" size=".3 .1 .02" pos="0 0 .2" mass="2" contype="0" conaffinity="0"/>
      <body name="axle">
        <joint name="spin" axis="0 1 0"/>
        <geom name="tyre" type="sphere" size=".1" mass=".5" friction="0.1 0.005 0.0001"/>
      </body>
    </body>
  </worldbody>
  <actuator><motor name="drive" joint="spin"/></actuator>
</mujoco>
"""


def wanting(y, count=2):
    """A game in which each agent wants y."""
    return gm.game(
        count, lambda i, y, p: 0.5 * p.weight * (y[i] - p.wanted) ** 2,
        lambda y, p: [("room", (y**2).sum() <= p.room)], weight=5.0, wanted=y, room=1e3 * y**2,
    )  # fmt: skip


def why(
    file, *, wanted=0.5, count=2, duration=6.0, output="x", input="drive", faults=None, **agents
):
    """The reasons of a run from rest, by their words."""
    run = gm.run(
        wanting(wanted, count), agents=gm.mjcf_robots(
            count, file, output=output, input=input, spacing=1.0, **agents
        ), law=gm.full_information(mode="implicit"), rho=1e-4, start=0.0, duration=duration,
        timestep=0.002, control_period=0.01, integrator="euler", faults=faults,
    )  # fmt: skip
    assert run.status in ("completed", "converged")
    (report,) = run.reports.values()
    found = report["not_reached"]
    if found is None:
        return None, run
    assert all(each["text"] in str(run) for each in found)
    return {each["reason"]: each for each in found}, run


def cart(**faults):
    return CART.format(**{**SOUND, **faults})


def test_a_sound_cart_reaches_it_and_nothing_is_told():
    found, run = why(cart())
    assert found is None
    assert "not reached" not in str(run)


def test_one_sample_does_not_show_that_outputs_rest():
    """Half of the way is gone in a run whose last twentieth has one sample."""
    from gne_mj.not_reached import Ended

    time, action = np.array([0.0, 0.1, 0.2, 0.3]), np.array([[0.0], [1.0], [2.0], [3.0]])
    ended = Ended(None, time, action, np.zeros((4, 1)), 6.0 - action[:, 0], 0.3, None)
    assert not ended.rests[0]
    assert Ended(None, time, 0.0 * action, action, 6.0 + 0.0 * time, 0.3, None).rests[0]
    alone = Ended(None, time[:1], action[:1], action[:1], time[:1], 0.3, None)
    assert alone.tail.tolist() == [True]


@pytest.mark.parametrize(
    ("fault", "kind", "load"),
    [
        ({"damping": 5.0}, "damping", lambda y: 5.0 * y),
        ({"friction": 0.7}, "dry friction", lambda y: 0.7),
        ({"gravity": -10, "slope": 5}, "gravity", lambda y: -10 * np.sin(np.radians(5))),
    ],
)
def test_a_load_of_the_files_own_is_told_with_its_size(fault, kind, load):
    """Rest is where w (y* - y) = D(y); the load's kind and size are those of the file."""
    found, run = why(cart(**fault))
    assert list(found) == ["load"]
    end = float(run.data["action"][-1, 0])
    expected = load(end)
    assert 5.0 * (0.5 - end) == pytest.approx(expected, rel=0.01)
    parts = found["load"]["figures"]["parts"]
    assert parts[kind] == pytest.approx(expected, rel=0.01)
    assert sum(map(abs, parts.values())) == pytest.approx(abs(expected), rel=0.01)
    assert kind in found["load"]["text"]


@pytest.mark.slow  # compiles, or starts programs, for seconds
def test_a_push_is_told_where_nothing_of_the_file_holds():
    found, _ = why(cart(), faults=[gm.push(1.0, agents=[2])])
    assert list(found) == ["load"]
    assert found["load"]["figures"]["pushed"] == [2]
    assert found["load"]["agents"] == [2]


def test_a_limit_is_told_with_its_share_of_the_time():
    found, _ = why(cart(damping=5.0), input_limit=0.2)
    assert "limit" in found
    assert found["limit"]["figures"]["at_end"]
    assert found["limit"]["figures"]["share"][0] > 0.9


def test_a_joint_at_its_stop_is_told_by_name():
    found, _ = why(cart(more='limited="true" range="-1 1"'))
    assert found["stop"]["agents"] == [1, 2]
    assert "'x'" in found["stop"]["text"]


def test_wheels_that_slip_are_told():
    """A friction of 0.1 gives 2.5 N at most; a wheel that is driven harder spins."""
    found, _ = why(
        ROLLER, wanted=3.0, count=1, duration=1.0, contacts="floor", input_limit=1.0
    )  # fmt: skip
    assert "slip" in found
    assert "tyre" in found["slip"]["text"]


def test_a_run_that_is_too_short_says_when_it_would_settle():
    """Of M y' = -w (y - y*) the distance falls by exp(-w t / M): 2% after 3.9 M/w."""
    found, _ = why(cart(mass=20), duration=3.0)
    assert list(found) == ["short"]
    figures = found["short"]["figures"]
    assert figures["time_constant"] == pytest.approx(20.0 / 5.0, rel=0.02)
    assert figures["settles"] == pytest.approx(4.0 * np.log(50.0), rel=0.02)


def test_outputs_that_are_kept_moving_are_told_with_what_moves_them():
    """A push of 2 N that swings once a second."""
    found, _ = why(cart(), faults=[gm.push(2.0, profile="sine", period=1.0)])
    assert list(found) == ["moving"]
    assert "under push" in found["moving"]["text"]


def test_looking_for_reasons_leaves_a_run_as_it_was():
    """A simulation that is looked at in between ends at the same bits."""
    scenario = gm.setup(
        wanting(0.5), agents=gm.mjcf_robots(2, cart(damping=5.0), output="x", input="drive"),
        law=gm.full_information(mode="implicit"), start=0.0, duration=1.0, timestep=0.002,
    )  # fmt: skip
    whole, parts = scenario.simulation_object(), scenario.simulation_object()
    whole.advance(500)
    parts.advance(250)
    parts.trajectory()
    parts.advance(250)
    ends = [each.trajectory()[scenario.name_of(None)]["state"][-1] for each in (whole, parts)]
    assert np.array_equal(*ends)
