"""MuJoCo's shapes in three.js's JSON: geometries, materials, and groups of meshes that are drawn.

A *geometry* and a *material* are three.js's own descriptions without identifiers; a group adds
these. Lengths are in m, colours rgba from 0 to 1. Where three.js would have a shape along y, its
geometry comes with a matrix that turns it along z, as MuJoCo has it.
"""

import base64
import hashlib
import io
import json
import uuid
from typing import Any, NamedTuple

import mujoco
import numpy as np
from meshcat.geometry import Object, pack_numpy_array
from numpy.typing import ArrayLike, NDArray
from PIL import Image

Json = dict[str, Any]
Matrix = NDArray[np.float64]  # (4, 4)

ENDLESS = 500.0  # m, half the side of what stands for an infinite plane

# three.js's names of numbers
FRONT, REPEAT, LINEAR, LINEAR_MIPMAP = 0, 1000, 1006, 1008

SHARP = 0.5  # cosine of the angle that a mesh's normal may be away from its face's

# How finely round shapes are drawn
AROUND, QUARTER = 24, 8  # edges of a circle; of a capsule's quarter circle
WIRE_AROUND, WIRE_ALONG, WIRE_POINTS = 6, 14, 8  # of a coil's wire: around it; each turn

# Turns three.js's y axis to z
UPRIGHT: Matrix = np.array(
    [[1.0, 0.0, 0.0, 0.0], [0.0, 0.0, -1.0, 0.0], [0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 0.0, 1.0]]
)


class DrawnPart(NamedTuple):
    """One mesh of a group.

    Attributes:
        name: what it is called in the viewer.
        geometry, material: see the module; a material may hold a texture as its "map".
        matrix: (4, 4) from the geometry to the group.
    """

    name: str
    geometry: Json
    material: Json
    matrix: Matrix


class Group(Object):
    """Meshes that move as one, for meshcat's ``set_object``.

    meshcat makes a folder of its menu for every path, which is slow; one group needs one path.
    Equal geometries, materials and textures are sent once. Identifiers follow from contents, so
    that drawing the same model again gives the same bytes.

    Args:
        parts: the meshes.
    """

    def __init__(self, parts: list[DrawnPart]) -> None:
        self.parts = parts

    def lower(self) -> Json:
        """The group in three.js's object format, version 4.5."""
        tables: dict[str, dict[str, Json]] = {
            "geometries": {}, "materials": {}, "textures": {}, "images": {}
        }  # fmt: skip

        def shared(table: str, content: Json) -> str:
            identifier = _identifier(content)
            tables[table][identifier] = {"uuid": identifier, **content}
            return identifier

        children = []
        for number, part in enumerate(self.parts):
            material = dict(part.material)
            if "map" in material:
                texture = material["map"]
                texture = texture | {"image": shared("images", texture["image"])}
                material["map"] = shared("textures", texture)
            child = {
                "type": "Mesh",
                "name": part.name,
                "geometry": shared("geometries", part.geometry),
                "material": shared("materials", material),
                "matrix": part.matrix.T.ravel().tolist(),  # three.js goes by columns
                "castShadow": True,
                "receiveShadow": True,
            }
            children.append({"uuid": _identifier([number, child]), **child})
        return {
            "metadata": {"version": 4.5, "type": "Object"},
            **{table: list(entries.values()) for table, entries in tables.items()},
            "object": {"uuid": _identifier(children), "type": "Group", "children": children},
        }


class Sharing(Object):
    """Groups whose geometries of many numbers are sent once: the page has them by their identifier.

    Args:
        group: what is drawn.
        sent: identifiers of what the page has; what it gets here is added when it is lowered.
    """

    def __init__(self, group: Group, sent: set[str]) -> None:
        self.group, self.sent = group, sent

    def lower(self) -> Json:
        """As of the group; what the page has is there without its numbers."""
        found = self.group.lower()
        for geometry in found["geometries"]:
            if "data" in geometry:
                if geometry["uuid"] in self.sent:
                    geometry["data"] = {"attributes": {}}
                self.sent.add(geometry["uuid"])
        return found


def _identifier(content: object) -> str:
    def of_array(array: Any) -> str:
        return hashlib.sha256(array.data).hexdigest()

    text = json.dumps(content, default=of_array).encode()
    return str(uuid.UUID(bytes=hashlib.blake2b(text, digest_size=16).digest()))


