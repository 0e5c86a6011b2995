"""A MuJoCo model as meshcat draws it: what is drawn once, and where it is at a state."""

from collections import Counter
from collections.abc import Iterable, Sequence
from typing import Any

import mujoco
import numpy as np
from numpy.typing import ArrayLike, NDArray

from gne_mj.plants.native_mujoco import step_address
from gne_mj.viewer.floors import ground, joined
from gne_mj.viewer.placing import LENGTH, POSITION, QUATERNION, Placing, place
from gne_mj.viewer.shapes import (
    DrawnPart,
    Group,
    Json,
    Matrix,
    Sharing,
    coil,
    height_field,
    material,
    mesh,
    plane,
    primitive,
    tube,
)
from gne_mj.viewer.surfaces import colours, laid_surface, plane_surface, surface

GROUPS = 3  # MuJoCo's viewer shows groups 0 to 2 unless told otherwise
COIL_RADIUS = 2.5, 0.02  # of a tendon's width, and at least so many m
NOTHING = 1e-9  # scale of what is hidden; three.js cannot take 0 apart into rotation and scale


class Mirror:
    """Draws a model, and says where everything is for given joint positions.

    Geoms and sites that move with one body are one object, those that never move one more. As in
    MuJoCo's viewer, of groups 0 to 2 what is not transparent altogether is drawn, and an element's
    own colour hides its material's. 2-D textures are there (round on what is round), those of cubes
    and of meshes without texture coordinates by their mean colour; materials shine and glow, and
    mirror nothing. The sky and the lights are for the page to draw (:mod:`.surroundings`). Flexes,
    skins, cameras, contacts and what else a viewer adds are not drawn.

    Tendons are lines of straight segments, as many as there can ever be. A fixed tendon goes
    through the anchors of its joints where they lie apart.

    Args:
        model: any model. It is kept, and read again with each call of :meth:`poses`.
        prefix: parts of the path that everything is drawn below, as ``("robots",)``.
        tinted: names or numbers of geoms to draw as an object of their own, their body's
            ``.../tint``, which a viewer can colour.
        coils: names of tendons to draw as helical springs; None: those with a stiffness that run
            straight from one site to another.
        hidden: names of geoms to leave out.
        endless: whether the lowest floor is drawn without an end, as robots can stand on it.

    Attributes:
        items: K paths of what moves: bodies, which have the path of their name, then segments of
            tendons.
        world: the path of what never moves.
        objects: path and object of all that is drawn, to be set once.
        floor: the height in m of a ground without an end, if one is among it.

    Raises:
        KeyError: a name that the model does not have.
    """

    def __init__(
        self,
        model: mujoco.MjModel,
        *,
        prefix: tuple[str, ...] = (),
        tinted: Iterable[str | int] = (),
        coils: Iterable[str] | None = None,
        hidden: Iterable[str] = (),
        endless: bool = True,
    ) -> None:
        self.model = model
        self._data = mujoco.MjData(model)
        self._mocap = np.concatenate([self._data.mocap_pos, self._data.mocap_quat], axis=1)
        mujoco.mj_kinematics(model, self._data)
        # bodies that are welded to the world never move; mocap bodies do not count as such
        self._bodies = np.flatnonzero(model.body_weldid)
        segments = self._tendon_segments()
        first = len(self._bodies) + np.cumsum(segments) - segments
        self._segments, self._first = segments, first
        self._joints, self._joint_rows = self._fixed_tendons()

        world, *self.items = self._paths(prefix)
        self.world = world
        self._rest = np.zeros((len(self.items), 8))
        self._rest[:, QUATERNION.start] = 1.0
        self._rest[: len(self._bodies), LENGTH] = 1.0
        self._placing = self._where()
        paths = np.full(model.nbody, world, dtype=object)
        paths[self._bodies] = self.items[: len(self._bodies)]
        parts: dict[str, list[DrawnPart]] = {}
        tints = {model.geom(name).id for name in tinted}
        left_out = {model.geom(name).id for name in hidden}
        shown = [geom for geom in _shown(model, "geom") if geom not in left_out]
        lowest = ground(model, self._data, shown) if endless else set()
        floors = joined(model, self._data, shown, lowest)
        self.floor = float(self._data.geom_xpos[min(lowest), 2]) if lowest else None
        for geom in shown:
            tint = geom in tints
            path = paths[model.geom_bodyid[geom]] + ("/tint" if tint else "")
            drawn = (
                self._floor(geom, floors[geom])
                if geom in floors
                else self._parts("geom", geom, plain=tint)
            )
            if drawn:
                parts.setdefault(path, []).extend(drawn)
        for site in _shown(model, "site"):
            parts.setdefault(paths[model.site_bodyid[site]], []).extend(self._parts("site", site))
        coiled = self._springs() if coils is None else {model.tendon(name).id for name in coils}
        for tendon in np.flatnonzero(segments).tolist():
            part = self._segment(tendon, coiled=tendon in coiled)
            for row in range(first[tendon], first[tendon] + segments[tendon]):
                parts[self.items[row]] = [part]
        self.objects = [(path, Group(own)) for path, own in parts.items() if own]

    def item_of(self, body: int) -> int:
        """Which item a body is.

        Raises:
            KeyError: it never moves.
        """
        (found,) = np.nonzero(self._bodies == body)
        if not len(found):
            raise KeyError(self.model.body(body).name)
        return int(found[0])

    def poses(self, qpos: ArrayLike, mocap: ArrayLike | None = None) -> NDArray[np.float64]:
        """Where all items are.

        Only kinematics are computed, which call none of MuJoCo's callbacks.

        Args:
            qpos: (nq,) joint positions.
            mocap: (nmocap, 7) mocap bodies' position (m) and quaternion w x y z; None: the model's.

        Returns:
            (K, 8): position (m), quaternion w x y z, and length: 1 for bodies, in m for segments of
            tendons, which begin at their position and go along their z axis; 0 hides one that is
            not needed.
        """
        mocap = self._mocap if mocap is None else np.asarray(mocap, dtype=np.float64)
        data = self._data
        data.mocap_pos[:], data.mocap_quat[:] = mocap[:, :3], mocap[:, 3:]
        found: NDArray[np.float64] = self.samples(np.asarray(qpos, dtype=np.float64)[None])[0]
        return found

    def samples(
        self, qpos: NDArray[np.float64], shift: Sequence[float] = (0.0, 0.0)
    ) -> NDArray[np.float64]:
        """Likewise at several samples, mocap bodies where they were last.

        Args:
            qpos: (T, nq) joint positions.
            shift: in m along x and y, by which all is moved.

        Returns:
            (T, K, 8), see :meth:`poses`. What is not a number, as of an agent that is away, is
            hidden in the place of something that is there.
        """
        if qpos.shape[1:] != (self.model.nq,):
            raise ValueError(f"qpos must be (T, {self.model.nq}), not {qpos.shape}")
        found = np.empty((len(qpos), *self._rest.shape))
        place()(self._placing, np.ascontiguousarray(qpos), shift[0], shift[1], found)
        return found

    def draw(self, visualizer: Any, sent: set[str] | None = None) -> None:
        """Draw everything, at the model's reference position, into a ``meshcat.Visualizer``.

        Args:
            visualizer: where.
            sent: what the package's own page has already, see :class:`.shapes.Sharing`; None for
                any other, which is sent all that is drawn.
        """
        for path, content in self.objects:
            visualizer[path].set_object(content if sent is None else Sharing(content, sent))
        self.set_poses(visualizer, self.poses(self.model.qpos0))

    def set_poses(self, visualizer: Any, poses: NDArray[np.float64]) -> None:
        """Move everything to its pose, (K, 8) of :meth:`poses`, in a ``meshcat.Visualizer``."""
        for path, matrix in zip(self.items, transforms(poses), strict=True):
            visualizer[path].set_transform(matrix)

    def _paths(self, prefix: tuple[str, ...]) -> list[str]:
        """The paths of the world, of bodies that move, of segments."""
        model = self.model
        # name, and what is called so if it has none or another one the same
        names = [(model.body(body).name, f"body_{body}") for body in (0, *self._bodies)]
        for tendon in np.flatnonzero(self._segments):
            name, other = model.tendon(tendon).name, f"tendon_{tendon}"
            if self._segments[tendon] == 1:
                names.append((name, other))
                continue
            for number in range(1, self._segments[tendon] + 1):
                names.append((f"{name or other}/{number}", f"{other}_{number}"))
        paths = [
            (*prefix, *(part for part in (name or other).split("/") if part))
            for name, other in names
        ]
        # meshcat moves what is below a path along with it, so none may be below another
        while True:
            uses = Counter(path[:end] for path in paths for end in range(len(path) + 1))
            if all(uses[path] == 1 for path in paths):
                return ["/".join(path) for path in paths]
            paths = [
                path if uses[path] == 1 else (*path, other)
                for path, (_, other) in zip(paths, names, strict=True)
            ]

    def _parts(self, what: str, number: int, *, plain: bool = False) -> list[DrawnPart]:
        """A geom or site as a mesh of its body's group; none if it cannot be drawn."""
        element = getattr(self.model, what)(number)
        drawn = self._shape(element, int(getattr(self.model, f"{what}_dataid")[number]), plain)
        if drawn is None:
            return []
        geometry, own, look = drawn
        at = np.eye(4)
        if self.model.body_weldid[element.bodyid[0]]:
            at[:3, :3], at[:3, 3] = rotations(element.quat), element.pos
        else:
            place = getattr(self._data, what)(number)
            at[:3, :3], at[:3, 3] = place.xmat.reshape(3, 3), place.xpos
        return [DrawnPart(element.name or f"{what}_{number}", geometry, look, at @ own)]

    def _floor(self, geom: int, place: tuple[Any, Any] | None) -> list[DrawnPart]:
        """A plane that never moves, at the middle and of the size that are given; none for None."""
        if place is None:
            return []
        middle, size = place
        element, at = self.model.geom(geom), np.eye(4)
        at[:3, :3], at[:3, 3] = self._data.geom_xmat[geom].reshape(3, 3), middle
        look = plane_surface(self.model, element, size)
        return [DrawnPart(element.name or f"geom_{geom}", plane(size), look, at)]

    def _shape(self, element: Any, number: int, plain: bool) -> tuple[Json, Matrix, Json] | None:
        """Geometry (of mesh or height field ``number``), its own matrix, and material."""
        model, kind, still = self.model, int(element.type[0]), np.eye(4)
        match mujoco.mjtGeom(kind):
            case mujoco.mjtGeom.mjGEOM_PLANE:
                look = plane_surface(model, element, element.size, plain=plain)
                return plane(element.size), still, look
            case mujoco.mjtGeom.mjGEOM_MESH | mujoco.mjtGeom.mjGEOM_SDF:
                if model.mesh_texcoordadr[number] >= 0:
                    look = laid_surface(model, element, np.ones(2), plain=plain)
                else:
                    look = surface(model, element, plain=plain)
                return mesh(model, number), still, look
            case mujoco.mjtGeom.mjGEOM_HFIELD:
                look = laid_surface(model, element, model.hfield_size[number, :2], plain=plain)
                return height_field(model, number, textured="map" in look), still, look
        drawn = primitive(kind, element.size)
        half = np.where(element.size[:2] > 0, element.size[:2], element.size[0])
        return drawn and (*drawn, laid_surface(model, element, half, plain=plain))

    def _is_fixed(self) -> NDArray[np.bool_]:
        """(tendons,)"""
        model = self.model
        if not model.ntendon:
            return np.zeros(0, dtype=bool)
        return model.wrap_type[model.tendon_adr] == mujoco.mjtWrap.mjWRAP_JOINT

    def _tendon_segments(self) -> NDArray[np.int64]:
        """(tendons,) how many segments each has at most; none if it is not shown."""
        model, wrap = self.model, mujoco.mjtWrap
        segments = np.zeros(model.ntendon, dtype=np.int64)
        for tendon in _shown(model, "tendon"):
            at = model.tendon_adr[tendon]
            path = model.wrap_type[at : at + model.tendon_num[tendon]]
            # a geom that is wrapped around is touched where the tendon comes and where it goes
            round_geom = np.isin(path, [wrap.mjWRAP_SPHERE, wrap.mjWRAP_CYLINDER])
            whole = np.repeat(path, np.where(round_geom, 2, 1)) != wrap.mjWRAP_PULLEY
            segments[tendon] = np.count_nonzero(whole[:-1] & whole[1:])
        return segments

    def _fixed_tendons(self) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
        """(n, 2) joints that segments of fixed tendons go between, and their rows of poses."""
        joints, rows = [np.zeros((0, 2), dtype=np.int64)], [np.zeros(0, dtype=np.int64)]
        for tendon in np.flatnonzero(self._is_fixed() & (self._segments > 0)):
            places = self.model.tendon_adr[tendon] + np.arange(self._segments[tendon])
            along = self.model.wrap_objid
            joints.append(np.column_stack([along[places], along[places + 1]]))
            rows.append(self._first[tendon] + np.arange(len(places)))
        return np.concatenate(joints), np.concatenate(rows)

    def _where(self) -> Placing:
        data, segments = self._data, self._segments
        spatial = np.where(self._is_fixed(), 0, segments)
        functions = [step_address("mj_kinematics"), step_address("mj_tendon")]
        functions[1] *= bool(np.any(spatial))  # its Jacobians, not needed, would want mj_comPos
        return Placing(
            np.array([*functions, self.model._address, data._address]),
            data.qpos, data.xpos, data.xquat, data.xanchor,
            data.ten_wrapnum, data.wrap_obj, data.wrap_xpos.reshape(-1, 3),
            self._rest, self._bodies, self._joints, self._joint_rows, self._first, spatial,
        )  # fmt: skip

    def _springs(self) -> set[int]:
        """Spatial tendons with a stiffness, from one site straight to another."""
        model = self.model
        straight = ~self._is_fixed() & (model.tendon_num == 2)
        return set(np.flatnonzero(straight & (model.tendon_stiffness > 0)).tolist())

    def _segment(self, tendon: int, *, coiled: bool) -> DrawnPart:
        model = self.model
        width = float(model.tendon_width[tendon])
        if coiled:
            share, least = COIL_RADIUS
            length = float(model.tendon_length0[tendon]) / int(self._segments[tendon])
            geometry, matrix = coil(max(share * width, least), length)
        else:
            geometry, matrix = tube(width)
        rgba = colours(model, model.tendon_rgba[[tendon]], model.tendon_matid[[tendon]])[0]
        name = model.tendon(tendon).name or f"tendon_{tendon}"
        return DrawnPart(name, geometry, material(rgba), matrix)


