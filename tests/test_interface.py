"""Games, agents, laws and faults as objects, and what the package's top level offers."""

import importlib
import inspect
import json
import re
import runpy
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from commands import environment

import gne_mj as gm
from gne_mj.controllers import FullInformation
from gne_mj.controllers.table import LawTable
from gne_mj.errors import InfeasibleStart, InvalidInput
from gne_mj.games import cournot_game, velocity_game
from gne_mj.registry import AGENTS, FAULTS, LAWS
from gne_mj.scenario import load_scenario
from gne_mj.scenario_tables import Scenario

ROOT = Path(__file__).parents[1]
WANTED = [1.0, 1.4, 1.8, 2.2, 2.6, 3.0]


def cost(i, y, p):
    return 0.5 * p.weight[i] * (y[i] - p.wanted[i]) ** 2 + p.price * y[i] * y.mean()


def constraints(y, p):
    yield "energy", (y**2).sum() <= p.budget
    for i in range(len(y)):
        yield f"gap {i + 1}", abs(y[i] - y[i - 1]) <= p.gap


def energy(**numbers):
    given = {"weight": 1.0, "wanted": WANTED, "price": 0.2, "budget": 12.0, "gap": 2.0}
    return gm.game(6, cost, constraints, **{**given, **numbers})


GAME = energy()
SHORT = {"duration": 0.2, "timestep": 0.01}


# ------------------------------------------------------------------ objects are a scenario's tables

MAKERS = {
    "flexible-robot": (AGENTS, gm.flexible_robots),
    "planar-flexible-robot": (AGENTS, gm.planar_robots),
    "integrator": (AGENTS, gm.integrators),
    "pi-cascade": (AGENTS, gm.pi_cascades),
    "mjcf-robot": (AGENTS, gm.mjcf_robots),
    "custom": (AGENTS, gm.custom_agents),
    "full": (LAWS, gm.full_information),
    "partial": (LAWS, gm.partial_information),
    "distributed": (LAWS, gm.fully_distributed),
    "push": (FAULTS, gm.push),
    "saturation": (FAULTS, gm.saturation),
    "noise": (FAULTS, gm.noise),
    "bias": (FAULTS, gm.bias),
    "sensor-delay": (FAULTS, gm.sensor_delay),
    "message-loss": (FAULTS, gm.message_loss),
    "message-delay": (FAULTS, gm.message_delay),
    "silence": (FAULTS, gm.silence),
    "estimate-corruption": (FAULTS, gm.estimate_corruption),
}
# Laws of others, whose functions leave out the keys that are for the paper's laws
RIVALS = {
    "primal-dual": gm.primal_dual_play,
    "primal-dual-partial": gm.primal_dual_partial,
    "l1-penalty": gm.l1_penalty,
    "quadratic-penalty": gm.quadratic_penalty,
    "recursive-safe-flow": gm.recursive_safe_flow,
    "feedback-seeking": gm.feedback_seeking,
    "safe-monotone-flow": gm.safe_monotone_flow,
    "cbf-filter": gm.cbf_filter,
    "discrete-cbf-filter": gm.discrete_cbf_filter,
    "projected-gradient": gm.projected_gradient,
    "receding-horizon": gm.receding_horizon,
}


def plain_default(value):
    return None if value in ({}, []) else value


@pytest.mark.parametrize("name", MAKERS)
def test_a_function_has_the_keys_and_defaults_of_its_table(name):
    registry, function = MAKERS[name]
    fields = registry._tables[name].model_fields
    signature = inspect.signature(function)
    assert set(signature.parameters) == set(fields) - {registry.key}
    for key, parameter in signature.parameters.items():
        if not fields[key].is_required():
            assert plain_default(parameter.default) == plain_default(fields[key].default), key
        else:
            assert parameter.default is inspect.Parameter.empty, key


@pytest.mark.parametrize("name", RIVALS)
def test_a_rivals_function_has_keys_and_defaults_of_its_table(name):
    fields, given = LAWS._tables[name].model_fields, inspect.signature(RIVALS[name]).parameters
    own = set(fields) - set(LawTable.model_fields) - {"information", "estimates", "communication"}
    assert set(given) - {"mode"} == own
    for key, parameter in given.items():
        assert parameter.default == fields[key].default, key


def test_every_type_that_scenarios_know_has_a_function():
    for registry, others in ((AGENTS, {"mixed"}), (LAWS, {"python", "custom"}), (FAULTS, set())):
        shipped = {name for name in registry
                   if registry._tables[name].__module__.startswith("gne_mj.")}  # fmt: skip
        made = {name for name, (owner, _) in MAKERS.items() if owner is registry}
        made |= set(RIVALS) if registry is LAWS else set()
        assert shipped - others == made


