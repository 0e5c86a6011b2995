"""One system of a scenario: its game, agents, law, plant, start, and what goes wrong."""

from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import replace
from typing import Annotated, Any, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, field_validator

import gne_mj.expressions.table  # registers games of expressions
import gne_mj.python_objects  # and games and laws of this process
import gne_mj.user_files  # noqa: F401  registers games and laws of the user's own
from gne_mj.barrier import BarrierTable
from gne_mj.controllers import Law
from gne_mj.controllers.full_information import FullController
from gne_mj.controllers.table import LawTable
from gne_mj.errors import InfeasibleStart, InvalidInput, named, part_of, renaming
from gne_mj.faults import EventTrigger, Fault
from gne_mj.game_model import Game
from gne_mj.games.table import GameTable
from gne_mj.load_margins import beyond_estimates
from gne_mj.loops.base import Present
from gne_mj.margins import Disturbance, with_margin
from gne_mj.membership import Membership, MembershipTable
from gne_mj.plants.agent_type import followed_position, placed_state, start_keys, start_of
from gne_mj.plants.agents import Agents
from gne_mj.plants.table import AgentsTable
from gne_mj.registry import AGENTS, FAULTS, GAMES, LAWS, MODES, load_plugins
from gne_mj.scenario_tables.clock import SimulationTable
from gne_mj.scenario_tables.faults import FaultTable, MarginTable
from gne_mj.separation import Separation, SeparationTable
from gne_mj.starts import interior_profile
from gne_mj.system import System, mode_of
from gne_mj.system.checks import check_law_room
from gne_mj.system.data import GUARDED
from gne_mj.theory.periods import least_rho
from gne_mj.toml_table import ACTION, INPUT, Fills, PerAction, Sizes, Table, Unit, per_action

load_plugins()  # the tables below hold any of those that are registered


class PlantTable(Table):
    """What moves the agents."""

    engine: Literal["mujoco", "ode"] | None = Field(
        None, description="'ode' if left out, but 'mujoco' for MJCF robots"
    )
    integrator: Literal["rk4", "euler", "tsit5", "rosenbrock"] | None = Field(
        None, description="in place of the simulation's; 'rosenbrock' for the distributed law"
    )


# Keys of a start that are agents' own: their outputs, other states, and what follows from them
STARTS = ("action", "extension", "appendage_velocity", "position", "velocity", "integral")


class InitialTable(Table):
    """The start; what is left out rests, relaxed, at the default actions."""

    action: Annotated[PerAction | None, Fills("state"), Unit(ACTION, "strictly inside")] = Field(
        None, description="y(0); the game's own, or one that is looked for inside, if left out"
    )
    extension: Annotated[PerAction | None, Unit("m")] = Field(None, description="robots: x1(0)")
    appendage_velocity: Annotated[PerAction | None, Unit("m/s")] = Field(
        None, description="robots: x3(0)"
    )
    position: Annotated[PerAction | None, Unit("m")] = Field(
        None, description="robots: d(0), or q(0) of outputs that are positions"
    )
    velocity: Annotated[PerAction | None, Unit("m/s")] = Field(
        None, description="v(0) of robots whose outputs are positions, relative to v_0"
    )
    integral: Annotated[PerAction | None, Unit(ACTION)] = Field(
        None, description="PI cascade: s(0)"
    )
    estimate: Annotated[
        float | list[float] | list[list[float]] | None,
        Fills("memory"),
        Unit(ACTION, "strictly inside for the distributed law"),
    ] = Field(
        None,
        description="what agents take all actions to be: one number, a profile for all agents, or"
        " one profile each; y(0) if left out",
    )
    filtered: Annotated[PerAction | None, Unit(ACTION, "strictly inside")] = Field(
        None, description="distributed law: z(0); y(0) if left out"
    )
    load: Annotated[PerAction | None, Unit(INPUT)] = Field(
        None,
        description="with controller.observer: what is known to push the agents; 0 if left out",
    )

    def leaves_open(self, agents: Agents) -> bool:
        """Whether agents start where a keyframe or settling leaves them."""
        return agents.standing is not None and all(getattr(self, key) is None for key in STARTS)

    def build(
        self, agents: Agents, sizes: Sizes, default: Callable[[], NDArray[np.float64]]
    ) -> NDArray[np.float64]:
        """(m, states): at rest at y(0), but for what is given."""
        if self.leaves_open(agents):
            return np.array(agents.standing)
        y = default() if self.action is None else per_action("action", self.action, sizes)
        state = agents.equilibrium(y)
        if agents.standing is not None and followed_position(agents.kind) < 0:
            state = agents.standing.copy()
            state[:, agents.kind.OUTPUT] = y
        names = [name for name, _ in agents.kind.STATES]
        placed = placed_state(agents.kind)
        if placed is not None:
            state[:, names.index(placed)] = _places(sizes)
        given = {}
        for key in STARTS:
            value = getattr(self, key)
            if value is None:
                continue
            if key not in start_keys(agents.kind):
                raise InvalidInput(key, value, f"{agents.kind.NAME}s have no {key}")
            given[key] = per_action(key, value, sizes)
        return start_of(agents.kind, agents.parameters, state, given)


