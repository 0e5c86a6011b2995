"""What is told of a robot before it plays, against closed forms and MuJoCo's own numbers."""

import json
import tomllib

import mujoco
import numpy as np
import pytest
from commands import gne_here
from low_level_robots import QUADROTOR

import gne_mj as gm
from gne_mj.errors import InvalidInput

CART = """
<mujoco>
  <option gravity="0 0 {gravity}"/>
  <worldbody>
    <body name="cart" euler="0 {slope} 0">
      <joint name="x" type="slide" axis="1 0 0" damping="{damping}" frictionloss="{friction}"
             stiffness="{stiffness}" {more}/>
      <geom type="box" size=".2 .1 .1" mass="2" contype="0" conaffinity="0"/>
      <body pos="0 0 .1">
        <joint name="mast" type="slide" axis="1 0 0" stiffness="8" damping="{between}"/>
        <geom size=".05" mass="1" contype="0" conaffinity="0"/>
      </body>
    </body>
  </worldbody>
  <actuator>{actuator}</actuator>
</mujoco>
"""
SOUND = {
    "gravity": 0, "slope": 0, "damping": 0, "friction": 0, "stiffness": 0, "more": "",
    "between": 1, "actuator": '<motor name="drive" joint="x"/>',
}  # fmt: skip
PLAIN = """
<mujoco>
  <option gravity="0 0 0"/>
  <worldbody>
    <body><joint name="x" type="slide" axis="1 0 0" {joint}/>
      <geom size=".1" mass="2" contype="0" conaffinity="0"/></body>
  </worldbody>
  <actuator><motor name="drive" joint="x"/></actuator>
</mujoco>
"""


def look(output="x", passivity=False, at=0.5, input="drive", **faults):
    text = CART.format(**{**SOUND, **faults})
    return gm.examine(text, output=output, input=input, at=at, passivity=passivity)


def test_a_sound_robot_needs_nothing_to_be_held_and_its_slope_is_the_masses():
    """Over a step the cart's mass alone is moved: dy+/du = h / 2 kg; over longer periods both."""
    seen = look()
    assert seen.rest.held
    assert seen.wished.held
    assert np.abs([*seen.rest.input, *seen.wished.input]).max() < 1e-9
    h = seen.slopes.periods[0]
    assert seen.slopes.least[0] == pytest.approx(h / 2.0, rel=5e-3)
    assert seen.slopes.rising(False) == seen.slopes.periods
    assert seen.degrees == [1]
    assert seen.limits == [np.inf]
    assert not seen.recommendation.cautions


UPHILL = 3.0 * 9.81 * np.sin(np.radians(4.0))  # of cart and mast, x being upwards


@pytest.mark.parametrize(
    ("fault", "rest", "wished", "kind"),
    [
        ({"damping": 3}, 0.0, 1.5, "damping"),
        ({"friction": 0.8}, 0.0, 0.8, "dry friction"),
        ({"gravity": -9.81, "slope": -4}, UPHILL, UPHILL, "gravity"),
    ],
)
def test_what_holds_it_is_the_files_load(fault, rest, wished, kind):
    """c v at 0 and 0.5 m/s, dry friction once it moves, and the weight along a slope."""
    seen = look(between=6, **fault)
    assert seen.rest.input[0] == pytest.approx(rest, rel=0.01, abs=1e-3)
    assert seen.wished.input[0] == pytest.approx(wished, rel=0.01)
    parts = seen.wished.parts
    # the mast's weight comes by its spring
    assert parts[kind][0] + parts["springs"][0] == pytest.approx(wished, rel=0.02)
    assert kind in str(seen)
    assert "rest where costs rise" in str(seen)


def test_relative_degrees_are_those_of_the_equations():
    """Of the mast behind a damper 2, behind a spring alone 3; a filter adds one."""
    assert look("mast").degrees == [1]  # a relative joint: the cart's own acceleration moves it
    mast = {"sum": [{"joint": "x"}, {"joint": "mast"}]}
    assert look(mast).degrees == [2]
    assert look(mast, between=0).degrees == [3]
    late = '<general name="drive" joint="x" dyntype="filter" dynprm="0.1"/>'
    assert look(actuator=late).degrees == [2]
    text = str(look(mast))
    assert "relative degree is 2" in text


