"""What a page shows of one system: words about it once, arrays of numbers from what is recorded."""

import json
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gne_mj.faults import for_native, triggered
from gne_mj.loops.faults import count_messages
from gne_mj.moving_values import bounds_move
from gne_mj.plants.agent_type import followed_position
from gne_mj.signals import declared
from gne_mj.system import Clock, mode_of
from gne_mj.system.data import SystemData
from gne_mj.variables import Variable
from gne_mj.viewer.fleet import fleet_of
from gne_mj.viewer.joints import Joints
from gne_mj.viewer.shares import Values, margins, shares

Arrays = dict[str, NDArray[Any]]


class ShownSystem:
    """One system as a page shows it: a fleet of robots in their MJCF, or bars.

    Args:
        system: what is shown.
        clock: how it steps.

    Attributes:
        fleet: its robots; None for agents without bodies.
        joints: of these.
    """

    def __init__(self, system: SystemData, clock: Clock) -> None:
        self.system, self.clock = system, clock
        self.fleet = fleet_of(system, clock)
        self.joints = None if self.fleet is None else Joints(self.fleet)

    def meta(self) -> dict[str, Any]:
        """What JSON tells the page of the system; constant while it runs."""
        system, game = self.system, self.system.game
        about = {
            "name": system.name,
            "game": game.name,
            "agent_name": game.agent_name,
            "agents": game.agents,
            "information": system.law.information,
            "mode": system.mode,
            "engine": system.engine,
            "drawn_as": "bars" if self.fleet is None else "fleet",
            "action": {
                "name": game.action_name,
                "unit": game.action_unit,
                "owner": (game.agent_of_action + 1).tolist(),
                "axis": list(game.axis_of_action) if max(game.sizes) > 1 else [""] * game.actions,
            },
            "quantities": [
                _about(system, line, [bound.name for bound in self._shown("bound")])
                for line in self._shown("line")[1:]
            ],
            "plan": None if self.fleet is None else plan_of(system),
            "edges": self._edges,
            "edges_are": "measurements" if system.law.graph is None else "messages",
            "links": self._links,
            "message_period": self._message_period,
            "triggered": triggered(system.faults),
            "estimates": bool(self._shown("estimates")),
            "kept": self._kept,
            "anchors": [],
            "rooms": [],
            "floor": None,
            "sky": None,
            "light": None,
            "tints": [],
            "joints": [],
        }
        if self.fleet is not None and self.joints is not None:
            about |= self.fleet.places | {"joints": self.joints.meta()}
        return about

    def _shown(self, page: str) -> list[Variable]:
        """The variables that the page has there; of lines the action is the first."""
        return [variable for variable in self._variables if variable.page == page]

    @cached_property
    def _variables(self) -> list[Variable]:
        return declared(self.system)

    def arrays(self, values: Values) -> Arrays:
        """What the page draws at the samples of a trajectory's variables, by array name.

        Args:
            values: of leading dimension T, of the variables that the page has; without some that
                an older trajectory, or the present instant, does not know.
        """
        system = self.system
        found: Arrays = {}
        for name, key in self._lines:
            rows = values.get(name)
            if rows is not None:
                found[key] = rows if rows.ndim == 2 else rows.reshape(len(rows), -1)
        found[f"{system.name}/margin"] = margins(values["constraint"])
        used = shares(system.game, values, system.constraint_room)
        found[f"{system.name}/share"] = used.astype(np.float32)
        for name, key in self._rounded:
            rows = values.get(name)
            if rows is not None:
                found[key] = rows.astype(np.float32)
        return found

    @cached_property
    def _lines(self) -> list[tuple[str, str]]:
        """Variables that are lines, or bounds of such, with the names of their arrays."""
        lines = [*self._shown("line"), *self._shown("bound")]
        return [(each.name, line_key(self.system.name, each.name)) for each in lines]

    @cached_property
    def _rounded(self) -> list[tuple[str, str]]:
        """Likewise what is looked at only: which links there are, who is there, estimates."""
        names = ["linked"] if self._network_changes else []
        names += ["there", *(each.name for each in self._shown("estimates"))]
        return [(name, f"{self.system.name}/{name}") for name in names]

    def messages(self, first: int, last: int) -> Arrays:
        """How many messages came and how many were lost, (links, 2), from one step to another."""
        if not self.counts_messages:
            return {}
        out = np.zeros((len(self._links), 2))
        period = self.clock.steps(self.clock.control_period)
        count_messages(self._faults, self.clock.timestep, period, first, last, out)
        return {f"{self.system.name}/messages": out.astype(np.float32)}

    @cached_property
    def counts_messages(self) -> bool:
        """Whether it is known how many come over each link."""
        return self._message_period is not None and bool(self._links)

    @cached_property
    def _faults(self) -> Any:
        system = self.system
        return for_native(system.faults, system.game, system.law.graph, system.seed)

    @property
    def _message_period(self) -> float | None:
        """s between messages; None if they flow all the time, by triggers, or over a graph that
        changes."""
        system = self.system
        held = system.law.graph is not None and mode_of(system).held
        periodic = held and not self._network_changes and not triggered(system.faults)
        return self.clock.control_period if periodic else None

    @property
    def _kept(self) -> dict[str, list[int]] | None:
        """Who keeps an estimate, from 1, and of which action, from 0; None of all estimates."""
        kept = self.system.law.kept
        if kept is None:
            return None
        return {
            "by": (kept.holder[kept.estimated] + 1).tolist(),
            "action": kept.action[kept.estimated].tolist(),
        }

    @cached_property
    def _edges(self) -> list[list[int]]:
        """Pairs of agents, from 1, that communicate, or that measure one another without."""
        system, game = self.system, self.system.game
        if system.law.graph is not None:
            return [[i + 1, j + 1] for i, j in system.law.graph.edges]
        pairs = {
            (min(i, j), max(i, j))
            for i, measurement in enumerate(game.in_cost)
            for j in measurement
        }
        pairs |= {(i, j) for members in game.in_constraint for i in members for j in members}
        return [[i + 1, j + 1] for i, j in sorted(pairs) if i < j]

    @property
    def _network_changes(self) -> bool:
        return self.system.law.graph is not None and self.system.law.graph.changes

    @cached_property
    def _links(self) -> list[list[int]]:
        """[hearer, sender], from 1, in the order of native neighbour lists; of a graph that
        changes both of each edge."""
        graph = self.system.law.graph
        if graph is None:
            return []
        if self._network_changes:
            return [pair for i, j in self._edges for pair in ([i, j], [j, i])]
        hearer = np.repeat(np.arange(graph.agents), np.diff(graph.data.pointer))
        return (np.column_stack([hearer, graph.data.neighbour]) + 1).tolist()


