"""Stored results: readable without this package, whole, and never written over."""

import json
import subprocess
import sys
from importlib.metadata import version

import numpy as np
import pytest

from gne_mj.errors import InvalidInput
from gne_mj.scenario import load_scenario, run
from gne_mj.trajectory import Trajectory

CHANGES = {
    "simulation.duration": 1.0,
    "simulation.seed": 7,
    "systems.robots.plant.engine": "ode",
    "systems.robots.agents.main_mass": [1.0, 1.5, 2.0, 1.0, 1.0],
}
TIMES = 21

# name: (dimensions, units, type)
COMMON = {
    "time": (("time",), "s"),
    "constraint": (("time", "constraint"), None),
    "state": (("time", "agent", "component"), "m, m/s, m/s, m"),
}
ROBOTS = {
    **COMMON,
    "action": (("time", "agent"), "m/s"),
    "input": (("time", "agent"), "N"),
    "position": (("time", "agent"), "m"),
    "extension": (("time", "agent"), "m"),
    "gap": (("time", "agent"), "m/s"),
    "gap_bound": (("agent",), "m/s"),
    "gap_lower_bound": (("agent",), "m/s"),
    "appendage_velocity": (("time", "agent"), "m/s"),
    "equilibrium": (("agent",), "m/s"),
}
CHANNELS = {
    **COMMON,
    "action": (("time", "agent"), "mW"),
    "input": (("time", "agent"), "mW/s"),
    "state": (("time", "agent", "component"), "mW, mW"),
    "estimate": (("time", "estimating_agent", "agent"), "mW"),
    "filtered_action": (("time", "agent"), "mW"),
    "total_power": (("time",), "mW"),
    "total_power_bound": ((), "mW"),
    "equilibrium": (("agent",), "mW"),
}


@pytest.fixture(scope="module")
def trajectory():
    return run("paper", CHANGES)


@pytest.fixture(scope="module")
def stored(trajectory, tmp_path_factory):
    return trajectory.save(tmp_path_factory.mktemp("stored") / "trajectory.zarr")


READER = """
import json, sys
import xarray
tree = xarray.open_datatree(sys.argv[1], engine="zarr")
tree.load()
groups = {}
for name, group in tree.children.items():
    data = group.to_dataset()
    groups[name] = {
        "attributes": {key: str(value) for key, value in data.attrs.items()},
        "variables": {
            key: [list(v.dims), v.attrs.get("units"), str(v.dtype), v.dtype.kind]
            for key, v in data.variables.items()
        },
        "sum": float(data["action"].sum()),
        "names": [str(name) for name in data["constraint_name"].values],
    }
strange = [name for name in sys.modules if name.split(".")[0] in ("gne_mj", "numba", "mujoco")]
print(json.dumps([groups, {k: str(v) for k, v in tree.attrs.items()}, strange]))
"""


