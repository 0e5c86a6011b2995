"""Scenario files: TOML in, validated objects out. A scenario defines a run, and holds no code."""

import difflib
import json
import re
import tomllib
from collections.abc import Iterable, Mapping
from importlib.resources import files
from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import (
    BaseModel,
    ConfigDict,
    Field,
    ValidationError,
    model_validator,
)
from pydantic_core import PydanticCustomError

from gne_mj import graph as graphs
from gne_mj.controllers import FullInformation, FullyDistributed, Law
from gne_mj.errors import InvalidInput
from gne_mj.game import Game
from gne_mj.games import osnr_game, ten_channels, velocity_game
from gne_mj.plants import flexible_robot, integrator, pi_cascade
from gne_mj.plants.agents import Agents
from gne_mj.simulation import Simulation
from gne_mj.system import Clock, System
from gne_mj.trajectory import Trajectory

# One number for all agents, or one each
PerAgent = float | list[float]

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
                        {"name": repr(key), "hint": nearest(str(key), cls.model_fields)},
                    )
        return values


class VelocityGame(_Table):
    """[eq:sensorNetGNE]"""

    type: Literal["velocity-synchronization"]
    reference_velocity: float = Field(3.0, description="v_0 in m/s")
    gap_bound: PerAgent = Field(3.0, description="delta_i in m/s, positive")

    def build(self, count: int) -> Game:
        """The game for ``count`` agents."""
        bound = _per_agent("game.gap_bound", self.gap_bound, count, positive=True)
        return velocity_game(count, self.reference_velocity, bound)

    def default_start(self, count: int) -> NDArray[np.float64]:
        """The named start for five agents; else everyone half a bound below the reference."""
        if count == len(DEFAULT_VELOCITIES):
            return np.array(DEFAULT_VELOCITIES)
        first = self.gap_bound if isinstance(self.gap_bound, float) else self.gap_bound[0]
        return np.full(count, self.reference_velocity - 0.5 * first)


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


class _AgentsTable(_Table):
    count: int = Field(gt=0, description="N")
    input_limit: PerAgent | None = Field(
        None, description="greatest |u_i| that the actuators deliver; no limit if left out"
    )

    def limits(self) -> NDArray[np.float64]:
        """(N,) limits, infinite where none is given."""
        if self.input_limit is None:
            return np.full(self.count, np.inf)
        return _per_agent("agents.input_limit", self.input_limit, self.count, positive=True)

    def columns(self, *names: str, positive: Iterable[str]) -> NDArray[np.float64]:
        """(N, len(names)) parameters."""
        columns = [
            _per_agent(f"agents.{n}", getattr(self, n), self.count, positive=n in positive)
            for n in names
        ]
        return np.column_stack(columns)


class RobotAgents(_AgentsTable):
    """[eq:MobileRobot]"""

    type: Literal["flexible-robot"]
    main_mass: PerAgent = Field(1.0, description="M in kg, positive")
    appendage_mass: PerAgent = Field(1.0, description="m in kg, positive")
    stiffness: PerAgent = Field(1.0, description="linear part of psi in N/m")
    atan_coefficient: PerAgent = Field(1.0, description="atan part of psi in N")
    damping: PerAgent = Field(1.0, description="gamma in N s/m")

    def build(self) -> Agents:
        """The agents."""
        names = flexible_robot.PARAMETERS
        table = self.columns(*names, positive=("main_mass", "appendage_mass"))
        if np.any(table[:, 4] < 0):
            raise InvalidInput("agents.damping", self.damping, "no entry may be negative")
        return Agents(flexible_robot, table, self.limits())


class IntegratorAgents(_AgentsTable):
    """[eq:int]"""

    type: Literal["integrator"]

    def build(self) -> Agents:
        """The agents."""
        return Agents(integrator, np.zeros((self.count, 0)), self.limits())


class PiCascadeAgents(_AgentsTable):
    """[eq:cascadePI]"""

    type: Literal["pi-cascade"]
    decay_rate: PerAgent = Field(1.0, description="v in 1/s")
    integral_gain: PerAgent = Field(0.5, description="k in 1/s, 0 < k < v")

    def build(self) -> Agents:
        """The agents."""
        table = self.columns(*pi_cascade.PARAMETERS, positive=pi_cascade.PARAMETERS)
        if np.any(table[:, 1] >= table[:, 0]):
            raise InvalidInput(
                "agents.integral_gain",
                self.integral_gain,
                "it must be below decay_rate (0 < k < v)",
            )
        return Agents(pi_cascade, table, self.limits())


class BarrierTable(_Table):
    """[eq:logbarrier]"""

    rho: float = Field(0.1, gt=0)


class FullController(_Table):
    """[eq:nonlinFIfeedback]"""

    information: Literal["full"]
    mode: Literal["continuous", "sampled"] = "continuous"

    def build(self, count: int) -> Law:
        """The law."""
        return FullInformation()


