"""The mirror: what meshcat is given to draw, against MuJoCo's own numbers."""

import base64
import io
from pathlib import Path

import meshcat.geometry
import mujoco
import numpy as np
import pytest
import umsgpack
from hypothesis import given
from hypothesis import strategies as st
from meshcat.commands import SetObject, SetTransform
from meshcat.visualizer import Visualizer
from numpy.testing import assert_allclose, assert_array_equal
from PIL import Image

from gne_mj.plants.fleet import compile_model, compose
from gne_mj.viewer.mirror import Mirror, rotations, transforms, turn_z_to
from gne_mj.viewer.shapes import DrawnPart, Group, capsule, coil, material

EXAMPLES = Path(__file__).parents[1] / "examples" / "robot"

JOINTS = """
<mujoco>
  <worldbody>
    <body name="free"><freejoint/><geom size=".1"/>
      <body name="arm" pos="0 .2 0"><joint type="ball"/><geom size=".1"/>
        <body pos=".3 0 0" quat="1 2 3 4"><geom size=".1"/></body>
      </body>
    </body>
    <body name="cart"><joint type="slide" axis="1 1 0"/><geom size=".1"/>
      <body name="cart/pole"><joint axis="0 1 0" pos="0 0 .3"/><geom size=".1"/></body>
    </body>
    <body name="hand" mocap="true" pos="1 2 3"><geom size=".1"/>
      <body name="finger" pos="0 0 .1"><geom size=".1"/></body>
    </body>
    <body name="pillar" pos="5 0 0" euler="0 90 0"><geom name="stone" size=".1 .5" type="cylinder"/>
      <body pos="0 0 1"><site name="top"/></body>
    </body>
  </worldbody>
</mujoco>
"""

TENDONS = """
<mujoco>
  <worldbody>
    <geom name="drum" type="cylinder" size=".2 .5" euler="90 0 0"/>
    <site name="a" pos="-1 0 0"/><site name="side" pos="0 0 1"/>
    <site name="e" pos="3 0 0"/><site name="f" pos="3 1 0"/>
    <body name="b" pos="1 0 -.1"><joint name="lift" type="slide" axis="0 0 1"/>
      <geom size=".05"/><site name="b"/>
      <body name="c" pos="0 0 .5"><joint name="turn"/><geom size=".05"/>
        <body name="d"><joint name="same"/><geom size=".05"/></body>
      </body>
    </body>
  </worldbody>
  <tendon>
    <fixed name="pair"><joint joint="lift" coef="1"/><joint joint="turn" coef="2"/>
      <joint joint="same" coef="1"/></fixed>
    <spatial name="unseen" group="3"><site site="e"/><site site="b"/></spatial>
    <spatial name="belt" width=".01" stiffness="3">
      <site site="a"/><geom geom="drum" sidesite="side"/><site site="b"/>
      <pulley divisor="2"/><site site="e"/><site site="f"/><site site="b"/>
    </spatial>
    <spatial name="spring" width=".004" stiffness="3"><site site="f"/><site site="b"/></spatial>
  </tendon>
</mujoco>
"""

ZOO = """
<mujoco>
  <asset>
    <texture name="squares" type="2d" builtin="checker" width="8" height="4" rgb1="1 0 0"
             rgb2="0 0 1"/>
    <texture name="sky" type="skybox" builtin="gradient" width="4" height="4" rgb1="1 1 1"/>
    <material name="tiles" texture="squares" texrepeat="3 1.5"/>
    <material name="leaf" rgba=".2 .6 .2 .5"/>
    <mesh name="tetrahedron" vertex="0 0 0  .6 0 0  0 .5 0  0 0 .4"/>
    <hfield name="dune" nrow="3" ncol="4" size="1 2 .5 .1"
            elevation="0 1 2 3  1 2 3 4  2 3 4 5"/>
  </asset>
  <worldbody>
    <geom name="sea" type="plane" size="0 0 1" material="tiles"/>
    <geom name="carpet" type="plane" size="1 2 1" material="tiles"/>
    <geom name="sand" type="hfield" hfield="dune"/>
    <body name="zoo" pos="0 0 3"><freejoint/>
      <geom name="own" size=".2" rgba="1 0 0 1" material="leaf"/>
      <geom name="leaf" size=".2" material="leaf"/>
      <geom name="plain" size=".2"/>
      <geom name="glass" size=".2" rgba="1 1 1 0"/>
      <geom name="hull" size=".2" group="3"/>
      <geom name="pill" type="capsule" size=".1 .3"/>
      <geom name="egg" type="ellipsoid" size=".1 .2 .3"/>
      <geom name="can" type="cylinder" size=".1 .3"/>
      <geom name="crate" type="box" size=".1 .2 .3" pos="1 0 0" euler="0 0 90"/>
      <geom name="rock" type="mesh" mesh="tetrahedron"/>
      <site name="mark" type="box" size=".1 .1 .1" rgba="0 0 1 1"/>
      <site name="hidden" group="4"/>
    </body>
  </worldbody>
</mujoco>
"""


