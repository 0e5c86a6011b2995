"""Errors name the parameter that was called; files' keys and flags are put on in one place each."""

import ast
import inspect
import re
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np
import pytest
from builders import FIVE, clock, integrators, robot_state, robot_system
from commands import gne_here

import gne_mj
from gne_mj import faults, graph, theory
from gne_mj.barrier import LogBarrier, Schedule
from gne_mj.batches import Plan, Store, Sweep, execute, make_plan, parse_record, parse_sweep
from gne_mj.controllers import FullyDistributed, PartialInformation
from gne_mj.environment import environment_of, law_policy, setting_of
from gne_mj.equilibrium import penalised_equilibrium
from gne_mj.errors import InfeasibleStart, InvalidInput, Refusal, named, part_of
from gne_mj.exit_map import Grid
from gne_mj.games import (
    cournot_game,
    formation_game,
    osnr_game,
    platoon_game,
    region_of,
    ten_channels,
    velocity_consensus_game,
    velocity_game,
)
from gne_mj.margins import Disturbance, tightening
from gne_mj.passivity import examine, plants_of
from gne_mj.plants import flexible_robot
from gne_mj.plants.agents import Agents
from gne_mj.quantity import Quantity
from gne_mj.scenario import load_scenario
from gne_mj.simulation import Simulation
from gne_mj.solutions import parse_path, solve_system
from gne_mj.starts import interior_profile
from gne_mj.system import Clock, System
from gne_mj.user_files import load_game, load_law

STATE, GAME = robot_state(FIVE), velocity_game(5, 3.0, 3.0)
DISC = region_of(radius=1.0)
NETWORK = PartialInformation(graph.ring(5))

# Parameters of a system that the clock's table has
OF_THE_CLOCK = {"name", "seed", "rtol", "on_exit"}


@pytest.fixture(scope="module")
def system():
    return robot_system(STATE, integrator="euler")


def of_system(system):
    """What the system's constructor was given."""
    return {name: getattr(system, name) for name in inspect.signature(System).parameters}


