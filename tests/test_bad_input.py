"""Bad input ends in one clear sentence, a non-zero exit status, and nothing half-written."""

import json
import re

import pytest

from gne_mj.cli import main
from gne_mj.errors import InfeasibleStart, InvalidInput
from gne_mj.scenario import load_scenario, parse_value, shipped

# what is set, then what the sentence must contain
CASES = {
    "start on the boundary": (
        "velocity-sync",
        ["initial.action=[0, 0, 0, 0, 0]"],
        ["initial.action", "initial velocity [0.0, 0.0", "gap of agent 1", "margin 0"],
    ),
    "start outside": (
        "velocity-sync",
        ["initial.action=[3, 3, -1, 0, 0]"],
        ["gap of agent 3", "g = 7", "margin -7", "must be negative"],
    ),
    "power start outside": (
        "osnr",
        ["systems.channels.initial.action=0.25"],
        ["total power", "margin"],
    ),
    "unknown key": ("velocity-sync", ["barrier.roh=0.1"], ["barrier.roh", "0.1", "'rho'"]),
    "unknown table": ("velocity-sync", ["barier.rho=0.1"], ["barier.rho", "'barrier'"]),
    "unknown simulation key": (
        "velocity-sync",
        ["simulation.time_step=0.1"],
        ["simulation.time_step", "'timestep'"],
    ),
    "unknown scenario": ("velocity-snc", [], ["velocity-snc", "'velocity-sync'"]),
    "missing file": ("nothing.toml", [], ["nothing.toml", "cannot be read"]),
    "unknown system": ("paper", ["systems.robot.barrier.rho=1"], ["'robots'"]),
    "system needed": ("paper", ["barrier.rho=1"], ["barrier.rho", "robots, channels"]),
    "negative mass": (
        "velocity-sync",
        ["agents.main_mass=[1, 1, -1, 1, 1]"],
        ["systems.robots.agents.main_mass", "-1", "positive"],
    ),
    "zero mass": ("velocity-sync", ["agents.appendage_mass=0"], ["appendage_mass", "positive"]),
    "negative damping": ("velocity-sync", ["agents.damping=-1"], ["agents.damping", "-1"]),
    "floor without schedule": (
        "velocity-sync",
        ["barrier.floor=0.01"],
        ["systems.robots.barrier.floor", "0.01", "barrier.schedule"],
    ),
    "alone where nothing is solved": (
        "velocity-sync",
        ["controller.decentralised=true"],
        ["controller.decentralised", "mode 'implicit'"],
    ),
    "fault of nobody": (
        "velocity-sync",
        ["faults=[{type='push', force=1.0, agents=[]}]"],
        ["systems.robots.faults.0.agents", "at least 1"],
    ),
    "fault of an unknown kind": (
        "velocity-sync",
        ["faults=[{type='shove', force=1.0}]"],
        ["systems.robots.faults.0.type", "'shove'", "push, saturation"],
    ),
    "rho zero": ("velocity-sync", ["barrier.rho=0"], ["barrier.rho", "0", "greater than 0"]),
    "delta zero": ("velocity-sync", ["game.gap_bound=0"], ["game.gap_bound", "0", "positive"]),
    "delta negative": (
        "velocity-sync",
        ["game.gap_bound=[3,3,3,3,-3]"],
        ["game.gap_bound", "-3", "positive"],
    ),
    "wrong length": (
        "velocity-sync",
        ["agents.stiffness=[1, 2]"],
        ["agents.stiffness", "[1.0, 2.0]", "list of 5"],
    ),
    "wrong length of start": (
        "velocity-sync",
        ["initial.action=[1, 2]"],
        ["initial.action", "list of 5"],
    ),
    "wrong number of channels": ("osnr", ["agents.count=9"], ["10 channels", "agents.count is 9"]),
    "not connected": (
        "osnr",
        ["controller.graph=[[1,2],[3,4]]"],
        ["controller.graph", "connected", "agent 1 cannot reach agents 3"],
    ),
    "edge out of range": (
        "osnr",
        ["controller.graph=[[1,11]]"],
        ["controller.graph", "[1, 11]", "1 to 10"],
    ),
    "wrong graph": (
        "osnr",
        ["controller.graph=sun"],
        ["systems.channels.controller.graph: got 'sun'"],
    ),
    "graph of another size": ("osnr", ["agents.count=3", "controller.graph=printed"], ["3"]),
    "nan": ("velocity-sync", ["barrier.rho=nan"], ["barrier.rho", "nan", "finite"]),
    "nan in a list": (
        "velocity-sync",
        ["initial.action=[1,0,nan,0.5,2]"],
        ["initial.action", "nan", "finite"],
    ),
    "infinite": ("velocity-sync", ["simulation.duration=inf"], ["simulation.duration", "finite"]),
    "timestep and control period": (
        "velocity-sync",
        ["simulation.control_period=0.005"],
        ["simulation.control_period", "0.005", "multiple of the timestep 0.002"],
    ),
    "timestep and recording": (
        "velocity-sync",
        ["recording.period=0.003"],
        ["recording.period", "0.003", "multiple"],
    ),
    "timestep and duration": (
        "velocity-sync",
        ["simulation.duration=1.001"],
        ["simulation.duration", "1.001", "multiple"],
    ),
    "a word for a number": ("velocity-sync", ["barrier.rho=small"], ["barrier.rho", "small"]),
    "unknown type": (
        "velocity-sync",
        ["game.type=velocity-synchronisation"],
        ["game.type", "'velocity-synchronization'"],
    ),
    "unknown information": (
        "velocity-sync",
        ["controller.information=ful"],
        ["controller.information", "'full'"],
    ),
    "unknown engine": ("velocity-sync", ["plant.engine=mujocco"], ["plant.engine", "'mujoco'"]),
    "PI cascade in MuJoCo": (
        "osnr",
        ["plant.engine=mujoco"],
        ["plant.engine", "mujoco", "'ode'"],
    ),
    "integral gain": ("osnr", ["agents.integral_gain=1"], ["integral_gain", "0 < k < v"]),
    "rosenbrock for a static law": (
        "velocity-sync",
        ["plant.engine=ode", "plant.integrator=rosenbrock"],
        ["plant.integrator", "rosenbrock"],
    ),
    "epsilon missing": (
        "velocity-sync",
        ['controller={information="distributed"}'],
        ["controller.epsilon", "must be given"],
    ),
    "a step too long for the estimates": (
        "osnr",
        ["controller.epsilon=0.001", "plant.integrator=rk4"],
        ["simulation.timestep", "0.002", "rosenbrock", "sampled"],
    ),
    "a ragged matrix": (
        "osnr",
        ["game.system_matrix=[[0, 1], [0]]"],
        ["game.system_matrix", "one length"],
    ),
    "a number for a table": ("velocity-sync", ["barrier=1"], ["barrier", "must be a table"]),
    "a position that is no number": (
        "cars",
        ["agents.poses=[[nan, 0, 0], [1, 0, 0], [2, 0, 0], [3, 0, 0]]"],
        ["agents.poses.0.0: got nan", "finite number"],
    ),
    "a reading of nothing that there is": (
        "cars",
        [
            'agents.input={controller="custom", file="x.py", actuators=["drive_left"],'
            ' readings=[{body="car", value="speed"}]}'
        ],
        ["agents.input.readings.0.value: got 'speed'"],
    ),
    "a margin for pushes of MJCF robots": (
        "cars",
        ["margin.push=1.0"],
        ["systems.cars.margin: got 'pushes'", "for noise"],
    ),
    "a margin of MJCF robots under a guard": (
        "cars",
        ["margin.noise=0.01", 'controller.between="guarded"'],
        ["systems.cars.controller.between: got 'guarded'", "leave one of both out"],
    ),
    "set without a value": ("velocity-sync", ["barrier.rho"], ["--set", "KEY=VALUE"]),
    "a state that robots lack": ("velocity-sync", ["initial.integral=1"], ["initial.integral"]),
}


