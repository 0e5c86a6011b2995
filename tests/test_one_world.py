"""Where a fleet's robots stand, and on what."""

import mujoco
import numpy as np
import pytest

import gne_mj as gm
from gne_mj.errors import InvalidInput
from gne_mj.plants.mjcf_fleet import MjcfPlant
from gne_mj.plants.mjcf_robot import MjcfAgents
from gne_mj.scenario import load_scenario

# A cart on a free joint and four wheels; its floor is its own
CART = """
<mujoco>
  <compiler angle="radian"/>
  <option timestep="0.002"/>
  <worldbody>
    <geom name="ground" type="plane" size="5 5 1"/>
    <body name="cart" pos="0 0 0.12">
      <freejoint/>
      <geom name="hull" type="box" size="0.2 0.1 0.05" mass="3"/>
      {wheels}
      <site name="tip" pos="0.2 0 0"/>
    </body>
  </worldbody>
  <actuator>
    <motor name="left" joint="w0"/>
    <general name="fan" joint="w2" dyntype="integrator" gainprm="0"/>
    <position name="brake" joint="w3" kp="1e-3" kv="1e-4"/>
  </actuator>
  {extra}
</mujoco>
"""
WHEEL = """
<body name="w{0}" pos="{1} {2} -0.05"><joint name="w{0}" axis="0 1 0" damping="0.01"/>
  <geom name="w{0}" type="ellipsoid" size="0.06 0.02 0.06" mass="0.2"/></body>"""
WHEELS = "".join(
    WHEEL.format(k, x, y)
    for k, (x, y) in enumerate([(0.15, 0.12), (0.15, -0.12), (-0.15, 0.12), (-0.15, -0.12)])
)
HILLS = """
<mujoco>
  <asset>
    <hfield name="hills" nrow="3" ncol="3" size="6 6 0.5 0.1" elevation="0 0 1 0 0 1 0 0 1"/>
    <texture name="dusk" type="skybox" builtin="gradient" width="8" height="48"/>
  </asset>
  <worldbody>
    <light name="lamp" pos="0 0 5"/>
    <geom name="hills" type="hfield" hfield="hills"/>
    <body name="rock" pos="2 2 0"><geom name="rock" size="0.3"/></body>
    {extra}
  </worldbody>
</mujoco>
"""


def cart(folder, extra="", name="cart.xml"):
    path = folder / name
    path.write_text(CART.format(wheels=WHEELS, extra=extra))
    return path


def hills(folder, extra="", name="hills.xml"):
    path = folder / name
    path.write_text(HILLS.format(extra=extra))
    return path


def agents(path, count=2, axes=1, **more):
    table = {
        "type": "mjcf-robot", "count": count, "file": str(path), "output": {"body": "cart"},
        "input": {"body": "cart"}, **more,
    }  # fmt: skip
    return MjcfAgents.model_validate(table).build((axes,) * count)


def plant_of(*args, **more):
    return MjcfPlant(agents(*args, **more), 0.002, "euler")


POSES = [
    {"position": [1.0, -2.0, 0.5], "yaw": 0.7},
    {"quaternion": [2.0, 0.0, 2.0, 0.0]},
]


def by_hand(path, poses, terrain=None):
    """The same world by MuJoCo's own functions alone."""
    world = mujoco.MjSpec()
    world.option.timestep = 0.002
    if terrain is not None:
        world.attach(
            mujoco.MjSpec.from_file(str(terrain)), prefix="terrain/",
            frame=world.worldbody.add_frame(),
        )  # fmt: skip
    for i, (position, quaternion) in enumerate(poses):
        spec = mujoco.MjSpec.from_file(str(path))
        if terrain is not None or i:  # all stand on one
            spec.delete(spec.geom("ground"))
        frame = world.worldbody.add_frame(pos=position, quat=quaternion)
        world.attach(spec, prefix=f"robot_{i + 1}/", frame=frame)
    model = world.compile()
    return model, mujoco.MjData(model)


