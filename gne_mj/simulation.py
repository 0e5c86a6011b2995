"""The one closed loop: measure -> law -> plant -> record, for all systems on one clock."""

import signal
import threading
import time as real_time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field, fields

import numpy as np
from numpy.typing import NDArray

from gne_mj.certificate import certify_run
from gne_mj.errors import InvalidInput
from gne_mj.loops import monitor as watch
from gne_mj.loops.base import Samples
from gne_mj.plain import raise_pending
from gne_mj.system import Clock, System
from gne_mj.trajectory import Trajectory

# Real time between looks at the user's wishes (progress, Ctrl-C), in s
_CHUNK = 0.1


@dataclass(frozen=True)
class Snapshot:
    """One system at one instant.

    Attributes:
        time: in s.
        measurement: outputs y, shape (m,).
        input: delivered inputs, shape (m,); not a number once the run has left the set.
        constraint: g(y), shape (p,), negative inside.
        state: (m, states), in the order of the agents' ``kind.STATES``.
        memory: the law's memory.
    """

    time: float
    measurement: NDArray[np.float64]
    input: NDArray[np.float64]
    constraint: NDArray[np.float64]
    state: NDArray[np.float64]
    memory: NDArray[np.float64]


class Simulation:
    """Systems side by side on one clock.

    Args:
        systems: with different names.
        clock: durations and steps.
        tolerance: on max |y - y*| for the status ``converged``.
        seed: kept with the results; systems have their own, of what is random in their faults.
        source: the scenario as JSON, kept with the results.

    >>> simulation = Simulation([system], clock)
    >>> snapshot = simulation.step()["robots"]    # one integration step
    >>> trajectory = simulation.run()             # on to the end
    """

    def __init__(
        self,
        systems: Sequence[System],
        clock: Clock,
        *,
        tolerance: float = 1e-3,
        seed: int = 0,
        source: str = "",
    ) -> None:
        names = [system.name for system in systems]
        if len(set(names)) != len(names) or not names:
            raise InvalidInput("systems", names, "there must be systems, with different names")
        self.systems, self.clock, self.tolerance = tuple(systems), clock, tolerance
        self.seed, self.source = seed, source
        self._runs = [_Run(system, clock) for system in systems]

    @property
    def time(self) -> float:
        """Simulated time in s that all systems still inside have reached."""
        return max(run.loop.time for run in self._runs)

    def step(self) -> dict[str, Snapshot]:
        """Take one integration step of every system; what is returned is its beginning.

        Measurement, input and state are those at the step's start. A system that has left its set
        stays where it was, its input not a number. Steps taken here are not recorded.
        """
        return {run.system.name: run.step() for run in self._runs}

    def run(self, progress: Callable[[float], None] | None = None) -> Trajectory:
        """Run to the clock's end, recording; Ctrl-C ends it early and keeps what was done.

        Args:
            progress: called now and then with the simulated time in s.
        """
        started = real_time.perf_counter()
        every = self.clock.steps(self.clock.sample_period)
        total = self.clock.steps(self.clock.duration)
        done = self.clock.steps(self.time)
        size = 1
        with interruption() as interrupted:
            while done < total and not interrupted.is_set() and any(r.inside for r in self._runs):
                # Whole sample periods; the last one may be shorter.
                samples = min(size, (total - done) // every)
                stride = every if samples else total - done
                samples = max(samples, 1)
                chunk_started = real_time.perf_counter()
                for run in self._runs:
                    run.advance(samples, stride)
                done += samples * stride
                elapsed = real_time.perf_counter() - chunk_started
                size = max(1, min(10 * size, int(size * _CHUNK / max(elapsed, 1e-6))))
                if progress is not None:
                    progress(done * self.clock.timestep)
            return self._trajectory(interrupted.is_set() and done < total, started)

    def _trajectory(self, interrupted: bool, started: float) -> Trajectory:
        parts = {}
        for run in self._runs:
            run.finish()
            time, samples = run.recorded()
            certificate = certify_run(
                run.system,
                time,
                samples.state[:, :, run.system.agents.kind.OUTPUT],
                samples.input,
                run.loop.monitor,
                tolerance=self.tolerance,
                duration=self.clock.duration,
                wall_time=run.wall_time,
                interrupted=interrupted,
            )
            parts[run.system.name] = (run.system, time, samples, certificate)
        return Trajectory.from_parts(
            parts,
            seed=self.seed,
            source=self.source,
            wall_time=real_time.perf_counter() - started,
        )


@dataclass
class _Run:
    """One system's loop and what it recorded."""

    system: System
    clock: Clock
    wall_time: float = 0.0
    _times: list[NDArray[np.float64]] = field(default_factory=list)
    _samples: list[Samples] = field(default_factory=list)

    def __post_init__(self) -> None:
        self.loop = self.system.closed_loop(self.clock)

    @property
    def inside(self) -> bool:
        return bool(self.loop.monitor[watch.EXIT] == watch.INSIDE)

    def step(self) -> Snapshot:
        time = self.loop.time
        samples = self.loop.advance(1, 1) if self.inside else self.loop.finish()
        raise_pending()
        if len(samples.input) == 0:  # it left the set in this very step
            samples = self.loop.finish()
        state = samples.state[0]
        y = state[:, self.system.agents.kind.OUTPUT].copy()
        constraint = self.system.game.constraints(y)
        return Snapshot(time, y, samples.input[0], constraint, state, samples.memory[0])

    def advance(self, samples: int, every: int) -> None:
        if not self.inside:
            return
        self._forget_last()
        started = real_time.perf_counter()
        first = self.clock.steps(self.loop.time)
        recorded = self.loop.advance(samples, every)
        raise_pending()
        self.wall_time += real_time.perf_counter() - started
        steps = first + every * np.arange(len(recorded.input), dtype=np.float64)
        self._times.append(steps * self.clock.timestep)
        self._samples.append(recorded)

    def finish(self) -> None:
        """Add the present state as the last row."""
        self._forget_last()
        self._times.append(np.array([self.loop.time]))
        self._samples.append(self.loop.finish())
        raise_pending()

    def _forget_last(self) -> None:
        """Drop the last row if it is of the present time, as when a run goes on after its end."""
        if self._times and len(self._times[-1]) and self._times[-1][-1] >= self.loop.time:
            self._times[-1] = self._times[-1][:-1]
            last = self._samples[-1]
            self._samples[-1] = Samples(*(getattr(last, each.name)[:-1] for each in fields(last)))

    def recorded(self) -> tuple[NDArray[np.float64], Samples]:
        parts = (
            np.concatenate([getattr(part, each.name) for part in self._samples])
            for each in fields(Samples)
        )
        return np.concatenate(self._times), Samples(*parts)


@contextmanager
def interruption() -> Iterator[threading.Event]:
    """An event that Ctrl-C sets, so that a run ends between chunks and keeps what it has.

    A second Ctrl-C acts as usual. Outside the main thread signals are left alone.
    """
    event = threading.Event()
    if threading.current_thread() is not threading.main_thread():
        yield event
        return
    before = signal.getsignal(signal.SIGINT)

    def stop(number: int, frame: object) -> None:
        event.set()
        signal.signal(signal.SIGINT, before)

    signal.signal(signal.SIGINT, stop)
    try:
        yield event
    finally:
        signal.signal(signal.SIGINT, before)