class DistributedController(_Table):
    """[eq:CenterFeedback]"""

    information: Literal["distributed"]
    mode: Literal["continuous", "sampled"] = "continuous"
    epsilon: float = Field(gt=0, description="time constant of estimates and z in s")
    gain: float = Field(1.0, gt=0, description="k")
    graph: Literal["line", "ring", "complete", "printed", "caption"] | list[tuple[int, int]] = (
        Field("ring", description="a name, or edges as pairs of agents numbered from 1")
    )

    def build(self, count: int) -> Law:
        """The law."""
        if isinstance(self.graph, str):
            graph = graphs.NAMED[self.graph](count)
        else:
            graph = graphs.Graph(count, tuple((i - 1, j - 1) for i, j in self.graph))
        return FullyDistributed(graph, self.epsilon, self.gain)


class PlantTable(_Table):
    """What moves the agents."""

    engine: Literal["mujoco", "ode"] = "ode"
    integrator: Literal["rk4", "euler", "rosenbrock"] | None = Field(
        None, description="in place of the simulation's"
    )


class InitialTable(_Table):
    """The start; what is left out rests, relaxed, at the default actions."""

    action: PerAgent | None = Field(None, description="y(0)")
    extension: PerAgent | None = Field(None, description="robots: x1(0) in m")
    appendage_velocity: PerAgent | None = Field(None, description="robots: x3(0) in m/s")
    position: PerAgent | None = Field(None, description="robots: d(0) in m")
    integral: PerAgent | None = Field(None, description="PI cascade: s(0)")

    def build(self, agents: Agents, default: NDArray[np.float64]) -> NDArray[np.float64]:
        """(m, states): at rest at y(0), but for what is given."""
        count = agents.channels
        y = default if self.action is None else _per_agent("initial.action", self.action, count)
        state = agents.equilibrium(y)
        names = [name for name, _ in agents.kind.STATES]
        if agents.kind is flexible_robot:
            state[:, names.index("position")] = -1.5 * np.arange(count)
        for key in ("extension", "appendage_velocity", "position", "integral"):
            given = getattr(self, key)
            if given is None:
                continue
            if key not in names:
                raise InvalidInput(f"initial.{key}", given, f"{agents.kind.NAME}s have no {key}")
            state[:, names.index(key)] = _per_agent(f"initial.{key}", given, count)
        return state


