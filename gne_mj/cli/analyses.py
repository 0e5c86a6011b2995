"""Commands that examine a scenario: equilibria, guarantees, plants, where a set is left."""

import json
from collections.abc import Callable
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from gne_mj.cli.application import app
from gne_mj.cli.arguments import JSON, OUT, SCENARIO, SET, SYSTEM, meaning, settings
from gne_mj.cli.output import Results, emit
from gne_mj.cli.signals import stopping
from gne_mj.progress import PREPARING, Tell, say, telling

if TYPE_CHECKING:
    from gne_mj.exit_map import Cell
    from gne_mj.scenario import Scenario
    from gne_mj.solutions import Solution
    from gne_mj.system import Clock, System
    from gne_mj.theory.guarantees import Guarantees


@app.command()
def solve(
    source: SCENARIO,
    set_: SET = None,
    system: Annotated[
        str | None, typer.Option("--system", metavar="NAME", help="Solve this system only.")
    ] = None,
    rhos: Annotated[
        list[float] | None,
        typer.Option("--rho", help="In place of the scenario's penalty; may be repeated."),
    ] = None,
    path: Annotated[
        str | None,
        typer.Option("--path", metavar="FROM:TO:COUNT", help="Equilibria over a range of rho."),
    ] = None,
    out: OUT = None,
    as_json: JSON = False,
) -> None:
    """Compute a scenario's penalised and variational equilibria, without running it.

    The exit status is 1 if a profile was found that is no equilibrium, since agents could gain.

    --out keeps a JSON report and, of a path, a CSV table and a figure for each system.
    """
    from gne_mj import solutions as solving
    from gne_mj.extras import need
    from gne_mj.scenario import load_scenario

    if path is not None and out is not None:
        need("plots", "the figure of a path")
    path_rhos = [] if path is None else meaning("path", solving.parse_path, path)
    results = Results(out)
    with telling(PREPARING, quiet=as_json):
        loaded = load_scenario(source, settings(set_))
        wanted = None if system is None else loaded.name_of(system)
        every, moved = loaded.inside_systems()
    solutions: list[Solution] = []
    for built in every:
        if wanted in (None, built.name):
            with telling(f"solving {built.name}", quiet=as_json) as tell, loaded.naming(built.name):
                solutions.append(solving.solve_system(built, rhos or (), path_rhos, tell))
    report = json.dumps(
        {each.name: {**each.to_dict(), "start_found": moved.get(each.name)} for each in solutions},
        indent=2,
    )
    with stopping(), results.written() as folder:
        if folder is not None:
            (folder / "report.json").write_text(report + "\n", encoding="utf-8")
            if path is not None:
                _keep_paths(solutions, folder)
    if as_json:
        emit(report)
    else:
        texts = [
            "\n".join([*solving.summary(each), *_moved(moved.get(each.name))]) for each in solutions
        ]
        print("\n\n".join(texts))
    raise typer.Exit(0 if all(each.holds for each in solutions) else 1)


def _keep_paths(solutions: "list[Solution]", folder: Path) -> None:
    from gne_mj import plots
    from gne_mj import solutions as solving

    for each in solutions:
        solving.write_path(each, folder / f"{each.name}-path.csv")
        plots.save_path(each, folder / f"{each.name}-path.png")


def _moved(done: dict[str, Any] | None) -> list[str]:
    """The line that tells where an analysis started in place of the scenario's own start."""
    if done is None:
        return []
    shown = ", ".join(f"{value:.5g}" for value in done["action"][:12])
    shown += ", ..." * (len(done["action"]) > 12)
    return [f"  started at           {shown}, found inside: {done['why']}"]


