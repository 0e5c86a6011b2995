"""What is too large, long or deep is refused in a short sentence, before anything is allocated."""

import datetime
import json
import os
import tomllib
from pathlib import Path

import numpy as np
import pytest
from builders import integrators
from commands import gne_here

from gne_mj import bounds, graph, lines
from gne_mj.errors import GneError, InvalidInput, UserCodeError, shown
from gne_mj.exit_map import Grid
from gne_mj.games import cournot_game, velocity_game
from gne_mj.passivity import examine, plants_of
from gne_mj.scenario import load_scenario, parse_value, shipped
from gne_mj.simulation import Simulation
from gne_mj.solutions import parse_path
from gne_mj.system import Clock
from gne_mj.toml_table import Table

SHORT = 400  # characters of a refusal on stderr


def refusal(*arguments):
    """What the command says on stderr, which is one short line."""
    done = gne_here(*arguments)
    assert done.returncode == 2, done
    assert done.stderr.startswith("gne-mj: ")
    assert done.stderr.count("\n") == 1
    assert len(done.stderr) < SHORT
    return done.stderr


# ----------------------------------------------------------------------------------- messages


@pytest.mark.parametrize(
    "value",
    [
        "x" * 100_000, [0.5] * 20_000, {f"k{i}": i for i in range(1000)}, 10**5000, "\n" * 50_000,
        np.zeros(5000), "\x1b[31m", "\udcff", [[0.1] * 50] * 50,
    ],
    ids=lambda value: type(value).__name__,
)  # fmt: skip
def test_messages_are_one_short_line(value):
    for error in (
        InvalidInput("a.key", value, "it must be a number"),
        InvalidInput("long." * 1000, value, "it must be " + "right " * 1000),
        UserCodeError(lambda: None, f"it returned {shown(value)}", "y" * 1000),
    ):
        text = str(error)
        assert len(text) <= 350
        assert text.isprintable()
        text.encode("utf-8")
    assert str(InvalidInput("a.key", value, "it must be small")).endswith("it must be small")


def test_ordinary_messages_are_whole():
    assert str(InvalidInput("a.b", [1.0, 2.0], "it must be short")) == (
        "a.b: got [1.0, 2.0], but it must be short"
    )
    deep = []
    for _ in range(100_000):
        deep = [deep]
    assert "too large to be shown" in shown(deep)
    while deep:  # or freeing it would recur
        deep = deep.pop()
    assert str(GneError("a" * 350)) == "a" * 350
    cut = str(GneError("a" * 300 + "z" * 300))
    assert len(cut) == 350
    assert cut.startswith("a" * 200)
    assert cut.endswith("z" * 100)
    assert " ... " in cut


# ------------------------------------------------------------------------------- command lines


@pytest.mark.parametrize(
    ("line", "words"),
    [
        ("nothing", "No such command 'nothing'"),
        ("run velocity-sync --nothing", "--nothing"),
        ("run a b", "extra argument"),
        ("solve", "SCENARIO"),
        ("solve velocity-sync --rho", "--rho"),
        ("passivity velocity-sync --trials many", "--trials"),
        ("view . --port 99999999999999999999", "65535"),
        ("--nothing", "--nothing"),
        ("run " + "x" * 5000, "it must name a file ending in .toml"),
        ("run " + "x" * 5000 + ".toml", "it cannot be read"),
        ("solve velocity-sync --path 1:2:99999999999", "10000"),
        ("map velocity-sync --periods 1:2:99999999999", "10000"),
        ("map velocity-sync --runs 1000000000", "at most 10000000"),
        ("passivity velocity-sync --trials 1000000000", "at most 10000000"),
        ("batch velocity-sync --runs 100000000000 --out nothing-here", "10000000 runs at most"),
        ("batch velocity-sync --runs 9 --chunk 9" + "0" * 17 + " --out nothing-here", "--chunk"),
        ("batch velocity-sync --sweep barrier.rho=1:2:99999999999 --out nothing-here", "100000"),
    ],
    ids=range(17),
)
def test_a_command_line_that_cannot_be(line, words):
    assert words in refusal(*line.split())


