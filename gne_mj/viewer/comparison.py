"""Several runs on one clock: one scene with the systems of all, which know whose they are."""

import json
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

from gne_mj.errors import InvalidInput
from gne_mj.trajectory import Trajectory
from gne_mj.viewer.differences import differences, headings, unique
from gne_mj.viewer.replay import Recording, scenario_within, shown_systems
from gne_mj.viewer.scene import Scene
from gne_mj.viewer.shown_system import ShownSystem

if TYPE_CHECKING:
    import xarray

MOST = 4  # runs at once


def comparison_pack(
    shown: Sequence[Trajectory] | Mapping[str, Trajectory], title: str | None = None
) -> bytes:
    """The pack of several trajectories.

    Args:
        shown: at most four; by their names, or "run 1" and so on.
        title: of the page; the runs' names if left out.

    Raises:
        InvalidInput: see :func:`gne_mj.viewer.replay.replay_pack`.
    """
    named = shown if isinstance(shown, Mapping) else _numbered(shown)
    if not 1 <= len(named) <= MOST:
        raise InvalidInput("runs", len(named), f"from 1 to {MOST} can be beside each other")
    names, trajectories = list(named), list(named.values())
    scenarios = [scenario_within(trajectory) for trajectory in trajectories]
    tables = [json.loads(trajectory.source) for trajectory in trajectories]
    heads, abouts = unique(headings(names, tables)), differences(tables)
    alone = all(len(scenario.systems) == 1 for scenario in scenarios)
    systems: list[ShownSystem] = []
    whose: list[int] = []
    datasets: dict[str, xarray.Dataset] = {}
    reports: dict[str, dict[str, Any]] = {}
    runs = []
    for run, (trajectory, scenario) in enumerate(zip(trajectories, scenarios, strict=True)):
        called = {name: _called(heads[run], name, alone) for name in scenario.systems}
        systems += shown_systems(trajectory, scenario, called.__getitem__)
        whose += [run] * len(called)
        datasets |= {new: trajectory[name] for name, new in called.items()}
        reports |= {new: trajectory.reports[name] for name, new in called.items()}
        runs.append(
            {
                "name": names[run],
                "heading": heads[run],
                "about": abouts[run],
                "end": max(float(trajectory[name]["time"][-1]) for name in called),
                # what is compared with what: systems of one name, or the only ones
                "systems": {new: "" if alone else name for name, new in called.items()},
            }
        )
    duration = max(scenario.clock().duration for scenario in scenarios)
    recording = Recording(datasets, reports)
    scene = Scene(
        systems, title or " · ".join(names), duration, runs=whose, values=recording.values
    )
    about = {"runs": runs, "interventions": _interventions(heads, trajectories), "scenario": None}
    return recording.pack(scene, about)


def _numbered(trajectories: Sequence[Trajectory]) -> dict[str, Trajectory]:
    return {f"run {number}": each for number, each in enumerate(trajectories, 1)}


def _called(heading: str, name: str, alone: bool) -> str:
    """What the page calls a system of a run."""
    return heading if alone else f"{heading}: {name}"


def _interventions(
    heads: Sequence[str], trajectories: Sequence[Trajectory]
) -> list[dict[str, Any]]:
    """What was done to each run, told by its heading."""
    done = [
        {**each, "what": f"{head}: {each['what']}"}
        for head, trajectory in zip(heads, trajectories, strict=True)
        for each in trajectory.interventions
    ]
    return sorted(done, key=lambda each: float(each["time"]))
