"""Harker's two players, who share x_1 + x_2 <= 15.

(5, 9) and (t, 15 - t) for t from 9 to 10 are the generalized Nash equilibria; the first one is the
only variational one.

Source: Harker, "Generalized Nash games and quasi-variational inequalities", European J. of
Operational Research 54 (1991), 81-94.
Published: (5, 9), exactly.
"""

PUBLISHED = [5.0, 9.0]


def cost(i, y, p):
    return y[i] ** 2 + [8 / 3, 5 / 4][i] * y[0] * y[1] - [34, 24.25][i] * y[i]


def constraints(y, p):
    yield "total", y.sum() <= 15
