"""Robots with low-level controllers, for tests: their MJCF and the same laws in plain Python."""

import mujoco
import numpy as np

from gne_mj.plants.mjcf_fleet import MjcfPlant
from gne_mj.plants.mjcf_robot import MjcfAgents

# A battery hangs off centre, so that the frame's origin is not the centre of mass
QUADROTOR = """
<mujoco>
  <option/>
  <worldbody>
    <body name="frame" pos="0.3 -0.2 1.5" euler="0 0 40">
      <freejoint name="free"/>
      <geom type="box" size="0.1 0.1 0.03" mass="0.6" contype="0" conaffinity="0"/>
      <body pos="0.02 0.01 -0.05">
        <geom size="0.03" mass="0.2" contype="0" conaffinity="0"/>
      </body>
      <site name="r1" pos=" 0.12  0.12 0.02"/>
      <site name="r2" pos="-0.12  0.12 0.02"/>
      <site name="r3" pos="-0.12 -0.12 0.02"/>
      <site name="r4" pos=" 0.12 -0.12 0.02"/>
    </body>
  </worldbody>
  <actuator>
    <motor name="m1" site="r1" gear="0 0 1 0 0 0.016" ctrlrange="0 6"/>
    <motor name="m2" site="r2" gear="0 0 1 0 0 -0.016" ctrlrange="0 6"/>
    <general name="m3" site="r3" gear="0 0 1 0 0 0.016" gainprm="4" ctrlrange="0 1.5"/>
    <motor name="m4" site="r4" gear="0 0 1 0 0 -0.016" ctrlrange="0 6"/>
  </actuator>
</mujoco>
"""

CAR = """
<mujoco>
  <option integrator="implicitfast"/>
  <worldbody>
    <geom name="ground" type="plane" size="20 20 0.1" friction="1.5 0.005 0.0001"/>
    <body name="car" pos="0 0 0.1">
      <freejoint/>
      <geom type="box" size="0.2 0.12 0.03" pos="0.02 0 0.03" mass="3" contype="0" conaffinity="0"/>
      <geom name="caster" size="0.03" pos="0.17 0 -0.07" mass="0.2" friction="0.001 0 0"
        condim="1" priority="1"/>
      <site name="nose" pos="0.25 0 0"/>
      <body name="left" pos="-0.05 0.15 0">
        <joint name="left" axis="0 1 0" armature="0.0005"/>
        <geom type="cylinder" size="0.1 0.02" zaxis="0 1 0" mass="0.3"/>
      </body>
      <body name="right" pos="-0.05 -0.15 0">
        <joint name="right" axis="0 -1 0" armature="0.0005"/>
        <geom type="cylinder" size="0.1 0.02" zaxis="0 1 0" mass="0.3"/>
      </body>
    </body>
  </worldbody>
  <actuator>
    <motor name="left" joint="left" gear="3" ctrlrange="-2 2"/>
    <motor name="right" joint="right" ctrlrange="-6 6"/>
  </actuator>
</mujoco>
"""

BOAT = """
<mujoco>
  <option density="1000" viscosity="0.001" gravity="0 0 0"/>
  <worldbody>
    <body name="hull" euler="0 0 25">
      <joint name="surge" type="slide" axis="1 0 0"/>
      <joint name="sway" type="slide" axis="0 1 0"/>
      <joint name="yaw" type="hinge" axis="0 0 1"/>
      <geom type="ellipsoid" size="0.6 0.2 0.1" mass="25"/>
      <site name="bow" pos="0.5 0 0"/>
      <site name="port" pos="-0.5 0.15 0"/>
      <site name="starboard" pos="-0.5 -0.2 0"/>
    </body>
  </worldbody>
  <actuator>
    <general name="port" site="port" gear="1 0 0 0 0 0" gainprm="20" ctrlrange="-1 1"/>
    <motor name="starboard" site="starboard" gear="2 0 0 0 0 0" ctrlrange="-10 10"/>
  </actuator>
</mujoco>
"""

