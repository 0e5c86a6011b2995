"""A bounded convex part of the plane: half-planes, a disc, or both."""

from dataclasses import dataclass
from functools import cached_property
from typing import Annotated, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from pydantic import Field

from gne_mj.errors import InvalidInput
from gne_mj.game_model import Box
from gne_mj.toml_table import Table, Unit

Array = NDArray[np.float64]

_SIDES = 64  # of a polygon within the disc, which stands for it where a point inside is looked for
_ARC = 128  # corners that stand for the disc where it is drawn
_THINNEST = 1e-6  # of a region, as a share of its length
_FARTHEST = 1e100  # m, so that squares are numbers
_STEPS = 100  # towards the least barrier; some 10 are taken


@dataclass(frozen=True, eq=False)
class Region:
    """The points y with n.y <= b for all half-planes and |y - center| <= radius.

    Args:
        normals: n of each half-plane, unit vectors that point outward, shape (K, 2).
        offsets: b in m, shape (K,).
        center: of the disc in m, shape (2,).
        radius: in m; infinite where there is no disc.
        box: (lower, upper) corners of a rectangle that holds it, each (2,), in m.

    Raises:
        InvalidInput: no point is strictly inside.
    """

    normals: Array
    offsets: Array
    center: Array
    radius: float
    box: Box

    def __post_init__(self) -> None:
        if not self.depth > 0.0:
            expected = "there must be points well inside all of its sides and its disc"
            raise InvalidInput("region", "...", expected)

    @property
    def disc(self) -> bool:
        """Whether it has one."""
        return bool(np.isfinite(self.radius))

    @property
    def middle(self) -> Array:
        """(2,) in m, where the logarithmic barrier of the region by itself is least."""
        return self._middle[0]

    @property
    def depth(self) -> float:
        """How far the boundary is from the middle, at least, in m; 0 if nothing is inside."""
        return self._middle[1]

    @property
    def outline(self) -> Array:
        """(K, 2) its corners in order round it, in m; an arc of the disc has many."""
        (left, low), (right, high) = self.box
        points = np.array([[left, low], [right, low], [right, high], [left, high]])
        if self.disc:
            angle = 2.0 * np.pi * np.arange(_ARC) / _ARC
            points = self.center + self.radius * np.column_stack([np.cos(angle), np.sin(angle)])
        for normal, offset in zip(self.normals, self.offsets, strict=True):
            points = _cut(points, points @ normal - offset)
        return points

    def share(self, points: Array) -> Array:
        """How much of the way to the boundary points (..., 2) have gone: 1 on it, more outside.

        Of a half-plane from the middle, of the disc from its center; the greatest of all.
        """
        from_middle = self.offsets - self.normals @ self.middle
        used = (points - self.middle) @ self.normals.T / from_middle
        if self.disc:
            away = np.linalg.norm(points - self.center, axis=-1, keepdims=True)
            used = np.concatenate([used, away / self.radius], axis=-1)
        return np.asarray(np.max(used, axis=-1))

    @cached_property
    def _middle(self) -> tuple[Array, float]:
        lower, upper = self.box
        if not np.all(lower < upper):
            return np.zeros(2), 0.0
        size = float(np.max(upper - lower))
        about = lower + 0.5 * (upper - lower)  # so that lengths are of the order of 1
        offsets = (self.offsets - self.normals @ about) / size
        center, radius = (self.center - about) / size, self.radius / size
        y = _inner_point(self.normals, offsets, center, radius)
        if y is None:
            return np.zeros(2), 0.0
        y = _least_barrier(self.normals, offsets, center, radius, y)
        room = np.append(offsets - self.normals @ y, radius - np.linalg.norm(y - center))
        return about + size * y, size * float(np.min(room))


def _cut(points: Array, beyond: Array) -> Array:
    """The part of a polygon that is not beyond a line, by how far its corners (K,) are."""
    kept = []
    for k, (point, far) in enumerate(zip(points, beyond, strict=True)):
        before, far_before = points[k - 1], beyond[k - 1]
        if (far > 0.0) != (far_before > 0.0):
            kept.append(before + far_before / (far_before - far) * (point - before))
        if not far > 0.0:
            kept.append(point)
    return np.array(kept).reshape(-1, 2)


def _inner_point(normals: Array, offsets: Array, center: Array, radius: float) -> Array | None:
    """(2,) the middle of the greatest disc inside, by a linear program; None if it is too small."""
    from scipy.optimize import linprog  # slow to load, and for polygons only

    if np.isfinite(radius):
        angle = 2.0 * np.pi * np.arange(_SIDES) / _SIDES
        around = np.column_stack([np.cos(angle), np.sin(angle)])
        normals = np.concatenate([normals, around])
        offsets = np.append(offsets, around @ center + radius * np.cos(np.pi / _SIDES))
    rows = np.column_stack([normals, np.ones(len(normals))])
    found = linprog([0.0, 0.0, -1.0], rows, offsets, bounds=(None, None)).x
    return None if found is None or not found[2] > _THINNEST else np.asarray(found[:2])


