"""A simulation that people watch and act on: paced by the clock on the wall, driven by a page."""

import queue
import threading
import time as real_time
from collections.abc import Mapping
from typing import Any, Literal

import numpy as np
from meshcat import Visualizer

from gne_mj.errors import GneError, InfeasibleStart, InvalidInput
from gne_mj.scenario import Scenario, as_done
from gne_mj.simulation import Simulation
from gne_mj.system import mode_of
from gne_mj.trajectory import Trajectory
from gne_mj.viewer.controls import pushes_of
from gne_mj.viewer.frames import Frames
from gne_mj.viewer.pacer import Pacer
from gne_mj.viewer.pack import pack
from gne_mj.viewer.replay import cut, scene_pack
from gne_mj.viewer.scene import Scene
from gne_mj.viewer.server import Browser, Server
from gne_mj.viewer.shown_system import ShownSystem
from gne_mj.viewer.sliders import Sliders, finite, in_words

FRAME = 1 / 60  # s between frames, at best
SHARE = 0.015  # of the time at most goes into frames while a run is as fast as it can
SLOWEST = 0.5  # s between frames, at worst
HISTORY = 1.0  # s between histories, while frames are far apart
ENTRIES, LEAST_ROWS = 100_000, 200  # actions in a history, but at least so many samples of them
PIECE = 0.05  # s of computing between looks at what the page asks for
Begin = Literal["now", "viewer", "paused"]  # when the first run goes on
LONGEST_PUSH = 100.0  # s
FASTEST = 1000.0  # times real time; beyond, ask for as fast as possible


