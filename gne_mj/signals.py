"""What a run shows, each signal declared once.

Trajectories, rows and summaries of batches, the live page, replays and figures all walk
``SIGNALS``: to add a signal is to add its :class:`Variable` there (docs/developers.md).
"""

import json
import math
from collections.abc import Callable, Iterable, Iterator, Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gne_mj import moving_values
from gne_mj.changing_graph import ChangingGraph
from gne_mj.controllers.law import MemoryPart
from gne_mj.errors import InvalidInput
from gne_mj.faults import triggered
from gne_mj.game_model import Game
from gne_mj.loops.base import Samples
from gne_mj.motion import motion_of
from gne_mj.plants.agent_type import followed_position, has_ode
from gne_mj.quantity import Quantity
from gne_mj.separation import nearest_distances
from gne_mj.system.data import SystemData
from gne_mj.variables import AXIS, Array, Labelled, Rows, Variable, axis_of, labelled


def declared(system: SystemData) -> list[Variable]:
    """The variables that a system has, in the order of its dataset."""
    found: list[Variable] = []
    for signal in SIGNALS:
        found += [signal] if isinstance(signal, Variable) else signal(system)
    return [variable for variable in found if variable.there(system)]


def coordinates_of(system: SystemData, time: NDArray[np.float64]) -> dict[str, Any]:
    """The coordinates that go with a system's variables, at times (samples,) in s."""
    game = system.game
    coordinates: dict[str, Any] = {
        "time": ("time", time, {"units": "s"}),
        "agent": ("agent", np.arange(1, game.agents + 1)),
        "constraint_name": ("constraint", np.array(game.constraint_names)),
        "component": ("component", np.array([name for name, _ in system.agents.kind.STATES])),
    }
    if _network_changes(system):
        assert system.law.graph is not None
        pairs = [f"{i + 1}-{j + 1}" for i, j in system.law.graph.edges]
        coordinates["edge"] = ("edge", np.array(pairs))
    if axis_of(system) == "action":
        coordinates["owner"] = ("action", game.agent_of_action + 1)
        coordinates["axis"] = ("action", np.array(game.axis_of_action))
    kept = system.law.kept
    if kept is not None:
        of = kept.action[kept.estimated]
        coordinates["by_agent"] = ("kept", kept.holder[kept.estimated] + 1)
        coordinates["of_agent"] = ("kept", game.agent_of_action[of] + 1)
        if axis_of(system) == "action":
            coordinates["of_axis"] = ("kept", np.array(game.axis_of_action)[of])
    return coordinates


def check_names(
    system: SystemData, variables: Iterable[Variable], others: Iterable[str] = ()
) -> None:
    """Refuse a game or agent type of which a variable has the name of another one.

    Args:
        system: whose.
        variables: which are to be in one dataset.
        others: names that are taken besides those of coordinates.

    Raises:
        InvalidInput: names the first such variable.
    """
    taken = {*coordinates_of(system, np.zeros(0)), *others}
    for variable in variables:
        for name in (variable.name, *variable.bounds(system)):
            if name in taken:
                raise InvalidInput(
                    "system", name, "results have something else of that name;"
                    " give the game's quantity, or the agents' state, another one",
                )  # fmt: skip
            taken.add(name)


def variables_of(system: SystemData, time: NDArray[np.float64], samples: Samples) -> Labelled:
    """What is kept of a run's samples: (dimensions, values, attributes) by name.

    Args:
        system: what was run.
        time: (samples,) in s.
        samples: at these times.
    """
    return labelled(declared(system), Rows(system, time, samples))


def _action_unit(system: SystemData) -> str:
    return system.game.action_unit


def input_unit(system: SystemData) -> str:
    """The unit of inputs; the action's per second where the agent type names none."""
    return system.agents.kind.INPUT_UNIT or f"{system.game.action_unit or 1}/s"


def _state_units(system: SystemData) -> str:
    return ", ".join(unit or system.game.action_unit for _, unit in system.agents.kind.STATES)


def equilibrium_of(system: SystemData) -> NDArray[np.float64]:
    """(m,) y*; not a number where it is not known."""
    known = system.known_equilibrium
    return np.full(system.game.actions, np.nan) if known is None else known.action


