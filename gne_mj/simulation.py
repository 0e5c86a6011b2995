"""The one closed loop: measure -> law -> plant -> record, for all systems on one clock."""

import time as real_time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, Protocol

from gne_mj.bounds import MOST_RECORDED, check_room
from gne_mj.errors import GneError, InvalidInput, named, part_of
from gne_mj.interruption import interruption
from gne_mj.loops.base import Present
from gne_mj.motion import motion_of
from gne_mj.signals import check_names, declared
from gne_mj.system import Clock, System
from gne_mj.system_run import Snapshot, SystemRun
from gne_mj.trajectory import Trajectory

# Real time between looks at the user's wishes (progress, Ctrl-C), in s, and the first steps at most
_CHUNK, _FIRST = 0.1, 10_000


class Remade(Protocol):
    """How a scenario's systems come of its keys: given changes, and where each system is.

    Returns the systems that are otherwise then, the changes by whole keys as JSON has them, and
    what remakes the systems further.
    """

    def __call__(
        self, changes: Mapping[str, Any], present: Mapping[str, Present]
    ) -> "tuple[Sequence[System], dict[str, Any], Remade]":
        """See the class."""


@dataclass(frozen=True)
class Planned:
    """What is done to a simulation while it runs.

    Attributes:
        time: in s; it acts as of the step that begins there.
        act: called with the simulation.
    """

    time: float
    act: "Callable[[Simulation], None]"