class Window:
    """Takes the commands of a visualizer, as a server would: lowered and packed."""

    def __init__(self):
        self.commands = []

    def send(self, command):
        self.commands.append(umsgpack.unpackb(umsgpack.packb(command.lower())))

    def of(self, kind):
        return {c["path"].removeprefix("/meshcat/"): c for c in self.commands if c["type"] == kind}


def model_of(xml):
    return mujoco.MjModel.from_xml_string(xml)


def data_at(model, qpos):
    data = mujoco.MjData(model)
    data.qpos[:] = qpos
    mujoco.mj_forward(model, data)
    return data


def parts_of(mirror, path):
    return {part.name: part for part in dict(mirror.objects)[path].parts}


def lowered(mirror, path):
    return dict(mirror.objects)[path].lower()


def arrays_of(geometry):
    """(V, 3) positions, (V, 3) normals, (F, 3) faces of a BufferGeometry."""
    attributes, index = geometry["data"]["attributes"], geometry["data"]["index"]
    position, normal = (
        np.frombuffer(attributes[name]["array"].data, dtype=np.float32).reshape(-1, 3)
        for name in ("position", "normal")
    )
    return position, normal, np.frombuffer(index["array"].data, dtype=np.uint32).reshape(-1, 3)


def volume_of(geometry):
    position, normal, faces = arrays_of(geometry)
    a, b, c = np.moveaxis(position[faces].astype(float), 1, 0)
    assert np.all(np.sum(np.cross(b - a, c - a) * normal[faces[:, 0]], axis=1) > 0)
    return np.sum(a * np.cross(b, c)) / 6


def ends_of(mirror, poses):
    """Starts and ends of the segments that are shown, by path."""
    matrices = transforms(poses)
    return {
        path: (matrix[:3, 3], matrix[:3] @ [0, 0, 1, 1])
        for path, matrix, pose in zip(mirror.items, matrices, poses, strict=True)
        if pose[7] > 0
    }


# ------------------------------------------------------------------------------------- bodies


@pytest.mark.parametrize("seed", range(5))
def test_bodies_are_where_mujoco_has_them(seed):
    rng = np.random.default_rng(seed)
    model = model_of(JOINTS)
    mirror = Mirror(model)
    data = mujoco.MjData(model)
    mujoco.mj_integratePos(model, data.qpos, rng.normal(size=model.nv), 1.0)
    mocap = rng.normal(size=(1, 7))
    mocap[:, 3:] /= np.linalg.norm(mocap[:, 3:])
    data.mocap_pos[:], data.mocap_quat[:] = mocap[:, :3], mocap[:, 3:]
    mujoco.mj_forward(model, data)
    poses = mirror.poses(data.qpos, mocap)
    assert poses.shape == (7, 8)
    assert poses.dtype == np.float64
    assert_allclose(poses[:, :3], data.xpos[1:8], rtol=0, atol=1e-12)
    assert_allclose(poses[:, 3:7], data.xquat[1:8], rtol=0, atol=1e-12)
    assert_array_equal(poses[:, 7], 1)


def test_without_mocap_poses_they_are_the_models():
    mirror = Mirror(model_of(JOINTS))
    elsewhere = mirror.poses(mirror.model.qpos0, [[9, 9, 9, 1, 0, 0, 0]])
    hand = mirror.items.index("hand")
    assert_array_equal(elsewhere[hand, :3], 9)
    assert_array_equal(mirror.poses(mirror.model.qpos0)[hand, :3], [1, 2, 3])