# What is called, with what, and which parameter is named
CALLS = [
    (Clock, (1.0, -0.1, 0.1, 0.1), {}, "timestep"),
    (Clock, (1.0, 0.1, 0.15, 0.1), {}, "control_period"),
    (Clock, (1.0, 0.1, 0.1, 0.15), {}, "sample_period"),
    (Clock, (1e300, 0.1, 0.1, 0.1), {}, "duration"),
    (Schedule, ("linear", 1.0, 0.1, 1.0), {}, "kind"),
    (Schedule, ("halving", 1.0, 2.0, 1.0), {}, "floor"),
    (Schedule, ("halving", 1.0, 0.1, 0.0), {}, "time_constant"),
    (LogBarrier, (GAME, 0.0), {}, "rho"),
    (velocity_game, (3, 3.0, -1.0), {}, "gap_bound"),
    (velocity_game, (3, 3.0, 1.0), {"desired_weight": -1.0}, "desired_weight"),
    (cournot_game, (3,), {"upper_bound": 1.0}, "upper_bound"),
    (cournot_game, (2001,), {}, "agents"),
    (osnr_game, (), {**ten_channels(), "gain": [1.0]}, "gain"),
    (osnr_game, (), {**ten_channels(), "system_matrix": [[1.0]]}, "system_matrix"),
    (velocity_consensus_game, ([(0, 2)], [1.0, 0.0], [0.0], 1.0, 1.0), {}, "edges"),
    (velocity_consensus_game, ([(0, 1)], [0.0, 0.0], [0.0], 1.0, 1.0), {}, "leader_weight"),
    (velocity_consensus_game, ([(0, 1)], [1.0, 0.0], [0.0], 1.0, 0.0), {}, "leader_gap_bound"),
    (platoon_game, (2,), {"leader_range": (1.0, 0.0)}, "leader_range"),
    (platoon_game, (3,), {"spacing_weight": [1.0, 9.0]}, "spacing_weight"),
    (region_of, (), {"vertices": [[0.0, 0.0]]}, "vertices"),
    (formation_game, (np.zeros((1, 2)), [], 1.0, DISC), {"links": [(0, 1)]}, "links"),
    (partial(replace, GAME, box=None), (), {"sizes": (0,) * 5}, "sizes"),
    (partial(replace, GAME), (), {"in_cost": [[7]] * 5}, "in_cost"),
    (partial(replace, GAME), (), {"box": (1.0, 2.0)}, "box"),
    (partial(replace, GAME), (), {"name": 3}, "name"),
    (GAME.tightened, (-1.0,), {}, "tightening"),
    (Quantity, ("q", "", "", np.sum), {"each": "link"}, "each"),
    (graph.Graph, (3, ((0, 1),)), {}, "edges"),
    (graph.complete, (2000,), {}, "agents"),
    (graph.printed, (5,), {}, "agents"),
    (FullyDistributed, (graph.ring(5), 0.0), {}, "epsilon"),
    (PartialInformation, (graph.ring(5),), {"coupling": 0.0}, "coupling"),
    (NETWORK.initial_memory, (FIVE,), {"estimate": [1.0]}, "estimate"),
    (PartialInformation(graph.ring(80)).propagator, (1e30,), {}, "period"),
    (Agents, (flexible_robot, np.ones((2, 4)), np.ones(2)), {}, "parameters"),
    (Agents, (flexible_robot, np.ones((2, 5)), np.zeros(2)), {}, "input_limit"),
    (faults.Push, (), {"force": 1.0, "period": 0.0}, "period"),
    (faults.Push, (), {"force": 1.0, "start": 1.0, "end": 0.5}, "end"),
    (faults.Push(agents=(5,)).targets, (GAME, None), {}, "agents"),
    (faults.MessageLoss().targets, (GAME, None), {}, "graph"),
    (Disturbance, (-np.ones(5), np.zeros(5)), {}, "push"),
    (Disturbance, (np.ones(5), np.zeros(5), -1), {}, "delay"),
    (tightening, (GAME, np.full(5, 9.0)), {}, "error"),
    (penalised_equilibrium, (GAME, -1.0, FIVE), {}, "rho"),
    (interior_profile, (replace(GAME, box=None).tightened(99.0), FIVE), {}, "game"),
    (Grid, ((0.1,), (2.0,)), {}, "margins"),
    (Grid, ((0.1,), (0.5,)), {"seed": -1}, "seed"),
    (parse_path, ("1:2",), {}, "text"),
    (parse_sweep, ("barrier.rho",), {}, "text"),
    (parse_record, ("some",), {}, "given"),
    (Sweep, ("barrier.rho", ()), {}, "values"),
    (examine, (plants_of(integrators(1), "ode", "euler"), 0.1), {"trials": 0}, "trials"),
    (load_game, ("nothing.py", 3, {}), {}, "path"),
    (load_law, ("nothing.py", GAME, None, {}), {}, "path"),
    (make_plan, ("velocity-sync",), {"system": "boats"}, "system"),
    (gne_mj.load_environment, ("nothing",), {}, "scenario"),
    (load_scenario, ("nothing",), {}, "source"),
]  # fmt: skip


def refused(function, *arguments, **options):
    with pytest.raises(Refusal) as caught:
        function(*arguments, **options)
    error = caught.value
    assert str(error).startswith(f"{error.key}: ")
    return error


def parameters(function):
    """Of a function or class; of a method, and of ``replace``, those of its object too."""
    own = set(inspect.signature(function).parameters)
    of = function.args[0] if getattr(function, "func", None) is replace else None
    of = getattr(function, "__self__", of)
    return own | (set() if of is None else set(inspect.signature(type(of)).parameters))


@pytest.mark.parametrize(("function", "arguments", "options", "key"), CALLS)
def test_a_parameter_of_the_called_function_is_named(function, arguments, options, key):
    assert refused(function, *arguments, **options).key == key
    assert key in parameters(function)


