"""All comparisons of one game, at the same profiles every time."""

from types import ModuleType
from weakref import WeakKeyDictionary, WeakSet

import numpy as np
from numpy.typing import NDArray

from gne_mj.errors import InvalidInput, UserCodeError
from gne_mj.game_check import claims, derivatives, members
from gne_mj.game_check.functions import Functions
from gne_mj.game_check.report import Comparison, Report
from gne_mj.game_model import Game
from gne_mj.progress import Tell, nothing

Array = NDArray[np.float64]

# Profiles and, for each, agents and constraints: at load, and when asked for
_AT_LOAD = (3, 8)
_ASKED = (20, 40)
_HALVINGS = 60

# What was compared at load of each module of functions: keys of games
_compared: WeakKeyDictionary[ModuleType, set[int]] = WeakKeyDictionary()
_compared_games: WeakSet[Game] = WeakSet()


def examine(
    game: Game,
    start: Array,
    points: int = _ASKED[0],
    most: int = _ASKED[1],
    progress: Tell = nothing,
) -> Report:
    """Compare all that is written twice in a game.

    Args:
        game: tested or not.
        start: (m,) a profile strictly inside.
        points: how many profiles to look at, ``start`` among them.
        most: agents, actions and constraints for each profile; of more a part is drawn.
        progress: called after every profile.

    Raises:
        UserCodeError: a function fails at ``start``, or is no finite number there.
    """
    with np.errstate(all="ignore"):
        return _Examination(game, points, most).of(start, progress)


def refuse(game: Game, start: Array) -> None:
    """Refuse a game whose author contradicts himself, once for each game.

    Args:
        game: one that is tested is not looked at.
        start: (m,) a profile strictly inside.

    Raises:
        InvalidInput: the first thing that differs.
        UserCodeError: as :func:`examine`.
    """
    if game.tested or game in _compared_games:
        return
    done = _compared.setdefault(game.written.module, set())
    if _key(game) not in done:
        report = examine(game, start, *_AT_LOAD)
        for comparison in report.comparisons:
            if comparison.difference is not None:
                raise InvalidInput(*comparison.difference)
        done.add(_key(game))
    _compared_games.add(game)


def _key(game: Game) -> int:
    """The same for games of one module with the same numbers, lists and declarations."""
    box = () if game.box is None else (bound.tobytes() for bound in game.box)
    closer = game.feasible_jacobian_bounds
    slopes = () if closer is None else (np.asarray(bound, float).tobytes() for bound in closer)
    gaps = None if game.gap_bounds is None else np.asarray(game.gap_bounds).tobytes()
    return hash(
        (
            game.written.parameters.tobytes(), game.sizes,
            tuple(map(tuple, game.in_cost)), tuple(map(tuple, game.in_constraint)),
            game.affine, tuple(box), game.jacobian_bounds is None, game.row_scaled, gaps,
            tuple(slopes),
            game.affine_constraints, game.constraint_class,
        )
    )  # fmt: skip


class _Examination:
    def __init__(self, game: Game, points: int, most: int) -> None:
        self.f, self.points, self.most = Functions(game), points, most
        self.rng = np.random.default_rng(0)
        self.failures: list[str] = []
        absent = "there is none, and central differences stand for it"
        second, bend = game.has_cost_hessian, game.has_constraint_hessian
        self.in_cost = Comparison("in_cost", "what functions read")
        self.in_constraint = Comparison("in_constraint", "what functions read")
        self.gradient = Comparison("cost_gradient", "differences of cost")
        self.others = (
            Comparison(
                "add_cost_hessian", "differences of cost_gradient", note="" if second else absent
            ),
            Comparison("constraint_gradient", "differences of constraint"),
            Comparison(
                "constraint_hessian",
                "differences of constraint_gradient",
                note="" if bend else absent,
            ),
        )

    def of(self, start: Array, progress: Tell) -> Report:
        good: list[Array] = []
        progress(0, self.points, f"{self.f.game.name} at {self.points} profiles")
        for n, y in enumerate(interior_profiles(self.f, start, self.points, self.rng)):
            try:
                self._compare(y)
            except UserCodeError as error:
                if n == 0:
                    raise
                self.failures.append(str(error))
            else:
                good.append(y)
            progress(n + 1, self.points, f"{n + 1} of {self.points} profiles")
        found = [self.in_cost, self.in_constraint, self.gradient, *self.others]
        return Report(
            self.f.game.name, len(good), (*found, *self._claims(good)), tuple(self.failures)
        )

    def _compare(self, y: Array) -> None:
        sample = y, self.rng, self.most
        members.costs(self.f, *sample, self.in_cost)
        members.constraints(self.f, *sample, self.in_constraint)
        derivatives.cost_gradients(self.f, *sample, self.gradient)
        derivatives.second_derivatives(self.f, *sample, *self.others)

    def _claims(self, points: list[Array]) -> list[Comparison]:
        game = self.f.game
        declared = (
            (claims.affine, game.affine),
            (claims.constraint_class, game.constraint_class is not None),
            (claims.box, game.box is not None),
            (claims.jacobian_bounds, game.jacobian_bounds is not None),
            (claims.gap_bounds, game.gap_bounds is not None),
        )
        found = []
        for compare, given in declared:
            if given:
                try:
                    found.append(compare(self.f, points, self.rng, self.most))
                except UserCodeError as error:
                    self.failures.append(str(error))
        return found


def interior_profiles(
    f: Functions, start: Array, count: int, rng: np.random.Generator
) -> list[Array]:
    """``start`` and others, random parts of the way to the boundary in random directions."""
    start = start.copy()
    start.flags.writeable = False
    found, center = [start], start
    size = 10.0 * max(1.0, float(np.max(np.abs(start))))
    while len(found) < count:
        direction = rng.normal(size=len(start))
        direction *= size / np.linalg.norm(direction)
        # The longer of both ways, which leads away from a start that is near a bound
        length, sign = max((_room(f, center, sign * direction), sign) for sign in (1.0, -1.0))
        y = center + sign * rng.uniform(0.3, 0.7) * length * direction
        y.flags.writeable = False
        center = y if f.inside([y]) else center
        found.append(center)
    return found


def _room(f: Functions, y: Array, direction: Array) -> float:
    """A length, at most 1, that y may go in a direction; at least half of what it may if less."""
    length = 1.0
    for _ in range(_HALVINGS):
        if f.inside([y + length * direction]):
            return length
        length *= 0.5
    return 0.0
