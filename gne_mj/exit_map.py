"""Where a set is left: runs over a grid of control periods, start margins and pushes.

Starts lie on random rays from the penalised equilibrium, at rest but for the outputs; a margin is
the share of the way from the equilibrium to the boundary that is left. A push is a constant force
on every entry of every agent's action, each in a random direction; it takes the place of the
scenario's own faults. A margin that the scenario declares is made anew for each control period.
"""

import csv
from collections.abc import Callable, Iterator, Sequence
from dataclasses import asdict, dataclass, fields, replace
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gne_mj.bounds import MOST_RUNS, check_count
from gne_mj.errors import InfeasibleStart, InvalidInput, SolverError
from gne_mj.faults import steady_push
from gne_mj.loops import monitor as watch
from gne_mj.loops.base import ClosedLoop
from gne_mj.plain import raise_pending
from gne_mj.progress import Tell, nothing
from gne_mj.registry import MODES
from gne_mj.system import Clock, System
from gne_mj.theory.trials import held_for


def held_modes() -> list[str]:
    """The modes that have a control period."""
    return [mode.name for mode in MODES if mode.held]


@dataclass(frozen=True)
class Grid:
    """What is tried.

    Args:
        periods: control periods in s.
        margins: shares of the way to the boundary that a start leaves, between 0 and 1.
        pushes: forces on every agent, in the input's unit.
        runs: starts for each cell.
        duration: of a run in s, rounded up to whole periods.
        seed: of starts and directions; the same ones in every cell.
    """

    periods: tuple[float, ...]
    margins: tuple[float, ...]
    pushes: tuple[float, ...] = (0.0,)
    runs: int = 20
    duration: float = 3.0
    seed: int = 0

    def __post_init__(self) -> None:
        for key in ("periods", "margins", "pushes"):
            values = np.asarray(getattr(self, key), dtype=np.float64)
            lowest = 0.0 if key == "pushes" else np.nextafter(0.0, 1.0)
            if not len(values) or not np.all(np.isfinite(values)) or np.any(values < lowest):
                raise InvalidInput(key, list(values), "every entry must be positive")
        if np.any(np.asarray(self.margins) >= 1.0):
            raise InvalidInput("margins", self.margins, "they are shares, below 1")
        for key in ("runs", "duration"):
            if not 0 < getattr(self, key) < np.inf:
                raise InvalidInput(key, getattr(self, key), "it must be positive")
        if self.seed < 0:
            raise InvalidInput("seed", self.seed, "it must not be negative")
        check_count("runs", self.total, MOST_RUNS, "all together")

    @property
    def cells(self) -> int:
        """How many cells that is."""
        return len(held_modes()) * len(self.periods) * len(self.margins) * len(self.pushes)

    @property
    def total(self) -> int:
        """How many runs that is."""
        return self.cells * self.runs


@dataclass(frozen=True)
class Cell:
    """What the runs of one cell showed.

    Attributes:
        mode, period, margin, push: which cell.
        runs: how many.
        left_at_instant: how many left the set, first seen at a control instant.
        left_between: how many left it between two control instants.
        no_action: how many ended since the law had no action or demand that is a number.
        refused: how many could not be started, as with a period that the mode refuses.
        least_margin: the least -g over all runs that stayed, None if none did.
    """

    mode: str
    period: float
    margin: float
    push: float
    runs: int
    left_at_instant: int
    left_between: int
    no_action: int
    refused: int
    least_margin: float | None

    @property
    def share(self) -> float:
        """Of the runs that did not stay inside."""
        return (self.left_at_instant + self.left_between + self.no_action) / max(self.runs, 1)


