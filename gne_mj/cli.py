"""The command line. Heavy modules are imported where they are needed, so that --help is quick."""

import json
import shutil
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

if TYPE_CHECKING:
    from gne_mj.simulation import Simulation
    from gne_mj.trajectory import Trajectory

app = typer.Typer(
    add_completion=False,
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    help="Robots that seek a generalized Nash equilibrium and never leave their constraint set.",
)

_SCENARIO = Annotated[
    str, typer.Argument(help="Name of a shipped scenario (see `scenarios`), or a .toml file.")
]
_SET = Annotated[
    list[str] | None,
    typer.Option("--set", metavar="KEY=VALUE", help="Change a value; may be repeated."),
]
_OUT = Annotated[
    Path | None, typer.Option("--out", metavar="DIR", help="Folder to write; must not exist.")
]
_JSON = Annotated[bool, typer.Option("--json", help="Print the report as JSON and nothing else.")]
_PREPARING = "preparing (a first run compiles for a few seconds)"


@app.command()
def run(scenario: _SCENARIO, set_: _SET = None, out: _OUT = None, as_json: _JSON = False) -> None:
    """Run a scenario; keep the trajectory and a JSON report in --out."""
    trajectory = _simulate(scenario, set_, out, quiet=as_json)
    _tell(trajectory, as_json)
    if out is not None and not as_json:
        print(f"\ntrajectory  {out / 'trajectory.zarr'}\nreport      {out / 'report.json'}")
    raise typer.Exit(0 if trajectory.holds else 1)


@app.command()
def certify(
    scenario: _SCENARIO,
    set_: _SET = None,
    as_json: _JSON = False,
    search: Annotated[
        bool,
        typer.Option(
            "--search-epsilon", help="Find by trial runs the largest epsilon that stays inside."
        ),
    ] = False,
    period: Annotated[
        bool,
        typer.Option(
            "--search-period",
            help="Mode implicit: find by trial runs the longest period that stays inside between"
            " the control instants too.",
        ),
    ] = False,
    push: Annotated[
        bool,
        typer.Option(
            "--search-push",
            help="Mode implicit: find by trial runs the smallest push that leaves the set.",
        ),
    ] = False,
) -> None:
    """Tell what the theory guarantees for a scenario's systems, and what it does not."""
    from dataclasses import asdict, replace

    from gne_mj.errors import InvalidInput
    from gne_mj.scenario import load_scenario
    from gne_mj.theory import certify as examine
    from gne_mj.theory import search_epsilon, search_period, search_push, words

    loaded = load_scenario(scenario, _settings(set_))
    clock = loaded.clock()
    systems = loaded.system_objects()
    reports = {system.name: examine(system, clock) for system in systems}
    if search:
        searched = [s for s in systems if reports[s.name].epsilon is not None]
        if not searched:
            raise InvalidInput("--search-epsilon", scenario, "no system has the distributed law")
        for system in searched:
            with _working(as_json, f"searching epsilon of {system.name}") as tell:
                found = asdict(search_epsilon(system, clock, tell))
            epsilon = {**(reports[system.name].epsilon or {}), "search": found}
            reports[system.name] = replace(reports[system.name], epsilon=epsilon)
    for option, wanted, key, hunt in (
        ("--search-period", period, "period_search", search_period),
        ("--search-push", push, "push_search", search_push),
    ):
        searched = [s for s in systems if wanted and reports[s.name].held is not None]
        if wanted and not searched:
            raise InvalidInput(option, scenario, "no system is in mode 'implicit'")
        for system in searched:
            with _working(as_json, f"searching for {system.name}") as tell:
                found = asdict(hunt(system, clock, tell))
            held = {**(reports[system.name].held or {}), key: found}
            reports[system.name] = replace(reports[system.name], held=held)
    if as_json:
        print(json.dumps({name: report.to_dict() for name, report in reports.items()}, indent=2))
    else:
        for report in reports.values():
            print("\n".join(words(report)))


@app.command()
def paper(
    set_: _SET = None,
    out: Annotated[
        Path, typer.Option("--out", metavar="DIR", help="Folder for the results.")
    ] = Path("results/paper"),
    as_json: _JSON = False,
) -> None:
    """Run the paper's two experiments beside each other and draw its four figures.

    Results of an earlier `paper` in the same folder are replaced; other files there stay.
    """
    trajectory = _simulate("paper", set_, out, quiet=as_json, replace=True, figures=("png",))
    _tell(trajectory, as_json)
    if not as_json:
        print(f"\ntrajectory  {out / 'trajectory.zarr'}\nreport      {out / 'report.json'}")
        for figure in sorted(out.glob("*.png")):
            print(f"figure      {figure}")
    raise typer.Exit(0 if trajectory.holds else 1)