def test_limits_and_what_holding_asks_of_them():
    """Two of the file's gear hold 3 N s/m of drag up to 2/3 m/s."""
    limited = '<motor name="drive" joint="x" gear="2" ctrlrange="-1 1"/>'
    seen = look(damping=3, actuator=limited)
    assert seen.limits == [2.0]
    assert seen.wished.held
    assert seen.recommendation.tables["systems"]["robots"]["agents"]["input_limit"] == 2.0
    far = look(damping=3, actuator=limited, at=1.0)
    assert not far.wished.held
    assert "inputs are at the limit 2" in far.wished.why
    assert far.wished.output[0] == pytest.approx(2.0 / 3.0, rel=0.01)


def test_a_stop_is_named_and_a_look_ahead_advised():
    seen = look(more='limited="true" range="-.2 .2"')
    assert seen.wished.why.startswith("joint 'x' is at its stop")
    assert any("lookahead" in each for each in seen.recommendation.cautions)


@pytest.mark.parametrize(
    ("joint", "fastest", "rk4", "euler"),
    [
        # x'' = -w^2 x: RK4's stability ends at 2 sqrt(2) / w, semi-implicit Euler's at 2 / w
        ('stiffness="20000"', 100.0, 2.0 * np.sqrt(2.0) / 100.0, 2.0 / 100.0),
        # v' = -c/m v: RK4's ends at 2.7853 m/c; MuJoCo's Euler takes dampers implicitly
        ('damping="1000"', 500.0, 2.785293 / 500.0, 0.2),
    ],
)
def test_the_longest_stable_steps_are_those_of_the_methods(joint, fastest, rk4, euler):
    """In closed form, of an oscillator and of a damped mass."""
    seen = gm.examine(
        PLAIN.format(joint=joint), output="x", input="drive", passivity=False
    )  # fmt: skip
    assert seen.steps.fastest == pytest.approx(fastest, rel=1e-3)
    assert seen.steps.longest["rk4"] == pytest.approx(rk4, rel=0.03)
    assert seen.steps.longest["euler"] == pytest.approx(euler, rel=0.03)


def test_an_input_the_wrong_way_round_is_turned():
    seen = look(input={"actuators": ["drive"], "factors": [-2.0]})
    agents = seen.recommendation.tables["systems"]["robots"]["agents"]
    assert agents["input"] == {"actuators": ["drive"], "factors": [2.0]}
    assert "falls where its input rises" in str(seen)


def test_the_transition_is_that_of_mujoco():
    """Against mjd_transitionFD, whose controls and step are the same."""
    from gne_mj.examination.bench import bench
    from gne_mj.examination.proposal import agents_of
    from gne_mj.examination.stable_steps import transition
    from gne_mj.interface.agents import path_of

    path = path_of(CART.format(**{**SOUND, "damping": 3, "stiffness": 5}))
    own = bench(agents_of(path, "x", "drive", 1), 0.01, "euler")
    found = transition(own, own.start, np.zeros(1))
    own.go(own.start)
    model, data = own.plant.model, own.plant.data
    expected = np.zeros((4, 4))
    mujoco.mjd_transitionFD(model, data, 1e-6, True, expected, None, None, None)
    np.testing.assert_allclose(found, expected, atol=1e-7)


@pytest.mark.slow  # compiles, or starts programs, for seconds
def test_what_is_proposed_runs_and_reaches(tmp_path):
    """A file alone: output and input are found, and the recommended scenario settles."""
    file = tmp_path / "cart.xml"
    file.write_text(CART.format(**SOUND), encoding="utf-8")
    seen = gm.examine(file)
    assert seen.usable
    assert seen.passivity.startswith("no violation found")
    agents = seen.recommendation.tables["systems"]["robots"]["agents"]
    assert (agents["output"], agents["input"]) == ("x", "drive")
    run = gm.run(tomllib.loads(seen.recommendation.toml))
    assert run.reports["robots"]["settling_time"] < 8.0


def test_a_file_without_a_way_to_move_is_told_so():
    still = "<mujoco><worldbody><geom type='plane' size='1 1 1'/></worldbody></mujoco>"
    seen = gm.examine(still)
    assert not seen.usable
    assert "No actuator" in str(seen)


def test_what_cannot_be_examined_is_refused_by_name():
    text = CART.format(**SOUND)
    for key, given in (
        ("output", {"output": "y", "input": "drive"}),
        ("input", {"output": "x"}),
        ("at", {"output": "x", "input": "drive", "at": np.nan}),
    ):
        with pytest.raises(InvalidInput, match=rf"^{key}\b"):
            gm.examine(text, **given)


