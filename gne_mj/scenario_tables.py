"""The tables of a scenario file: what may stand where, and what is built from it.

Each table has the fields that a user may set, with their units, and a ``build`` that makes the
object they describe.
"""

import re
from collections.abc import Callable, Iterable, Mapping
from pathlib import Path
from typing import Annotated, Any, ClassVar, Literal, get_args

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, ConfigDict, Field, model_validator
from pydantic_core import PydanticCustomError

from gne_mj import graph as graphs
from gne_mj.controllers import FullInformation, FullyDistributed, Law, PartialInformation
from gne_mj.errors import InvalidInput, nearest
from gne_mj.game import Game
from gne_mj.games import (
    cournot_game,
    osnr_game,
    ten_channels,
    velocity_consensus_game,
    velocity_game,
)
from gne_mj.plants import flexible_robot, integrator, mixed, pi_cascade
from gne_mj.plants.agents import Agents
from gne_mj.plants.mjcf_robot import RobotFile, mjcf_robots
from gne_mj.simulation import Simulation
from gne_mj.system import Clock, System
from gne_mj.user_files import load_game, load_law

# One number for all agents, or one each
PerAgent = float | list[float]

# m_i, the entries of each agent's action
Sizes = tuple[int, ...]

# Of what every entry of an action has: one number for all; where an action is a vector, one vector
# for all agents or a list of them; else one number for each agent
PerAction = float | list[float] | list[list[float]]

# The paper gives no initial velocities, and from rest the first gap would lie on its bound.
DEFAULT_VELOCITIES = (1.0, 0.0, -1.0, 0.5, 2.0)


class _Table(BaseModel):
    """A TOML table: unknown keys and numbers that are not finite are errors."""

    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)

    @model_validator(mode="before")
    @classmethod
    def _known_keys(cls, values: Any) -> Any:
        if isinstance(values, Mapping):
            for key in values:
                if key not in cls.model_fields:
                    raise PydanticCustomError(
                        "unknown_key",
                        "{name} is not a key here; {hint}",
                        {"name": repr(key), "hint": cls._hint(str(key))},
                    )
        return values

    @classmethod
    def _hint(cls, key: str) -> str:
        """Where a key that is unknown here belongs, or the nearest one that is known here."""
        for choice in ("type", "information"):
            for other in all_tables() if choice in cls.model_fields else ():
                if choice in other.model_fields and key in other.model_fields:
                    (own,) = get_args(cls.model_fields[choice].annotation)
                    (theirs,) = get_args(other.model_fields[choice].annotation)
                    example = " (--set 'controller={...}')" if choice == "information" else ""
                    return (
                        f"it belongs to {choice} = '{theirs}', not to '{own}'; to change the"
                        f" {choice} give the whole table{example}"
                    )
        return nearest(key, cls.model_fields)


class VelocityGame(_Table):
    """[eq:sensorNetGNE]"""

    type: Literal["velocity-synchronization"]
    reference_velocity: float = Field(3.0, description="v_0 in m/s")
    gap_bound: PerAgent = Field(3.0, description="delta_i in m/s, positive")
    desired_velocity: PerAgent | None = Field(
        None, description="v_i^d in m/s; the reference velocity if left out"
    )
    desired_weight: PerAgent = Field(0.0, description="w_i, not negative")

    def build(self, count: int) -> Game:
        """The game for ``count`` agents."""
        desired = self.desired_velocity
        return velocity_game(
            count,
            self.reference_velocity,
            _per_agent("game.gap_bound", self.gap_bound, count, positive=True),
            None if desired is None else _per_agent("game.desired_velocity", desired, count),
            _per_agent("game.desired_weight", self.desired_weight, count),
        )

    def default_start(self, count: int) -> NDArray[np.float64]:
        """The named start for five agents; else everyone half a bound below the reference."""
        if count == len(DEFAULT_VELOCITIES):
            return np.array(DEFAULT_VELOCITIES)
        first = self.gap_bound if isinstance(self.gap_bound, float) else self.gap_bound[0]
        return np.full(count, self.reference_velocity - 0.5 * first)


