"""Modes and schedules are registered things: one more is known everywhere."""

from typing import Annotated

import numpy as np
import pytest
from builders import FIVE, robot_state, robot_system
from pydantic import BaseModel, ValidationError

import gne_mj
from gne_mj.barrier import Fall, Schedule, reciprocal
from gne_mj.batch_variables import declared_figures, figures
from gne_mj.errors import InvalidInput
from gne_mj.exit_map import held_modes
from gne_mj.native import kernel
from gne_mj.registry import MODES, SCHEDULES, Names
from gne_mj.scenario import load_scenario
from gne_mj.system import Clock, mode_of
from gne_mj.system.modes import Figure, Sampled
from gne_mj.system.modes.mode import entry
from gne_mj.theory import certify
from gne_mj.theory.trials import search_period

SHORT = {
    "simulation.duration": 0.2, "simulation.control_period": 0.01, "plant.engine": "ode",
    "simulation.integrator": "euler",
}  # fmt: skip


class Counted(Sampled):
    """Mode sampled, which says how many steps it took."""

    name = "counted"
    section = "counted"
    figures = (Figure("counted_steps", entry("steps"), "1", "steps taken"),)

    def report(self, system, monitor):
        return {"steps": int(monitor.steps)}


@kernel
def square_root(start, elapsed):
    return start / np.sqrt(1.0 + elapsed)


@pytest.fixture
def counted(monkeypatch):
    monkeypatch.setattr(MODES, "_things", dict(MODES._things))
    return MODES.register(Counted())


def test_a_mode_more_runs_from_a_scenario_and_is_reported(counted):
    found = {
        mode: gne_mj.run("velocity-sync", {**SHORT, "controller.mode": mode})
        for mode in ("sampled", "counted")
    }
    for name in ("action", "input", "state"):
        of = [each["robots"][name].to_numpy() for each in found.values()]
        assert np.array_equal(*of)
    reports = {mode: each.reports["robots"] for mode, each in found.items()}
    assert found["counted"]["robots"].attrs["mode"] == "counted"
    assert reports["counted"]["counted"] == {"steps": reports["counted"]["steps"]}
    assert reports["sampled"]["counted"] is None
    for section in ("division", "implicit"):
        assert reports["counted"][section] is None


def test_a_mode_more_is_certified_mapped_and_kept_by_batches(counted):
    scenario = load_scenario("velocity-sync", {**SHORT, "controller.mode": "counted"})
    (system,) = scenario.system_objects()
    assert mode_of(system) is counted
    told = certify(system, scenario.clock())
    assert told.status == "not certified"
    assert told.periods["control_period"] == 0.01
    assert any("mode 'counted'" in line for line in told.not_certified)
    assert search_period(system, scenario.clock()).trials
    assert held_modes() == ["sampled", "implicit", "counted"]
    assert "counted_steps" in {figure.name for figure in declared_figures(system)}
    (other,) = load_scenario("velocity-sync", SHORT).system_objects()
    assert "counted_steps" not in {figure.name for figure in declared_figures(other)}
    assert len({figure.name for figure in figures()}) == len(figures())


def test_figures_of_modes_are_of_the_systems_whose_runs_report_them():
    """Divided steps where steps are fixed, solutions where inputs are solved for."""
    for mode, integrator, expected in (
        ("continuous", "rk4", {"divided_steps", "smallest_step"}),
        ("continuous", "euler", {"divided_steps", "smallest_step"}),
        ("sampled", "rk4", set()),
        ("implicit", "euler", {"solutions", "newton_steps", "not_accurate", "prediction_error",
                               "periods_not_monotone"}),
    ):  # fmt: skip
        system = robot_system(robot_state(FIVE), mode=mode, integrator=integrator)
        of_modes = {figure.name for each in MODES for figure in each.figures}
        found = {figure.name for figure in declared_figures(system)} & of_modes
        assert found == expected
        division = certify(system, Clock(0.1, 0.01, 0.01, 0.1)).division
        assert (division is not None) == (mode == "continuous")


def test_a_mode_that_there_is_not_is_refused():
    with pytest.raises(InvalidInput, match=r"^mode: got 'sampeld', but did you mean 'sampled'\?"):
        robot_system(robot_state(FIVE), mode="sampeld")
    for mode in ("sampeld", 3):
        with pytest.raises(InvalidInput, match=r"controller\.mode: got"):
            load_scenario("velocity-sync", {"controller.mode": mode})


def test_a_schedule_more_is_what_the_law_and_the_results_have(monkeypatch):
    monkeypatch.setattr(SCHEDULES, "_things", dict(SCHEDULES._things))
    SCHEDULES.register(Fall("square-root", square_root))
    changes = {
        "simulation.duration": 0.2, "recording.period": 0.02, "plant.engine": "ode",
        "controller.mode": "sampled", "simulation.control_period": 0.02,
        "barrier": {"rho": 0.5, "schedule": "square-root", "time_constant": 0.05, "floor": 0.3},
    }  # fmt: skip
    data = gne_mj.run("velocity-sync", changes)["robots"]
    (system,) = load_scenario("velocity-sync", changes).system_objects()
    time = data["time"].to_numpy()
    penalty = np.maximum(0.5 / np.sqrt(1.0 + time / 0.05), 0.3)
    assert np.allclose(data["penalty"], penalty, rtol=1e-14, atol=0)
    game, y = system.game, data["action"].to_numpy()
    for k in range(len(time) - 1):
        weights = penalty[k] / -game.constraints(y[k])
        force = game.pseudo_gradient(y[k]) + weights @ game.constraint_jacobian(y[k])
        assert np.allclose(data["input"][k], -force, rtol=1e-9, atol=1e-12)


def test_the_kinds_of_schedules_are_those_that_are_registered():
    assert [fall.name for fall in SCHEDULES] == ["exponential", "reciprocal", "halving"]
    with pytest.raises(
        InvalidInput, match=r"^kind: got 'recipocal', but did you mean 'reciprocal'"
    ):
        Schedule("recipocal", 1.0, 0.1, 1.0)
    with pytest.raises(InvalidInput, match=r"barrier\.schedule: got 'half', but"):
        load_scenario("velocity-sync", {"barrier.schedule": "half"})


def test_a_name_is_registered_once_and_an_annotation_takes_those_of_its_time():
    names = Names("kind")

    class Model(BaseModel):
        kind: Annotated[str, names]

    names.register(Fall("first", reciprocal))
    assert Model(kind="first").kind == "first"
    with pytest.raises(ValidationError, match="'first'"):
        Model(kind="second")
    names.register(Fall("second", reciprocal))
    assert Model(kind="second").kind == "second"
    with pytest.raises(InvalidInput, match=r"^kind: got 'first', but another one has this name"):
        names.register(Fall("first", reciprocal))
