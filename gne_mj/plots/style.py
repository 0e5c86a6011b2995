"""What all figures share: readable in grey, in the paper's style."""

from typing import Any

from gne_mj.extras import need

FORMATS = ("png", "pdf", "svg")

# Readable in grey: lines differ in dash as well as in colour (Okabe and Ito's palette).
COLOURS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#56B4E9")
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


def pyplot() -> Any:
    """``matplotlib.pyplot``, slow to import, for files alone.

    Raises:
        MissingExtra: matplotlib is not installed.
    """
    need("plots", "drawing figures")
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    return plt


def axis_label(words: str, symbol: str, unit: str) -> str:
    """An axis's label: what it is, its symbol and its unit."""
    return " ".join([words, *([f"${symbol}$"] if symbol else []), *([f"({unit})"] if unit else [])])


def line_style(number: int) -> dict[str, Any]:
    """How the line of this number looks: colour and dash."""
    return {
        "color": COLOURS[number % len(COLOURS)],
        "linestyle": DASHES[(number + number // len(COLOURS)) % len(DASHES)],
    }
