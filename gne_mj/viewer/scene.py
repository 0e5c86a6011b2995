"""All of a page's systems together: what is drawn once, and arrays for instants or samples."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gne_mj.viewer.mirror import POSITION, QUATERNION
from gne_mj.viewer.shown_system import Arrays, ShownSystem, Values

APART = 1.2  # m between the lanes of systems that are drawn beside each other
ROOT = "meshcat"  # where a meshcat.Visualizer draws everything


class Scene:
    """What a page shows of several systems.

    Args:
        shown_systems: one a system.
        title: of the page.
        duration: of the run, in s.
    """

    def __init__(self, shown_systems: Sequence[ShownSystem], title: str, duration: float) -> None:
        self.shown_systems, self.title, self.duration = shown_systems, title, duration
        self._shifts = _beside(shown_systems)

    def meta(self) -> dict[str, Any]:
        """What JSON tells the page of the scene; see :mod:`gne_mj.viewer`."""
        items: list[str] = []
        systems = []
        for shown_system in self.shown_systems:
            about = shown_system.meta()
            if shown_system.fleet is not None:
                about["anchors"] = [len(items) + anchor for anchor in about["anchors"]]
                about["tints"] = [[f"{ROOT}/{path}" for path in each] for each in about["tints"]]
                items.extend(f"{ROOT}/{item}" for item in shown_system.fleet.mirror.items)
            systems.append(about)
        clock = self.shown_systems[0].clock
        return {
            "title": self.title,
            "duration": self.duration,
            "sample_period": clock.sample_period,
            "items": items,
            "systems": systems,
        }

    def draw(self, visualizer: Any) -> None:
        """Draw all fleets into a ``meshcat.Visualizer``."""
        for shown_system in self.shown_systems:
            if shown_system.fleet is not None:
                shown_system.fleet.mirror.draw(visualizer)

    def poses(self, values: Mapping[str, Values]) -> NDArray[np.float64]:
        """(T, K, 8) of all items at samples, from the variables of each system by its name."""
        found = []
        for shown_system, shift in zip(self.shown_systems, self._shifts, strict=True):
            if shown_system.fleet is not None:
                mirror = shown_system.fleet.mirror
                rows = shown_system.fleet.qpos(values[shown_system.system.name])
                poses = np.array([_hidden(mirror.poses(row)) for row in rows])
                poses[..., 1] += shift
                found.append(poses)
        if not found:
            samples = len(next(iter(values.values()))["action"])
            return np.zeros((samples, 0, 8))
        return found[0] if len(found) == 1 else np.concatenate(found, axis=1)

    def arrays(self, values: Mapping[str, Values]) -> Arrays:
        """What the page draws besides at samples, of all systems."""
        found: Arrays = {}
        for shown_system in self.shown_systems:
            found |= shown_system.arrays(values[shown_system.system.name])
        return found


def _beside(shown_systems: Sequence[ShownSystem]) -> list[float]:
    """How far in m along y each system is moved: lanes do not lie upon each other."""
    shifts, taken = [], None
    for shown_system in shown_systems:
        lane = None if shown_system.fleet is None else shown_system.fleet.lane
        shift = 0.0 if lane is None or taken is None else taken - APART - lane[1]
        shifts.append(shift)
        if lane is not None:
            taken = lane[0] + shift
    return shifts


def _hidden(poses: NDArray[np.float64]) -> NDArray[np.float64]:
    """Poses (K, 8) of which those that are not numbers, of agents that are away, are hidden, in the
    place of one that is there."""
    gone = ~np.all(np.isfinite(poses), axis=1)
    if np.any(gone):
        there = poses[~gone, :3]
        poses[gone] = 0.0
        poses[gone, QUATERNION.start] = 1.0
        poses[gone, POSITION] = there[0] if len(there) else 0.0
    return poses