def _least_barrier(normals: Array, offsets: Array, center: Array, radius: float, y: Array) -> Array:
    """Where the region's barrier is least, from a point (2,) inside, by damped Newton steps.

    The barrier is self-concordant, so that a step shortened by 1 + its decrement stays inside.
    """
    for _ in range(_STEPS):
        push = normals / (offsets - normals @ y)[:, None]
        slope, bend = np.sum(push, axis=0), push.T @ push
        if np.isfinite(radius):
            away = y - center
            room = radius**2 - away @ away
            slope = slope + 2.0 * away / room
            bend = bend + 2.0 * np.eye(2) / room + 4.0 * np.outer(away, away) / room**2
        step = np.linalg.solve(bend, slope)
        decrement = np.sqrt(slope @ step)
        y = y - step / (1.0 + decrement)
        if decrement < 1e-12:
            break
    return y


def region_of(
    *,
    box: ArrayLike | None = None,
    vertices: ArrayLike | None = None,
    center: ArrayLike | None = None,
    radius: float | None = None,
) -> Region:
    """What is in all of these: at least one of a box, a polygon and a disc.

    Args:
        box: [[least x, least y], [greatest x, greatest y]] in m.
        vertices: of a convex polygon, in either order round it, in m, shape (3 or more, 2).
        center: of a disc in m; [0, 0] if left out.
        radius: of it in m, which makes the disc.

    Raises:
        InvalidInput: naming the first that is no such thing, or ``region`` where nothing is left.
    """
    corners = [_corners(box)] if box is not None else []
    corners += [_convex(vertices)] if vertices is not None else []
    boxes = [(np.min(each, axis=0), np.max(each, axis=0)) for each in corners]
    middle = np.zeros(2) if center is None else _points("center", [center])[0]
    if radius is not None:
        if not 1.0 / _FARTHEST <= radius <= _FARTHEST:
            expected = f"it must be positive and finite, from {1.0 / _FARTHEST:g} to {_FARTHEST:g}"
            raise InvalidInput("radius", radius, expected)
        boxes.append((middle - radius, middle + radius))
    elif center is not None:
        raise InvalidInput("radius", None, "a disc has a center and a radius")
    if not boxes:
        raise InvalidInput("region", None, "it needs a box, vertices or a radius")
    normals, offsets = [np.zeros((0, 2))], [np.zeros(0)]
    for points in corners:
        along = np.roll(points, -1, axis=0) - points
        outward = np.column_stack([along[:, 1], -along[:, 0]])
        normals.append(outward / np.hypot(*outward.T)[:, None])
        offsets.append(np.sum(normals[-1] * points, axis=1))
    lower, upper = (np.array([each[k] for each in boxes]) for k in (0, 1))
    return Region(
        np.concatenate(normals),
        np.concatenate(offsets),
        middle,
        np.inf if radius is None else float(radius),
        (np.max(lower, axis=0), np.min(upper, axis=0)),
    )


def _points(key: str, given: Any) -> Array:
    try:
        points = np.asarray(given, dtype=np.float64)
    except ValueError:  # lists of unequal lengths
        points = np.zeros(0)
    if points.ndim != 2 or points.shape[1] != 2 or not np.all(np.abs(points) <= _FARTHEST):
        expected = f"every point must be [x, y], two finite numbers of at most {_FARTHEST:g}"
        raise InvalidInput(key, given, expected)
    return points


def _corners(given: ArrayLike) -> Array:
    """(4, 2) of a box, anticlockwise."""
    points = _points("box", given)
    if len(points) != 2 or not np.all(points[0] < points[1]):
        raise InvalidInput(
            "box", given, "it must be [[least x, least y], [greatest x, greatest y]]"
        )
    (left, low), (right, high) = points
    return np.array([[left, low], [right, low], [right, high], [left, high]])


def _convex(given: ArrayLike) -> Array:
    """The vertices of a polygon, anticlockwise."""
    points = _points("vertices", given)
    expected = "there must be three or more, of a convex polygon, in order round it"
    if len(points) < 3:
        raise InvalidInput("vertices", given, expected)
    along = np.roll(points, -1, axis=0) - points
    ahead = np.roll(along, -1, axis=0)
    turn = np.arctan2(
        along[:, 0] * ahead[:, 1] - along[:, 1] * ahead[:, 0], np.sum(along * ahead, axis=1)
    )
    once = abs(abs(np.sum(turn)) - 2.0 * np.pi) < 1e-6  # and not twice, as a star
    if not once or not np.all(turn * np.sign(np.sum(turn)) > 1e-9):
        raise InvalidInput("vertices", given, expected)
    return points if np.sum(turn) > 0.0 else points[::-1]


_Point = Annotated[list[float], Field(min_length=2, max_length=2)]


class RegionTable(Table):
    """Where agents in the plane must stay: a box, a convex polygon, a disc, or what all have."""

    box: Annotated[list[_Point] | None, Unit("m")] = Field(
        None, description="[[least x, least y], [greatest x, greatest y]]"
    )
    vertices: Annotated[list[_Point] | None, Unit("m")] = Field(
        None, description="of a convex polygon in order round it"
    )
    center: Annotated[_Point | None, Unit("m")] = Field(
        None, description="of a disc; [0, 0] if left out"
    )
    radius: Annotated[float | None, Unit("m", "> 0")] = Field(None, description="of the disc")

    def build(self) -> Region:
        """The region."""
        return region_of(**self.model_dump())
