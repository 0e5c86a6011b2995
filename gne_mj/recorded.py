"""A system as its run recorded it: enough to show the run again, where its functions are not.

A page shows who plays, who hears or measures whom, quantities and their bounds, and estimates. With
its own results a run keeps what of these the results do not say (the attribute ``structure``), so
that neither a game's file nor the program that made it is needed to look at what it did.
"""

import json
import sys
from collections.abc import Sequence
from types import ModuleType
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from gne_mj.controllers import Law
from gne_mj.controllers.keepers import Keepers
from gne_mj.controllers.kept import Kept
from gne_mj.controllers.law import MemoryPart
from gne_mj.controllers.theorem import LawTheorem
from gne_mj.errors import InvalidInput
from gne_mj.faults import Fault
from gne_mj.game_model import Game
from gne_mj.graph import Graph, complete
from gne_mj.native import kernel
from gne_mj.plants.agents import Agents
from gne_mj.quantity import Quantity
from gne_mj.separation import Separation
from gne_mj.system.data import WATCHED, SystemData

if TYPE_CHECKING:
    import xarray

_ALL = "all"  # in place of a list of all agents, or of all edges


def structure_of(system: SystemData) -> str:
    """What a system's results do not say of it, as JSON; agents are numbered from 1."""
    game, graph, apart = system.game, system.law.graph, system.separation
    graph = None if graph is None else graph.whole
    edges = None if graph is None else [[i + 1, j + 1] for i, j in graph.edges]
    everyone = edges is not None and 2 * len(edges) == game.agents * (game.agents - 1)
    return json.dumps(
        {
            "sizes": list(game.sizes),
            "axes": list(game.axes),
            "in_cost": _numbered(game.in_cost, game.agents),
            "in_constraint": _numbered(game.in_constraint, game.agents),
            "owners": None if game.owners is None else _numbered(game.owners, game.agents),
            "quantities": [quantity.name for quantity in game.quantities],
            "graph": _ALL if everyone else edges,
            "graph_changes": graph is not None and graph.changes,
            "room": [
                each if np.isfinite(each) else None for each in system.constraint_room.tolist()
            ],
            "separation": None if apart is None else [apart.distance, apart.reach, apart.turn],
            "estimates": [part.name for part in system.law.memory_parts if part.rows],
            "kept_estimates": [part.name for part in system.law.memory_parts if part.kept],
        },
        default=int,
    )


def sizes_of(data: "xarray.Dataset") -> tuple[int, ...]:
    """m_i of each agent of a recorded system.

    Raises:
        InvalidInput: an older version has recorded it.
    """
    return tuple(_structure(data)["sizes"])


def recorded_system(
    name: str, data: "xarray.Dataset", agents: Agents, faults: tuple[Fault, ...], seed: int
) -> SystemData:
    """The system of a dataset; its game and law have no functions that could be called.

    Args:
        name: of the system.
        data: what it recorded.
        agents: who played.
        faults, seed: what went wrong.

    Raises:
        InvalidInput: an older version has recorded it.
    """
    known, attributes = _structure(data), data.attrs
    count, action = len(known["sizes"]), data["action"].attrs
    owners = known["owners"]
    game = Game(
        name=attributes["game"],
        kernels=sys.modules[__name__],
        parameters=np.zeros(0),
        sizes=tuple(known["sizes"]),
        in_cost=_from_numbered(known["in_cost"], count),
        in_constraint=_from_numbered(known["in_constraint"], count),
        owners=None if owners is None else _from_numbered(owners, count),
        constraint_names=tuple(map(str, data["constraint_name"].to_numpy())),
        action_name=action["long_name"],
        action_unit=action["units"],
        agent_name=attributes["agent_name"],
        axes=tuple(known["axes"]),
        quantities=tuple(_quantity(data, each) for each in known["quantities"]),
        tested=True,
    )
    found = SystemData(
        name=name,
        game=game,
        agents=agents,
        law=_RecordedLaw(data, known),
        rho=attributes["rho"],
        state=data["state"].to_numpy()[0],
        mode=attributes["mode"],
        engine=attributes["engine"],
        integrator=attributes["integrator"],
        decentralised=bool(attributes["decentralised"]),
        between=attributes.get("between", WATCHED),
        faults=faults,
        seed=seed,
        separation=None if known["separation"] is None else Separation(*known["separation"]),
        observer=float("load" in data),  # there was one; its gain nobody asks of results
    )
    room = known.get("room", [None] * game.constraints_count)  # which older results do not have
    vars(found)["constraint_room"] = np.array(room, dtype=np.float64)  # None is not a number
    return found