class SystemTable(Table):
    """One game with its agents."""

    game: Annotated[GameTable, GAMES] = Field(description="what is played")
    # N is the game's too
    agents: Annotated[AgentsTable, AGENTS, Fills("")] = Field(description="who plays")
    barrier: Annotated[BarrierTable, Fills("")] = Field(
        BarrierTable(), description="what keeps them inside"
    )
    controller: Annotated[LawTable, LAWS, Fills("law"), Fills("")] = Field(
        FullController(information="full"), description="by which law"
    )
    plant: Annotated[PlantTable, Fills("")] = Field(
        PlantTable(), description="what moves the agents"
    )
    initial: Annotated[InitialTable, Fills("")] = Field(InitialTable(), description="the start")
    separation: SeparationTable | None = Field(
        None, description="agents in the plane keep at least a distance from each other"
    )
    margin: Annotated[MarginTable | None, Fills("disturbance")] = Field(
        None, description="the barrier is tightened so that these disturbances keep all inside"
    )
    membership: MembershipTable | None = Field(
        None, description="agents that leave and join during the run"
    )
    faults: list[Annotated[FaultTable, FAULTS]] = Field(
        [], description="what goes wrong, each from a start (s) to an end"
    )

    @field_validator("controller", mode="before")
    @classmethod
    def _full_by_default(cls, table: Any) -> Any:
        """A controller that does not say what it knows knows everything, as if left out."""
        given = isinstance(table, Mapping) and "information" not in table
        return {"information": "full", **table} if given else table

    def game_and_start(self, name: str) -> tuple[Game, NDArray[np.float64]]:
        """The game alone with a profile strictly inside: y(0) or, if it is not, one near it.

        Args:
            name: of the system.

        Raises:
            InvalidInput: no game can be made, or no such profile was found.
        """
        given = self.initial.action
        with self.naming(name):
            game = self._game()
            if given is None:
                y = self._default_start(game)
            else:
                y = per_action("initial.action", given, game.sizes)
            inside = bool(np.all(game.constraints(y) < 0.0))
            return game, y if inside else interior_profile(game, y)

    def _default_start(self, game: Game) -> NDArray[np.float64]:
        """y(0) where none is given: the game's own, or one that is looked for inside."""
        y = self.game.default_start(self.agents.count)
        return interior_profile(game, np.zeros(game.actions)) if y is None else y

    def build(self, name: str, simulation: "SimulationTable", at: Present | None = None) -> System:
        """The system, with the simulation's integrator unless it names its own.

        Args:
            name: of the system.
            simulation: the clock's table.
            at: where it starts, in place of the initial table; its memory may be longer.
        """
        with self.naming(name):
            return self._build(name, simulation, at)

    def _build(self, name: str, simulation: "SimulationTable", at: Present | None) -> System:
        period = simulation.control_period or simulation.timestep
        game, agents = self._parts(simulation)
        with part_of("controller"):
            law = self.controller.build(game)
        if self.margin and not (MODES[self.controller.mode].promises or law.acts_outside):
            raise InvalidInput(
                "margin", "given", "it is for mode 'implicit', where a margin is a promise"
            )
        check_law_room(game, law)
        if at is None:
            state, memory = self._start(game, agents, law)
        else:
            state = at.state
            length = len(law.initial_memory(state[:, agents.kind.OUTPUT]))
            memory = at.memory[:length].copy()
        with part_of("barrier"):
            schedule = self.barrier.build(1e-9)
        system = System(
            name=name,
            game=game,
            agents=agents,
            law=law,
            rho=self.barrier.rho if schedule is None else schedule.floor,
            schedule=schedule,
            faults=self._faults(),
            seed=simulation.seed,
            disturbance=self._disturbance(game),
            separation=self._separation(),
            state=state,
            memory=memory,
            mode=self.controller.mode,
            decentralised=self.controller.decentralised,
            between=self.controller.between,
            observer=self.controller.observer,
            compensation=self.controller.compensation,
            load=self._load(game),
            membership=self._membership(game),
            feed_forward=self.controller.feed_forward,
            engine=self.plant.engine or self.agents.engine,
            integrator=self.plant.integrator or simulation.integrator,
            rtol=simulation.rtol,
            on_exit=simulation.on_exit,
        )
        acts = mode_of(system).explicit_period(period, simulation.timestep)
        if schedule is None or self.barrier.floor is not None or acts is None:
            return system
        floor = least_rho(system, acts)
        return replace(system, rho=floor, schedule=self.barrier.build(floor))

    def players(self, sizes: Sizes) -> tuple[Agents, tuple[Fault, ...]]:
        """The agents, for actions of so many entries each, and what goes wrong with them."""
        with part_of("agents"):
            agents = self.agents.build(sizes)
        return agents, self._faults()

    def _faults(self) -> tuple[Fault, ...]:
        found = []
        for number, fault in enumerate(self.faults):
            with part_of(f"faults.{number}"):
                found.append(fault.build())
        event = getattr(self.controller, "communication", None)
        if event is not None:
            with part_of("controller.communication"):
                found.append(EventTrigger(**event.model_dump(exclude={"type"})))
        return tuple(found)

    @contextmanager
    def naming(self, name: str) -> Iterator[None]:
        """Let what is refused within be named by the keys of this system, which has this name."""

        def key_of(parameter: str) -> str:
            # the clock is all systems'
            of_all = parameter.startswith("simulation.")
            return parameter if of_all else f"systems.{name}.{self.key_of(parameter)}"

        with renaming(key_of):
            yield

    def build_inside(
        self, name: str, simulation: "SimulationTable"
    ) -> tuple[System, dict[str, Any] | None]:
        """The system and what was done where no start is given, or one that is not inside.

        It then starts at an interior profile that was looked for, with estimates that fit, and
        what was done has ``why`` in words and the ``action`` (m,) that was found; else it is None.

        Raises:
            InvalidInput: see :class:`gne_mj.system.System`; no interior profile was found.
        """
        given = self.initial.action
        with self.naming(name):
            game, _ = self._parts(simulation)
        try:
            built = self.build(name, simulation)
            default = self.game.default_start(self.agents.count)
            if given is None and default is None and not self.initial.leaves_open(built.agents):
                return built, {"why": "no start is given", "action": built.start.tolist()}
            return built, None
        except InfeasibleStart as error:
            why = str(error)
            wanted = (
                self._default_start(game)
                if given is None
                else per_action("initial.action", given, game.sizes)
            )
        with self.naming(name):
            profile = interior_profile(game, wanted)
        table = self.starting_at(profile, game.sizes)
        # Estimates that were given belong to the start that was given.
        initial = table.initial.model_copy(update={"estimate": None, "filtered": None})
        system = table.model_copy(update={"initial": initial}).build(name, simulation)
        return system, {"why": why, "action": profile.tolist()}

    def starting_at(
        self, y: NDArray[np.float64], sizes: Sizes, position: NDArray[np.float64] | None = None
    ) -> "SystemTable":
        """The same system with y(0) = y, shape (m,).

        Where positions follow outputs q(0) is ``position`` (m,) or, if left out, y: at rest, and
        inside as y is.
        """
        update: dict[str, Any] = {"action": _by_agent(y, sizes)}
        if getattr(self.agents, "positions", False):
            at = None if position is None else _by_agent(position, sizes)
            update |= {"position": at, "velocity": None}
        return self.model_copy(update={"initial": self.initial.model_copy(update=update)})

    def _parts(self, simulation: "SimulationTable") -> tuple[Game, Agents]:
        """The game, with its margin, and the agents."""
        game = self._game()
        with part_of("agents"):
            built = self.agents.build(game.sizes)
        integrator = self.plant.integrator or simulation.integrator
        agents = built.stood(simulation.timestep, integrator)
        disturbance = self._disturbance(game)
        if disturbance is None:
            return game, agents
        if self.game.moving:
            raise InvalidInput(
                "margin",
                "given",
                f"no margin is known for a game that moves (game.{self.game.moving[0]})",
            )
        period = simulation.control_period or simulation.timestep
        keys = {
            "period": "simulation.control_period", "observer": "controller.observer",
            "disturbance": "margin", "guarded": "controller.between",
        }  # fmt: skip
        with named(**keys):
            guarded = self.controller.between == GUARDED
            steps = max(1, round(period / simulation.timestep))
            unforeseen = beyond_estimates(
                agents, simulation.timestep, integrator, steps, disturbance,
                self.controller.observer, guarded,
            )  # fmt: skip
            game = with_margin(
                game, agents, unforeseen, simulation.timestep, integrator, steps, guarded
            )
        return game, agents

    def _game(self) -> Game:
        with part_of("game"):
            return self.game.game(self.agents.count)

    def _disturbance(self, game: Game) -> Disturbance | None:
        if self.margin is None:
            return None
        with part_of("margin"):
            return self.margin.disturbance(game)

    def _load(self, game: Game) -> NDArray[np.float64] | None:
        given = self.initial.load
        return None if given is None else per_action("initial.load", given, game.sizes)

    def _membership(self, game: Game) -> Membership | None:
        if self.membership is None:
            return None
        with part_of("membership"):
            away = self.game.away(self.agents.count)
            return self.membership.build(game, away, self.game.keeps)

    def _separation(self) -> Separation | None:
        if self.separation is None:
            return None
        with part_of("separation"):
            return self.separation.build()

    def _start(
        self, game: Game, agents: Agents, law: Law
    ) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """States (m, states) and the law's memory, as the initial table has them."""
        sizes, initial = game.sizes, self.initial
        with part_of("initial"):
            state = initial.build(agents, sizes, lambda: self._default_start(game))
            if initial.leaves_open(agents):
                check_standing(game, state[:, agents.kind.OUTPUT])
            filtered = initial.filtered
            memory = law.initial_memory(
                state[:, agents.kind.OUTPUT],
                initial.estimate,
                None if filtered is None else per_action("filtered", filtered, sizes),
            )
        return state, memory


