"""The installed command: what it prints, what it writes, and its exit status."""

import json
import signal
import subprocess
import sys
import time
import tomllib
from types import SimpleNamespace

import pytest
import typer.main
from commands import COMMAND, environment, gne, gne_here

import gne_mj
from gne_mj.cli import app, signals
from gne_mj.scenario import load_scenario, shipped

COMMANDS = tuple(typer.main.get_command(app).commands)
SHORT = ("--set", "simulation.duration=0.2")
# crosses the barrier at a stage of its first step
LEAVING = (
    "--set", "initial.action=[0.01, 2.99, 3, 3, 3]", "--set", "simulation.timestep=0.2",
    "--set", "recording.period=0.2", "--set", "simulation.duration=2",
    "--set", "controller.mode=sampled", "--set", "simulation.control_period=0.4",
)  # fmt: skip
# What only some commands need, a tenth of a second or more each
STORING = {"xarray", "zarr", "pandas", "matplotlib", "asyncio"}
NUMERICAL = {"scipy.linalg", "scipy.sparse", "scipy.special", "scipy.optimize", "scipy.spatial"}
HEAVY = {"numba", "mujoco", "xarray", "matplotlib", "scipy", "zarr", "dm_control"}


@pytest.fixture(scope="module")
def finished(tmp_path_factory):
    """A short run, and what was printed."""
    folder = tmp_path_factory.mktemp("cli") / "run"
    return folder, gne("run", "velocity-sync", *SHORT, "--out", folder)


def test_version():
    done = gne("--version")
    assert (done.returncode, done.stdout, done.stderr) == (0, f"gne-mj {gne_mj.__version__}\n", "")


@pytest.mark.parametrize("command", [(), *((name,) for name in COMMANDS)], ids=str)
def test_help_answers_without_heavy_modules(command):
    code = f"""
import sys
sys.argv = ["gne-mj", *{command!r}, "--help"]
from gne_mj.cli import main
try:
    main()
except SystemExit as ended:
    heavy = sorted({HEAVY!r} & set(sys.modules))
    print("heavy:", heavy, ended.code)
"""
    done = subprocess.run(
        [sys.executable, "-c", code], env=environment(), capture_output=True, text=True, check=False
    )
    assert done.stderr == ""
    assert done.stdout.splitlines()[-1] == "heavy: [] 0"
    assert "Usage" in done.stdout
    if not command:
        for name in COMMANDS:
            assert name in done.stdout


@pytest.mark.parametrize(
    ("command", "unneeded"),
    [
        (("run", "velocity-sync", *SHORT), STORING | NUMERICAL),
        (("solve", "osnr"), STORING | NUMERICAL | {"mujoco"}),
        (("certify", "velocity-sync"), STORING | {"scipy.special", "scipy.optimize"}),
    ],
    ids=lambda value: value[0] if isinstance(value, tuple) else "",
)
def test_a_command_loads_only_what_it_needs(command, unneeded):
    code = f"""
import sys
sys.argv = ["gne-mj", *{command!r}, "--json"]
from gne_mj.cli import main
try:
    main()
finally:
    print(sorted({unneeded!r} & set(sys.modules)), file=sys.stderr)
"""
    program = [sys.executable, "-c", code]
    for _ in range(2):  # the first one may have to compile, for which numba loads all it has
        done = subprocess.run(
            program, env=environment(), capture_output=True, text=True, check=True
        )
        loaded = done.stderr.splitlines()[-1]
        if loaded == "[]":
            break
    assert loaded == "[]"


def test_no_command_shows_the_help():
    done = gne()
    assert "Usage" in done.stdout + done.stderr
    assert "Traceback" not in done.stderr


def test_run_writes_trajectory_and_report(finished):
    folder, done = finished
    assert done.returncode == 0
    assert done.stderr == "", "no warning, no progress bar"
    assert "\r" not in done.stdout
    assert {path.name for path in folder.iterdir()} == {"trajectory.zarr", "report.json"}
    assert [path.name for path in folder.parent.iterdir()] == ["run"]
    report = json.loads((folder / "report.json").read_text())
    assert report["status"] == report["systems"]["robots"]["status"] == "completed"
    assert report["systems"]["robots"]["end_time"] == pytest.approx(0.2)
    for words in ("robots", "completed", "least margin", "peak input", str(folder)):
        assert words in done.stdout
    assert gne_mj.Trajectory.load(folder / "trajectory.zarr").report() == report
    assert folder.stat().st_mode & 0o777 == 0o755


