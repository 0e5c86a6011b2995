"""The paper's closed loops as stiff differential equations, for the campaigns to compare with.

Written from the paper's equations with NumPy and SciPy alone, as tests/reference.py is, whose slow
versions tests hold it to; of the product nothing is used. Flat states are the channels' states one
after the other, then (partial and distributed information) N rows of estimates whose own entries
rest and are never read, then (distributed) z. Positions, on which nothing depends, are left out.
"""

import itertools
import warnings
from dataclasses import dataclass, field

import numpy as np
from scipy.integrate import LSODA, Radau

ROBOT, INTEGRATOR, CASCADE = "robot", "integrator", "cascade"
STATES = {ROBOT: 3, INTEGRATOR: 1, CASCADE: 2}
OUTPUT = {ROBOT: 1, INTEGRATOR: 0, CASCADE: 0}
# What a rate is where the law has none: so great that no step of the solver is taken there
OUTSIDE = 1e30
SMALLEST = 1e-12  # step, of the time that has passed, at which a solution ends


@dataclass
class Affine:
    """dJ_i/dy_a = A_a y + b_a."""

    slope: np.ndarray
    offset: np.ndarray

    def value(self, rows):
        """F_a at row a of ``rows`` (m, m): (m,)."""
        return np.einsum("ab,ab->a", self.slope, rows) + self.offset

    def slopes(self, rows):
        """dF_a/dy at row a: (m, m)."""
        return self.slope


@dataclass
class Osnr:
    """dJ_i/dy_i = a_i - b_i c_i / (n0_i + sum_{j != i} Gamma_ij y_j + c_i y_i) [eq:osnrGNE]."""

    price: np.ndarray
    weight: np.ndarray
    gain: np.ndarray
    noise: np.ndarray
    matrix: np.ndarray  # Gamma, zero on the diagonal

    def _received(self, rows):
        return self.noise + np.einsum("ab,ab->a", self.matrix + np.diag(self.gain), rows)

    def value(self, rows):
        """As of :class:`Affine`."""
        return self.price - self.weight * self.gain / self._received(rows)

    def slopes(self, rows):
        """As of :class:`Affine`."""
        factor = self.weight * self.gain / self._received(rows) ** 2
        return factor[:, None] * (self.matrix + np.diag(self.gain))


@dataclass
class Game:
    """A game: F, lines C y < d, and discs |B_l y - r_l| < delta_l, whose g is in squares.

    Attributes:
        owner: (m,) the agent of each action.
        pull: F.
        line, bound: C (lines, m), d (lines,); first among the constraints if any.
        disc, center, radius: B (discs, k, m), r (discs, k), delta (discs,).
        sign: -1 for all that is outside of a disc, (discs,) or one for all.
    """

    owner: np.ndarray
    pull: Affine | Osnr
    line: np.ndarray
    bound: np.ndarray
    disc: np.ndarray
    center: np.ndarray
    radius: np.ndarray
    sign: np.ndarray | float = 1.0

    @property
    def _signed(self):
        return np.broadcast_to(self.sign, self.radius.shape)[:, None, None] * self.disc

    def slacks(self, rows):
        """-g at profiles (n, m): (n, p)."""
        away = np.einsum("lka,na->nlk", self.disc, rows) - self.center
        length = np.sqrt(np.sum(away**2, axis=2))
        of_discs = self.sign * (self.radius - length) * (self.radius + length)
        return np.concatenate([self.bound - rows @ self.line.T, of_discs], axis=1)

    def slopes(self, rows):
        """dg/dy at profiles (n, m): (n, p, m)."""
        away = np.einsum("lka,na->nlk", self.disc, rows) - self.center
        of_discs = 2.0 * np.einsum("lka,nlk->nla", self._signed, away)
        lines = np.broadcast_to(self.line, (len(rows), *self.line.shape))
        return np.concatenate([lines, of_discs], axis=1)

    def barrier_gradient(self, rows, rho):
        """dphi/dy at profiles (n, m): (n, m)."""
        return np.einsum("np,npa->na", rho / self.slacks(rows), self.slopes(rows))

    def barrier_hessian(self, rows, rho):
        """d2phi/dy2 at profiles (n, m): (n, m, m)."""
        slack, slope = self.slacks(rows), self.slopes(rows)
        scaled = slope * (np.sqrt(rho) / slack)[:, :, None]
        curved = np.einsum("lka,lkb->lab", self._signed, self.disc)
        weight = 2.0 * rho / slack[:, len(self.bound) :]
        return np.einsum("npa,npb->nab", scaled, scaled) + np.einsum("nl,lab->nab", weight, curved)

    def members(self):
        """Whether agent i is in constraint l: (N, p)."""
        forms = np.concatenate([self.line != 0, np.any(self.disc != 0, axis=1)])
        agents = self.owner[-1] + 1
        return np.array([np.any(forms[:, self.owner == i], axis=1) for i in range(agents)])