@app.command()
def solve(
    scenario: _SCENARIO,
    set_: _SET = None,
    system: Annotated[
        str | None, typer.Option("--system", metavar="NAME", help="Solve this system only.")
    ] = None,
    rho: Annotated[
        list[float] | None,
        typer.Option("--rho", help="In place of the scenario's penalty; may be repeated."),
    ] = None,
    path: Annotated[
        str | None,
        typer.Option("--path", metavar="FROM:TO:COUNT", help="Equilibria over a range of rho."),
    ] = None,
    out: _OUT = None,
    as_json: _JSON = False,
) -> None:
    """Compute a scenario's penalised and variational equilibria, without running it.

    --out keeps a JSON report and, of a path, a CSV table and a figure for each system.
    """
    from gne_mj import solve as solving
    from gne_mj.errors import InvalidInput, nearest

    rhos = [] if path is None else solving.parse_path(path)
    simulation = _load(scenario, set_, quiet=as_json)
    systems = [each for each in simulation.systems if system in (None, each.name)]
    if not systems:
        names = [each.name for each in simulation.systems]
        raise InvalidInput("--system", system, nearest(str(system), names))
    with _working(as_json, _PREPARING):
        solutions = [solving.solve_system(each, rho or (), rhos) for each in systems]
    report = json.dumps({each.name: each.to_dict() for each in solutions}, indent=2)
    with _results(out, replace=False) as folder:
        if folder is not None:
            (folder / "report.json").write_text(report + "\n", encoding="utf-8")
            if path is not None:
                from gne_mj import plots

                for each in solutions:
                    solving.write_path(each, folder / f"{each.name}-path.csv")
                    plots.save_path(each, folder / f"{each.name}-path.png")
    if as_json:
        print(report)
    else:
        print("\n\n".join("\n".join(solving.summary(each)) for each in solutions))


@app.command()
def plot(
    run_folder: Annotated[
        Path, typer.Argument(metavar="RUN", help="Folder that `run --out` or `paper` wrote.")
    ],
    out: Annotated[
        Path | None, typer.Option("--out", metavar="DIR", help="Where to; RUN if left out.")
    ] = None,
    format_: Annotated[
        list[str] | None, typer.Option("--format", help="png, pdf or svg; may be repeated.")
    ] = None,
) -> None:
    """Draw the figures of a stored run."""
    from gne_mj import plots
    from gne_mj.errors import InvalidInput
    from gne_mj.trajectory import Trajectory

    store = run_folder / "trajectory.zarr"
    if not store.is_dir():
        raise InvalidInput("RUN", str(run_folder), "it must be a folder with a trajectory.zarr")
    formats = tuple(format_ or ("png",))
    for name in formats:
        if name not in plots.FORMATS:
            raise InvalidInput("--format", name, f"choose from {', '.join(plots.FORMATS)}")
    try:
        trajectory = Trajectory.load(store)
    except (OSError, KeyError):
        raise InvalidInput(
            "RUN", str(run_folder), "its trajectory.zarr must be one that a run wrote"
        ) from None
    target = out or run_folder
    target.mkdir(parents=True, exist_ok=True)
    for path in plots.save(trajectory, target, formats):
        print(path)


