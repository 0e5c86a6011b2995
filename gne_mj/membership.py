"""Agents that leave a run and join it: who, when, and what others' costs take them to do meanwhile.

While some are away the others play the game among themselves (:mod:`gne_mj.game_among`), over the
graph among themselves. Who leaves takes constraints along; who joins is admitted only strictly
inside (docs/networks.md, *Agents that leave and join*).
"""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Annotated

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from gne_mj.errors import InvalidInput, part_of
from gne_mj.game_model import Game
from gne_mj.toml_table import ACTION, PerAction, Sizes, Table, Unit, per_action

Array = NDArray[np.float64]
There = NDArray[np.bool_]  # (N,) who is


@dataclass(frozen=True, eq=False)
class Change:
    """Some agents leave, then some join.

    Args:
        time: in s.
        leaves, joins: agents, from 0; those who join are admitted together or not at all.
        action: outputs of those who join, agent by agent; None: as at the start.
        retry: s after which they try again where they are not admitted; 0: never.
    """

    time: float
    leaves: tuple[int, ...]
    joins: tuple[int, ...]
    action: Array | None = None
    retry: float = 0.0


@dataclass(frozen=True, eq=False)
class Membership:
    """Who leaves and joins, and when.

    Args:
        changes: by their times; who joins first was not there at the start.
        away: (m,) what the action of an agent that is away counts as in others' costs.
        keeps: names of constraints that go on without some of their agents, at these actions.
    """

    changes: tuple[Change, ...]
    away: Array
    keeps: frozenset[str] = frozenset()

    def at_start(self, agents: int) -> There:
        """Who is there at the start."""
        there = np.ones(agents, dtype=bool)
        for change in reversed(self.changes):
            there[list(change.joins)] = False
            there[list(change.leaves)] = True
        return there

    def intervals(self, agents: int) -> Iterator[tuple[float, There]]:
        """When who is there, if all are admitted: from a time in s on."""
        there = self.at_start(agents)
        yield 0.0, there.copy()
        for change in self.changes:
            there[list(change.leaves)] = False
            there[list(change.joins)] = True
            yield change.time, there.copy()


def check_changes(game: Game, membership: Membership) -> None:
    """Refuse changes of agents that there are not, or who are not there, or there already.

    Raises:
        InvalidInput: names ``changes``, ``away`` or ``keeps``.
    """
    for number, change in enumerate(membership.changes):
        with part_of(f"changes.{number}"):
            _check_numbers(game, "leaves", change.leaves)
            _check_numbers(game, "joins", change.joins)
    there, before = membership.at_start(game.agents), 0.0
    for number, change in enumerate(membership.changes):
        with part_of(f"changes.{number}"):
            if not before < change.time < np.inf:
                expected = "changes follow each other, the first one after 0 s"
                raise InvalidInput("time", change.time, expected)
            before = change.time
            _check_able("leaves", change.leaves, there)
            there[list(change.leaves)] = False
            _check_able("joins", change.joins, ~there)
            there[list(change.joins)] = True
            if not change.leaves and not change.joins:
                raise InvalidInput("leaves", [], "somebody must leave or join")
    if membership.away.shape != (game.actions,) or not np.all(np.isfinite(membership.away)):
        raise InvalidInput("away", membership.away, f"it must be {game.actions} finite numbers")
    for name in membership.keeps:
        if name not in game.constraint_names:
            names = ", ".join(repr(each) for each in game.constraint_names[:5])
            raise InvalidInput("keeps", name, f"it must be a constraint's name, such as {names}")


def _check_numbers(game: Game, key: str, agents: tuple[int, ...]) -> None:
    for i in agents:
        if not 0 <= i < game.agents:
            raise InvalidInput(key, i + 1, f"agents are numbered from 1 to {game.agents}")


def _check_able(key: str, agents: tuple[int, ...], able: There) -> None:
    for i in agents:
        if agents.count(i) > 1 or not able[i]:
            where = "there" if key == "leaves" else "away"
            raise InvalidInput(key, i + 1, f"who {key} must be {where} until then, and named once")


class ChangeTable(Table):
    """Some agents leave, then some join."""

    time: Annotated[float, Unit("s", "> 0, whole steps or control periods")] = Field(
        gt=0, description="when, each one after the one before"
    )
    leaves: list[int] = Field([], description="who leaves, numbered from 1")
    joins: list[int] = Field(
        [], description="who joins; of whom that is the first change, they are away at the start"
    )
    action: Annotated[PerAction | None, Unit(ACTION)] = Field(
        None,
        description="outputs of those who join: one number, or one each; those of the start if"
        " left out",
    )
    retry: Annotated[float | None, Unit("s")] = Field(
        None,
        gt=0,
        description="after how long they try again where they are not admitted; never if left out",
    )

    def build(self, sizes: Sizes) -> Change:
        """The change, of agents whose actions have so many entries."""
        joins = tuple(i - 1 for i in self.joins)
        known = tuple(sizes[i] for i in joins if 0 <= i < len(sizes))
        given = self.action
        return Change(
            self.time,
            tuple(i - 1 for i in self.leaves),
            joins,
            None if given is None or not known else per_action("action", given, known),
            self.retry or 0.0,
        )


class MembershipTable(Table):
    """Agents leave and join during the run."""

    changes: list[ChangeTable] = Field(min_length=1, description="when who leaves or joins")
    away: Annotated[PerAction | None, Unit(ACTION)] = Field(
        None,
        description="what the action of an agent that is away counts as in others' costs; the"
        " game's own, if it has one",
    )
    keeps: list[str] | None = Field(
        None,
        description="names of constraints that go on without some of their agents, whose actions"
        " are those of 'away' there; the game's own if left out",
    )

    def build(self, game: Game, away: Array | None, keeps: tuple[str, ...]) -> Membership:
        """The membership.

        Args:
            game: of all agents.
            away, keeps: the game's own, where nothing is given.
        """
        if self.away is not None:
            away = per_action("away", self.away, game.sizes)
        changes = []
        for number, change in enumerate(self.changes):
            with part_of(f"changes.{number}"):
                changes.append(change.build(game.sizes))
        found = Membership(
            tuple(changes),
            np.zeros(game.actions) if away is None else away,
            frozenset(keeps if self.keeps is None else self.keeps),
        )
        check_changes(game, found)
        if away is None and _reads_away(game, found):
            expected = (
                "costs of those who stay have the action of one who is away: say what it counts as"
            )
            raise InvalidInput("away", None, expected)
        return found


def _reads_away(game: Game, membership: Membership) -> bool:
    """Whether costs or constraints of those present ever have the action of one who is away."""
    kept = [
        game.in_constraint[k]
        for k, name in enumerate(game.constraint_names)
        if name in membership.keeps
    ]
    for _, there in membership.intervals(game.agents):
        rows = [game.in_cost[i] for i in np.flatnonzero(there).tolist()] + kept
        if any(not there[j] for row in rows for j in row):
            return True
    return False