def test_tables_that_are_no_outputs_or_inputs_are_told_in_one_sentence():
    with pytest.raises(InvalidInput, match=r"^input\.body: got 3"):
        gm.examine(CART.format(**SOUND), output="x", input={"body": 3})
    with pytest.raises(InvalidInput, match=r"^at: got \[1\.0, 2\.0\], but it must be 1 finite"):
        gm.examine(CART.format(**SOUND), at=[1.0, 2.0], passivity=False)


def test_why_what_a_file_has_cannot_be_used_is_told():
    """A motor there is: that nothing is driven would be wrong."""
    ball = PLAIN.format(joint="").replace('type="slide" axis="1 0 0"', 'type="ball"')
    seen = gm.examine(ball)
    assert not seen.usable
    assert "No actuator" not in str(seen)
    assert "Output 'x' with input 'drive': " in str(seen)


def test_what_compensation_takes_off_is_no_caution():
    seen = look(damping=3)
    law = seen.recommendation.tables["systems"]["robots"]["controller"]
    assert law["compensation"]
    assert not any("rest where costs" in each for each in seen.recommendation.cautions)


def test_what_is_a_scenarios_alone_is_refused_of_a_robots_file():
    from gne_mj.interface.examining import of_source

    given = {"passivity": False, "scenario": None}
    with pytest.raises(InvalidInput, match=r"^changes: got 'a.b'"):
        of_source("x.xml", None, None, None, changes={"a.b": 1}, system=None, **given)
    with pytest.raises(InvalidInput, match=r"^system: got 'robots'"):
        of_source("x.xml", None, None, None, changes={}, system="robots", **given)


def test_robots_of_a_scenario_are_examined_at_their_equilibrium():
    seen = gm.examine("examples/robot/scenario.toml", agent=2, passivity=False)
    assert seen.file.endswith("cart.xml")
    assert seen.wished.wanted == pytest.approx([2.0])


HIGH = '<key name="high" qpos="0 0 1.5 1 0 0 0"/><key name="low" qpos="0 0 0.0299 1 0 0 0"/>'
FLYING = (
    QUADROTOR.replace(
        "</worldbody>",
        """
  <geom name="ground" type="plane" size="5 5 1"/>
</worldbody><keyframe>KEYS</keyframe>""",
    )
    .replace("KEYS", HIGH)
    .replace(
        'size="0.1 0.1 0.03" mass="0.6" contype="0" conaffinity="0"',
        'size="0.1 0.1 0.03" mass="0.6"',
    )
)
FLIES = {
    "output": {"body": "frame", "axes": ["x", "y", "z"]},
    "input": {"controller": "quadrotor", "rotors": ["m1", "m2", "m3", "m4"]},
}


def test_a_quadrotor_is_to_begin_in_the_air_and_to_be_followed_at_its_centre():
    """The battery hangs 0.2 / 0.8 of (2, 1, -5) cm off the frame's origin."""
    off = f"{25.0 * np.sqrt(30.0) / 100.0:.2g} cm from the output's point"
    for keyframe, stands in (("high", False), ("low", True)):
        seen = gm.examine(FLYING, keyframe=keyframe, passivity=False, **FLIES)
        assert [each.name for each in seen.offers if each.kind == "keyframe"] == ["high", "low"]
        assert seen.recommendation.tables["systems"]["robots"]["agents"]["keyframe"] == keyframe
        assert stands == any(
            "It stands on something" in each for each in seen.recommendation.cautions
        )
        assert any(off in each for each in seen.recommendation.cautions)
    centre = FLYING.replace(
        '<site name="r1"', '<site name="c" pos=".005 .0025 -.0125"/><site name="r1"'
    )
    seen = gm.examine(
        centre, passivity=False, keyframe="high", input=FLIES["input"],
        output={"site": "c", "axes": ["x", "y", "z"]},
    )  # fmt: skip
    assert not any("centre of mass" in each for each in seen.recommendation.cautions)
    with pytest.raises(InvalidInput, match=r"^keyframe: got 'hgih', .*; did you mean 'high'"):
        gm.examine(FLYING, keyframe="hgih", **FLIES)