def test_no_item_is_below_another():
    mirror = Mirror(model_of(JOINTS), prefix=("all", "here"))
    assert mirror.items == [
        "all/here/free", "all/here/arm", "all/here/body_3", "all/here/cart/body_4",
        "all/here/cart/pole", "all/here/hand", "all/here/finger",
    ]  # fmt: skip
    names = ("a", "a/b", "a/b/c", "a/", "//", "world/x")
    bodies = "".join(f'<body name="{n}"><joint/><geom size="1"/></body>' for n in names)
    items = Mirror(model_of(f"<mujoco><worldbody>{bodies}</worldbody></mujoco>")).items
    assert len(set(items)) == len(names)
    assert not any(one != other and other.startswith(one + "/") for one in items for other in items)


def test_what_never_moves_is_one_object_in_its_place():
    model = model_of(JOINTS)
    mirror = Mirror(model)
    data = data_at(model, model.qpos0)
    parts = parts_of(mirror, "world")
    assert set(parts) == {"stone", "top"}
    # the cylinder's axis is y in three.js
    matrix = parts["stone"].matrix
    assert_allclose(matrix[:3, 3], data.geom("stone").xpos, atol=1e-12)
    assert_allclose(matrix[:3, 1], data.geom("stone").xmat.reshape(3, 3)[:, 2], atol=1e-12)
    assert_allclose(parts["top"].matrix[:3, 3], data.site("top").xpos, atol=1e-12)


# ------------------------------------------------------------------------------------ tendons


@pytest.mark.parametrize("lift", [-0.3, 0.0, 1.5])  # the belt leaves the drum at the last one
def test_tendons_go_through_their_wrap_points(lift):
    model = model_of(TENDONS)
    mirror = Mirror(model)
    data = data_at(model, [lift, 0.4, -0.2])
    ends = ends_of(mirror, mirror.poses(data.qpos))
    points = data.wrap_xpos.reshape(-1, 3)
    at = data.ten_wrapadr[model.tendon("belt").id]
    count = data.ten_wrapnum[model.tendon("belt").id]
    pulley = at + np.flatnonzero(data.wrap_obj.ravel()[at : at + count] == -2)[0]
    expected = [(p, p + 1) for p in range(at, at + count - 1) if pulley not in (p, p + 1)]
    assert len(expected) == (5 if lift < 1 else 3)
    drawn = [ends[path] for path in mirror.items if path.startswith("belt/") and path in ends]
    assert_allclose(drawn, points[np.array(expected)], atol=1e-12)
    spring = ends["spring"]
    assert_allclose(spring, [data.site("f").xpos, data.site("b").xpos], atol=1e-12)
    assert not any("unseen" in path for path in mirror.items)


def test_as_many_segments_as_there_can_ever_be():
    items = Mirror(model_of(TENDONS)).items
    assert sum(path.startswith("belt/") for path in items) == 3 + 2
    assert items[:3] == ["b", "c", "d"]


def test_fixed_tendons_go_through_joints_that_lie_apart():
    model = model_of(TENDONS)
    mirror = Mirror(model)
    data = data_at(model, [0.2, 0.4, -0.2])
    poses = mirror.poses(data.qpos)
    ends = ends_of(mirror, poses)
    anchors = [data.joint(name).xanchor for name in ("lift", "turn")]
    assert_allclose(ends["pair/1"], anchors, atol=1e-12)
    assert "pair/2" not in ends  # both joints are in one place


def test_springs_are_coils():
    def kind(mirror, path):
        return parts_of(mirror, path)[path.split("/")[0]].geometry["type"]

    by_stiffness = Mirror(model_of(TENDONS))
    assert kind(by_stiffness, "spring") == "TubeGeometry"
    assert kind(by_stiffness, "belt/1") == "CylinderGeometry"
    by_name = Mirror(model_of(TENDONS), coils=["belt"])
    assert kind(by_name, "spring") == "CylinderGeometry"
    assert kind(by_name, "belt/1") == "TubeGeometry"


def test_a_coil_begins_and_ends_on_its_axis():
    geometry, matrix = coil(0.05, 0.7)
    points = np.array(geometry["path"]["points"])
    points = points @ matrix[:3, :3].T
    assert_allclose(points[[0, -1]], [[0, 0, 0], [0, 0, 1]], atol=1e-12)
    radius = np.hypot(points[:, 0], points[:, 1])
    assert radius.max() == pytest.approx(0.05, rel=1e-3)
    assert np.all(np.diff(points[:, 2]) > 0)


# ------------------------------------------------------------------------------------- shapes


