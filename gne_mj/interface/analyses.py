"""What can be told of a set-up without running it."""

from __future__ import annotations

from collections.abc import Sequence

from gne_mj import game_check
from gne_mj.arguments import answering
from gne_mj.errors import InvalidInput, named
from gne_mj.interface.running import Run
from gne_mj.progress import if_asked
from gne_mj.scenario import Scenario, Source, load_scenario
from gne_mj.scenario_tables.clock import RecordingTable, SimulationTable
from gne_mj.solutions import Solution, solve_system
from gne_mj.system import Clock, System
from gne_mj.theory import certify as examine
from gne_mj.theory.guarantees import Guarantees


@answering
def solve(
    source: Source | Run | System,
    *,
    rho: float | Sequence[float] | None = None,
    path: Sequence[float] = (),
    system: str | None = None,
    progress: bool = False,
) -> Solution:
    """The penalised and the variational equilibria of a game, with their multipliers.

    >>> print(gne_mj.solve(game, rho=[0.1, 0.01]))

    Args:
        source: a game, a scenario, a run, a system.
        rho: one penalty or several; the scenario's own if left out.
        path: further penalties, each equilibrium started from the one before.
        system: which; may be left out if there is only one.
        progress: tell on stderr how long it takes and how far it is, as the command does.

    Raises:
        InvalidInput: a penalty that is not positive; no start inside was found.
        SolverError: an equilibrium was not found.
    """
    if rho is None:
        rhos: Sequence[float] = ()
    else:
        rhos = (rho,) if isinstance(rho, int | float) else tuple(rho)
    with named(rhos="rho", path_rhos="path"), if_asked(progress) as tell:
        return solve_system(_system(source, system)[0], rhos, tuple(path), tell)


@answering
def certify(
    source: Source | Run | System, *, system: str | None = None, clock: Clock | None = None
) -> Guarantees:
    """What the theory guarantees for a system, and what it does not (docs/certificates.md).

    >>> print(gne_mj.certify(run))

    Args:
        source: a scenario, a run, a system; a game, for integrators under full information.
        system: which; may be left out if there is only one.
        clock: how it steps; the scenario's own. Of a system alone that of scenarios that say
            nothing of theirs.

    Raises:
        InvalidInput: no start inside was found, or matrices would fill the memory.
    """
    if not isinstance(source, Run | System):
        source = load_scenario(source).without_interventions("certificates")
    found, own = _system(source, system)
    return examine(found, clock or own)


@answering
def check(source: Source | Run, *, system: str | None = None) -> game_check.Report:
    """Compare what a game says twice: derivatives with differences, lists, declarations.

    Args:
        source: a game, a scenario, a run.
        system: which; may be left out if there is only one.

    Raises:
        InvalidInput: no profile inside was found.
    """
    scenario = _scenario(source)
    name = scenario.name_of(system)
    return game_check.examine(*scenario.systems[name].game_and_start(name))


def _scenario(source: Source | Run) -> Scenario:
    return source.scenario if isinstance(source, Run) else load_scenario(source)


def _system(source: Source | Run | System, name: str | None) -> tuple[System, Clock]:
    """The system that is meant, started inside, and the clock that it runs on."""
    if isinstance(source, System):
        if name not in (None, source.name):
            raise InvalidInput("system", name, f"this is system '{source.name}'")
        simulation, recording = SimulationTable(), RecordingTable()
        step = simulation.timestep
        return source, Clock(simulation.duration, step, step, recording.period)
    scenario = _scenario(source)
    chosen = scenario.name_of(name)
    if isinstance(source, Run):
        return source.systems[chosen], scenario.clock()
    return scenario.systems[chosen].build_inside(chosen, scenario.simulation)[0], scenario.clock()