def material(rgba: ArrayLike, **more: Any) -> Json:
    """A surface of one colour, times a texture if ``more`` has a "map"; seen from outside only."""
    *colour, alpha = np.clip(np.asarray(rgba, dtype=np.float64), 0.0, 1.0).tolist()
    red, green, blue = (round(255 * part) for part in colour)
    return {
        "type": "MeshPhongMaterial",
        "color": red << 16 | green << 8 | blue,
        "specular": 0x222222,
        "shininess": 40,
        "side": FRONT,
        "opacity": alpha,
        "transparent": alpha < 1.0,
        **more,
    }


def pixels(model: mujoco.MjModel, number: int) -> NDArray[np.uint8]:
    """(height, width, channels) of a texture; a cube's six faces are below each other, or alike."""
    at, channels = model.tex_adr[number], model.tex_nchannel[number]
    height, width = model.tex_height[number], model.tex_width[number]
    return model.tex_data[at : at + height * width * channels].reshape(height, width, channels)


def texture(
    model: mujoco.MjModel, number: int, repeat: Any, offset: ArrayLike | None = None
) -> Json:
    """The model's 2-D texture of this number.

    Args:
        model: whose.
        number: which.
        repeat: (2,) how many times it is there in each direction.
        offset: (2,) where it begins, in repetitions; None: in the upper left corner.
    """
    offset = np.array([0.0, -repeat[1]]) if offset is None else np.asarray(offset)
    image, png = pixels(model, number), io.BytesIO()
    Image.fromarray(image[..., 0] if image.shape[2] == 1 else image).save(png, "png")
    return {
        "image": {"url": "data:image/png;base64," + base64.b64encode(png.getvalue()).decode()},
        "wrap": [REPEAT, REPEAT],
        "repeat": [float(times) for times in repeat],
        "offset": (offset % 1.0).tolist(),
        "minFilter": LINEAR_MIPMAP,
        "magFilter": LINEAR,
        "anisotropy": 8,
    }


def primitive(kind: int, size: NDArray[np.float64]) -> tuple[Json, Matrix] | None:
    """A sphere, capsule, ellipsoid, cylinder or box of MuJoCo's ``size``; None: another kind."""
    radius, half_length = float(size[0]), float(size[1])
    match mujoco.mjtGeom(kind):
        case mujoco.mjtGeom.mjGEOM_SPHERE:
            return sphere(radius), np.eye(4)
        case mujoco.mjtGeom.mjGEOM_CAPSULE:
            return capsule(radius, half_length), UPRIGHT
        case mujoco.mjtGeom.mjGEOM_ELLIPSOID:
            return sphere(1.0), np.diag([*size, 1.0])
        case mujoco.mjtGeom.mjGEOM_CYLINDER:
            return cylinder(radius, 2 * half_length), UPRIGHT
        case mujoco.mjtGeom.mjGEOM_BOX:
            width, height, depth = (2 * size).tolist()
            box = {"type": "BoxGeometry", "width": width, "height": height, "depth": depth}
            return box, np.eye(4)
    return None


def sphere(radius: float) -> Json:
    """A sphere around the origin."""
    return {
        "type": "SphereGeometry",
        "radius": radius,
        "widthSegments": AROUND,
        "heightSegments": 2 * QUARTER,
    }


def cylinder(radius: float, length: float) -> Json:
    """A cylinder along y, its centre in the origin."""
    return {
        "type": "CylinderGeometry",
        "radiusTop": radius,
        "radiusBottom": radius,
        "height": length,
        "radialSegments": AROUND,
    }


def capsule(radius: float, half_length: float) -> Json:
    """A capsule along y; ``half_length`` is without its round ends, as MuJoCo has it."""
    angles = np.linspace(0.0, np.pi / 2, QUARTER + 1)
    along = half_length + radius * np.sin(angles)
    outward = radius * np.cos(angles)
    profile = np.column_stack([[*outward[::-1], *outward], [*-along[::-1], *along]])
    return {
        "type": "LatheGeometry",
        "points": [{"x": x, "y": y} for x, y in profile.tolist()],
        "segments": AROUND,
        "phiStart": 0.0,
        "phiLength": 2 * np.pi,
    }


