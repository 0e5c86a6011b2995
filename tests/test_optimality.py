"""What solve finds is an equilibrium, or it says that it is none; where it starts; what a run
tells without a y*."""

import json
import shutil
from pathlib import Path
from types import ModuleType

import box_game
import kernel_game
import numpy as np
import pytest
from commands import gne_here as gne
from test_scales import one_agent

from gne_mj.equilibrium import (
    best_response,
    measured_epsilon,
    penalised_equilibrium,
    variational_equilibrium,
)
from gne_mj.errors import InvalidInput, SolverError, UserCodeError
from gne_mj.game_model import Game
from gne_mj.loops import monitor as watch
from gne_mj.optimality import examine
from gne_mj.run_metrics import check_numbers
from gne_mj.scenario import load_scenario
from gne_mj.solutions import solve_system
from gne_mj.starts import interior_profile

HERE = Path(__file__).parent
# Where the logarithm game's gradient is, after its cost
LINE = 2 + (HERE / "logarithm_game.py").read_text().split("\n").index(
    "def cost_gradient(q, i, a, y):"
)
COST_LINE = LINE - 4


def scenario(tmp_path, action="2.0", kind="maximum", width=6.0, file="box_game.py"):
    """A scenario of one's own game, on integrators."""
    shutil.copy(HERE / file, tmp_path / file)
    text = f"""
        [simulation]
        duration = 0.5
        timestep = 0.01
        [systems.s.game]
        type = "custom"
        file = "{file}"
        [systems.s.agents]
        type = "integrator"
        count = 2
        [systems.s.barrier]
        rho = 0.01
    """
    if file == "box_game.py":
        text += f'[systems.s.game.parameters]\nkind = "{kind}"\nwidth = {width}\n'
    if action is not None:
        text += f"[systems.s.initial]\naction = {action}\n"
    path = tmp_path / "own.toml"
    path.write_text(text)
    return path


def test_a_maximum_is_no_equilibrium(tmp_path):
    """J_i = cos(3 y_i) + y_i / 10 in [0, 6]: from 2 Newton's method climbs to the top."""
    done = gne("solve", scenario(tmp_path), "--json")
    assert done.returncode == 1
    report = json.loads(done.stdout)["s"]
    found = report["variational"]
    grid = np.linspace(0.0, 6.0, 600_001)
    value = np.cos(3 * grid) + 0.1 * grid
    y = np.array(found["action"])
    gain = np.cos(3 * y) + 0.1 * y - np.min(value)
    assert np.allclose(found["gains"], gain, rtol=1e-8)
    assert np.all(gain > 2.0)
    assert not found["is_equilibrium"]
    assert found["not_minima"] == [1, 2]
    assert np.allclose(found["own_curvature"], -1.0)
    assert report["penalised"][0]["epsilon"]["measured"] > 2.0
    told = gne("solve", scenario(tmp_path))
    assert told.returncode == 1
    for words in ("no equilibrium", "agents 1, 2", "gains 2.1", "own second derivative"):
        assert words in told.stdout
    bounds = ("bound", "largest_own_bound")
    assert all(report["penalised"][0]["epsilon"][name] is None for name in bounds)
    # A run and certify do not state a bound that a best response exceeds
    certified = json.loads(gne("certify", scenario(tmp_path), "--json").stdout)["s"]["equilibrium"]
    assert all(certified[name] is None for name in bounds)
    assert certified["own_bound"] == [None, None]
    assert "J_1 is not convex in y_1" in certified["refuted"]
    ran = gne("run", scenario(tmp_path))
    assert "no bound, since the lemma does not hold: not every J_i is convex in y_i" in ran.stdout
    assert "variational GNE\n" not in told.stdout.replace("to the variational GNE\n", "")


def test_a_minimum_that_is_not_the_least_is_told(tmp_path):
    """From 3.1 the method ends in the well at pi, that at 1.05 being 0.21 deeper."""
    system = load_scenario(scenario(tmp_path, action="3.1")).system_objects()[0]
    solution = solve_system(system)
    assert solution.optimality.not_minima == ()
    assert solution.deviating == (0, 1)
    grid = np.linspace(0.0, 6.0, 600_001)
    least = np.min(np.cos(3 * grid) + 0.1 * grid)
    y = solution.variational.action[0]
    assert solution.gains == pytest.approx(np.cos(3 * y) + 0.1 * y - least, rel=1e-8)
    best = best_response(system.game, 0, solution.variational.action)
    assert best.action[0] == pytest.approx(grid[np.argmin(np.cos(3 * grid) + 0.1 * grid)], abs=1e-4)


