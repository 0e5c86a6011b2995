"""What a game derives from its actions and bounds, such as gaps or a total: recorded and drawn."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from gne_mj.errors import InvalidInput


@dataclass(frozen=True, eq=False)
class Quantity:
    """A number, or one for each agent or constraint, that follows from the actions.

    Args:
        name: the variable's name in a trajectory; bounds are kept as NAME_bound and
            NAME_lower_bound.
        long_name: what it is, in the words of a figure's axis.
        unit: of the values.
        values: maps profiles (samples, m) to (samples, entries), or to (samples,) if it is one
            number.
        each: "agent" or "constraint", what the entries belong to; empty for one number.
        symbol: its formula in TeX, for figures; may be empty.
        bound: greatest allowed value, one number or (entries,); None if there is none.
        lower_bound: least allowed value likewise. Entries that have none of the bounds there are
            (not a number) are not there: their values are no numbers either.
        between: of distances between agents the two of each entry, from 0, shape (entries, 2); -1
            for entries that are none. They are drawn where the agents are.
        outline: corners of the part of the plane that the values say the use of, in order round it,
            in the action's unit, shape (K, 2).
        moves: of results, whether the bounds are those of the first sample, and change.

    Raises:
        InvalidInput: an ``each`` that is none, or pairs or corners of another shape.
    """

    name: str
    long_name: str
    unit: str
    values: Callable[[NDArray[np.float64]], ArrayLike]
    each: str = ""
    symbol: str = ""
    bound: ArrayLike | None = None
    lower_bound: ArrayLike | None = None
    between: ArrayLike | None = None
    outline: ArrayLike | None = None
    moves: bool = False

    def __post_init__(self) -> None:
        if self.each not in ("", "agent", "constraint"):
            raise InvalidInput("each", self.each, "it must be 'agent', 'constraint' or ''")
        for key in ("between", "outline"):
            given = getattr(self, key)
            if given is not None and (np.ndim(given) != 2 or np.shape(given)[1] != 2):
                raise InvalidInput(key, np.shape(given), "its shape must be (..., 2)")

    def there(self, entries: tuple[int, ...]) -> NDArray[np.bool_]:
        """Which entries there are, of shape ``entries``."""
        bounds = list(self.bounds(entries).values())
        unbounded = np.all(np.isnan(bounds), axis=0) if bounds else np.zeros(entries, dtype=bool)
        return np.logical_not(unbounded)

    @property
    def pairs(self) -> list[list[int]]:
        """The two agents that each entry is a distance between, from 0; without entries: none."""
        return [] if self.between is None else np.asarray(self.between, dtype=int).tolist()

    @property
    def corners(self) -> list[list[float]]:
        """Of its outline; without: none."""
        return [] if self.outline is None else np.asarray(self.outline, dtype=float).tolist()

    @np.errstate(over="ignore")  # what is beyond all floats is infinite
    def at(self, profiles: NDArray[np.float64], entries: tuple[int, ...]) -> NDArray[np.float64]:
        """The values at profiles (samples, m), of shape (samples, *entries).

        Raises:
            InvalidInput: the values come in another shape.
        """
        values = np.asarray(self.values(profiles), dtype=np.float64)
        if values.shape != (len(profiles), *entries):
            raise InvalidInput(
                "values",
                values.shape,
                f"its values at {len(profiles)} profiles must be {(len(profiles), *entries)}",
            )
        return values

    def bounds(self, entries: tuple[int, ...]) -> dict[str, NDArray[np.float64]]:
        """The bounds there are, by the variable's name, each of shape ``entries``.

        Raises:
            InvalidInput: a bound that is neither one number nor of that shape.
        """
        bounds = {}
        for key, value in (("bound", self.bound), ("lower_bound", self.lower_bound)):
            if value is None:
                continue
            array = np.asarray(value, dtype=np.float64)
            if array.shape not in ((), entries):
                raise InvalidInput(key, array.shape, f"it must be one number or {entries}")
            bounds[f"{self.name}_{key}"] = np.broadcast_to(array, entries).copy()
        return bounds
