"""Skies, lights and materials of files, as the page gets them: against MuJoCo's own numbers."""

import mujoco
import numpy as np
import pytest
from mirror_scenes import model_of, parts_of
from numpy.testing import assert_allclose

from gne_mj.plants.fleet import read_model
from gne_mj.viewer.mirror import Mirror
from gne_mj.viewer.surroundings import light_of, sky_of

RED, BLUE = [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]


def sky(attributes):
    texture = f'<texture name="s" type="skybox" width="64" height="64" {attributes}/>'
    return model_of(f"<mujoco><asset>{texture}</asset></mujoco>")


def test_a_flat_sky_has_its_colours_and_a_gradient_goes_from_one_to_the_other():
    flat = sky_of(sky('builtin="flat" rgb1="1 0 0" rgb2="0 0 1"'))
    assert flat == [RED, RED, BLUE]
    zenith, horizon, nadir = sky_of(sky('builtin="gradient" rgb1="1 0 0" rgb2="0 0 1"'))
    assert_allclose(horizon, [0.5, 0.0, 0.5], atol=0.08)
    assert zenith[0] > 0.8 > 0.2 > nadir[0]
    assert nadir[2] > 0.8 > 0.2 > zenith[2]


def test_the_horizon_is_what_mujoco_keeps_in_the_middle_of_the_faces_around():
    model = sky('builtin="gradient" rgb1="0.2 0.4 0.9" rgb2="0.9 0.8 0.7"')
    data = model.tex_data.reshape(6, 64, 64, 3) / 255
    rows = np.concatenate([data[face, 31:33] for face in (0, 1, 4, 5)])
    assert_allclose(sky_of(model)[1], rows.mean(axis=(0, 1)), atol=1e-3)
    assert_allclose(sky_of(model)[0], data[2].mean(axis=(0, 1)), atol=1e-3)


def test_of_several_skies_the_first_counts_and_without_one_there_is_none():
    two = """<mujoco><asset>
    <texture name="t" type="2d" builtin="flat" rgb1="0 1 0" width="4" height="4"/>
    <texture name="a" type="skybox" builtin="flat" rgb1="1 0 0" rgb2="1 0 0" width="4" height="4"/>
    <texture name="b" type="skybox" builtin="flat" rgb1="0 0 1" rgb2="0 0 1" width="4" height="4"/>
    </asset></mujoco>"""
    assert sky_of(model_of(two)) == [RED] * 3
    assert sky_of(model_of("<mujoco/>")) is None
    assert sky_of(model_of(read_model("lane.xml"))) is not None


def lit(lights, head="0.7"):
    visual = f'<visual><headlight diffuse="{head} {head} {head}"/></visual>'
    return model_of(f"<mujoco>{visual}<worldbody>{lights}</worldbody></mujoco>")


def test_lights_come_from_where_mujoco_has_them():
    """A lamp on a body that is turned: MuJoCo's own direction. One that is green counts for what
    green does to the eye (0.7152 of white), and copies count once."""
    model = lit(
        """<body quat="0.9 0.1 0.3 0.2" pos="0 0 3"><geom size="0.1"/>
             <light name="lamp" dir="0 0.2 -1" diffuse="0.7 0.7 0.7"/></body>
           <light dir="1 0 0" type="directional" diffuse="0 1 0"/>
           <light dir="1 0 0" pos="0 9 9" type="directional" diffuse="0 1 0"/>
           <light dir="0 1 0" active="false" diffuse="1 1 1"/>"""
    )
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    found = light_of(model)
    (first, second), head = found["from"], found["head"]
    total = 0.7152 + 0.7 + 0.7
    assert_allclose(first, [-1, 0, 0, 0.7152 / total], atol=1e-3)
    assert_allclose(second[:3], -data.light("lamp").xdir, atol=0.05)
    assert_allclose([second[3], head], 0.7 / total, atol=1e-3)


def test_a_point_shines_toward_the_middle_and_three_lights_at_most():
    model = lit("".join(
        f'<light type="point" pos="{x} {y} 0" diffuse="{part} {part} {part}"/>'
        for x, y, part in ((3, 0, 0.9), (-3, 0, 0.5), (0, 3, 0.7), (0, -3, 0.1))
    ) + '<geom size="0.1"/>', head="0")  # fmt: skip
    found = light_of(model)
    parts = np.array([0.9, 0.7, 0.5]) / 2.1
    expected = np.column_stack([[[1, 0, 0], [0, 1, 0], [-1, 0, 0]], parts])
    assert_allclose(found["from"], expected, atol=1e-3)
    assert found["head"] == 0.0


def test_without_lights_the_page_has_its_own():
    assert light_of(lit("")) is None
    assert light_of(lit('<light diffuse="0 0 0"/>')) is None