def test_robots_stand_where_their_poses_say(tmp_path):
    """As in the same world composed by MuJoCo's own functions."""
    path = cart(tmp_path)
    plant = plant_of(path, poses=POSES, contacts="none")
    turned = [np.cos(0.35), 0.0, 0.0, np.sin(0.35)]
    model, data = by_hand(path, [([1.0, -2.0, 0.5], turned), ([0.0, 0.0, 0.0], [1, 0, 1, 0])])
    plant.reset(np.zeros((2, 2)))
    mujoco.mj_forward(model, data)
    assert np.allclose(plant.data.qpos, data.qpos, rtol=0, atol=1e-15)
    for name in ("robot_1/w2", "robot_2/w3"):
        for what in ("xpos", "xmat"):
            ours, theirs = (getattr(each.body(name), what) for each in (plant.data, data))
            assert np.allclose(ours, theirs, rtol=0, atol=1e-14)
    floor = plant.model.geom("floor")
    assert floor.pos[1] == -1.0
    assert floor.size[1] == 3.0


def test_the_lanes_sky_and_sun_make_way_for_those_that_files_bring(tmp_path):
    def names(path, **more):
        model = plant_of(path, **more).model
        skies = np.flatnonzero(model.tex_type == mujoco.mjtTexture.mjTEXTURE_SKYBOX)
        lights = [model.light(k).name for k in range(model.nlight)]
        return [model.texture(int(k)).name for k in skies], lights

    dusk = '<asset><texture name="dusk" type="skybox" builtin="flat" width="8" height="8"/></asset>'
    lamp = '<worldbody><light name="lamp"/></worldbody>'
    two = ("robot_1/{}", "robot_2/{}")
    assert names(cart(tmp_path)) == (["sky"], ["sun"])
    assert names(cart(tmp_path, dusk)) == ([each.format("dusk") for each in two], ["sun"])
    assert names(cart(tmp_path, lamp)) == (["sky"], [each.format("lamp") for each in two])
    over = names(cart(tmp_path), terrain=str(hills(tmp_path)), poses=POSES)
    assert over == (["terrain/dusk"], ["terrain/lamp"])


def test_lists_are_positions_and_a_spacing_is_the_short_form(tmp_path):
    path = cart(tmp_path)
    lists = plant_of(path, poses=[[0, 0, 0], [0, 3, 0]])
    short = plant_of(path, spacing=3.0)
    assert np.array_equal(lists.data.qpos, short.data.qpos)


def test_with_positions_poses_say_what_these_leave_open(tmp_path):
    """A plane's outputs are x and y; heading and height are the poses'."""
    path = cart(tmp_path)
    plant = plant_of(
        path, axes=2, lookahead=1.0, local_damping=0.0, output={"body": "cart", "axes": ["x", "y"]},
        poses=[{"position": [0, 0, 0.01], "yaw": 1.0}, {"yaw": -0.5}], contacts="none",
    )  # fmt: skip
    places = np.array([1.0, 2.0, -1.0, 0.5])
    plant.reset(np.column_stack([places, places]))
    assert np.allclose(plant.data.qpos.reshape(2, -1)[:, :2].ravel(), places, rtol=0, atol=1e-12)
    assert np.allclose(plant.data.qpos.reshape(2, -1)[:, 2], [0.13, 0.12], rtol=0, atol=1e-12)
    heading = [np.arctan2(*plant.data.body(f"robot_{i}/cart").xmat[[3, 0]]) for i in (1, 2)]
    assert np.allclose(heading, [1.0, -0.5], rtol=0, atol=1e-12)


SLIDE = """<mujoco><option gravity="0 0 0"/><worldbody><body name="cart">
  <joint name="x" type="slide" axis="1 0 0"/><geom name="hull" size="0.1"/></body></worldbody>
  <actuator><motor name="u" joint="x"/></actuator></mujoco>"""


def test_a_pose_along_a_slide_whose_position_is_the_output_is_refused(tmp_path):
    path = tmp_path / "slide.xml"
    path.write_text(SLIDE)
    more = {"output": "x", "input": "u", "lookahead": 1.0, "local_damping": 0.0}
    plant_of(path, poses=[[0, 0, 0], [0, 1, 0.5]], **more)
    for pose in ({"position": [0.5, 0, 0]}, {"yaw": 0.1}):
        with pytest.raises(InvalidInput, match="position of joint 'x' says where agent 2") as told:
            plant_of(path, poses=[[0, 0, 0], pose], **more)
        assert told.value.key == "agents.poses"


