"""Putting a set-up together, and running it."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from numpy.typing import ArrayLike

from gne_mj.arguments import answering
from gne_mj.controllers import Law
from gne_mj.controllers.table import LawTable
from gne_mj.errors import InvalidInput
from gne_mj.game_model import Game
from gne_mj.interface.laws import own_law
from gne_mj.membership import MembershipTable
from gne_mj.progress import if_asked, of_time
from gne_mj.scenario import Scenario, Source, load_scenario
from gne_mj.scenario_tables.faults import FaultTable
from gne_mj.simulation import Simulation
from gne_mj.system import Clock, System
from gne_mj.toml_table import Table
from gne_mj.trajectory import Trajectory

if TYPE_CHECKING:
    import xarray

    from gne_mj.interface.show import Figures, Replay
    from gne_mj.viewer import Server

# Which key of a scenario each part fills
KEYS = {
    "agents": "agents",
    "law": "controller",
    "rho": "barrier.rho",
    "start": "initial.action",
    "faults": "faults",
    "membership": "membership",
    "engine": "plant.engine",
    "integrator": "simulation.integrator",
    "duration": "simulation.duration",
    "timestep": "simulation.timestep",
    "control_period": "simulation.control_period",
    "sample_period": "recording.period",
    "tolerance": "simulation.tolerance",
    "seed": "simulation.seed",
}


@answering
def setup(
    source: Source,
    changes: Mapping[str, Any] | None = None,
    *,
    agents: Table | None = None,
    law: LawTable | Law | Callable[..., ArrayLike] | None = None,
    rho: float | None = None,
    start: ArrayLike | None = None,
    duration: float | None = None,
    timestep: float | None = None,
    control_period: float | None = None,
    sample_period: float | None = None,
    engine: str | None = None,
    integrator: str | None = None,
    faults: Sequence[FaultTable] | None = None,
    membership: MembershipTable | Mapping[str, Any] | None = None,
    tolerance: float | None = None,
    seed: int | None = None,
) -> Scenario:
    """A scenario from a game and what plays it, or from another one with parts replaced.

    >>> scenario = gne_mj.setup(game, agents=gne_mj.flexible_robots(6), rho=0.02)
    >>> gne_mj.batch(scenario, {"game.parameters.budget": [20, 30]}, out="results/budget")

    Args:
        source: a game; a shipped scenario's name, a file ending in .toml, a scenario.
        changes: dotted keys to new values, see :func:`gne_mj.load_scenario`; they come last.
        agents: who plays; integrators where a game is given without.
        law: an object, or a plain function ``action(game, rho, y, memory)`` that returns u (m,);
            full information where a game is given without.
        rho: penalty of the barrier; 0.1 where a game is given without.
        start: y(0), one number or one for each agent, strictly inside; looked for if left out.
        duration: s; 30 where a game is given without.
        timestep: of the integration, s; likewise 0.002.
        control_period: how long inputs are held, s; the timestep if left out.
        sample_period: s between samples that are kept; likewise 0.05.
        engine: "ode" or "mujoco".
        integrator: "rk4", "euler" or, of ODE agents, "tsit5" (adaptive steps); "rosenbrock" is a
            change of ``plant.integrator``.
        faults: what goes wrong.
        membership: who leaves and joins meanwhile, ``{"changes": [{"time": 2.0, "leaves": [3]}]}``
            (docs/networks.md, *Agents that leave and join*).
        tolerance: on the greatest distance to y*, for the status ``converged``.
        seed: of what is random in faults.

    Raises:
        InvalidInput: names the key, the value and what would be right.
    """
    given = {name: value for name, value in locals().items() if name in KEYS and value is not None}
    return load_scenario(source, {**part_changes(source, given), **(changes or {})})


def part_changes(source: Source, given: Mapping[str, Any]) -> dict[str, Any]:
    """Parts of a set-up, by their names, as changes of a scenario's keys."""
    found = {KEYS.get(name, name): value for name, value in given.items()}
    agents, law = given.get("agents"), given.get("law")
    if not isinstance(agents, Table | Mapping | None):
        raise InvalidInput("agents", agents, "it must be agents, such as flexible_robots(6)")
    if isinstance(source, Game) and getattr(agents, "count", source.agents) != source.agents:
        raise InvalidInput("agents", agents, f"the {source.called} has {source.agents} agents")
    if isinstance(law, Table | Law | Mapping) or law is None:
        return found
    if not callable(law):
        laws = "full_information() or partial_information(graph)"
        raise InvalidInput("law", law, f"it must be a law, such as {laws}, or a function")
    return {**found, "controller": own_law(law)}


