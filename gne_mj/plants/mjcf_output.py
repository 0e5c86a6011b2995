"""What of a user's robot is its output: declared, not yet looked for in a model.

A name stands for a joint or a sensor. A table says which body, site, geom, joint, tendon, actuator
or sensor, whether its linear or its angular velocity, along which axes, and of which frame; or it
is a sum of such, each with a factor.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated, Any, Literal

from pydantic import Field

from gne_mj.errors import InvalidInput
from gne_mj.toml_table import Table, Unit

AXES = ("x", "y", "z")
# Things that have a place and an orientation
FRAMES = ("body", "site", "geom")
KINDS = (*FRAMES, "joint", "tendon", "actuator", "sensor", "sum")


@dataclass(frozen=True)
class Output:
    """One measured velocity of a robot, along one axis.

    Args:
        kind: one of KINDS.
        name: of the thing, in the robot's file; empty for a sum.
        angular: whether it is an angular velocity (rad/s), where the thing has both.
        frame: "world", "own", or empty where the table does not say.
        axis: 0, 1 or 2; -1 where it has but one velocity.
        factor: by which it is multiplied.
        terms: of a sum.
    """

    kind: str
    name: str = ""
    angular: bool = False
    frame: str = ""
    axis: int = -1
    factor: float = 1.0
    terms: tuple[Output, ...] = ()

    def __str__(self) -> str:
        if self.terms:
            return " + ".join(f"{term.factor:g} {term}" for term in self.terms)
        along = f", {AXES[self.axis]}" if self.axis >= 0 else ""
        return f"{self.kind} '{self.name}'{along}"


class OutputTable(Table):
    """A velocity of a part of the robot, or a sum of such."""

    body: str | None = Field(None, description="a body, at its frame's origin")
    site: str | None = Field(None, description="a site")
    geom: str | None = Field(None, description="a geom, at its centre")
    joint: str | None = Field(None, description="a joint of any kind")
    tendon: str | None = Field(None, description="a tendon's rate of length")
    actuator: str | None = Field(None, description="an actuator's, its gear included")
    sensor: str | None = Field(None, description="a sensor of velocities")
    sum: list[OutputTable] | None = Field(
        None, min_length=1, description="tables of one number each, with a factor"
    )
    velocity: Literal["linear", "angular"] | None = Field(
        None, description="of bodies, sites and geoms, and of free joints; linear if left out"
    )
    frame: Literal["world", "own"] | None = Field(
        None,
        description="whose axes; if left out the world's, of joints' angular velocities their own",
    )
    axes: list[Literal["x", "y", "z"]] | None = Field(
        None, min_length=1, description="one each entry of the action; x, y, z if left out"
    )
    factor: Annotated[float | None, Unit("")] = Field(None, description="in a sum; 1 if left out")

    def channels(self, axes: int, *, within: bool = False) -> tuple[Output, ...]:
        """One for each number that the table stands for.

        Args:
            axes: how many to take of things that have three, where the table does not say which.
            within: whether the table is a sum's.

        Raises:
            InvalidInput: it names no thing or several, or has keys that the thing does not.
        """
        named = [kind for kind in KINDS if getattr(self, kind) is not None]
        if len(named) != 1:
            raise InvalidInput("output", named, f"it must name one of {', '.join(KINDS)}")
        (kind,) = named
        if self.factor is not None and not within:
            raise InvalidInput("output.factor", self.factor, "it is for the tables of a sum")
        factor = 1.0 if self.factor is None else self.factor
        if self.sum is not None:
            self._unused(kind, "velocity", "frame", "axes")
            return (self._summed(self.sum, factor),)
        name, angular = getattr(self, kind), self.velocity == "angular"
        if kind in ("tendon", "actuator"):
            self._unused(kind, "velocity", "frame", "axes")
        if kind == "sensor":
            self._unused(kind, "velocity", "frame")
        if kind in FRAMES or self.axes is not None or self.velocity is not None:
            chosen = self.axes if self.axes is not None else AXES[: 1 if within else axes]
            places = [AXES.index(axis) for axis in chosen]
        else:
            places = [-1]
        return tuple(Output(kind, name, angular, self.frame or "", axis, factor) for axis in places)

    @staticmethod
    def _summed(tables: Sequence[OutputTable], factor: float) -> Output:
        terms: list[Output] = []
        for table in tables:
            found = table.channels(1, within=True)
            if len(found) != 1:
                raise InvalidInput("output.sum", table.axes, "each of its tables is one number")
            terms += found
        return Output("sum", factor=factor, terms=tuple(terms))

    def _unused(self, kind: str, *keys: str) -> None:
        for key in keys:
            if getattr(self, key) is not None:
                raise InvalidInput(f"output.{key}", getattr(self, key), f"a {kind} has none")


def channels_of(given: Any, count: int, axes: int) -> list[str | Output]:
    """The output of every channel, agent by agent: see :func:`channels`."""
    return channels("output", given, count, axes)


def channels(key: str, given: Any, count: int, axes: int) -> list[Any]:
    """What every channel has, agent by agent.

    Args:
        key: that gives it.
        given: for all agents a name, a table, or a list of as many as an action has entries; or a
            list with one of these for each agent. A table stands for what its ``channels`` returns.
        count: N.
        axes: entries of an agent's action.

    Raises:
        InvalidInput: other numbers of them.
    """
    if not isinstance(given, list):
        rows = [_expanded([given], axes)] * count
    elif axes > 1 and not any(isinstance(entry, list) for entry in given):
        each = [_expanded([entry], axes) for entry in given]
        one_each = len(each) == count and all(len(row) == axes for row in each)
        rows = each if one_each else [_expanded(given, axes)] * count
    else:
        rows = [_expanded(entry if isinstance(entry, list) else [entry], axes) for entry in given]
    if [len(row) for row in rows] != [axes] * count:
        one = "one name" if axes == 1 else f"a list of {axes} names"
        many = "" if axes == 1 else " such lists"
        counts = "" if axes == 1 else "; a table counts by its axes"
        shown = given.model_dump(exclude_none=True) if isinstance(given, Table) else given
        raise InvalidInput(key, shown, f"it must be {one} or a list of {count}{many}{counts}")
    return [entry for row in rows for entry in row]


def _expanded(entries: Sequence[Any], axes: int) -> list[Any]:
    found: list[Any] = []
    for entry in entries:
        found += [entry] if isinstance(entry, str) else entry.channels(axes)
    return found
