"""A lower bound of mu where each row of dF/dy only changes in length, for any number of rows.

Let row r of dF/dy be anywhere between the r-th rows of S and L, and e_r be a unit vector. With
a_r the difference of the two rows, the symmetric part of dF/dy is that of S plus
sum_r t_r (e_r a_r' + a_r e_r')/2 with 0 <= t_r <= 1. For every s > 0

    (e_r a_r' + a_r e_r')/2 + w_r w_r' = v v' >= 0,   w_r = sqrt(s) a_r - e_r / (4 sqrt(s)),
                                                      v = sqrt(s) a_r + e_r / (4 sqrt(s)),

so that t_r times the first term is at least -w_r w_r' whatever t_r is, and

    mu >= lambda_min(sym(S) - sum_r w_r w_r').

The right side is concave in s_1, ..., s_m, and is made great by gradient steps on a smooth lower
bound of it. All such bounds are right, and the best one is the relaxation of a matrix cube, which
for such matrices needs no more than 2/pi of the room that the 2^m corners have (Ben-Tal and
Nemirovski, SIAM J. Optim. 12, 2002).
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from gne_mj.theory import spectra

Array = NDArray[np.float64]

# How closely the smooth bound follows the least eigenvalue, and steps at each of these
_SHARPNESS = (10.0, 100.0, 1000.0)
_STEPS = 10


class Bound(NamedTuple):
    """A bound of the least eigenvalue of all such symmetric parts.

    Attributes:
        value: none of them has an eigenvalue below this, but for rounding.
        base: S, the matrix with every row at its shorter end, (m, m).
        loss: w_r as rows, (m, m): sym(dF/dy) >= sym(base) - loss' loss; row r belongs to row r.
    """

    value: float
    base: Array
    loss: Array


def least_eigenvalue(short: Array, long: Array) -> Bound:
    """The bound for rows between those of two matrices (m, m), the shorter ones first."""
    moves = np.any(long != short, axis=1)
    symmetric, loss = 0.5 * (short + short.T), np.zeros_like(short)
    if not np.any(moves):
        return Bound(spectra.least_eigenvalue(symmetric), short, loss)
    change, unit = (long - short)[moves], np.eye(len(short))[moves]
    best = -np.inf

    def smooth(log_s: Array, sharpness: float, size: float) -> tuple[float, Array]:
        """A lower bound of the least eigenvalue and its derivative, both negative and scaled."""
        nonlocal best
        s = np.exp(log_s)[:, None]
        rows = np.sqrt(s) * change - unit / (4.0 * np.sqrt(s))
        values, vectors = np.linalg.eigh(symmetric - rows.T @ rows)
        if values[0] > best:
            best, loss[moves] = float(values[0]), rows
        shares = np.exp(-sharpness / size * (values - values[0]))
        bound = values[0] - size / sharpness * np.log(np.sum(shares))
        seen = vectors * np.sqrt(shares / np.sum(shares))
        slope = np.sum((unit @ seen) ** 2, axis=1) / (16.0 * s[:, 0] ** 2)
        slope -= np.sum((change @ seen) ** 2, axis=1)
        return -bound / size, -slope * s[:, 0] / size

    from scipy.optimize import minimize  # slow to load, and for few games only

    # What is best if all directions count alike
    log_s = -np.log(4.0 * np.linalg.norm(change, axis=1))
    smooth(log_s, 1.0, 1.0)
    for sharpness in _SHARPNESS:
        size = max(abs(best), 1e-12 * float(np.max(np.abs(symmetric))))
        options = {"maxiter": _STEPS}
        found = minimize(smooth, log_s, (sharpness, size), "L-BFGS-B", jac=True, options=options)
        log_s = found.x
    return Bound(best, short, loss)