def test_objects_are_the_tables_that_a_file_has():
    scenario = gm.setup(
        GAME, agents=gm.pi_cascades(6, decay_rate=np.full(6, 2.0)), rho=0.02, seed=3,
        law=gm.partial_information(gm.ring(6), coupling=2.0, mode="sampled"), control_period=0.01,
        faults=[gm.noise(0.01, agents=[1]), gm.message_loss(0.5, edges=[(1, 2)])], start=np.ones(6),
    )  # fmt: skip
    assert isinstance(scenario, Scenario)
    system = scenario.systems["players"]
    (built,) = scenario.system_objects()
    assert system.controller.network(6).edges == gm.ring(6).edges
    assert (built.law.coupling, built.mode, built.rho, built.seed) == (2.0, "sampled", 0.02, 3)
    assert built.agents.parameters[:, 0].tolist() == [2.0] * 6
    assert [type(fault).__name__ for fault in built.faults] == ["Noise", "MessageLoss"]
    # the whole of it is text, of which this process makes the same again
    again = load_scenario(json.loads(scenario.model_dump_json(exclude_none=True)))
    assert again.systems["players"].controller == system.controller
    y = np.linspace(0.5, 1.5, 6)
    rebuilt = again.system_objects()[0].game
    assert rebuilt.pseudo_gradient(y).tolist() == GAME.pseudo_gradient(y).tolist()


def test_a_graph_is_its_edges_in_a_table():
    own = gm.Graph(4, ((0, 1), (1, 2), (1, 3)))
    assert gm.partial_information(own).graph == [(1, 2), (2, 3), (2, 4)]
    degrees = np.diag(gm.star(5).laplacian)
    assert degrees.tolist() == [4, 1, 1, 1, 1]


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: gm.flexible_robots(0), "count: got 0, but"),
        (lambda: gm.partial_information("rign"), "did you mean 'ring'?"),
        (lambda: gm.fully_distributed(epsilon=-1.0), "epsilon: got -1.0"),
        (lambda: gm.full_information(mode="smapled"), "did you mean 'sampled'?"),
        (lambda: gm.setup(GAME, agents=gm.integrators(5)), "the own game has 6 agents"),
        (lambda: gm.setup(GAME, {"barrier.roh": 1.0}), "did you mean 'rho'?"),
        (lambda: gm.setup("velocity-snyc"), "did you mean 'velocity-sync'?"),
        (lambda: GAME.changed(bugdet=3.0), "did you mean 'budget'?"),
        (lambda: gm.setup(GAME, {"game.object": "game 0"}).system_objects(), "another Python proc"),
        (lambda: gm.vary(GAME, {"rho": 0.1}), "its values must be a list"),
        (lambda: gm.solve("paper"), "name one of robots, channels"),
    ],
)  # fmt: skip
def test_mistakes_are_one_sentence(make, words):
    with pytest.raises(InvalidInput, match=re.escape(words)):
        make()


def test_any_game_and_any_law_object_will_do():
    game = cournot_game(3)
    scenario = gm.setup(game, law=FullInformation(), **SHORT, start=[8.0, 8.0, 8.0])
    assert scenario.system_objects()[0].game is game
    with pytest.raises(InvalidInput, match=r"agents\.count: got 4, but the .* has 3 agents"):
        load_scenario(scenario, {"agents.count": 4}).system_objects()


def test_a_robot_of_mjcf_text():
    text = "<mujoco><worldbody/></mujoco>"
    first, again = (gm.mjcf_robots(2, text, output="o", input="i") for _ in range(2))
    assert first == again
    assert Path(first.file).read_text() == text


# ---------------------------------------------------------------------------------------- running


def test_a_start_inside_is_found_and_one_that_is_given_is_kept():
    tight = energy(budget=4.0)
    found = gm.setup(tight, {"game.parameters.gap": 0.5}).system_objects()[0]
    assert np.all(found.game.constraints(found.start) < 0)
    kept = gm.setup(tight, start=0.3).system_objects()[0]
    assert kept.start.tolist() == [0.3] * 6
    with pytest.raises(InfeasibleStart, match="energy"):
        gm.setup(tight, start=2.0).system_objects()


