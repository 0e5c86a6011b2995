"""An environment of a system, or of a scenario's."""

from __future__ import annotations  # short signatures

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from gne_mj.environment.episodes import BOUND
from gne_mj.environment.information import STRUCTURES, Information, Structure, information_of
from gne_mj.environment.observation import finite_costs
from gne_mj.environment.parallel import FleetParallelEnv
from gne_mj.environment.setting import Setting, Start
from gne_mj.environment.single import FleetEnv
from gne_mj.environment.task import FleetEnvironment
from gne_mj.environment.vector import FleetVectorEnv
from gne_mj.errors import InvalidInput, named, nearest
from gne_mj.graph import NAMED, Graph
from gne_mj.motion import motion_of
from gne_mj.scenario import load_scenario
from gne_mj.starts import random_starts
from gne_mj.system import Clock, System


@contextmanager
def setting_in(
    scenario: str | Path | Mapping[str, Any],
    changes: Mapping[str, Any] | None,
    system: str | None,
    options: Mapping[str, Any],
) -> Iterator[Setting]:
    """A scenario's setting; what is refused within is named by the scenario's keys."""
    with named(source="scenario"):
        what = "environments"
        loaded = load_scenario(scenario, changes).without_interventions(what)
        loaded = loaded.without_membership(what)
    name = loaded.name_of(system)
    built = loaded.systems[name].build(name, loaded.simulation)
    with loaded.naming(name):
        yield setting_of(built, loaded.clock(), **options)


def load_environment(
    scenario: str | Path | Mapping[str, Any],
    changes: Mapping[str, Any] | None = None,
    system: str | None = None,
    *,
    reward: Literal["sum", "each"] = "sum",
    random: int | np.random.Generator | None = None,
    **options: Any,
) -> FleetEnvironment:
    """A dm_env environment of a scenario's fleet.

    Args:
        scenario: as :func:`gne_mj.load_scenario` has it.
        changes: likewise.
        system: which of the scenario's systems; may be left out if there is only one.
        reward: as :func:`environment_of` has it.
        random: as :func:`environment_of` has it.
        **options: as :func:`setting_of` has them.

    Raises:
        InvalidInput: names the key, the value and what would be right.
        InfeasibleStart: a start on or outside the boundary.

    >>> environment = load_environment("velocity-sync", {"agents.input_limit": 20.0})
    >>> timestep = environment.reset()
    >>> timestep = environment.step(np.zeros(environment.action_spec().shape))
    """
    with setting_in(scenario, changes, system, options) as setting:
        return FleetEnvironment(setting, reward, random)


def load_gymnasium(
    scenario: str | Path | Mapping[str, Any],
    changes: Mapping[str, Any] | None = None,
    system: str | None = None,
    *,
    bound: float = BOUND,
    render_mode: str | None = None,
    **options: Any,
) -> FleetEnv:
    """A Gymnasium environment of a scenario's fleet, in which one learner gives all forces.

    Args:
        scenario: as :func:`load_environment` has it.
        changes: as :func:`load_environment` has it.
        system: as :func:`load_environment` has it.
        bound: as :class:`FleetEnv` has it.
        render_mode: as :class:`FleetEnv` has it.
        **options: as :func:`setting_of` has them.

    Raises:
        InvalidInput, InfeasibleStart: as :func:`load_environment`.
    """
    with setting_in(scenario, changes, system, options) as setting:
        return FleetEnv(setting, bound=bound, render_mode=render_mode)


def load_vector(
    scenario: str | Path | Mapping[str, Any],
    changes: Mapping[str, Any] | None = None,
    system: str | None = None,
    *,
    num_envs: int,
    threads: int | None = None,
    bound: float = BOUND,
    render_mode: str | None = None,
    **options: Any,
) -> FleetVectorEnv:
    """A Gymnasium vector environment of many fleets of a scenario, stepped natively on threads.

    Args:
        scenario: as :func:`load_environment` has it.
        changes: as :func:`load_environment` has it.
        system: as :func:`load_environment` has it.
        num_envs: as :class:`FleetVectorEnv` has it.
        threads: as :class:`FleetVectorEnv` has it.
        bound: as :class:`FleetVectorEnv` has it.
        render_mode: as :class:`FleetVectorEnv` has it.
        **options: as :func:`setting_of` has them.

    Raises:
        InvalidInput, InfeasibleStart: as :func:`load_environment`.
    """
    with setting_in(scenario, changes, system, options) as setting:
        return FleetVectorEnv(
            setting, num_envs, threads=threads, bound=bound, render_mode=render_mode
        )


def load_pettingzoo(
    scenario: str | Path | Mapping[str, Any],
    changes: Mapping[str, Any] | None = None,
    system: str | None = None,
    *,
    bound: float = BOUND,
    render_mode: str | None = None,
    **options: Any,
) -> FleetParallelEnv:
    """A PettingZoo environment (parallel API) of a scenario's fleet.

    Args:
        scenario: as :func:`load_environment` has it.
        changes: as :func:`load_environment` has it.
        system: as :func:`load_environment` has it.
        bound: as :class:`FleetParallelEnv` has it.
        render_mode: as :class:`FleetParallelEnv` has it.
        **options: as :func:`setting_of` has them.

    Raises:
        InvalidInput, InfeasibleStart: as :func:`load_environment`.
    """
    with setting_in(scenario, changes, system, options) as setting:
        return FleetParallelEnv(setting, bound=bound, render_mode=render_mode)


def environment_of(
    system: System,
    clock: Clock,
    *,
    reward: Literal["sum", "each"] = "sum",
    random: int | np.random.Generator | None = None,
    **options: Any,
) -> FleetEnvironment:
    """A dm_env environment of a MuJoCo fleet and its game: :class:`FleetTask` says what is what.

    Args:
        system: as :func:`setting_of` has it.
        clock: as :func:`setting_of` has it.
        reward: "sum", minus the sum of all costs; "each", minus its cost to each agent, (N,).
        random: seed or generator of the random starts.
        **options: as :func:`setting_of` has them.

    Raises:
        InvalidInput, UserCodeError, NotFinite: as :func:`setting_of`.
    """
    return FleetEnvironment(setting_of(system, clock, **options), reward, random)


def setting_of(
    system: System,
    clock: Clock,
    *,
    information: Structure | None = None,
    graph: Graph | str | None = None,
    exit_cost: float | None = None,
    start: Literal["own", "random"] | Start = "own",
    spread: float = 0.9,
) -> Setting:
    """What an episode of a MuJoCo fleet and its game is, for every kind of environment.

    Args:
        system: game, agents and start; its law only sets what is observed unless that is given.
        clock: integration step, control period (one step of the environment) and the duration, in
            whole periods, after which an episode is cut off.
        information: what each agent sees, "full", "partial" or "distributed"; the law's if left
            out (of a law of one's own "full", or "partial" if it has a graph).
        graph: who hears whom, or a named graph; the law's if left out.
        exit_cost: what leaving the set costs. Costs end with the episode, so that without it a
            learner would find that leaving at once is best. If left out it is what standing still
            at the system's start would cost for a whole episode, and not less than 0.
        start: "own", the system's; "random", at rest on a random ray from the penalised
            equilibrium to the boundary; or a function that draws y(0), shape (m,), given a
            generator.
        spread: for random starts: up to which part of the way to the boundary, between 0 and 1.

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
    told = _information(system, information, graph)
    return Setting(system, clock, told, periods, float(exit_cost), _start(system, start, spread))


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
    for key in ("separation", "membership"):
        if getattr(system, key) is not None:
            raise InvalidInput(f"system.{key}", "given", "an environment has none: remove it")


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