def test_colours_and_what_is_shown_follow_mujocos_viewer():
    parts = parts_of(Mirror(model_of(ZOO)), "zoo")
    shown = {"own", "leaf", "plain", "pill", "egg", "can", "crate", "rock", "mark"}
    assert set(parts) == shown

    def looks(name):
        return parts[name].material["color"], parts[name].material["opacity"]

    assert looks("own") == (0xFF0000, 1.0)
    assert looks("leaf") == (0x339933, 0.5)
    assert looks("plain") == (0x808080, 1.0)
    assert looks("mark") == (0x0000FF, 1.0)
    assert parts["leaf"].material["transparent"]
    assert not parts["own"].material["transparent"]


def test_round_shapes_along_z_have_mujocos_sizes():
    parts = parts_of(Mirror(model_of(ZOO)), "zoo")
    profile = np.array([[p["x"], p["y"]] for p in parts["pill"].geometry["points"]])
    assert profile[:, 0].max() == pytest.approx(0.1)
    assert_allclose(profile[[0, -1]], [[0, -0.4], [0, 0.4]], atol=1e-15)
    assert np.all(np.diff(profile[:, 1]) > 0)  # otherwise its inside is out
    for name in ("pill", "can"):
        assert_array_equal(parts[name].matrix[:3, :3] @ [0, 1, 0], [0, 0, 1])
    assert parts["can"].geometry["height"] == 0.6
    assert_allclose(np.diag(parts["egg"].matrix), [0.1, 0.2, 0.3, 1])
    crate = parts["crate"]
    box = [crate.geometry[side] for side in ("width", "height", "depth")]
    corner = crate.matrix @ [*(np.array(box) / 2), 1]
    assert_allclose(corner, [1 - 0.2, 0.1, 0.3, 1], atol=1e-12)


def test_meshes_and_height_fields_enclose_their_volume():
    mirror = Mirror(model_of(ZOO))
    rock = parts_of(mirror, "zoo")["rock"]
    assert volume_of(rock.geometry) == pytest.approx(0.6 * 0.5 * 0.4 / 6, rel=1e-6)
    position, normal, _ = arrays_of(rock.geometry)
    assert len(position) == 12  # each corner has a normal of its own in each face
    assert_allclose(np.linalg.norm(normal, axis=1), 1, rtol=1e-6)
    # the compiled mesh is turned about its centre; its geom turns it back
    back = position @ rock.matrix[:3, :3].T + rock.matrix[:3, 3]
    assert_allclose(back.max(axis=0), [0.6, 0.5, 0.4], atol=1e-6)
    assert_allclose(back.min(axis=0), 0, atol=1e-6)
    # an inclined plane over 2 m x 4 m, from 0 to 0.5 m, on a base of 0.1 m
    sand = parts_of(mirror, "world")["sand"].geometry
    assert volume_of(sand) == pytest.approx(2 * 4 * (0.25 + 0.1), rel=1e-6)
    position, _, _ = arrays_of(sand)
    assert_allclose(position.min(axis=0), [-1, -2, -0.1], rtol=1e-6)
    assert_allclose(position.max(axis=0), [1, 2, 0.5], rtol=1e-6)


def test_planes_have_their_texture():
    mirror = Mirror(model_of(ZOO))
    parts = parts_of(mirror, "world")
    sea, carpet = parts["sea"], parts["carpet"]
    assert (carpet.geometry["width"], carpet.geometry["height"]) == (2.0, 4.0)
    assert carpet.material["map"]["repeat"] == [3.0, 1.5]
    assert carpet.material["map"]["offset"] == [0.0, 0.5]
    assert sea.geometry["width"] == 1000.0
    assert sea.material["map"]["repeat"] == [1500.0, 750.0]
    url = carpet.material["map"]["image"]["url"]
    image = Image.open(io.BytesIO(base64.b64decode(url.removeprefix("data:image/png;base64,"))))
    pixels = mirror.model.tex_data[: 4 * 8 * 3].reshape(4, 8, 3)
    assert_array_equal(np.asarray(image), pixels)


