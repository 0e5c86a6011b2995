"""The figure of a comparison of laws: violation over time and against effort, and settling."""

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from gne_mj.plots.style import line_style, styled, subplots

if TYPE_CHECKING:
    import xarray


def save_comparison(data: "xarray.Dataset", file: Path, kind: str = "png") -> None:
    """Draw the laws of a comparison.

    Left: max_l g_l over time, 0 inside, the median of the runs with a band up to the worst. Middle:
    each law's median effort and worst violation. Right: how many runs have settled to the
    variational equilibrium by when.

    Args:
        data: as :func:`gne_mj.compare` returns it.
        file: to write.
        kind: of file: png, pdf or svg.
    """
    with styled():
        figure, grid = subplots(1, 3, 9.6, 3.1)
        over, against, settled = grid[0]
        for number, law in enumerate(data["law"].to_numpy()):
            own, style = data.sel(law=law), line_style(number)
            draw_violation(over, own, style, str(law))
            effort = float(own["rms_input"].median())
            worst = float(own["largest_violation"].max())
            against.plot([effort], [worst], "o", color=style["color"], markersize=5)
            _settled(settled, own, style)
        over.set(xlabel="time (s)", ylabel="violation, $\\max_l\\ [g_l]^+$")
        over.set_yscale("symlog", linthresh=_least(data))
        against.set(xlabel="RMS input (median)", ylabel="largest violation (worst run)")
        against.set_yscale("symlog", linthresh=_least(data))
        settled.set(xlabel="time (s)", ylabel="runs that have settled", ylim=(-0.03, 1.03))
        handles, labels = over.get_legend_handles_labels()
        figure.legend(handles, labels, loc="outside lower center", ncols=min(len(labels), 5))
        figure.savefig(file, dpi=200, format=kind)


def draw_violation(axes: Any, own: "xarray.Dataset", style: dict[str, Any], label: str) -> None:
    """One law's violation over time: the median of its runs, and a band up to the worst."""
    time, violation = own["time"].to_numpy(), own["violation"].to_numpy()
    there = ~np.all(np.isnan(violation), axis=0)
    axes.plot(time[there], np.nanmedian(violation[:, there], axis=0), label=label, **style)
    worst = np.nanmax(violation[:, there], axis=0)
    axes.fill_between(time[there], 0.0, worst, color=style["color"], alpha=0.08, linewidth=0)


def _settled(axes: Any, own: "xarray.Dataset", style: dict[str, Any]) -> None:
    times = np.sort(own["settling_time_to_variational"].to_numpy())
    times = times[~np.isnan(times)]
    share = np.arange(1, len(times) + 1) / own.sizes["run"]
    end = float(own["time"][-1])
    axes.step([0.0, *times, end], [0.0, *share, share[-1] if len(share) else 0.0],
              where="post", **style)  # fmt: skip


def _least(data: "xarray.Dataset") -> float:
    """Below which violation is drawn as nothing: a thousandth of the greatest."""
    greatest = float(data["largest_violation"].max())
    return 1e-3 * greatest if greatest > 0.0 else 1.0
