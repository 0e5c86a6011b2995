"""Whether what a game's author gives for its fields is of the right kind, before it is used."""

from collections.abc import Callable, Sequence
from numbers import Integral
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gne_mj.equality import Equality
from gne_mj.errors import GneError, InvalidInput, UserCodeError
from gne_mj.quantity import Quantity

Box = tuple[NDArray[np.float64], NDArray[np.float64]]

_TEXTS = ("name", "action_name", "action_unit", "agent_name")
_SWITCHES = ("affine", "row_scaled", "smooth", "tested")


def check_kinds(game: Any) -> None:
    """Refuse fields of a :class:`gne_mj.game_model.Game` that are not of the kind they must be.

    Raises:
        InvalidInput: names the first of them.
    """
    for key in _TEXTS:
        _need(game, key, _is_text(getattr(game, key)), "it must be UTF-8 text")
    for key in ("constraint_names", "axes"):
        texts = _all(getattr(game, key), str) and all(map(_is_text, getattr(game, key)))
        _need(game, key, texts, "it must list UTF-8 texts")
    for key in _SWITCHES:
        flag = isinstance(getattr(game, key), bool | np.bool_)
        _need(game, key, flag, "it must be True or False")
    _need(game, "sizes", _all(game.sizes, Integral), "it must list a whole number an agent")
    for key in ("in_cost", "in_constraint"):
        lists = getattr(game, key)
        fits = _all(lists, Sequence | np.ndarray) and all(_all(each, Integral) for each in lists)
        _need(game, key, fits, "it must list lists of agents' numbers")
    owners = game.owners
    fits = owners is None or (
        _all(owners, Sequence | np.ndarray) and all(_all(each, Integral) for each in owners)
    )
    _need(game, "owners", fits, "it must list lists of agents' numbers")
    _need(game, "quantities", _all(game.quantities, Quantity), "it must list gne_mj Quantities")
    equalities = _all(game.equalities, Equality)
    _need(game, "equalities", equalities, "it must list gne_mj Equalities")
    numbers = real(game.parameters)
    row = numbers is not None and numbers.ndim == 1
    _need(game, "parameters", row, "it must be one row of real numbers")
    count, p = sum(game.sizes), len(game.in_constraint)
    for key, positive in (("gap_bounds", True), ("tightening", False)):
        given = getattr(game, key)
        array = real(given)
        fits = given is None or (array is not None and array.shape == (p,))
        _need(game, key, fits, f"it must list {p} real numbers, one a constraint")
        if array is not None and not np.all(array > 0.0 if positive else array >= 0.0):
            _need(game, key, False, f"all must be {'positive' if positive else 'at least 0'}")
    _need_pair(game, "box", (count,))
    _need_pair(game, "feasible_jacobian_bounds", (count, count))
    known = game.jacobian_bounds is None or callable(game.jacobian_bounds)
    _need(game, "jacobian_bounds", known, "it must be a function of a box")


def check_owners(game: Any) -> None:
    """Refuse owners that do not appear in their constraint, or equalities of none.

    Raises:
        InvalidInput: names ``owners`` or ``equalities``.
    """
    if game.owners is not None and len(game.owners) != len(game.in_constraint):
        expected = f"there must be {len(game.in_constraint)}, one a constraint"
        raise InvalidInput("owners", f"{len(game.owners)} lists", expected)
    for own, members in zip(game.owned_by, game.in_constraint, strict=True):
        if not len(own) or len(set(own)) != len(own) or not set(own) <= set(members):
            expected = f"it must list some of the agents in the constraint, {sorted(members)}"
            raise InvalidInput("owners", list(own), expected)
    for each in game.equalities:
        if not 0 <= each.constraint < len(game.in_constraint):
            expected = f"constraints are numbered from 0 to {len(game.in_constraint) - 1}"
            raise InvalidInput("equalities", each.constraint, expected)


def checked_bounds(function: Callable[[Box], Box], actions: int) -> Callable[[Box], Box]:
    """A user's ``jacobian_bounds``; UserCodeError where it fails or returns no bounds."""

    def bounds(box: Box) -> Box:
        try:
            found: Any = function(box)
        except (KeyboardInterrupt, GneError):
            raise
        except BaseException as error:
            raise UserCodeError(function, error) from error
        pair = _pair(found, (actions, actions))
        if pair is None:
            shape = f"({actions}, {actions})"
            raise UserCodeError(function, f"it must return (lower, upper), each of shape {shape}")
        return pair

    return bounds


def real(value: Any) -> NDArray[np.float64] | None:
    """A value as an array of real numbers; None if it is none, as NumPy takes complex and text."""
    try:
        array = np.asarray(value)
    except ValueError:  # rows of different lengths
        return None
    return array.astype(np.float64) if array.dtype.kind in "fiu" else None


def _need(game: Any, key: str, holds: bool, expected: str) -> None:
    if not holds:
        raise InvalidInput(key, f"{getattr(game, key)!r:.60}", expected)


def _need_pair(game: Any, key: str, shape: tuple[int, ...]) -> None:
    given = getattr(game, key)
    fits = given is None or _pair(given, shape) is not None
    _need(game, key, fits, f"it must be (lower, upper), each of real numbers of shape {shape}")


def _pair(given: Any, shape: tuple[int, ...]) -> Box | None:
    if not isinstance(given, Sequence | np.ndarray) or len(given) != 2:
        return None
    lower, upper = real(given[0]), real(given[1])
    if lower is None or upper is None or not lower.shape == upper.shape == shape:
        return None
    return lower, upper


def _is_text(value: Any) -> bool:
    """Whether results can keep it."""
    return isinstance(value, str) and value == value.encode(errors="ignore").decode()


def _all(values: Any, kind: Any) -> bool:
    """Whether these are several values of a kind."""
    if isinstance(values, str) or not isinstance(values, Sequence | np.ndarray):
        return False
    return all(isinstance(each, kind) and not isinstance(each, bool) for each in values)