def exit_map(
    system: System,
    timestep: float,
    grid: Grid,
    progress: Tell = nothing,
    stopped: Callable[[], bool] = lambda: False,
) -> list[Cell]:
    """All cells of the grid, or those done when ``stopped``, asked before each run, said so.

    Args:
        system: whose game, agents, law and engine are tried; its start and mode do not matter.
        timestep: the longest integration step in s; periods are made of whole steps.
        grid: what is tried.
        progress: called after every run, with integration steps and the number of runs.

    Raises:
        InvalidInput: agents keep apart.
    """
    if system.membership is not None:
        expected = "maps know no agents that leave or join: leave it out"
        raise InvalidInput("system.membership", "given", expected)
    if system.separation is not None:
        raise InvalidInput(
            "system.separation",
            "given",
            "a map is of ways from the equilibrium to the boundary of the game's set, and agents"
            " that keep apart cannot begin on all of them: 'gne-mj batch' draws starts that fit",
        )
    starts = _rays(system, grid)
    plants: dict[tuple[str, bool], Any] = {}
    cells: list[Cell] = []
    clocks = {period: _clock(grid.duration, timestep, period) for period in grid.periods}
    steps = {period: clock.steps(clock.duration) for period, clock in clocks.items()}
    total = sum(steps.values()) * (grid.total // len(grid.periods))
    done = runs = 0
    progress(0, total, f"{grid.total} runs of {grid.duration:g} s")
    for mode, period, push, margin in product(
        held_modes(), grid.periods, grid.pushes, grid.margins
    ):
        counts = dict.fromkeys(("instant", "between", "nothing", "refused"), 0)
        least = np.inf
        for ray, signs in starts:
            if stopped():
                return cells
            outcome, worst = _run(
                _at(system, mode, ray, margin, push * signs), clocks[period], plants
            )
            if outcome == "inside":
                least = min(least, worst)
            else:
                counts[outcome] += 1
            done, runs = done + steps[period], runs + 1
            progress(done, total, f"{runs} of {grid.total} runs")
        cells.append(
            Cell(
                mode, period, margin, push, len(starts), counts["instant"], counts["between"],
                counts["nothing"], counts["refused"], least if np.isfinite(least) else None,
            )
        )  # fmt: skip
    return cells


def write(cells: Sequence[Cell], file: Path) -> None:
    """The cells as a CSV table."""
    with file.open("w", encoding="utf-8", newline="") as stream:
        names = [each.name for each in fields(Cell)]
        table = csv.DictWriter(stream, names)
        table.writeheader()
        table.writerows(asdict(cell) for cell in cells)


def summary(cells: Sequence[Cell]) -> Iterator[str]:
    """Lines that tell, for each mode and push, up to which period every run stayed inside."""
    for mode, push in dict.fromkeys((cell.mode, cell.push) for cell in cells):
        own = [cell for cell in cells if (cell.mode, cell.push) == (mode, push)]
        runs, left = sum(c.runs for c in own), sum(c.left_at_instant for c in own)
        between = sum(c.left_between + c.no_action for c in own)
        safe = 0.0
        for period in sorted({cell.period for cell in own}):
            if any(cell.share > 0 or cell.refused for cell in own if cell.period == period):
                break
            safe = period
        text = f"every start stayed inside up to {safe:g} s" if safe else "no period was safe"
        yield (
            f"{mode}, push {push:g}: {text}; of {runs} runs {left} left at a control instant,"
            f" {between} between"
        )


def _rays(system: System, grid: Grid) -> list[tuple[NDArray[np.float64], NDArray[np.float64]]]:
    """For each run a way from y* to the boundary, (m,), and signs of the agents' pushes (m,)."""
    rng = np.random.default_rng(grid.seed)
    game, middle = system.game, system.centre
    found = []
    for _ in range(grid.runs):
        ray = rng.normal(size=game.actions)
        low, high = 0.0, 1.0

        def inside(length: float, ray: NDArray[np.float64] = ray) -> bool:
            return bool(np.all(game.constraints(middle + length * ray) + game.margins < 0))

        while inside(high) and high < 1e12:
            high *= 2.0
        for _ in range(100):
            length = 0.5 * (low + high)
            low, high = (length, high) if inside(length) else (low, length)
        found.append((low * ray, rng.choice([-1.0, 1.0], game.actions)))
    return found


def _at(
    system: System, mode: str, ray: NDArray[np.float64], margin: float, push: NDArray[np.float64]
) -> System | None:
    """The system at rest at that part of the way, pushed; None if rounding puts it outside."""
    y = system.centre + (1.0 - margin) * ray
    state = system.agents.equilibrium(y)
    memory = system.law.initial_memory(y)
    try:
        return replace(
            system, mode=mode, state=state, memory=memory, faults=steady_push(system.game, push)
        )
    except (InvalidInput, InfeasibleStart):
        return None


def _clock(duration: float, timestep: float, period: float) -> Clock:
    """Of whole periods, each of whole steps."""
    steps = int(np.ceil(period / timestep - 1e-9))
    duration = float(np.ceil(duration / period - 1e-9)) * period
    return Clock(duration, period / steps, period, duration)


def _run(
    system: System | None, clock: Clock, plants: dict[tuple[str, bool], Any]
) -> tuple[str, float]:
    """How one run ended, and its least margin -g."""
    if system is None:
        return "refused", np.nan
    key = (system.mode, bool(system.faults))
    try:
        held = held_for(system, clock.timestep, clock.steps(clock.control_period))
        loop: ClosedLoop = held.closed_loop(clock, plants.get(key))
    except (InvalidInput, InfeasibleStart, SolverError):
        return "refused", np.nan
    plants[key] = getattr(loop, "plant", None)
    loop.pass_over(clock.steps(clock.duration))
    loop.finish()
    raise_pending()
    monitor = loop.monitor
    if monitor.exit == watch.LEFT_SET:
        return ("between" if monitor.exit_between > 0 else "instant"), np.nan
    if monitor.exit != watch.INSIDE:
        return "nothing", np.nan
    return "inside", float(-np.max(monitor.worst))
