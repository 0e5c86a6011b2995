"""What every native closed loop offers to the simulation."""

from abc import ABC, abstractmethod
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True)
class Samples:
    """What a loop recorded at the sample times, one row each.

    Attributes:
        state: (samples, m, states) of the agents' channels.
        input: (samples, m) delivered inputs.
        memory: (samples, k) the law's memory (k = 0 for a static law).
        seen: (samples, m) outputs as the law read them for that input; (samples, 0) in a run
            without faults.
        acts: (samples, m) inputs with pushes, which moved the plant; likewise.
    """

    state: NDArray[np.float64]
    input: NDArray[np.float64]
    memory: NDArray[np.float64]
    seen: NDArray[np.float64]
    acts: NDArray[np.float64]


class ClosedLoop(ABC):
    """One system's plant, game and law, advanced natively from sample to sample.

    Attributes:
        monitor: the flat array of :mod:`gne_mj.loops.monitor`.
        keeps: what must live as long as the loop, as plain functions that it knows by address.
    """

    monitor: NDArray[np.float64]
    keeps: object = None

    @abstractmethod
    def advance(self, samples: int, every: int) -> Samples:
        """Record ``samples`` rows, each followed by ``every`` steps.

        Fewer rows come back if the run leaves the set; the state then stays as it was at the
        start of the step in which that was seen, and the monitor says where and when.
        """

    @abstractmethod
    def finish(self) -> Samples:
        """Observe the present state without moving on, and return it as one row.

        Its input is not a number if there is none, as outside the interior.
        """

    @property
    @abstractmethod
    def time(self) -> float:
        """Time of the present state in s."""
