"""The systems of those present, where agents leave and join during a run."""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from gne_mj.errors import InvalidInput, Refusal
from gne_mj.game_among import MOST_ACTIONS, Among, game_among
from gne_mj.loops.membership import MembershipLoop, Part
from gne_mj.membership import Change, There
from gne_mj.plants.agent_type import followed_position, has_ode, placed_state
from gne_mj.system.clock import Clock
from gne_mj.system.data import ADAPTIVE, SystemData

if TYPE_CHECKING:
    from gne_mj.system.assembly import Assembly

Array = NDArray[np.float64]
Indices = NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class Present:
    """Those present, by themselves.

    Attributes:
        among: their game, and which agents, actions and constraints of the whole one are theirs.
        memory: which entries of the whole run's memory are.
        system: theirs.
    """

    among: Among
    memory: Indices
    system: Any


def check_membership(system: SystemData) -> None:
    """Refuse what does not go on among fewer agents.

    Raises:
        InvalidInput: names ``membership`` or what does not go with it.
    """
    membership, game, key = system.membership, system.game, "membership"
    if membership is None:
        return
    if system.integrator in ADAPTIVE:
        expected = "its steps do not end where agents leave or join; use 'rk4' or 'euler'"
        raise InvalidInput("integrator", system.integrator, expected)
    against = {
        "faults": (bool(system.faults), "faults are of agents that stay"),
        "on_exit": (system.goes_on, "such runs end where they leave the set: on_exit = 'stop'"),
        "schedule": (system.moves, "games and penalties must stand still where agents come and go"),
        "agents": (
            not has_ode(system.agents.kind),
            "only MuJoCo knows the state of a user's own robots, which is not handed on",
        ),
    }
    for strikes, expected in against.values():
        if strikes:
            raise InvalidInput(key, "given", expected)
    if game.actions > MOST_ACTIONS:
        expected = f"each evaluation copies a profile: it is for up to {MOST_ACTIONS} actions"
        raise InvalidInput(key, f"{game.actions} actions", expected)
    for number, (time, there) in enumerate(membership.intervals(game.agents)):
        try:
            game_among(game, there, membership.away, membership.keeps)
            system.law.among(there)
        except Refusal as error:
            at = f"{key}.changes.{number - 1}" if number else key
            error.rename(at, f"from {time:g} s on {error.about}")
            raise


def check_instants(system: SystemData, clock: Clock, *, held: bool) -> None:
    """Refuse changes between steps, or between control instants.

    Raises:
        InvalidInput: names ``membership.changes`` and the time.
    """
    if system.membership is None:
        return
    unit, what = (clock.control_period, "control period") if held else (clock.timestep, "timestep")
    for number, change in enumerate(system.membership.changes):
        for key, time in (("time", change.time), ("retry", change.retry)):
            if abs(time / unit - round(time / unit)) > 1e-6:
                raise InvalidInput(
                    f"membership.changes.{number}.{key}",
                    time,
                    f"it must be a multiple of the {what} {unit:g} s",
                )


def present_of(
    system: "Assembly", there: There, state: Array, memory: Array | None = None
) -> Present:
    """The system of those that are there.

    Args:
        system: of all agents.
        there: (N,) who is.
        state: (m, states) of all agents; those of others are not read.
        memory: of all agents, with their observers' loads behind; as at a start if left out.

    Raises:
        InfeasibleStart: those present are not strictly inside.
        InvalidInput: they cannot go on by themselves.
    """
    membership, game = system.membership, system.game
    assert membership is not None
    among = game_among(game, there, membership.away, membership.keeps)
    law, bound, channels = system.law.among(there), system.disturbance, there[game.agent_of_action]
    places = memory_places(system, among)
    of_law = len(places) - (len(among.actions) if system.observer > 0.0 else 0)
    found = replace(
        system,
        game=among.game,
        agents=system.agents.among(channels),
        law=law,
        state=state[channels].copy(),
        memory=np.zeros(0) if memory is None else memory[places[:of_law]],
        load=None if memory is None or system.observer == 0.0 else memory[places[of_law:]],
        disturbance=None
        if bound is None
        else replace(
            bound, push=bound.push[channels], noise=bound.noise[channels],
            change=None if bound.change is None else bound.change[channels],
        ),
        membership=None,
    )  # fmt: skip
    return Present(among, places, found)


def memory_places(system: SystemData, among: Among) -> Indices:
    """Which entries of the whole run's memory are those of some agents, in their order."""
    m, at, places = system.game.actions, 0, [np.zeros(0, dtype=np.int64)]
    for part in system.law.memory_parts:
        rows = among.agents[:, None] if part.rows else np.zeros((1, 1), dtype=np.int64)
        places.append((at + rows * m + among.actions).ravel())
        at += m * (system.game.agents if part.rows else 1)
    if system.observer > 0.0:
        places.append(at + among.actions)
    return np.concatenate(places)