class Run(Trajectory):
    """A run that was made here: a trajectory with its scenario and systems at hand.

    Attributes:
        scenario: what was run.
        systems: what it was made into, by name.
    """

    def __init__(
        self, trajectory: Trajectory, scenario: Scenario, systems: Mapping[str, System]
    ) -> None:
        super().__init__(trajectory._given)
        self.scenario, self.systems = scenario, dict(systems)

    @property
    def system(self) -> System:
        """The only system.

        Raises:
            InvalidInput: there are several.
        """
        return self.systems[self.scenario.name_of(None)]

    @property
    def data(self) -> xarray.Dataset:
        """What the only system recorded."""
        return self[self.scenario.name_of(None)]

    @property
    def clock(self) -> Clock:
        """That it ran on."""
        return self.scenario.clock()

    def plot(self, folder: str | Path | None = None, formats: Sequence[str] = ("png",)) -> Figures:
        """See :func:`gne_mj.plot`."""
        from gne_mj.interface.show import plot

        return plot(self, folder, formats)

    def view(self, title: str = "gne-mj replay", *, port: int = 0) -> Server:
        """See :func:`gne_mj.view`."""
        from gne_mj.interface.show import view

        return view(self, title, port=port)

    def replay(self, *others: Trajectory) -> Replay:
        """The replay, for a notebook to show inline: some two megabytes each time.

        Args:
            others: up to three runs to compare with.
        """
        from gne_mj.interface.show import Replay

        return Replay((self, *others) if others else self)


@answering
def run(
    source: Source,
    changes: Mapping[str, Any] | None = None,
    *,
    agents: Table | None = None,
    law: LawTable | Law | Callable[..., ArrayLike] | None = None,
    rho: float | None = None,
    start: ArrayLike | None = None,
    duration: float | None = None,
    timestep: float | None = None,
    control_period: float | None = None,
    sample_period: float | None = None,
    engine: str | None = None,
    integrator: str | None = None,
    faults: Sequence[FaultTable] | None = None,
    membership: MembershipTable | Mapping[str, Any] | None = None,
    tolerance: float | None = None,
    seed: int | None = None,
    progress: Callable[[float], None] | bool = False,
) -> Run:
    """Run a scenario, or a game with what plays it, to its end.

    >>> gne_mj.run("velocity-sync", {"barrier.rho": 0.02}).status
    >>> gne_mj.run(game, agents=gne_mj.flexible_robots(6), rho=0.02, duration=10.0).plot()

    What is not told here is as :func:`gne_mj.setup` has it.

    Args:
        source: a game, a shipped scenario's name, a file ending in .toml, or a scenario.
        progress: True to tell on stderr how long it takes and how far it is, as the command does;
            or what is called now and then with the simulated time in s.

    Raises:
        InvalidInput: names the key, the value and what would be right.
        InfeasibleStart: a start that was given, or the game's own, is not strictly inside.
    """
    given = {name: value for name, value in locals().items() if name in KEYS}
    return run_scenario(setup(source, changes, **given), progress)


def run_scenario(scenario: Scenario, progress: Callable[[float], None] | bool = False) -> Run:
    """Run it to its end."""
    with if_asked(progress) as tell:
        simulation: Simulation = scenario.simulation_object()
        shown = progress if callable(progress) else of_time(tell, simulation.clock.duration)
        trajectory = simulation.run(shown)
    return Run(trajectory, scenario, {each.name: each for each in simulation.systems})