class VelocityConsensusGame(_Table):
    """Velocity vectors synchronised over any graph, some agents knowing the reference."""

    type: Literal["velocity-consensus"]
    reference_velocity: list[float] = Field([1.0, 1.0], description="v_0 in m/s")
    edges: Literal["line", "ring", "complete", "printed", "caption"] | list[tuple[int, int]] = (
        Field("ring", description="a name, or pairs of agents numbered from 1; of the game, not"
              " of who hears whom")
    )  # fmt: skip
    leader_weight: PerAgent | None = Field(
        None, description="w_i, positive for leaders and 0 for others; if left out agent 1 leads"
    )
    gap_bound: PerAgent = Field(3.0, description="in m/s, positive; one or one for each edge")
    leader_gap_bound: PerAgent = Field(
        3.0, description="to v_0 in m/s, positive; one or one for each leader"
    )

    def build(self, count: int) -> Game:
        """The game for ``count`` agents."""
        given = self.leader_weight
        weight = _per_agent("game.leader_weight", 0.0 if given is None else given, count)
        if given is None:
            weight[0] = 1.0
        return velocity_consensus_game(
            self._edges(count),
            weight.tolist(),
            self.reference_velocity,
            self.gap_bound,
            self.leader_gap_bound,
        )

    def _edges(self, count: int) -> list[tuple[int, int]]:
        if not isinstance(self.edges, str):
            return [(i - 1, j - 1) for i, j in self.edges]
        try:
            return list(graphs.NAMED[self.edges](count).edges)
        except InvalidInput as error:
            raise InvalidInput("game.edges", error.value, error.expected) from None

    def default_start(self, count: int) -> NDArray[np.float64]:
        """Everyone half a leader's bound below the reference, along the first axis."""
        start = np.tile(np.array(self.reference_velocity), (count, 1))
        start[:, 0] -= 0.5 * np.min(self.leader_gap_bound)
        return start.ravel()


class OsnrGame(_Table):
    """[eq:osnrGNE]; what is left out is taken from the ten-channel link."""

    type: Literal["osnr"]
    total_power_limit: float | None = Field(None, gt=0, description="P_0 in mW")
    price: list[float] | None = None
    utility_weight: list[float] | None = None
    gain: list[float] | None = None
    noise_power: list[float] | None = None
    system_matrix: list[list[float]] | None = None

    def build(self, count: int) -> Game:
        """The game for ``count`` agents."""
        parameters = ten_channels()
        if self.system_matrix is not None and len({len(row) for row in self.system_matrix}) > 1:
            raise InvalidInput("game.system_matrix", "...", "its rows must be of one length")
        given = self.model_dump(exclude={"type"}, exclude_none=True)
        parameters.update(given)
        for key in ("price", "utility_weight", "gain", "noise_power", "system_matrix"):
            if len(parameters[key]) != count:
                raise InvalidInput(
                    f"game.{key}",
                    f"{len(parameters[key])} channels",
                    f"agents.count is {count}; every list must have that many entries",
                )
        return osnr_game(**parameters)

    def default_start(self, count: int) -> NDArray[np.float64]:
        """80% of the power limit, shared equally."""
        limit = self.total_power_limit or ten_channels()["total_power_limit"]
        return np.full(count, 0.8 * limit / count)


class CournotGame(_Table):
    """Firms of one product; what is left out has the published numbers for ``count`` firms."""

    type: Literal["cournot"]
    unit_cost: list[float] | None = Field(None, description="c_i; N (1 + (i - 1) / 2)")
    demand_intercept: float | None = Field(None, description="D, price of an empty market; 60 N")
    lower_bound: PerAgent = Field(7.0, description="least quantity of each firm")
    upper_bound: PerAgent = Field(100.0, description="greatest quantity of each firm")

    def build(self, count: int) -> Game:
        """The game for ``count`` agents."""
        return cournot_game(count, **self.model_dump(exclude={"type"}))

    def default_start(self, count: int) -> NDArray[np.float64]:
        """Every firm half way between its bounds."""
        middle = 0.5 * (np.asarray(self.lower_bound) + np.asarray(self.upper_bound))
        return np.broadcast_to(middle, (count,)).copy()


