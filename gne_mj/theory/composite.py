"""Up to which epsilon W = V + omega V_fast falls on an invariant set.

V is the agents' storage and V_fast half the squared errors of estimates and z. On S the law is
linear in e = x - x* and the errors xi, with unknown factors between known ends: dF/dy along the way
from y* to what an agent takes the profile to be, rho/(s_l s_l*) of each barrier at the actions, and
rho/(s_l s) where an agent takes the slack s_l for s. -W' is a quadratic form with them; a product
t x y of an unknown t in [0, 1] and two linear functions of (e, xi) is at least

    t x y >= -(sqrt(sigma) x - y / sqrt(sigma))^2 / 4        for every sigma > 0,

so that what is left is one matrix M + Q / epsilon with Q >= 0 on xi alone. It is positive definite
for all epsilon below omega / lambda_max of a matrix: the linear case of alpha_1 alpha_2 / (alpha_1
gamma + beta_1 beta_2) of the theory of singular perturbations.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from gne_mj.theory.fast_errors import Lags
from gne_mj.theory.invariant_set import InvariantSet
from gne_mj.theory.linear_loop import LinearLoop

Array = NDArray[np.float64]

# Trials for how the barrier's unknown factors are split, as a share of F's own slopes
_LEAST, _MOST, _TRIALS = -6.0, 3.0, 14
_ROUNDING = 1e-9


class Products(NamedTuple):
    """Products t x y with lower <= t <= upper: x and y linear in (e, xi), one a row."""

    x: Array
    y: Array
    lower: Array
    upper: Array
    sigma: Array

    @property
    def form(self) -> Array:
        """A quadratic form below the sum of all products."""
        middle = self.x.T @ (self.lower[:, None] * self.y)
        unknown = (self.upper > self.lower) & np.any(self.y != 0.0, axis=1)
        x, y, root = self.x[unknown], self.y[unknown], np.sqrt(self.sigma[unknown])[:, None]
        range_ = np.sqrt(self.upper - self.lower)[unknown, None]
        part = 0.5 * range_ * (root * x - y / root)
        return 0.5 * (middle + middle.T) - part.T @ part


class Composite:
    """The form -W' on S.

    Args:
        loop, lags: the loop.
        held: S.
        weight: omega.
    """

    def __init__(self, loop: LinearLoop, lags: Lags, held: InvariantSet, weight: float) -> None:
        self._loop, self._held, self._weight = loop, held, weight
        m, states = loop.drift.shape
        agents = loop.game.agents
        self._slow = m * states
        self._size = self._slow + agents * m
        self._error = np.arange(agents * m).reshape(agents, m) + self._slow
        self._fast = np.zeros((agents * m,) * 2)
        for a, owner in enumerate(loop.owner):
            others = self._error[np.arange(agents) != owner, a] - self._slow
            self._fast[np.ix_(others, others)] = lags.grounded(owner)
            own = self._error[owner, a] - self._slow
            self._fast[own, own] = 1.0
        values, basis = np.linalg.eigh(self._fast)
        self._root = (basis / np.sqrt(values)) @ basis.T  # Q^(-1/2), less omega

    def largest_epsilon(self) -> float:
        """W' < 0 on S, but at the equilibrium, for all epsilon below this; 0 if for none."""
        found, low, high = 0.0, _LEAST, _MOST
        ratio = 0.5 * (np.sqrt(5.0) - 1.0)
        inner = [high - ratio * (high - low), low + ratio * (high - low)]
        values = [self.epsilon_for(np.exp(each)) for each in inner]
        for _ in range(_TRIALS):
            found = max(found, *values)
            if values[0] >= values[1]:
                high, inner = inner[1], [inner[1] - ratio * (inner[1] - low), inner[0]]
                values = [self.epsilon_for(np.exp(inner[0])), values[0]]
            else:
                low, inner = inner[0], [inner[1], inner[0] + ratio * (high - inner[0])]
                values = [values[1], self.epsilon_for(np.exp(inner[1]))]
        return max(found, *values)

    def epsilon_for(self, share: float) -> float:
        """The same with the barrier's factors split by this share of F's own slopes."""
        form = self.form(share)
        if form is None:
            return 0.0
        slow = slice(0, self._slow)
        size = np.sqrt(np.abs(np.diag(form)[slow]))
        if not np.all(size > 0.0):
            return 0.0
        scaled = form[slow, slow] / np.outer(size, size)
        if np.linalg.eigvalsh(scaled)[0] <= _ROUNDING:
            return 0.0
        fast = slice(self._slow, self._size)
        cross = form[slow, fast]
        needed = cross.T @ np.linalg.solve(form[slow, slow], cross) - form[fast, fast]
        greatest = float(np.linalg.eigvalsh(self._root @ needed @ self._root)[-1])
        return self._weight / greatest * (1.0 - _ROUNDING) if greatest > 0.0 else np.inf

    def form(self, share: float) -> Array | None:
        """M: -W' >= (e, xi)'M(e, xi) + weight xi'Qxi / epsilon; None without bounds of dF/dy."""
        loop, k = self._loop, self._loop.gain
        m, states = loop.drift.shape
        found = np.zeros((self._size,) * 2)
        deviation = np.eye(self._size)[: self._slow].reshape(m, states, self._size)
        pulled = np.zeros((m, self._size))  # sum of all errors about an action
        np.put_along_axis(pulled, self._error.T, 1.0, axis=1)
        for a in range(m):
            at = slice(a * states, (a + 1) * states)
            found[at, at] += loop.dissipation[a]
        drift = np.einsum("ms,msn->mn", loop.drift, deviation)
        cross = self._weight * pulled.T @ drift
        found += 0.5 * (cross + cross.T)
        action = deviation[:, loop.output]
        acting = action - self._weight * pulled
        costs = self._costs(action, acting)
        if costs is None:
            return None
        for products in (*costs, *self._barriers(action, acting, share * costs[0].sigma)):
            scaled = products._replace(lower=k * products.lower, upper=k * products.upper)
            found += scaled.form
        return found

    def _costs(self, action: Array, acting: Array) -> tuple[Products, Products] | None:
        """F's differences from y*: by the shorter rows, and by what longer ones have more.

        sigma is each row's slope in its own action.
        """
        loop, held = self._loop, self._held
        lower, upper = (held.lower - held.behind).min(axis=0), (held.upper + held.ahead).max(axis=0)
        rows = loop.jacobian_bounds(lower, upper)
        if rows is None:
            return None
        errors = np.zeros((len(action),) * 2 + (self._size,))  # of what a's owner takes each for
        each = np.arange(len(action))
        for a, owner in enumerate(loop.owner):
            known = loop.owner == owner
            errors[a, each[~known], self._error[owner, ~known]] = 1.0
        found = []
        for row, knows in ((rows[0], 1.0), (rows[1] - rows[0], 0.0)):
            taken = row @ action + np.einsum("ab,abn->an", row, errors)
            none = np.zeros(len(action))
            own = np.diag(row)
            sigma = np.where(own > 0.0, own, np.linalg.norm(row, axis=1))
            found.append(Products(acting, taken, none + knows, none + 1.0, sigma))
        return found[0], found[1]

    def _barriers(self, action: Array, acting: Array, sigma: Array) -> tuple[Products, Products]:
        """The barrier's differences: at the actions from y*, and at what agents take them for."""
        loop, held = self._loop, self._held
        a, rho, slack = loop.slopes, loop.rho, loop.slack
        at_actions = Products(
            a @ acting, a @ action, rho / (slack * held.ceiling), rho / (slack * held.floor),
            np.ones(len(a)),
        )  # fmt: skip
        which, own = np.nonzero(a)
        errors = np.zeros((len(which), self._size))
        np.put_along_axis(errors, self._error[loop.owner[own]], a[which], axis=1)
        short, over = (each[which, loop.owner[own]] for each in (held.short, held.over))
        least, most = held.floor[which], held.ceiling[which]
        lower, upper = rho / (most * (most + over)), rho / (least * (least - short))
        slope = a[which, own]
        with np.errstate(divide="ignore"):  # infinite where nothing is to be split
            split = 4.0 * sigma[own] / ((upper - lower) * slope**2)
        return at_actions, Products(slope[:, None] * acting[own], errors, lower, upper, split)
