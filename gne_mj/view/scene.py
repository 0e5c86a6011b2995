"""All of a page's systems together: what is drawn once, and arrays for instants or samples."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gne_mj.view.stage import Arrays, Stage, Values

ROOT = "meshcat"  # where a meshcat.Visualizer draws everything


class Scene:
    """What a page shows of several systems.

    Args:
        stages: one a system.
        title: of the page.
        duration: of the run, in s.
    """

    def __init__(self, stages: Sequence[Stage], title: str, duration: float) -> None:
        self.stages, self.title, self.duration = stages, title, duration

    def meta(self) -> dict[str, Any]:
        """What JSON tells the page of the scene; see :mod:`gne_mj.view`."""
        items: list[str] = []
        systems = []
        for stage in self.stages:
            about = stage.meta()
            if stage.fleet is not None:
                about["anchors"] = [len(items) + anchor for anchor in about["anchors"]]
                about["tints"] = [[f"{ROOT}/{path}" for path in each] for each in about["tints"]]
                items.extend(f"{ROOT}/{item}" for item in stage.fleet.mirror.items)
            systems.append(about)
        clock = self.stages[0].clock
        return {
            "title": self.title,
            "duration": self.duration,
            "sample_period": clock.sample_period,
            "items": items,
            "systems": systems,
        }

    def draw(self, visualizer: Any) -> None:
        """Draw all fleets into a ``meshcat.Visualizer``."""
        for stage in self.stages:
            if stage.fleet is not None:
                stage.fleet.mirror.draw(visualizer)

    def poses(self, values: Mapping[str, Values]) -> NDArray[np.float64]:
        """(T, K, 8) of all items at samples, from the variables of each system by its name."""
        found = []
        for stage in self.stages:
            if stage.fleet is not None:
                mirror = stage.fleet.mirror
                rows = stage.fleet.qpos(values[stage.system.name])
                found.append(np.stack([mirror.poses(row) for row in rows]))
        if not found:
            samples = len(next(iter(values.values()))["action"])
            return np.zeros((samples, 0, 8))
        return found[0] if len(found) == 1 else np.concatenate(found, axis=1)

    def arrays(self, values: Mapping[str, Values]) -> Arrays:
        """What the page draws besides at samples, of all systems."""
        found: Arrays = {}
        for stage in self.stages:
            found |= stage.arrays(values[stage.system.name])
        return found