@pytest.mark.parametrize(
    ("changes", "key"),
    [
        ({"agents": integrators(4)}, "agents.count"),
        ({"state": STATE[:4]}, "state"),
        ({"state": robot_state(FIVE + 9.0)}, "state"),
        ({"rho": 0.0}, "rho"),
        ({"memory": np.ones(3)}, "memory"),
        ({"law": PartialInformation(graph.ring(4)), "memory": np.zeros(0)}, "law.graph"),
        ({"integrator": "rosenbrock"}, "integrator"),
        ({"integrator": "tsit5", "rtol": 1.0}, "rtol"),
        ({"agents": integrators(5), "state": FIVE[:, None], "engine": "mujoco"}, "engine"),
        ({"decentralised": True}, "decentralised"),
        ({"faults": (faults.Noise(), faults.Push(agents=(7,)))}, "faults.1.agents"),
        ({"faults": (faults.MessageLoss(),)}, "faults.0"),
    ],
)
def test_of_a_system_too_and_what_is_within_it(system, changes, key):
    error = refused(System, **{**of_system(system), **changes})
    assert error.key == key
    assert key.split(".")[0] in parameters(System)


def test_what_is_called_with_a_system_says_so(system):
    times = clock(0.01)
    fast = replace(system, law=FullyDistributed(graph.ring(5), 1e-9), memory=np.zeros(0))
    for function, arguments, key in (
        (fast.closed_loop, (times,), "clock.timestep"),
        (Simulation, ([fast], times), "clock.timestep"),
        (Simulation, ([system], Clock(1e9, 0.01, 0.01, 0.01)), "clock.sample_period"),
        (Simulation, ([system, system], times), "systems"),
        (theory.search_epsilon, (system, times), "system.law.information"),
        (theory.search_period, (system, times), "system.mode"),
        (solve_system, (system, (-1.0,)), "rhos"),
        (solve_system, (system, (), (-1.0,)), "path_rhos"),
        (environment_of, (system, times), "system.engine"),
        (partial(setting_of, graph="rin", information="partial"),
         (replace(system, engine="mujoco"), times), "graph"),
        (law_policy, (replace(system, schedule=Schedule("halving", 1.0, 0.1, 1.0)),),
         "system.schedule"),
    ):  # fmt: skip
        assert refused(function, *arguments).key == key
        assert key.split(".")[0] in parameters(function)


@pytest.mark.parametrize(
    ("options", "key"),
    [
        ({"starts": -1}, "starts"),
        ({"spread": 2.0}, "spread"),
        ({"sweeps": (Sweep("simulation.seed", (1, 2)),)}, "sweeps"),
    ],
)
def test_of_a_batch(options, key, tmp_path):
    assert refused(make_plan, "velocity-sync", **options).key == key
    assert key in parameters(Plan)
    key = {"starts": "runs", "sweeps": "sweep"}.get(key, key)
    options = {{"starts": "runs"}.get(name, name): given for name, given in options.items()}
    options = {"sweep": {"simulation.seed": [1, 2]}} if "sweeps" in options else options
    assert refused(gne_mj.batch, "velocity-sync", out=tmp_path / "a", **options).key == key
    assert key in parameters(gne_mj.batch)


def test_of_a_file_that_is_gone(tmp_path):
    (tmp_path / "own.py").write_text(OWN)
    tables = {"systems": {"s": {
        "game": {"type": "custom", "file": str(tmp_path / "own.py")},
        "agents": {"type": "integrator", "count": 3},
        "initial": {"action": 2.9},
    }}}  # fmt: skip
    plan = make_plan(tables)
    (tmp_path / "own.py").unlink()
    assert refused(plan.manifest).key == "scenario.systems.s.game.file"


OWN = """
from gne_mj.games import velocity_game
def game(count):
    return velocity_game(count, 3.0, 1.0)
"""


def test_of_a_batchs_folder(tmp_path):
    plan = make_plan("velocity-sync", {"plant.engine": "ode"})
    assert refused(Store.create, tmp_path, plan).key == "folder"
    assert refused(Store.open, tmp_path).key == "folder"
    store = Store.create(tmp_path / "a", plan)
    assert refused(execute, store, threads=-1).key == "threads"
    error = refused(gne_mj.batch, "velocity-sync", {"barrier.rho": [1.0, 1.0]}, out=tmp_path)
    assert error.key == "sweep.barrier.rho"


