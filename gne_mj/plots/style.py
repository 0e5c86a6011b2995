"""What all figures share: readable in grey, in the paper's style."""

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from gne_mj.extras import need
from gne_mj.palette import PALETTE

FORMATS = ("png", "pdf", "svg")

# Readable in grey: lines differ in dash as well as in colour; black is for bounds.
COLOURS = PALETTE["light"]
DASHES = ("-", (0, (6, 2)), (0, (2, 1.5)), (0, (6, 2, 1.5, 2)), (0, (1, 1)))
# Beyond this many lines a legend says less than it hides.
LEGEND = 12
STYLE: Any = {
    "font.size": 9,
    "font.family": "serif",
    "mathtext.fontset": "cm",
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.grid": True,
    "grid.alpha": 0.25,
    "grid.linewidth": 0.5,
    "lines.linewidth": 1.3,
    "legend.frameon": False,
    "legend.fontsize": 7.5,
    "svg.hashsalt": "gne-mj",
}


@contextmanager
def styled(**settings: Any) -> Iterator[None]:
    """Draw in this style, with these settings besides.

    Raises:
        MissingExtra: matplotlib is not installed.
    """
    need("plots", "drawing figures")
    from matplotlib import rc_context

    both: Any = dict(STYLE, **settings)
    with rc_context(both):
        yield


def subplots(rows: int, columns: int, width: float, height: float, **how: Any) -> Any:
    """A figure of a size in inches and its (rows, columns) axes; pyplot knows nothing of it."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(width, height), layout="constrained")
    return figure, figure.subplots(rows, columns, squeeze=False, **how)


def axis_label(words: str, symbol: str, unit: str) -> str:
    """An axis's label: what it is, its symbol and its unit."""
    return " ".join([words, *([f"${symbol}$"] if symbol else []), *([f"({unit})"] if unit else [])])


def line_style(number: int) -> dict[str, Any]:
    """How the line of this number looks: colour and dash."""
    return {
        "color": COLOURS[number % len(COLOURS)],
        "linestyle": DASHES[(number + number // len(COLOURS)) % len(DASHES)],
    }
