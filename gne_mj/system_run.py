"""The run of one system: its loop, advanced from sample to sample, and what it recorded."""

import time as real_time
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gne_mj.certificate import Certificate, certify_run
from gne_mj.changing_graph import ChangingGraph
from gne_mj.errors import InvalidInput
from gne_mj.loops import monitor as watch
from gne_mj.loops.base import Samples
from gne_mj.plain import raise_pending
from gne_mj.plants.agent_type import has_ode
from gne_mj.run_metrics import check_numbers
from gne_mj.signals import declared
from gne_mj.system import Clock, System
from gne_mj.trajectory import SystemRecord, joined, variables_of_parts
from gne_mj.variables import Rows, Variable, changed


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


class SystemRun:
    """One system's loop and what it recorded.

    Attributes:
        system: with the numbers of now.
        loop: its closed loop.
        wall_time: real time in s that its steps took.
    """

    def __init__(self, system: System, clock: Clock) -> None:
        self.system, self.clock = system, clock
        self._shown = _shown(system)
        self.loop = system.closed_loop(clock)
        self.wall_time = 0.0
        self._due: int | None = None  # the step at which the next row is recorded; None: at once
        self._pushes: list[tuple[int, float, int]] = []  # output, force, until which step
        self._recorded: list[SystemRecord] = []
        self._unknown = np.full((1, system.game.actions), np.nan)

    def is_there(self, channel: int) -> bool:
        """Whether an output's agent is there: some leave and join."""
        return bool(np.isfinite(self.loop.present().state[channel, self.system.agents.kind.OUTPUT]))

    @property
    def inside(self) -> bool:
        """Whether the run has not left its set."""
        return bool(self.loop.monitor["exit"] == watch.INSIDE)  # by item: pages ask at every frame

    def doubts(self) -> list[str]:
        """See :meth:`gne_mj.simulation.Simulation.doubts`."""
        plant = getattr(self.loop, "plant", None)
        if has_ode(self.system.agents.kind) or plant is None:
            return []
        from gne_mj.examination.in_short import doubts  # late: they know MuJoCo
        from gne_mj.plants.mjcf_file import remarks

        steps = self.clock.steps(self.clock.control_period)
        paths = dict.fromkeys(robot.path for robot in plant.agents.files)
        said = [words for path in paths for words in remarks(path, self.clock.timestep)]
        return said + doubts(plant, self.system.agents.input_limit, steps)

    def step(self) -> Snapshot:
        """One integration step; what is returned is its beginning."""
        time = self.loop.time
        samples = self.loop.advance(1, 1) if self.inside else self.loop.finish()
        raise_pending()
        if len(samples.input) == 0:  # it left the set in this very step
            samples = self.loop.finish()
        state = samples.state[0]
        y = state[:, self.system.agents.kind.OUTPUT].copy()
        constraint = self.system.game_at(time).constraints(y)
        return Snapshot(time, y, samples.input[0], constraint, state, samples.memory[0])

    def advance(self, steps: int) -> None:
        """So many steps, if it is still inside, recorded once in a sample period."""
        started = real_time.perf_counter()
        now = self.clock.steps(self.loop.time)
        end = now + steps
        while now < end and self.inside:
            if any(until <= now for *_, until in self._pushes):
                self._pushes = [push for push in self._pushes if push[2] > now]
                self.loop.push(self._pushed(self._pushes))
            now = self._piece(now, min([end, *(until for *_, until in self._pushes)]))
        self.wall_time += real_time.perf_counter() - started

    def _piece(self, now: int, end: int) -> int:
        """On towards a step as far as one call of the loop goes; returns the step reached."""
        every = self.clock.steps(self.clock.sample_period)
        if self._due is None or self._due < now:
            self._due = now
            self._forget_last()
        if now < self._due:
            end = min(end, self._due)
            self.loop.advance(1, end - now)
            raise_pending()
            return end
        # Whole sample periods; the last one may be shorter.
        samples = (end - now) // every
        stride = every if samples else end - now
        samples = max(samples, 1)
        rows = self.loop.advance(samples, stride)
        raise_pending()
        steps = now + stride * np.arange(len(rows.input), dtype=np.float64)
        self._recorded.append(SystemRecord(self.system, steps * self.clock.timestep, rows))
        self._due = now + samples * every
        return now + samples * stride

    def recorded(self, most: int) -> tuple[NDArray[np.float64], dict[str, NDArray[Any]]]:
        """Sample times so far in s, and what a trajectory has of them, by the variables' names.

        Args:
            most: samples; of more only every so many-th is there.
        """
        self._recorded = joined(self._recorded)  # so that the next time is quick
        every = 1 + sum(len(part.time) for part in self._recorded) // (most + 1)
        parts = [part.thinned(every) for part in self._recorded]
        if not parts:
            return np.zeros(0), {}
        return np.concatenate([part.time for part in parts]), {
            name: values
            for name, (dimensions, values, _) in variables_of_parts(parts).items()
            if dimensions[:1] == ("time",)
        }

    def present(self) -> dict[str, NDArray[Any]]:
        """What a page shows of this instant, one row each, by the variables' names.

        Inputs, and what else an instant's state does not say, are those of the last sample; before
        the first one they are left out.
        """
        state, memory, configuration = self.loop.present()
        none = self._unknown
        samples = Samples(state[None], none, memory[None], none, none, configuration[None])
        instant = Rows(self.system, np.array([self.loop.time]), samples)
        found = {}
        for variable in self._shown:
            rows = instant if variable.instant else self._last
            if variable.name == "lyapunov":  # which the monitor knows of the last step's start
                monitor = self.loop.monitor  # by item, as in run_metrics.worst_constraints
                known = monitor["started"] and self.system.known_equilibrium is not None
                found[variable.name] = np.array([monitor["storage"] if known else np.nan])
            elif rows is not None:
                found[variable.name] = variable.source(rows)
        return found

    @property
    def _last(self) -> Rows | None:
        """The last sample."""
        part = next((part for part in reversed(self._recorded) if len(part.time)), None)
        if part is None:
            return None
        return Rows(part.system, part.time[-1:], changed(part.samples, lambda rows: rows[-1:]))

    def change(self, system: System) -> None:
        """See :meth:`Simulation.change`."""
        graphs = [each.law.graph for each in (self.system, system)]
        if any(isinstance(graph, ChangingGraph) for graph in graphs) and graphs[0] is not graphs[1]:
            tables = [getattr(graph, "table", None) for graph in graphs]
            if tables[0] != tables[1]:
                raise InvalidInput(
                    "law.graph",
                    "another one",
                    "one that changes stays what it is while a run goes on",
                )
        if system.membership is not None:
            raise InvalidInput(
                "membership", "given", "where agents leave and join numbers stay as they are"
            )
        if system.between != self.system.between:
            raise InvalidInput(
                "between", system.between, "it stays as it is while a simulation goes on"
            )
        self.loop.adopt(system.setup(self.clock))
        self.loop.kept_alive = system
        self.system = system
        self._shown = _shown(system)

    def push(self, channel: int, force: float, steps: int) -> None:
        """See :meth:`Simulation.push`."""
        until = self.clock.steps(self.loop.time) + steps
        pushes = [*self._pushes, (channel, force, until)]
        self.loop.push(self._pushed(pushes))  # first, since it may refuse
        self._pushes = pushes

    def _pushed(self, pushes: Sequence[tuple[int, float, int]]) -> NDArray[np.float64]:
        """(m,) forces of all of them together."""
        forces = np.zeros(self.system.game.actions)
        for channel, force, _ in pushes:
            forces[channel] += force
        return forces

    def part(
        self, tolerance: float, interrupted: bool, intervened: bool
    ) -> tuple[list[SystemRecord], Certificate]:
        """What was recorded, the present state being the last row, and what it shows."""
        self._forget_last()
        last = SystemRecord(self.system, np.array([self.loop.time]), self.loop.finish())
        raise_pending()
        self._recorded.append(last)
        self._due = None
        parts = joined(self._recorded)
        time, samples = parts[-1].time, parts[-1].samples
        y = samples.state[-1, :, self.system.agents.kind.OUTPUT]
        check_numbers(self.system.game, self.loop.monitor, y, self.clock.timestep)
        if len(parts) > 1:
            time = np.concatenate([part.time for part in parts])
            samples = Samples.join([part.samples for part in parts])
        certificate = certify_run(
            self.system,
            time,
            samples.state[:, :, self.system.agents.kind.OUTPUT],
            samples.input,
            self.loop.monitor,
            tolerance=tolerance,
            duration=self.clock.duration,
            wall_time=self.wall_time,
            interrupted=interrupted,
            intervened=intervened,
            network=self.loop.network,
            membership=self.loop.membership,
            clock=self.clock,
        )
        if certificate.status == "completed":
            from gne_mj import not_reached  # which loads MuJoCo

            why = not_reached.report(
                self.system, time, samples.state[:, :, self.system.agents.kind.OUTPUT],
                samples.input, duration=self.clock.duration, tolerance=tolerance,
                plant=getattr(self.loop, "plant", None),
            )  # fmt: skip
            certificate = replace(certificate, not_reached=why)
        return parts, certificate

    def _forget_last(self) -> None:
        """Drop the last row if it is of the present time, as when a run goes on after its end."""
        if not self._recorded:
            return
        last = self._recorded[-1]
        if len(last.time) and last.time[-1] >= self.loop.time:
            self._recorded[-1] = SystemRecord(last.system, last.time[:-1], last.samples.first(-1))


def _shown(system: System) -> list[Variable]:
    """What a page has of a system, by its present numbers."""
    return [variable for variable in declared(system) if variable.page]
