"""The figures of docs/held-inputs.md, but for the map (that is `gne-mj map`)."""

from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np

from gne_mj import plots
from gne_mj.equilibrium import variational_equilibrium
from gne_mj.scenario import load_scenario, run

FOLDER = Path(__file__).parents[2] / "docs" / "figures"
STYLES = (
    {"color": "#0072B2", "linestyle": "-", "marker": "o"},
    {"color": "#D55E00", "linestyle": (0, (6, 2)), "marker": "s"},
    {"color": "#009E73", "linestyle": (0, (2, 1.5)), "marker": "^"},
    {"color": "#CC79A7", "linestyle": (0, (6, 2, 1.5, 2)), "marker": "v"},
)


def losses() -> None:
    """Settling time over the share of messages that are lost, medians and ranges of ten seeds."""
    shares = (0.0, 0.2, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 0.95)
    figure, axes = plt.subplots(figsize=(4.8, 3.2), layout="constrained")
    for style, period in zip(STYLES, (0.01, 0.03, 0.1), strict=False):
        times = []
        for share in shares:
            found, margins = [], []
            for seed in range(10):
                trajectory = run(
                    "velocity-sync",
                    {
                        "controller": {
                            "information": "partial", "graph": "ring", "coupling": 5.0,
                            "time_constant": 0.1, "mode": "implicit",
                        },
                        "plant.integrator": "euler", "simulation.timestep": 0.005,
                        "simulation.control_period": period, "simulation.duration": 600.0,
                        "simulation.seed": seed, "recording.period": 0.5,
                        "faults": [{"type": "message-loss", "probability": share}],
                    },
                )  # fmt: skip
                report = trajectory.reports["robots"]
                settled = report["settling_time"]
                found.append(np.inf if settled is None else settled)
                margins.append(report["worst_constraint"]["margin"])
                assert trajectory.holds, trajectory.tree.attrs["message"]
                if share == 0.0:
                    break
            times.append((np.min(found), np.median(found), np.max(found)))
            print(f"period {period:g} s, loss {share:g}: {times[-1]}, least margin"
                  f" {min(margins):.4g}", flush=True)  # fmt: skip
        low, middle, high = np.array(times).T
        axes.plot(shares, middle, label=f"{1e3 * period:g} ms", markersize=4, **style)
        axes.fill_between(shares, low, high, color=style["color"], alpha=0.15, linewidth=0)
    axes.set_xlabel("share of messages lost")
    axes.set_ylabel("settling time (s)")
    axes.set_yscale("log")
    _finish(figure, axes, "settling-over-losses.png", "control period")


def penalties() -> None:
    """Distance to the variational equilibrium of the channels while the penalty falls."""
    figure, axes = plt.subplots(figsize=(4.8, 3.2), layout="constrained")
    cases = {
        "implicit, 10 ms, to 1e-9": ("implicit", 0.01, None),
        "sampled, 2 ms, to its floor": ("sampled", 0.002, None),
        "sampled, 2 ms, a fifth of it": ("sampled", 0.002, 0.2),
    }
    for style, (label, (mode, step, part)) in zip(STYLES, cases.items(), strict=False):
        changes = {
            "controller": {"information": "full", "mode": mode}, "plant.integrator": "euler",
            "barrier": {"rho": 1.0, "schedule": "exponential", "time_constant": 1.0},
            "simulation.timestep": step, "simulation.duration": 40.0, "recording.period": 0.1,
        }  # fmt: skip
        (system,) = load_scenario("osnr", changes).system_objects()
        if part is not None:
            changes["barrier.floor"] = part * system.rho
        trajectory = run("osnr", changes)
        data = trajectory["channels"]
        exact = variational_equilibrium(system.game, system.start)
        distance = np.linalg.norm(data["action"].to_numpy() - exact.action, axis=1)
        line = {key: value for key, value in style.items() if key != "marker"}
        axes.semilogy(data["time"], np.maximum(distance, 1e-16), label=label, **line)
        if not trajectory.holds:
            axes.plot(data["time"][-1], distance[-1], "x", color=style["color"], markersize=8)
        report = trajectory.reports["channels"]
        print(label, f"rho to {float(data['penalty'][-1]):.3g}:", trajectory.status,
              f"distance {distance[-1]:.3g},", report["worst_constraint"], flush=True)  # fmt: skip
    axes.set_xlabel("time (s)")
    axes.set_ylabel("distance to the vGNE (mW)")
    _finish(figure, axes, "falling-penalty.png", None)


def disturbed() -> None:
    """The shipped scenario's gaps, with their bounds."""
    figure = plots.draw(run("disturbed"))["robots-gaps"]
    figure.savefig(FOLDER / "disturbed-gaps.png", dpi=160)


def formation() -> None:
    """The shipped formation from above."""
    figure = plots.draw(run("formation"))["robots-plane"]
    figure.savefig(FOLDER / "formation.png", dpi=160)


def _finish(figure: plt.Figure, axes: plt.Axes, name: str, title: str | None) -> None:
    axes.grid(which="major", alpha=0.25)
    axes.spines[["top", "right"]].set_visible(False)
    axes.legend(frameon=False, fontsize=8, title=title, title_fontsize=8)
    figure.savefig(FOLDER / name, dpi=160)


if __name__ == "__main__":
    penalties()
    losses()
    disturbed()
    formation()
