"""What a law is, seen from Python: its kernels, its numbers, and its memory at the start."""

from abc import ABC, abstractmethod
from types import ModuleType
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from gne_mj.controllers import settings
from gne_mj.graph import Graph, GraphData

_NOBODY = GraphData(np.zeros(1, dtype=np.int64), np.zeros(0, dtype=np.int64))


class Law(ABC):
    """A feedback law of one information structure.

    The mathematics is the kernels of its module: ``action`` (inputs from measurements and memory),
    ``rate`` (of the memory, mode continuous) and ``propagate`` (the memory over a control period,
    mode sampled).

    Attributes:
        information: name of the information structure.
        graph: over which agents communicate; None if they need not.
    """

    information: ClassVar[str]
    graph: Graph | None = None

    @property
    @abstractmethod
    def kernels(self) -> ModuleType:
        """The module of kernels."""

    @property
    def graph_data(self) -> GraphData:
        """The graph for native code; nobody hears anybody without one."""
        return self.graph.data if self.graph is not None else _NOBODY

    def settings(self, rho: float) -> NDArray[np.float64]:
        """The law's numbers for native code (see :mod:`gne_mj.controllers.settings`)."""
        numbers = np.ones(settings.COUNT)
        numbers[settings.RHO] = rho
        return numbers

    def initial_memory(self, y: NDArray[np.float64]) -> NDArray[np.float64]:
        """The memory at the start, everybody knowing the initial profile y (m,)."""
        return np.zeros(0)

    def propagators(self, period: float) -> NDArray[np.float64]:
        """What ``propagate`` needs for a control period in s."""
        return np.zeros((0, 0, 0))
