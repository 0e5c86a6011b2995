"""Simulated time and the clock on the wall."""

import math
import time as real_time

MEASURED_OVER = 1.0  # s


class Pacer:
    """Says how many integration steps are due, and how fast they have gone.

    Args:
        speed: simulated s per s; None for as fast as possible.
    """

    def __init__(self, speed: float | None) -> None:
        self.speed = speed
        self._cost: float | None = None  # s of computing for a step, smoothed
        self.restart(0.0)

    def restart(self, time: float) -> None:
        """Simulated time (s) goes with the wall's clock from here."""
        self._since = real_time.perf_counter(), time
        self._seen: list[tuple[float, float]] = []

    def due(self, time: float, timestep: float) -> int:
        """Steps that the wall's clock is ahead of simulated time; with a speed."""
        assert self.speed is not None
        wall, start = self._since
        ahead = start + (real_time.perf_counter() - wall) * self.speed - time
        return max(0, math.floor(ahead / timestep + 1e-9))

    def affordable(self, seconds: float) -> int:
        """Steps that computing for so long takes; a few as long as that is not known."""
        if self._cost is None:
            return 10
        return max(1, int(seconds / max(self._cost, 1e-9)))

    def took(self, steps: int, seconds: float) -> None:
        """Note what steps have cost."""
        cost = seconds / steps
        self._cost = cost if self._cost is None else 0.7 * self._cost + 0.3 * cost

    def saw(self, time: float) -> None:
        """Note simulated time (s) at a look."""
        now = real_time.perf_counter()
        self._seen.append((now, time))
        while len(self._seen) > 2 and self._seen[1][0] <= now - MEASURED_OVER:
            self._seen.pop(0)

    @property
    def measured(self) -> float:
        """Simulated s per s over the last looks; 0 if that is not known."""
        if not self._seen:
            return 0.0
        (wall, time), (wall_now, time_now) = self._seen[0], self._seen[-1]
        return (time_now - time) / (wall_now - wall) if wall_now > wall else 0.0