def _states(system: SystemData) -> Iterator[Variable]:
    """The agents' states but the output, each by its name, and what follows from them."""
    kind = system.agents.kind
    states = (_state(index, *state) for index, state in enumerate(kind.STATES))
    yield from (state for index, state in enumerate(states) if index != kind.OUTPUT)
    for name, unit, source in getattr(kind, "DERIVED", ()):
        yield _derived(name, unit, source)


def _derived(name: str, unit: str, source: Callable[[Array, Array, Array], Array]) -> Variable:
    return Variable(
        name, ("time", AXIS),
        lambda rows: source(rows.system.agents.parameters, rows.samples.state, rows.time),
        unit=unit, page="behind",
    )  # fmt: skip


def _state(index: int, name: str, unit: str) -> Variable:
    return Variable(
        name,
        ("time", AXIS),
        lambda rows: rows.samples.state[:, :, index],
        unit=unit or _action_unit,
    )


def _quantities(system: SystemData) -> Iterator[Variable]:
    """What the game derives from its actions, with the bounds that it states."""
    game = system.game
    for index, quantity in enumerate(game.quantities):
        bounds = quantity.bounds(game.entries(quantity))
        moves = moving_values.bounds_move(game, index)
        yield _quantity(index, quantity, {} if moves else bounds)
        for name in bounds if moves else ():
            yield _moving_bound(name, index, quantity)


def _quantity(index: int, quantity: Quantity, bounds: Mapping[str, Array]) -> Variable:
    return Variable(
        quantity.name,
        _dimensions(quantity),
        lambda rows: moving_values.quantity(rows.system, index, rows.time, rows.y),
        unit=quantity.unit,
        long_name=quantity.long_name,
        symbol=quantity.symbol,
        more=_drawn(quantity),
        bounds=lambda system: bounds,
        figure=True,
        page="line",
    )


def _moving_bound(name: str, index: int, quantity: Quantity) -> Variable:
    return Variable(
        name,
        _dimensions(quantity),
        lambda rows: moving_values.bounds(rows.system, index, rows.time)[name],
        unit=quantity.unit,
        page="bound",
    )


def _dimensions(quantity: Quantity) -> tuple[str, ...]:
    return ("time", *((quantity.each,) if quantity.each else ()))


def _equilibrium(system: SystemData) -> Iterator[Variable]:
    """y*, over time where the game moves."""
    yield Variable(
        "equilibrium", (AXIS,), lambda rows: equilibrium_of(rows.system),
        there=lambda system: motion_of(system.game) is None and system.membership is None,
        unit=_action_unit, long_name="y*", batch=False,
        runs=(
            Variable(
                "equilibrium", ("run", AXIS),
                lambda runs: np.tile(runs.equilibrium, (len(runs.monitors), 1)),
                unit=_action_unit, long_name="y*",
            ),
        ),
    )  # fmt: skip
    yield Variable(
        "equilibrium", ("time", AXIS), lambda rows: rows.system.equilibria_among(rows.time, rows.y),
        there=lambda system: system.membership is not None,
        unit=_action_unit, long_name="y* of those present", batch=False,
    )  # fmt: skip
    yield Variable(
        "equilibrium", ("time", AXIS), lambda rows: rows.system.equilibria(rows.time),
        there=lambda system: motion_of(system.game) is not None,
        unit=_action_unit, long_name="y*(t)",
        runs=(
            Variable(
                "final_equilibrium", ("run", AXIS),
                lambda runs: np.tile(runs.equilibrium, (len(runs.monitors), 1)),
                unit=_action_unit, long_name="y* at the end",
            ),
        ),
    )  # fmt: skip


def _drawn(quantity: Quantity) -> dict[str, str]:
    """Between which agents it is, and of which outline, for figures."""
    found = {"between": quantity.pairs, "outline": quantity.corners}
    return {key: json.dumps(value) for key, value in found.items() if value}