def test_a_command_line_that_cannot_be_as_json():
    done = gne_here("solve", "--json", "--rho", "much", "velocity-sync")
    assert json.loads(done.stdout)["status"] == "invalid_input"
    assert "--rho" in json.loads(done.stdout)["message"]


def test_too_many_threads(tmp_path):
    line = "batch velocity-sync --set simulation.duration=0.05 --runs 1 --threads 1000000000 --out"
    assert "--threads" in refusal(*line.split(), tmp_path / "batch")


# ----------------------------------------------------------------------------------- files


@pytest.mark.parametrize("depth", [33, 300, 20_000])
@pytest.mark.parametrize("kind", ["tables", "dotted", "lists"])
def test_deep_nesting(tmp_path, depth, kind):
    text = {
        "tables": "a = " + "{a = " * depth + "1" + "}" * depth,
        "dotted": ".".join("a" * depth) + " = 1",
        "lists": "a = " + "[" * depth + "]" * depth,
    }[kind]
    file = tmp_path / "deep.toml"
    file.write_text(text)
    assert "deep" in refusal("run", file)
    if kind == "lists":
        value = refusal("run", "velocity-sync", "--set", f"initial.{text.replace(' ', '')}")
        assert "initial.a" in value
        change = f"initial.action={'[' * depth}{']' * depth}"
        assert "initial.action" in refusal("run", "velocity-sync", "--set", change)


def test_deep_nesting_in_mappings():
    tables = tomllib.loads(shipped()["velocity-sync"])
    deep = 1
    for _ in range(300):
        deep = {"a": deep}
    for place in (tables, tables["systems"]["robots"]["game"]):
        place["deep"] = deep
        with pytest.raises(InvalidInput, match="32 deep at most"):
            load_scenario(tables)
        del place["deep"]
    bounds.check_nesting("key", json.loads("[" * 31 + "1" + "]" * 31))


def test_files_that_are_none(tmp_path):
    (tmp_path / "zero.toml").symlink_to("/dev/zero")
    assert "no ordinary file" in refusal("run", tmp_path / "zero.toml")
    os.mkfifo(tmp_path / "pipe.toml")
    assert "no ordinary file" in refusal("run", tmp_path / "pipe.toml")
    (tmp_path / "folder.toml").mkdir()
    assert "directory" in refusal("run", tmp_path / "folder.toml")
    with (tmp_path / "long.toml").open("wb") as file:
        file.truncate(bounds.MOST_FILE + 1)
    assert "32 MiB" in refusal("run", tmp_path / "long.toml")
    game = tmp_path / "game.toml"
    game.write_text(
        '[systems.a]\ngame = {type = "custom", file = "/dev/zero"}\n'
        'agents = {type = "integrator", count = 2}\ninitial = {action = 0.0}\n'
    )
    assert "no ordinary file" in refusal("run", game)


def test_integers_of_thousands_of_digits(tmp_path):
    file = tmp_path / "long.toml"
    file.write_text("a = " + "9" * 5000)
    assert "not valid TOML" in refusal("run", file)
    assert parse_value("9" * 5000) == "9" * 5000


@pytest.mark.parametrize("key", ["it's", 'a"b', "a\nb", "a.b", "é", "x" * 10_000])
def test_keys_of_any_letters(key):
    tables = tomllib.loads(shipped()["velocity-sync"])
    tables["systems"]["robots"]["barrier"][key] = 1
    with pytest.raises(InvalidInput, match="there is no such key"):
        load_scenario(tables)


# ----------------------------------------------------------------------------------- numbers

TOO_MUCH = {
    "simulation.timestep": (5e-324, 1e-300, 1e300, 10**40, datetime.date(2026, 1, 1)),
    "simulation.duration": (1e300, 1e13, 10**400, "long", datetime.time(1)),
    "simulation.control_period": (2**63 - 1, 1e300, 5e-324),
    "recording.period": (1e300, 5e-324),
    "agents.count": (10**9, 10**40, 2**63, 1e300, datetime.date(2026, 1, 1)),
    "simulation.seed": (2**63, -1, 10**40),
    "barrier.rho": (10**400, datetime.datetime(2026, 1, 1)),
    "game.gap_bound": ([1.0] * 20_000, [[3.0]], "wide", 10**400),
    "agents.main_mass": (datetime.date(2026, 1, 1), [10**400] * 5),
    "initial.action": ([0.0] * 100_000, {}),
    "margin": ({"delay": 2**63 - 1}, {"push": 10**400}),
    "faults": ([{"type": "sensor-delay", "periods": 10**12}], [{"type": "push", "force": 10**400}]),
}


