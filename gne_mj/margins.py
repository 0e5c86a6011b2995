"""How far to stay from the bounds so that pushes, noise and delay cannot carry agents across.

In mode implicit the outputs expected at the next control instant are strictly inside whatever the
state is. What really is reached differs from them by what the prediction does not know: pushes
since the measured state, and the error of the measured output. Both act through the plant's
discrete map. With |dx(k+1)| <= A |dx(k)| + b |push|, A and b bounding the absolute values of the
map's derivatives over all states, the outputs differ by at most ``push_gain * push + noise_gain *
noise``; a barrier of g + t < 0 with t at least what such a difference can add to g then keeps
g < 0 at every control instant.
"""

from dataclasses import dataclass
from types import ModuleType

import numpy as np
from numpy.typing import NDArray

from gne_mj.bounds import MOST_HELD, check_count
from gne_mj.errors import InvalidInput, named
from gne_mj.game_model import Game
from gne_mj.plants.agent_type import by_type, has_ode
from gne_mj.plants.agents import Agents, input_columns

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Disturbance:
    """Bounds on what is not modelled.

    Args:
        push: greatest force on each channel besides its input, (m,), in the input's unit.
        noise: greatest error of each output that is read, (m,).
        delay: by how many control periods sensors are late.
        change: the most that a push changes within a control period, (m,), where an observer
            follows it (:mod:`gne_mj.load_margins`); ``push`` is then what is not known of it at the
            start.
    """

    push: Array
    noise: Array
    delay: int = 0
    change: Array | None = None

    def __post_init__(self) -> None:
        for key in ("push", "noise") + (() if self.change is None else ("change",)):
            value = np.asarray(getattr(self, key), dtype=np.float64)
            if np.any(value < 0) or not np.all(np.isfinite(value)):
                raise InvalidInput(key, value, "it must be finite and not negative")
        if self.delay < 0:
            raise InvalidInput("delay", self.delay, "it must not be negative")


@dataclass(frozen=True, eq=False)
class Influence:
    """What disturbances, and inputs, do to the outputs at the next control instant.

    Attributes:
        push_gain, noise_gain: (m,) bounds of |dy+| for a push of at most 1 and a reading that is
            wrong by at most 1.
        least_slope: (m,) lower bound of dy+/du over all states, of one control period.
        exact: whether the slopes are exact, since the agents are linear.
    """

    push_gain: Array
    noise_gain: Array
    least_slope: Array
    exact: bool

    def of(self, disturbance: Disturbance) -> Array:
        """Bounds of |y - predicted y| at a control instant, shape (m,)."""
        return self.push_gain * disturbance.push + self.noise_gain * disturbance.noise


@np.errstate(over="ignore", invalid="ignore")  # what is not finite no margin covers
def influence(
    agents: Agents, timestep: float, integrator: str, period: int, delay: int = 0
) -> Influence:
    """Bounds for a control period of so many steps, predicted from a state ``delay`` periods old.

    Args:
        agents: known as ODEs.
        timestep: in s.
        integrator: "euler" or "rk4".
        period: steps in a control period.
        delay: in control periods.

    Of MJCF robots the map's derivatives are not known. What they change by over a period is added
    to what is read of them, errors and all; pushes are then those whose unit moves an output by
    one, as an observer counts them.
    """
    if not has_ode(agents.kind):
        one = np.ones(agents.channels)
        return Influence(one, one, one, exact=False)
    check_count("period", period * (delay + 1), MOST_HELD, "the timesteps looked ahead over")
    gains = np.zeros((3, agents.channels))
    known: dict[bytes, tuple[float, float, float]] = {}
    exact = True
    for r, row in enumerate(agents.parameters):
        key = row.tobytes()
        if key not in known:
            ((kind, own),) = by_type(agents.kind, row[None])
            channel = _Channel(kind, own[0], timestep, integrator)
            exact = exact and channel.linear
            # Sensors may be less late than they may be, and errors fade on their way.
            each = [channel.gains(period * (late + 1)) for late in range(delay + 1)]
            known[key] = (*np.max(each, axis=0), channel.least_slope(period))
        gains[:, r] = known[key]
    return Influence(gains[0], gains[1], gains[2], exact)


def errors_ahead(
    agents: Agents, timestep: float, integrator: str, period: int, disturbance: Disturbance
) -> Array:
    """Bounds of |y - predicted y| (period, m) at the end of each step of a control period.

    Of a state that is known at its start, but for the reading's error.
    """
    found = np.zeros((period, agents.channels))
    known: dict[bytes, tuple[Array, Array]] = {}
    for r, row in enumerate(agents.parameters):
        key = row.tobytes()
        if key not in known:
            ((kind, own),) = by_type(agents.kind, row[None])
            known[key] = _Channel(kind, own[0], timestep, integrator).gains_ahead(period)
        pushed, read = known[key]
        found[:, r] = pushed * disturbance.push[r] + read * disturbance.noise[r]
    return found


