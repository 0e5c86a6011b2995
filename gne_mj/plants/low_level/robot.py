"""A robot's file by itself, as controllers look into it for masses, places and wheels."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any, NamedTuple

import mujoco
import numpy as np
from numpy.typing import NDArray

from gne_mj.errors import InvalidInput, nearest
from gne_mj.plants.mjcf_actuator import is_servo
from gne_mj.plants.mjcf_output import AXES
from gne_mj.plants.mjcf_reading import OBJECTS, names_in

Array = NDArray[np.float64]

_TRN, _JOINT, _GEOM = mujoco.mjtTrn, mujoco.mjtJoint, mujoco.mjtGeom
_ROUND = (_GEOM.mjGEOM_SPHERE, _GEOM.mjGEOM_CYLINDER, _GEOM.mjGEOM_CAPSULE, _GEOM.mjGEOM_ELLIPSOID)


class Robot(NamedTuple):
    """A robot's file by itself, in the pose that it begins in."""

    model: mujoco.MjModel
    data: mujoco.MjData
    path: Path

    def find(self, key: str, kind: str, name: str) -> int:
        """The number of a named thing.

        Raises:
            InvalidInput: there is none; names ``input`` and the key.
        """
        index = int(mujoco.mj_name2id(self.model, OBJECTS[kind], name))
        if index < 0:
            known = nearest(name, names_in(self.model, kind, ""))
            raise self.refused(key, name, f"{self.path.name} has no such {kind}; {known}")
        return index

    def name(self, key: str, kind: str, index: int) -> str:
        """The name of a thing, which it must have.

        Raises:
            InvalidInput: it has none; names ``input`` and the key.
        """
        found: str = getattr(self.model, kind)(index).name
        if not found:
            raise self.refused(
                key, f"{kind} {index}", f"in {self.path.name} it must have a name: give it one"
            )
        return found

    def refused(self, key: str, value: Any, expected: str) -> InvalidInput:
        """The error for a key of the controller's table."""
        return InvalidInput(f"input.{key}", value, expected)

    def entries_of_axes(self, given: Sequence[str] | None, axes: int) -> list[float]:
        """For x, y and z the entry of an input that is a force along it; -1 for none.

        Args:
            given: the table's ``axes``; if None the first ones.
            axes: entries of the input.

        Raises:
            InvalidInput: they are not as many, or one is there twice; names ``input.axes``.
        """
        named = list(AXES[:axes] if given is None else given)
        if len(named) != axes or len(set(named)) != axes:
            raise self.refused("axes", named, f"an action has {axes} entries: name as many axes")
        return [float(named.index(axis)) if axis in named else -1.0 for axis in AXES]

    def free_body(self, key: str, given: str | None) -> int:
        """The body of a name; without one that of the only free joint.

        Raises:
            InvalidInput: there is none, or several; names ``input`` and the key.
        """
        if given is not None:
            return self.find(key, "body", given)
        free = np.flatnonzero(self.model.jnt_type == _JOINT.mjJNT_FREE)
        if len(free) != 1:
            raise self.refused(
                key, None, f"{self.path.name} has {len(free)} free joints: name the body"
            )
        return int(self.model.jnt_bodyid[free[0]])

    def joint_of(self, key: str, actuator: str, *, slides: bool = False) -> int:
        """The hinge (or slide) joint that an actuator drives.

        Raises:
            InvalidInput: it drives something else; names ``input`` and the key.
        """
        index = self.find(key, "actuator", actuator)
        joint = int(self.model.actuator_trnid[index, 0])
        kinds = (_JOINT.mjJNT_HINGE, _JOINT.mjJNT_SLIDE)[: 1 + slides]
        by_joint = (_TRN.mjTRN_JOINT, _TRN.mjTRN_JOINTINPARENT)
        if (
            _TRN(self.model.actuator_trntype[index]) not in by_joint
            or _JOINT(self.model.jnt_type[joint]) not in kinds
        ):
            what = "hinge or slide" if slides else "hinge"
            raise self.refused(key, actuator, f"it must drive a {what} joint")
        return joint

    def joints_above(self, body: int) -> list[int]:
        """The joints of a body and of all that carry it."""
        model = self.model
        found: list[int] = []
        while body:
            first = int(model.body_jntadr[body])
            found += range(first, first + int(model.body_jntnum[body]))
            body = int(model.body_parentid[body])
        return found

    def slides(self, joint: int) -> bool:
        """Whether it is a slide and no hinge."""
        return bool(self.model.jnt_type[joint] == _JOINT.mjJNT_SLIDE)

    def carries(self, body: int, other: int) -> bool:
        """Whether a body is another one, or that is attached to it."""
        while other > body:
            other = int(self.model.body_parentid[other])
        return other == body

    def axes(self, body: int) -> Array:
        """(3, 3) a body's orientation, its axes the columns."""
        found: Array = self.data.xmat[body].reshape(3, 3)
        return found

    def composite(self, body: int) -> tuple[float, Array, Array]:
        """Mass (kg) of a body with all that it carries, its centre (m), the inertia (kg m^2) there.

        Both in the body's axes, the centre from its origin.
        """
        model, data, own = self.model, self.data, self.axes(body)
        carried = [b for b in range(model.nbody) if self.carries(body, b)]
        mass = float(model.body_mass[carried].sum())
        centre = model.body_mass[carried] @ data.xipos[carried] / mass
        inertia = np.zeros((3, 3))
        for b in carried:
            turned, arm = data.ximat[b].reshape(3, 3), data.xipos[b] - centre
            inertia += turned @ np.diag(model.body_inertia[b]) @ turned.T
            inertia += model.body_mass[b] * (arm @ arm * np.eye(3) - np.outer(arm, arm))
        return mass, own.T @ (centre - data.xpos[body]), own.T @ inertia @ own

    def wrench(self, key: str, actuator: str, body: int, centre: Array) -> Array:
        """(6,) force and moment about a centre, in a body's axes, that 1 N of an actuator gives.

        Args:
            key: of the controller's table, which names the actuator.
            actuator: its name; it acts at a site.
            body: that carries it.
            centre: (3,) from the body's origin, in its axes.

        Raises:
            InvalidInput: it acts elsewhere; names ``input`` and the key.
        """
        model, data = self.model, self.data
        index = self.find(key, "actuator", actuator)
        if model.actuator_trntype[index] != _TRN.mjTRN_SITE:
            raise self.refused(key, actuator, "it must act at a site: <motor site=.../>")
        site = int(model.actuator_trnid[index, 0])
        if not self.carries(body, int(model.site_bodyid[site])):
            name = model.body(body).name
            raise self.refused(key, actuator, f"the body '{name}' must carry its site")
        own = self.axes(body)
        turned = own.T @ data.site_xmat[site].reshape(3, 3)
        gear = model.actuator_gear[model.actuator_outadr[index]]
        force = turned @ gear[:3]
        arm = own.T @ (data.site_xpos[site] - data.xpos[body]) - centre
        return np.concatenate([force, turned @ gear[3:] + np.cross(arm, force)])

    def round_size(self, key: str, body: int) -> float:
        """The radius in m of the largest round geom of a body that touches others.

        Raises:
            InvalidInput: it has none; names ``input`` and the key.
        """
        model, first = self.model, int(self.model.body_geomadr[body])
        found = [
            float(model.geom_size[geom, 0])
            for geom in range(first, first + int(model.body_geomnum[body]))
            if _GEOM(model.geom_type[geom]) in _ROUND
            and (model.geom_contype[geom] or model.geom_conaffinity[geom])
        ]
        if not found:
            name = model.body(body).name
            raise self.refused(
                key, None, f"the body '{name}' has no round geom that touches: give it"
            )
        return max(found)

    def yaw_inertia(self, body: int) -> float:
        """About the vertical through the centre of a body with all that it carries, in kg m^2."""
        _, _, inertia = self.composite(body)
        axes = self.axes(body)
        return float((axes @ inertia @ axes.T)[2, 2])

    def servo(self, key: str, name: str) -> list[float]:
        """Of a servo its gear, gain, b_0, b_1 and b_2, and the range of its force.

        Raises:
            InvalidInput: it is no servo at a joint or tendon; names ``input`` and the key.
        """
        model, index = self.model, self.find(key, "actuator", name)
        along = (_TRN.mjTRN_JOINT, _TRN.mjTRN_JOINTINPARENT, _TRN.mjTRN_TENDON)
        gear = float(model.actuator_gear[model.actuator_outadr[index], 0])
        gain = float(model.actuator_gainprm[index, 0])
        given = _TRN(model.actuator_trntype[index]) in along and gear * gain != 0.0
        if not given or not is_servo(model, index):
            raise self.refused(
                key, name, f"in {self.path.name} it must be a position or velocity servo of a joint"
                " or tendon, without timeconst and delay",
            )  # fmt: skip
        low, high = -np.inf, np.inf
        if model.actuator_forcelimited[index]:
            low, high = model.actuator_forcerange[index]
        return [gear, gain, *model.actuator_biasprm[index, :3].tolist(), float(low), float(high)]
