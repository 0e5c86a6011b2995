"""The gain k that the fully distributed law needs: k > beta / mu [asmp:OSSPassive].

The assumption asks for dV/dt <= -alpha |x - x*|^2 + beta |y - y*|^2 + (y - y*)'(u - u*). An agent
type tells its energy balance dV/dt = -e'De + (y - y*)'(u - u*), e = x - x*, V <= e'Pe/2. So the
assumption holds with every beta for which D + beta C'C (C selects the output) is positive
definite, and alpha is that matrix's least eigenvalue. The theorem's reduced system
[eq:reduced], the limit epsilon -> 0, then has dV/dt <= -e'(D + k mu C'C)e.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gne_mj.plants.agent_type import by_type, energy_balance
from gne_mj.plants.agents import Agents

Array = NDArray[np.float64]
_ROUNDING = 1e-12


@dataclass(frozen=True)
class Gain:
    """What is known of the gain.

    Attributes:
        gain: k.
        fails: names of the agent types that do not meet the assumption.
        unknown: names of those that tell no energy balance.
        beta: all agents meet the assumption with any beta above this; None if one does not.
        least: k* is any number above this, beta / mu; None likewise, or without a certain mu.
        alpha: with beta = k mu.
        decay_rate: of the reduced system's V, in 1/s: V(t) <= V(0) exp(-decay_rate t).
        rates: the same for other gains, as pairs (k, decay_rate).
    """

    gain: float
    fails: tuple[str, ...] = ()
    unknown: tuple[str, ...] = ()
    beta: float | None = None
    least: float | None = None
    alpha: float | None = None
    decay_rate: float | None = None
    rates: tuple[tuple[float, float], ...] = ()


def required_gain(agents: Agents, mu: float | None, gain: float) -> Gain:
    """Whether all agents meet the assumption, and what follows for the gain k.

    Args:
        agents: which.
        mu: of strong monotonicity over the feasible set; None if it is not certain.
        gain: the k in use.
    """
    balances, fails, unknown, beta = [], [], [], 0.0
    for kind, parameters in by_type(agents.kind, agents.parameters):
        balance = energy_balance(kind, parameters)
        if balance is None:
            unknown.append(kind.NAME)
            continue
        storage, dissipation = balance
        least = least_beta(dissipation, kind.OUTPUT)
        if np.all(np.isfinite(least)):
            beta = max(beta, float(np.max(least)))
            balances.append((storage, dissipation, kind.OUTPUT))
        else:
            fails.append(kind.NAME)
    if fails or unknown:
        return Gain(gain, tuple(fails), tuple(unknown))
    if mu is None:
        return Gain(gain, beta=beta)

    def rate(k: float) -> float:
        return min(decay_rate(*balance, k * mu) for balance in balances)

    holds = k_mu_suffices(gain, mu, beta)
    return Gain(
        gain,
        beta=beta,
        least=beta / mu,
        alpha=min(alpha(d, c, gain * mu) for _, d, c in balances) if holds else None,
        decay_rate=rate(gain) if holds else None,
        rates=tuple(
            (k, rate(k))
            for k in (0.01 * gain, 0.1 * gain, gain, 10.0 * gain, 100.0 * gain)
            if k_mu_suffices(k, mu, beta)
        ),
    )


def k_mu_suffices(gain: float, mu: float, beta: float) -> bool:
    """Whether the assumption holds with a beta below k mu."""
    return gain * mu > beta


def least_beta(dissipation: Array, output: int) -> Array:
    """The beta >= 0 above which D + beta C'C is positive definite, (m,); infinite if none is.

    Schur's complement of the states other than the output; dissipation (m, s, s).
    """
    rest = np.arange(dissipation.shape[-1]) != output
    found = np.empty(len(dissipation))
    for channel, d in enumerate(dissipation):
        scale = max(float(np.max(np.abs(d))), 1.0)
        inner, cross = d[np.ix_(rest, rest)], d[rest, output]
        if np.any(np.linalg.eigvalsh(inner) <= _ROUNDING * scale):
            found[channel] = np.inf
            continue
        least = cross @ np.linalg.solve(inner, cross) - d[output, output]
        found[channel] = least if least > 1e3 * _ROUNDING * scale else 0.0
    return found


def alpha(dissipation: Array, output: int, beta: float) -> float:
    """The alpha of the assumption for a beta: least eigenvalue of D + beta C'C over channels."""
    return float(np.min(np.linalg.eigvalsh(_raised(dissipation, output, beta))))


def decay_rate(storage: Array, dissipation: Array, output: int, beta: float) -> float:
    """The greatest s with D + beta C'C >= s P/2 in all channels: then dV/dt <= -s V."""
    from scipy.linalg import eigh  # slow to load, and for certificates only

    raised = _raised(dissipation, output, beta)
    return float(
        min(eigh(d, 0.5 * p, eigvals_only=True)[0] for d, p in zip(raised, storage, strict=True))
    )


def _raised(dissipation: Array, output: int, beta: float) -> Array:
    raised = dissipation.copy()
    raised[:, output, output] += beta
    return raised
