"""What a live page costs the simulation: one frame, and the rate of steps with a browser attached.

The browser is a process of its own that takes frames and answers as the page does, but draws
nothing: what a page draws with costs another processor, or not, as the machine has one.
"""

import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager

import numpy as np
from turns import in_turns, row

from gne_mj.scenario import load_scenario
from gne_mj.viewer import Session

FLEETS = {5: 0.3, 100: 2.0, 500: 8.0}  # robots, ms allowed for a frame
SECONDS = 0.3  # of one turn

BROWSER = """
import asyncio, contextlib, sys
from tornado.httpclient import HTTPRequest
from tornado.websocket import WebSocketClosedError, websocket_connect

async def watch(url):
    request = HTTPRequest(url.replace("http", "ws") + "socket")
    page = await websocket_connect(request, max_message_size=2**28)
    frames = 0
    while (message := await page.read_message()) is not None:
        if message[:4] == b"GNE1":
            if frames > 1:  # after the scene and the history
                await page.write_message('{"do": "shown"}')
            frames += 1

with contextlib.suppress(WebSocketClosedError):  # it ends as the page's server does
    asyncio.run(watch(sys.argv[1]))
"""


def rows(turns: int) -> list[dict[str, str]]:
    """The table's lines."""
    lines = []
    for count, allowed in FLEETS.items():
        with watched(count) as session:
            frames = in_turns({"frame": frame_time(session)}, turns)["frame"]
            lines.append(
                {
                    "what": f"view: one frame of {count} robots, a browser attached (ms)",
                    "ours": f"{np.median(frames):.3g}", "other": "", "ratio": "",
                    "target": f"< {allowed:g} ms",
                }
            )  # fmt: skip
            kinds = {"with": rate(session._turn, session), "without": rate(bare(session), session)}
            rates = in_turns(kinds, turns)
            what = f"view: steps per s of {count} robots, watched / not watched"
            lines.append(row(what, rates, "with", "without", "> 0.95"))
    return lines


@contextmanager
def watched(count: int) -> Iterator[Session]:
    """A session of so many robots, as fast as it can, with a browser that takes every frame."""
    tables = load_scenario("velocity-sync").model_dump(mode="json", exclude_none=True)
    system = tables["systems"]["robots"]
    system["agents"]["count"], system["initial"] = count, {}
    # As long as no session gets, with as many samples as may be recorded of 500 robots
    tables["simulation"]["duration"], tables["recording"]["period"] = 1e4, 0.5
    session = Session(load_scenario(tables), "benchmark", speed=None)
    browser = subprocess.Popen([sys.executable, "-c", BROWSER, session.server.url])
    try:
        while not session.server.browsers:
            session._turn()
            assert browser.poll() is None
        yield session
    finally:
        session.server.close()
        browser.wait(10)


def frame_time(session: Session) -> Callable[[], float]:
    """Median ms of processor time that a frame takes of both threads."""
    making: list[float] = []
    sending: list[float] = []

    def timed(function: Callable[..., None], into: list[float]) -> Callable[..., None]:
        def call(*arguments: object) -> None:
            started = time.thread_time()
            function(*arguments)
            into.append(time.thread_time() - started)

        return call

    session._publish = timed(session._publish, making)
    session.server._bridge.publish = timed(session.server._bridge.publish, sending)

    def measure() -> float:
        making.clear()
        sending.clear()
        end = time.perf_counter() + SECONDS
        while time.perf_counter() < end or not (making and sending):
            session._turn()
        return 1e3 * float(np.median(making) + np.median(sending))

    return measure


def rate(advance: Callable[[], None], session: Session) -> Callable[[], float]:
    """Steps per s over some tenths of a second."""

    def measure() -> float:
        first, started = session.simulation.time, time.perf_counter()
        while time.perf_counter() - started < SECONDS:
            advance()
        elapsed = time.perf_counter() - started
        return (session.simulation.time - first) / session.simulation.clock.timestep / elapsed

    return measure


def bare(session: Session) -> Callable[[], None]:
    """The same simulation in pieces of the same length, without a look at the page."""

    def advance() -> None:
        session._move(session._pacer.affordable(0.01))

    return advance
