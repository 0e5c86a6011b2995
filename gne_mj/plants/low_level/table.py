"""What a low-level controller is: the step from an agent's input to the controls of its actuators.

It takes all entries of one agent's input u at once, reads the robot, and says what each of the
actuators that it names shall give; it may have a memory, whose rate it says too. Each kind is one
module (``low_level/quadrotor.py``) with its registered table and its kernels:

    control(q, readings, memory, u, out)   fills out (controls,), of actuators that are forces; with
                                           COUNTS_LIMITS = True it returns 1 where it gave less than
                                           u asks for, by limits of its own, and else 0
    rate(q, readings, memory, u, out)      fills out (moving,); only with a memory that moves
    start(q, readings, out)                fills out (memory,) at a run's start, else zeros; called
                                           in Python

Those entries of the memory that move come first. They are in MuJoCo's ``act``, each an activation
that integrates its control, so that whatever saves, copies or predicts a simulation's state has
them too; what is only kept from the start is in ``userdata``.
"""

from abc import abstractmethod
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from types import ModuleType
from typing import TYPE_CHECKING, Annotated, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from pydantic import Discriminator, Tag

from gne_mj.plants.mjcf_input import InputTable
from gne_mj.plants.mjcf_output import Output
from gne_mj.registry import LOW_LEVEL
from gne_mj.toml_table import Table

if TYPE_CHECKING:
    from gne_mj.plants.low_level.robot import Robot


class Seen(NamedTuple):
    """One number that a controller reads.

    Attributes:
        of: of what, in the robot's file; for a velocity or position as outputs are declared.
        value: "velocity", "position", "orientation", or an array of mjData with three numbers for
            each such thing.
        component: of an orientation (row by row) or such an array.
    """

    of: Output | str
    value: str = "velocity"
    component: int = 0


@dataclass(frozen=True, eq=False)
class Controller:
    """A controller as one robot has it, everything by the names of its file.

    Attributes:
        module: its kernels.
        actuators: whose forces it says, (controls,).
        seen: what it reads, (readings,).
        numbers: q.
        inputs: entries of u.
        moving, held: entries of its memory that move, and that are kept from the start.
        start: in place of the module's.
        kept: what must be there as long as it is.
        raw: whether it says the actuators' own controls, which are not made forces.
        holds_weight: whether it gives what holds the robot against gravity without being asked.
    """

    module: ModuleType
    actuators: tuple[str, ...]
    seen: tuple[Seen, ...]
    numbers: NDArray[np.float64]
    inputs: int
    moving: int = 0
    held: int = 0
    start: Callable[..., None] | None = None
    kept: Any = None
    raw: bool = False
    holds_weight: bool = False


class ControllerTable(Table):
    """``input = { controller = ..., ... }``: the keys of one kind of controller."""

    def channels(self, axes: int) -> "tuple[Controlled, ...]":
        """One for each entry of an action."""
        return tuple(Controlled(self, axis, axes) for axis in range(axes))

    @abstractmethod
    def bind(self, robot: "Robot", axes: int) -> Controller:
        """The controller of a robot whose input has so many entries.

        Raises:
            InvalidInput: the file does not have what it needs; names ``input`` and the key.
        """


def _which(given: Any) -> str:
    named = isinstance(given, ControllerTable) or "controller" in (
        given if isinstance(given, Mapping) else ()
    )
    return "ControllerTable" if named else "InputTable"


# ``input = { ... }``: of a controller, or of actuators
InputGiven = Annotated[
    Annotated[InputTable, Tag("InputTable")]
    | Annotated[ControllerTable, LOW_LEVEL, Tag("ControllerTable")],
    Discriminator(_which),
]


@dataclass(frozen=True)
class Controlled:
    """That an entry of an action goes to a low-level controller.

    Args:
        table: of that controller.
        axis: which entry of its input, from 0.
        axes: how many there are.
    """

    table: ControllerTable
    axis: int
    axes: int

    def __hash__(self) -> int:
        return hash((self.table.model_dump_json(), self.axis, self.axes))

    def __str__(self) -> str:
        return f"{self.table.controller}, input {self.axis + 1}"  # type: ignore[attr-defined]


def orientation(kind: str, name: str) -> tuple[Seen, ...]:
    """The nine numbers of a body's, site's or geom's orientation, row by row."""
    return tuple(Seen(Output(kind, name), "orientation", k) for k in range(9))


def three(kind: str, name: str, value: str) -> tuple[Seen, ...]:
    """The three numbers that an array of mjData has for a thing."""
    return tuple(Seen(Output(kind, name), value, k) for k in range(3))


def along(value: str, kind: str, name: str, *, angular: bool = False, own: bool = False,
          axes: Sequence[int] = (0, 1, 2)) -> tuple[Seen, ...]:  # fmt: skip
    """Velocities or positions of a body's, site's or geom's along some axes."""
    frame = "own" if own else "world"
    return tuple(Seen(Output(kind, name, angular, frame, axis), value) for axis in axes)