@pytest.mark.parametrize(("key", "value"), [(k, v) for k, each in TOO_MUCH.items() for v in each])
def test_numbers_that_are_too_much(key, value):
    with pytest.raises(InvalidInput) as caught:
        load_scenario("velocity-sync", {key: value}).simulation_object()
    assert key.split(".")[-1] in caught.value.key
    assert len(str(caught.value)) <= 350


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"recording.period": 0.002, "simulation.duration": 1e6}, "recording.period.*GB"),
        ({"simulation.timestep": 1e-11, "simulation.duration": 1e6}, "duration.*9e.15 timesteps"),
        ({"agents.count": 20_000, "controller": {"information": "partial"}}, "estimate.*GB"),
        (
            {"agents.count": 5000, "controller": {"information": "partial", "graph": "complete"}},
            "edges",
        ),
        (
            {"simulation.control_period": 2000.0, "controller.mode": "implicit"},
            "simulation.control_period: got .*its timesteps",
        ),
    ],
)
def test_products_that_are_too_much(changes, words):
    with pytest.raises(InvalidInput, match=words):
        load_scenario("velocity-sync", changes).simulation_object()


def test_what_fits_is_not_refused():
    scenario = load_scenario(
        "velocity-sync",
        {"simulation.timestep": 1e-12, "simulation.duration": 1e-10, "recording.period": 1e-11},
    )
    assert scenario.simulation_object().run().status == "completed"
    clock = Clock(1e12, 1e12, 1e12, 1e12)
    assert clock.steps(clock.duration) == 1


@pytest.mark.parametrize("field", range(4))
@pytest.mark.parametrize("value", [5e-324, 9e-13, 1.1e12, 1e300])
def test_times_of_a_clock(field, value):
    times = [1.0, 1.0, 1.0, 1.0]
    times[field] = value
    with pytest.raises(InvalidInput, match=r"it must lie from 1e-12 to 1e\+12 s"):
        Clock(*times)


def test_sizes_of_games_and_graphs():
    assert cournot_game(3).agents == 3
    with pytest.raises(InvalidInput, match="at most 2000"):
        cournot_game(2001)
    with pytest.raises(InvalidInput, match="at most 50000"):
        velocity_game(50_001, 3.0, 3.0)
    with pytest.raises(InvalidInput, match="at most 500000"):
        graph.complete(1001)
    with pytest.raises(InvalidInput, match="matrix of the velocity synchronisation game"):
        velocity_game(20_000, 3.0, 3.0).pseudo_gradient_jacobian(np.zeros(20_000))


def test_ranges_maps_and_trials():
    assert len(parse_path("1:2:10000")) == 10_000
    with pytest.raises(InvalidInput, match="from 2 to 10000"):
        parse_path("1:2:10001")
    for runs, duration, words in ((10**7, 1.0, "^runs"), (1, np.inf, "^duration")):
        with pytest.raises(InvalidInput, match=words):
            Grid((0.1,), (0.1,), runs=runs, duration=duration)
    build = plants_of(integrators(1), "ode", "euler")
    for options, words in (
        ({"trials": 10**9}, "trials"), ({"duration": 1e30}, "duration"),
    ):  # fmt: skip
        with pytest.raises(InvalidInput, match=words):
            examine(build, 0.1, **options)
    with pytest.raises(InvalidInput, match="what a trial"):
        examine(plants_of(integrators(20_000), "ode", "euler"), 0.001, duration=100.0)


def test_trials_tell_how_far_they_are():
    told = []
    build = plants_of(integrators(300), "ode", "euler")
    examine(build, 0.1, duration=4.0, trials=3, progress=lambda *now: told.append(now))
    assert told[0] == (0.0, 1.0, "3 trials of 4 s for each of 300 agents, at up to 3 amplitudes")
    # one trial of 300 channels at a time, of 20 held inputs of two steps, at each amplitude
    assert [done for done, _, _ in told[1:]] == pytest.approx(np.arange(1, 181) / 180)
    assert told[90][2] == "50% of all trials"


