"""What all agents see of fleets, as columns of one table with a row for each fleet.

Agents are numbered from 1 in the entries' names, as everywhere that people read.
"""

from itertools import accumulate, pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from gne_mj.environment.fleets import Fleets
from gne_mj.environment.information import Information
from gne_mj.errors import GneError, UserCodeError
from gne_mj.game_model import Game
from gne_mj.plants import mjcf_file
from gne_mj.plants.fleet_plant import FleetPlant
from gne_mj.plants.mjcf_fleet import MjcfPlant

Array = NDArray[np.float64]
ALL = "all/"


class NotFinite(GneError, FloatingPointError):
    """A cost or an observation that is not a number, inside the constraint set."""


def finite_costs(game: Game, y: Array) -> Array:
    """J_i of each agent, shape (..., N), at y (..., m) inside.

    Raises:
        UserCodeError: one of plain functions raises, or is not a number.
        NotFinite: another that is not a finite number.
    """
    costs = game.costs(y)
    if not np.all(np.isfinite(costs)):
        raise NotFinite(f"the agents' costs at {y.tolist()} are not finite: {costs.tolist()}")
    return costs


class Entry(NamedTuple):
    """Some columns of the table under a name.

    Attributes:
        name: ``agent_i/...`` or ``all/...``.
        columns: which.
        shape: of what is observed of one fleet.
    """

    name: str
    columns: NDArray[np.int64]
    shape: tuple[int, ...]