@app.command(name="map")
def map_(
    scenario: _SCENARIO,
    set_: _SET = None,
    system: Annotated[
        str | None, typer.Option("--system", metavar="NAME", help="Which; needed if several.")
    ] = None,
    periods: Annotated[
        str, typer.Option("--periods", metavar="FROM:TO:COUNT", help="Control periods in s.")
    ] = "0.001:1:7",
    margins: Annotated[
        str,
        typer.Option(
            "--margins", metavar="FROM:TO:COUNT", help="Shares of the way to the boundary left."
        ),
    ] = "1e-6:0.5:6",
    pushes: Annotated[
        str, typer.Option("--pushes", metavar="A,B,...", help="Forces on every agent.")
    ] = "0,2,10",
    runs: Annotated[int, typer.Option("--runs", help="Random starts for each cell.")] = 20,
    duration: Annotated[float, typer.Option("--duration", help="Of each run, in s.")] = 3.0,
    seed: Annotated[int, typer.Option("--seed", help="Of starts and directions.")] = 0,
    out: _OUT = None,
    as_json: _JSON = False,
) -> None:
    """Map where modes `sampled` and `implicit` leave the set: period x start margin x push.

    --out keeps the figure map.png and the table map.csv. Ctrl-C ends it early and keeps what was
    done.
    """
    from dataclasses import asdict

    from gne_mj import exit_map as mapping
    from gne_mj.errors import InvalidInput, nearest
    from gne_mj.scenario import load_scenario
    from gne_mj.simulation import interruption
    from gne_mj.solve import parse_path

    loaded = load_scenario(scenario, _settings(set_))
    names = list(loaded.systems)
    if system is None and len(names) > 1:
        raise InvalidInput("--system", None, f"name one of {', '.join(names)}")
    name = system or names[0]
    if name not in names:
        raise InvalidInput("--system", system, nearest(str(system), names))
    try:
        forces = tuple(float(force) for force in pushes.split(","))
    except ValueError:
        raise InvalidInput("--pushes", pushes, "it must be numbers, A,B,...") from None
    grid = mapping.Grid(
        periods=tuple(parse_path(periods, "--periods")),
        margins=tuple(parse_path(margins, "--margins")),
        pushes=forces,
        runs=runs,
        duration=duration,
        seed=seed,
    )
    built = loaded.systems[name].build(name, loaded.simulation)
    with (
        interruption() as stop,
        _results(out, replace=False) as folder,
        _progress(float(grid.total), as_json, "runs") as show,
    ):
        cells = mapping.exit_map(built, loaded.simulation.timestep, grid, show, stopped=stop.is_set)
        if folder is not None:
            from gne_mj import plots

            mapping.write(cells, folder / "map.csv")
            plots.save_map(cells, folder / "map.png")
    if as_json:
        print(json.dumps([asdict(cell) for cell in cells], indent=2))
    else:
        print("\n".join(mapping.summary(cells)))
        if out is not None:
            print(f"\nfigure      {out / 'map.png'}\ntable       {out / 'map.csv'}")
    raise typer.Exit(1 if stop.is_set() else 0)


@app.command()
def passivity(
    scenario: _SCENARIO,
    system: Annotated[
        str | None, typer.Option("--system", metavar="NAME", help="This one; all if left out.")
    ] = None,
    set_: _SET = None,
    trials: Annotated[int, typer.Option("--trials", help="Trials for each agent.")] = 24,
    seed: Annotated[int, typer.Option("--seed", help="Of the random inputs and states.")] = 0,
    as_json: _JSON = False,
) -> None:
    """Look for violations of equilibrium-independent passivity in the plants of a scenario.

    Trials last as long as the scenario, and use its step and half of it; input limits and the law
    do not matter here. That no violation is found is no proof.
    """
    from gne_mj.errors import InvalidInput, nearest
    from gne_mj.passivity import examine, plants_of
    from gne_mj.scenario import load_scenario

    loaded = load_scenario(scenario, _settings(set_))
    if system is not None and system not in loaded.systems:
        raise InvalidInput("--system", system, nearest(system, loaded.systems))
    reports = {}
    for name in loaded.systems if system is None else (system,):
        with _working(as_json, _PREPARING):
            built = loaded.systems[name].build(name, loaded.simulation)
            reports[name] = examine(
                plants_of(built.agents, built.engine, built.integrator),
                loaded.simulation.timestep,
                duration=loaded.simulation.duration,
                trials=trials,
                seed=seed,
                outputs=built.game.box or (-1.0, 1.0),
                owners=built.game.agent_of_action,
            )
        if not as_json:
            print("\n".join([f"\n{name}", *(f"  {line}" for line in reports[name].summary())]))
    if as_json:
        print(json.dumps({name: report.to_dict() for name, report in reports.items()}, indent=2))
    raise typer.Exit(0 if all(report.holds for report in reports.values()) else 1)


@app.command()
def scenarios(
    name: Annotated[
        str | None, typer.Argument(help="Print this scenario's file, to start one of your own.")
    ] = None,
) -> None:
    """List the shipped scenarios, or print one."""
    import tomllib

    from gne_mj.errors import InvalidInput, nearest
    from gne_mj.scenario import shipped

    files = shipped()
    if name is None:
        width = max(map(len, files))
        for key, text in files.items():
            print(f"{key:{width}}  {tomllib.loads(text)['description']}")
    elif name in files:
        print(files[name], end="")
    else:
        raise InvalidInput("scenario", name, nearest(name, files))


def _version(value: bool) -> None:
    if value:
        from gne_mj import __version__

        print(f"gne-mj {__version__}")
        raise typer.Exit


@app.callback()
def _options(
    version: Annotated[
        bool,
        typer.Option("--version", callback=_version, is_eager=True, help="Print the version."),
    ] = False,
) -> None:
    pass


