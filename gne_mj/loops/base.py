"""What every native closed loop offers to the simulation."""

from abc import ABC, abstractmethod
from collections.abc import Sequence
from typing import TYPE_CHECKING, Annotated, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from gne_mj.errors import EngineError
from gne_mj.loops import monitor as watch

if TYPE_CHECKING:
    from gne_mj.loops.layout import Setup


# Steps that a loop takes without a look at the user's wishes
PIECE = 1_000_000


class Samples(NamedTuple):
    """What a loop recorded at the sample times, one row each.

    Attributes:
        state: (samples, m, states) of the agents' channels.
        input: (samples, m) delivered inputs.
        memory: (samples, k) the law's memory (k = 0 for a static law).
        measurement: (samples, m) outputs as the law read them for that input; (samples, 0) in a run
            without faults.
        applied: (samples, m) inputs with pushes, which moved the plant; likewise.
        configuration: (samples, nq) all joints' positions of MJCF robots, MuJoCo's qpos; of other
            agents, whose state says it, (samples, 0).
    """

    state: Annotated[NDArray[np.float64], "m, states"]
    input: Annotated[NDArray[np.float64], "m"]
    memory: Annotated[NDArray[np.float64], "memory"]
    measurement: Annotated[NDArray[np.float64], "m * faulty"]
    applied: Annotated[NDArray[np.float64], "m * faulty"]
    configuration: Annotated[NDArray[np.float64], "joints"]

    @classmethod
    def join(cls, parts: Sequence["Samples"]) -> "Samples":
        """One after the other."""
        return cls(*(np.concatenate(columns) for columns in zip(*parts, strict=True)))

    def thinned(self, every: int) -> "Samples":
        """Every so many-th row."""
        return Samples(*(column[::every] for column in self))

    def first(self, rows: int) -> "Samples":
        """So many rows; all but some of the last ones if negative."""
        return Samples(*(column[:rows] for column in self))


class Present(NamedTuple):
    """What a loop's system is like between two steps; shapes as a row's of :class:`Samples`."""

    state: NDArray[np.float64]
    memory: NDArray[np.float64]
    configuration: NDArray[np.float64]


class ClosedLoop(ABC):
    """One system's plant, game and law, advanced natively from sample to sample.

    Attributes:
        monitor: what :mod:`gne_mj.loops.monitor` measures, by name.
        network: of a graph that changes: how often it did, and for how many s it was not connected;
            None of others.
        membership: of agents that leave and join: who did when, or was not admitted; None of
            others (:mod:`gne_mj.loops.membership`).
        kept_alive: what must live as long as the loop, as plain functions that it knows by address.
    """

    monitor: Any
    kept_alive: object = None
    network: dict[str, Any] | None = None
    membership: dict[str, Any] | None = None

    @abstractmethod
    def advance(self, samples: int, every: int) -> Samples:
        """Record ``samples`` rows, each followed by ``every`` steps.

        Fewer rows come back if the run leaves the set; the state then stays as it was at the
        start of the step in which that was seen, and the monitor says where and when.
        """

    def pass_over(self, steps: int) -> None:
        """Take so many steps, or as many as stay in the set, and keep no row.

        In pieces, so that Ctrl-C is heard between them.
        """
        while steps > 0 and self.monitor.exit == watch.INSIDE:
            self.advance(1, min(steps, PIECE))
            steps -= PIECE

    @abstractmethod
    def finish(self) -> Samples:
        """Observe the present state without moving on, and return it as one row.

        Its input is not a number if there is none, as outside the interior.
        """

    @abstractmethod
    def present(self) -> Present:
        """Copies of the present state, which is not observed: nothing changes."""

    def adopt(self, setup: "Setup") -> None:
        """Go on from the present state with other numbers of the same game, law and agents.

        In the held modes a law's memory that is still of the last control instant moves on by the
        new numbers from there.

        Args:
            setup: of the same sizes; its clock is that of the present one.
        """
        self._adopt(setup)
        # V is measured from another equilibrium now, so that a step across the change says nothing.
        self.monitor.storage = np.nan

    @abstractmethod
    def _adopt(self, setup: "Setup") -> None:
        """Take the numbers."""

    def start_at(self, step: int) -> None:
        """Let the start be that of a later step, which begins a control period.

        Raises:
            EngineError: this loop knows no other start.
        """
        raise EngineError("only loops with a fixed timestep can go on where others ended")

    def push(self, force: NDArray[np.float64]) -> None:
        """Forces (m,) on the agents' outputs besides their inputs, from now until changed.

        Raises:
            EngineError: this engine, or this output, knows none.
        """
        raise EngineError("only robots in MuJoCo can be pushed while they run")

    def push_unit(self, channel: int) -> str:
        """What pushes of an output (from 0) are measured in: N, or N m where it turns."""
        return "N"

    @property
    @abstractmethod
    def time(self) -> float:
        """Time of the present state in s."""
