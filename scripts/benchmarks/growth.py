"""How the time of a step grows with the number of agents, each law and engine on equal robots.

Rows tell the time per step and agent for few and for many, and of 1,000 robots beside MuJoCo;
``draw`` draws all of them.
"""

import time
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from turns import in_turns, row

from gne_mj.controllers import FullInformation, Law, PartialInformation
from gne_mj.controllers.keepers import fewest, readers
from gne_mj.controllers.kept import Kept
from gne_mj.game_model import Game
from gne_mj.games import velocity_game
from gne_mj.graph import line
from gne_mj.plants import flexible_robot
from gne_mj.plants.agents import Agents
from gne_mj.plants.fleet import compile_model, compose
from gne_mj.plants.mujoco import run_steps
from gne_mj.plants.native_mujoco import step_address
from gne_mj.system import Clock, System

H = 1e-3
COUNTS = (10, 30, 100, 300, 1000, 3000, 5000)
FEW, MANY = 30, 5000  # of the rows
BESIDE = 1000  # of those beside MuJoCo alone
WORK = 200_000  # steps times agents of a turn, of laws whose work is in proportion to N
ENGINES = {"ode": "ODE", "mujoco": "MuJoCo"}
BARE = "mj_step alone"


class Kind(NamedTuple):
    """What is measured.

    Attributes:
        name: in words.
        law, mode, engine: as scenarios have them, "all" and "needed" being the estimates of partial
            information; without a law MuJoCo alone.
        most: agents.
    """

    name: str
    law: str
    mode: str
    engine: str
    most: int = MANY


KINDS = (
    *(Kind(f"full, {ENGINES[each]}", "full", "continuous", each) for each in ENGINES),
    *(Kind(f"implicit, {ENGINES[each]}", "full", "implicit", each) for each in ENGINES),
    *(Kind(f"partial, {ENGINES[each]}", "needed", "sampled", each) for each in ENGINES),
    Kind("partial, all estimates, ODE", "all", "continuous", "ode", 1000),
    Kind("partial, all estimates, MuJoCo", "all", "continuous", "mujoco", 1000),
    Kind(BARE, "", "", "mujoco"),
)


def rows(turns: int = 20) -> list[dict[str, str]]:
    """The table's lines, in microseconds per step and agent; and the figure, drawn anew."""
    found = measure(turns)
    draw(found, Path(__file__).parents[2] / "docs" / "figures" / "growth.png")
    return [*(_row(kind, found) for kind in KINDS), _beside(found)]


def measure(turns: int) -> dict[int, dict[str, list[float]]]:
    """Of each number of agents and kind what its turns took, in us per step and agent."""
    found = {}
    for count in COUNTS:
        kinds = [kind for kind in KINDS if count <= kind.most]
        found[count] = in_turns({kind.name: _turn(kind, count) for kind in kinds}, turns)
    return found


def _turn(kind: Kind, count: int) -> Callable[[], float]:
    work = WORK / count if kind.law == "all" else WORK
    steps = max(1, round(work / count))
    make = _bare if not kind.law else _closed_loop
    return partial(_per_agent, make(kind, count, steps), count * steps)


def _per_agent(run: Callable[[], Any], size: int) -> float:
    began = time.perf_counter()
    run()
    return 1e6 * (time.perf_counter() - began) / size


def _closed_loop(kind: Kind, count: int, steps: int) -> Callable[[], Any]:
    agents = Agents(flexible_robot, _numbers(count), np.full(count, np.inf))
    game = velocity_game(count, 3.0, 3.0)
    system = System(
        "robots", game, agents, _law(kind, game), 0.1,
        agents.equilibrium(_velocities(count)),
        engine=kind.engine, integrator="euler", mode=kind.mode,
    )  # fmt: skip
    loop = system.closed_loop(Clock(1e3, H, H, H))
    return partial(loop.advance, 1, steps)


def _law(kind: Kind, game: Game) -> Law:
    if kind.law == "full":
        return FullInformation()
    graph, kept = line(game.agents), None
    if kind.law == "needed":
        keepers = fewest(graph, readers(game.data, constraints=False))
        kept = Kept(graph, game.data.offsets, keepers)
    return PartialInformation(graph, kept=kept)


def _bare(_kind: Kind, count: int, steps: int) -> Callable[[], Any]:
    import mujoco

    model = compile_model(compose(_numbers(count), decorated=False), timestep=H, integrator="Euler")
    data = mujoco.MjData(model)
    data.qvel[0::2] = data.qvel[1::2] = _velocities(count)
    run = run_steps()
    return lambda: run(step_address(), model._address, data._address, steps)


def _numbers(count: int) -> np.ndarray:
    return np.ones((count, len(flexible_robot.PARAMETERS)))


def _velocities(count: int) -> np.ndarray:
    """Near the reference of 3 m/s, and none like its neighbour's."""
    return 3.0 + 0.2 * np.sin(np.arange(count))


def _row(kind: Kind, found: dict[int, dict[str, list[float]]]) -> dict[str, str]:
    most = max(count for count in found if kind.name in found[count])
    times = {"many": found[most][kind.name], "few": found[FEW][kind.name]}
    what = f"growth, {kind.name}, euler: us per step and agent; N = {most} / N = {FEW}"
    return row(what, times, "many", "few", "")


def _beside(found: dict[int, dict[str, list[float]]]) -> dict[str, str]:
    """Partial information of many robots beside MuJoCo alone."""
    what = f"growth, partial, MuJoCo, sampled / mj_step: us per step and agent, N = {BESIDE}"
    return row(what, found[BESIDE], "partial, MuJoCo", BARE, "< 1.3")


def draw(found: dict[int, dict[str, list[float]]], path: Path) -> None:
    """Medians over N."""
    from gne_mj.plots.style import COLOURS, DASHES, styled, subplots

    with styled():
        figure, ((axes,),) = subplots(1, 1, 4.8, 3.4)
        for k, kind in enumerate(KINDS):
            counts = [count for count in found if kind.name in found[count]]
            times = [float(np.median(found[count][kind.name])) for count in counts]
            style = {"color": COLOURS[k // 2], "linestyle": DASHES[k % 2], "marker": "os"[k % 2]}
            if not kind.law:
                style |= {"color": "black", "linestyle": ":", "marker": ""}
            axes.loglog(counts, times, label=kind.name, markersize=3.5, **style)
        axes.set_xlabel("agents $N$")
        axes.set_ylabel(r"time per step and agent ($\mu$s)")
        named = [f"{count:,}" if count != COUNTS[-2] else "" for count in COUNTS]
        axes.set_xticks(COUNTS, named)
        axes.minorticks_off()
        axes.set_ylim(top=10.0 * axes.get_ylim()[1])  # room for the legend
        axes.legend(ncols=2, loc="upper left")
        figure.savefig(path, dpi=180)


if __name__ == "__main__":
    for line_ in rows():
        print(*line_.values(), sep="  ")