def plane(gradient, second, value, agents=1):
    """Agents with two entries each in the unit disc."""
    module = ModuleType("plane")
    module.cost = lambda q, i, y: value(y[2 * i : 2 * i + 2])
    module.cost_gradient = lambda q, i, a, y: gradient(y[2 * i : 2 * i + 2])[a - 2 * i]

    def add_cost_hessian(q, i, a, y, scale, out):
        out[2 * i : 2 * i + 2] += scale * second(y[2 * i : 2 * i + 2])[a - 2 * i]

    module.add_cost_hessian = add_cost_hessian
    module.constraint = lambda q, k, y: y[2 * k] ** 2 + y[2 * k + 1] ** 2 - 1.0
    module.constraint_gradient = lambda q, k, a, y: 2.0 * y[a]
    module.constraint_hessian = lambda q, k, a, b, y: 2.0 * (a == b)
    return Game(
        name="plane", kernels=module, parameters=np.zeros(1), sizes=(2,) * agents,
        in_cost=[[i] for i in range(agents)], in_constraint=[[i] for i in range(agents)],
        constraint_names=tuple(f"disc {i + 1}" for i in range(agents)),
    )  # fmt: skip


def test_a_saddle_of_an_own_cost_is_no_equilibrium():
    """J_i = y_1^2 - y_2^2 in the unit disc: stationary at 0, least at (0, 1) and (0, -1)."""
    game = plane(
        lambda y: np.array([2 * y[0], -2 * y[1]]), lambda y: np.diag([2.0, -2.0]),
        lambda y: y[0] ** 2 - y[1] ** 2, agents=2,
    )  # fmt: skip
    point = variational_equilibrium(game, [0.1, 0.0, 0.2, 0.0])
    assert np.allclose(point.action, 0.0, atol=1e-9)
    assert examine(game, point).not_minima == (0, 1)
    assert measured_epsilon(game, point.action) == pytest.approx([1.0, 1.0], abs=1e-6)
    almost = [1e-63, 0.0, 2e-63, 0.0]  # so small a profile is no length to look by
    assert measured_epsilon(game, almost) == pytest.approx([1.0, 1.0], abs=1e-6)


@pytest.mark.parametrize(("bend", "minimum"), [(1.0, True), (3.0, False)])
def test_a_bounds_curvature_counts(bend, minimum):
    """J = -2 y_1 - bend y_2^2 / 2 in the disc, at (1, 0): the bound's 2 lambda = 2 against bend."""
    game = plane(
        lambda y: np.array([-2.0, -bend * y[1]]), lambda y: np.diag([0.0, -bend]),
        lambda y: -2.0 * y[0] - 0.5 * bend * y[1] ** 2,
    )  # fmt: skip
    point = variational_equilibrium(game, [0.5, 0.0])
    assert np.allclose(point.action, [1.0, 0.0], atol=1e-9)
    found = examine(game, point)
    assert found.active == (0,)
    assert (found.not_minima == ()) is minimum
    gain = 0.0 if minimum else 2 * 2 / 3 + 1.5 * 5 / 9 - 2.0  # at y_1 = 2 / 3
    assert measured_epsilon(game, point.action)[0] == pytest.approx(gain, abs=1e-8)


def test_a_corner_leaves_no_direction():
    """J = -y^2 at its upper bound, 1, of [-0.5, 1]: the first derivative holds it there."""
    game = one_agent(lambda y: -2.0 * y, lambda y: -2.0, (-0.5, 1.0), lambda y: -(y**2))
    found = examine(game, variational_equilibrium(game, [0.9]))
    assert found.curvature[0] == np.inf
    assert found.active == (1,)