def test_a_run_has_its_system_data_and_figures(tmp_path):
    run = gm.run(GAME, agents=gm.flexible_robots(6), rho=0.02, **SHORT)
    assert run.status == "completed"
    assert run.system.rho == 0.02
    assert run.data["action"].dims == ("time", "agent")
    figures = run.plot(tmp_path / "new" / "figures")
    assert list(figures) == [
        "players-actions", "players-energy-value", "players-gap-values", "players-constraints",
    ]  # fmt: skip
    assert {path.stem for path in (tmp_path / "new" / "figures").iterdir()} == set(figures)
    assert len(figures._repr_html_()) < 400_000
    # every constraint is drawn with its bound, and the report has each margin at its worst
    (axes,) = figures["players-energy-value"].axes
    assert axes.lines[-1].get_ydata()[0] == 12.0
    least = run.reports["players"]["worst_constraint"]
    assert least["margin"] == min(least["each"])
    assert np.all(np.array(least["each"]) <= -run.data["constraint"].max("time").values + 1e-12)


def test_constraints_of_which_there_are_fewer_than_agents_are_drawn_too():
    def some(y, p):
        yield "cap", y.sum() <= 9.0
        for i in (1, 3):
            yield f"gap {i}", abs(y[i] - y[i - 1]) <= p.gap

    run = gm.run(gm.game(6, cost, some, weight=1.0, wanted=WANTED, price=0.2, gap=2.0), **SHORT)
    gap = run.data["gap_value"]
    assert gap.dims == ("time", "constraint")
    y = run.data["action"].values
    assert np.allclose(gap[:, 1:], np.stack([y[:, 1] - y[:, 0], y[:, 3] - y[:, 2]], axis=1))
    assert np.all(np.isnan(gap[:, 0]))
    (axes,) = run.plot()["players-gap-values"].axes
    assert [line.get_label() for line in axes.lines if line.get_label()[0] != "_"] == [
        "gap 1", "gap 3", "bound of\neach gap",
    ]  # fmt: skip


def test_a_plain_function_is_a_law():
    def action(game, rho, y, memory, gain=1.0):
        slope = game.constraint_jacobian(y).T @ (rho / -game.constraints(y))
        return -gain * (game.pseudo_gradient(y) + slope)

    own = gm.run(GAME, law=action, rho=0.1, **SHORT)
    package = gm.run(GAME, law=gm.full_information(), rho=0.1, **SHORT)
    assert np.allclose(own.data["action"], package.data["action"], rtol=0, atol=1e-12)
    faster = gm.setup(GAME, law=gm.own_law(action, gain=2.0), rho=0.1)
    assert faster.systems["players"].controller.parameters == {"gain": 2.0}
    changed = load_scenario(faster, {"controller.parameters.gain": 3.0})
    start = changed.system_objects()[0]
    assert np.allclose(
        3.0 * package.data["input"][0], gm.run(changed, **SHORT).data["input"][0], rtol=1e-12
    )
    assert start.law.information == "custom"


def test_a_law_with_a_memory():
    def action(game, rho, y, memory):
        return memory - y

    def rate(game, rho, y, memory):
        return np.zeros(len(y))

    law = gm.own_law(action, rate, lambda y: y + 1.0)
    run = gm.run(GAME, law=law, start=0.5, **SHORT)
    expected = 1.5 - np.exp(-run.data["time"].values)
    assert np.allclose(run.data["action"][:, 0], expected, rtol=0, atol=1e-9)
    with pytest.raises(InvalidInput, match="both of these functions"):
        gm.setup(GAME, law=gm.own_law(action, rate)).system_objects()


def test_solve_certify_and_check_take_what_there_is():
    solution = gm.solve(GAME, rho=[0.1, 0.02])
    assert [point.equilibrium.rho for point in solution.penalised] == [0.1, 0.02]
    scenario = gm.setup(GAME, rho=0.02, **SHORT)
    run = gm.run(scenario)
    for source in (scenario, run, run.system):
        assert gm.solve(source).penalised[0].equilibrium.action == pytest.approx(
            solution.penalised[1].equilibrium.action, abs=1e-9
        )
        assert gm.certify(source).status == "certified"
    assert gm.check(GAME).holds


def test_variations_are_a_small_table():
    scenario = gm.setup(GAME, **SHORT)
    seen = []
    found = gm.vary(
        scenario, {"law": [gm.full_information(), gm.partial_information()], "rho": [0.1, 0.01]},
        progress=lambda number, of: seen.append((number, of)),
    )  # fmt: skip
    assert seen == [(k, 4) for k in range(4)]
    assert [run.system.rho for run in found.runs] == [0.1, 0.01, 0.1, 0.01]
    table = found.table
    assert table["law"].tolist() == ["full, continuous"] * 2 + ["partial, continuous"] * 2
    for row, run in zip(table.to_dict("records"), found.runs, strict=True):
        assert row["least margin"] == run.reports["players"]["worst_constraint"]["margin"]
    assert repr(found).count("\n") == 4
    assert "<table" in found._repr_html_()


