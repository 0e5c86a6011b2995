"""Every signal is declared once, and all that shows a run reads that declaration."""

import json

import numpy as np
import pytest
from batch_plans import small

import gne_mj
from gne_mj import plots, signals
from gne_mj.batch_variables import declared_figures, figures
from gne_mj.batches import execute
from gne_mj.batches.report import summary, write_report
from gne_mj.scenario import load_scenario
from gne_mj.signals import SIGNALS, declared
from gne_mj.variables import AXIS, Column, Panel, Variable
from gne_mj.viewer import Session, replay_pack
from gne_mj.viewer.pack import unpack

SHORT = {"simulation.duration": 0.2}
COORDINATES = {"time", "agent", "constraint_name", "component", "owner", "axis"}
OF_BATCHES = {"run", "start", "seed", "barrier.rho"}


def declarations(system):
    """(dimensions, attributes) by name, of what is sampled or a number of a system."""
    found = {}
    for variable in declared(system):
        dimensions, attributes = variable.dims(system), variable.attributes(system)
        found[variable.name] = dimensions, attributes
        for name in variable.bounds(system):
            units = {k: v for k, v in attributes.items() if k == "units"}
            found[name] = tuple(d for d in dimensions if d != "time"), units
    return found


def assert_declared(data, declarations):
    assert set(data.variables) - COORDINATES - OF_BATCHES == set(declarations)
    for name, (dimensions, attributes) in declarations.items():
        assert data[name].dims == dimensions, name
        assert data[name].attrs == attributes, name


@pytest.mark.parametrize(
    ("scenario", "changes", "some"),
    [
        ("velocity-sync", {**SHORT, "plant.engine": "ode", "barrier.schedule": "halving"},
         {"gap", "gap_bound", "position", "penalty"}),
        ("osnr", SHORT, {"estimate", "filtered_action", "total_power_bound"}),
        ("disturbed", SHORT, {"measurement", "acting_input", "tightening"}),
        ("planar-sync", SHORT, {"position", "gap"}),
    ],
)  # fmt: skip
def test_every_variable_of_a_trajectory_is_declared(scenario, changes, some):
    trajectory = gne_mj.run(scenario, changes)
    for system in load_scenario(scenario, changes).system_objects():
        expected = declarations(system)
        assert some <= set(expected)
        assert_declared(trajectory[system.name], expected)


def test_every_variable_of_a_batch_is_declared(tmp_path):
    store = small(tmp_path, record=1, starts=1)
    execute(store, threads=1)
    system = store.plan.combination(0).system
    expected = {
        figure.name: (figure.dims(system), figure.attributes(system))
        for figure in declared_figures(system)
    }
    once = {each.name for each in declared(system) if not each.batch}
    expected |= {
        name: (("run", *dimensions), attributes)
        for name, (dimensions, attributes) in declarations(system).items()
        if name not in once
    }
    data = store.dataset()
    assert_declared(data, expected)
    assert "state" not in data
    assert data["equilibrium"].dims == ("run", "agent")


def test_no_name_is_declared_twice():
    names = [figure.name for figure in figures()]
    assert len(set(names)) == len(names)
    for system in load_scenario("paper").system_objects():
        names = [variable.name for variable in declared(system)]
        assert len(set(names)) == len(names)


# --------------------------------------------------------------------- a signal more, in one place


def power(rows):
    return rows.samples.input * rows.y


POWER = Variable(
    "delivered_power",
    ("time", AXIS),
    power,
    there=lambda system: system.agents.kind.INPUT_UNIT == "N",
    unit="W",
    long_name="delivered power",
    symbol="u_i y_i",
    bounds=lambda system: {"delivered_power_bound": np.full(system.game.actions, 90.0)},
    instant=False,
    figure=True,
    page="line",
    runs=(
        Variable(
            "peak_power",
            ("run",),
            lambda runs: np.max(np.abs(runs.of(power)), axis=(1, 2)),
            unit="W",
            panel=Panel("peak power", log=False, worst="max"),
            columns=(Column("peak_power_max", "peak power", lambda values: values.max()),),
        ),
    ),
)


PARTIAL = {"information": "partial", "graph": "line", "coupling": 5.0, "time_constant": 0.1}


@pytest.mark.parametrize(
    ("scenario", "changes"),
    [
        ("velocity-sync", {"plant.engine": "ode"}),
        ("velocity-sync", {"plant.engine": "ode", "controller": PARTIAL}),
    ],
)
def test_recorded_v_is_the_monitors(scenario, changes):
    """At the run's two ends, of which the monitor's kernels tell V without any record."""
    run = gne_mj.run(scenario, {**SHORT, **changes})
    ((name, report),) = run.reports.items()
    seen, recorded = report["lyapunov"], run[name]["lyapunov"].to_numpy()
    assert recorded[[0, -1]] == pytest.approx([seen["start"], seen["final"]], rel=1e-9)


@pytest.fixture
def more(monkeypatch):
    monkeypatch.setattr(signals, "SIGNALS", (*SIGNALS, POWER))


