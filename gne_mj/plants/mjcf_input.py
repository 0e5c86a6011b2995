"""What of a user's robot its input drives: declared, not yet looked for in a model.

A name stands for an actuator. A table says which actuators share an input and by which factors, or
that the input is a force (or a torque) at a body or site itself, which no actuator of the file
gives.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Literal

from pydantic import Field

from gne_mj.errors import InvalidInput
from gne_mj.plants.mjcf_output import AXES, channels
from gne_mj.toml_table import Table


@dataclass(frozen=True)
class Input:
    """What one entry of an action drives.

    Args:
        actuators: names in the robot's file; none for a force at a body or site.
        factors: of each the force that it gives for an input of 1.
        kind: "body" or "site", of a force that no actuator gives; else empty.
        name: of that body or site.
        torque: whether it is a torque (N m) and no force (N).
        own: whether it is along the body's or site's own axes and not the world's.
        axis: 0, 1 or 2.
    """

    actuators: tuple[str, ...] = ()
    factors: tuple[float, ...] = ()
    kind: str = ""
    name: str = ""
    torque: bool = False
    own: bool = False
    axis: int = 0

    def __str__(self) -> str:
        if not self.kind:
            pairs = zip(self.factors, self.actuators, strict=True)
            return ", ".join(f"{factor:g} '{name}'" for factor, name in pairs)
        what = "torque" if self.torque else "force"
        return f"{what} at {self.kind} '{self.name}', {AXES[self.axis]}"


class InputTable(Table):
    """Actuators that share an input, or a force at a body or site."""

    actuators: list[str] | None = Field(None, min_length=1, description="their names")
    factors: list[float] | list[list[float]] | None = Field(
        None,
        description="of each the force for an input of 1; of vectors a list for each entry",
    )
    body: str | None = Field(None, description="a body, at its frame's origin")
    site: str | None = Field(None, description="a site")
    effort: Literal["force", "torque"] | None = Field(
        None, description="at the body or site; a force if left out"
    )
    frame: Literal["world", "own"] | None = Field(
        None, description="along whose axes; the world's if left out"
    )
    axes: list[Literal["x", "y", "z"]] | None = Field(
        None, min_length=1, description="one each entry of the action; x, y, z if left out"
    )

    def channels(self, axes: int) -> tuple[Input, ...]:
        """One for each entry of an action that the table stands for.

        Raises:
            InvalidInput: it names nothing or several things, or numbers that do not fit.
        """
        given = [key for key in ("actuators", "body", "site") if getattr(self, key) is not None]
        if len(given) != 1:
            raise InvalidInput("input", given, "it must name one of actuators, body, site")
        if self.actuators is not None:
            for key in ("effort", "frame", "axes"):
                if getattr(self, key) is not None:
                    raise InvalidInput(f"input.{key}", getattr(self, key), "actuators have none")
            return tuple(
                Input(tuple(self.actuators), tuple(row)) for row in self._rows(self.actuators)
            )
        if self.factors is not None:
            raise InvalidInput("input.factors", self.factors, f"a {given[0]} has none")
        chosen = self.axes if self.axes is not None else AXES[:axes]
        return tuple(
            Input(
                kind=given[0], name=getattr(self, given[0]), torque=self.effort == "torque",
                own=self.frame == "own", axis=AXES.index(axis),
            )
            for axis in chosen
        )  # fmt: skip

    def _rows(self, actuators: Sequence[str]) -> list[list[float]]:
        given: Any = [1.0] * len(actuators) if self.factors is None else self.factors
        rows: list[list[float]] = given if given and isinstance(given[0], list) else [given]
        if any(len(row) != len(actuators) for row in rows):
            raise InvalidInput(
                "input.factors", given, f"it must have {len(actuators)} numbers, one an actuator"
            )
        if not all(any(row) for row in rows):
            raise InvalidInput("input.factors", given, "an input must drive something")
        return rows


def inputs_of(given: Any, count: int, axes: int) -> list[Any]:
    """The input of every channel, agent by agent: as ``channels`` of mjcf_output has them."""
    return channels("input", given, count, axes)