# ------------------------------------------------------------------------------------- files

GROUPS = [
    {"type": "integrator", "count": 4},
    {"type": "pi-cascade", "count": 1, "integral_gain": 3.0},
]
MIXED = {"type": "mixed", "groups": GROUPS}
PUSH = {"type": "push", "force": 1.0}
HELD = {"controller.mode": "implicit", "simulation.control_period": 0.1}
FILES = [
    ("velocity-sync", {"simulation.timestep": 1e300}, "simulation.timestep"),
    ("velocity-sync", {"recording.period": 0.003}, "recording.period"),
    ("velocity-sync", {"simulation.duration": 1e9}, "recording.period"),
    ("velocity-sync", {"simulation.control_period": 2e3, "controller.mode": "implicit"},
     "simulation.control_period"),
    ("velocity-sync", {"barrier.schedule": "halving", "barrier.floor": 1.0}, "barrier.floor"),
    ("velocity-sync", {"barrier.floor": 1.0}, "barrier.floor"),
    ("velocity-sync", {"game.desired_weight": -1.0}, "game.desired_weight"),
    ("cournot", {"agents.count": 2500}, "agents.count"),
    ("cournot", {"game.upper_bound": 1.0}, "game.upper_bound"),
    ("osnr", {"controller.graph": [[1, 2]]}, "controller.graph"),
    ("osnr", {"controller.graph": "complete", "agents.count": 4}, "game.price"),
    ("planar-sync", {"game.edges": "printed"}, "agents.count"),
    ("planar-sync", {"agents.count": 20_000, "game.reference_velocity": [1.0] * 3}, "agents.count"),
    ("velocity-sync", {"agents.damping": -1.0}, "agents.damping"),
    ("velocity-sync", {"agents": MIXED}, "agents.groups.1.integral_gain"),
    ("velocity-sync", {"plant.integrator": "rosenbrock"}, "plant.integrator"),
    ("velocity-sync", {"plant.integrator": "tsit5"}, "plant.integrator"),
    ("velocity-sync", {"simulation.rtol": 0.0}, "simulation.rtol"),
    ("osnr", {"plant.engine": "mujoco"}, "plant.engine"),
    ("osnr", {"controller.epsilon": 1e-3, "plant.integrator": "rk4"}, "simulation.timestep"),
    ("velocity-sync", {"controller.decentralised": True}, "controller.decentralised"),
    ("velocity-sync", {"initial.action": 0.0}, "initial.action"),
    ("velocity-sync", {"initial.integral": 0.0}, "initial.integral"),
    ("osnr", {"initial.estimate": 9.0}, "initial.estimate"),
    ("osnr", {"initial.estimate": [1.0]}, "initial.estimate"),
    ("osnr", {"initial.filtered": [1.0]}, "initial.filtered"),
    ("velocity-sync", {"faults": [PUSH, {**PUSH, "agents": [9]}]}, "faults.1.agents"),
    ("velocity-sync", {"faults": [PUSH, {**PUSH, "start": 2.0, "end": 1.0}]}, "faults.1.end"),
    ("velocity-sync", {"margin.push": [1.0, 2.0]}, "margin.push"),
    ("velocity-sync", {**HELD, "margin.push": 100.0}, "margin"),
    ("velocity-sync", {**HELD, "margin.delay": 999, "simulation.control_period": 2.0},
     "simulation.control_period"),
    ("velocity-sync", {"game": {"type": "custom", "file": "nothing.py"}}, "game.file"),
    ("velocity-sync", {"controller": {"information": "custom", "file": "nothing.py"}},
     "controller.file"),
]  # fmt: skip


@pytest.mark.parametrize(("name", "changes", "key"), FILES)
def test_the_key_of_a_file_is_named(name, changes, key):
    error = refused(lambda: load_scenario(name, changes).simulation_object())
    system = next(iter(load_scenario(name).systems))
    shared = key.split(".")[0] in ("simulation", "recording")
    assert error.key == (key if shared else f"systems.{system}.{key}")