def main() -> None:
    """Entry point: an error meant for the user is one sentence on stderr.

    The exit status is 2, but 1 where a function of the user's own fails.
    """
    try:
        app()
    except BrokenPipeError:
        sys.exit(1)
    except OSError as error:
        _fail(f"{error.filename}: {error.strerror}" if error.filename else str(error))
    except Exception as error:
        from gne_mj.errors import GneError, UserCodeError

        if type(error).__module__.startswith("numba"):
            from gne_mj.user_files import compiler_complaint

            if (complaint := compiler_complaint(error)) is not None:
                _fail(complaint, UserCodeError.status, 1)
        if not isinstance(error, GneError):
            raise
        code = 1 if isinstance(error, UserCodeError) else 2
        _fail(str(error), getattr(error, "status", None), code)


def _fail(message: str, status: str | None = None, code: int = 2) -> None:
    if "--json" in sys.argv:
        print(json.dumps({"status": status or "invalid_input", "message": message}))
    print(f"gne-mj: {status + ': ' if status else ''}{message}", file=sys.stderr)
    sys.exit(code)


def _load(scenario: str, changes: list[str] | None, *, quiet: bool) -> "Simulation":
    from gne_mj.scenario import load_scenario

    with _working(quiet, _PREPARING):
        return load_scenario(scenario, _settings(changes)).simulation_object()


def _simulate(
    scenario: str,
    changes: list[str] | None,
    out: Path | None,
    *,
    quiet: bool,
    replace: bool = False,
    figures: tuple[str, ...] = (),
) -> "Trajectory":
    from gne_mj.simulation import interruption

    simulation = _load(scenario, changes, quiet=quiet)
    # The interruption covers the writing too: a first Ctrl-C never loses what was computed.
    with (
        interruption(),
        _results(out, replace) as folder,
        _progress(simulation.clock.duration, quiet) as show,
    ):
        trajectory = simulation.run(show)
        if folder is not None:
            trajectory.save(folder / "trajectory.zarr")
            report = json.dumps(trajectory.report(), indent=2)
            (folder / "report.json").write_text(report + "\n", encoding="utf-8")
            if figures:
                from gne_mj import plots

                plots.save(trajectory, folder, figures)
    return trajectory


def _settings(changes: list[str] | None) -> dict[str, Any]:
    """What --set asks for: dotted keys to values."""
    from gne_mj.errors import InvalidInput
    from gne_mj.scenario import parse_value

    settings: dict[str, Any] = {}
    for change in changes or []:
        key, equals, value = change.partition("=")
        if not (key and equals):
            raise InvalidInput("--set", change, "it must read KEY=VALUE")
        settings[key.strip()] = parse_value(value.strip())
    return settings


@contextmanager
def _results(out: Path | None, replace: bool) -> Iterator[Path | None]:
    """A folder that becomes ``out`` when all is written, and vanishes if something fails.

    `paper` may replace results of its own, and only those.
    """
    import tempfile

    from gne_mj.errors import InvalidInput

    if out is None:
        yield None
        return
    if out.exists() and not (replace and _is_of_paper(out)):
        raise InvalidInput("--out", str(out), "it exists already; name a folder that does not")
    try:
        out.parent.mkdir(parents=True, exist_ok=True)
        folder = Path(tempfile.mkdtemp(prefix=f".{out.name}-", dir=out.parent))
    except OSError as error:
        raise InvalidInput("--out", str(out), f"it cannot be written: {error.strerror}") from None
    try:
        yield folder
        folder.chmod(0o755)
        if out.exists():
            _replace(folder, out)
        else:
            folder.rename(out)
    except BaseException:
        shutil.rmtree(folder, ignore_errors=True)
        raise


def _is_of_paper(out: Path) -> bool:
    """Whether a folder holds what `paper` writes: `run` does not draw."""
    figures = ("robots-velocities", "robots-gaps", "channels-powers", "channels-total-power")
    names = ("report.json", "trajectory.zarr", *(f"{figure}.png" for figure in figures))
    return all((out / name).exists() for name in names)


def _replace(folder: Path, out: Path) -> None:
    """Move all in ``folder`` into ``out``; what has the same names there goes last of all."""
    import tempfile

    aside = Path(tempfile.mkdtemp(prefix=f".{out.name}-old-", dir=out.parent))
    for entry in sorted(folder.iterdir()):
        if (out / entry.name).exists():
            (out / entry.name).rename(aside / entry.name)
        entry.rename(out / entry.name)
    folder.rmdir()
    shutil.rmtree(aside)