BAD_POSES = [
    ([[0, 0, 0]], "poses", "there must be 2"),
    ([[0, 0, 0], [0, 1]], "poses", "x, y, z"),
    ([[0, 0, 0], {"yaw": 1.0, "quaternion": [1, 0, 0, 0]}], "poses.1.yaw", "or a quaternion"),
    ([[0, 0, 0], {"quaternion": [0, 0, 0, 0]}], "poses.1.quaternion", "must not be 0"),
]


@pytest.mark.parametrize(("poses", "key", "words"), BAD_POSES)
def test_poses_that_are_none_are_refused(tmp_path, poses, key, words):
    with pytest.raises(InvalidInput, match=words) as told:
        agents(cart(tmp_path), poses=poses)
    assert told.value.key == key
    assert "\n" not in str(told.value)


def test_poses_and_a_spacing_do_not_go_together(tmp_path):
    with pytest.raises(InvalidInput, match="poses say where they are"):
        agents(cart(tmp_path), poses=POSES, spacing=1.0)


def test_a_terrain_is_attached_once_and_robots_leave_their_floors_out(tmp_path):
    """400 steps beside those of the same world composed by MuJoCo's own functions."""
    path, ground = cart(tmp_path), hills(tmp_path)
    places = [[-1.0, -1.0, 0.3], [-1.0, 1.0, 0.3]]
    plant = plant_of(path, poses=places, terrain=str(ground))
    model, data = by_hand(path, [(place, [1, 0, 0, 0]) for place in places], ground)
    plant.step(np.zeros(2), 400)
    mujoco.mj_step(model, data, 400)
    assert np.allclose(plant.data.qpos, data.qpos, rtol=0, atol=1e-6)
    assert plant.data.ncon == data.ncon >= 4
    own = plant.model
    named = [own.geom(k).name for k in range(own.ngeom)]
    assert "floor" not in named
    assert not any("ground" in name for name in named)
    assert named.count("terrain/hills") == 1
    assert own.nhfield == 1
    assert [own.light(k).name for k in range(own.nlight)] == ["terrain/lamp"]
    assert [own.texture(k).name for k in range(own.ntex) if own.tex_type[k] == 2] == [
        "terrain/dusk"
    ]


def test_contacts_with_the_floor_are_those_with_all_of_a_terrain(tmp_path):
    path, ground = cart(tmp_path), hills(tmp_path)
    for which, touches in (("floor", True), ("agents", False)):
        plant = plant_of(
            path, poses=[[2, 2, 0.1], [-2, 2, 0.5]], terrain=str(ground), contacts=which
        )
        rock = plant.model.geom("terrain/rock").id
        assert bool(plant.model.geom_contype[rock] | plant.model.geom_conaffinity[rock]) == touches
        mujoco.mj_forward(plant.model, plant.data)
        assert np.any(plant.data.contact.geom == rock) == touches


BAD_TERRAINS = [
    ({"extra": '<body name="ball"><joint name="spin"/><geom size="1"/></body>'}, {},
     "it has joint 'spin'"),
    ({"extra": '<body name="m" mocap="true"><geom size="1"/></body>'}, {}, "mocap body 'm'"),
    ({"extra": '</worldbody><option gravity="0 0 -1"/><worldbody>'}, {}, "its gravity must be"),
    ({}, {"extra": '<contact><pair geom1="ground" geom2="w0"/></contact>'}, "floor 'ground'"),
    ({"extra": "<geom/>"}, {}, "MuJoCo must"),
]  # fmt: skip


@pytest.mark.parametrize(("ground", "robot", "words"), BAD_TERRAINS)
def test_terrains_that_are_none_are_refused_in_one_sentence(tmp_path, ground, robot, words):
    path, ground = cart(tmp_path, **robot), hills(tmp_path, **ground)
    with pytest.raises(InvalidInput, match=words) as told:
        plant_of(path, terrain=str(ground), spacing=3.0)
    assert told.value.key == ("agents.path" if robot else "agents.terrain")
    assert "\n" not in str(told.value)


def test_a_terrain_that_says_nothing_of_physics_takes_the_robots(tmp_path):
    path = cart(tmp_path, "<option gravity='0 0 -2' density='1'/>")
    plant = plant_of(path, terrain=str(hills(tmp_path)), contacts="none")
    assert plant.model.opt.gravity[2] == -2.0


