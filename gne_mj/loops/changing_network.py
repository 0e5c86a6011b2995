"""A closed loop whose agents communicate over a graph that changes."""

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gne_mj.changing_graph import ChangingGraph
from gne_mj.controllers.propagation import Propagator
from gne_mj.graph import GraphData, connected
from gne_mj.loops.base import ClosedLoop, Present, Samples
from gne_mj.loops.layout import Setup
from gne_mj.loops.pieces import LoopInPieces

KEPT = 256  # graphs whose numbers are kept for when they come again


class ChangingNetworkLoop(LoopInPieces):
    """Another loop, which is given the graph's numbers whenever the graph becomes another one.

    The storage function does not know the graph, so that it goes on across a change. In the held
    modes estimates move over a period by the graph of its end.

    Args:
        loop: at its start.
        setup: that it was made of.
        graph: which changes.
        places: the agents' places (N, d) in m in a state (m, states), if they have any.
        propagator: for who hears whom, what the law's memory moves by; None in mode continuous,
            where nothing of the kind is needed.
        seed: of the run.

    Attributes:
        changes: how often the graph has become another one.
        disconnected: at how many steps it was not connected.
    """

    def __init__(
        self,
        loop: ClosedLoop,
        setup: Setup,
        graph: ChangingGraph,
        places: Callable[[NDArray[np.float64]], NDArray[np.float64] | None],
        propagator: Callable[[GraphData], Propagator] | None,
        seed: int,
    ) -> None:
        self._loop, self._setup, self._graph = loop, setup, graph
        self._places, self._propagator, self._seed = places, propagator, seed
        self._known: dict[bytes, Setup] = {}
        self._lists: GraphData | None = None
        self._connected = True
        self._next = 0  # the step at which the graph can become another one
        self.changes, self.disconnected = 0, 0

    @property
    def monitor(self) -> Any:
        """Of the loop."""
        return self._loop.monitor

    @property
    def time(self) -> float:
        """Time of the present state in s."""
        return self._loop.time

    @property
    def network(self) -> dict[str, Any]:  # type: ignore[override]
        """See the base class."""
        time = self.disconnected * self._setup.clock.h
        return {"changes": self.changes, "disconnected": time}

    @property
    def _step(self) -> int:
        return round(self.time / self._setup.clock.h)

    def finish(self) -> Samples:
        """See the base class."""
        if self._inside:
            self._look()
        return self._loop.finish()

    def present(self) -> Present:
        """See the base class."""
        return self._loop.present()

    def push(self, force: NDArray[np.float64]) -> None:
        """See the base class."""
        self._loop.push(force)

    def push_unit(self, channel: int) -> str:
        """See the base class."""
        return self._loop.push_unit(channel)

    def start_at(self, step: int) -> None:
        """See the base class."""
        self._loop.start_at(step)

    def _adopt(self, setup: Setup) -> None:
        self._setup = setup
        self._known.clear()
        if self._lists is not None:
            self._loop.adopt(self._over(self._lists))

    def _go(self, samples: int, every: int) -> Samples:
        first = self._step
        found = self._loop.advance(samples, every)
        if not self._connected:
            self.disconnected += self._step - first
        return found

    def _look(self) -> int:
        """Take the graph of now; for how many steps it stays."""
        step, h = self._step, self._setup.clock.h
        if step >= self._next:
            places = self._places(self._loop.present().state)
            lists = self._graph.lists_at(step * h, places, self._seed)
            self._next = max(step + 1, round(self._graph.next_look(step * h) / h))
            self._take(lists)
        return self._next - step

    def _take(self, lists: GraphData) -> None:
        if self._lists is not None:
            if all(map(np.array_equal, lists, self._lists)):
                return
            self.changes += 1
        storage = self.monitor.storage
        self._lists, self._connected = lists, connected(lists)
        self._loop.adopt(self._over(lists))
        self.monitor.storage = storage

    def _over(self, lists: GraphData) -> Setup:
        """What the loop is made of, over a graph."""
        key = b"".join(array.tobytes() for array in lists)
        if key not in self._known:
            if len(self._known) >= KEPT:
                self._known.clear()
            problem = self._setup.problem._replace(graph=lists)
            if self._propagator is not None:
                problem = problem._replace(propagator=self._propagator(lists))
            self._known[key] = self._setup._replace(problem=problem)
        return self._known[key]
