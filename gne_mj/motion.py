"""Games whose numbers move: references, wishes, bounds, limits, prices as functions of time.

A game's table may have a function of time in the place of any number. The game itself is then that
of time 0, and carries a :class:`Motion`: which numbers move, how the game's parameters q follow
them, and the game at any other time. q is affine in them, which is tried before anything runs, so
that native code brings q to a time by :func:`move` and nothing else of a loop differs.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Annotated, Any, NamedTuple, cast

import numpy as np
from numpy.typing import NDArray

from gne_mj.errors import InvalidInput, Refusal, UserCodeError
from gne_mj.game_model import Game, GameData
from gne_mj.native import kernel
from gne_mj.parameter_block import floats_at
from gne_mj.time_functions import Signal, value_at

Array = NDArray[np.float64]

_ROUNDING = 1e-9  # of a game's numbers, within which they follow those that move
_TRIED = 1e-3  # part of a number, by which it is changed to see what follows
_GIVEN = "a function of time"
_CHECKED = 8  # times at most at which what follows is compared with the game itself


class Moving(NamedTuple):
    """How native code brings a game's parameters to a time.

    Index lists are in compressed rows, as those of :class:`gne_mj.game_model.GameData`.
    """

    rows: Annotated[np.ndarray, "n"]  # of the functions, see value_at
    pointer: Annotated[np.ndarray, "n", int]  # where each begins, with the end of the last
    moved: Annotated[np.ndarray, "n", int]  # entries of q that move
    standing: Annotated[np.ndarray, "n"]  # and what each of them has besides
    first: Annotated[np.ndarray, "n", int]  # where each function's list begins in the next two
    entry: Annotated[np.ndarray, "n", int]  # entries of q that follow it
    factor: Annotated[np.ndarray, "n"]  # by how much
    target: Annotated[np.ndarray, "n", int]  # [address, length] of q
    # Feed-forward (gne_mj.feed_forward): inputs (times, m) so many s apart, and that of now
    input: Annotated[np.ndarray, "n"] = np.zeros(0)
    spacing: Annotated[np.ndarray, "1"] = np.ones(1)
    now: Annotated[np.ndarray, "n"] = np.zeros(0)


_NONE = np.zeros(0, dtype=np.int64)
STANDING = Moving(
    np.zeros(0), _NONE, _NONE, np.zeros(0), _NONE, _NONE, np.zeros(0), np.zeros(2, np.int64)
)


@kernel
def move(moving, time):
    """Bring q, and what is fed forward, to a time in s."""
    q = floats_at(moving.target[0], moving.target[1])
    for k in range(len(moving.moved)):
        q[moving.moved[k]] = moving.standing[k]
    for s in range(len(moving.first) - 1):
        value = value_at(moving.rows[moving.pointer[s] : moving.pointer[s + 1]], time)
        for k in range(moving.first[s], moving.first[s + 1]):
            q[moving.entry[k]] += moving.factor[k] * value
    m = len(moving.now)
    if m > 0:
        at = time / moving.spacing[0]
        row = min(int(at), len(moving.input) // m - 2)
        part = min(at - row, 1.0)
        for r in range(m):
            before, after = moving.input[row * m + r], moving.input[(row + 1) * m + r]
            moving.now[r] = before + part * (after - before)


@dataclass(frozen=True, eq=False)
class Motion:
    """Which numbers of a game move, and how.

    Args:
        keys: what they are called, for messages.
        signals: one for each.
        make: the game with these values in their places.

    Raises:
        InvalidInput: the game's parameters do not follow a number in proportion, or its structure
            changes with it; or a value that it cannot have, with the time.
    """

    keys: tuple[str, ...]
    signals: tuple[Signal, ...]
    make: Callable[[Sequence[float]], Game]
    _others: list[tuple[list[float], Game]] = field(default_factory=list, init=False)

    def __post_init__(self) -> None:
        _ = self._follows  # refuses what cannot move
        self._check()

    def values(self, time: float) -> list[float]:
        """The numbers at a time in s."""
        return [signal.at(time) for signal in self.signals]

    def at(self, time: float) -> Game:
        """The game of a time in s, checked as any other."""
        try:
            return self.make(self.values(time))
        except Refusal as error:
            error.rename(error.key, f"at {time:g} s {error.about}")
            raise

    @property
    def knots(self) -> tuple[float, ...]:
        """Times in s at which some number, or its rate, jumps, those after 0."""
        return tuple(sorted({t for signal in self.signals for t in signal.knots if t > 0.0}))

    @property
    def others(self) -> list[Game]:
        """The game of time 0 with one after the other of the numbers changed a little."""
        return [game for _, game in self._others]

    @cached_property
    def moves_constraints(self) -> bool:
        """Whether constraints move, not costs alone."""
        game = self.make(self.values(0.0))
        y = 0.5 + np.random.default_rng(0).random(game.actions)
        g = game.constraints(y)
        return any(not np.array_equal(g, each.constraints(y)) for each in self.others)

    def frame(self) -> "Frame":
        """A game of its own that can be brought to any time."""
        return Frame(self, self.make(self.values(0.0)))

    @cached_property
    def _follows(self) -> tuple[Array, Array]:
        """dq/ds (signals, n) and what q has besides (n,)."""
        now = self.values(0.0)
        game = self.make(now)
        q = _parameters(game)
        slopes = np.zeros((len(now), len(q)))
        for k, (key, value) in enumerate(zip(self.keys, now, strict=True)):
            slopes[k] = self._slope(k, key, game, now, _TRIED * (abs(value) or 1.0))
        nearest = np.round(slopes, 9)
        slopes = np.where(np.abs(slopes - nearest) < _ROUNDING, nearest, slopes)
        standing = q - np.array(now) @ slopes
        standing[np.abs(standing) <= _ROUNDING * np.abs(q)] = 0.0
        for key, slope in zip(self.keys, slopes, strict=True):
            if not np.any(slope):
                raise InvalidInput(key, _GIVEN, "no parameter of the game (its q) follows it")
        return slopes, standing

    def _check(self) -> None:
        """Compare the game as native code moves it with the game as it is made at some times."""
        frame = self.frame()
        times = self.knots[:: len(self.knots) // _CHECKED + 1]
        there = [(self.values(time), self.at(time)) for time in times]
        for values, made in [*self._others, *there]:
            if not _same(made, frame.set(values)):
                raise InvalidInput(
                    self.keys[0],
                    _GIVEN,
                    "the game's functions must follow what moves by its parameters (q) alone, and"
                    f" in proportion, which they do not where {', '.join(self.keys)} are"
                    f" {', '.join(f'{value:g}' for value in values)}",
                )

    def _slope(self, k: int, key: str, game: Game, now: list[float], change: float) -> Array:
        """dq/ds of one number."""
        for step in (change, -change):
            moved = [*now]
            moved[k] += step
            try:
                other = self.make(moved)
            except Refusal:
                continue
            if _structure(other) != _structure(game):
                break
            self._others.append((moved, other))
            return (_parameters(other) - _parameters(game)) / (moved[k] - now[k])
        raise InvalidInput(
            key,
            _GIVEN,
            "it must be a number that can change without changing who depends on whom",
        )

    def _moving(self, q: Array) -> Moving:
        slopes, standing = self._follows
        rows = [signal.row for signal in self.signals]
        entries = [np.flatnonzero(slope) for slope in slopes]
        moved = np.unique(np.concatenate(entries)).astype(np.int64)
        return Moving(
            np.concatenate(rows),
            _ends(rows),
            moved,
            standing[moved],
            _ends(entries),
            np.concatenate(entries).astype(np.int64),
            np.concatenate([slope[at] for slope, at in zip(slopes, entries, strict=True)]),
            np.array([q.ctypes.data, q.size], dtype=np.int64),
        )


class Frame:
    """A game whose parameters are brought to one time after the other.

    Args:
        motion: how they move.
        game: made for this frame alone.

    Attributes:
        game: as it is at the time that was asked for last.
        moving: for native code, which changes the same game.
    """

    def __init__(self, motion: Motion, game: Game) -> None:
        self.motion, self.game = motion, game
        self._q = game.data.parameters if game.native else game.written.parameters
        self._q.flags.writeable = True
        self.moving = motion._moving(self._q)

    @property
    def data(self) -> GameData:
        """What native code reads of the game."""
        return self.game.data

    def to(self, time: float) -> Game:
        """The game at a time in s; it is no longer that of another time then."""
        return self.set(self.motion.values(time))

    def set(self, values: Sequence[float]) -> Game:
        """The same where what moves has these values."""
        slopes, standing = self.motion._follows
        moved = self.moving.moved
        self._q[moved] = standing[moved] + np.array(values) @ slopes[:, moved]
        return self.game


def motion_of(game: Game) -> Motion | None:
    """How a game's numbers move; None of one whose numbers stand still."""
    return cast("Motion | None", game.motion)