class CustomGame(_Table):
    """A game of the user's own."""

    type: Literal["custom"]
    file: str = Field(description="Python file that defines game(count, ...)")
    parameters: dict[str, Any] = Field({}, description="handed to it")

    def build(self, count: int) -> Game:
        """The game for ``count`` agents."""
        return load_game(self.file, count, self.parameters)

    def default_start(self, count: int) -> NDArray[np.float64]:
        """There is none."""
        raise InvalidInput("initial.action", None, "a custom game has no default start: give one")


class _AgentsTable(_Table):
    count: int = Field(gt=0, description="N")
    input_limit: PerAction | None = Field(
        None, description="greatest |u| that the actuators deliver; no limit if left out"
    )

    def limits(self, sizes: Sizes) -> NDArray[np.float64]:
        """(m,) limits, infinite where none is given."""
        if self.input_limit is None:
            return np.full(sum(sizes), np.inf)
        limits = _per_action("agents.input_limit", self.input_limit, sizes)
        if np.any(limits <= 0):
            raise InvalidInput("agents.input_limit", self.input_limit, "it must be positive")
        return limits

    def rows(self, sizes: Sizes, *names: str, positive: Iterable[str]) -> NDArray[np.float64]:
        """(m, len(names)) parameters, the same for all channels of an agent."""
        columns = [
            _per_agent(f"agents.{n}", getattr(self, n), self.count, positive=n in positive)
            for n in names
        ]
        return np.repeat(np.column_stack(columns), sizes, axis=0)


class _RobotTable(_AgentsTable):
    """[eq:MobileRobot]"""

    axes: ClassVar[int]
    main_mass: PerAgent = Field(1.0, description="M in kg, positive")
    appendage_mass: PerAgent = Field(1.0, description="m in kg, positive")
    stiffness: PerAgent = Field(1.0, description="linear part of psi in N/m")
    atan_coefficient: PerAgent = Field(1.0, description="atan part of psi in N")
    damping: PerAgent = Field(1.0, description="gamma in N s/m")

    def build(self, sizes: Sizes) -> Agents:
        """The agents, for actions of so many entries each."""
        _check_sizes(self.type, self.axes, sizes)  # type: ignore[attr-defined]
        names = flexible_robot.PARAMETERS
        table = self.rows(sizes, *names, positive=("main_mass", "appendage_mass"))
        if np.any(table[:, 4] < 0):
            raise InvalidInput("agents.damping", self.damping, "no entry may be negative")
        return Agents(flexible_robot, table, self.limits(sizes), self.axes)


class RobotAgents(_RobotTable):
    """Robots on a lane."""

    axes: ClassVar[int] = 1
    type: Literal["flexible-robot"]


class PlanarRobotAgents(_RobotTable):
    """Robots in the plane, with the same masses, spring and damper along both axes."""

    axes: ClassVar[int] = 2
    type: Literal["planar-flexible-robot"]


class IntegratorAgents(_AgentsTable):
    """[eq:int]"""

    type: Literal["integrator"]

    def build(self, sizes: Sizes) -> Agents:
        """The agents, for actions of so many entries each."""
        table = np.zeros((sum(sizes), 0))
        return Agents(integrator, table, self.limits(sizes), _dimension(sizes))


class PiCascadeAgents(_AgentsTable):
    """[eq:cascadePI]"""

    type: Literal["pi-cascade"]
    decay_rate: PerAgent = Field(1.0, description="v in 1/s")
    integral_gain: PerAgent = Field(0.5, description="k in 1/s, 0 < k < v")

    def build(self, sizes: Sizes) -> Agents:
        """The agents, for actions of so many entries each."""
        table = self.rows(sizes, *pi_cascade.PARAMETERS, positive=pi_cascade.PARAMETERS)
        if np.any(table[:, 1] >= table[:, 0]):
            raise InvalidInput(
                "agents.integral_gain",
                self.integral_gain,
                "it must be below decay_rate (0 < k < v)",
            )
        return Agents(pi_cascade, table, self.limits(sizes), _dimension(sizes))


