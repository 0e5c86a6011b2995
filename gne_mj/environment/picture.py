"""A picture of a fleet as it is now, drawn with NumPy alone: no display or OpenGL is needed.

Above, each channel has a row with its output's place between the bounds that the game declares.
Below, each constraint has a row that fills as it is used up.
"""

import numpy as np
from numpy.typing import NDArray

from gne_mj.environment.fleets import Fleets
from gne_mj.system import System

MODES = ("rgb_array", "ansi")
WIDTH, ROW, GAP = 320, 12, 4
GROUND, TRACK, OUTPUT = (255, 255, 255), (225, 228, 232), (40, 90, 160)
USED, NEAR, NEARLY = (90, 160, 90), (200, 70, 50), 0.9  # colours up to that share, and beyond
REACH = 10.0  # of outputs of which the game declares no bounds

Picture = NDArray[np.uint8]


def picture(system: System, fleets: Fleets, row: int) -> Picture:
    """A picture (height, WIDTH, 3) of one fleet."""
    game, y, g = system.game, fleets.rows.y[row], fleets.rows.g[row]
    low, high = game.box or (np.full(len(y), -REACH), np.full(len(y), REACH))
    rows = len(y) + len(g)
    drawn = np.full((rows * (ROW + GAP) + 3 * GAP, WIDTH, 3), GROUND, dtype=np.uint8)
    tops = GAP + np.arange(rows) * (ROW + GAP) + np.where(np.arange(rows) < len(y), 0, GAP)
    places = _pixels((y - low) / (high - low), WIDTH - 2 * GAP - ROW)
    ends = _pixels(used(system, g), WIDTH - 2 * GAP)
    for top in tops:
        drawn[top : top + ROW, GAP : WIDTH - GAP] = TRACK
    for top, at in zip(tops[: len(y)], places, strict=True):
        drawn[top : top + ROW, at : at + ROW] = OUTPUT
    near = _pixels(np.array(NEARLY), WIDTH - 2 * GAP)
    for top, end in zip(tops[len(y) :], ends, strict=True):
        drawn[top : top + ROW, GAP:end] = USED if end < near else NEAR
    return drawn


def _pixels(share: NDArray[np.float64], width: int) -> NDArray[np.int64]:
    return GAP + np.rint(np.clip(share, 0.0, 1.0) * width).astype(np.int64)


def used(system: System, g: NDArray[np.float64]) -> NDArray[np.float64]:
    """How much of each constraint's slack at y* is used, (p,); 1 where it is violated."""
    return 1.0 - np.clip(g / system.game.constraints(system.centre), 0.0, 1.0)


def line(system: System, fleets: Fleets, row: int) -> str:
    """One fleet in words: the time, its outputs, and the constraint that is used most."""
    g = fleets.rows.g[row]
    share = used(system, g)
    worst = int(np.argmax(share))
    y = " ".join(f"{value:.3f}" for value in fleets.rows.y[row])
    name = system.game.constraint_names[worst]
    return f"{fleets.time(row):.3f} s: y = {y}; {name} {share[worst]:.0%} used"


def drawn(mode: str | None, system: System, fleets: Fleets, row: int) -> Picture | str | None:
    """What an environment's ``render`` returns in one of MODES."""
    if mode is None:
        return None
    return (picture if mode == "rgb_array" else line)(system, fleets, row)