@app.command()
def certify(
    source: SCENARIO,
    set_: SET = None,
    as_json: JSON = False,
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
    from gne_mj.scenario import load_scenario
    from gne_mj.theory import certify as examine
    from gne_mj.theory import report_text, search_epsilon, search_period, search_push

    with telling(PREPARING, quiet=as_json):
        loaded = load_scenario(source, settings(set_)).without_interventions("certificates")
        systems, moved = loaded.inside_systems()
    reports = {}
    for system in systems:
        what = f"matrices of {system.name}, of {system.game.actions} actions"
        with telling(what, quiet=as_json), loaded.naming(system.name):
            reports[system.name] = examine(system, loaded.clock())
    distributed, implicit = "no system has the distributed law", "no system is in mode 'implicit'"
    for wanted, kind in (
        (search, _Search("search", search_epsilon, "epsilon", "search", distributed)),
        (period, _Search("period", search_period, "held", "period_search", implicit)),
        (push, _Search("push", search_push, "held", "push_search", implicit)),
    ):
        if wanted:
            reports = kind.fill(reports, source, loaded, systems, as_json)
    if as_json:
        starts = {name: {"start_found": done} for name, done in moved.items()}
        every = {name: {**each.to_dict(), **starts.get(name, {})} for name, each in reports.items()}
        emit(json.dumps(every, indent=2))
    else:
        for name, report in reports.items():
            print("\n".join([*report_text(report), *_moved(moved.get(name))]))


@dataclass(frozen=True)
class _Search:
    """A search by trial runs: the option that asks for it, and the entry of reports that it fills.

    Systems without the `part` of a report have nothing to search for; `missing` says why.
    """

    option: str
    seek: Callable[["System", "Clock", Tell], Any]
    part: str
    entry: str
    missing: str

    def fill(
        self,
        reports: "dict[str, Guarantees]",
        source: str,
        loaded: "Scenario",
        systems: "list[System]",
        as_json: bool,
    ) -> "dict[str, Guarantees]":
        """The reports of a scenario's systems, with what was found."""
        from gne_mj.errors import InvalidInput

        chosen = [each for each in systems if getattr(reports[each.name], self.part) is not None]
        if not chosen:
            raise InvalidInput(self.option, source, self.missing)
        filled = dict(reports)
        for system in chosen:
            report = reports[system.name]
            what = f"searching for {system.name}"
            with telling(what, quiet=as_json) as tell, loaded.naming(system.name):
                found = asdict(self.seek(system, loaded.clock(), tell))
            part: dict[str, Any] = {self.part: {**getattr(report, self.part), self.entry: found}}
            filled[system.name] = replace(report, **part)
        return filled


@app.command()
def check(source: SCENARIO, set_: SET = None, as_json: JSON = False) -> None:
    """Compare what is written twice in a scenario's games: derivatives, lists, declarations.

    Derivatives are compared with differences at profiles strictly inside. Exit status 1 if anything
    differs or a function fails.
    """
    from gne_mj.game_check import examine
    from gne_mj.scenario import load_scenario

    loaded = load_scenario(source, settings(set_))
    reports = {}
    for name, table in loaded.systems.items():
        with telling(PREPARING, quiet=as_json) as tell:
            reports[name] = examine(*table.game_and_start(name), progress=tell)
        if not as_json:
            head = f"\n{name}: {reports[name].game}, {reports[name].points} profiles"
            print("\n".join([head, *(f"  {line}" for line in reports[name].summary())]))
    if as_json:
        emit(json.dumps({name: report.to_dict() for name, report in reports.items()}, indent=2))
    raise typer.Exit(0 if all(report.holds for report in reports.values()) else 1)


@app.command()
def passivity(
    source: SCENARIO,
    system: Annotated[
        str | None, typer.Option("--system", metavar="NAME", help="This one; all if left out.")
    ] = None,
    set_: SET = None,
    trials: Annotated[int, typer.Option("--trials", help="Trials for each agent.")] = 24,
    seed: Annotated[int, typer.Option("--seed", help="Of the random inputs and states.")] = 0,
    as_json: JSON = False,
) -> None:
    """Look for violations of equilibrium-independent passivity in the plants of a scenario.

    Trials last as long as the scenario, and use its step and half of it; input limits and the law
    do not matter here. Amplitudes grow, and the report tells how far was tried. That no violation
    is found is no proof.
    """
    from gne_mj.errors import named
    from gne_mj.passivity import examine, plants_of
    from gne_mj.scenario import load_scenario

    loaded = load_scenario(source, settings(set_))
    reports = {}
    for name in loaded.systems if system is None else (loaded.name_of(system),):
        with telling(PREPARING, quiet=as_json):
            built = loaded.systems[name].build(name, loaded.simulation)
        of_clock = {key: f"clock.{key}" for key in ("timestep", "duration")}
        with (
            telling(PREPARING, quiet=as_json) as tell,
            loaded.naming(name),
            named(build="system.agents.count", **of_clock),
        ):
            reports[name] = examine(
                plants_of(built.agents, built.engine, built.integrator),
                loaded.simulation.timestep,
                duration=loaded.simulation.duration,
                trials=trials,
                seed=seed,
                outputs=built.game.box or (-1.0, 1.0),
                owners=built.game.agent_of_action,
                progress=tell,
            )
        if not as_json:
            print("\n".join([f"\n{name}", *(f"  {line}" for line in reports[name].summary())]))
    if as_json:
        emit(json.dumps({name: report.to_dict() for name, report in reports.items()}, indent=2))
    raise typer.Exit(0 if all(report.holds for report in reports.values()) else 1)


_ROBOT = Annotated[
    str,
    typer.Argument(
        metavar="ROBOT.xml|SCENARIO",
        help="An MJCF file (gne_mj:car.xml is a shipped one), or a scenario with such robots.",
    ),
]


@app.command(name="examine")
def examine_(
    source: _ROBOT,
    output: Annotated[
        str | None,
        typer.Option(metavar="VALUE", help="y_i as a scenario has it; proposed if left out."),
    ] = None,
    input: Annotated[
        str | None, typer.Option(metavar="VALUE", help="u_i as a scenario has it; likewise.")
    ] = None,
    keyframe: Annotated[
        str | None, typer.Option(metavar="NAME", help="Of a file: in which it begins.")
    ] = None,
    at: Annotated[
        str | None,
        typer.Option(
            metavar="A,B,...",
            help="Wished output, a number an entry; 0.5, of a scenario's robots y*.",
        ),
    ] = None,
    passive: Annotated[
        bool, typer.Option("--passivity/--no-passivity", help="Try passivity, too.")
    ] = True,
    set_: SET = None,
    system: Annotated[
        str | None, typer.Option("--system", metavar="NAME", help="This one; all if left out.")
    ] = None,
    scenario: Annotated[
        Path | None,
        typer.Option(metavar="FILE.toml", help="Write the recommended scenario of a file here."),
    ] = None,
    as_json: JSON = False,
) -> None:
    """Tell what a user's robot is like before it plays, and what to use.

    Its outputs and inputs; what input holds it at rest and at the wished output; dy+/du over
    periods and states; relative degree, limits, the longest stable step, passivity; and an agents'
    table with what goes with it. Exit status 1 if no output is reached by an input.
    """
    from gne_mj.errors import named
    from gne_mj.interface import examining

    wished = None if at is None else _numbers("at", at)
    with telling(PREPARING, quiet=as_json) as tell, named(changes="set_"):
        found = examining.of_source(
            source, output, input, wished, keyframe=keyframe, changes=settings(set_),
            system=system, passivity=passive, scenario=scenario, progress=tell,
        )  # fmt: skip
    (only, *_) = found.values()
    if scenario is not None and only.usable:
        from gne_mj.files import written

        with written("scenario", scenario, replace=False) as new:
            new.write_text(only.recommendation.toml, encoding="utf-8")
    if as_json:
        emit(json.dumps({name: each.to_dict() for name, each in found.items()}, indent=2))
    else:
        print("\n\n".join(map(str, found.values())))
    raise typer.Exit(0 if all(each.usable for each in found.values()) else 1)


@app.command(name="map")
def map_(
    source: SCENARIO,
    set_: SET = None,
    system: SYSTEM = None,
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
    runs: Annotated[int, typer.Option("--runs", help="Random starts for each cell.")] = 5,
    duration: Annotated[float, typer.Option("--duration", help="Of each run, in s.")] = 3.0,
    seed: Annotated[int, typer.Option("--seed", help="Of starts and directions.")] = 0,
    out: OUT = None,
    as_json: JSON = False,
) -> None:
    """Map where modes `sampled` and `implicit` leave the set: period x start margin x push.

    --out keeps the figure map.png and the table map.csv. Ctrl-C ends it early and keeps the cells
    that were done.
    """
    from gne_mj import exit_map as mapping
    from gne_mj.extras import need
    from gne_mj.scenario import load_scenario
    from gne_mj.solutions import parse_path

    if out is not None:
        need("plots", "the figure of a map")
    loaded = load_scenario(source, settings(set_)).without_interventions("maps")
    name = loaded.name_of(system)
    grid = mapping.Grid(
        periods=tuple(meaning("periods", parse_path, periods)),
        margins=tuple(meaning("margins", parse_path, margins)),
        pushes=_numbers("pushes", pushes),
        runs=runs,
        duration=duration,
        seed=seed,
    )
    results = Results(out)
    with stopping() as stop:
        with telling(PREPARING, quiet=as_json) as tell, loaded.naming(name):
            built = loaded.systems[name].build(name, loaded.simulation)
            cells = mapping.exit_map(
                built, loaded.simulation.timestep, grid, tell, stopped=stop.is_set
            )
        if cells:
            _keep_map(cells, results)
    if as_json:
        emit(json.dumps([asdict(cell) for cell in cells], indent=2))
    else:
        _print_map(cells, results.out)
    if stop.is_set():
        say(f"gne-mj: stopped: {len(cells)} of {grid.cells} cells were done")
    raise typer.Exit(1 if stop.is_set() else 0)


def _numbers(key: str, text: str) -> tuple[float, ...]:
    from gne_mj.errors import InvalidInput

    try:
        return tuple(float(number) for number in text.split(","))
    except ValueError:
        raise InvalidInput(key, text, "it must be numbers, A,B,...") from None


def _print_map(cells: "list[Cell]", out: Path | None) -> None:
    from gne_mj.exit_map import summary

    print("\n".join(summary(cells)))
    if cells and out is not None:
        print(f"\nfigure      {out / 'map.png'}\ntable       {out / 'map.csv'}")


def _keep_map(cells: "list[Cell]", results: Results) -> None:
    from gne_mj import exit_map as mapping

    with results.written() as folder:
        if folder is not None:
            from gne_mj import plots

            mapping.write(cells, folder / "map.csv")
            plots.save_map(cells, folder / "map.png")
