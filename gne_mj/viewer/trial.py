"""A change of a running system is tried before it acts: would the run leave its set with it?"""

import time as real_time
from dataclasses import replace

from gne_mj.certificate import status_now
from gne_mj.loops.base import ClosedLoop
from gne_mj.plain import raise_pending
from gne_mj.plants.mjcf_robot import MjcfRobots
from gne_mj.system import Clock, System

EFFORT = 0.1  # s of computing for a trial
FIRST_PIECE = 10  # steps before the first look at what was spent; each later piece is twice as long


class Trials:
    """Runs that nobody sees, each on with a changed system from where the shown run is.

    Nothing goes wrong in them: faults are left out. What a trial could not begin like is not tried:
    a penalty or game that changes in time, and MJCF robots, whose state is more than their games
    see of it.
    """

    def __init__(self) -> None:
        self._loops: dict[str, ClosedLoop] = {}  # the last ones, whose plants are used once more

    def exit(self, system: System, clock: Clock, steps: int) -> tuple[float, str] | None:
        """After how many s, and how, a system ends early; None if it was not seen to.

        Args:
            system: starts at the present state.
            clock: of the run.
            steps: up to the run's end; a trial ends before, when it has cost EFFORT.

        Raises:
            GneError: as when such a run begins; or a user's function failed.
        """
        if isinstance(system.agents, MjcfRobots) or system.moves:
            return None
        last = self._loops.get(system.name)
        tried = replace(system, faults=())
        loop = tried.closed_loop(clock, getattr(last, "plant", None))
        self._loops[system.name] = loop
        began, piece = real_time.thread_time(), FIRST_PIECE
        while steps > 0 and real_time.thread_time() < began + EFFORT:
            loop.advance(1, min(piece, steps))
            raise_pending()
            now = status_now(tried, loop.monitor)
            if now["exit_time"] is not None:
                return now["exit_time"], now["status"]
            steps, piece = steps - piece, 2 * piece
        return None