def test_a_batch_sweeps_a_games_numbers_and_laws(tmp_path):
    scenario = gm.setup(GAME, **SHORT)
    sweep = {"game.parameters.budget": [8.0, 12.0], "controller": [gm.full_information()]}
    runs = gm.batch(scenario, sweep, out=tmp_path / "runs")
    alone = gm.run(scenario, {"game.parameters.budget": 8.0})
    assert runs["final_action"][0].values.tolist() == alone.data["action"][-1].values.tolist()


def test_a_simulation_changes_by_keys():
    scenario = gm.setup(GAME, rho=0.1, **SHORT)
    simulation = scenario.simulation_object()
    simulation.advance(10)
    simulation.change({"barrier.rho": 0.02})
    simulation.change({"game.parameters.price": 0.4, "barrier.rho": 0.03})
    (system,) = simulation.systems
    assert system.rho == 0.03
    y = np.ones(6)
    other = GAME.changed(price=0.4)
    assert system.game.pseudo_gradient(y).tolist() == other.pseudo_gradient(y).tolist()
    assert [done["what"] for done in simulation.interventions] == [
        "barrier.rho = 0.02", "game.parameters.price = 0.4, barrier.rho = 0.03",
    ]  # fmt: skip
    # as a simulation that had the numbers from where this one is
    fresh = gm.setup(
        other, rho=0.03, start=simulation.runs["players"].loop.present().state[:, 0], **SHORT
    ).simulation_object()
    (ours,), (theirs,) = (list(each.step().values()) for each in (simulation, fresh))
    assert ours.input == pytest.approx(theirs.input, rel=1e-13)
    for changes, words in (
        ({"barrier.roh": 1.0}, "did you mean 'rho'"),
        ({"simulation.timestep": 0.005}, "it stays as it is"),
        ({"agents.input_limit": 1.0}, "it stays as it is"),
        ({"game.parameters.budget": 0.1}, "energy"),
    ):
        with pytest.raises((InvalidInput, InfeasibleStart), match=words):
            simulation.change(changes)
    assert simulation.systems == (system,)


# ------------------------------------------------------------------------------------ the top level


def test_everything_is_listed_documented_and_signed():
    assert set(gm.__all__) <= set(dir(gm))
    assert gm.__all__ == sorted(gm.__all__)
    for name in gm.__all__:
        thing = getattr(gm, name)
        assert thing is getattr(gm, name)
        if callable(thing):
            assert inspect.getdoc(thing), name
            assert inspect.signature(thing) is not None
    assert set(importlib.import_module("gne_mj.interface").__all__) < set(gm.__all__)


@pytest.mark.parametrize(
    ("wrong", "right"),
    [("cerify", "certify"), ("flexible_robot", "flexible_robots"), ("Grpah", "Graph")],
)
def test_a_wrong_name_is_answered_with_the_nearest(wrong, right):
    with pytest.raises(AttributeError, match=f"no attribute '{wrong}': did you mean '{right}'"):
        getattr(gm, wrong)
    with pytest.raises(AttributeError, match=r"no attribute 'zzzzzz'$"):
        _ = gm.zzzzzz


def test_reprs_are_short_and_say_what_it_is():
    run = gm.run(GAME, **SHORT)
    simulation = gm.load_scenario(GAME, {"simulation.duration": 1.0}).simulation_object()
    solution, guarantees = gm.solve(GAME), gm.certify(run)

    def still(game, rho, y, memory):
        return 0.0 * y

    def alone(agent, gain):
        return -gain * agent.y

    plain = gm.setup(GAME, law=still).system_objects()[0].law
    local = gm.setup(GAME, law=gm.own_law(alone, gain=1.0)).system_objects()[0].law
    shown = {
        "Game 'own game': 6 agents, 6 actions, 7 constraints": GAME,
        "Game 'velocity synchronisation": velocity_game(5, 3.0, 3.0),
        "System 'players': own game": run.system,
        "FullInformation()": run.system.law,
        "PlainLaw of still, without a memory": plain,
        "PlainLaw of alone, without a memory": local,
        "Graph of 6 agents, 6 edges, lambda_2 = 1": gm.ring(6),
        "Simulation of players: 0 of 1 s": simulation,
        "Trajectory of players: completed": run,
        "Scenario of players: expressions with 6 integrator": run.scenario,
        "Equilibrium at rho = 0.1: y = [": solution.penalised[0].equilibrium,
        "Solution of own game, 6 agents: variational GNE": solution,
        "Guarantees of 'players': certified": guarantees,
        "RobotAgents(": gm.flexible_robots(6, main_mass=2.0),
        "Figures: players-actions": run.plot(),
    }  # fmt: skip
    for words, thing in shown.items():
        assert words in repr(thing), repr(thing)
        assert len(repr(thing)) < 400
        assert repr(thing).count("\n") <= 1
    assert "multipliers" in str(solution)
    assert "guaranteed" in str(guarantees)