def test_an_agent_of_a_scenario_is_examined_where_and_as_it_begins(tmp_path):
    (tmp_path / "drone.xml").write_text(FLYING, encoding="utf-8")
    game = gm.game(
        2, lambda i, y, p: (y[i] - 0.2) @ (y[i] - 0.2),
        lambda y, p: [("gap", (y[0] - y[1]) @ (y[0] - y[1]) <= 1.0)], dimension=3,
    )  # fmt: skip
    agents = gm.mjcf_robots(
        2, tmp_path / "drone.xml", keyframe=["high", "low"], **FLIES,
        poses=[[0, 0, 0], {"position": [3, 0, 0], "quaternion": [1, 0, 0, 1]}],
    )  # fmt: skip
    law = gm.full_information(mode="sampled")
    made = gm.setup(game, agents=agents, law=law, start=np.zeros((2, 3)))
    for agent, stands in ((1, False), (2, True)):
        seen = gm.examine(made, agent=agent, passivity=False)
        assert stands == any("It stands on" in each for each in seen.recommendation.cautions)


def test_what_lags_may_rise_over_long_periods_only():
    from gne_mj.examination.responses import Slopes

    seen = Slopes([1.0, 2.0, 3.0, 4.0], [-1.0, 1.0, 2.0, -1.0], [1.0] * 4, [1.0] * 4, 9, 0.0)
    assert seen.rising(lags=True) == [2.0, 3.0]
    assert seen.rising(lags=False) == []


def test_the_command(tmp_path, monkeypatch):
    (tmp_path / "cart.xml").write_text(CART.format(**SOUND), encoding="utf-8")
    monkeypatch.chdir(tmp_path)
    done = gne_here("examine", "cart.xml", "--no-passivity", "--scenario", "made.toml", "--json")
    assert done.returncode == 0, done.stderr
    report = json.loads(done.stdout)["cart.xml"]
    assert report["limits"] == [None]
    made = tomllib.loads((tmp_path / "made.toml").read_text(encoding="utf-8"))
    assert made["systems"]["robots"]["agents"]["file"] == "cart.xml"
    gone = gne_here("examine", "gone.xml")
    assert gone.returncode == 2
    assert gone.stderr.count("\n") == 1


def told(text, **options):
    """What is told before a run of two such robots."""
    game = gm.game(
        2, lambda i, y, p: (y[i] - 0.5) ** 2, lambda y, p: [("gap", abs(y[0] - y[1]) <= 2.0)]
    )
    given = {"timestep": 0.002, "control_period": 0.01, "duration": 0.1, "start": 0.0, **options}
    agents = gm.mjcf_robots(
        2, text, output="x", input=given.pop("input", "drive"), spacing=1.0,
        input_limit=given.pop("input_limit", None),
    )  # fmt: skip
    made = gm.setup(game, agents=agents, law=gm.full_information(mode="sampled"), **given)
    (found,) = made.simulation_object().doubts().values()
    return found


def test_what_a_file_was_made_for_is_told_once_for_two_robots():
    finer = CART.format(**SOUND).replace("<mujoco>", '<mujoco><option timestep="0.001"/>', 1)
    (words,) = told(finer)
    assert words.endswith("was made for steps of 1 ms, and these are 2 ms")
    assert told(finer, timestep=0.001) == []


def test_before_a_run_only_what_is_wrong_is_told():
    """One fault a file; a sound one and one that falls over by itself are nothing to tell."""
    assert told(CART.format(**SOUND)) == []
    assert told(PLAIN.format(joint='stiffness="-20"')) == []
    stiff = PLAIN.format(joint='stiffness="20000"')  # stable up to 28 ms with rk4
    assert told(stiff, timestep=0.01) == []
    (long,) = told(stiff, timestep=0.05, control_period=0.05, duration=0.5)
    assert "beyond the longest stable step" in long
    (turned,) = told(CART.format(**SOUND), input={"actuators": ["drive"], "factors": [-1.0]})
    assert "does not rise with its input" in turned
    slope = CART.format(**{**SOUND, "gravity": -9.81, "slope": -10})
    (weak,) = told(slope, input_limit=2.0)
    assert "beyond its limit 2" in weak
    need = 2.0 * 9.81 * np.sin(np.radians(10.0))
    asked = float(weak.split("about ")[1].split(",")[0])
    assert asked == pytest.approx(need, rel=0.01)
