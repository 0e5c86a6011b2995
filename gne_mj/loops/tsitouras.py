"""Tsitouras's pair of Runge-Kutta methods of orders 5 and 4, with dense output of order 4.

C. Tsitouras, Runge-Kutta pairs of order 5(4) satisfying only the first column simplifying
assumption, Computers & Mathematics with Applications 62, 770 (2011). Six new evaluations a step:
the last stage is at the step's end, where the next step begins. The kernels are for numbers and for
lanes (:mod:`gne_mj.lanes`), to the same bits.
"""

import numpy as np

from gne_mj.lanes import where
from gne_mj.native import kernel

STAGES = 7
NODES = (0.0, 0.161, 0.327, 0.9, 0.9800255409045097, 1.0, 1.0)
A = (
    (0.161,),
    (-0.008480655492356989, 0.335480655492357),
    (2.8971530571054935, -6.359448489975075, 4.3622954328695815),
    (5.325864828439257, -11.748883564062828, 7.4955393428898365, -0.09249506636175525),
    (
        5.86145544294642,
        -12.92096931784711,
        8.159367898576159,
        -0.071584973281401,
        -0.028269050394068383,
    ),
    (
        0.09646076681806523,
        0.01,
        0.4798896504144996,
        1.379008574103742,
        -3.290069515436081,
        2.324710524099774,
    ),
)
# The solution of order 5 less that of order 4
E = (
    -0.00178001105222577714,
    -0.0008164344596567469,
    0.007880878010261995,
    -0.1447110071732629,
    0.5823571654525552,
    -0.45808210592918697,
    1.0 / 66.0,
)
SAFETY, SHRINK, UNKNOWN = 0.9, 0.2, 0.5  # UNKNOWN: where a stage was outside
LEAST_ERROR = 1e-4  # steps grow as after this one where an error is less: to 3.8 times at most


@kernel
def stage_state(stage, h, state, k, trial):
    """Fill trial with the flat state at a stage from 1 on, given the rates at those before it."""
    k0, k1, k2, k3, k4, k5 = k[0], k[1], k[2], k[3], k[4], k[5]
    n = len(state)
    if stage == 1:
        for r in range(n):
            trial[r] = state[r] + h * (A[0][0] * k0[r])
    elif stage == 2:
        for r in range(n):
            trial[r] = state[r] + h * (A[1][0] * k0[r] + A[1][1] * k1[r])
    elif stage == 3:
        for r in range(n):
            trial[r] = state[r] + h * (A[2][0] * k0[r] + A[2][1] * k1[r] + A[2][2] * k2[r])
    elif stage == 4:
        for r in range(n):
            rise = A[3][0] * k0[r] + A[3][1] * k1[r] + A[3][2] * k2[r] + A[3][3] * k3[r]
            trial[r] = state[r] + h * rise
    elif stage == 5:
        for r in range(n):
            rise = A[4][0] * k0[r] + A[4][1] * k1[r] + A[4][2] * k2[r] + A[4][3] * k3[r]
            trial[r] = state[r] + h * (rise + A[4][4] * k4[r])
    else:
        for r in range(n):
            rise = A[5][0] * k0[r] + A[5][1] * k1[r] + A[5][2] * k2[r] + A[5][3] * k3[r]
            trial[r] = state[r] + h * (rise + A[5][4] * k4[r] + A[5][5] * k5[r])


@kernel
def difference(h, k, out):
    """Fill out with the flat state's solution of order 5 less that of order 4, given all rates."""
    k0, k1, k2, k3, k4, k5, k6 = k[0], k[1], k[2], k[3], k[4], k[5], k[6]
    for r in range(len(out)):
        rise = E[0] * k0[r] + E[1] * k1[r] + E[2] * k2[r] + E[3] * k3[r]
        out[r] = h * (rise + E[4] * k4[r] + E[5] * k5[r] + E[6] * k6[r])


@kernel
def interpolate(share, h, begun, k, out):
    """Fill out with the flat state at a share from 0 to 1 of a step of h s from ``begun``."""
    s, square = share, share * share
    b0 = -1.0530884977290216 * s * (s - 1.3299890189751412)
    b0 = b0 * (square - 1.4364028541716351 * s + 0.7139816917074209)
    b1 = 0.1017 * square * (square - 2.1966568338249754 * s + 1.2949852507374631)
    b2 = 2.490627285651252793 * square * (square - 2.38535645472061657 * s + 1.57803468208092486)
    b3 = -16.54810288924490272 * square * (s - 1.21712927295533244) * (s - 0.61620406037800089)
    b4 = 47.37952196281928122 * square * (s - 1.203071208372362603) * (s - 0.658047292653547382)
    b5 = -34.87065786149660974 * square * (s - 1.2) * (s - 0.666666666666666667)
    b6 = 2.5 * square * (s - 1.0) * (s - 0.6)
    k0, k1, k2, k3, k4, k5, k6 = k[0], k[1], k[2], k[3], k[4], k[5], k[6]
    for r in range(len(out)):
        rise = b0 * k0[r] + b1 * k1[r] + b2 * k2[r] + b3 * k3[r]
        out[r] = begun[r] + h * (rise + b4 * k4[r] + b5 * k5[r] + b6 * k6[r])


@kernel
def next_length(h, error, last, failed, least):
    """How long a step comes after one of h s, in s.

    A proportional and integral controller (G. Söderlind, Automatic control and adaptive
    time-stepping, Numerical Algorithms 31, 281 (2002)), in powers that square roots make, so that
    lanes find the same bits.

    Args:
        h: of the step tried.
        error: its weighted error, of which 1 is allowed; infinite where a stage was outside.
        last: what this returned second for the last step that stood; 0 at the start.
        failed: 1 if the step before was taken back.
        least: length in s that a step which is taken back shortens to at most, if it is longer.

    Returns:
        The length, and what to keep if the step stands.
    """
    known = error < np.inf
    bounded = where(known, max(error, LEAST_ERROR), 1.0)
    eighth = np.sqrt(np.sqrt(np.sqrt(bounded)))
    sixteenth = np.sqrt(eighth)
    rise = SAFETY * where(last > 0.0, last, 1.0) / (eighth * np.sqrt(sixteenth))
    rise = where((failed > 0.0) & (rise > 1.0), 1.0, rise)
    fall = where(known, max(SHRINK, SAFETY / (eighth * sixteenth)), UNKNOWN)
    shorter = where(h > least, max(h * fall, least), h * fall)
    return where(error <= 1.0, h * rise, shorter), sixteenth
