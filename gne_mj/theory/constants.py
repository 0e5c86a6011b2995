"""The constants of [asmp:pseudo]: how monotone F is, and how fast it and **F** can change.

mu (y - y')'(F(y) - F(y')) >= mu |y - y'|^2, which is half of the mu of the paper's definition and
the mu of its conditions; |F(y) - F(y')| <= theta_1 |y - y'|; and theta_2 the same for the extended
pseudo-gradient **F**, in which each agent has a profile of its own.

On a convex set they follow from the values of dF/dy, row by row: the difference of two values of
an agent's gradient is the mean of its rows of dF/dy along the way times the difference of the
profiles, whichever profiles the other agents have.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from gne_mj.errors import UserCodeError
from gne_mj.game_model import Box, Game
from gne_mj.theory import spectra
from gne_mj.theory.monotonicity import Bound, least_eigenvalue

EXACT, BOUNDED, SAMPLED = "exact", "bounded", "sampled"

# Sampled points, and how much work their eigenvalues may be
SAMPLES = 200
_WORK = 1e10
# How far samples are looked for where no bounds of the actions are known
_FARTHEST = 1e6


@dataclass(frozen=True)
class Constant:
    """One constant and what it rests on.

    Attributes:
        value: of mu a lower bound, of a theta an upper one; if "sampled" the other way round, see
            :func:`told`; nan if nothing is known.
        label: "exact" (F affine: eigenvalues or singular values), "bounded" (rigorous bounds of
            dF/dy over a box, up to rounding) or "sampled" (never to be taken as certain).
        sampled: what samples showed, beside a bound: mu is at most this, theta at least this.
    """

    value: float
    label: str
    sampled: float | None = None

    @property
    def certified(self) -> bool:
        """Whether it may be relied on."""
        return self.label != SAMPLED


def told(name: str, label: str) -> str:
    """How a constant's value is to be read: "exact", "at least" or "at most".

    Samples miss the least mu and the greatest theta; rigorous bounds err on the other side.
    """
    if label == EXACT:
        return EXACT
    return "at most" if (name == "mu") == (label == SAMPLED) else "at least"


@dataclass(frozen=True, eq=False)
class Slopes:
    """What is known of dF/dy over a convex set.

    Args:
        game: whose F it is.
        box: (lower, upper), each (m,), the set; None where no bounds of the actions are known.
        center: a feasible profile (m,), from which samples are drawn.
        feasible: whether only feasible profiles matter, or all of the box.
    """

    game: Game
    box: Box | None
    center: NDArray[np.float64]
    feasible: bool

    @cached_property
    def rows(self) -> Box | None:
        """Two matrices (m, m) between whose rows those of dF/dy lie, the shorter ones first.

        The same one twice for an affine F; None if nothing of the kind is known.
        """
        if self._affine:
            here = self.game.pseudo_gradient_jacobian(self.center)
            return here, here
        if self._bounds is None or not self.game.row_scaled:
            return None
        lower, upper = self._bounds
        flipped = np.abs(lower) > np.abs(upper)
        return np.where(flipped, upper, lower), np.where(flipped, lower, upper)

    @cached_property
    def between(self) -> Bound | None:
        """What follows for mu from ``rows``."""
        return None if self.rows is None else least_eigenvalue(*self.rows)

    @property
    def label(self) -> str:
        """What the constants will be: "exact", "bounded" or "sampled"."""
        if self._affine:
            return EXACT
        return BOUNDED if self._bounds is not None else SAMPLED

    @cached_property
    def mu(self) -> Constant:
        """Strong monotonicity: the least eigenvalue of the symmetric part of dF/dy.

        From bounds of the entries alone: that of their centre less the spectral norm of their
        radius.
        """
        if self.between is not None:
            return self._constant(self.between.value, "mu")
        if self._bounds is None:
            return Constant(self.samples["mu"], SAMPLED)
        lower, upper = self._bounds
        radius = 0.5 * (upper - lower)
        value = _monotonicity(0.5 * (lower + upper)) - np.linalg.norm(_symmetric(radius), 2)
        return self._constant(float(value), "mu")

    @cached_property
    def theta_1(self) -> Constant:
        """Lipschitz constant of F: the greatest singular value of dF/dy."""
        if self._bounds is None and not self._affine:
            return Constant(self.samples["theta_1"], SAMPLED)
        return self._constant(spectra.norm(self._greatest), "theta_1")

    @cached_property
    def theta_2(self) -> Constant:
        """Lipschitz constant of **F**: the greatest singular value of one agent's rows."""
        if self._bounds is None and not self._affine:
            return Constant(self.samples["theta_2"], SAMPLED)
        return self._constant(float(np.max(_row_norms(self.game, self._greatest))), "theta_2")

    @cached_property
    def floor(self) -> float:
        """What may be rounding in mu: rounding itself and, of an affine F, how far dF/dy varies."""
        size = float(np.max(np.abs(self._greatest), initial=0.0))
        varies = 10.0 * self.game.actions * self._variation if self._affine else 0.0
        return max(1e-12 * size, varies)

    @property
    def monotone(self) -> bool:
        """Whether F is certainly strongly monotone over the set: mu > 0 beyond rounding."""
        if self.label == SAMPLED:
            return False
        return self.mu.value > self.floor

    @property
    def merely_monotone(self) -> bool:
        """Whether F is certainly monotone, and certainly neither strongly nor strictly so."""
        return self.label == EXACT and self.mu.value == 0.0

    @property
    def refuted(self) -> bool:
        """Whether F is certainly not monotone: a negative direction was met."""
        if self.label == EXACT:
            return self.mu.value < 0.0
        met = self.samples["mu"]
        return met < -1e-9 * self.samples["theta_1"]

    @cached_property
    def samples(self) -> dict[str, float]:
        """mu, theta_1 and theta_2 over sampled profiles only."""
        slopes = self._seen
        if not len(slopes):
            return {"mu": np.nan, "theta_1": np.nan, "theta_2": np.nan}
        return {
            "mu": float(_monotonicity(slopes).min()),
            "theta_1": float(np.linalg.norm(slopes, 2, axis=(1, 2)).max()),
            "theta_2": float(_row_norms(self.game, slopes).max()),
        }

    def _constant(self, value: float, name: str) -> Constant:
        if not self._affine:
            return Constant(value, self.label, self.samples[name])
        return Constant(0.0 if abs(value) <= self.floor else value, self.label)

    @cached_property
    def _seen(self) -> NDArray[np.float64]:
        """dF/dy at sampled profiles, where it is finite: (count, m, m)."""
        m = self.game.actions
        count = int(np.clip(_WORK / (50.0 * m**3), 2, SAMPLES))
        points = profiles(self.game, self.center, self.box, count, self.feasible)
        slopes = np.array([self._slope(y) for y in points])
        found: NDArray[np.float64] = slopes[np.all(np.isfinite(slopes), axis=(1, 2))]
        return found

    def _slope(self, y: NDArray[np.float64]) -> NDArray[np.float64]:
        """dF/dy (m, m); not numbers where a function fails at estimates outside the set."""
        try:
            return self.game.pseudo_gradient_jacobian(y)
        except UserCodeError:
            if self.feasible:
                raise
            return np.full((self.game.actions,) * 2, np.nan)

    @cached_property
    def _variation(self) -> float:
        """How much an entry of dF/dy varies between some profiles; 0 up to rounding if affine."""
        here = self.game.pseudo_gradient_jacobian(self.center)
        others = profiles(self.game, self.center, self.box, 3, self.feasible)
        away = 0.9 * (others - self.center)  # not to the boundary, where no step has room
        slopes = (self.game.pseudo_gradient_jacobian(self.center + way) for way in away)
        return max(float(np.max(np.abs(slope - here))) for slope in slopes)

    @cached_property
    def _affine(self) -> bool:
        """Whether F is affine, as the game states, and other profiles do not show otherwise."""
        if not self.game.affine:
            return False
        here = self.game.pseudo_gradient_jacobian(self.center)
        return self._variation <= 1e-6 * float(np.max(np.abs(here)))

    @cached_property
    def _bounds(self) -> Box | None:
        """The game's bounds of dF/dy, if they are finite and no sample lies beyond them."""
        if self.game.jacobian_bounds is None or self.box is None:
            return None
        lower, upper = self.game.jacobian_bounds(self.box)
        closer = self.game.feasible_jacobian_bounds
        if self.feasible and closer is not None:
            lower, upper = np.maximum(lower, closer[0]), np.minimum(upper, closer[1])
        if not np.all(np.isfinite(lower) & np.isfinite(upper)):
            return None
        slack = 1e-9 * np.maximum(np.abs(lower), np.abs(upper))
        within = np.all((self._seen >= lower - slack) & (self._seen <= upper + slack))
        return (lower, upper) if within else None

    @property
    def _greatest(self) -> NDArray[np.float64]:
        """A matrix at which norms of all rows together, and of some, are greatest."""
        if self.rows is not None:
            return self.rows[1]
        assert self._bounds is not None
        return np.maximum(np.abs(self._bounds[0]), np.abs(self._bounds[1]))