def test_a_scenario_names_its_terrain_relative_to_itself(tmp_path):
    cart(tmp_path)
    hills(tmp_path)
    scenario = tmp_path / "s.toml"
    scenario.write_text(
        """[simulation]
duration = 0.1
timestep = 0.002
integrator = "euler"
[systems.carts.game]
type = "expressions"
cost = "(y[i] - 1)**2"
constraints = { low = "y[i] >= -2", high = "y[i] <= 2" }
[systems.carts.agents]
type = "mjcf-robot"
count = 2
file = "cart.xml"
output = { body = "cart" }
input = { body = "cart" }
poses = [[-1, -1, 0.3], { position = [-1, 1, 0.3], yaw = 0.1 }]
terrain = "hills.xml"
[systems.carts.initial]
action = 0.0
"""
    )
    run = gm.run(scenario)
    start = run["carts"]["configuration"].to_numpy()[0].reshape(2, -1)
    assert np.allclose(start[:, :3], [[-1, -1, 0.42], [-1, 1, 0.42]], rtol=0, atol=1e-12)
    assert run.status == "completed"
    with pytest.raises(InvalidInput, match="MuJoCo must read"):
        load_scenario(scenario, {"agents.terrain": "none.xml"}).system_objects()[0].mujoco_plant(
            load_scenario(scenario).clock()
        )


HOME = [0.5, 0.25, 0.2, np.cos(0.2), 0.0, 0.0, np.sin(0.2), 0.1, 0.2, 0.3, 0.4]
KEYS = """<keyframe><key name="rest"/>
  <key name="home" qpos="{}" qvel="0.3 0 0 0 0 0.5 0 0 1 0" act="0.7" ctrl="0 0 0.4"/></keyframe>
""".format(" ".join(map(str, HOME)))


def test_robots_start_in_keyframes_of_their_files(tmp_path):
    """Joints, activations, controls and velocities, of free joints as their poses turn them."""
    path = cart(tmp_path, KEYS)
    poses = [[0, 0, 0], {"position": [1.0, 2.0, 0.3], "yaw": 0.7}]
    plant = plant_of(path, poses=poses, contacts="none", keyframe=["rest", "home"])
    state = plant.standing
    model = mujoco.MjModel.from_xml_path(str(path))
    alone = mujoco.MjData(model)
    mujoco.mj_resetDataKeyframe(model, alone, model.key("home").id)
    mujoco.mj_forward(model, alone)
    turn = np.empty(9)
    mujoco.mju_quat2Mat(turn, np.array([np.cos(0.35), 0.0, 0.0, np.sin(0.35)]))
    turn = turn.reshape(3, 3)
    assert np.allclose(plant.data.qpos[:11], model.qpos0, rtol=0, atol=1e-15)
    for _ in range(2):  # as it stands, and again from its state
        mujoco.mj_forward(plant.model, plant.data)
        for name in ("cart", "w1", "w3"):
            ours, theirs = plant.data.body(f"robot_2/{name}"), alone.body(name)
            place = turn @ theirs.xpos + [1.0, 2.0, 0.3]
            assert np.allclose(ours.xpos, place, rtol=0, atol=1e-14)
            assert np.allclose(ours.xmat.reshape(3, 3), turn @ theirs.xmat.reshape(3, 3))
        velocity = turn @ [0.3, 0.0, 0.0]
        assert np.allclose(plant.state[:, 0], [0.0, velocity[0]], rtol=0, atol=1e-14)
        assert np.allclose(plant.data.qvel[10:13], velocity, rtol=0, atol=1e-14)
        assert np.allclose(plant.data.qvel[13:], alone.qvel[3:], rtol=0, atol=1e-14)
        assert plant.data.act.tolist() == [0.0, 0.7]
        assert plant.data.ctrl.tolist()[:3] == [0.0, 0.0, 0.0]
        assert plant.data.actuator("robot_2/brake").ctrl[0] == 0.4
        plant.reset(state)


def test_other_velocities_are_those_nearest_to_a_keyframes(tmp_path):
    """One entry of the keyframe's velocities is the output: all others stay."""
    path = cart(tmp_path, KEYS)
    plant = plant_of(path, count=1, contacts="none", keyframe="home")
    plant.reset([[0.8, 0.0]])
    assert np.allclose(plant.data.qvel, [0.8, 0, 0, 0, 0, 0.5, 0, 0, 1, 0], rtol=0, atol=1e-14)