def moving_game(game: Game, motion: Motion) -> Game:
    """A game, as it is at time 0, that moves from then on."""
    object.__setattr__(game, "motion", motion)
    return game


def _same(made: Game, moved: Game) -> bool:
    """Whether two games have the same parameters, and values at a profile."""
    y = 0.5 + np.random.default_rng(0).random(made.actions)
    if not np.allclose(_parameters(made), _parameters(moved), rtol=1e-7, atol=1e-9):
        return False
    try:
        return all(
            np.allclose(a, b, rtol=1e-7, atol=1e-9, equal_nan=True)
            for a, b in (
                (made.costs(y), moved.costs(y)),
                (made.constraints(y), moved.constraints(y)),
                (made.pseudo_gradient(y), moved.pseudo_gradient(y)),
            )
        )
    except UserCodeError:  # which is not defined there
        return True


def _ends(rows: Sequence[NDArray[Any]]) -> NDArray[np.int64]:
    """Where each of some rows begins in all of them, with the end."""
    return np.concatenate([[0], np.cumsum([len(row) for row in rows])]).astype(np.int64)


def _parameters(game: Game) -> Array:
    """q of a game as it is now."""
    return np.array(game.data.parameters if game.native else game.written.parameters)


def _structure(game: Game) -> tuple[object, ...]:
    """What of a game must not change in time."""
    lists = (game.in_cost, game.in_constraint, game.owned_by)
    members = [[tuple(map(int, each)) for each in rows] for rows in lists]
    return game.sizes, game.constraint_names, members, len(_parameters(game))