def test_of_a_game_of_ones_own_too(tmp_path):
    (tmp_path / "own.py").write_text(OWN.replace("count, 3.0", "count + 1, 3.0"))
    own = {"type": "custom", "file": str(tmp_path / "own.py")}
    error = refused(lambda: load_scenario("velocity-sync", {"game": own}).simulation_object())
    assert (error.key, error.value) == ("systems.robots.agents.count", 5)
    (tmp_path / "own.py").write_text(OWN.replace("count, 3.0, 1.0", "count, 3.0, -1.0"))
    error = refused(lambda: load_scenario("velocity-sync", {"game": own}).simulation_object())
    assert error.key == "systems.robots.game.gap_bound"


def test_what_is_called_with_a_scenarios_system_is_told_of_its_keys():
    scenario = load_scenario("osnr", {"controller.mode": "continuous"})
    (system,) = scenario.system_objects()
    for search, key in (
        (theory.search_period, "systems.channels.controller.mode"),
        (lambda system, clock: system.closed_loop(Clock(1.0, 0.05, 0.05, 0.05)),
         "simulation.timestep"),
    ):  # fmt: skip
        tried = replace(system, integrator="rk4")
        with pytest.raises(Refusal) as caught, scenario.naming("channels"):
            search(tried, scenario.clock())
        assert caught.value.key == key


def test_the_key_is_found_by_what_the_tables_declare():
    scenario = load_scenario("osnr", {"margin": {"push": 1.0}, "faults": [PUSH]})
    for parameter, key in {
        "clock.duration": "simulation.duration",
        "clock.sample_period": "recording.period",
        "systems.channels.law.graph": "systems.channels.controller.graph",
        "systems.channels.law.graph.edges.3": "systems.channels.controller.graph.edges.3",
        "systems.channels.rho": "systems.channels.barrier.rho",
        "systems.channels.state": "systems.channels.initial.action",
        "systems.channels.disturbance.delay": "systems.channels.margin.delay",
        "systems.channels.faults.0.force": "systems.channels.faults.0.force",
        "systems.channels.game.agents": "systems.channels.agents.count",
        "systems.channels.game.in_cost": "systems.channels.game.in_cost",
        "graph": "graph",
    }.items():
        assert scenario.key_of(parameter) == key


def test_every_parameter_of_a_system_and_clock_has_a_key():
    """A new one needs a key of its name, or one that says that it fills it."""
    scenario = load_scenario("velocity-sync")
    for name in set(inspect.signature(System).parameters) - OF_THE_CLOCK:
        assert scenario.key_of(f"systems.robots.{name}").count(".") >= 2
        assert _found(scenario, f"systems.robots.{name}"), name
    for name in inspect.signature(Clock).parameters:
        assert _found(scenario, f"clock.{name}"), name


def _found(scenario, parameter):
    """Whether what is named is a key of the scenario's tables."""
    value = scenario
    for part in scenario.key_of(parameter).split("."):
        known = type(value).model_fields if hasattr(type(value), "model_fields") else value
        if part not in known:
            return False
        value = getattr(value, part) if hasattr(type(value), "model_fields") else value[part]
    return True


# --------------------------------------------------------------------------------------- flags