def tightening(game: Game, error: Array) -> Array:
    """How much a difference of outputs of at most ``error`` (m,) can add to g, shape (p,).

    Exact for affine constraints; for bounds on gaps, |gap|^2 <= delta^2 with any affine gap, t is
    such that |gap|^2 <= delta^2 - t leaves room for the greatest change of the gap.

    Raises:
        InvalidInput: constraints of another form, or an error as great as a bound on a gap.
    """
    y = np.zeros(game.actions) if game.box is None else 0.5 * (game.box[0] + game.box[1])
    bent = game.gap_bounds is not None or (
        game.constraint_class == "quadratic" and game.has_constraint_hessian
    )
    if not bent and not is_affine(game, y):
        raise _other_form(game)
    slopes = game.constraint_jacobian(y)
    t = np.abs(slopes) @ error
    for k in range(game.constraints_count if bent else 0):
        start, actions = game.actions_in_constraints
        own = actions[start[k] : start[k + 1]]
        form = 0.5 * game.constraint_hessian(k, y)
        if np.any(form):
            change = float(np.sqrt(error[own] @ np.abs(form) @ error[own]))
            t[k] = _room(game, k, change, _gap_bound(game, k, y, slopes[k, own], form))
    return t


def _room(game: Game, constraint: int, change: float, bound: float) -> float:
    """By how much delta^2 must be less for a gap that changes by ``change``."""
    if change >= bound:
        raise InvalidInput(
            "error",
            f"{change:.4g} of '{game.constraint_names[constraint]}'",
            f"disturbances could use up all of the bound, {bound:g}; a shorter control"
            " period or smaller disturbances leave room",
        )
    return 2.0 * bound * change - change**2


def _gap_bound(game: Game, constraint: int, y: Array, slope: Array, form: Array) -> float:
    """delta of a quadratic constraint: where the gap vanishes g is least, and -delta^2.

    Args:
        game: whose.
        constraint: its number.
        y: (m,) where slope and form, half of the second derivatives, were taken.
        slope, form: in the actions of the constraint's own agents.
    """
    if game.gap_bounds is not None:
        return float(game.gap_bounds[constraint])
    away = -0.5 * np.linalg.pinv(form, hermitian=True) @ slope
    least = game.constraints(y)[constraint] + 0.5 * slope @ away
    slanted = np.max(np.abs(slope + 2.0 * form @ away)) > 1e-9 * np.max(np.abs(slope), initial=1.0)
    if slanted or not least < 0.0:  # it goes on for ever somewhere, or is never kept
        raise _other_form(game)
    return float(np.sqrt(-least))


def _other_form(game: Game) -> InvalidInput:
    return InvalidInput(
        "game", game.name, "margins are computed for affine constraints and bounds on gaps"
    )


def is_affine(game: Game, y: Array) -> bool:
    """Whether each constraint's second derivative vanishes at y (m,) and around it."""
    rng = np.random.default_rng(0)
    size = 1.0 + np.abs(y)
    points = [y, *(y + size * rng.normal(size=len(y)) for _ in range(5))]
    weights = rng.uniform(0.5, 1.5, (3, game.constraints_count))  # no two of them cancel alike
    return not any(
        np.any(game.weighted_constraint_hessian(point, each))
        for point in points
        for each in weights
    )


def with_margin(
    game: Game,
    agents: Agents,
    disturbance: Disturbance,
    timestep: float,
    integrator: str,
    period: int,
    guarded: bool = False,
) -> Game:
    """The game with a barrier that leaves room for such disturbances, and for no others.

    Where periods may end early (``guarded``), for what they can do over any shorter one too.

    Raises:
        InvalidInput: as :func:`influence` and :func:`tightening`.
    """
    with named(error="disturbance"):
        error = influence(agents, timestep, integrator, period, disturbance.delay).of(disturbance)
        if guarded:
            ahead = errors_ahead(agents, timestep, integrator, period, disturbance)
            error = np.maximum(error, np.max(ahead, axis=0))
        return game.tightened(tightening(game, error))


def of_the_set(game: Game) -> Game:
    """The game with a barrier of g < 0 itself, whatever keeps farther away from it."""
    return game.tightened(0.0) if np.any(game.margins) else game


def largest_push(game: Game, effect: Influence, disturbance: Disturbance, t: Array) -> float:
    """The greatest push, the same on all channels, that a tightening t (p,) covers; 0 if none.

    Noise and delay are those of ``disturbance``.
    """

    def covered(push: float) -> bool:
        error = effect.of(Disturbance(np.full(game.actions, push), disturbance.noise))
        try:
            return bool(np.all(tightening(game, error) <= t * (1.0 + 1e-12)))
        except InvalidInput:
            return False

    if not np.all(t > 0) or not covered(0.0):
        return 0.0
    low, high = 0.0, 1e-6
    while covered(high) and high < 1e300:
        low, high = high, 4.0 * high
    for _ in range(60):
        middle = 0.5 * (low + high)
        if covered(middle):
            low = middle
        else:
            high = middle
    return low