@contextmanager
def _working(quiet: bool, what: str) -> Iterator[Any]:
    """A word on a terminal's stderr meanwhile; what is handed out changes it."""
    if quiet or not sys.stderr.isatty():
        yield None
        return
    from rich.console import Console

    with Console(stderr=True).status(what) as status:
        yield status.update


@contextmanager
def _progress(total: float, quiet: bool, unit: str = "s") -> Iterator[Any]:
    """A progress bar on a terminal's stderr, else nothing."""
    if quiet or not sys.stderr.isatty():
        yield None
        return
    from rich.console import Console
    from rich.progress import BarColumn, Progress, TextColumn, TimeRemainingColumn

    with Progress(
        TextColumn(
            f"{{task.completed:{'.1f' if unit == 's' else '.0f'}}} of {{task.total:g}} {unit}"
        ),
        BarColumn(),
        TimeRemainingColumn(),
        console=Console(stderr=True),
        transient=True,
    ) as bar:
        task = bar.add_task("run", total=total)
        yield lambda now: bar.update(task, completed=now)


def _tell(trajectory: "Trajectory", as_json: bool) -> None:
    if as_json:
        print(json.dumps(trajectory.report(), indent=2))
        return
    for name, report in trajectory.reports.items():
        print("\n".join(_summary(name, report)))
        _warn(name, report)


def _summary(name: str, report: dict[str, Any]) -> list[str]:
    worst, gap = report["worst_constraint"], report["worst_gap"]
    settling, actuators = report["settling_time"], report["actuators"]
    lyapunov, epsilon = report["lyapunov"], report["epsilon"]
    distances = report["equilibrium"]
    unknown = distances["final_distance_to_variational"] is None
    rows = {
        "status": f"{report['status']}: {report['message']}",
        "least margin": "nothing was observed"
        if worst is None
        else f"-g = {worst['margin']:.6g}, constraint '{worst['name']}' at {worst['time']:.4g} s",
        "settling time": "not settled" if settling is None else f"{settling:.4g} s",
        "distance at the end": f"{distances['final_distance']:.3g} to the penalised equilibrium"
        + ("" if unknown else f", {distances['final_distance_to_variational']:.3g} to the vGNE"),
        "Lyapunov function": "not known of MJCF robots"
        if not lyapunov["known"]
        else ("never rose" if lyapunov["monotone"] else "rose")
        + (f" up to the exit, last seen at {lyapunov['observed_until']:.4g} s" * lyapunov["left"])
        + f" (largest rise {lyapunov['largest_rise']:.2g}; "
        + ("the theory claims a decrease)" if lyapunov["claimed"] else "nothing is claimed here)"),
        "peak input": f"{actuators['peak']:.4g} (agent {actuators['peak_agent']} at"
        f" {actuators['peak_time']:.4g} s), RMS up to {max(actuators['rms']):.4g}",
    }
    if gap is not None:
        rows["widest gap"] = (
            f"{gap['gap']:.6g} of {gap['bound']:g} {gap['unit']}, {gap['name']} at"
            f" {gap['time']:.4g} s"
        )
    implicit = report["implicit"]
    if implicit is not None:
        rows["held inputs"] = (
            f"{implicit['solutions']} solved for in {implicit['mean_newton_steps']:.3g} Newton"
            f" steps each; predicted outputs off by up to"
            f" {implicit['largest_prediction_error']:.2g}"
        )
        for key, what in (
            ("not_accurate", "not accurate (though inside)"),
            ("periods_not_monotone", "periods without dy+/du > 0"),
        ):
            if implicit[key]:
                rows["held inputs"] += f"; {implicit[key]} {what}"
    if epsilon["measured"] is not None:
        rows["epsilon"] = (
            f"{epsilon['measured']:.3g} measured at the penalised equilibrium; p rho ="
            f" {epsilon['p_rho']:g}, largest p_i rho = {epsilon['largest_own_p_rho']:g}"
            + (f", and {epsilon['of_margin']:.3g} for the margin" if epsilon["of_margin"] else "")
        )
    return [f"\n{name}", *(f"  {key:20} {value}" for key, value in rows.items())]


def _warn(name: str, report: dict[str, Any]) -> None:
    saturated = report["actuators"]["saturated"]
    if saturated is not None:
        print(
            f"gne-mj: warning: systems.{name}: the law asked agent {saturated['agent']} for"
            f" {saturated['demand']:.4g} at {saturated['time']:.4g} s, beyond its input limit"
            f" {saturated['limit']:g}; from then on nothing is guaranteed",
            file=sys.stderr,
        )