class SystemTable(_Table):
    """One game with its agents."""

    game: Annotated[VelocityGame | OsnrGame, Field(discriminator="type")]
    agents: Annotated[RobotAgents | IntegratorAgents | PiCascadeAgents, Field(discriminator="type")]
    barrier: BarrierTable = BarrierTable()
    controller: Annotated[
        FullController | DistributedController, Field(discriminator="information")
    ] = FullController(information="full")
    plant: PlantTable = PlantTable()
    initial: InitialTable = InitialTable()

    def build(self, name: str, integrator_name: str) -> System:
        """The system, with the simulation's integrator unless it names its own."""
        count = self.agents.count
        try:
            game = self.game.build(count)
            agents = self.agents.build()
            law = self.controller.build(count)
            state = self.initial.build(agents, self.game.default_start(count))
        except InvalidInput as error:
            raise InvalidInput(f"systems.{name}.{error.key}", error.value, error.expected) from None
        if self.plant.engine == "mujoco" and agents.kind is not flexible_robot:
            raise InvalidInput(
                f"systems.{name}.plant.engine",
                "mujoco",
                f"MuJoCo has models of flexible robots only; run {agents.kind.NAME}s on 'ode'",
            )
        return System(
            name=name,
            game=game,
            agents=agents,
            law=law,
            rho=self.barrier.rho,
            state=state,
            mode=self.controller.mode,
            engine=self.plant.engine,
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

    def simulation_object(self) -> Simulation:
        """The scenario, ready to run.

        Raises:
            InvalidInput, InfeasibleStart: see :class:`gne_mj.system.System`.
        """
        clock = self.clock()
        systems = [
            table.build(name, self.simulation.integrator) for name, table in self.systems.items()
        ]
        return Simulation(
            systems,
            clock,
            tolerance=self.simulation.tolerance,
            seed=self.simulation.seed,
            source=self.model_dump_json(exclude_none=True),
        )


def shipped() -> dict[str, str]:
    """The shipped scenarios: name to TOML text."""
    folder = files("gne_mj.scenarios")
    return {
        entry.name.removesuffix(".toml"): entry.read_text(encoding="utf-8")
        for entry in sorted(folder.iterdir(), key=lambda entry: entry.name)
        if entry.name.endswith(".toml")
    }


def load_scenario(
    source: str | Path | Mapping[str, Any], changes: Mapping[str, Any] | None = None
) -> Scenario:
    """A scenario from a shipped name, a TOML file or a mapping, with some values changed.

    Args:
        source: name of a shipped scenario, path of a file ending in .toml, or the tables.
        changes: dotted keys to new values, e.g. {"systems.robots.barrier.rho": 0.2}; "systems."
            may be left out, and the system's name too if there is only one.

    Raises:
        InvalidInput: names the key, the value and what would be right.
    """
    tables = json.loads(json.dumps(source)) if isinstance(source, Mapping) else _read(source)
    for key, value in (changes or {}).items():
        _change(tables, key, value)
    try:
        return Scenario.model_validate(tables)
    except ValidationError as error:
        raise _first(error) from None


def run(
    source: str | Path | Mapping[str, Any], changes: Mapping[str, Any] | None = None
) -> Trajectory:
    """Load a scenario, run it to its end and return the trajectory; see :func:`load_scenario`."""
    return load_scenario(source, changes).simulation_object().run()


def parse_value(text: str) -> Any:
    """What ``--set key=TEXT`` means: a TOML value, else the text itself."""
    try:
        return tomllib.loads(f"value = {text}")["value"]
    except tomllib.TOMLDecodeError:
        return text


def _read(source: str | Path) -> dict[str, Any]:
    names = shipped()
    if str(source) in names:
        return tomllib.loads(names[str(source)])
    path = Path(source)
    if path.suffix != ".toml":
        raise InvalidInput(
            "scenario",
            str(source),
            f"it must name a file ending in .toml; {nearest(str(source), names)}",
        )
    try:
        return tomllib.loads(path.read_text(encoding="utf-8"))
    except (OSError, UnicodeDecodeError) as error:
        reason = getattr(error, "strerror", None) or "it is not UTF-8 text"
        raise InvalidInput("scenario", str(source), f"it cannot be read: {reason}") from None
    except tomllib.TOMLDecodeError as error:
        raise InvalidInput("scenario", str(source), f"it is not valid TOML: {error}") from None


def _change(tables: dict[str, Any], key: str, value: Any) -> None:
    systems = tables.get("systems", {})
    parts = key.split(".")
    if parts[0] in systems and parts[0] not in Scenario.model_fields:
        parts.insert(0, "systems")
    elif parts[0] in SystemTable.model_fields:
        if len(systems) != 1:
            raise InvalidInput(
                key, value, f"it must begin with one of the systems: {', '.join(systems)}"
            )
        parts = ["systems", next(iter(systems)), *parts]
    elif parts[0] == "systems" and len(parts) > 1 and parts[1] not in systems:
        raise InvalidInput(key, value, f"there is no such system; {nearest(parts[1], systems)}")
    elif parts[0] not in Scenario.model_fields:
        known = [*Scenario.model_fields, *SystemTable.model_fields, *systems]
        raise InvalidInput(key, value, f"there is no such key; {nearest(parts[0], known)}")
    table = tables
    for part in parts[:-1]:
        table = table.setdefault(part, {})
        if not isinstance(table, dict):
            raise InvalidInput(key, value, f"'{part}' is a value, not a table")
    table[parts[-1]] = value


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


def nearest(name: str, known: Iterable[str]) -> str:
    """A hint for a name that is not known: the nearest one, or all."""
    known = list(known)
    close = difflib.get_close_matches(name, known, n=1, cutoff=0.5)
    if close:
        return f"did you mean '{close[0]}'?"
    return f"choose from {', '.join(known)}"


def _first(error: ValidationError) -> InvalidInput:
    """The first of pydantic's complaints as one sentence."""
    details = error.errors()
    detail = details[0]
    if detail["loc"][-1] == "float" and isinstance(detail["input"], list):
        # of "one number or a list of them" the user meant the list
        detail = details[1]
    tags = {"velocity-synchronization", "osnr", "flexible-robot", "integrator", "pi-cascade",
            "full", "distributed", "float", "list", "literal"}  # fmt: skip
    where = [str(part) for part in detail["loc"] if str(part).split("[")[0] not in tags]
    value = detail["input"]
    context = detail.get("ctx", {})
    kind = detail["type"]
    if kind == "unknown_key":
        unknown = context["name"].strip("'")
        return InvalidInput(
            ".".join([*where, unknown]), value[unknown], f"there is no such key; {context['hint']}"
        )
    if kind == "missing":
        return InvalidInput(".".join(where), None, "this key must be given")
    if kind == "union_tag_not_found":
        field = context["discriminator"].strip("'")
        return InvalidInput(".".join([*where, field]), None, "this key must be given")
    if kind == "union_tag_invalid":
        field = context["discriminator"].strip("'")
        names = [name.strip(" '") for name in context["expected_tags"].split(",")]
        return InvalidInput(
            ".".join([*where, field]), context["tag"], nearest(str(context["tag"]), names)
        )
    if kind == "literal_error":
        names = re.findall(r"'([^']*)'", context["expected"])
        return InvalidInput(".".join(where), value, nearest(str(value), names))
    message = detail["msg"][0].lower() + detail["msg"][1:]
    return InvalidInput(".".join(where), value, message.replace("input should", "it should"))
