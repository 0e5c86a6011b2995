"""A trajectory as one compressed pack: everything that a page needs to show it again."""

import json
from collections.abc import Callable, Mapping, Sequence
from itertools import pairwise
from typing import TYPE_CHECKING, Any

import numpy as np
import umsgpack
from numpy.typing import NDArray

from gne_mj.errors import InvalidInput
from gne_mj.recorded import recorded_system, sizes_of
from gne_mj.scenario import Scenario, load_scenario, scenario_of
from gne_mj.trajectory import Trajectory
from gne_mj.viewer.joints import MOST
from gne_mj.viewer.pack import packed_small
from gne_mj.viewer.scene import Scene
from gne_mj.viewer.shares import Values
from gne_mj.viewer.shown_system import Arrays, ShownSystem, is_line

if TYPE_CHECKING:
    import xarray

Shown = Trajectory | Sequence[Trajectory] | Mapping[str, Trajectory]
"""What a replay is of: a run, or several to be compared, which can have names."""

SAME = 1e-9  # s, up to which samples of several runs are at one time
SAMPLES = 6000  # of longer trajectories so many are shown, evenly chosen


def replay_pack(shown: Shown, title: str | None = None) -> bytes:
    """The pack of a trajectory, or of several on one clock.

    Args:
        shown: a trajectory, or :data:`gne_mj.viewer.comparison.MOST` of them at most, to compare.
        title: of the page; if left out the scenario's description, or the systems' or runs'
            names.

    Raises:
        InvalidInput: one holds no scenario, or the robots' own files are gone. Its game and law
            need not be there. Or there are none or too many.
    """
    if not isinstance(shown, Trajectory):
        from gne_mj.viewer.comparison import comparison_pack

        return comparison_pack(shown, title)
    scenario = scenario_within(shown)
    recording = _recording(shown, list(scenario.systems))
    scene = Scene(
        shown_systems(shown, scenario),
        title or scenario.description or ", ".join(scenario.systems),
        scenario.clock().duration,
        values=recording.values,
    )
    return recording.pack(scene, _about(shown))


def scenario_within(trajectory: Trajectory) -> Scenario:
    """The scenario that a trajectory holds.

    Raises:
        InvalidInput: it holds none.
    """
    if not trajectory.source:
        raise InvalidInput(
            "trajectory", "of no scenario", "robots are drawn from the scenario that it must hold"
        )
    return load_scenario(json.loads(trajectory.source))


def shown_systems(
    trajectory: Trajectory, scenario: Scenario, called: Callable[[str], str] = str
) -> list[ShownSystem]:
    """What a page shows of each system of a trajectory.

    Args:
        trajectory: with what was recorded.
        scenario: of it.
        called: the page's name of each.
    """
    clock, found = scenario.clock(), []
    for name, table in scenario.systems.items():
        data = trajectory[name]
        with table.naming(name):
            agents, faults = table.players(sizes_of(data))
        seed = scenario.simulation.seed
        found.append(ShownSystem(recorded_system(called(name), data, agents, faults, seed), clock))
    return found


def scene_pack(scene: Scene, trajectory: Trajectory) -> bytes:
    """The pack of a trajectory of a scene's systems.

    Raises:
        InvalidInput: its robots have other joints than the scene's.
    """
    names = [shown_system.system.name for shown_system in scene.shown_systems]
    return _recording(trajectory, names).pack(scene, _about(trajectory))


def _recording(trajectory: Trajectory, names: Sequence[str]) -> "Recording":
    return Recording({name: trajectory[name] for name in names}, trajectory.reports)


def _about(trajectory: Trajectory) -> dict[str, Any]:
    return {"interventions": trajectory.interventions, "scenario": _text(trajectory)}


class Recording:
    """What systems recorded, at the sample times of all.

    Args:
        datasets, reports: of each system by its name on the page.

    Attributes:
        time: (T,) in s.
        values: what depends on time, at these times, of each system.
    """

    def __init__(
        self, datasets: Mapping[str, "xarray.Dataset"], reports: Mapping[str, dict[str, Any]]
    ) -> None:
        self._datasets, self._reports = datasets, reports
        self.time = _times(list(datasets.values()))
        self.values = {name: _values(data, self.time) for name, data in datasets.items()}

    def pack(self, scene: Scene, about: Mapping[str, Any]) -> bytes:
        """The pack of it.

        Args:
            scene: of these systems.
            about: what the page is told besides.

        Raises:
            InvalidInput: robots have other joints than the scene's.
        """
        time, values = self.time, self.values
        arrays: Arrays = {"time": time, **scene.arrays(values)}
        for shown_system in scene.shown_systems:
            name = shown_system.system.name
            ended = float(self._datasets[name]["time"][-1])
            cut(arrays, name, time > ended + 1e-9)
            left = outcome(self._reports[name])
            if left["exit_agents"]:
                mark_outside(arrays, name, left["exit_agents"], time >= ended - 1e-9)
            arrays |= _messages(shown_system, np.minimum(time, ended))
            arrays |= _joints(shown_system, values[name])
        poses = scene.poses(values).reshape(len(time), -1)
        varies = np.flatnonzero(np.any(poses != poses[:1], axis=0))
        arrays["pose_base"] = poses[0]
        arrays["pose_columns"] = varies.astype(np.int32)
        arrays["pose_values"] = poses[:, varies]
        commands = _Commands()
        scene.draw(commands.visualizer)
        arrays["commands"] = np.frombuffer(b"".join(commands.sent), dtype=np.uint8)
        meta = {
            "kind": "replay",
            **scene.meta(),
            "outcome": {name: outcome(self._reports[name]) for name in self._datasets},
            "command_lengths": [len(command) for command in commands.sent],
            **about,
        }
        return packed_small(meta, {name: _lean(name, array) for name, array in arrays.items()})