def profiles(
    game: Game, center: NDArray[np.float64], box: Box | None, count: int, feasible: bool
) -> NDArray[np.float64]:
    """Profiles to sample (count, m), always the same ones, the last of them ``center``.

    Some corners of the box and uniform ones in it. If only feasible ones are asked for (or there
    is no box): from the center in those (or random) directions, half of them all the way to the
    boundary and half a random part of it.
    """
    rng = np.random.default_rng(0)
    m = game.actions
    if box is not None:
        ends = rng.uniform(box[0], box[1], (count, m))
        corners = np.where(np.eye(m, dtype=bool), box[1], box[0])[: count // 2]
        ends[: len(corners)] = corners
    else:
        ends = center + _FARTHEST * rng.normal(size=(count, m)) / np.sqrt(m)
    ends[-1] = center
    if box is not None and not feasible:
        return ends
    inside, outside = np.zeros(count), np.ones(count)
    for _ in range(60):
        middle = 0.5 * (inside + outside)
        trial = center + middle[:, None] * (ends - center)
        good = np.all(game.constraints(trial) < 0.0, axis=1)
        inside, outside = np.where(good, middle, inside), np.where(good, outside, middle)
    ways = np.where(np.arange(count) % 2, rng.uniform(size=count), 1.0) * inside
    found = center + ways[:, None] * (ends - center)
    # In a set that is not convex a part of the way can be outside where its end is not
    good = np.all(game.constraints(found) < 0.0, axis=1)
    return np.where(good[:, None], found, center + inside[:, None] * (ends - center))


def _symmetric(slopes: NDArray[np.float64]) -> NDArray[np.float64]:
    return 0.5 * (slopes + np.swapaxes(slopes, -1, -2))


def _monotonicity(slopes: NDArray[np.float64]) -> NDArray[np.floating]:
    """Least eigenvalue of the symmetric part of each matrix (..., m, m)."""
    return np.linalg.eigvalsh(_symmetric(slopes))[..., 0]


def _row_norms(game: Game, slopes: NDArray[np.float64]) -> NDArray[np.floating]:
    """Greatest singular value of each agent's rows of each matrix (..., m, m): (..., N)."""
    if all(size == 1 for size in game.sizes):
        return np.linalg.norm(slopes, axis=-1)
    at = game.data.offsets
    blocks = [slopes[..., at[i] : at[i + 1], :] for i in range(game.agents)]
    return np.stack([np.linalg.norm(block, 2, axis=(-2, -1)) for block in blocks], axis=-1)
