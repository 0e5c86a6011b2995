"""Colours of agents, one for figures and pages.

Okabe and Ito's hues in an order in which each differs much from the next, also for who sees two of
three colours, each with contrast to its ground; agents 9 to 16 have the same hues, darker or
lighter. Black and white are left to bounds and sums.
"""

PALETTE = {
    "light": [
        "#0072b2", "#707070", "#4a35a8", "#3a9bd9", "#c56a9c", "#d55e00", "#00805c", "#b07800",
        "#003f62", "#3e3e3e", "#9286cb", "#205577", "#6c3a56", "#753400", "#004633", "#614200",
    ],
    "dark": [
        "#56b4e9", "#c9c9c9", "#7f8cff", "#f0e442", "#d98cbb", "#e8703a", "#2fc18c", "#e69f00",
        "#b3ddf5", "#797979", "#c5cbff", "#908928", "#eecbe0", "#f5bfa6", "#a1e3cb", "#f4d48c",
    ],
}  # fmt: skip
