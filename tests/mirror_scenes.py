"""Scenes for the mirror, and what is drawn of them."""

import mujoco

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


def model_of(xml):
    return mujoco.MjModel.from_xml_string(xml)


def data_at(model, qpos):
    data = mujoco.MjData(model)
    data.qpos[:] = qpos
    mujoco.mj_forward(model, data)
    return data


def parts_of(mirror, path):
    return {part.name: part for part in dict(mirror.objects)[path].parts}
