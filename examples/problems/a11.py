"""A.11 Two players share x_1 + x_2 <= 1.

(t, 1 - t) is a generalized Nash equilibrium for every t from 1/2 to 1, (3/4, 1/4) the variational
one.

Source: Facchinei and Kanzow (2010), preprint's appendix A.11; Facchinei, Fischer and Piccialli
(2007).
Published: the variational one to four digits, 5e-5 outside the bound.
"""

PUBLISHED = [0.75002417863494, 0.2500241786374]


def cost(i, y, p):
    return (y[i] - [1.0, 0.5][i]) ** 2


def constraints(y, p):
    yield "total", y.sum() <= 1