def _shown(model: mujoco.MjModel, what: str) -> list[int]:
    """The geoms, sites or tendons that MuJoCo's viewer shows."""
    group, rgba, matid = (getattr(model, f"{what}_{n}") for n in ("group", "rgba", "matid"))
    return np.flatnonzero((group < GROUPS) & (colours(model, rgba, matid)[:, 3] > 0)).tolist()


def rotations(quaternions: NDArray[np.float64]) -> NDArray[np.float64]:
    """(..., 3, 3) matrices of unit quaternions (..., 4), w x y z."""
    w, x, y, z = np.moveaxis(quaternions, -1, 0)
    rows = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
        [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
    ]
    return np.moveaxis(np.array(rows), (0, 1), (-2, -1))


def transforms(poses: NDArray[np.float64]) -> NDArray[np.float64]:
    """(K, 4, 4) matrices of poses (K, 8): what is hidden shrinks to a point."""
    length = poses[:, LENGTH]
    scale = np.where(length > 0, [np.ones_like(length), np.ones_like(length), length], NOTHING)
    matrices = np.zeros((len(poses), 4, 4))
    matrices[:, :3, :3] = rotations(poses[:, QUATERNION]) * scale.T[:, None, :]
    matrices[:, :3, 3] = poses[:, POSITION]
    matrices[:, 3, 3] = 1.0
    return matrices