def test_every_table_bounds_its_numbers():
    """No field of a table takes a number that is not finite."""
    assert not Table.model_config["allow_inf_nan"]


# ----------------------------------------------------------------------------- long ways in pieces


def test_samples_that_are_far_apart(monkeypatch):
    """A run looks at the user's wishes between them, and takes the same steps."""
    changes = {"simulation.duration": 0.6, "recording.period": 0.2, "controller.mode": "sampled"}
    once = load_scenario("velocity-sync", changes).simulation_object().run()["robots"]
    monkeypatch.setattr("gne_mj.simulation._FIRST", 7)
    calls = []
    simulation: Simulation = load_scenario("velocity-sync", changes).simulation_object()
    pieces = simulation.run(calls.append)["robots"]
    assert calls[:2] == pytest.approx([7 * 0.002, 77 * 0.002])
    for name in ("time", "action", "input", "state"):
        np.testing.assert_array_equal(once[name].to_numpy(), pieces[name].to_numpy())


def test_steps_without_rows(monkeypatch):
    (system,) = load_scenario("velocity-sync").system_objects()
    clock = Clock(1.0, 0.002, 0.002, 1.0)
    once, pieces = system.closed_loop(clock), system.closed_loop(clock)
    once.advance(1, 100)
    monkeypatch.setattr("gne_mj.loops.base.PIECE", 7)
    pieces.pass_over(100)
    assert pieces.time == once.time
    np.testing.assert_array_equal(pieces.present().state, once.present().state)


def test_parameters_that_overflow():
    """They are the user's numbers, not a fault in the shipped game's code."""
    done = gne_here("run", "velocity-sync", "--set", "game.gap_bound=1e300")
    assert done.returncode == 2
    assert len(done.stderr.splitlines()) == 1
    assert "invalid_input" not in done.stderr
    assert "game: got" in done.stderr
    assert "overflow encountered" in done.stderr


@pytest.mark.parametrize("start", [1e200, -1e300, 1.7e308])
def test_starts_that_overflow(start):
    """They are outside, in one sentence and without a warning, which here is an error."""
    done = gne_here("run", "velocity-sync", "--set", f"initial.action={start}")
    assert done.returncode == 2
    assert "must be negative" in done.stderr
    (system,), moved = load_scenario("velocity-sync", {"initial.action": start}).inside_systems()
    assert np.all(system.game.constraints(system.start) < 0.0)
    assert moved


@pytest.mark.parametrize("length", [5e-324, 1e-310, 1.0, 1e300, 1.7e308])
@pytest.mark.parametrize("own", [[], [0, 1]])
def test_lines_of_any_length_end(length, own):
    """Doubling neither begins at zero nor goes on at infinity."""
    game = velocity_game(3, 3.0, 3.0)
    y, direction = np.full(3, 3.0), np.array([1.0, 0.0, 0.0])
    with np.errstate(over="ignore", invalid="ignore"):
        found = lines.end(game.data, 0, np.array(own), y, direction, 1.0, length, y.copy())
    assert 0.0 <= found < np.inf
    if own and length == 1.0:
        assert found == pytest.approx(3.0, rel=1e-12)


@pytest.mark.parametrize(
    "arguments",
    [
        ("map", "velocity-sync", "--set", "agents.damping=1e19", "--periods", "0.002:0.01:2",
         "--margins", "0.1:0.5:2", "--pushes", "0", "--runs", "1", "--duration", "0.02"),
        ("check", "osnr", "--set", "game.total_power_limit=1e300"),
        ("run", "CHARGING", "--set", "game.parameters.capacity=1e308", "--set",
         "simulation.duration=0.02"),
    ],
)  # fmt: skip
def test_numbers_that_overflow_on_the_way_are_no_warnings(arguments):
    own = Path(__file__).parent.parent / "examples" / "game" / "scenario.toml"
    done = gne_here(*(str(own) if each == "CHARGING" else each for each in arguments))
    assert done.returncode == 0
    assert done.stderr == ""
