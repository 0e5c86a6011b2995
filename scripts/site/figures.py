"""Writes docs/figures/concept-*.svg and start-*.svg: figures of docs/concepts.md and index.md."""

import shutil
from collections.abc import Callable
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

import gne_mj as gm
from gne_mj.cli.templates import TEMPLATES
from gne_mj.equilibrium import path, variational_equilibrium
from gne_mj.plots.style import COLOURS, line_style, styled, subplots

FOLDER = Path(__file__).parents[2] / "docs" / "figures"
WANTED, TOGETHER = (2.0, 1.5), 2.0  # of two boats, in m/s


def equilibria(axes: Any) -> None:
    """Two agents with one shared bound: all generalized equilibria, and the path to one."""
    ours = (TOGETHER - WANTED[1], WANTED[0])
    y1 = np.linspace(-0.2, 2.4, 50)
    axes.fill_between(y1, -0.2, TOGETHER - y1, color="0.9", linewidth=0)
    axes.plot(y1, TOGETHER - y1, color="0.4", linewidth=1, label="shared bound")
    axes.plot(ours, [TOGETHER - each for each in ours], color=COLOURS[0], linewidth=4,
              alpha=0.5, label="generalized Nash equilibria")  # fmt: skip
    boats, rhos = two_boats(), np.geomspace(1.0, 1e-4, 40)
    actions = [found.action for found in path(boats, rhos, [0.5, 0.5])]
    axes.plot(*np.transpose(actions), **line_style(1), label="penalised, rho falls")
    axes.plot(
        *variational_equilibrium(boats, [0.5, 0.5]).action, "o", color="black", label="variational"
    )
    axes.plot(*WANTED, "x", color="black", label="what each wants")
    axes.set(xlabel="$y_1$ (m/s)", ylabel="$y_2$ (m/s)", xlim=(0, 4.2), ylim=(0, 1.8))
    axes.legend(loc="center right")


def prices(axes: Any) -> None:
    """What each of them would pay for more of the shared bound, along all equilibria."""
    y1 = np.linspace(TOGETHER - WANTED[1], WANTED[0], 50)
    for number, price in enumerate((WANTED[0] - y1, WANTED[1] - (TOGETHER - y1))):
        axes.plot(y1, price, **line_style(number), label=f"price of agent {number + 1}")
    found = variational_equilibrium(two_boats(), [0.5, 0.5])
    axes.plot(found.action[0], found.multipliers[0], "o", color="black", label="variational")
    axes.set(xlabel="$y_1$ at the equilibrium (m/s)", ylabel=r"multiplier $\lambda$")
    axes.legend()


def barrier(axes: Any) -> None:
    """An agent's cost beside a bound, with the barrier on top."""
    y = np.linspace(0, 2 - 1e-6, 2000)
    axes.plot(y, (y - 3) ** 2 / 2, color="black", linewidth=1, label="cost alone")
    for number, rho in enumerate((1.0, 0.3, 0.03)):
        total = (y - 3) ** 2 / 2 - rho * np.log(2 - y)
        axes.plot(y, total, **line_style(number), label=f"with barrier, rho = {rho:g}")
        axes.plot(y[total.argmin()], total.min(), "o", color=COLOURS[number], markersize=4)
    axes.axvline(2, color="black", linestyle=(0, (4, 3)), linewidth=1)
    axes.set(xlabel="$y$", ylabel="what the agent minimises", xlim=(0, 2.15), ylim=(0, 5))
    axes.legend(loc="lower left")


def information(axes: Any) -> None:
    """Ten channels under the three laws."""
    laws: dict[str, dict[str, Any]] = {
        "full": {"information": "full"},
        "partial": {"information": "partial", "graph": "printed"},
        "partial, estimates 20 times as fast": {
            "information": "partial", "graph": "printed", "time_constant": 0.05,
        },
        "fully distributed": {
            "information": "distributed", "graph": "printed", "gain": 0.1, "epsilon": 0.01,
        },
    }  # fmt: skip
    for number, (name, law) in enumerate(laws.items()):
        steps = "rosenbrock" if "epsilon" in law else "rk4"
        changes = {"controller": law, "plant.integrator": steps, "simulation.duration": 20.0}
        run = gm.run("osnr", changes)["channels"]
        far = abs(run["action"] - run["equilibrium"]).max("agent")
        axes.semilogy(run["time"], far, **line_style(number), label=name)
    axes.set(xlabel="time (s)", ylabel="distance from $y^*$ (mW)", ylim=(1e-7, None))
    axes.legend()


def passivity(axes: Any) -> None:
    """Five robots: what is stored never exceeds what was there and what was supplied."""
    run = gm.run("velocity-sync", {"recording.period": 0.002, "simulation.duration": 6.0})["robots"]
    names = ("extension", "action", "appendage_velocity", "input", "time")
    x, v, w, u, times = (run[name].values for name in names)
    v, w = v - 3.0, w - 3.0
    spring = x**2 / 2 + x * np.arctan(x) - np.log(1 + x**2) / 2
    stored = (spring + v**2 / 2 + w**2 / 2).sum(1)
    power = (v * u).sum(1)
    supplied = stored[0] + np.concatenate([[0], np.cumsum(power[1:] + power[:-1]) * 0.001])
    axes.plot(times, supplied, **line_style(1), label="at the start, and supplied since")
    axes.plot(times, stored, **line_style(0), label="stored: $V$")
    axes.set(xlabel="time (s)", ylabel="energy about the equilibrium (J)")
    axes.legend()


def sampled(axes: Any) -> None:
    """The same law once a second: as its formula reads, and solved for."""
    for number, mode in enumerate(("sampled", "implicit")):
        run = gm.run(
            "velocity-sync",
            {"controller.mode": mode, "simulation.control_period": 1.0, "simulation.duration": 8.0},
        )["robots"]
        worst = abs(run["gap"]).max("agent")
        axes.plot(run["time"], worst, **line_style(number), label=f"mode {mode}")
    axes.axhline(3, color="black", linestyle=(0, (4, 3)), linewidth=1, label="bound")
    axes.set(xlabel="time (s)", ylabel="largest gap (m/s)")
    axes.legend()


def start() -> None:
    """The game that `gne-mj new game mine` writes."""
    with TemporaryDirectory() as name:
        folder = Path(name)
        for end, text in TEMPLATES["game"].items():
            (folder / f"mine{end}").write_text(text.replace("NAME", "mine"), encoding="utf-8")
        gm.run(folder / "mine.toml").plot(folder, ("svg",))
        for what in ("actions", "budget-value"):
            shutil.copy(folder / f"robots-{what}.svg", FOLDER / f"start-{what}.svg")


def two_boats() -> gm.Game:
    """J_i = (y_i - wanted_i)^2 / 2 with y_1 + y_2 <= 2."""
    return gm.game(
        2,
        lambda i, y, p: (y[i] - p.wanted[i]) ** 2 / 2,
        lambda y, p: [("together", y[0] + y[1] <= p.together)],
        wanted=list(WANTED),
        together=TOGETHER,
    )


DRAWN: dict[str, Callable[[Any], None]] = {
    "equilibria": equilibria, "prices": prices, "barrier": barrier,
    "information": information, "passivity": passivity, "sampled": sampled,
}  # fmt: skip

if __name__ == "__main__":
    start()
    for name, draw in DRAWN.items():
        with styled():
            figure, axes = subplots(1, 1, 4.6, 2.9)
            draw(axes[0, 0])
            figure.savefig(FOLDER / f"concept-{name}.svg", metadata={"Date": None})