def test_a_merely_monotone_game_is_solved_and_told(tmp_path):
    path = scenario(tmp_path, kind="flat", width=3.0, action="0.5")
    done = gne("solve", path)
    assert done.returncode == 0
    assert "merely monotone there: the equilibrium need not be unique" in done.stdout
    assert "uniqueness" not in gne("solve", "desired-velocity").stdout


def test_differences_stay_inside_the_set():
    """Functions that raise outside [0, 6]; exact second derivatives are known."""
    module = ModuleType("inside")
    for name in ("cost", "constraint", "constraint_gradient"):
        setattr(module, name, getattr(box_game, name))

    def cost_gradient(q, i, a, y):
        assert np.all((y >= 0.0) & (y <= 6.0))
        return 1.0 - 0.3 / y[i] + y[i] ** 3

    module.cost_gradient = cost_gradient
    game = Game(
        name="inside", kernels=module, parameters=np.array([1.0, 6.0]), sizes=(1, 1),
        in_cost=[[0], [1]], in_constraint=[[0], [1]] * 2, constraint_names=tuple("abcd"),
    )  # fmt: skip
    for y in ([1e-11, 6.0 - 1e-11], [0.3, 5.0], [1e-3, 6.0 - 1e-6], [5.9999999, 1e-30]):
        expected = np.diag(0.3 / np.square(y) + 3.0 * np.square(y))
        assert np.allclose(game.pseudo_gradient_jacobian(y), expected, rtol=1e-7)


def test_the_logarithm_is_certified_without_stepping_out(tmp_path):
    done = gne("certify", scenario(tmp_path, kind="logarithm", action="1.0"))
    assert (done.returncode, done.stderr) == (0, "")


@pytest.mark.parametrize("command", ["solve", "certify"])
@pytest.mark.parametrize("action", [None, "9.0"])
def test_an_interior_start_is_found(tmp_path, command, action):
    path = scenario(tmp_path, kind="logarithm", action=action)
    done = gne(command, path, "--json")
    assert (done.returncode, done.stderr) == (0, "")
    found = json.loads(done.stdout)["s"]["start_found"]
    assert np.all((np.array(found["action"]) > 0.0) & (np.array(found["action"]) < 6.0))
    assert ("no start is given" if action is None else "'g2' has g = 3") in found["why"]
    assert "found inside: " in gne(command, path).stdout
    assert (
        json.loads(gne(command, scenario(tmp_path), "--json").stdout)["s"].get("start_found")
        is None
    )
    # a run takes one where none is given, never another than was asked for
    assert gne("run", scenario(tmp_path, action=action)).returncode == (2 if action else 0)


def test_where_nothing_is_inside_that_is_said():
    game = one_agent(lambda y: y, lambda y: 1.0, (1.0, -1.0))
    with pytest.raises(InvalidInput, match="no profile strictly inside"):
        interior_profile(game, np.array([5.0]))


@pytest.mark.parametrize("unit", [1e-9, 1e9])
def test_interior_profiles_do_not_depend_on_units(unit):
    """A thin shell of a triangle far away."""
    module = ModuleType("thin")
    module.cost = lambda q, i, y: 0.0
    module.cost_gradient = lambda q, i, a, y: 0.0
    normals = np.array([[1.0, 1.0], [-1.0, -1.001], [0.0, -1.0]])
    limits = np.array([1.0, -0.999, 3.0]) * unit
    scales = 10.0 ** np.array([8.0, -8.0, 0.0])
    module.constraint = lambda q, k, y: scales[k] * (normals[k] @ y - limits[k])
    module.constraint_gradient = lambda q, k, a, y: scales[k] * normals[k, a]
    game = Game(
        name="thin", kernels=module, parameters=np.zeros(1), sizes=(1, 1), in_cost=[[0], [1]],
        in_constraint=[[0, 1]] * 3, constraint_names=tuple("abc"),
    )  # fmt: skip
    found = interior_profile(game, np.array([1e4, -3e3]) * unit)
    assert np.all(normals @ found < limits)