def test_keyframes_that_a_file_has_not_are_refused(tmp_path):
    path = cart(tmp_path, KEYS)
    with pytest.raises(InvalidInput, match=r"cart.xml must have a keyframe of this name; .*home"):
        plant_of(path, keyframe="hom", spacing=1.0)
    with pytest.raises(InvalidInput, match="one name or a list of 2"):
        agents(path, keyframe=["home"])
    with pytest.raises(InvalidInput, match="it has none at all"):
        plant_of(cart(tmp_path), keyframe="home", spacing=1.0)


def settled_by_hand(path, poses, seconds, terrain=None):
    model, data = by_hand(path, [(pose, [1, 0, 0, 0]) for pose in poses], terrain)
    mujoco.mj_step(model, data, round(seconds / 0.002))
    return data


def test_robots_settle_before_they_start(tmp_path):
    """As MuJoCo lets them, and then at rest at time 0."""
    path, seconds = cart(tmp_path), 1.5
    poses = [[0.0, 0.0, 0.0], [0.0, 1.0, 0.0]]
    plant = plant_of(path, poses=poses, settle=seconds)
    data = settled_by_hand(path, poses, seconds)
    assert abs(data.qpos[2] - 0.12) > 1e-3
    for state in (plant.standing, np.zeros((2, 2))):
        plant.reset(state)
        assert np.allclose(plant.data.qpos, data.qpos, rtol=0, atol=1e-6)
        assert not np.any(plant.data.qvel)
        assert plant.data.time == 0.0
    before = plant.data.qpos.copy()
    plant.step(np.zeros(2), 500)
    assert np.allclose(plant.data.qpos, before, rtol=0, atol=1e-5)


def test_wheels_roll_where_a_settled_cart_starts_at_a_speed(tmp_path):
    """They turn at v/r; then bearings brake them, and no tyre slides."""
    plant = plant_of(cart(tmp_path), spacing=1.0, settle=1.5)
    plant.reset([[0.3, 0.0], [-0.2, 0.0]])
    assert np.allclose(plant.state[:, 0], [0.3, -0.2], rtol=0, atol=1e-12)
    turning = plant.data.qvel.reshape(2, -1)[:, 6:]
    assert np.allclose(turning, np.outer([0.3, -0.2], np.ones(4)) / 0.06, rtol=0.02)
    plant.step(np.zeros(2), 20)
    assert np.allclose(plant.state[:, 0], [0.3, -0.2], rtol=0.15)  # of bearings, not of sliding


def test_with_positions_robots_settle_where_these_say(tmp_path):
    """On a terrain, too."""
    path, ground = cart(tmp_path), hills(tmp_path)
    path.write_text(path.read_text().replace('kp="1e-3" kv="1e-4"', 'kp="0.5" kv="0.1"'))
    more = {
        "axes": 2, "lookahead": 1.0, "local_damping": 0.0, "settle": 2.0,
        "output": {"body": "cart", "axes": ["x", "y"]}, "input": {"body": "cart"},
        "poses": [[-1, 0, 0.1], [1, 0, 0.1]],
    }  # fmt: skip
    plant = plant_of(path, terrain=str(ground), **more)
    places = np.array([-3.0, 1.0, -4.0, -2.0])
    plant.reset(np.column_stack([places, places]))
    assert np.allclose(plant.state, places[:, None], rtol=0, atol=1e-9)
    heights = plant.data.qpos.reshape(2, -1)[:, 2].copy()
    assert np.all(heights < 0.12)
    plant.step(np.zeros(4), 500)
    assert np.allclose(plant.data.qpos.reshape(2, -1)[:, 2], heights, rtol=0, atol=1e-3)
    assert np.allclose(plant.state[:, 1], places, rtol=0, atol=5e-3)


def test_robots_that_do_not_settle_are_refused_in_one_sentence(tmp_path):
    path = cart(tmp_path)
    plant = plant_of(path, contacts="none", settle=0.5)
    with pytest.raises(InvalidInput, match="agent 1 must come to rest under inputs of zero"):
        plant.reset(np.zeros((2, 2)))
    high = plant_of(
        path, count=1, lookahead=1.0, local_damping=0.0, settle=1.0,
        output={"body": "cart", "axes": ["z"]},
    )  # fmt: skip
    with pytest.raises(InvalidInput, match=r"comes to rest at 0\.1\d* and not at 0\.3") as told:
        high.reset([[0.3, 0.3]])
    assert told.value.key == "agents.settle"
    assert "\n" not in str(told.value)
    rests = high.standing
    assert rests[0, 0] == rests[0, 1] == pytest.approx(0.11, abs=2e-3)
    high.reset(rests)