def estimates_of(
    game: Game, y: NDArray[np.float64], memory: NDArray[np.float64]
) -> NDArray[np.float64]:
    """(samples, N, m) what agents take the actions to be, of actions (samples, m) and memories."""
    m, owner = game.actions, game.agent_of_action
    estimates = memory[:, : game.agents * m].reshape(len(y), game.agents, m).copy()
    estimates[:, owner, np.arange(m)] = y  # an agent's own block is its action, not an estimate
    return estimates


def _memory(system: SystemData) -> Iterator[Variable]:
    """What the law says that its memory holds; all of it where it says nothing."""
    game, at = system.game, 0
    for part in system.law.memory_parts:
        size = (
            math.prod(part.shape) if part.dims else game.actions * (game.agents if part.rows else 1)
        )
        if part.dims:
            yield _other(part, slice(at, at + size))
        elif part.kept:
            assert system.law.kept is not None
            yield _kept(part, np.flatnonzero(system.law.kept.estimated))
            size += system.law.kept.size  # room for a profile is behind them
        else:
            yield _estimates(part, at) if part.rows else _row(part, slice(at, at + size))
        at += size
    if not at and len(system.memory):
        yield Variable(
            "memory", ("time", "memory_entry"), lambda rows: rows.samples.memory,
            long_name="the law's memory",
        )  # fmt: skip


def _estimates(part: MemoryPart, at: int) -> Variable:
    return Variable(
        part.name, ("time", "estimating_agent", AXIS),
        lambda rows: estimates_of(rows.system.game, rows.y, rows.samples.memory[:, at:]),
        unit=_action_unit, long_name=part.long_name, page="estimates",
    )  # fmt: skip


def _kept(part: MemoryPart, entries: NDArray[np.int64]) -> Variable:
    return Variable(
        part.name, ("time", "kept"), lambda rows: rows.samples.memory[:, entries],
        unit=_action_unit, long_name=part.long_name, page="estimates",
    )  # fmt: skip


def _other(part: MemoryPart, entries: slice) -> Variable:
    return Variable(
        part.name, ("time", *part.dims),
        lambda rows: rows.samples.memory[:, entries].reshape(-1, *part.shape),
        long_name=part.long_name,
    )  # fmt: skip


def _row(part: MemoryPart, entries: slice) -> Variable:
    return Variable(
        part.name, ("time", AXIS), lambda rows: rows.samples.memory[:, entries],
        unit=_action_unit, long_name=part.long_name,
    )  # fmt: skip


def _penalty(rows: Rows) -> Array:
    assert rows.system.schedule is not None
    return rows.system.schedule.at(rows.time)


def _is_faulty(system: SystemData) -> bool:
    return bool(system.faults)


# In the order of a dataset; a function yields what game, agent type or law declare of themselves
def _nearest_distance(rows: Rows) -> Array:
    positions = rows.samples.state[:, :, followed_position(rows.system.agents.kind)]
    return nearest_distances(positions.reshape(len(positions), rows.system.game.agents, -1))


def _network_changes(system: SystemData) -> bool:
    return system.law.graph is not None and system.law.graph.changes


def _messages(rows: Rows) -> Array:
    memory, game = rows.samples.memory, rows.system.game
    end = memory.shape[1] - (game.actions if rows.system.observer > 0.0 else 0)
    return memory[:, end - game.agents : end]


def _lyapunov(rows: Rows) -> Array:
    """V about y*, of the agents and of the law's memory; not numbers where y* is not known."""
    system, game = rows.system, rows.system.game
    known = system.known_equilibrium
    if known is None:
        return np.full(len(rows.time), np.nan)
    rest, owner = system.agents.equilibrium(known.action), game.agent_of_action
    stored = np.sum(system.agents.storage(rows.samples.state, rest), axis=1)
    memory = rows.samples.memory[:, : len(system.memory)].copy()
    if system.law.has_estimates and system.law.kept is None:
        own = memory[:, : game.agents * game.actions].reshape(len(memory), game.agents, -1)
        own[:, owner, np.arange(game.actions)] = rows.y
    return stored + system.law.memory_storage(memory, owner, known.action)


def _there(rows: Rows) -> Array:
    first = np.searchsorted(rows.system.game.agent_of_action, np.arange(rows.system.game.agents))
    return np.isfinite(rows.y[:, first])