def test_without_an_equilibrium_a_run_says_what_is_not_known(tmp_path):
    path = scenario(tmp_path, action="0.5", file="endless_game.py")
    system = load_scenario(path).system_objects()[0]
    assert system.known_equilibrium is None
    with pytest.raises(SolverError):
        _ = system.equilibrium
    assert gne("solve", path).returncode == 2
    out = tmp_path / "out"
    done = gne("run", path, "--out", out)
    assert (done.returncode, done.stderr) == (0, "")
    assert "completed: ran its 0.5 s inside the set; no penalised equilibrium was" in done.stdout
    assert done.stdout.count("not known: no penalised equilibrium") == 3
    (report,) = json.loads((out / "report.json").read_text())["systems"].values()
    assert report["equilibrium"]["final_distance"] is None
    assert report["settling_time"] is None
    assert report["epsilon"]["measured"] is None
    assert not report["lyapunov"]["claimed"]
    for key in ("start", "final", "largest_rise", "monotone"):
        assert report["lyapunov"][key] is None
    assert report["worst_constraint"]["margin"] == pytest.approx(1.5)
    for command in (
        ("plot", out), ("view", out, "--html", tmp_path / "page.html"), ("certify", path),
        ("batch", path, "--runs", "2", "--out", tmp_path / "batch"),
        ("run", path, "--set", "controller.mode=implicit"),
    ):  # fmt: skip
        done = gne(*command)
        assert (done.returncode, done.stderr) == (0, ""), command


@pytest.mark.parametrize("command", ["solve", "certify", "run"])
@pytest.mark.parametrize("function", ["cost", "cost_gradient"])
def test_what_is_not_a_number_at_the_start_is_told(tmp_path, command, function):
    path, line = scenario(tmp_path, "[0.5, -0.1]", file="logarithm_game.py"), COST_LINE
    if function == "cost_gradient":  # alone
        file, line = tmp_path / "logarithm_game.py", LINE
        file.write_text(file.read_text().replace("y[i] * np.log(y[i])", "y[i] * np.log(abs(y[i]))"))
    done = gne(command, path, "--json")
    assert done.returncode == 1
    where = f"logarithm_game.py, line {line}, in {function}: "
    assert done.stderr.startswith(f"gne-mj: user_code_failed: {where}")
    assert "invalid value encountered in log" in done.stderr
    assert "for agent 2 at y = [0.5, -0.1]" in done.stderr
    assert len(done.stderr.splitlines()) == 1
    assert json.loads(done.stdout)["status"] == "user_code_failed"


def test_a_gradient_that_stops_being_a_number_is_told(tmp_path):
    """Actions fall below zero within a step, which no solution of the equation does."""
    path = scenario(tmp_path, "0.5", file="logarithm_game.py")
    coarse = ("--set", "simulation.timestep=0.1", "--set", "recording.period=0.1")
    for command in (
        ("run", path), ("batch", path, "--runs", "2", "--out", tmp_path / "batch")
    ):  # fmt: skip
        done = gne(*command, *coarse)
        assert done.returncode == 1
        assert f"user_code_failed: logarithm_game.py, line {LINE}" in done.stderr
        assert "at y = [-" in done.stderr


def test_kernels_are_asked_as_they_were_written():
    """Compiled they return what is not a number; as Python functions they tell where."""
    game = Game(
        name="kernels", kernels=kernel_game, parameters=np.zeros(1), sizes=(1, 1),
        in_cost=[[0], [1]], in_constraint=[[0], [1]], constraint_names=("a", "b"),
    )  # fmt: skip
    with pytest.raises(UserCodeError) as caught:
        penalised_equilibrium(game, 0.1, [0.5, -0.1])
    for words in ("kernel_game.py, line", "in cost_gradient", "math domain error", "agent 2"):
        assert words in str(caught.value)
    assert penalised_equilibrium(game, 0.1, [0.5, 0.1]).residual < 1e-12

    monitor = watch.fresh(2, 2)
    monitor.exit = watch.DIVERGED
    monitor.last_u[:] = [-2.0, 0.0]
    with pytest.raises(UserCodeError, match="agent 1 at y = "):  # half a step further
        check_numbers(game, monitor, np.array([0.05, 1.0]), 0.05)
    monitor.last_u[:] = 0.0
    check_numbers(game, monitor, np.array([0.05, 1.0]), 0.05)
    monitor.exit = watch.LEFT_SET
    check_numbers(game, monitor, np.array([-1.0, 1.0]), 0.05)