def test_a_settled_reference_must_stand_still(tmp_path):
    with pytest.raises(InvalidInput, match="reference_velocity moves theirs"):
        agents(cart(tmp_path), lookahead=1.0, local_damping=0.0, reference_velocity=1.0, settle=1.0)


def tables(path, **more):
    return {
        "simulation": {"duration": 0.2, "timestep": 0.002, "integrator": "euler"},
        "systems": {"carts": {
            "game": {"type": "expressions", "cost": "(y[i] - 1)**2",
                     "constraints": {"low": "y[i] >= -2", "high": "y[i] <= 2"}},
            "agents": {"type": "mjcf-robot", "count": 2, "file": str(path),
                       "output": {"body": "cart"}, "input": {"body": "cart"}, **more},
        }},
    }  # fmt: skip


def test_a_start_of_which_nothing_is_said_is_the_keyframes_or_the_settled_one(tmp_path):
    path = cart(tmp_path, KEYS)
    for more, y in (({"settle": 1.5}, 0.0), ({"keyframe": "home", "contacts": "none"}, 0.3)):
        scenario = load_scenario(tables(path, **more))
        system = scenario.system_objects()[0]
        assert np.allclose(system.start, y, rtol=0, atol=1e-14)
        given = load_scenario(scenario, {"initial.action": 0.5}).system_objects()[0]
        assert given.start.tolist() == [0.5, 0.5]
        assert np.array_equal(given.state[:, 1], system.state[:, 1])
    outside = {"game.constraints": {"high": "y[i] <= -0.5"}}
    with pytest.raises(InvalidInput, match=r"in their keyframe, or settled, .* g = ") as told:
        load_scenario(scenario, outside).system_objects()
    assert told.value.key == "systems.carts.initial.action"


def test_settled_runs_are_the_same_again_and_in_batches(tmp_path):
    """The run, its repetition from its own scenario, and a batch's runs of other starts."""
    scenario = load_scenario(tables(cart(tmp_path), settle=1.5))
    run = gm.run(scenario)
    again = gm.run(load_scenario(run.scenario))
    qpos = run["carts"]["configuration"].to_numpy()
    assert np.array_equal(qpos, again["carts"]["configuration"].to_numpy())
    by_itself = settled_by_hand(tmp_path / "cart.xml", [[0, 0, 0], [0, 2, 0]], 1.5)
    assert np.allclose(qpos[0], by_itself.qpos, rtol=0, atol=1e-6)
    run.save(tmp_path / "kept")
    kept = gm.Trajectory.load(tmp_path / "kept")
    assert np.array_equal(kept["carts"]["configuration"].to_numpy()[0], qpos[0])
    found = gm.batch(scenario, out=tmp_path / "b", runs=3, threads=2)
    assert set(found["status"].to_numpy().tolist()) == {"completed"}


def test_of_floors_that_are_the_same_but_one_is_left(tmp_path):
    """Pairs and sensors that name another one name it; contacts are ten times those of one."""
    extra = """<contact><pair geom1="ground" geom2="w0" condim="1"/></contact>
    <sensor><distance geom1="ground" geom2="hull" cutoff="1"/></sensor>"""
    path = cart(tmp_path, extra)
    one, ten = (plant_of(path, count=n, spacing=1.0, settle=1.5) for n in (1, 10))
    for plant in (one, ten):
        plant.reset(plant.standing)
    model = ten.model
    assert one.data.ncon == 4
    assert ten.data.ncon == 40
    assert np.count_nonzero(model.geom_type == mujoco.mjtGeom.mjGEOM_PLANE) == 2  # and the lane's
    ground = model.geom("robot_1/ground").id
    assert model.pair_geom1.tolist() == [ground] * 10
    assert model.sensor_objid.tolist() == [ground] * 10
    heights = ten.data.qpos.reshape(10, -1)[:, 2]
    assert np.allclose(heights, one.data.qpos[2], rtol=0, atol=1e-9)