def printed(code):
    """What a program of its own prints."""
    done = subprocess.run(
        [sys.executable, "-c", code], env={**environment(), "PYTHONPATH": str(ROOT)},
        capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    return done.stdout


def test_the_top_level_is_as_light_as_before():
    heavy = printed(
        "import sys, gne_mj as gm; dir(gm); gm.__all__;"
        "print(sorted({'numba', 'scipy', 'pydantic', 'sympy'} & set(sys.modules)))"
    )
    assert heavy == "[]\n"


SNIPPET = """
import gne_mj as gm
{names}
def cost(i: int, y: object, p: object) -> object: ...
game: gm.Game = gm.game(3, cost, cost, price=1.0)
run: gm.Run = gm.run(game, agents=gm.flexible_robots(3), law=gm.partial_information(gm.ring(3)))
status: str = run.status
system: gm.System = run.system
gm.certify(run).to_dict()
gm.flexible_robots(3, main_mas=1.0)  # wrong
gm.run(game, rho="a")  # wrong
gm.cerify  # wrong
"""


@pytest.mark.slow
def test_types_are_known_to_a_type_checker(tmp_path):
    text = SNIPPET.format(names="\n".join(f"gm.{name}" for name in gm.__all__))
    (tmp_path / "snippet.py").write_text(text)
    done = subprocess.run(
        [sys.executable, "-m", "mypy", "--strict", "--follow-imports=silent",
         "--cache-dir", tmp_path / "cache", "snippet.py"],
        cwd=tmp_path, env={**environment(), "MYPYPATH": str(ROOT)}, capture_output=True, text=True,
        check=False,
    )  # fmt: skip
    lines = text.splitlines()
    wrong = {n for n, line in enumerate(lines, 1) if line.endswith("# wrong")}
    found = {int(n) for n in re.findall(r"^snippet\.py:(\d+): error", done.stdout, flags=re.M)}
    assert found == wrong, done.stdout


def test_the_ten_lines_run(tmp_path, monkeypatch, capsys):
    path = ROOT / "examples/python/energy_in_ten_lines.py"
    text = path.read_text().replace("duration=60.0", "duration=1.0")
    code = [line for line in text.split("\nimport", 1)[1].splitlines() if line.strip()]
    assert len([line for line in code if '"""' not in line]) <= 15
    script = tmp_path / "energy.py"
    script.write_text(text)
    monkeypatch.chdir(tmp_path)
    found = runpy.run_path(str(script))
    assert found["run"].status == "completed"
    assert (tmp_path / "results/energy/players-energy-value.png").stat().st_size > 5000
    printed = capsys.readouterr().out
    for words in ("players\n  status", "certified", "variational GNE"):
        assert words in printed


@pytest.mark.slow
def test_figures_leave_pyplot_and_its_backend_alone():
    told = printed(
        "import sys, matplotlib; matplotlib.use('svg');"
        "import gne_mj as gm; from gne_mj.expressions import game;"
        "one = game(2, lambda i, y, p: y[i]**2, lambda y, p: iter([y.sum() <= 1.0]));"
        "run = gm.run(one, start=0.1, duration=0.01); figures = run.plot(); figures._repr_html_();"
        "print(matplotlib.get_backend(), 'matplotlib.pyplot' in sys.modules, len(figures) > 1)"
    )
    assert told.split() == ["svg", "False", "True"]


@pytest.mark.parametrize("count", [5, 7])
def test_a_graph_of_another_size_is_refused(count):
    with pytest.raises(InvalidInput, match="graph"):
        gm.setup(GAME, law=gm.partial_information(gm.ring(count))).system_objects()


def test_a_run_is_printed_as_commands_print_it():
    run = gm.run(GAME, **SHORT)
    lines = str(run).splitlines()
    assert lines[0] == "players"
    assert lines[1].split()[:2] == ["status", f"{run.status}:"]
    assert any(line.startswith("  least margin ") for line in lines)