def _text(trajectory: Trajectory) -> str | None:
    """The file of the scenario with what was done; None where no keys say it."""
    try:
        return scenario_of(trajectory).toml()
    except InvalidInput:
        return None


def outcome(report: dict[str, Any]) -> dict[str, Any]:
    """How a system's run ended, from its report."""
    worst, left = report["worst_constraint"], report["exit"]
    outside = report.get("outside")  # which older results do not have
    first = None if outside is None or not outside["exits"] else outside["first"]
    return {
        "status": report["status"],
        "message": report["message"],
        "margin": None if worst is None else worst["margin"],
        "margin_name": None if worst is None else worst["name"],
        "margin_time": None if worst is None else worst["time"],
        "exit_time": first if left is None else left["time"],
        "exit_agents": [] if left is None else left.get("agents", []),
    }


class _Commands:
    """Stands in for a meshcat window, and keeps what it is sent."""

    def __init__(self) -> None:
        from meshcat import Visualizer

        self.sent: list[bytes] = []
        self.visualizer = Visualizer(window=self)

    def send(self, command: Any) -> None:
        """Keep one of meshcat's commands."""
        self.sent.append(umsgpack.packb(command.lower()))


def _times(datasets: Sequence["xarray.Dataset"]) -> NDArray[np.float64]:
    """All times at which a system was sampled, at most SAMPLES and the last one always."""
    time = np.unique(np.concatenate([data["time"].to_numpy() for data in datasets]))
    time = time[np.diff(time, prepend=-np.inf) > SAME]  # clocks differ in their last bits
    every = -(-len(time) // SAMPLES)
    kept = np.zeros(len(time), dtype=bool)
    kept[::every] = kept[-1:] = True
    return time[kept]


def _values(data: "xarray.Dataset", time: NDArray[np.float64]) -> dict[str, NDArray[np.float64]]:
    """What depends on time, at these times: between samples interpolated, later as at the end."""
    own = data["time"].to_numpy()
    after = np.clip(np.searchsorted(own, time), 0, len(own) - 1)
    before = np.clip(after - 1, 0, None)
    length = own[after] - own[before]
    rest = np.where(length > 0, (own[after] - time) / np.where(length > 0, length, 1.0), 0.0)
    rest = np.clip(rest, 0.0, 1.0)
    found = {}
    for name, variable in data.variables.items():
        if variable.dims[:1] == ("time",) and name != "time":
            rows = variable.to_numpy()
            if rows.dtype == bool:  # as it was at the sample before
                found[str(name)] = rows[np.where(rest > 0.0, before, after)]
                continue
            weight = rest.reshape(-1, *(1,) * (rows.ndim - 1))
            mixed = rows[after] + weight * (rows[before] - rows[after])
            # exact at samples, also where a neighbour is not a number
            found[str(name)] = np.where(weight == 0.0, rows[after], mixed)
    return found


def cut(arrays: Arrays, name: str, gone: NDArray[np.bool_]) -> None:
    """No lines of a system at the samples (T,) after its end."""
    for key, array in arrays.items():
        if is_line(name, key) and np.any(gone):
            arrays[key] = array.copy()
            arrays[key][gone] = np.nan


def mark_outside(arrays: Arrays, name: str, agents: Sequence[int], rows: NDArray[np.bool_]) -> None:
    """Of these agents, from 1, more than the bound is used at these samples (T,).

    The state of the step in which an exit was seen is that of its start, which is inside, and of a
    game without quantities no share is known.
    """
    share = arrays[f"{name}/share"]
    for agent in agents:
        inside = rows & ~(share[:, agent - 1] > 1.0)
        share[inside, agent - 1] = np.inf


def _messages(shown_system: ShownSystem, time: NDArray[np.float64]) -> Arrays:
    """Messages since the sample before."""
    steps = [0, *(shown_system.clock.steps(t) for t in time)]
    rows = [shown_system.messages(*pair) for pair in pairwise(steps)]
    return {key: np.stack([row[key] for row in rows]) for key in rows[0]} if rows else {}


def _joints(shown_system: ShownSystem, values: Values) -> Arrays:
    """Numbers of the joints, unless they are many."""
    joints, samples = shown_system.joints, len(values["action"])
    if joints is None or joints.size * samples > MOST:
        return {}
    return {f"{shown_system.system.name}/joints": joints.recorded(values)}


def _lean(name: str, array: NDArray[Any]) -> NDArray[Any]:
    """What is looked at only, with the digits that can be seen; poses as they are."""
    if name.startswith("pose") or array.dtype.kind != "f" or name == "time":
        return array
    if name.endswith("/joints"):  # shown with three digits behind the point
        return _to_multiples(array, 2.0**-10).astype(np.float32)
    if name.endswith("/share"):
        near = _to_multiples(array, 2.0**-11)
        crossed = (near > 1.0) != (array > 1.0)  # what is outside stays so
        return np.where(crossed, array, near).astype(np.float32)
    return _rounded(array.astype(np.float32), bits=9 if name.endswith("/estimate") else 0)


def _to_multiples(array: NDArray[np.floating[Any]], unit: float) -> NDArray[np.floating[Any]]:
    """The nearest multiples of a power of two: few binary digits, which compress."""
    return np.round(array / unit) * unit


def _rounded(array: NDArray[np.float32], bits: int) -> NDArray[np.float32]:
    """Without the last so many of the 23 binary digits."""
    return (array.view(np.uint32) & np.uint32(0xFFFFFFFF << bits & 0xFFFFFFFF)).view(np.float32)