def _linked(rows: Rows) -> Array:
    system = rows.system
    assert isinstance(system.law.graph, ChangingGraph)
    places = system.places(rows.samples.state)
    return system.law.graph.edges_at(rows.time, places, system.seed)


def _least_distances(system: SystemData) -> dict[str, Array]:
    assert system.separation is not None
    return {"nearest_distance_lower_bound": np.full(system.game.agents, system.separation.distance)}


SIGNALS: tuple[Variable | Callable[[SystemData], Iterator[Variable]], ...] = (
    Variable(
        "action", ("time", AXIS), lambda rows: rows.y,
        unit=_action_unit, long_name=lambda system: system.game.action_name,
        figure=True, page="line",
        runs=(
            Variable(
                "initial_action", ("run", AXIS), lambda runs: runs.y[:, 0].copy(),
                unit=_action_unit,
            ),
            Variable(
                "final_action", ("run", AXIS), lambda runs: runs.y[:, -1].copy(),
                unit=_action_unit,
            ),
        ),
    ),
    Variable(
        "input", ("time", AXIS), lambda rows: rows.samples.input,
        unit=input_unit, long_name="delivered input u", instant=False,
    ),
    Variable(
        "state", ("time", AXIS, "component"), lambda rows: rows.samples.state,
        unit=_state_units, page="behind", batch=False,  # whose rows have its components
    ),
    _equilibrium,
    _states,
    _quantities,
    Variable(
        "nearest_distance", ("time", "agent"), _nearest_distance,
        there=lambda system: system.separation is not None, unit="m",
        long_name="nearest distance", symbol="d_i",
        bounds=_least_distances, figure=True, page="line",
    ),
    Variable(
        "constraint", ("time", "constraint"),
        lambda rows: moving_values.constraints(rows.system, rows.time, rows.y),
        long_name="constraint, negative inside the set", symbol="g_l",
        bounds=lambda system: {"constraint_bound": np.zeros(system.game.constraints_count)},
        figure=True, page="line",
    ),
    _memory,
    Variable(
        "lyapunov", ("time",), _lyapunov, there=lambda system: system.measures_storage,
        long_name="Lyapunov function V", symbol="V", page="line", batch=False,
    ),
    Variable(
        "linked", ("time", "edge"), _linked, there=_network_changes,
        long_name="whether the two agents hear each other", page="behind", batch=False,
    ),
    Variable(
        "sent_message", ("time", "agent"), _messages,
        there=lambda system: triggered(system.faults), unit="",
        long_name="messages sent so far", figure=True, page="line",
    ),
    Variable(
        "there", ("time", "agent"), _there, there=lambda system: system.membership is not None,
        long_name="whether the agent is there", page="behind", batch=False,
    ),
    Variable(
        "load", ("time", AXIS),
        lambda rows: rows.samples.memory[:, -rows.system.game.actions :],
        there=lambda system: system.observer > 0.0, unit=input_unit,
        long_name="load as each agent estimates it", page="line",
    ),
    Variable(
        "measurement", ("time", AXIS), lambda rows: rows.samples.measurement, there=_is_faulty,
        unit=_action_unit, long_name="outputs as the law read them for the input of that time",
        instant=False,
    ),
    Variable(
        "acting_input", ("time", AXIS), lambda rows: rows.samples.applied, there=_is_faulty,
        unit=input_unit, long_name="input with the faults' pushes, as it moved the plant",
        instant=False,
    ),
    Variable(
        "configuration", ("time", "coordinate"), lambda rows: rows.samples.configuration,
        there=lambda system: not has_ode(system.agents.kind),
        long_name="all joints' positions, MuJoCo's qpos", page="behind", batch=False,
    ),
    Variable(
        "penalty", ("time",), _penalty, there=lambda system: system.schedule is not None,
        unit="", long_name="penalty rho",
    ),
    Variable(
        "tightening", ("constraint",), lambda rows: rows.system.game.margins,
        there=lambda system: bool(np.any(system.game.margins)),
        long_name="t: the barrier guards g + t < 0",
    ),
)  # fmt: skip