@pytest.mark.parametrize("case", CASES)
def test_one_sentence_and_nothing_written(case, tmp_path, capsys, monkeypatch):
    scenario, changes, expected = CASES[case]
    out = tmp_path / "run"
    arguments = ["gne-mj", "run", scenario, "--out", str(out)]
    monkeypatch.setattr("sys.argv", [*arguments, *(f"--set={change}" for change in changes)])
    with pytest.raises(SystemExit) as ended:
        main()
    assert ended.value.code == 2
    stdout, stderr = capsys.readouterr()
    assert stdout == ""
    assert stderr.startswith("gne-mj: ")
    assert stderr.count("\n") == 1
    assert "Traceback" not in stderr
    for words in expected:
        assert words in stderr, stderr
    assert list(tmp_path.iterdir()) == []


def test_infeasible_start_names_its_status(capsys, monkeypatch):
    arguments = "gne-mj run velocity-sync --json --set initial.action=0"
    monkeypatch.setattr("sys.argv", arguments.split())
    with pytest.raises(SystemExit) as ended:
        main()
    assert ended.value.code == 2
    stdout, stderr = capsys.readouterr()
    assert json.loads(stdout)["status"] == "infeasible_start"
    assert "infeasible_start" in stderr


def test_an_existing_folder_is_left_alone(tmp_path, capsys, monkeypatch):
    (tmp_path / "mine.txt").write_text("mine")
    for command in ("run velocity-sync", "paper"):
        monkeypatch.setattr("sys.argv", ["gne-mj", *command.split(), "--out", str(tmp_path)])
        with pytest.raises(SystemExit) as ended:
            main()
        assert ended.value.code == 2
        assert "it exists already" in capsys.readouterr().err
        assert [path.name for path in tmp_path.iterdir()] == ["mine.txt"]