def plan_of(system: SystemData) -> dict[str, Any] | None:
    """What the page draws on the ground of agents whose positions follow their outputs.

    How fast what positions are relative to moves, in m/s, the corners of a region, in m, pairs of
    agents, from 1, with a least distance in m; None of others.
    """
    kind, game = system.agents.kind, system.game
    if followed_position(kind) < 0 or not 1 <= system.agents.dimension <= 2:
        return None
    velocity = system.agents.parameters[: system.agents.dimension]
    at = kind.PARAMETERS.index("reference_velocity")
    return {
        "velocity": [*velocity[:, at].tolist(), 0.0][:2],
        "region": next((each.corners for each in game.quantities if each.corners), []),
        "radius": _radii(system),
    }


def _radii(system: SystemData) -> list[float | None]:
    """Of discs around the agents, of which no two meet while least distances are kept, in m."""
    game, apart = system.game, system.separation
    found = np.full(game.agents, np.inf if apart is None else 0.5 * apart.distance)
    for index, quantity in enumerate(game.quantities):
        still = quantity.pairs and not bounds_move(game, index)
        bounds = quantity.bounds(game.entries(quantity)) if still else {}
        least = bounds.get(f"{quantity.name}_lower_bound", np.zeros(0))
        for pair, distance in zip(quantity.pairs, least.reshape(-1), strict=False):
            if pair[0] >= 0 and distance > 0.0:
                found[pair] = np.minimum(found[pair], 0.5 * distance)
    return [float(radius) if np.isfinite(radius) else None for radius in found]


def line_key(system: str, variable: str) -> str:
    """The name of the array of a system's line."""
    return f"{system}/{variable}" if variable == "action" else f"{system}/quantity/{variable}"


def is_line(system: str, key: str) -> bool:
    """Whether an array of this name is a line of this system."""
    return key == line_key(system, "action") or key.startswith(line_key(system, ""))


def _about(system: SystemData, line: Variable, moving: list[str]) -> dict[str, Any]:
    """What JSON tells the page of a line but the action; ``moving`` are bounds that are lines."""
    game, attributes, bounds = system.game, line.attributes(system), line.bounds(system)
    labels = {
        "agent": [str(i + 1) for i in range(game.agents)],
        "action": [
            f"{i + 1} {axis}"
            for i, axis in zip(game.agent_of_action, game.axis_of_action, strict=True)
        ],
        "constraint": list(game.constraint_names),
    }
    about: dict[str, Any] = {
        "name": line.name,
        "long_name": attributes.get("long_name", line.name),
        "symbol": attributes.get("symbol", ""),
        "unit": attributes.get("units", ""),
        "labels": labels[line.dims(system)[1]] if len(line.dimensions) > 1 else [""],
    }
    pairs = json.loads(attributes.get("between", "[]"))
    about["between"] = [[i + 1, j + 1] if i >= 0 else None for i, j in pairs]
    about["moving_bounds"] = {}
    for key in ("bound", "lower_bound"):
        name = f"{line.name}_{key}"
        given = bounds.get(name)
        about[key] = None
        if name in moving:
            about["moving_bounds"][key] = name
        if given is not None:
            about[key] = [float(b) if np.isfinite(b) else None for b in given.reshape(-1)]
    return about