class _ChangedGraph(Graph):
    """Of a run in which the graph became another one; the results say which it was when."""

    changes: ClassVar[bool] = True


class _RecordedLaw(Law):
    """What is known of a law."""

    def __init__(self, data: "xarray.Dataset", known: dict[str, Any]) -> None:
        self._storage = "lyapunov" in data
        edges, agents = known["graph"], len(known["sizes"])
        if edges is not None:
            pairs = tuple((i - 1, j - 1) for i, j in edges) if edges != _ALL else None
            # of results of versions before graphs could change nothing says so
            kind = _ChangedGraph if known.get("graph_changes") else Graph
            self.graph = kind(agents, complete(agents).edges if pairs is None else pairs)
        # results of older versions do not say which estimates were kept
        kept = known.get("kept_estimates", [])
        if kept:
            assert self.graph is not None
            self.kept = _kept(data, self.graph, known["sizes"])
        parts = [
            MemoryPart(
                name, data[name].attrs["long_name"], rows=name not in kept, kept=name in kept
            )
            for name in (*known["estimates"], *kept)
        ]
        vars(self).update(information=data.attrs["information"], memory_parts=tuple(parts))

    @property
    def theorem(self) -> LawTheorem | None:
        """Some, where V was recorded; which one nobody asks of results."""
        return LawTheorem("") if self._storage else None

    @property
    def kernels(self) -> ModuleType:
        """None that could be called."""
        return sys.modules[__name__]


def _kept(data: "xarray.Dataset", graph: Graph, sizes: Sequence[int]) -> Kept:
    """Who kept which estimates."""
    by, of = data["by_agent"].to_numpy() - 1, data["of_agent"].to_numpy() - 1
    keepers = tuple(np.array([j, *np.unique(by[of == j])]) for j in range(graph.agents))
    smallest = np.zeros(graph.agents, dtype=bool)  # which nobody asks of results
    return Kept(graph, np.concatenate([[0], np.cumsum(sizes)]), Keepers(keepers, smallest))


def _structure(data: "xarray.Dataset") -> dict[str, Any]:
    if "structure" not in data.attrs:
        raise InvalidInput(
            "trajectory", "without 'structure'", "an older version has recorded it; run it again"
        )
    found: dict[str, Any] = json.loads(data.attrs["structure"])
    return found


def _quantity(data: "xarray.Dataset", name: str) -> Quantity:
    """A quantity with its bounds, of values that are recorded and not found anew.

    Of bounds that move it has those of the first sample.
    """
    variable = data[name]
    given = {key: data[f"{name}_{key}"] for key in ("bound", "lower_bound")
             if f"{name}_{key}" in data}  # fmt: skip
    moves = any("time" in bound.dims for bound in given.values())
    bounds = {key: bound.to_numpy()[0] if moves else bound.to_numpy()
              for key, bound in given.items()}  # fmt: skip
    about = {"long_name": name, "units": "", "symbol": "", **variable.attrs}
    return Quantity(
        name=name,
        long_name=about["long_name"],
        unit=about["units"],
        values=lambda y: np.full((len(y), *variable.shape[1:]), np.nan),
        each=str(variable.dims[1]) if variable.ndim > 1 else "",
        symbol=about["symbol"],
        moves=moves,
        **bounds,
        **{key: json.loads(about[key]) for key in ("between", "outline") if key in about},
    )


def _numbered(rows: Sequence[Sequence[int]], agents: int) -> list[Any]:
    """Lists of agents from 1, those of all of them by a word."""
    return [_ALL if len(row) == agents else [i + 1 for i in row] for row in rows]


def _from_numbered(rows: list[Any], agents: int) -> list[Sequence[int]]:
    return [range(agents) if row == _ALL else [i - 1 for i in row] for row in rows]


# The kernels that a game's module must have; nothing asks for their values.


@kernel
def cost(q, i, y):
    """Unknown."""
    return np.nan


@kernel
def cost_gradient(q, i, a, y):
    """Unknown."""
    return np.nan


@kernel
def add_cost_hessian(q, i, a, y, scale, out):
    """Unknown."""


@kernel
def constraint(q, k, y):
    """Unknown."""
    return np.nan


@kernel
def constraint_gradient(q, k, a, y):
    """Unknown."""
    return np.nan


@kernel
def constraint_hessian(q, k, a, b, y):
    """Unknown."""
    return np.nan