class MjcfAgents(_AgentsTable):
    """Robots of the user's own."""

    type: Literal["mjcf-robot"]
    file: str | list[str] = Field(description="MJCF file, one for all or one each")
    output: str | list[str] = Field(description="joint or velocity sensor that is y_i")
    input: str | list[str] = Field(description="actuator that u_i drives")

    def build(self, sizes: Sizes) -> Agents:
        """The agents, for actions of one entry each."""
        _check_sizes(self.type, 1, sizes)
        columns = []
        for key in ("file", "output", "input"):
            given = getattr(self, key)
            each = [given] * self.count if isinstance(given, str) else given
            if len(each) != self.count:
                raise InvalidInput(
                    f"agents.{key}", given, f"it must be one name or a list of {self.count}"
                )
            columns.append(each)
        robots = tuple(RobotFile(Path(f), o, i) for f, o, i in zip(*columns, strict=True))
        return mjcf_robots(robots, self.limits(sizes))


class MixedAgents(_Table):
    """Agents of several types."""

    type: Literal["mixed"]
    groups: list[
        Annotated[
            RobotAgents | PlanarRobotAgents | IntegratorAgents | PiCascadeAgents,
            Field(discriminator="type"),
        ]
    ] = Field(min_length=1, description="tables of agents, one behind the other")

    @property
    def count(self) -> int:
        """N."""
        return sum(group.count for group in self.groups)

    def build(self, sizes: Sizes) -> Agents:
        """The agents, for actions of so many entries each."""
        first, built = 0, []
        for index, group in enumerate(self.groups):
            try:
                built.append(group.build(sizes[first : first + group.count]))
            except InvalidInput as error:
                key = error.key.replace("agents", f"agents.groups.{index}", 1)
                raise InvalidInput(key, error.value, error.expected) from None
            first += group.count
        return mixed.join(built, _dimension(sizes))


class BarrierTable(_Table):
    """[eq:logbarrier]"""

    rho: float = Field(0.1, gt=0)


class FullController(_Table):
    """[eq:nonlinFIfeedback]"""

    information: Literal["full"]
    mode: Literal["continuous", "sampled"] = "continuous"

    def build(self, game: Game) -> Law:
        """The law."""
        return FullInformation()


class _NetworkController(_Table):
    graph: Literal["line", "ring", "complete", "printed", "caption"] | list[tuple[int, int]] = (
        Field("ring", description="a name, or edges as pairs of agents numbered from 1")
    )

    def network(self, count: int) -> graphs.Graph:
        """The communication graph."""
        if isinstance(self.graph, str):
            return graphs.NAMED[self.graph](count)
        return graphs.Graph(count, tuple((i - 1, j - 1) for i, j in self.graph))


class PartialController(_NetworkController):
    """[eq:nonlinearPIFeedback]"""

    information: Literal["partial"]
    mode: Literal["continuous", "sampled"] = "continuous"
    coupling: float = Field(1.0, gt=0, description="c; the paper has 1")
    time_constant: float = Field(1.0, gt=0, description="tau of the estimates in s; the paper's 1")

    def build(self, game: Game) -> Law:
        """The law."""
        return PartialInformation(self.network(game.agents), self.coupling, self.time_constant)


class DistributedController(_NetworkController):
    """[eq:CenterFeedback]"""

    information: Literal["distributed"]
    mode: Literal["continuous", "sampled"] = "continuous"
    epsilon: float = Field(gt=0, description="time constant of estimates and z in s")
    gain: float = Field(1.0, gt=0, description="k")

    def build(self, game: Game) -> Law:
        """The law."""
        return FullyDistributed(self.network(game.agents), self.epsilon, self.gain)


class CustomController(_NetworkController):
    """A law of the user's own."""

    information: Literal["custom"]
    mode: Literal["continuous", "sampled"] = "continuous"
    file: str = Field(description="Python file that defines law(game, graph, ...) or action(...)")
    parameters: dict[str, Any] = Field({}, description="handed to it")

    def build(self, game: Game) -> Law:
        """The law."""
        return load_law(self.file, game, self.network(game.agents), self.parameters)


class PlantTable(_Table):
    """What moves the agents."""

    engine: Literal["mujoco", "ode"] | None = Field(
        None, description="'ode' if left out, but 'mujoco' for MJCF robots"
    )
    integrator: Literal["rk4", "euler", "rosenbrock"] | None = Field(
        None, description="in place of the simulation's"
    )