class Session:
    """One scenario on a page of its own, run as often as its viewers like.

    All happens in the thread that calls :meth:`run`; messages of browsers wait until it looks.

    Args:
        scenario: what is run.
        title: of the page.
        speed: simulated s per s; None for as fast as possible.
        port: of the page's server; 0 for any that is free.
        begin: when the first run goes on: "now", when the first "viewer" sees its start, or when
            one says so ("paused").

    Attributes:
        simulation: the present run.
        server: of the page.
    """

    def __init__(
        self,
        scenario: Scenario,
        title: str,
        *,
        speed: float | None = 1.0,
        port: int = 0,
        begin: Begin = "now",
    ) -> None:
        self._sliders = Sliders(scenario)
        self._pacer = Pacer(speed)
        self._ended: Trajectory | None = None
        self._next: Scenario | None = None  # that viewers have asked for
        self._missed = 0
        self._looked_at: set[str] = set()  # systems whose joints somebody looks at
        self._asked: queue.Queue[tuple[dict[str, Any], Browser]] = queue.Queue()
        simulation = scenario.simulation_object()
        clock, systems = simulation.clock, simulation.systems
        shown_systems = [ShownSystem(system, clock) for system in systems]
        self._scene = Scene(shown_systems, title, clock.duration)
        self._begin(scenario, simulation)
        self._waits, self._playing = begin == "viewer", begin == "now"
        self._pushes = pushes_of(shown_systems)
        self.server = Server(title, port=port, received=self._receive)
        self._scene.draw(self.visualizer)

    @property
    def visualizer(self) -> Visualizer:
        """A ``meshcat.Visualizer`` of the page, to draw something of one's own besides.

        It can set and delete objects, transforms and properties; what asks a browser for an answer
        (images, waiting for it) is not there.
        """
        return Visualizer(window=self.server)

    def _receive(self, message: dict[str, Any], browser: Browser) -> None:
        self._asked.put((message, browser))  # in the server's thread

    def run(self, stop: threading.Event) -> Trajectory:
        """Until the run has ended, viewers start another one or ``stop`` is set.

        Returns:
            What it recorded. The page shows the run's end when it is told to (:meth:`show`), so
            that a caller can keep the trajectory before anything else.
        """
        if self._next is not None:
            self._begin(self._next, self._next.simulation_object())
            self.server.broadcast(self._history())
            self._tell_controls()
            self._tell_interventions()
        while not stop.is_set() and not self.simulation.ended and self._next is None:
            self._turn()
        return self.simulation.trajectory(interrupted=not self.simulation.ended)

    def show(self, trajectory: Trajectory) -> None:
        """Let viewers replay the run that has ended."""
        if self._next is not None:
            return
        try:
            self.server.replay = scene_pack(self._scene, trajectory)
        except GneError as error:
            self._notice(str(error))
            return
        self._ended = trajectory
        self.server.broadcast(self._frame())  # no browser may miss it

    def linger(self, stop: threading.Event) -> None:
        """Show the run that has ended, and further ones if viewers restart, until ``stop``."""
        while not stop.is_set():
            if self.simulation.ended and self._next is None:
                self._look(0.1)
            else:
                self.show(self.run(stop))

    def _begin(self, scenario: Scenario, simulation: Simulation) -> None:
        """A new run, at the scenario's start."""
        self.simulation = simulation
        self._frames = Frames(self._scene, simulation, self._looked_at)
        self._sliders.begin(scenario)
        self._next = self._ended = None
        self._playing, self._waits = True, False
        self._pacer.restart(simulation.time)
        self._next_frame = self._frame_time = self._history_due = 0.0

    def _turn(self) -> None:
        """Answer the page, move on for a moment, show it."""
        now = real_time.perf_counter()
        if self._playing and self._pacer.speed is None:
            self._look(0.0)
            until_frame = max(self._next_frame - now, 1e-3)
            self._move(self._pacer.affordable(min(PIECE, until_frame)))
        else:
            self._look(max(0.0, self._next_frame - now))
            if self._playing:
                self._catch_up()
        if real_time.perf_counter() >= self._next_frame:
            self._publish()

    def _catch_up(self) -> None:
        """On to where the wall's clock says, unless that takes too long."""
        simulation, pacer = self.simulation, self._pacer
        if pacer.speed is None:  # it was changed just now
            return
        steps = pacer.due(simulation.time, simulation.clock.timestep)
        most = pacer.affordable(PIECE)
        self._move(min(steps, most))
        if steps > most:  # it cannot keep up, and never tries to make up for it
            pacer.restart(simulation.time)

    def _move(self, steps: int) -> None:
        simulation = self.simulation
        left = simulation.clock.steps(simulation.clock.duration - simulation.time)
        steps = min(steps, left)
        if steps > 0:
            started, done = real_time.perf_counter(), len(simulation.interventions)
            simulation.advance(steps)
            self._pacer.took(steps, real_time.perf_counter() - started)
            if len(simulation.interventions) > done:
                self._sliders.follow(simulation.interventions[done:])
                self._tell_controls()
                self._tell_interventions()

    def _look(self, wait: float) -> None:
        """Do what browsers ask for, waiting so long (s) for the first of them."""
        asked: list[tuple[dict[str, Any], Browser]] = []
        try:
            if wait > 0:
                asked.append(self._asked.get(timeout=wait))
            while True:
                asked.append(self._asked.get_nowait())
        except queue.Empty:
            pass
        # of a slider that is dragged only where it is now counts
        last = {str(m.get("key")): n for n, (m, _) in enumerate(asked) if m.get("do") == "set"}
        for number, (message, browser) in enumerate(asked):
            if message.get("do") == "set" and last[str(message.get("key"))] != number:
                continue
            try:
                self._do(message, browser)
            except GneError as error:
                self._refuse(error, message, browser)
            except Exception as error:  # no message may end a run
                self._notice(f"This failed: {type(error).__name__}: {error}", browser)
        if asked:
            self._next_frame = 0.0  # show at once what it did

    def _refuse(self, error: GneError, message: Mapping[str, Any], browser: Browser) -> None:
        """Say why something is not done, in the page's words; the same again takes its place."""
        do, key = message.get("do"), str(message.get("key", ""))
        if do in ("push", "link"):
            what = {"push": "this push", "link": "this link"}[str(do)]
            text = f"{message.get('system')}, {what}: {in_words(error)}"
            self._notice(text, browser, about=f"{do} {message.get('system')}")
        else:
            self._notice(self._sliders.refused(error, key), browser, about=key)

    def _do(self, message: Mapping[str, Any], browser: Browser) -> None:
        match message.get("do"):
            case "connect":
                self._welcome(browser)
            case "play":
                self._play()
            case "seen":  # its start, by a browser
                if self._waits:
                    self._play()
            case "pause":
                self._playing = self._waits = False
            case "step":
                self._playing = self._waits = False
                self._move(self._step_length())
            case "restart":
                self._restart()
            case "speed":
                self._set_speed(message.get("value"))
            case "set":
                self._set(message.get("key"), message.get("value"))
            case "push":
                self._push(message)
            case "link":
                self._link(message)
            case "look":
                self._look_at(message.get("system"))
            case "scenario":
                scenario = as_done(self.simulation.source, self.simulation.interventions)
                self.server.tell({"kind": "scenario", "text": scenario.toml()}, browser)
            case other:
                raise InvalidInput("do", other, "the page asks for what this version does not know")

    def _play(self) -> None:
        self._playing, self._waits = True, False
        self._pacer.restart(self.simulation.time)

    def _step_length(self) -> int:
        """Integration steps in one step of the page: to the next control instant, or sample."""
        clock = self.simulation.clock
        held = any(mode_of(system).held for system in self.simulation.systems)
        return clock.steps(clock.control_period if held else clock.sample_period)

    def _restart(self) -> None:
        """Let :meth:`run` return; the next one begins from the start, with the present sliders."""
        scenario = self._sliders.next_scenario()
        try:
            scenario.system_objects()
        except InfeasibleStart as error:  # the run goes on
            self._notice(self._sliders.refused_start(error))
            return
        self._next = scenario

    def _set_speed(self, value: Any) -> None:
        if value is not None:
            value = finite("speed", value)
            if not 0 < value <= FASTEST:
                raise InvalidInput("speed", value, f"it must be positive, at most {FASTEST:g}")
        self._pacer.speed = value
        self._pacer.restart(self.simulation.time)

    def _set(self, key: Any, value: Any) -> None:
        """Change a number of the running simulation, or of the next one when that has ended."""
        try:
            acts = self._sliders.set(self.simulation, key, value)
        finally:
            self._tell_controls()
        if acts:
            self._tell_interventions()
        else:
            self._notice("This holds from the next start on: its run has ended.", level="info")

    def _push(self, message: Mapping[str, Any]) -> None:
        """Push an agent along its axes, with "force" along "axis" or "forces" along the first."""
        name, agent = message.get("system"), message.get("agent")
        about = next((each for each in self._pushes if each["system"] == name), None)
        if about is None:
            raise InvalidInput("push", name, "only robots in MuJoCo can be pushed")
        game = self.simulation.runs[str(name)].system.game
        if not isinstance(agent, int) or not 1 <= agent <= game.agents:
            raise InvalidInput("push", agent, f"agents are numbered 1 to {game.agents}")
        axis, forces = message.get("axis", 0), message.get("forces")
        if not isinstance(axis, int) or not 0 <= axis < game.sizes[agent - 1]:
            raise InvalidInput("push", axis, f"agent {agent} has {game.sizes[agent - 1]} axes")
        if forces is None:
            forces = [0.0] * axis + [message.get("force", about["force"])]
        if not isinstance(forces, list) or not 0 < len(forces) <= game.sizes[agent - 1]:
            raise InvalidInput("push", forces, f"agent {agent} has {game.sizes[agent - 1]} axes")
        forces = [finite("push", force) for force in forces]
        duration = finite("push", message.get("duration", about["duration"]))
        if not 0.0 < duration <= LONGEST_PUSH:
            raise InvalidInput(
                "push", duration, f"it must last longer than 0 s, and at most {LONGEST_PUSH:g} s"
            )
        if self.simulation.ended:
            raise InvalidInput("push", name, "its run has ended; restart it")
        first = int(game.data.offsets[agent - 1])
        for channel, force in enumerate(forces, first):
            if force != 0.0:
                self.simulation.push(str(name), channel, force, duration)
        self._tell_interventions()

    def _link(self, message: Mapping[str, Any]) -> None:
        """Two agents of a system lose their link, or have it again."""
        name, pair, lost = (message.get(key) for key in ("system", "agents", "lost"))
        if name not in self.simulation.runs:
            raise InvalidInput("link", name, "there is no such system")
        pair = pair if isinstance(pair, list) and all(type(i) is int for i in pair) else []
        if len(pair) != 2 or not isinstance(lost, bool):
            raise InvalidInput("link", pair, "it is between two agents, and lost or not")
        if self.simulation.ended:
            raise InvalidInput("link", name, "its run has ended; restart it")
        first, second = pair[0] - 1, pair[1] - 1
        self.simulation.link(str(name), (first, second), lost=lost)
        self._tell_interventions()

    def _look_at(self, name: Any) -> None:
        """Frames have the joints of this system from now on, since somebody looks at them."""
        if name in self.simulation.runs:
            self._looked_at.add(str(name))

    def _tell_controls(self, browser: Browser | None = None) -> None:
        self.server.tell({"kind": "controls", "values": self._sliders.values}, browser)

    def _tell_interventions(self, browser: Browser | None = None) -> None:
        done = self.simulation.interventions
        self.server.tell({"kind": "interventions", "done": done}, browser)

    def _welcome(self, browser: Browser) -> None:
        scene = {
            "kind": "scene",
            **self._scene.meta(),
            "controls": [control.meta() for control in self._sliders.controls.values()],
            "pushes": self._pushes,
        }
        self.server.welcome(browser, [pack(scene, {}), self._history(), self._frame()])
        self._tell_controls(browser)
        self._tell_interventions(browser)

    def _notice(
        self, text: str, browser: Browser | None = None, *, level: str = "error", about: str = ""
    ) -> None:
        """Say something; of what is ``about`` the same the page shows the last sentence only."""
        message = {"kind": "notice", "level": level, "text": text, "about": about or text}
        self.server.tell(message, browser)

    def _history(self) -> bytes:
        """What was recorded so far, for the plots."""
        columns = sum(system.game.actions for system in self.simulation.systems)
        most = max(LEAST_ROWS, ENTRIES // columns)
        recorded = {name: run.recorded(most) for name, run in self.simulation.runs.items()}
        time, _ = max(recorded.values(), key=lambda found: len(found[0]))
        values = {}
        for name, (own, variables) in recorded.items():
            rows = np.clip(np.searchsorted(own, time), 0, max(len(own) - 1, 0))
            values[name] = {key: value[rows] for key, value in variables.items()}
        arrays = {"time": time}
        if len(time):
            arrays |= self._scene.arrays(values)
            for name, (own, _) in recorded.items():
                cut(arrays, name, time > own[-1] + 1e-9)
        return pack({"kind": "history"}, arrays)

    def _publish(self) -> None:
        """Offer a frame to whoever looks; the next one comes when this one's cost allows."""
        started, time = real_time.perf_counter(), self.simulation.time
        self._pacer.saw(time)
        self.server.publish(self._frame())
        cost = real_time.perf_counter() - started
        least = FRAME if self._playing else SLOWEST
        fast = self._playing and self._pacer.speed is None
        self._next_frame = started + min(SLOWEST, max(least, cost / SHARE if fast else 2 * cost))
        passed, self._frame_time = time - self._frame_time, time
        missed, self._missed = self.server.dropped - self._missed, self.server.dropped
        # where frames are too few to draw plots of, these are of what is recorded
        if (missed or passed > self.simulation.clock.sample_period) and started > self._history_due:
            started = real_time.perf_counter()
            self.server.publish(self._history())
            cost = real_time.perf_counter() - started
            self._history_due = started + max(HISTORY, cost / SHARE)

    def _frame(self) -> bytes:
        """The present instant."""
        pacer, ended = self._pacer, self._ended
        playing = self._playing and not self.simulation.ended
        reports = None if ended is None else ended.reports
        return self._frames.frame(playing, pacer.speed, pacer.measured, reports)
