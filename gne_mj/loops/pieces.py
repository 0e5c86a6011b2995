"""Closed loops that are another one's, or others', run in pieces between changes."""

from abc import abstractmethod

from gne_mj.loops import monitor as watch
from gne_mj.loops.base import ClosedLoop, Samples


class LoopInPieces(ClosedLoop):
    """A closed loop in which something changes between two integration steps."""

    @abstractmethod
    def _look(self) -> int:
        """Make the changes of now; for how many steps there will be none."""

    @abstractmethod
    def _go(self, samples: int, every: int) -> Samples:
        """Advance without a change."""

    @property
    def _inside(self) -> bool:
        return bool(self.monitor.exit == watch.INSIDE)

    def advance(self, samples: int, every: int) -> Samples:
        """See the base class."""
        rows: list[Samples] = []
        while samples > 0 and self._inside:
            ahead = self._look()
            whole = min(ahead // every, samples)
            if whole > 0:
                rows.append(self._go(whole, every))
                samples -= whole
                continue
            rows.append(self._go(1, ahead))  # there is a change before the next sample
            samples, left = samples - 1, every - ahead
            while left > 0 and self._inside:
                steps = min(self._look(), left)
                self._go(1, steps)
                left -= steps
        return Samples.join(rows) if rows else self._go(0, every)
