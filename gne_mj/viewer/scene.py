"""All of a page's systems together: what is drawn once, and arrays for instants or samples."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gne_mj.palette import PALETTE
from gne_mj.viewer.beside import shifts_of
from gne_mj.viewer.shares import Values
from gne_mj.viewer.shown_system import Arrays, ShownSystem

ROOT = "meshcat"  # where a meshcat.Visualizer draws everything


class Scene:
    """What a page shows of several systems.

    Args:
        shown_systems: one a system.
        title: of the page.
        duration: of the run, in s.
        runs: which run each system is of, from 0, where several are compared; all of one if left
            out.
        values: what is known of each system by its name over a run, so that none is drawn upon
            another one; if left out by how they start.
    """

    def __init__(
        self,
        shown_systems: Sequence[ShownSystem],
        title: str,
        duration: float,
        *,
        runs: Sequence[int] | None = None,
        values: Mapping[str, Values] | None = None,
    ) -> None:
        self.shown_systems, self.title, self.duration = shown_systems, title, duration
        self._runs = [0] * len(shown_systems) if runs is None else list(runs)
        shifts, beside = shifts_of(shown_systems, self._runs, values)
        self._shifts, self._beside = shifts.tolist(), beside.tolist()

    def meta(self) -> dict[str, Any]:
        """What JSON tells the page of the scene; see :mod:`gne_mj.viewer`."""
        items: list[str] = []
        systems = []
        for k, shown_system in enumerate(self.shown_systems):
            about = shown_system.meta()
            about["run"] = self._runs[k]
            about["shift"], about["beside"] = self._shifts[k], self._beside[k]
            about["items"] = [len(items), 0]
            if shown_system.fleet is not None:
                about["world"] = f"{ROOT}/{shown_system.fleet.mirror.world}"
                about["items"][1] = len(shown_system.fleet.mirror.items)
                about["anchors"] = [len(items) + anchor for anchor in about["anchors"]]
                about["tints"] = [[f"{ROOT}/{path}" for path in each] for each in about["tints"]]
                items.extend(f"{ROOT}/{item}" for item in shown_system.fleet.mirror.items)
            systems.append(about)
        clock = self.shown_systems[0].clock
        return {
            "title": self.title,
            "palette": PALETTE,
            "duration": self.duration,
            "sample_period": clock.sample_period,
            "items": items,
            "systems": systems,
        }

    def draw(self, visualizer: Any) -> None:
        """Draw all fleets into a ``meshcat.Visualizer``."""
        sent: set[str] = set()
        for shown_system in self.shown_systems:
            if shown_system.fleet is not None:
                shown_system.fleet.mirror.draw(visualizer, sent)

    def poses(self, values: Mapping[str, Values]) -> NDArray[np.float64]:
        """(T, K, 8) of all items at samples, from the variables of each system by its name."""
        found = []
        for shown_system, shift in zip(self.shown_systems, self._shifts, strict=True):
            if shown_system.fleet is not None:
                rows = shown_system.fleet.qpos(values[shown_system.system.name])
                found.append(shown_system.fleet.mirror.samples(rows, shift))
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