def test_json_is_one_document(tmp_path):
    out = tmp_path / "run"
    done = gne("run", "velocity-sync", *SHORT, "--json", "--out", out)
    assert (done.returncode, done.stderr) == (0, "")
    report = json.loads(done.stdout)
    assert report["status"] == "completed"
    assert report == json.loads((out / "report.json").read_text())


def test_nothing_is_written_unless_asked(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    done = gne_here("run", "velocity-sync", *SHORT)
    assert done.returncode == 0
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("as_json", [False, True], ids=["words", "json"])
def test_leaving_the_set_fails_and_keeps_the_results(tmp_path, as_json):
    out = tmp_path / "run"
    command = gne_here if as_json else gne
    done = command("run", "velocity-sync", *LEAVING, "--out", out, *(["--json"] if as_json else []))
    assert done.returncode == 1
    report = json.loads((out / "report.json").read_text())
    assert report["status"] == "left_feasible_set"
    assert "constraint 'gap of agent" in report["systems"]["robots"]["message"]
    assert (out / "trajectory.zarr").is_dir()
    if as_json:
        assert json.loads(done.stdout) == report
    else:
        assert "left_feasible_set: " in done.stdout


def test_values_are_set_in_order(tmp_path):
    out = tmp_path / "run"
    gne_here("run", "velocity-sync", *SHORT, "--set", "simulation.duration=0.1",
        "--set", "barrier.rho = 0.2", "--out", out)  # fmt: skip
    scenario = json.loads(gne_mj.Trajectory.load(out / "trajectory.zarr").tree.attrs["scenario"])
    assert scenario["simulation"]["duration"] == 0.1
    assert scenario["systems"]["robots"]["barrier"]["rho"] == 0.2


def test_an_existing_folder_is_not_run_over(finished):
    folder, _ = finished
    before = (folder / "report.json").read_bytes()
    done = gne_here("run", "velocity-sync", *SHORT, "--out", folder)
    assert done.returncode == 2
    assert done.stdout == ""
    assert "it exists already" in done.stderr
    assert (folder / "report.json").read_bytes() == before


def test_an_input_limit_that_is_met_is_warned_of():
    done = gne_here("run", "velocity-sync", *SHORT, "--set", "agents.input_limit=2.5")
    assert done.returncode == 0
    assert done.stderr.count("\n") == 1
    for words in ("gne-mj: warning: systems.robots", "agent 1", "4.055", "2.5", "guaranteed"):
        assert words in done.stderr


def test_plot_draws_into_the_runs_folder(finished):
    folder, _ = finished
    done = gne_here("plot", folder)
    assert (done.returncode, done.stderr) == (0, "")
    assert {path.name for path in folder.glob("*.png")} == {
        "robots-velocities.png", "robots-gaps.png", "robots-constraints.png",
    }  # fmt: skip


def test_plot_refuses(finished, tmp_path):
    folder, _ = finished
    bad_format = gne_here("plot", folder, "--format", "jpg", "--out", tmp_path / "new")
    assert bad_format.returncode == 2
    assert "png, pdf, svg" in bad_format.stderr
    no_run = gne_here("plot", tmp_path, "--out", tmp_path / "new")
    assert no_run.returncode == 2
    assert "trajectory.zarr" in no_run.stderr
    for done in (bad_format, no_run):
        assert done.stdout == ""
        assert done.stderr.count("\n") == 1
    assert list(tmp_path.iterdir()) == []


def test_scenarios_are_listed_and_printed(tmp_path):
    done = gne_here("scenarios")
    assert (done.returncode, done.stderr) == (0, "")
    assert [line.split()[0] for line in done.stdout.splitlines()] == list(shipped())
    assert {"velocity-sync", "osnr", "paper"} <= set(shipped())
    for name in shipped():
        done = gne_here("scenarios", name)
        assert done.returncode == 0
        assert tomllib.loads(done.stdout)
        mine = tmp_path / f"{name}.toml"
        mine.write_text(done.stdout)
        assert load_scenario(mine) == load_scenario(name)
    unknown = gne_here("scenarios", "papr")
    assert unknown.returncode == 2
    assert "did you mean 'paper'?" in unknown.stderr


def test_a_file_of_ones_own_runs(tmp_path):
    mine = tmp_path / "mine.toml"
    mine.write_text(shipped()["velocity-sync"].replace("duration = 30.0", "duration = 0.1"))
    done = gne_here("run", mine, "--json")
    assert (done.returncode, done.stderr) == (0, "")
    assert json.loads(done.stdout)["systems"]["robots"]["end_time"] == pytest.approx(0.1)


def test_ctrl_c_before_the_run_leaves_nothing(tmp_path):
    process = subprocess.Popen(
        [COMMAND, "run", "velocity-sync", "--out", tmp_path / "run"],
        env=environment(), stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
    )  # fmt: skip
    time.sleep(0.25)  # still importing
    process.send_signal(signal.SIGINT)
    process.communicate(timeout=60)
    assert process.returncode != 0
    assert list(tmp_path.iterdir()) == []


def test_a_closed_pipe_is_no_traceback():
    done = subprocess.run(
        f"'{COMMAND}' scenarios paper | head -n 1",
        shell=True, env=environment(), capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert done.stdout.startswith("description")
    assert "Traceback" not in done.stderr


@pytest.mark.parametrize("name", ["SIGINT", "SIGTERM"])
def test_a_signal_that_strikes_a_finaliser_is_heard(name):
    code = f"""
import signal, time
from gne_mj.cli import signals
class Finalised:
    def __del__(self):
        signal.raise_signal(signal.{name})
        sum(range(9))
try:
    with signals.unwinding():
        Finalised()
        end = time.monotonic() + 30
        while time.monotonic() < end:
            time.sleep(0.01)
except KeyboardInterrupt:
    print("heard", signals.received() == signal.{name})
"""
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert (done.stdout, done.stderr) == ("heard True\n", "")


@pytest.mark.parametrize("name", ["SIGINT", "SIGTERM", "SIGHUP"])
@pytest.mark.parametrize(
    ("module", "path", "raised"),
    [
        ("typer.main", "get_command", "KeyboardInterrupt"),  # commands are put together
        ("typer.core", "TyperGroup.parse_args", "KeyboardInterrupt"),  # the line is read
        ("gne_mj.scenario", "load_scenario", "KeyboardInterrupt"),
        ("gne_mj.scenario", "load_scenario", "ImportError"),  # what an extension makes of it
    ],
)
def test_a_signal_ends_a_command_wherever_it_strikes(name, module, path, raised):
    code = f"""
import importlib, signal, sys
def struck(*arguments, **options):
    try:
        signal.raise_signal(signal.{name})
        sum(range(9))
    except KeyboardInterrupt:
        raise {raised}
owner = importlib.import_module("{module}")
*kinds, name = "{path}".split(".")
for kind in kinds:
    owner = getattr(owner, kind)
setattr(owner, name, struck)
sys.argv = ["gne-mj", "run", "velocity-sync", "--set", "simulation.duration=0.01"]
from gne_mj.cli import main
main()
"""
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    number = getattr(signal, name)
    assert (done.returncode, done.stderr) == (128 + number, "gne-mj: interrupted\n")


def test_what_listened_before_a_command_listens_again(monkeypatch):
    """To what Python cannot raise, and to signals; one of before is no matter of this command."""
    heard = []
    monkeypatch.setattr(sys, "unraisablehook", heard.append)
    handlers = {number: signal.getsignal(number) for number in signals.ENDING}
    with pytest.raises(KeyboardInterrupt), signals.unwinding():
        signal.raise_signal(signal.SIGTERM)
    assert signals.came()
    with signals.unwinding():
        assert not signals.came()
        sys.unraisablehook(SimpleNamespace(exc_value=ValueError("else")))
    assert len(heard) == 1
    assert sys.unraisablehook == heard.append
    assert {number: signal.getsignal(number) for number in signals.ENDING} == handlers