def check_standing(game: Game, y: NDArray[np.float64]) -> None:
    """Refuse agents of whose start nothing is given, and that stand outside.

    Raises:
        InvalidInput: names ``action``.
    """
    worst, value = game.tightest(y)
    if not value < 0.0:
        raise InvalidInput(
            "action", None, f"in their keyframe, or settled, agents' outputs are"
            f" {np.round(y[:6], 4).tolist()}, where constraint '{game.constraint_names[worst]}' has"
            f" g = {value:.3g} and not less than 0: give one inside, or let them start elsewhere",
        )  # fmt: skip


def _by_agent(y: NDArray[np.float64], sizes: Sizes) -> Any:
    """Numbers (m,) as a table has them: a list, of lists where actions are vectors."""
    blocks = np.split(y, np.cumsum(sizes)[:-1])
    return [block.tolist() for block in blocks] if max(sizes) > 1 else y.tolist()


def _places(sizes: Sizes) -> NDArray[np.float64]:
    """(m,) positions in m, 1.5 m apart: behind each other, or in the rows of a square."""
    count, dimension = len(sizes), max(sizes)
    places = np.zeros((count, dimension))
    number = np.arange(count)
    side = count if dimension == 1 else int(np.ceil(np.sqrt(count)))
    places[:, 0] = -1.5 * (number % side)
    places[:, 1:2] = -1.5 * (number // side)[:, None]
    return places[np.arange(dimension) < np.array(sizes)[:, None]]