MATERIALS = """
<mujoco>
  <asset>
    <texture name="cube" type="cube" builtin="flat" rgb1="0.9 0.6 0.3" rgb2="0.3 0 0.9" width="8"
             height="8"/>
    <texture name="squares" type="2d" builtin="checker" rgb1="1 0 0" rgb2="0 0 1" width="8"
             height="8"/>
    <material name="fur" texture="cube" rgba="1 0.5 1 1"/>
    <material name="tiles" texture="squares" texrepeat="2 3"/>
    <material name="large" texture="squares" texrepeat="2 3" texuniform="true"/>
    <material name="lamp" rgba="0.8 0.4 0.2 1" emission="0.5" specular="1" shininess="0.25"/>
    <mesh name="rock" vertex="0 0 0  .6 0 0  0 .5 0  0 0 .4"/>
    <hfield name="dune" nrow="2" ncol="3" size="1 2 .5 .1" elevation="0 1 2 1 2 3"/>
  </asset>
  <worldbody>
    <geom name="sand" type="hfield" hfield="dune" material="tiles"/>
    <body><joint/>
      <geom name="paw" size="0.1" material="fur"/>
      <geom name="crate" type="box" size="0.1 0.2 0.3" material="tiles"/>
      <geom name="chest" type="box" size="0.1 0.2 0.3" material="large"/>
      <geom name="rock" type="mesh" mesh="rock" material="tiles"/>
      <geom name="lamp" size="0.1" material="lamp"/>
      <geom name="plain" size="0.1"/>
      <geom name="told" type="box" size="0.1 0.1 0.1" material="tiles"/>
      <geom name="told lamp" size="0.1" material="lamp"/>
    </body>
  </worldbody>
</mujoco>
"""


def test_materials_shine_and_glow_and_textures_are_laid_or_leave_their_mean():
    mirror = Mirror(model_of(MATERIALS), tinted=["told", "told lamp"])
    parts = {name: part.material for name, part in parts_of(mirror, "body_1").items()}
    told = {name: part.material for name, part in parts_of(mirror, "body_1/tint").items()}

    def colour(name):
        return np.array([parts[name]["color"] >> shift & 255 for shift in (16, 8, 0)]) / 255

    # five faces of a flat cube have its first colour, the lower one has its second
    assert_allclose(
        colour("paw"), [1.0 * (4.5 + 0.3) / 6, 0.5 * 3.0 / 6, (1.5 + 0.9) / 6], atol=5e-3
    )
    assert_allclose(colour("rock"), [0.5, 0.0, 0.5], atol=5e-3)  # without texture coordinates
    assert parts["crate"]["map"]["repeat"] == [2.0, 3.0]
    assert_allclose(parts["chest"]["map"]["repeat"], [0.2, 0.6])
    assert parts["lamp"]["emissive"] == 0x66331A
    assert (parts["lamp"]["specular"], parts["lamp"]["shininess"]) == (0x444444, 20)
    assert (parts["plain"]["specular"], parts["plain"]["shininess"]) == (0x222222, 40)
    assert (parts["paw"]["specular"], parts["paw"]["shininess"]) == (0x222222, 40)
    # a robot's colour tells how much of its bounds it uses: nothing may change that
    assert "map" not in told["told"]
    assert "emissive" not in told["told lamp"]


def test_height_fields_have_texture_coordinates_where_they_have_a_texture():
    sand = parts_of(Mirror(model_of(MATERIALS)), "world")["sand"]
    attributes = sand.geometry["data"]["attributes"]
    position, uv = (
        np.frombuffer(attributes[name]["array"].data, dtype=np.float32).reshape(-1, width)
        for name, width in (("position", 3), ("uv", 2))
    )
    assert_allclose(uv, (position[:, :2] + [1, 2]) / [2, 4], atol=1e-6)
    assert sand.material["map"]["repeat"] == [2.0, 3.0]
    bare = model_of(MATERIALS.replace(' hfield="dune" material="tiles"', ' hfield="dune"'))
    geometry = parts_of(Mirror(bare), "world")["sand"].geometry
    assert set(geometry["data"]["attributes"]) == {"position", "normal"}


@pytest.mark.parametrize("file", ["lane.xml", "plane.xml"])
def test_the_packages_own_grounds_have_a_sky_and_a_sun(file):
    model = model_of(read_model(file))
    zenith, horizon, _ = sky_of(model)
    assert zenith[2] > zenith[0]  # blue
    assert sum(horizon) > sum(zenith)  # and paler far away
    found = light_of(model)
    assert found["head"] + sum(each[3] for each in found["from"]) == pytest.approx(1, abs=2e-3)