ARM = """
<mujoco>
  <worldbody>
    <body name="rail">
      <joint name="rail" type="slide" axis="0.6 0.8 0"/>
      <geom size="0.1" mass="2"/>
      <body name="upper" pos="0.1 0 0.1">
        <joint name="turn" axis="0 0 1"/>
        <joint name="lift" axis="0 1 0" pos="0.02 0 0"/>
        <geom type="capsule" fromto="0 0 0 0.4 0 0" size="0.03" mass="1"/>
        <body name="lower" pos="0.4 0 0" euler="10 20 0">
          <joint name="elbow" axis="0 1 0.2"/>
          <geom type="capsule" fromto="0 0 0 0.3 0 0.1" size="0.03" mass="0.6"/>
          <site name="hand" pos="0.3 0 0.1"/>
        </body>
      </body>
    </body>
  </worldbody>
  <actuator>
    <motor name="a" joint="rail"/><motor name="b" joint="turn" gear="5"/>
    <velocity name="c" joint="lift" kv="3"/><motor name="d" joint="elbow" gear="-2"/>
  </actuator>
</mujoco>
"""


def fleet(path, text, given, output, axes, count=1, timestep=0.002, integrator="euler", **keys):
    """A plant of such robots."""
    path.write_text(text)
    table = MjcfAgents(
        type="mjcf-robot", count=count, file=str(path), output=output, input=given, **keys
    )
    return MjcfPlant(table.build((axes,) * count), timestep, integrator)


def vee(matrix):
    """The vector of a skew matrix."""
    return np.array([matrix[2, 1], matrix[0, 2], matrix[1, 0]])


def quadrotor_law(model, data, u, place, heading, *, w_n=20.0, zeta=1.0, k=2.0, tilt=0.6):
    """Controls of QUADROTOR under a force wish u (N), nan along axes that are held."""
    body = model.body("frame").id
    mass, weight = 0.8, 0.8 * 9.81
    x, r = data.qpos[:3], data.xmat[body].reshape(3, 3)
    v, w = data.qvel[:3], data.qvel[3:6]
    force = np.where(np.isnan(u), -mass * (k**2 * (x - place) + 2 * k * v), u)
    force[2] = max(force[2] + weight, 0.2 * weight)
    across = np.hypot(*force[:2])
    if across > np.tan(tilt) * force[2]:
        force[:2] *= np.tan(tilt) * force[2] / across
    b3 = force / np.linalg.norm(force)
    b2 = np.cross(b3, heading)
    b2 /= np.linalg.norm(b2)
    wanted = np.column_stack([np.cross(b2, b3), b2, b3])
    error = 0.5 * vee(wanted.T @ r - r.T @ wanted)
    # inertia about the centre of mass, from MuJoCo's own mass matrix about the frame's origin
    full = np.zeros((model.nv, model.nv))
    mujoco.mj_fullM(model, data, full)
    centre = r.T @ (data.subtree_com[body] - x)
    j = full[3:6, 3:6] - mass * (centre @ centre * np.eye(3) - np.outer(centre, centre))
    moment = j @ (-(w_n**2) * error - 2 * zeta * w_n * w) + np.cross(w, j @ w)
    arms = np.array([model.site(f"r{n}").pos for n in range(1, 5)]) - centre
    spin = 0.016 * np.array([1, -1, 1, -1])
    mixer = np.vstack([np.ones(4), arms[:, 1], -arms[:, 0], spin])
    thrusts = np.linalg.solve(mixer, [force @ r[:, 2], *moment])
    return thrusts * [1, 1, 1 / 4, 1]


CART = """
<mujoco>
  <option gravity="0 0 0"/>
  <worldbody>
    <body name="cart">
      <joint name="x" type="slide" axis="1 0 0" damping="1.5"/>
      <geom size="0.1" mass="2"/>
    </body>
  </worldbody>
  <actuator><motor name="push" joint="x" gear="4"/></actuator>
</mujoco>
"""
# As if a cart had no drag: it follows a mass that has none
FRICTIONLESS = """
MEMORY = 1


def control(readings, memory, u, *, mass, gain):
    return [u[0] + mass * gain * (memory[0] - readings[0])]


def rate(readings, memory, u, *, mass, gain):
    return [u[0] / mass]


def start(readings, *, mass, gain):
    return [readings[0]]
"""
FRICTIONLESS_KERNELS = """
from gne_mj.native import kernel

MEMORY, PARAMETERS = 1, ("mass", "gain")


@kernel
def control(q, readings, memory, u, out):
    out[0] = u[0] + q[0] * q[1] * (memory[0] - readings[0])


@kernel
def rate(q, readings, memory, u, out):
    out[0] = u[0] / q[0]


@kernel
def start(q, readings, out):
    out[0] = readings[0]
"""