class View:
    """Who sees what, of fleets of one game.

    Args:
        game: what is played.
        plant: such a fleet.
        told: what each agent sees.

    Attributes:
        entries: in their order: for agent i ``agent_i/own``, (m_i * states,), its channels' states
            one behind the other; for an MJCF robot also ``agent_i/joints``, its qpos, qvel and act;
            ``agent_i/neighbours``, outputs of those it hears; and ``agent_i/constraints``, g_l of
            those it is told, negative inside. With full information also ``all/output`` (m,),
            ``all/state`` (m, states), ``all/constraint`` (p,), and what the game derives from the
            actions, as ``all/gap``.
    """

    def __init__(self, game: Game, plant: FleetPlant, told: Information) -> None:
        self.game, self._told = game, told
        shapes = [(each, game.entries(each)) for each in game.quantities]
        # of each quantity which of its entries there are
        self._there = [(each, own, each.there(own) if own else ...) for each, own in shapes]
        m, states, p = game.actions, plant.agents.states, game.constraints_count
        joints = joints_of(plant)
        at = [0, *accumulate([m * states, m, p, sum(map(len, joints))])]
        state, y, g = (np.arange(a, b) for a, b in pairwise(at[:4]))
        joint_at = [at[3], *accumulate(map(len, joints), initial=at[3])][1:]
        self.entries: list[Entry] = []
        for i, (a, b) in enumerate(pairwise(game.data.offsets.tolist())):
            name = f"agent_{i + 1}"
            self._add(f"{name}/own", state[a * states : b * states])
            if joints:
                self._add(f"{name}/joints", joint_at[i] + np.arange(len(joints[i])))
            self._add(f"{name}/neighbours", y[told.heard[i]])
            self._add(f"{name}/constraints", g[told.constraints[i]])
        self._joint_entries = np.concatenate(joints) if joints else None
        if told.structure == "full":
            self._add(f"{ALL}output", y)
            self._add(f"{ALL}state", state, (m, states))
            self._add(f"{ALL}constraint", g)
            first = at[4]
            for name, values in self._derived(np.full((1, m), np.nan)):
                self._add(f"{ALL}{name}", first + np.arange(values.size), values.shape[1:])
                first += values.size
        self._states, self._output = states, plant.agents.kind.OUTPUT

    def _add(
        self, name: str, columns: NDArray[np.int64], shape: tuple[int, ...] | None = None
    ) -> None:
        self.entries.append(Entry(name, columns, columns.shape if shape is None else shape))

    @property
    def joint(self) -> NDArray[np.int64]:
        """Columns of what all agents see together, each once: what is under ``all/``, if any is."""
        whole = [each.columns for each in self.entries if each.name.startswith(ALL)]
        return np.concatenate(whole[1:] if whole else [each.columns for each in self.entries])

    def own(self, agent: int) -> NDArray[np.int64]:
        """Columns of what one agent sees, from 0."""
        name = f"agent_{agent + 1}/"
        return np.concatenate([e.columns for e in self.entries if e.name.startswith(name)])

    def table(self, fleets: Fleets, rows: slice = slice(None)) -> Array:
        """The table of fleets as they are now, (E, columns)."""
        found = fleets.rows
        parts = [found.state[rows], found.y[rows], found.g[rows]]
        if self._joint_entries is not None:
            parts.append(fleets.joints(rows)[:, self._joint_entries])
        if self._told.structure == "full":
            derived = [values for _, values in self._derived(found.y[rows])]
            parts += [values.reshape(len(values), -1) for values in derived]
        return np.concatenate(parts, axis=1)

    def _derived(self, y: Array) -> list[tuple[str, Array]]:
        """What the game derives from its actions y (E, m), without entries that are not there."""
        return [(each.name, each.at(y, own)[:, there]) for each, own, there in self._there]

    def bounds(self, bound: float) -> tuple[Array, Array]:
        """(lower, upper) bounds of the table's columns: those of outputs that the game declares.

        Args:
            bound: of the magnitude of all others.
        """
        width = 1 + max(int(each.columns.max(initial=-1)) for each in self.entries)
        lower, upper = np.full(width, -bound), np.full(width, bound)
        if self.game.box is not None:
            m = self.game.actions
            for columns in (
                np.arange(m) * self._states + self._output,
                m * self._states + np.arange(m),
            ):
                lower[columns], upper[columns] = self.game.box
        return lower, upper

    def finite(self, fleets: Fleets, row: int) -> bool:
        """Whether all that is observed of a fleet, and its costs, are numbers."""
        try:
            costs = self.game.costs(fleets.rows.y[row])
            table = self.table(fleets, slice(row, row + 1))
        except UserCodeError:  # outside they need not be defined
            return False
        return bool(np.all(np.isfinite(table)) and np.all(np.isfinite(costs)))

    def settle(self, fleets: Fleets, row: int) -> None:
        """See to it that what is observed of a fleet that left is finite."""
        if fleets.exits[row] is not None and not self.finite(fleets, row):
            fleets.restore(row)

    def check(self, table: Array) -> Array:
        """The table itself, if all of it are numbers.

        Raises:
            NotFinite: an entry that is none.
        """
        if not np.all(np.isfinite(table)):
            for each in self.entries:
                values = table[:, each.columns]
                if not np.all(np.isfinite(values)):
                    raise NotFinite(f"observation '{each.name}' is not finite: {values.tolist()}")
        return table


def joints_of(plant: FleetPlant) -> list[NDArray[np.int64]]:
    """Of each MJCF robot its entries of qpos, qvel and act, one behind the other.

    None of others, whose state is known. Robots are attached one behind the other, so that their
    numbers are too; names would not do, since joints without one are not given any.
    """
    if not isinstance(plant, MjcfPlant):
        return []
    whole = np.array([plant.model.nq, plant.model.nv, plant.model.na])
    behind, parts, at = np.cumsum([0, *whole[:2]]), [], np.zeros(3, dtype=np.int64)
    for robot in plant.agents.files:
        alone = mjcf_file.alone(robot.path)
        ends = at + np.array([alone.nq, alone.nv, alone.na])
        spans = zip(behind + at, behind + ends, strict=True)
        parts.append(np.concatenate([np.arange(a, b) for a, b in spans]))
        at = ends
    assert np.array_equal(at, whole)
    return parts