@dataclass
class Law:
    """One of the three laws; what a law does not have is not read."""

    information: str  # "full", "partial" or "distributed"
    laplacian: np.ndarray = field(default_factory=lambda: np.zeros((0, 0)))
    coupling: float = 1.0  # c
    time_constant: float = 1.0  # tau, s
    gain: float = 1.0  # k
    epsilon: float = 1.0  # s


class Loop:
    """Channels of known types under one law.

    Args:
        game: the game.
        law: the law.
        rho: the penalty.
        channels: of each action its agent's type and numbers: (M, m, stiffness, atan coefficient,
            damping) of robots, (v, k) of PI cascades, () of integrators.
    """

    def __init__(self, game, law, rho, channels):
        self.game, self.law, self.rho = game, law, rho
        kinds = [kind for kind, _ in channels]
        at = np.concatenate([[0], np.cumsum([STATES[kind] for kind in kinds])])
        self.output = np.array([a + OUTPUT[kind] for a, kind in zip(at, kinds, strict=False)])
        m, agents = len(kinds), int(game.owner[-1]) + 1
        self.m, self.agents, self.size = m, agents, int(at[-1])
        self._robots = np.array([a for a, k in zip(at, kinds, strict=False) if k == ROBOT], int)
        self._cascades = np.array([a for a, k in zip(at, kinds, strict=False) if k == CASCADE], int)
        self._robot = np.array([q for k, q in channels if k == ROBOT], float).reshape(-1, 5).T
        self._cascade = np.array([q for k, q in channels if k == CASCADE], float).reshape(-1, 2).T
        self.length = self.size
        if law.information != "full":
            # Where in the flat state each entry of each agent's profile stands
            self._own = game.owner[None, :] == np.arange(agents)[:, None]
            estimate = self.size + np.arange(agents * m).reshape(agents, m)
            self._profile = np.where(self._own, self.output, estimate)
            self._estimate = slice(self.size, self.size + agents * m)
            self.length += agents * m
        if law.information == "distributed":
            self._z = slice(self.length, self.length + m)
            self._filtered = np.where(self._own, self.length + np.arange(m), self._profile)
            self.length += m
            self._members = game.members()
        self._inputs = self._input_columns(at, kinds)

    def _input_columns(self, at, kinds):
        columns = np.zeros((self.length, self.m))
        columns[self.output, np.arange(self.m)] = 1.0
        columns[self._robots + 1, np.searchsorted(at[:-1], self._robots)] = 1.0 / self._robot[0]
        columns[self._cascades + 1, np.searchsorted(at[:-1], self._cascades)] = 1.0
        return columns

    def pack(self, states, estimates=None, filtered=None):
        """The flat state from the channels' states (a row each, of its type), and the law's."""
        parts = [np.concatenate([np.asarray(row, float) for row in states])]
        if estimates is not None:
            parts.append(np.asarray(estimates, float).ravel())
        if filtered is not None:
            parts.append(np.asarray(filtered, float))
        return np.concatenate(parts)

    def input(self, x):
        """u (m,), not a number where the law has none."""
        y, law, game = x[self.output], self.law, self.game
        if law.information != "distributed":
            if not np.all(game.slacks(y[None]) > 0):
                return np.full(self.m, np.nan)
            barrier = game.barrier_gradient(y[None], self.rho)[0]
            if law.information == "full":
                return -game.pull.value(np.broadcast_to(y, (self.m, self.m))) - barrier
            rows = x[self._profile]
            heard = (law.laplacian @ rows)[game.owner, np.arange(self.m)]
            return -game.pull.value(rows[game.owner]) - barrier - law.coupling * heard
        rows, guarded = x[self._profile], x[self._filtered]
        if not np.all((game.slacks(guarded) > 0) | ~self._members):
            return np.full(self.m, np.nan)
        if not np.all(game.slacks(y[None]) > 0):
            return np.full(self.m, np.nan)
        barrier = game.barrier_gradient(guarded, self.rho)[game.owner, np.arange(self.m)]
        return -law.gain * (game.pull.value(rows[game.owner]) + barrier)

    def rate(self, _time, x):
        """The flat state's rate, :data:`OUTSIDE` where there is none."""
        with np.errstate(all="ignore"):
            u = self.input(x)
            if not np.all(np.isfinite(u)):
                return np.full(len(x), OUTSIDE)
            rate = self._inputs @ u
            r, (mass, small, stiffness, atan, damping) = self._robots, self._robot
            link = stiffness * x[r] + atan * np.arctan(x[r]) + damping * (x[r + 1] - x[r + 2])
            rate[r] = x[r + 1] - x[r + 2]
            rate[r + 1] -= link / mass
            rate[r + 2] = link / small
            c, (v, k) = self._cascades, self._cascade
            rate[c] += -v * x[c] + k * x[c + 1]
            law = self.law
            if law.information != "full":
                moves = -self._speed * (law.laplacian @ x[self._profile])
                rate[self._estimate] = np.where(self._own, 0.0, moves).ravel()
            if law.information == "distributed":
                rate[self._z] = (x[self.output] - x[self._z]) / law.epsilon
            return rate

    @property
    def _speed(self):
        law = self.law
        partial = law.information == "partial"
        return law.coupling / law.time_constant if partial else 1.0 / law.epsilon

    def jacobian(self, _time, x):
        """d rate / dx."""
        law, game, m = self.law, self.game, self.m
        at, owner = np.arange(m), game.owner
        du = np.zeros((m, len(x)))
        y = x[self.output]
        if law.information == "full":
            slopes = game.pull.slopes(np.broadcast_to(y, (m, m)))
            du[:, self.output] = -slopes - game.barrier_hessian(y[None], self.rho)[0]
        else:
            rows = x[self._profile]
            where = self._profile[owner]
            np.add.at(du, (at[:, None], where), -game.pull.slopes(rows[owner]))
        if law.information == "partial":
            du[:, self.output] -= game.barrier_hessian(y[None], self.rho)[0]
            weights = -law.coupling * law.laplacian[owner]  # (m, N)
            np.add.at(du, (at[:, None], self._profile[:, at].T), weights)
        if law.information == "distributed":
            bends = game.barrier_hessian(x[self._filtered], self.rho)[owner, at]
            np.add.at(du, (at[:, None], self._filtered[owner]), -bends)
            du *= law.gain
        slope = self._inputs @ du
        r, (mass, small, stiffness, atan, damping) = self._robots, self._robot
        stiff = stiffness + atan / (1.0 + x[r] ** 2)
        for column, link in ((0, stiff), (1, damping), (2, -damping)):
            slope[r + 1, r + column] -= link / mass
            slope[r + 2, r + column] += link / small
        slope[r, r + 1] += 1.0
        slope[r, r + 2] -= 1.0
        c, (v, k) = self._cascades, self._cascade
        slope[c, c] -= v
        slope[c, c + 1] += k
        if law.information != "full":
            for i in range(self.agents):
                others = np.flatnonzero(~self._own[i])
                into = self.size + i * m + others
                for j in np.flatnonzero(law.laplacian[i]):
                    value = -self._speed * law.laplacian[i, j]
                    slope[into, self._profile[j, others]] += value
        if law.information == "distributed":
            slope[np.arange(self._z.start, self._z.stop), self.output] += 1.0 / law.epsilon
            slope[self._z, self._z] -= np.eye(m) / law.epsilon
        return slope


