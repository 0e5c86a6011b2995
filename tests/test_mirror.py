"""The mirror: what meshcat is given to draw, and where, against MuJoCo's own numbers."""

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
from mirror_scenes import JOINTS, TENDONS, ZOO, data_at, model_of, parts_of
from numpy.testing import assert_allclose, assert_array_equal

from gne_mj.plants.fleet import compile_model, compose
from gne_mj.viewer.mirror import Mirror, rotations, transforms
from gne_mj.viewer.placing import turn_z_to

EXAMPLES = Path(__file__).parents[1] / "examples" / "robot"


class Window:
    """Takes the commands of a visualizer, as a server would: lowered and packed."""

    def __init__(self):
        self.commands = []

    def send(self, command):
        self.commands.append(umsgpack.unpackb(umsgpack.packb(command.lower())))

    def of(self, kind):
        return {c["path"].removeprefix("/meshcat/"): c for c in self.commands if c["type"] == kind}


def lowered(mirror, path):
    return dict(mirror.objects)[path].lower()


def ends_of(mirror, poses):
    """Starts and ends of the segments that are shown, by path."""
    matrices = transforms(poses)
    return {
        path: (matrix[:3, 3], matrix[:3] @ [0, 0, 1, 1])
        for path, matrix, pose in zip(mirror.items, matrices, poses, strict=True)
        if pose[7] > 0
    }


# Bodies


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


# Tendons


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


# Into meshcat


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


def test_commands_can_be_packed():
    mirror = Mirror(model_of(ZOO))
    for path, thing in mirror.objects:
        umsgpack.packb(SetObject(thing, path=meshcat.path.Path((path,))).lower())
    for matrix in transforms(mirror.poses(mirror.model.qpos0)):
        umsgpack.packb(SetTransform(matrix, meshcat.path.Path()).lower())


# Whole models


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


# Rotations

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