@pytest.mark.parametrize(
    ("line", "words"),
    [
        ("run nothing", "SCENARIO: got 'nothing'"),
        ("run velocity-sync --set x", "--set: got 'x'"),
        ("run velocity-sync --out .", "--out: got '.'"),
        ("run velocity-sync --speed 2", "--speed: got '2', but it goes with --view"),
        ("run --from nothing --index 1", "--from: got 'nothing'"),
        ("run velocity-sync --set barrier.floor=1", "systems.robots.barrier.floor: got 1"),
        ("solve velocity-sync --rho -1", "--rho: got -1.0"),
        ("solve velocity-sync --path 1:2", "--path: got '1:2'"),
        ("solve velocity-sync --system boats", "--system: got 'boats'"),
        ("certify velocity-sync --search-epsilon", "--search-epsilon: got 'velocity-sync'"),
        ("passivity velocity-sync --trials 0", "--trials: got 0"),
        ("passivity velocity-sync --seed -1", "--seed: got -1"),
        ("passivity velocity-sync --set simulation.duration=0.05", "simulation.duration: got 0.05"),
        ("map velocity-sync --margins 1:2", "--margins: got '1:2'"),
        ("map velocity-sync --runs 0", "--runs: got 0"),
        ("map velocity-sync --pushes a", "--pushes: got 'a'"),
        ("map paper", "--system: nothing is given"),
        ("batch velocity-sync --runs -1", "--runs: got -1"),
        ("batch velocity-sync --sweep barrier.rho", "--sweep: got 'barrier.rho'"),
        ("batch velocity-sync --sweep barrier.rho=1,1", "--sweep barrier.rho: got 1"),
        ("batch velocity-sync --sweep simulation.seed=1,2", "--sweep: got 'simulation.seed'"),
        ("batch velocity-sync --record some", "--record: got 'some'"),
        ("batch velocity-sync --out .", "--out: got '.', but it exists already; name a folder that"
         " does not, or add --resume"),
        ("batch velocity-sync --cluster nonsense", "--cluster: got 'nonsense'"),
        ("batch-report nothing", "DIR: got 'nothing'"),
        ("plot nothing", "RUN: got 'nothing'"),
        ("view nothing --html . ", "--html: got '.'"),
        ("scenarios nothing", "NAME: got 'nothing'"),
    ],
)  # fmt: skip
def test_the_flag_is_named(line, words, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    done = gne_here(*line.split())
    assert done.returncode == 2
    assert done.stderr.startswith(f"gne-mj: {words}"), done.stderr
    assert list(tmp_path.iterdir()) == []


def test_files_that_exist_are_replaced_only_if_that_is_asked_for(tmp_path):
    page = tmp_path / "page.html"
    page.write_text("mine")
    assert "ask" not in (said := gne_here("view", tmp_path, "--html", page).stderr)
    assert said.startswith("gne-mj: --html: got ")
    assert "give --replace" in said


# ------------------------------------------------------------------------------- in the sources

_ROOT = Path(gne_mj.__file__).parent
# Their names stand in scenario files, and none of a function's parameters is called so
_OF_FILES = {"simulation", "recording", "barrier", "controller", "plant", "initial", "margin"}
_NAMING = {"InvalidInput", "InfeasibleStart", "check_room", "check_count", "storing", "written",
           "refuse_existing"}  # fmt: skip


def test_no_module_below_the_scenarios_names_keys_of_files_or_flags():
    wrong, seen = [], 0
    for path in [*_ROOT.rglob("*.py"), *(_ROOT / "controllers").resolve().glob("*.py")]:
        layer = path.relative_to(_ROOT).parts[0] if path.is_relative_to(_ROOT) else ""
        if layer in ("cli", "scenario.py", "scenario_tables"):
            continue
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            called = isinstance(node, ast.Call) and getattr(node.func, "id", "") in _NAMING
            if not (called and node.args):
                continue
            seen += 1
            first = (
                node.args[0].values[0] if isinstance(node.args[0], ast.JoinedStr) else node.args[0]
            )
            key = first.value if isinstance(first, ast.Constant) else ""
            flag = re.match("--|[A-Z]+$", key)
            if flag or key.split(".")[0] in _OF_FILES or re.match(r"systems\.", key):
                wrong.append(f"{path.name}:{node.lineno}: {key}")
    assert wrong == []
    assert seen > 150


def test_parts_and_other_names():
    with pytest.raises(InvalidInput) as caught, named(plan=""), part_of("plan"):
        raise InvalidInput("sweeps", 1, "less")
    assert (caught.value.key, str(caught.value)) == ("sweeps", "sweeps: got 1, but less")
    with pytest.raises(InvalidInput, match=r"^system\.clock\.x: got 1, but less"), \
            part_of("system"), part_of("clock", "system"):  # fmt: skip
        raise InvalidInput("x", 1, "less")
    with pytest.raises(InfeasibleStart, match=r"^a\.b: the start must lie"), named(c="a"):
        raise InfeasibleStart("c.b", "start", "gap", 1.0)