class InitialTable(_Table):
    """The start; what is left out rests, relaxed, at the default actions."""

    action: PerAction | None = Field(None, description="y(0)")
    extension: PerAction | None = Field(None, description="robots: x1(0) in m")
    appendage_velocity: PerAction | None = Field(None, description="robots: x3(0) in m/s")
    position: PerAction | None = Field(None, description="robots: d(0) in m")
    integral: PerAction | None = Field(None, description="PI cascade: s(0)")
    estimate: float | list[float] | list[list[float]] | None = Field(
        None, description="one number, a profile that all agents hold, or one profile each; y(0)"
    )
    filtered: PerAction | None = Field(None, description="distributed law: z(0); y(0) if left out")

    def build(
        self, agents: Agents, sizes: Sizes, default: Callable[[], NDArray[np.float64]]
    ) -> NDArray[np.float64]:
        """(m, states): at rest at y(0), but for what is given."""
        y = default() if self.action is None else _per_action("initial.action", self.action, sizes)
        state = agents.equilibrium(y)
        names = [name for name, _ in agents.kind.STATES]
        if agents.kind is flexible_robot:
            state[:, names.index("position")] = _places(sizes)
        for key in ("extension", "appendage_velocity", "position", "integral"):
            given = getattr(self, key)
            if given is None:
                continue
            if key not in names:
                raise InvalidInput(f"initial.{key}", given, f"{agents.kind.NAME}s have no {key}")
            state[:, names.index(key)] = _per_action(f"initial.{key}", given, sizes)
        return state


class SystemTable(_Table):
    """One game with its agents."""

    game: Annotated[
        VelocityGame | VelocityConsensusGame | OsnrGame | CournotGame | CustomGame,
        Field(discriminator="type"),
    ]
    agents: Annotated[
        RobotAgents
        | PlanarRobotAgents
        | IntegratorAgents
        | PiCascadeAgents
        | MixedAgents
        | MjcfAgents,
        Field(discriminator="type"),
    ]
    barrier: BarrierTable = BarrierTable()
    controller: Annotated[
        FullController | PartialController | DistributedController | CustomController,
        Field(discriminator="information"),
    ] = FullController(information="full")
    plant: PlantTable = PlantTable()
    initial: InitialTable = InitialTable()

    def build(self, name: str, integrator_name: str) -> System:
        """The system, with the simulation's integrator unless it names its own."""
        count = self.agents.count
        try:
            game = self.game.build(count)
            agents = self.agents.build(game.sizes)
            law = self.controller.build(game)
            state = self.initial.build(agents, game.sizes, lambda: self.game.default_start(count))
            filtered = self.initial.filtered
            memory = law.initial_memory(
                state[:, agents.kind.OUTPUT],
                self.initial.estimate,
                None if filtered is None else _per_action("initial.filtered", filtered, game.sizes),
            )
        except InvalidInput as error:
            raise InvalidInput(f"systems.{name}.{error.key}", error.value, error.expected) from None
        return System(
            name=name,
            game=game,
            agents=agents,
            law=law,
            rho=self.barrier.rho,
            state=state,
            memory=memory,
            mode=self.controller.mode,
            engine=self.plant.engine or ("mujoco" if self.agents.type == "mjcf-robot" else "ode"),
            integrator=self.plant.integrator or integrator_name,
        )


class SimulationTable(_Table):
    """The clock that all systems share."""

    duration: float = Field(30.0, gt=0, description="s")
    timestep: float = Field(0.002, gt=0, description="s")
    control_period: float | None = Field(
        None, gt=0, description="s, for mode sampled; the timestep if left out"
    )
    integrator: Literal["rk4", "euler"] = "rk4"
    tolerance: float = Field(1e-3, gt=0, description="on max |y - y*|, for status converged")
    seed: int = Field(0, ge=0)


class RecordingTable(_Table):
    """What is kept."""

    period: float = Field(0.05, gt=0, description="s between samples")