@pytest.mark.usefixtures("more")
def test_a_signal_more_is_in_trajectories_replays_and_figures():
    trajectory = gne_mj.run("velocity-sync", {**SHORT, "plant.engine": "ode"})
    data = trajectory["robots"]
    values = data["input"].to_numpy() * data["action"].to_numpy()
    assert np.array_equal(data["delivered_power"], values)
    assert data["delivered_power"].dims == ("time", "agent")
    about = {"units": "W", "long_name": "delivered power", "symbol": "u_i y_i"}
    assert data["delivered_power"].attrs == about
    assert data["delivered_power_bound"].to_numpy().tolist() == [90.0] * 5
    assert json.loads(data.attrs["quantities"]) == ["gap", "constraint", "delivered_power"]

    meta, arrays = unpack(replay_pack(trajectory))
    line = meta["systems"][0]["quantities"][-1]
    assert (line["name"], line["unit"]) == ("delivered_power", "W")
    assert line["labels"] == ["1", "2", "3", "4", "5"]
    assert line["bound"] == [90.0] * 5
    shown = arrays["robots/quantity/delivered_power"]
    assert shown == pytest.approx(values, rel=1e-6)

    figures = plots.draw(trajectory)
    names = ["velocities", "gaps", "constraints", "delivered-powers"]
    assert list(figures) == [f"robots-{name}" for name in names]
    (axes,) = figures["robots-delivered-powers"].axes
    assert axes.get_ylabel() == "delivered power $u_i y_i$ (W)"
    assert [line.get_ydata().tolist() for line in axes.lines[:5]] == values.T.tolist()
    assert axes.lines[5].get_ydata() == [90.0, 90.0]


@pytest.mark.usefixtures("more")
def test_a_signal_is_of_the_systems_that_have_it_and_so_are_its_figures():
    for system in load_scenario("paper").system_objects():
        has = system.name == "robots"
        assert ("delivered_power" in [each.name for each in declared(system)]) == has
        assert ("peak_power" in [each.name for each in declared_figures(system)]) == has
    assert "peak_power" in [each.name for each in figures()]


@pytest.mark.usefixtures("more")
def test_a_signal_more_has_a_panel_for_each_axis_of_its_agents():
    trajectory = gne_mj.run("planar-sync", SHORT)
    data = trajectory["robots"]
    assert data["delivered_power"].dims == ("time", "action")
    drawn = plots.draw(trajectory)["robots-delivered-powers"].axes
    assert [axes.get_ylabel() for axes in drawn] == [
        f"delivered power $u_{{i,{axis}}} y_{{i,{axis}}}$ (W)" for axis in "xy"
    ]
    for axes, axis in zip(drawn, "xy", strict=True):
        mine = data["delivered_power"].to_numpy()[:, data["axis"].to_numpy() == axis]
        assert [line.get_ydata().tolist() for line in axes.lines[:6]] == mine.T.tolist()
    system = unpack(replay_pack(trajectory))[0]["systems"][0]
    labels = system["quantities"][-1]["labels"]
    assert labels[:3] == ["1 x", "1 y", "2 x"]
    assert len(labels) == 12


@pytest.mark.usefixtures("more")
def test_a_signal_more_is_on_the_live_page_as_it_was_last_recorded():
    scenario = load_scenario("velocity-sync", {**SHORT, "plant.engine": "ode"})
    session = Session(scenario, "a title")
    try:
        (system,) = session._scene.meta()["systems"]
        names = [each["name"] for each in system["quantities"]]
        assert names == ["gap", "constraint", "lyapunov", "delivered_power"]
        key = "robots/quantity/delivered_power"
        assert key not in unpack(session._frame())[1]  # nothing is recorded yet
        session._move(60)  # samples at 0, 0.05 and 0.1 s
        now, history = (unpack(pack)[1] for pack in (session._frame(), session._history()))
        trajectory = session.simulation.trajectory()
    finally:
        session.server.close()
    recorded = trajectory["robots"]["delivered_power"].to_numpy()
    assert np.array_equal(history[key], recorded[:3])
    assert np.array_equal(now[key], recorded[2])
    assert np.array_equal(now["robots/action"], trajectory["robots"]["action"][3])  # of 0.12 s


def test_a_frame_is_of_the_numbers_of_now():
    changes = {**SHORT, "plant.engine": "ode"}
    session = Session(load_scenario("velocity-sync", changes), "a title")
    try:
        session._move(10)
        before = unpack(session._frame())[1]["robots/quantity/gap"]
        key = "systems.robots.game.reference_velocity"
        session._do({"do": "set", "key": key, "value": 3.25}, None)
        after = unpack(session._frame())[1]["robots/quantity/gap"]
    finally:
        session.server.close()
    assert after - before == pytest.approx([-0.25, 0.0, 0.0, 0.0, 0.0])


@pytest.mark.usefixtures("more")
def test_a_signal_more_is_in_batches_tables_and_figures(tmp_path):
    store = small(tmp_path, record=1, starts=2)
    execute(store, threads=1)
    runs = store.dataset()
    power = runs["input"] * runs["action"]
    assert np.array_equal(runs["delivered_power"], power)
    assert runs["delivered_power_bound"].dims == ("run", "agent")
    assert np.array_equal(runs["peak_power"], np.abs(power).max(("time", "agent")))
    report = write_report(store, tmp_path, ("svg",), replace=False)
    table = report.table.set_index("barrier.rho")["peak_power_max"]
    expected = runs["peak_power"].groupby("barrier.rho").max()
    assert table.to_numpy() == pytest.approx(expected.to_numpy())
    assert "peak power" in next(summary(report.table, ["barrier.rho"]))
    assert "peak power (W)" in (tmp_path / "summary.svg").read_text()