@pytest.fixture(scope="module")
def elsewhere(stored, tmp_path_factory):
    """What xarray alone reads, in a process of its own."""
    done = subprocess.run(
        [sys.executable, "-W", "error", "-I", "-c", READER, stored],
        cwd=tmp_path_factory.mktemp("elsewhere"), capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    assert done.stderr == ""
    groups, attributes, strange = json.loads(done.stdout)
    assert strange == []
    return groups, attributes


def test_xarray_alone_reads_it(elsewhere, trajectory):
    groups, attributes = elsewhere
    assert set(groups) == {"robots", "channels"}
    assert attributes["seed"] == "7"
    for name, group in groups.items():
        data = trajectory[name]
        assert group["sum"] == pytest.approx(float(data["action"].sum()), rel=1e-12)
        assert group["names"] == data["constraint_name"].to_numpy().tolist()
        assert group["attributes"]["status"] == "completed"
        assert "ran its 1 s inside the set" in group["attributes"]["message"]
        assert json.loads(group["attributes"]["certificate"])["status"] == "completed"
    assert groups["robots"]["attributes"]["information"] == "full"
    assert groups["channels"]["attributes"]["information"] == "distributed"


def test_only_plain_numbers_and_strings(elsewhere, trajectory):
    for group in elsewhere[0].values():
        for name, (_, _, dtype, kind) in group["variables"].items():
            assert dtype in ("float64", "int64") or kind in "UT", f"{name}: {dtype}"
    for name in ("robots", "channels"):
        for variable in trajectory[name].variables.values():
            assert variable.dtype.kind in "fiUT"
            if variable.dtype.kind == "f":
                assert variable.dtype == np.float64


def test_nothing_stored_is_pickled(stored):
    headers = [json.loads(path.read_text()) for path in stored.rglob(".zarray")]
    assert len(headers) > 20
    for header in headers:
        assert "|O" not in json.dumps(header["dtype"])
        assert "pickle" not in json.dumps(header)


@pytest.mark.parametrize(("system", "expected"), [("robots", ROBOTS), ("channels", CHANNELS)])
def test_dimensions_and_units(elsewhere, trajectory, system, expected):
    data = trajectory[system]
    for name, (dimensions, units) in expected.items():
        assert data[name].dims == dimensions, name
        assert data[name].attrs.get("units") == units, name
        stored = elsewhere[0][system]["variables"][name]
        assert (tuple(stored[0]), stored[1]) == (dimensions, units), name
    count = {"robots": 5, "channels": 10}[system]
    assert data.sizes["time"] == TIMES
    assert data.sizes["agent"] == count
    assert data.sizes["constraint"] == {"robots": 5, "channels": 11}[system]
    assert np.allclose(data["time"], 0.05 * np.arange(TIMES))
    assert data["agent"].to_numpy().tolist() == list(range(1, count + 1))
    assert data["component"].to_numpy().tolist()[:1] == [
        {"robots": "extension", "channels": "action"}[system]
    ]
    assert np.all(data["constraint"] < 0)
    assert set(data.variables) >= {"agent", "component", "constraint_name"}


def test_times_are_multiples_of_the_step_to_the_bit(trajectory):
    """However the run was cut into chunks, which hangs on how fast the machine happens to be."""
    for name in ("robots", "channels"):
        assert np.array_equal(trajectory[name]["time"], 25 * np.arange(TIMES) * 0.002)


def test_what_is_recorded_fits_together(trajectory):
    robots, channels = trajectory["robots"], trajectory["channels"]
    component = {name: k for k, name in enumerate(robots["component"].to_numpy())}
    for name, key in (("action", "velocity"), ("position", "position"), ("extension", "extension")):
        assert np.array_equal(robots[name], robots["state"][:, :, component[key]])
    y = robots["action"].to_numpy()
    gap = np.diff(y, axis=1, prepend=3.0)
    assert np.array_equal(robots["gap"], gap)
    assert np.array_equal(robots["gap_lower_bound"], -robots["gap_bound"])
    assert np.array_equal(channels["total_power"], channels["action"].sum("agent"))
    assert float(channels["total_power_bound"]) == 2.5
    assert np.allclose(robots["constraint"], gap**2 - robots["gap_bound"].to_numpy() ** 2)
    y = channels["action"].to_numpy()
    expected = np.concatenate([-y, y.sum(axis=1, keepdims=True) - 2.5], axis=1)
    assert np.allclose(channels["constraint"], expected, rtol=0, atol=1e-13)
    estimates = channels["estimate"].to_numpy()
    assert np.array_equal(np.einsum("tii->ti", estimates), y)
    assert np.array_equal(estimates[0], np.full((10, 10), 0.2))


def test_loading_gives_the_same(stored, trajectory):
    loaded = Trajectory.load(stored)
    assert loaded.tree.identical(trajectory.tree)
    assert loaded.report() == trajectory.report()
    assert loaded.status == trajectory.status == "completed"
    assert loaded.holds
    for name in ("robots", "channels"):
        for key, variable in trajectory[name].variables.items():
            other = loaded[name].variables[key]
            assert other.attrs == variable.attrs
            assert other.dims == variable.dims
            assert np.array_equal(other.to_numpy(), variable.to_numpy())
    # in memory: the folder is not needed any more
    assert not any(v.chunks for v in loaded["robots"].variables.values())


def test_what_was_loaded_can_be_stored_again(stored, tmp_path):
    again = Trajectory.load(Trajectory.load(stored).save(tmp_path / "again"))
    assert again.tree.identical(Trajectory.load(stored).tree)


def test_nothing_is_written_over(trajectory, tmp_path):
    mine = tmp_path / "mine"
    mine.mkdir()
    (mine / "file").write_text("mine")
    with pytest.raises(InvalidInput, match="mine"):
        trajectory.save(mine)
    with pytest.raises(InvalidInput):
        trajectory.save(str(mine / "file"))
    assert [path.name for path in mine.iterdir()] == ["file"]
    assert (mine / "file").read_text() == "mine"
    saved = trajectory.save(tmp_path / "new")
    before = sorted(path.stat().st_mtime_ns for path in saved.rglob("*"))
    with pytest.raises(InvalidInput):
        trajectory.save(saved)
    assert sorted(path.stat().st_mtime_ns for path in saved.rglob("*")) == before


def test_the_scenario_is_kept_and_runs_again(stored, trajectory):
    source = json.loads(Trajectory.load(stored).tree.attrs["scenario"])
    scenario = load_scenario(source)
    assert scenario == load_scenario("paper", CHANGES)
    assert scenario.systems["robots"].agents.main_mass == [1.0, 1.5, 2.0, 1.0, 1.0]
    again = scenario.simulation_object().run()
    for name in ("robots", "channels"):
        assert again[name].drop_attrs().identical(trajectory[name].drop_attrs())
    assert again.tree.attrs["scenario"] == trajectory.tree.attrs["scenario"]


def test_versions_and_report(trajectory):
    report = trajectory.report()
    assert json.loads(json.dumps(report, allow_nan=False)) == report
    assert report["seed"] == 7
    assert report["status"] == "completed"
    assert report["wall_time"] > 0
    for name in ("gne-mj", "mujoco", "numba", "numpy", "scipy"):
        assert report["versions"][name] == version(name)
    assert report["versions"]["python"].count(".") == 2
    assert set(report["systems"]) == {"robots", "channels"}
    for system in report["systems"].values():
        assert system["message"]
        assert system["end_time"] == pytest.approx(1.0)
        assert system["steps"] > 0


def test_the_worst_status_is_the_runs():
    leaving = {
        "simulation.duration": 2.0,
        "simulation.timestep": 0.2,
        "recording.period": 0.2,
        "simulation.control_period": 0.4,
        "systems.robots.plant.engine": "ode",
        "systems.robots.controller.mode": "sampled",
        "systems.robots.initial.action": [0.01, 2.99, 3.0, 3.0, 3.0],
    }
    left = run("paper", leaving)
    statuses = {name: report["status"] for name, report in left.reports.items()}
    assert statuses == {"robots": "left_feasible_set", "channels": "completed"}
    assert left.status == "left_feasible_set"
    assert not left.holds


def test_a_run_that_left_is_stored_like_any_other(tmp_path):
    left = run(
        "velocity-sync",
        {"plant.engine": "ode", "simulation.timestep": 0.2, "recording.period": 0.2,
         "controller.mode": "sampled", "simulation.control_period": 0.4,
         "initial.action": [0.01, 2.99, 3.0, 3.0, 3.0]},
    )  # fmt: skip
    loaded = Trajectory.load(left.save(tmp_path / "left"))
    assert loaded.tree.identical(left.tree)
    assert loaded.status == "left_feasible_set"
    assert "constraint '" in loaded["robots"].attrs["message"]
    assert json.loads(json.dumps(loaded.report(), allow_nan=False))["status"] == loaded.status