class Company:
    """Makes the loops of those present, see :class:`gne_mj.loops.membership.Company`.

    Args:
        system: of all agents.
        clock: of the run.
    """

    def __init__(self, system: "Assembly", clock: Clock) -> None:
        self._system, self._clock = system, clock

    def part(self, there: There, state: Array, memory: Array, step: int) -> Part:
        """The loop of those that are there."""
        found = present_of(self._system, there, state, memory)
        self._system.keep_among(there, found)
        loop = found.system.closed_loop(self._clock)
        loop.start_at(step)
        among = found.among
        return Part(loop, there.copy(), among.actions, among.constraints, found.memory)

    def welcome(
        self, change: Change, there: There, state: Array, memory: Array
    ) -> tuple[Array, Array]:
        """States and memories with those who join."""
        system, game = self._system, self._system.game
        joins = np.zeros(game.agents, dtype=bool)
        joins[list(change.joins)] = True
        comes = joins[game.agent_of_action] & ~there[game.agent_of_action]
        start = system.state.copy()
        if change.action is not None:
            order = [a for i in change.joins for a in np.flatnonzero(game.agent_of_action == i)]
            y = system.start.copy()
            y[order] = change.action
            start = _moved(system, system.agents.equilibrium(y), start)
        here = there[game.agent_of_action]
        state = state.copy()
        state[comes] = _beside(system, start, state, here)[comes]
        return state, self._heard(joins & ~there, there, state, memory.copy())

    def _heard(self, comes: There, there: There, state: Array, memory: Array) -> Array:
        """Memories: who joins takes others' actions to be what neighbours do on average, and all
        take its own to be what it is."""
        system, m = self._system, self._system.game.actions
        y, own = state[:, system.agents.kind.OUTPUT], comes[system.game.agent_of_action]
        at = 0
        for part in system.law.memory_parts:
            size = m * (system.game.agents if part.rows else 1)
            rows = memory[at : at + size].reshape(-1, m)  # a view
            if part.rows:
                for i in np.flatnonzero(comes):
                    near = [j for j in _neighbours(system, int(i)) if there[j]]
                    rows[i] = np.mean(rows[near], axis=0) if near else y
            rows[:, own] = y[own]
            at += size
        if system.observer > 0.0:
            memory[at:][own] = 0.0
        return memory


def _neighbours(system: SystemData, agent: int) -> list[int]:
    assert system.law.graph is not None
    return [j if i == agent else i for i, j in system.law.graph.edges if agent in (i, j)]


def _moved(system: SystemData, rest: Array, start: Array) -> Array:
    """Rest at outputs that are given, at the places of the start."""
    placed = placed_state(system.agents.kind)
    if placed is not None and followed_position(system.agents.kind) < 0:
        at = [name for name, _ in system.agents.kind.STATES].index(placed)
        rest[:, at] = start[:, at]
    return rest


def _beside(system: SystemData, start: Array, state: Array, here: NDArray[np.bool_]) -> Array:
    """The start of those who join; of robots whose places are free, as far from those present on
    average as it was at the start."""
    placed = placed_state(system.agents.kind)
    if placed is None or followed_position(system.agents.kind) >= 0:
        return start
    at = [name for name, _ in system.agents.kind.STATES].index(placed)
    d, moved = max(system.agents.dimension, 1), start.copy()
    for axis in range(d):
        along = np.arange(len(start)) % d == axis
        own = here & along
        moved[along, at] += np.mean(state[own, at]) - np.mean(system.state[own, at])
    return moved


def groups(system: SystemData, y: Array) -> Iterator[tuple[There, NDArray[np.bool_]]]:
    """Who was there in samples (samples, m), not numbers for who was not: each set of agents once,
    with the samples that it is of."""
    first = np.concatenate([[0], np.cumsum(system.game.sizes)[:-1]])
    there = np.isfinite(y[:, first])
    for each in np.unique(there, axis=0):
        yield each, np.all(there == each, axis=1)


def membership_loop(system: "Assembly", clock: Clock) -> MembershipLoop:
    """The loop of a run in which agents leave and join, at its start."""
    membership, game = system.membership, system.game
    assert membership is not None
    company, memory = Company(system, clock), system.loop_memory
    there = membership.at_start(game.agents)
    first = company.part(there, system.state, memory, 0)
    return MembershipLoop(
        company, membership.changes, first, (system.state, memory), game.constraints_count,
        clock.timestep,
    )  # fmt: skip