class Simulation:
    """Systems side by side on one clock.

    Args:
        systems: with different names.
        clock: durations and steps.
        tolerance: on max |y - y*| for the status ``converged``.
        seed: kept with the results; systems have their own, of what is random in their faults.
        source: the scenario as JSON, kept with the results.
        remade: systems with changes of a scenario's keys, see :class:`Remade`.
        planned: what is done while it runs.

    Attributes:
        interventions: what :meth:`change`, :meth:`push` and :meth:`link` did, each with its "time"
            in s, its "system", and "what" in words; changes of a scenario's keys with these
            ("keys").

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
        remade: "Remade | None" = None,
        planned: Sequence[Planned] = (),
    ) -> None:
        names = [system.name for system in systems]
        if len(set(names)) != len(names) or not names:
            raise InvalidInput("systems", names, "there must be systems, with different names")
        check_recording(systems, clock)
        for system in systems:
            with named(system=f"systems.{system.name}"):
                check_names(system, declared(system))
        self.clock, self.tolerance = clock, tolerance
        self.seed, self.source = seed, source
        self._remade = remade
        self._lost: dict[str, set[tuple[int, int]]] = {}  # links of each system, from 0
        self.interventions: list[dict[str, Any]] = []
        self._planned = sorted(planned, key=lambda each: clock.steps(each.time))
        self._runs: dict[str, SystemRun] = {}
        for system in systems:
            with part_of(f"systems.{system.name}", "clock"):
                self._runs[system.name] = SystemRun(system, clock)

    def __repr__(self) -> str:
        return (
            f"<Simulation of {', '.join(self._runs)}: {self.time:.6g} of"
            f" {self.clock.duration:g} s{', ended' * self.ended}>"
        )

    @property
    def systems(self) -> tuple[System, ...]:
        """The systems as they are now."""
        return tuple(run.system for run in self._runs.values())

    @property
    def runs(self) -> Mapping[str, SystemRun]:
        """Each system's run, by its name."""
        return self._runs

    @property
    def time(self) -> float:
        """Simulated time in s that all systems still inside have reached."""
        return max(run.loop.time for run in self._runs.values())

    @property
    def ended(self) -> bool:
        """Whether the clock's end is reached, or every system has left its set."""
        left = not any(run.inside for run in self._runs.values())
        return left or self.clock.steps(self.time) >= self.clock.steps(self.clock.duration)

    def step(self) -> dict[str, Snapshot]:
        """Take one integration step of every system; what is returned is its beginning.

        Measurement, input and state are those at the step's start. A system that has left its set
        stays where it was, its input not a number. Steps taken here are not recorded.
        """
        self._act()
        return {name: run.step() for name, run in self._runs.items()}

    def advance(self, steps: int) -> None:
        """Take so many integration steps of every system still inside, recording on the way."""
        now = self.clock.steps(self.time)
        end = now + steps
        while now < end:
            self._act()
            due = [self.clock.steps(each.time) for each in self._planned[:1]]
            until = min([end, *due])
            for run in self._runs.values():
                run.advance(until - now)
            now = until

    def _act(self) -> None:
        """Do what is planned for now; what is refused is not tried again."""
        while self._planned and self.clock.steps(self._planned[0].time) <= self.clock.steps(
            self.time
        ):
            self._planned.pop(0).act(self)

    def change(
        self,
        changes: System | Mapping[str, Any],
        what: str = "",
        *,
        remade: Remade | None = None,
        **about: Any,
    ) -> None:
        """Go on with other numbers, as of the next step.

        >>> simulation.change({"barrier.rho": 0.02})

        Args:
            changes: dotted keys of the scenario's games, barriers and controllers to new values;
                or a system of the same name, game, law, agents and engine, whose start is not used.
            what: the change in words, kept with the results; the keys and values if left out.
            remade: of a system that a scenario's changes made: how further ones come of its keys.
            about: what else to keep of it, as JSON has it. A later one of the same time, system and
                "key" takes its place.

        A system that has left its set stays as it is.

        Raises:
            InvalidInput: a key that there is not, or a step that the new numbers do not allow.
            InfeasibleStart: the present outputs are not inside with the new numbers. Of several
                systems those before the refused one have changed, else nothing has.
        """
        if isinstance(changes, System):
            self._change(changes, what, about)
            self._remade = remade or self._remade
            return
        if self._remade is None:
            raise InvalidInput("changes", changes, "only a scenario's simulation knows its keys")
        words = what or ", ".join(f"{key} = {value!r}" for key, value in changes.items())
        present = {name: run.loop.present() for name, run in self._runs.items()}
        systems, given, remade = self._remade(changes, present)
        for system in systems:
            if self._runs[system.name].inside:
                self._change(system, words, {"keys": given, **about})
        self._remade = remade

    def _change(self, system: System, what: str, about: Mapping[str, Any]) -> None:
        lost = self._lost.get(system.name)
        if lost:
            system = replace(system, law=system.law.without_links(lost))
        if motion_of(system.game) is not None or motion_of(self._runs[system.name].system.game):
            raise InvalidInput(
                "changes", what or system.name,
                "a game that moves stays as it is while it runs: change the scenario, and run it",
            )  # fmt: skip
        with part_of("system", "clock"):
            self._runs[system.name].change(system)
        self._note(system.name, what, about)

    def push(self, system: str, channel: int, force: float, duration: float) -> None:
        """Push one of a system's outputs for a while, as of the next step.

        Args:
            system: its name.
            channel: which output, from 0.
            force: in N (N m where the output turns), besides the input and other pushes.
            duration: in s, at least one step.

        Raises:
            EngineError: the system does not run in MuJoCo, or a sensor alone tells the output.
        """
        run = self._runs[system]
        if not run.inside:
            raise InvalidInput("system", system, "it must not have left its set")
        if not run.is_there(channel):
            raise InvalidInput("channel", channel, "the agent must be there")
        run.push(channel, force, max(1, self.clock.steps(duration)))
        game = run.system.game
        agent, axis = int(game.agent_of_action[channel]) + 1, game.axis_of_action[channel]
        along = f" along {axis}" if max(game.sizes) > 1 else ""
        about: dict[str, Any] = {
            "agent": agent,
            "channel": channel + 1,
            "force": force,
            "duration": duration,
        }
        about |= {"axis": axis} if along else {}
        unit = run.loop.push_unit(channel)
        what = f"{game.agent_name} {agent} pushed{along} by {force:g} {unit} for {duration:g} s"
        self._note(system, what, about)

    def link(self, system: str, agents: tuple[int, int], *, lost: bool = True) -> None:
        """Lose the link between two agents, or have it again, as of the next step.

        In the held modes estimates move over the period that has begun by the new links. The
        Lyapunov function knows no graph; what is proven of it asks for one that is connected.

        Args:
            system: its name.
            agents: the two, from 0.
            lost: whether it is lost now.

        Raises:
            InvalidInput: there is no such link, or this law's links stay.
        """
        run = self._runs[system]
        if not run.inside:
            raise InvalidInput("system", system, "it must not have left its set")
        edge, before = check_link(run.system, agents), self._lost.get(system, set())
        after = before | {edge} if lost else before - {edge}
        law = run.system.law.without_links(after)
        first, second = edge[0] + 1, edge[1] + 1
        state = "lost" if lost else "there again"
        what = f"link between {run.system.game.agent_name}s {first} and {second} {state}"
        self._lost[system] = after
        try:
            system_then = replace(run.system, law=law)
            self._change(system_then, what, {"link": [first, second], "lost": lost})
        except GneError:
            self._lost[system] = before
            raise

    def _note(self, system: str, what: str, about: Mapping[str, Any]) -> None:
        note = {"time": self.time, "system": system, "what": what, **about}
        same = ("time", "system", "key")
        last = self.interventions[-1] if self.interventions else {}
        if "key" in note and [note[k] for k in same] == [last.get(k) for k in same]:
            self.interventions.pop()  # a slider on its way
        self.interventions.append(note)

    def doubts(self) -> dict[str, list[str]]:
        """Before a run: what will go wrong with users' robots, a sentence each, by system.

        Steps that are too long, outputs that do not rise with their inputs, limits below what
        staying at the start takes (:mod:`gne_mj.examination.in_short`).
        """
        return {name: run.doubts() for name, run in self._runs.items()}

    def run(self, progress: Callable[[float], None] | None = None) -> Trajectory:
        """Run to the clock's end, recording; Ctrl-C ends it early and keeps what was done.

        Args:
            progress: called now and then with the simulated time in s.
        """
        every = self.clock.steps(self.clock.sample_period)
        total = self.clock.steps(self.clock.duration)
        unit = min(every, _FIRST)  # samples may be far apart
        size = 1
        with interruption() as interrupted:
            while not self.ended and not interrupted.is_set():
                steps = min(size * unit, total - self.clock.steps(self.time))
                started = real_time.perf_counter()
                self.advance(steps)
                elapsed = real_time.perf_counter() - started
                size = max(1, min(10 * size, int(size * _CHUNK / max(elapsed, 1e-6))))
                if progress is not None:
                    progress(self.time)
            return self.trajectory(interrupted=interrupted.is_set() and not self.ended)

    def trajectory(self, *, interrupted: bool = False) -> Trajectory:
        """What was recorded until now, with the present state as the last sample.

        Args:
            interrupted: the user stopped the run.
        """
        touched = {done["system"] for done in self.interventions}
        parts = {}
        for name, run in self._runs.items():
            with part_of(f"systems.{name}"):
                parts[name] = run.part(self.tolerance, interrupted, name in touched)
        return Trajectory.from_parts(
            parts,
            seed=self.seed,
            source=self.source,
            wall_time=sum(run.wall_time for run in self._runs.values()),
            interventions=self.interventions,
        )


def check_link(system: System, agents: tuple[int, int]) -> tuple[int, int]:
    """The edge of a system's graph between two agents, from 0.

    Raises:
        InvalidInput: there is none, or the law's links cannot be lost; names ``agents``.
    """
    edge, graph = (min(agents), max(agents)), system.law.graph
    if graph is not None and edge not in graph.whole.edges:
        pair = [agents[0] + 1, agents[1] + 1]
        raise InvalidInput("agents", pair, "there is no link between them")
    with named(lost="agents"):
        system.law.without_links([edge])
    return edge


def check_recording(systems: Sequence[System], clock: Clock) -> None:
    """Refuse a run whose samples would fill the memory."""
    rows = clock.steps(clock.duration) // clock.steps(clock.sample_period) + 2
    numbers = sum(system.recorded for system in systems)
    what = f"{rows} samples of {numbers} numbers"
    check_room("clock.sample_period", clock.sample_period, rows * numbers, what, MOST_RECORDED)
