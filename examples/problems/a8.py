"""A.8 Three players; constraints that only the first two have. Many equilibria.

(t, 1 - t, 1.5 t) is a generalized Nash equilibrium for every t from 1/2 to 2/3. None of them has
one multiplier of x_1 + x_2 <= 1 for both players, so that player 1's cost is weighted here: with
the weight w it is that of t = (1 + w) / 2.

Source: Facchinei and Kanzow (2010), preprint's appendix A.8; Facchinei, Fischer and Piccialli
(2009).
Published: t = 0.625 to four digits, which is w = 1/4. From another start the library has
(0.62510047, 0.37500003, 0.93765059), which is the same one less accurately.
"""

from gne_mj.expressions import private

PUBLISHED = [0.62503131162143, 0.37500031253875, 0.93754579549990]


def cost(i, y, p):
    return [-p.weight * y[0], (y[1] - 0.5) ** 2, (y[2] - 1.5 * y[0]) ** 2][i]


def constraints(y, p):
    yield "total", private([0, 1], y[0] + y[1] <= 1)
    yield "third", private([0, 1], y[2] <= y[0] + y[1])
