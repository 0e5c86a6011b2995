"""The mirror's shapes: MuJoCo's forms, sizes, colours and textures as objects of three.js."""

import base64
import io

import meshcat.geometry
import mujoco
import numpy as np
import pytest
import umsgpack
from mirror_scenes import JOINTS, TENDONS, ZOO, model_of, parts_of
from numpy.testing import assert_allclose, assert_array_equal
from PIL import Image

from gne_mj.viewer.mirror import Mirror
from gne_mj.viewer.shapes import DrawnPart, Group, Sharing, capsule, coil, material


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


def test_floors_that_copies_of_a_file_bring_are_drawn_as_one_for_all():
    """Two robots' floors, 6 m apart along y, are 4 m wide each: together 10 m, in the middle. The
    lowest has no end, and squares of its texture are as large as they were."""
    assets = """<asset><texture name="t" type="2d" builtin="checker" width="8" height="8"/>
        <material name="t" texture="t" texrepeat="10 6"/></asset>"""
    plane = '<geom name="{}/{}" type="plane" size="5 2 1" pos="0 {} {}" material="t"/>'
    robots = (("robot_1", 0), ("robot_2", 6))
    floors = "".join(
        plane.format(robot, name, y, z)
        for robot, y in robots
        for name, z in (("table", 1), ("floor", 0))
    )
    body = '<body><freejoint/><geom size="0.1"/></body>'
    mirror = Mirror(model_of(f"<mujoco>{assets}<worldbody>{floors}{body}</worldbody></mujoco>"))
    parts = parts_of(mirror, "world")
    table, floor = parts["robot_1/table"], parts["robot_1/floor"]
    assert len(parts) == 2
    assert mirror.floor == 0.0
    assert (table.geometry["width"], table.geometry["height"]) == (10.0, 10.0)
    np.testing.assert_allclose(table.matrix[:3, 3], [0.0, 3.0, 1.0])
    assert table.material["map"]["repeat"] == [10.0, 15.0]
    assert (floor.geometry["width"], floor.geometry["height"]) == (1000.0, 1000.0)
    assert floor.material["map"]["repeat"] == [1000.0, 1500.0]


def test_the_page_is_sent_a_meshs_numbers_once():
    """The first time all that the group itself has; from then on all but the numbers."""
    mirror, sent = Mirror(model_of(ZOO)), set()

    def geometries(wrapped):
        return [
            each for _, group in mirror.objects for each in wrapped(group).lower()["geometries"]
        ]

    whole = geometries(lambda group: group)
    assert geometries(lambda group: Sharing(group, sent)) == whole
    meshes = {geometry["uuid"] for geometry in whole if "data" in geometry}
    assert sent == meshes
    assert len(meshes) == 2  # rock and sand
    without = [{**each, "data": {"attributes": {}}} if "data" in each else each for each in whole]
    assert geometries(lambda group: Sharing(group, sent)) == without
