"""What a live page is sent of the present instant."""

from collections.abc import Mapping, Set
from typing import Any

import numpy as np

from gne_mj.certificate import status_now
from gne_mj.simulation import Simulation
from gne_mj.system_run import SystemRun
from gne_mj.viewer.pack import encoded, pack
from gne_mj.viewer.replay import cut, mark_outside, outcome
from gne_mj.viewer.scene import Scene
from gne_mj.viewer.shares import Values
from gne_mj.viewer.shown_system import Arrays


class Frames:
    """The frames of one simulation.

    Args:
        scene: of its systems.
        simulation: what is shown.
        looked_at: names of systems whose joints frames have; may change.
    """

    def __init__(self, scene: Scene, simulation: Simulation, looked_at: Set[str]) -> None:
        self._scene, self._simulation, self._looked_at = scene, simulation, looked_at
        self._standings = {name: _Standing(run) for name, run in simulation.runs.items()}
        self._counting = [each for each in scene.shown_systems if each.counts_messages]
        self._counted = 0  # step up to which messages have been told

    def frame(
        self,
        playing: bool,
        speed: float | None,
        pace: float,
        reports: Mapping[str, dict[str, Any]] | None,
    ) -> bytes:
        """The pack of the present instant.

        Args:
            playing: whether the simulation goes on.
            speed, pace: what is asked for, and measured, in simulated s per s.
            reports: how each system's run ended; None while it goes on.
        """
        scene, runs = self._scene, self._simulation.runs
        for standing in self._standings.values():
            standing.look(None if reports is None else reports[standing.name])
        values = {name: run.present() for name, run in runs.items()}
        rows, time = scene.arrays(values), self._simulation.time
        for name, run in runs.items():
            if not run.inside:
                cut(rows, name, np.array([time > run.loop.time + 1e-9]))
                agents = self._standings[name].state["exit_agents"]
                mark_outside(rows, name, agents, np.array([True]))
        arrays = {name: row[0] for name, row in rows.items()}
        arrays["poses"] = scene.poses(values)[0]
        arrays |= self._joints(values) if self._looked_at else {}
        if self._counting:
            arrays |= self._messages()
        states = ", ".join([standing.text for standing in self._standings.values()])
        about = (
            f'{{"kind": "frame", "time": {_text(time)}, "playing": {_text(playing)},'
            f' "speed": {_text(speed)}, "pace": {_text(pace)},'
            f' "ended": {_text(reports is not None)}, "state": {{{states}}}}}'
        )
        return pack(about, arrays)

    def _joints(self, values: Mapping[str, Values]) -> Arrays:
        """Numbers of the joints that somebody looks at, by the names of arrays."""
        found = {}
        for shown_system in self._scene.shown_systems:
            name, joints = shown_system.system.name, shown_system.joints
            if joints is None or name not in self._looked_at:
                continue
            data = getattr(getattr(self._simulation.runs[name].loop, "plant", None), "data", None)
            rows = joints.recorded(values[name])[0] if data is None else joints.live(data)
            found[f"{name}/joints"] = rows.astype(np.float32)
        return found

    def _messages(self) -> Arrays:
        """What came and what was lost over links since the last frame."""
        clock, first = self._simulation.clock, self._counted
        self._counted = clock.steps(self._simulation.time)
        found: Arrays = {}
        for shown_system in self._counting:
            own = clock.steps(self._simulation.runs[shown_system.system.name].loop.time)
            found |= shown_system.messages(first, max(first, own))
        return found


class _Standing:
    """How a run stands, also as JSON's text: found anew only when its monitor has seen worse."""

    def __init__(self, run: SystemRun) -> None:
        self._run, self.name = run, run.system.name
        self._seen: object = None

    def look(self, report: dict[str, Any] | None) -> None:
        """Bring ``state`` and ``text`` up to date; a run that has ended has a report."""
        monitor = self._run.loop.monitor
        worst = monitor["worst"]
        index = int(worst.argmax())
        # with these changes all that a status is made of
        seen = report is None, monitor["exit"], monitor["started"], index, worst[index]
        if seen != self._seen:
            self._seen = seen
            self.state = (
                status_now(self._run.system, monitor) if report is None else outcome(report)
            )
            self.text = f"{encoded(self.name)}: {encoded(self.state)}"


def _text(value: float | bool | None) -> str:
    """JSON's text of what is finite."""
    if value is None:
        return "null"
    return ("false", "true")[value] if isinstance(value, bool) else repr(float(value))