def plane(size: NDArray[np.float64]) -> Json:
    """A plane of MuJoCo's half sides ``size``; a side of 0 has no end."""
    width, height = np.where(size[:2] > 0, 2 * size[:2], 2 * ENDLESS).tolist()
    return {"type": "PlaneGeometry", "width": width, "height": height}


def plane_texture(
    model: mujoco.MjModel, number: int, size: NDArray[np.float64], *, repeat: Any, uniform: bool
) -> Json:
    """A plane's texture where MuJoCo's renderer has it.

    Args:
        model: whose.
        number: which texture.
        size: the plane's half sides; a side of 0 has no end.
        repeat: (2,) the material's ``texrepeat``: repetitions over the plane or, where it has no
            end or all is ``uniform``, over 2 m.
        uniform: the material's ``texuniform``.
    """
    endless = size[:2] <= 0
    half = np.where(endless, ENDLESS, size[:2])
    repeat = np.where(endless | uniform, repeat * half, repeat)
    # from the upper left corner, or around the middle of what has no end
    offset = np.where(endless, 0.5 - repeat / 2, [0.0, -repeat[1]])
    return texture(model, number, repeat, offset)


def triangles(
    vertices: ArrayLike, normals: ArrayLike, faces: ArrayLike, uv: ArrayLike | None = None
) -> Json:
    """Triangles: (V, 3) vertices with normals, (F, 3) faces, (V, 2) texture coordinates."""
    attributes = {"position": vertices, "normal": normals} | ({} if uv is None else {"uv": uv})
    return {
        "type": "BufferGeometry",
        "data": {
            "attributes": {
                name: pack_numpy_array(np.asarray(values, dtype=np.float32).T)
                for name, values in attributes.items()
            },
            "index": pack_numpy_array(np.ravel(faces).astype(np.uint32)),
        },
    }


def mesh(model: mujoco.MjModel, number: int) -> Json:
    """The model's mesh of this number, with texture coordinates if it has any."""

    def own(values: Any, addresses: Any, counts: Any) -> Any:
        return values[addresses[number] : addresses[number] + counts[number]]

    vertices = own(model.mesh_vert, model.mesh_vertadr, model.mesh_vertnum)
    normals = own(model.mesh_normal, model.mesh_normaladr, model.mesh_normalnum)
    faces, of_normals, of_uv = (
        own(corners, model.mesh_faceadr, model.mesh_facenum)
        for corners in (model.mesh_face, model.mesh_facenormal, model.mesh_facetexcoord)
    )
    # MuJoCo's own normals are arbitrary at sharp edges: there each face gets its own
    a, b, c = np.moveaxis(vertices[faces].astype(np.float64), 1, 0)
    flat = np.cross(b - a, c - a)
    flat /= np.maximum(np.linalg.norm(flat, axis=1, keepdims=True), np.finfo(float).tiny)
    sharp = np.einsum("fci,fi->fc", normals[of_normals], flat) < SHARP
    of_normals = np.where(sharp, len(normals) + np.arange(len(faces))[:, None], of_normals)
    normals = np.concatenate([normals, flat])

    # A corner has its normal, and texture coordinates, in each face; three.js knows only vertices:
    # one for each combination that there is.
    textured = model.mesh_texcoordadr[number] >= 0
    corners = [faces, of_normals, *([of_uv] if textured else [])]
    combinations, corner = np.unique(
        [indices.ravel() for indices in corners], axis=1, return_inverse=True
    )
    uv = None
    if textured:
        uv = own(model.mesh_texcoord, model.mesh_texcoordadr, model.mesh_texcoordnum)
        uv = uv[combinations[2]] * [1, -1] + [0, 1]  # images begin at the top
    return triangles(vertices[combinations[0]], normals[combinations[1]], corner, uv)