class _Channel:
    """Bounds of one channel's discrete map dx(k+1) = A dx(k) + b du over all states."""

    def __init__(self, kind: ModuleType, q: Array, h: float, integrator: str) -> None:
        self._output, n = kind.OUTPUT, len(kind.STATES)
        column = input_columns(kind, q[None])[0]
        slopes = []
        # A spring's slope lies between those at rest and far out, and the map is affine in it.
        for x in (np.zeros(n), np.full(n, np.inf)):
            slope = np.zeros((n, n))
            kind.jacobian(q, x, slope)
            slopes.append(slope)
        self.linear = bool(np.array_equal(slopes[0], slopes[1]))
        positions = list(getattr(kind, "POSITIONS", ()))
        if integrator == "euler" and hasattr(kind, "physical"):
            steps = _turned_steps(kind.physical(q), slopes, column, h, positions)
        else:
            steps = [_step(slope, column, h, integrator, positions) for slope in slopes]
        self._exact = steps[0]
        if integrator == "rk4" and not self.linear:
            # Stages with slopes of their own: absolute values bound every mixture of them.
            steps = [_step(np.abs(slope), np.abs(column), h, "rk4", []) for slope in slopes]
        identity = np.eye(n)
        self._a = np.max([np.abs(a) for a, _ in steps], axis=0)
        self._change = np.max([np.abs(a - identity) for a, _ in steps], axis=0)
        self._b = np.max([np.abs(b) for _, b in steps], axis=0)
        # what the input alone does in a step: of Euler's, in which no spring acts on it, exactly
        self._free = h * column[self._output]
        if integrator == "euler":
            self._free = self._exact[1][self._output]

    def gains(self, steps: int) -> tuple[float, float]:
        """Bounds of |dy| for pushes of at most 1, and for an output that is read wrong by 1."""
        pushed, read = self.gains_ahead(steps)
        return float(pushed[-1]), float(read[-1])

    def gains_ahead(self, steps: int) -> tuple[Array, Array]:
        """The same after each of so many steps, (steps,) both."""
        pushed, read = np.zeros_like(self._b), np.zeros_like(self._b)
        read[self._output] = 1.0
        found = np.zeros((2, steps))
        if self.linear:
            a, b = self._exact
            response = b
            for step in range(steps):
                pushed = pushed + np.abs(response)
                response, read = a @ response, a @ read
                found[:, step] = pushed[self._output], abs(read[self._output])
            return found[0], found[1]
        for step in range(steps):
            pushed, read = self._a @ pushed + self._b, self._a @ read
            found[:, step] = pushed[self._output], read[self._output]
        return found[0], found[1]

    def least_slope(self, steps: int) -> float:
        """A lower bound of dy/du for an input held so long: exact where the map is linear.

        What the input alone does, h G a step, less the most that all else can take away again.
        """
        if self.linear:
            a, b = self._exact
            x = np.zeros_like(b)
            for _ in range(steps):
                x = a @ x + b
            return float(x[self._output])
        size, taken = np.zeros_like(self._b), 0.0
        for _ in range(steps):
            taken += float(self._change[self._output] @ size)
            size = self._a @ size + self._b
        return float(steps * (2.0 * self._free - self._b[self._output]) - taken)


def _turned_steps(
    physical: Array, slopes: list[Array], column: Array, h: float, positions: list[int]
) -> list[tuple[Array, Array]]:
    """Euler's, in the states, where it is semi-implicit in others that ``physical`` leads from."""
    back, found = np.linalg.inv(physical), []
    for slope in slopes:
        a, b = _step(back @ slope @ physical, back @ column, h, "euler", positions)
        found.append((physical @ a @ back, physical @ b))
    return found


def _step(
    slope: Array, column: Array, h: float, integrator: str, positions: list[int]
) -> tuple[Array, Array]:
    """One integration step's derivatives to state and input, where x' has ``slope``, ``column``."""
    identity = np.eye(len(slope))
    if integrator == "rk4":
        z = h * slope
        second = z @ z
        a = identity + z + second / 2.0 + second @ z / 6.0 + second @ second / 24.0
        b = h * (identity + z / 2.0 + second / 6.0 + second @ z / 24.0) @ column
        return a, b
    a, b = identity + h * slope, h * column
    # Semi-implicit: positions move by the new velocities.
    a[positions] = identity[positions] + h * slope[positions] @ a
    b[positions] = h * slope[positions] @ b
    return a, b
