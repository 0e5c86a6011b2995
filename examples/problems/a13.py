"""A.13 River basin pollution: three producers keep two bounds on pollutants.

Source: Facchinei and Kanzow (2010), preprint's appendix A.13; Haurie and Krawczyk (1997), Krawczyk
and Uryasev (2000).
Published: the variational (normalised) equilibrium, right to six digits: to all digits it is that
of a first bound of 100.0000519. With a multiplier for each player there are others, such as (0,
6.4733, 22.2808).
"""

PUBLISHED = [21.14480155732168, 16.02785326538717, 2.7259709656438]


def cost(i, y, p):
    return y[i] * ([0.1, 0.12, 0.15][i] + [0.01, 0.05, 0.01][i] * y[i] - 3 + 0.01 * y.sum())


def constraints(y, p):
    yield "station 1", 3.25 * y[0] + 1.25 * y[1] + 4.125 * y[2] <= 100
    yield "station 2", 2.2915 * y[0] + 1.5625 * y[1] + 2.8125 * y[2] <= 100
