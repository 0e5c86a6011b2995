"""An environment of a system, or of a scenario's."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from gne_mj.environment.information import STRUCTURES, Information, Structure, information_of
from gne_mj.environment.physics import FleetPhysics
from gne_mj.environment.task import FleetEnvironment, FleetTask, Start, finite_costs
from gne_mj.errors import InvalidInput, named, nearest, part_of
from gne_mj.graph import NAMED, Graph
from gne_mj.motion import motion_of
from gne_mj.plants.fleet_plant import build_fleet
from gne_mj.scenario import load_scenario
from gne_mj.starts import random_starts
from gne_mj.system import Clock, System


def load_environment(
    scenario: str | Path | Mapping[str, Any],
    changes: Mapping[str, Any] | None = None,
    system: str | None = None,
    **options: Any,
) -> FleetEnvironment:
    """A dm_env environment of a scenario's fleet.

    Args:
        scenario: as :func:`gne_mj.load_scenario` has it.
        changes: likewise.
        system: which of the scenario's systems; may be left out if there is only one.
        **options: as :func:`environment_of` has them.

    Raises:
        InvalidInput: names the key, the value and what would be right.
        InfeasibleStart: a start on or outside the boundary.

    >>> environment = load_environment("velocity-sync", {"agents.input_limit": 20.0})
    >>> timestep = environment.reset()
    >>> timestep = environment.step(np.zeros(environment.action_spec().shape))
    """
    with named(source="scenario"):
        loaded = load_scenario(scenario, changes).without_interventions("environments")
    name = loaded.name_of(system)
    built = loaded.systems[name].build(name, loaded.simulation)
    with loaded.naming(name):
        return environment_of(built, loaded.clock(), **options)


def environment_of(
    system: System,
    clock: Clock,
    *,
    information: Structure | None = None,
    graph: Graph | str | None = None,
    reward: Literal["sum", "each"] = "sum",
    exit_cost: float | None = None,
    start: Literal["own", "random"] | Start = "own",
    spread: float = 0.9,
    random: int | np.random.Generator | None = None,
) -> FleetEnvironment:
    """A dm_env environment of a MuJoCo fleet and its game: :class:`FleetTask` says what is what.

    Args:
        system: game, agents and start; its law only sets what is observed unless that is given.
        clock: integration step, control period (one step of the environment) and the duration, in
            whole periods, after which an episode is cut off.
        information: what each agent sees, "full", "partial" or "distributed"; the law's if left
            out (of a law of one's own "full", or "partial" if it has a graph).
        graph: who hears whom, or a named graph; the law's if left out.
        reward: "sum", minus the sum of all costs; "each", minus its cost to each agent, (N,).
        exit_cost: what leaving the set costs. Costs end with the episode, so that without it a
            learner would find that leaving at once is best. If left out it is what standing still
            at the system's start would cost for a whole episode, and not less than 0.
        start: "own", the system's; "random", at rest on a random ray from the penalised
            equilibrium to the boundary; or a function that draws y(0), shape (m,), given a
            generator.
        spread: for random starts: up to which part of the way to the boundary, between 0 and 1.
        random: seed or generator of the random starts.

    Raises:
        InvalidInput: agents that do not run in MuJoCo, faults or separation (there are none here),
            or an option that is not one of the above.
        UserCodeError, NotFinite: costs at the start that are not numbers.
    """
    _check(system)
    periods = _episode(clock)
    if exit_cost is None:
        costs = finite_costs(system.game, system.start)
        exit_cost = float(np.maximum(0.0, periods * costs.sum()))
    physics = _physics(system, clock.timestep)
    task = FleetTask(
        system,
        _information(system, information, graph),
        periods,
        reward=reward,
        exit_cost=exit_cost,
        start=_start(system, start, spread),
        rng=np.random.default_rng(random),
    )
    return FleetEnvironment(physics, task, n_sub_steps=clock.steps(clock.control_period))


def _check(system: System) -> None:
    """Refuse what an environment does not have."""
    if system.engine != "mujoco":
        raise InvalidInput("system.engine", system.engine, "an environment is of engine 'mujoco'")
    if motion_of(system.game) is not None:
        raise InvalidInput("system.game", "numbers that move", "an environment's stand still")
    if system.faults:
        raise InvalidInput(
            "system.faults", f"{len(system.faults)} faults", "an environment has none: remove them"
        )
    if system.separation is not None:
        raise InvalidInput("system.separation", "given", "an environment has none: remove it")


def _episode(clock: Clock) -> int:
    """Control periods of an episode."""
    periods = clock.duration / clock.control_period
    if round(periods) < 1 or abs(periods - round(periods)) > 1e-6:
        raise InvalidInput(
            "clock.duration",
            clock.duration,
            f"an episode is a multiple of the control period {clock.control_period:g} s",
        )
    return round(periods)


def _physics(system: System, timestep: float) -> FleetPhysics:
    with part_of("system"):
        plant = build_fleet(system.agents, timestep, system.integrator)
        return FleetPhysics(plant, system.game, system.state)


def _information(system: System, structure: str | None, graph: Graph | str | None) -> Information:
    law, game = system.law, system.game
    if structure is None:
        structure = law.information
        if structure not in STRUCTURES:
            structure = "full" if law.graph is None else "partial"
    if isinstance(graph, str):
        if graph not in NAMED:
            raise InvalidInput("graph", graph, nearest(graph, NAMED))
        with named(agents="graph"):
            graph = NAMED[graph](game.agents)
    with named(structure="information"):
        return information_of(game, structure, law.graph if graph is None else graph)


def _start(system: System, start: str | Start, spread: float) -> Start | None:
    if callable(start):
        return start
    if start == "own":
        return None
    if start != "random":
        raise InvalidInput("start", start, "choose from own, random, or give a function")
    if not 0.0 < spread < 1.0:
        raise InvalidInput("spread", spread, "it must lie between 0 and 1")
    middle = system.centre

    def draw(rng: np.random.Generator) -> NDArray[np.float64]:
        return random_starts(system.game, middle, [int(rng.integers(2**53))], spread)[0]

    return draw