def test_textured_meshes_have_coordinates():
    square = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nvt 0 0\nvt 1 0\nvt 0 .25\n"
    faces = "f 1/1 3/3 2/2\nf 1/1 2/2 4/3\nf 1/1 4/3 3/2\nf 2/1 3/2 4/3\n"
    model = mujoco.MjModel.from_xml_string(
        """<mujoco><asset><texture name="t" type="2d" builtin="flat" width="2" height="2"/>
        <material name="t" texture="t"/><mesh name="m" file="m.obj"/></asset>
        <worldbody><geom name="m" type="mesh" mesh="m" material="t"/></worldbody></mujoco>""",
        {"m.obj": (square + faces).encode()},
    )
    part = parts_of(Mirror(model), "world")["m"]
    assert "map" in part.material
    uv = part.geometry["data"]["attributes"]["uv"]
    assert uv["itemSize"] == 2
    uv = np.frombuffer(uv["array"].data, dtype=np.float32).reshape(-1, 2)
    assert_array_equal(np.unique(uv, axis=0), [[0, 0], [0, 0.25], [1, 0]])
    position, _, _ = arrays_of(part.geometry)
    assert len(uv) == len(position)


# ------------------------------------------------------------------------- three.js and meshcat


@pytest.mark.parametrize("xml", [JOINTS, TENDONS, ZOO])
def test_objects_are_three_js_objects(xml):
    for _, thing in Mirror(model_of(xml)).objects:
        assert isinstance(thing, meshcat.geometry.Object)
        scene = umsgpack.unpackb(umsgpack.packb(thing.lower()))
        assert scene["metadata"] == {"version": 4.5, "type": "Object"}
        known = {
            table: {entry["uuid"] for entry in scene[table]}
            for table in ("geometries", "materials", "textures", "images")
        }
        for table, identifiers in known.items():
            assert len(identifiers) == len(scene[table])
        assert scene["object"]["type"] == "Group"
        children = scene["object"]["children"]
        assert len({child["uuid"] for child in children}) == len(children)
        for child in children:
            assert child["type"] == "Mesh"
            assert child["geometry"] in known["geometries"]
            assert child["material"] in known["materials"]
            assert len(child["matrix"]) == 16
            assert child["matrix"][3::4] == [0, 0, 0, 1]  # goes by columns
        assert known["geometries"] == {child["geometry"] for child in children}
        assert {m["map"] for m in scene["materials"] if "map" in m} == known["textures"]
        assert {texture["image"] for texture in scene["textures"]} == known["images"]


def test_equal_parts_of_an_object_are_shared_and_equal_objects_equal():
    ball = ({"type": "SphereGeometry", "radius": 1.0}, material([1, 0, 0, 1]))
    parts = [DrawnPart("a", *ball, np.eye(4)), DrawnPart("b", *ball, 2 * np.eye(4))]
    scene = Group(parts).lower()
    assert (len(scene["geometries"]), len(scene["materials"])) == (1, 1)
    assert scene == Group(list(parts)).lower()
    other = DrawnPart("b", capsule(0.1, 0.2), material([0, 0, 1, 1]), np.eye(4))
    scene = Group([parts[0], other]).lower()
    assert (len(scene["geometries"]), len(scene["materials"])) == (2, 2)


def test_draws_into_a_visualizer():
    model = model_of(TENDONS)
    mirror, window = Mirror(model, prefix=("robots",)), Window()
    visualizer = Visualizer(window=window)
    mirror.draw(visualizer)
    drawn = window.of("set_object")
    assert list(drawn) == [path for path, _ in mirror.objects]
    assert drawn["robots/b"]["object"] == umsgpack.unpackb(
        umsgpack.packb(lowered(mirror, "robots/b"))
    )
    assert list(window.of("set_transform")) == mirror.items

    window.commands.clear()
    data = data_at(model, [0.2, 0.4, -0.2])
    mirror.set_poses(visualizer, mirror.poses(data.qpos))
    moved = {
        path: np.reshape(command["matrix"], (4, 4)).T
        for path, command in window.of("set_transform").items()
    }
    assert_allclose(moved["robots/c"][:3, 3], data.body("c").xpos, atol=1e-12)
    assert_allclose(moved["robots/c"][:3, :3], data.body("c").xmat.reshape(3, 3), atol=1e-12)
    assert_allclose(moved["robots/spring"] @ [0, 0, 1, 1], [*data.site("b").xpos, 1], atol=1e-12)
    assert np.abs(moved["robots/pair/2"][:3, :3]).max() < 1e-6


def test_tinted_geoms_are_objects_of_their_own():
    mirror = Mirror(model_of(ZOO), prefix=("p",), tinted=["pill", "egg", "carpet"])
    assert set(parts_of(mirror, "p/zoo/tint")) == {"pill", "egg"}
    assert set(parts_of(mirror, "p/world/tint")) == {"carpet"}
    assert "pill" not in parts_of(mirror, "p/zoo")
    assert mirror.items == ["p/zoo"]
    with pytest.raises(KeyError, match="pil"):
        Mirror(mirror.model, tinted=["pil"])


