"""Rate maximisation: three transmitters spread their power over four channels that they share.

Without the shared bound on the power in each channel it is the game of iterative water filling.

Source: Yu, Ginis and Cioffi, "Distributed multiuser power control for digital subscriber lines",
IEEE J. on Selected Areas in Communications 20 (2002); the gains are this file's own.
Published: no digits; compared with water filling where the shared bound does not bind.
"""

import numpy as np

NOISE = np.array([[0.10, 0.15, 0.30, 0.45], [0.40, 0.12, 0.20, 0.25], [0.20, 0.35, 0.12, 0.15]])
CROSS = np.array([[1.0, 0.12, 0.08], [0.10, 1.0, 0.15], [0.06, 0.09, 1.0]])  # from j to i


def cost(i, y, p):
    noise = NOISE[i] + sum(CROSS[i, j] * y[j] for j in range(3) if j != i)
    return -np.log(1 + y[i] / noise).sum()


def constraints(y, p):
    for i in range(3):
        yield f"power {i + 1}", y[i].sum() <= 1
    yield "channel", y.sum(axis=0) <= p.most