def test_a_folder_that_cannot_be_written(tmp_path, capsys, monkeypatch):
    (tmp_path / "file").write_text("")
    out = tmp_path / "file" / "run"
    monkeypatch.setattr("sys.argv", ["gne-mj", "run", "velocity-sync", "--out", str(out)])
    with pytest.raises(SystemExit) as ended:
        main()
    assert ended.value.code == 2
    assert "cannot be written" in capsys.readouterr().err


def test_plot_of_a_folder_that_no_run_wrote(tmp_path, capsys, monkeypatch):
    for content in ((), ("trajectory.zarr",)):
        for name in content:
            (tmp_path / name).mkdir()
        monkeypatch.setattr("sys.argv", ["gne-mj", "plot", str(tmp_path)])
        with pytest.raises(SystemExit) as ended:
            main()
        assert ended.value.code == 2
        assert capsys.readouterr().err.startswith("gne-mj: RUN: got ")


def test_a_broken_file(tmp_path):
    path = tmp_path / "broken.toml"
    path.write_text("[systems\n")
    with pytest.raises(InvalidInput, match="not valid TOML"):
        load_scenario(path)
    path.write_bytes(b"\xff\xfe")
    with pytest.raises(InvalidInput, match="UTF-8"):
        load_scenario(path)
    path.write_text("systems = 5\n")
    with pytest.raises(InvalidInput, match="systems: got 5"):
        load_scenario(path, {"simulation.duration": 1.0})
    path.write_text("description = 'no system'\n")
    with pytest.raises(InvalidInput, match="systems"):
        load_scenario(path)


def test_a_system_may_be_called_like_a_type():
    tables = {"systems": {"osnr": {"game": {"type": "osnr"}, "agents": {"type": "pi-cascade"}}}}
    with pytest.raises(InvalidInput, match=r"systems\.osnr\.agents\.count: nothing is given"):
        load_scenario(tables)


def test_a_key_of_another_information_structure_says_whose_it_is():
    with pytest.raises(InvalidInput, match="belongs to information = 'distributed', not to 'full'"):
        load_scenario("osnr", {"controller.information": "full"})


def test_errors_keep_their_parts():
    with pytest.raises(InvalidInput) as caught:
        load_scenario("velocity-sync", {"barrier.rho": -1.0})
    assert caught.value.key == "systems.robots.barrier.rho"
    assert caught.value.value == -1.0
    scenario = load_scenario("velocity-sync", {"initial.action": [9.0, 9.0, 9.0, 9.0, 9.0]})
    with pytest.raises(InfeasibleStart) as start:
        scenario.simulation_object()
    assert start.value.constraint == "gap of agent 1"
    assert start.value.value == pytest.approx(27.0)


def test_every_shipped_scenario_validates_and_explains_itself():
    for name, text in shipped().items():
        scenario = load_scenario(name)
        assert scenario.description
        assert re.search(r"#.*\bm?s\b", text), "units beside the numbers"


def test_values_of_set():
    assert parse_value("0.5") == 0.5
    assert parse_value("[1, 2]") == [1, 2]
    assert parse_value("true") is True
    assert parse_value("ring") == "ring"
    assert parse_value('"1"') == "1"


def test_the_paper_scenario_is_the_two_others_side_by_side():
    paper = load_scenario("paper").systems
    assert paper["robots"] == load_scenario("velocity-sync").systems["robots"]
    assert paper["channels"] == load_scenario("osnr").systems["channels"]