def height_field(model: mujoco.MjModel, number: int, *, textured: bool = False) -> Json:
    """The model's height field of this number: the surface on a solid base.

    Args:
        model: whose.
        number: which.
        textured: with texture coordinates, from 0 to 1 along x and y.
    """
    rows, columns = int(model.hfield_nrow[number]), int(model.hfield_ncol[number])
    half_x, half_y, top, base = model.hfield_size[number]
    at = model.hfield_adr[number]
    height = top * model.hfield_data[at : at + rows * columns].reshape(rows, columns)
    y, x = np.linspace(-half_y, half_y, rows), np.linspace(-half_x, half_x, columns)
    points = np.dstack([*np.meshgrid(x, y), height]).reshape(-1, 3)
    slope_y, slope_x = np.gradient(height, y, x)
    upward = np.dstack([-slope_x, -slope_y, np.ones_like(height)]).reshape(-1, 3)
    upward /= np.linalg.norm(upward, axis=1, keepdims=True)
    number_of = np.arange(rows * columns).reshape(rows, columns)
    a, b = number_of[:-1, :-1].ravel(), number_of[:-1, 1:].ravel()
    c, d = number_of[1:, 1:].ravel(), number_of[1:, :-1].ravel()
    surface = np.concatenate([np.column_stack([a, b, c]), np.column_stack([a, c, d])])

    # walls below the edge, which is gone round counter-clockwise
    edge = np.concatenate(
        [number_of[0, :-1], number_of[:-1, -1], number_of[-1, :0:-1], number_of[:0:-1, 0]]
    )
    start, end = points[edge], points[np.roll(edge, -1)]
    below_start, below_end = ((p[:, 0], p[:, 1], np.full(len(p), -base)) for p in (start, end))
    walls = np.stack([np.transpose(below_start), np.transpose(below_end), end, start], axis=1)
    outward = np.cross(end - start, [0.0, 0.0, 1.0])
    outward /= np.linalg.norm(outward, axis=1, keepdims=True)
    bottom = np.array([[-half_x, half_y], [half_x, half_y], [half_x, -half_y], [-half_x, -half_y]])
    quads = np.concatenate([walls, np.insert(bottom, 2, -base, axis=1)[None]]).reshape(-1, 3)
    quad_normals = np.repeat([*outward, [0.0, 0.0, -1.0]], 4, axis=0)
    first = len(points) + 4 * np.arange(len(edge) + 1)
    points = np.concatenate([points, quads])
    return triangles(
        points,
        np.concatenate([upward, quad_normals]),
        np.concatenate([surface, np.add.outer(first, [0, 1, 2]), np.add.outer(first, [0, 2, 3])]),
        0.5 + 0.5 * points[:, :2] / [half_x, half_y] if textured else None,
    )


def tube(radius: float) -> tuple[Json, Matrix]:
    """A straight piece of tendon: from 0 to 1 along z, to be scaled to its length."""
    matrix = UPRIGHT.copy()
    matrix[2, 3] = 0.5
    return cylinder(radius, 1.0), matrix


def coil(radius: float, length: float) -> tuple[Json, Matrix]:
    """A helical spring from 0 to 1 along z, to be scaled to its length.

    Args:
        radius: of the helix.
        length: at which its wire is round; scaled to another one it is an ellipse.
    """
    length = max(length, 6 * radius)
    turns = int(np.clip(round(length / (1.2 * radius)), 6, 12))
    straight = 0.08 * length  # at both ends, on the axis
    angle = 2 * np.pi * np.linspace(0.0, turns, turns * WIRE_POINTS + 1)
    # wound up from the axis and back to it within half a turn
    wound = np.clip(np.minimum(angle, angle[::-1]) / np.pi, 0.0, 1.0)
    wound *= radius * wound * (3 - 2 * wound)
    z = np.linspace(straight, length - straight, len(angle))
    helix = np.column_stack([wound * np.cos(angle), wound * np.sin(angle), z])
    path = np.concatenate([[[0, 0, 0]], helix, [[0, 0, length]]])
    geometry = {
        "type": "TubeGeometry",
        "path": {
            "type": "CatmullRomCurve3",
            "points": np.round(path, 6).tolist(),
            "arcLengthDivisions": 2 * turns * WIRE_ALONG,
            "closed": False,
            "curveType": "centripetal",
            "tension": 0.5,
        },
        "tubularSegments": turns * WIRE_ALONG,
        "radius": 0.15 * radius,
        "radialSegments": WIRE_AROUND,
        "closed": False,
    }
    return geometry, np.diag([1.0, 1.0, 1.0 / length, 1.0])