# -------------------------------------------------------------------------------- whole models


@pytest.mark.parametrize("dimension", [1, 2])
@pytest.mark.parametrize("decorated", [True, False])
def test_fleets_of_flexible_robots(dimension, decorated):
    fleet = compose(np.ones((3 * dimension, 5)), dimension=dimension, decorated=decorated)
    model = compile_model(fleet, timestep=0.001, integrator="Euler")
    kinds = ("main", "appendage")
    bodies = [f"robots/robot_{i}/{kind}" for i in (1, 2, 3) for kind in kinds]
    if not decorated:
        mirror = Mirror(model, prefix=("robots",))
        assert mirror.items == bodies
        assert mirror.objects == []
        return
    coils, chassis = ([f"robot_{i}/{what}" for i in (1, 2, 3)] for what in ("coil", "chassis"))
    mirror = Mirror(model, prefix=("robots",), coils=coils, tinted=chassis)
    # the springs, which act on joints and lie on the ground, are not shown
    assert mirror.items == bodies + [f"robots/{coil}" for coil in coils]
    assert [path for path, _ in mirror.objects if path.endswith("tint")] == [
        f"robots/robot_{i}/main/tint" for i in (1, 2, 3)
    ]
    data = data_at(model, np.linspace(0, 1, model.nq))
    poses = mirror.poses(data.qpos)
    assert_allclose(poses[6:, 7], data.ten_length[[model.tendon(name).id for name in coils]])


@pytest.mark.parametrize("file", ["crane.xml", "cart.xml"])
def test_robots_of_the_examples(file):
    model = mujoco.MjModel.from_xml_path(str(EXAMPLES / file))
    mirror = Mirror(model)
    assert len(mirror.items) == 2
    mirror.draw(Visualizer(window=Window()))


def test_an_empty_model_is_nothing():
    mirror = Mirror(model_of("<mujoco/>"))
    assert mirror.items == []
    assert mirror.objects == []
    assert mirror.poses([]).shape == (0, 8)


def test_no_callback_of_mujoco_is_called():
    def fail(*_):
        raise AssertionError

    mirror = Mirror(model_of(TENDONS))
    mujoco.set_mjcb_passive(fail)
    mujoco.set_mjcb_control(fail)
    try:
        mirror.poses(mirror.model.qpos0)
    finally:
        mujoco.set_mjcb_passive(None)
        mujoco.set_mjcb_control(None)


# ----------------------------------------------------------------------------------- rotations

component = st.floats(-1, 1) | st.sampled_from([0.0, -0.0, 1e-300, -1e-300, 1e-16, -1e-16, 1e-8])


@given(x=component, y=component, z=component | st.sampled_from([1.0, -1.0]))
def test_quaternions_take_z_to_any_direction(x, y, z):
    length = np.linalg.norm([x, y, z])
    if length < 1e-150:
        return
    direction = np.array([[x, y, z]]) / length
    direction /= np.linalg.norm(direction)
    quaternion = np.array([turn_z_to(*direction[0])])
    assert_allclose(np.linalg.norm(quaternion), 1, rtol=1e-14)
    assert_allclose(rotations(quaternion)[0] @ [0, 0, 1], direction[0], atol=1e-14)


def test_quaternions_of_nearby_directions_are_near():
    # about the horizontal, where a fleet's springs lie
    low, high = turn_z_to(1.0, 0.0, -1e-17), turn_z_to(1.0, 0.0, 1e-17)
    assert_allclose(low, high, atol=1e-15)


def test_rotations_are_mujocos():
    quaternions = np.random.default_rng(1).normal(size=(4, 4))
    quaternions /= np.linalg.norm(quaternions, axis=1, keepdims=True)
    for quaternion, matrix in zip(quaternions, rotations(quaternions), strict=True):
        expected = np.empty(9)
        mujoco.mju_quat2Mat(expected, quaternion)
        assert_allclose(matrix.ravel(), expected, atol=1e-15)


def test_commands_can_be_packed():
    mirror = Mirror(model_of(ZOO))
    for path, thing in mirror.objects:
        umsgpack.packb(SetObject(thing, path=meshcat.path.Path((path,))).lower())
    for matrix in transforms(mirror.poses(mirror.model.qpos0)):
        umsgpack.packb(SetTransform(matrix, meshcat.path.Path()).lower())
