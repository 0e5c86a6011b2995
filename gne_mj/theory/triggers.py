"""Whether event triggers keep V falling (docs/messages.md), and how far V can rise through them.

With Q(e) >= q |e|^2 the form of :mod:`gne_mj.theory.coupling`, A the graph's adjacency, L its
Laplacian and Delta its degrees (each for all entries of a profile), let there be an s with

    t - s Delta >= B P^-1 B,   P = Q - q/4 - 2 s L > 0,   B = c A/2 + s L,   s = sigma t.

Then dV/dt <= -(q/4) |e|^2 + t N (threshold exp(-decay t))^2. Where Q is not known as a matrix,
16 sigma c^2 D^3 <= q^2 (1 - 2 sigma D) is enough, D being the greatest degree, with
t = c^2 D^2 / (2 q (1 - 2 sigma D)).
"""

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gne_mj.faults import EventTrigger
from gne_mj.graph import Graph
from gne_mj.system.data import SystemData
from gne_mj.theory.constants import Slopes
from gne_mj.theory.coupling import form_at, least_of_form

Array = NDArray[np.float64]

NUMBERS = ("form", "largest_sigma", "beta", "rises", "ball")
_HALVINGS = 50


@dataclass(frozen=True, eq=False)
class Triggers:
    """What is certain of a system whose agents send by triggers.

    Args:
        system: with one trigger for all its agents.
        slopes: of its F, where estimates are; None under a law of which nothing is proven here.
    """

    system: SystemData
    slopes: Slopes | None

    @property
    def trigger(self) -> EventTrigger:
        """That of all agents."""
        return next(fault for fault in self.system.faults if isinstance(fault, EventTrigger))

    @cached_property
    def form(self) -> float:
        """q, no more than what Q certainly has; not a number where nothing is certain."""
        if self.slopes is None or not self.slopes.monotone:
            return np.nan
        if self._matrix is not None:
            return float(np.linalg.eigvalsh(self._matrix)[0])
        return least_of_form(self.slopes, self._graph, self._gain)

    @cached_property
    def largest_sigma(self) -> float:
        """The greatest that is proven; not a number if none is."""
        if not self.form > 0.0:
            return np.nan
        if not self._degree:  # nobody to hear what is sent
            return np.inf
        if self._matrix is not None:
            return self._best / self._spent(self._best)
        square, degree = self.form**2, self._degree
        return float(square / (16.0 * self._gain**2 * degree**3 + 2.0 * degree * square))

    @cached_property
    def why_not(self) -> str | None:
        """Why V is not certain to fall; None if it is."""
        if self.slopes is None:
            return f"nothing is proven of them under {self.system.law.information} information"
        if np.isnan(self.form):
            return "F is not certain to be strongly monotone"
        if not self.form > 0.0:
            return (
                f"q = {self.form:.4g}, and it must be positive: the coupling gain is too small even"
                " if all messages came"
            )
        if not self.trigger.sigma <= self.largest_sigma:
            return (
                f"sigma = {self.trigger.sigma:g}, and up to {self.largest_sigma:.4g} it is proven"
            )
        return None

    @cached_property
    def beta(self) -> float:
        """What the threshold's square is multiplied by in dV/dt."""
        sigma, degree = self.trigger.sigma, self._degree
        if self._matrix is None:
            spread = 2.0 * self.form * (1.0 - 2.0 * sigma * degree)
            return self._graph.agents * float(self._gain**2 * degree**2 / spread)
        if sigma == 0.0 or not degree:
            return self._graph.agents * self._spent(0.0)
        # s - sigma t(s) is concave, negative at 0 and not at the best s
        low, high = 0.0, self._best
        for _ in range(_HALVINGS):
            middle = 0.5 * (low + high)
            enough = middle >= sigma * self._spent(middle)
            low, high = (low, middle) if enough else (middle, high)
        return self._graph.agents * high / sigma

    @property
    def converges(self) -> bool:
        """Whether e certainly tends to 0, and not to a ball only."""
        return self.why_not is None and (self.trigger.decay > 0.0 or self.trigger.threshold == 0.0)

    @property
    def rises(self) -> float:
        """By how much V can rise in all; infinite if the threshold does not decay."""
        trigger = self.trigger
        if trigger.threshold == 0.0:
            return 0.0
        size = self.beta * trigger.threshold**2
        return size / (2.0 * trigger.decay) if trigger.decay > 0.0 else np.inf

    @property
    def ball(self) -> float:
        """V falls where |e| is greater than this times exp(-decay t)."""
        return float(np.sqrt(4.0 * self.beta / self.form)) * self.trigger.threshold

    def report(self) -> dict[str, Any]:
        """All of it as plain data; None stands for what is not known, or infinite."""
        trigger, proven = self.trigger, self.why_not is None
        numbers = {"form": self.form, "largest_sigma": self.largest_sigma}
        if proven:
            numbers |= {"beta": self.beta, "rises": self.rises, "ball": self.ball}
        known = {key: float(value) for key, value in numbers.items() if np.isfinite(value)}
        return {
            "sigma": trigger.sigma,
            "threshold": trigger.threshold,
            "decay": trigger.decay,
            "proven": proven,
            "why_not": self.why_not,
            "converges": self.converges,
            **dict.fromkeys(NUMBERS),
            **known,
        }

    @cached_property
    def _best(self) -> float:
        """The s at which s / t(s), which rises and then falls, is greatest; any other is safe."""
        from scipy.linalg import eigh  # slow to load, and for certificates only
        from scipy.optimize import minimize_scalar

        assert self._matrix is not None
        rest = self._matrix - 0.25 * self.form * np.eye(len(self._matrix))
        most = 1.0 / float(eigh(2.0 * self._laplacian, rest, eigvals_only=True)[-1])
        found = minimize_scalar(lambda s: -s / self._spent(s), bounds=(0.0, most), method="bounded")
        return float(found.x)

    def _spent(self, s: float) -> float:
        """The least t for an s; infinite if there is none."""
        assert self._matrix is not None
        size = len(self._matrix)
        degrees = np.diagonal(self._laplacian)
        left = self._matrix - 0.25 * self.form * np.eye(size) - 2.0 * s * self._laplacian
        between = 0.5 * self._gain * (np.diag(degrees) - self._laplacian) + s * self._laplacian
        try:
            half = np.linalg.solve(np.linalg.cholesky(left), between)
        except np.linalg.LinAlgError:
            return np.inf
        return float(np.linalg.eigvalsh(s * np.diag(degrees) + half.T @ half)[-1])

    @cached_property
    def _matrix(self) -> Array | None:
        assert self.slopes is not None
        return form_at(self.slopes, self._graph, self._gain)

    @cached_property
    def _laplacian(self) -> Array:
        """Of the graph, for all entries of a profile, (N m, N m)."""
        found: Array = np.kron(self._graph.laplacian, np.eye(self.system.game.actions))
        return found

    @property
    def _gain(self) -> float:
        return self.system.law.coupling

    @property
    def _graph(self) -> Graph:
        graph = self.system.law.graph
        assert graph is not None
        return graph

    @property
    def _degree(self) -> int:
        return int(np.max(np.diff(self._graph.data.pointer)))
