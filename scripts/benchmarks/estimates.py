"""What estimates cost: how settling time and the time per step grow with the number of agents.

Draws docs/figures/settling-over-agents.png and docs/figures/step-over-agents.png.
"""

import argparse
import statistics
import time
from pathlib import Path

import matplotlib
import numpy as np

from gne_mj.controllers import FullInformation, Law, PartialInformation
from gne_mj.games import velocity_game
from gne_mj.graph import ring
from gne_mj.plants import flexible_robot
from gne_mj.plants.agents import Agents
from gne_mj.simulation import Simulation
from gne_mj.system import Clock, System

matplotlib.use("Agg")
import matplotlib.pyplot as plt

SMALL = 0.001  # the small time constant tau in s
_STYLES = (
    {"color": "#0072B2", "linestyle": "-", "marker": "o"},
    {"color": "#D55E00", "linestyle": (0, (6, 2)), "marker": "s"},
    {"color": "#009E73", "linestyle": (0, (2, 1.5)), "marker": "^"},
)


def system(count: int, law: Law, **options: str) -> System:
    """Robots with equal numbers, everybody half a bound below the reference, on the velocity game.

    They start at 1.5 m/s, springs relaxed; v_0 = 3 m/s, gaps up to 3 m/s.
    """
    table = np.ones((count, len(flexible_robot.PARAMETERS)))
    agents = Agents(flexible_robot, table, np.full(count, np.inf))
    state = agents.equilibrium(np.full(count, 1.5))
    return System("robots", velocity_game(count, 3.0, 3.0), agents, law, 0.1, state, **options)  # type: ignore[arg-type]


def settling(count: int, law: Law) -> float:
    """Settling time in s, found by runs that are doubled until it shows."""
    duration = 100.0
    while True:
        clock = Clock(duration, 0.02, 0.02, 0.1)
        run = Simulation([system(count, law, mode="sampled")], clock).run()
        report = run.reports["robots"]
        if not run.holds:
            raise RuntimeError(f"N = {count}: {report['status']}: {report['message']}")
        if report["settling_time"] is not None and report["status"] == "converged":
            return float(report["settling_time"])
        duration *= 2.0


def step_time(count: int, law: Law, runs: int, **options: str) -> float:
    """Median microseconds of one integration step in MuJoCo, at 1 ms."""
    steps = max(2, min(2000, 200_000 // count**2))
    clock = Clock(0.001 * steps * (runs + 1), 0.001, 0.001, 0.001 * steps)
    loop = system(count, law, engine="mujoco", **options).closed_loop(clock)
    loop.advance(1, steps)
    times = []
    for _ in range(runs):
        started = time.perf_counter()
        loop.advance(1, steps)
        times.append((time.perf_counter() - started) / steps)
    return 1e6 * statistics.median(times)


def draw_settling(path: Path) -> None:
    """Full information, partial with the paper's tau = 1, partial with a small tau."""
    cases = {
        "full information": ((5, 10, 20, 35, 50), lambda _: FullInformation()),
        r"partial, $\tau$ = 1 s (the paper's)": (
            (5, 10, 20, 35, 50),
            lambda n: PartialInformation(ring(n)),
        ),
        rf"partial, $\tau$ = {SMALL:g} s": (
            (5, 10, 20, 35, 50),
            lambda n: PartialInformation(ring(n), time_constant=SMALL),
        ),
    }
    figure, axes = plt.subplots(figsize=(4.8, 3.2), layout="constrained")
    for style, (label, (counts, law)) in zip(_STYLES, cases.items(), strict=True):
        times = [settling(count, law(count)) for count in counts]
        print(label, dict(zip(counts, times, strict=True)), flush=True)
        axes.loglog(counts, times, label=label, **style)
    _finish(figure, axes, "settling time (s)", path)


def draw_steps(path: Path, runs: int) -> None:
    """Both modes over N, with lines that grow as edges times agents."""
    counts = (10, 20, 50, 100, 200, 500, 1000)
    cases = {
        "continuous, RK4": {"mode": "continuous", "integrator": "rk4"},
        "sampled, Euler": {"mode": "sampled", "integrator": "euler"},
    }
    figure, axes = plt.subplots(figsize=(4.8, 3.2), layout="constrained")
    for style, (label, options) in zip(_STYLES, cases.items(), strict=False):
        times = [step_time(n, PartialInformation(ring(n)), runs, **options) for n in counts]
        print(label, dict(zip(counts, times, strict=True)), flush=True)
        axes.loglog(counts, times, label=label, **style)
        ideal = times[-2] * (np.array(counts) / counts[-2]) ** 2.0
        axes.loglog(counts, ideal, color="grey", linewidth=0.8, linestyle=":")
    axes.plot([], [], color="grey", linewidth=0.8, linestyle=":", label="edges x agents")
    _finish(figure, axes, r"time per step ($\mu$s)", path)


def _finish(figure: plt.Figure, axes: plt.Axes, label: str, path: Path) -> None:
    counts = sorted({int(x) for line in axes.lines for x in line.get_xdata()})
    axes.set_xticks(counts, [str(count) for count in counts])
    axes.minorticks_off()
    axes.set_xlabel("agents N, on a ring")
    axes.set_ylabel(label)
    axes.grid(which="major", alpha=0.25)
    axes.spines[["top", "right"]].set_visible(False)
    axes.legend(frameon=False, fontsize=8)
    figure.savefig(path, dpi=180)


def main() -> None:
    """Parse the arguments and draw."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--runs", type=int, default=20, help="turns of which the median counts")
    parser.add_argument("--only", choices=("settling", "steps"), help="one of the figures")
    options = parser.parse_args()
    folder = Path(__file__).parents[2] / "docs" / "figures"
    if options.only != "steps":
        draw_settling(folder / "settling-over-agents.png")
    if options.only != "settling":
        draw_steps(folder / "step-over-agents.png", options.runs)


if __name__ == "__main__":
    main()