def follow(loop, x, times, rtol):
    """SciPy's LSODA from times[0] through all times: outputs (reached, m), one row a time.

    Fewer rows come back if its step becomes too small, as where the law's domain ends.
    """
    rows = [x[loop.output]]
    if not times[-1] > times[0]:
        return np.array(rows)
    with warnings.catch_warnings(), np.errstate(all="ignore"):
        warnings.simplefilter("ignore")  # it says in a warning what its status says, too
        solver = LSODA(
            loop.rate, times[0], x, times[-1], rtol=rtol, atol=0.01 * rtol, jac=loop.jacobian,
            first_step=min(_first_step(loop, x), times[-1] - times[0]),
        )  # fmt: skip
        while solver.status == "running":
            solver.step()
            if solver.status == "failed" or solver.step_size < SMALLEST * solver.t:
                break
            passed = times[len(rows) : np.searchsorted(times, solver.t, side="right")]
            if len(passed):
                rows += list(solver.dense_output()(passed).T[:, loop.output])
    return np.array(rows)


def follow_by_radau(loop, x, times, rtol):
    """The same by Radau's method, some five times slower.

    Restarted at each time, so that no row is interpolated (the dense output is of lower order).
    """
    rows, step = [x[loop.output]], _first_step(loop, x)
    for start, end in itertools.pairwise(times):
        solver = Radau(
            loop.rate, start, x, end, rtol=rtol, atol=0.01 * rtol, jac=loop.jacobian,
            first_step=min(step, end - start),
        )  # fmt: skip
        while solver.status == "running":
            step = solver.h_abs
            solver.step()
        if solver.status == "failed":
            break
        step, x = max(step, solver.h_abs), solver.y
        rows.append(x[loop.output])
    return np.array(rows)


def _first_step(loop, x):
    fastest = float(np.max(np.sum(np.abs(loop.jacobian(0.0, x)), axis=1)))
    return 1e-3 / max(1.0, fastest)