class Scenario(_Table):
    """A whole run: systems on one clock."""

    description: str = ""
    simulation: SimulationTable = SimulationTable()
    recording: RecordingTable = RecordingTable()
    systems: dict[str, SystemTable] = Field(min_length=1)

    @model_validator(mode="after")
    def _names(self) -> "Scenario":
        for name in self.systems:
            if not re.fullmatch(r"[A-Za-z0-9_-]+", name):
                raise PydanticCustomError(
                    "name", "a system's name has letters, digits, '-' and '_' only"
                )
        return self

    def clock(self) -> Clock:
        """The shared clock."""
        simulation = self.simulation
        try:
            return Clock(
                duration=simulation.duration,
                timestep=simulation.timestep,
                control_period=simulation.control_period or simulation.timestep,
                sample_period=self.recording.period,
            )
        except InvalidInput as error:
            if error.key == "simulation.sample_period":
                raise InvalidInput("recording.period", error.value, error.expected) from None
            raise

    def system_objects(self) -> list[System]:
        """The systems, checked.

        Raises:
            InvalidInput, InfeasibleStart: see :class:`gne_mj.system.System`.
        """
        integrator = self.simulation.integrator
        return [table.build(name, integrator) for name, table in self.systems.items()]

    def simulation_object(self) -> Simulation:
        """The scenario, ready to run.

        Raises:
            InvalidInput, InfeasibleStart: see :class:`gne_mj.system.System`.
        """
        clock = self.clock()
        return Simulation(
            self.system_objects(),
            clock,
            tolerance=self.simulation.tolerance,
            seed=self.simulation.seed,
            source=self.model_dump_json(exclude_none=True),
        )


def _dimension(sizes: Sizes) -> int:
    """Channels of each agent, where all have as many; else each channel is taken by itself."""
    return sizes[0] if len(set(sizes)) == 1 else 1


def _check_sizes(kind: str, axes: int, sizes: Sizes) -> None:
    for size in sizes:
        if size != axes:
            raise InvalidInput(
                "agents.type",
                kind,
                f"its agents act along {axes} {'axis' if axes == 1 else 'axes'}, and the game's"
                f" actions have {size}",
            )


def _places(sizes: Sizes) -> NDArray[np.float64]:
    """(m,) positions in m, 1.5 m apart: behind each other, or in the rows of a square."""
    count, dimension = len(sizes), max(sizes)
    places = np.zeros((count, dimension))
    number = np.arange(count)
    side = count if dimension == 1 else int(np.ceil(np.sqrt(count)))
    places[:, 0] = -1.5 * (number % side)
    places[:, 1:2] = -1.5 * (number // side)[:, None]
    return places[np.arange(dimension) < np.array(sizes)[:, None]]


def _per_action(key: str, given: PerAction, sizes: Sizes) -> NDArray[np.float64]:
    """(m,) numbers, agent by agent."""
    count, dimension = len(sizes), _dimension(sizes)
    vectors: list[Any] = []
    if isinstance(given, list):
        if any(isinstance(entry, list) for entry in given):
            vectors = given
        elif max(sizes) > 1:
            vectors = [given] * count
    if not vectors:
        return np.repeat(_per_agent(key, given, count), sizes)  # type: ignore[arg-type]
    if tuple(map(len, vectors)) != tuple(sizes):
        one = f"one list of {dimension} for all agents, or " if dimension > 1 else ""
        raise InvalidInput(
            key,
            given,
            f"it must be one number, {one}a list of {count} lists, one for each agent",
        )
    return np.concatenate(vectors, dtype=np.float64)


def _per_agent(
    key: str, given: PerAgent, count: int, *, positive: bool = False
) -> NDArray[np.float64]:
    values = np.asarray(given, dtype=np.float64)
    if values.ndim == 1 and len(values) != count:
        raise InvalidInput(
            key, given, f"it must be one number or a list of {count}, one for each agent"
        )
    if positive and np.any(values <= 0):
        raise InvalidInput(key, given, "it must be positive")
    return np.broadcast_to(values, (count,)).copy()


def all_tables() -> list[type[_Table]]:
    """Every kind of table."""
    found: list[type[_Table]] = []
    waiting: list[type[_Table]] = [_Table]
    while waiting:
        table = waiting.pop()
        found.append(table)
        waiting.extend(table.__subclasses__())
    return found


def union_tags() -> set[str]:
    """What may stand in the keys that choose among tables, such as "osnr" in ``game.type``."""
    keys = ("type", "information")
    fields = [table.model_fields[key] for table in all_tables() for key in keys
              if key in table.model_fields]  # fmt: skip
    return {tag for field in fields for tag in get_args(field.annotation)}
