"""Cournot with transport: two firms at two places sell at home and, at a cost of shipping, abroad.

What is shipped in all is bounded by K. While that does not bind, each sells (a - c + t) / (3 b) at
home and (a - c - 2 t) / (3 b) abroad, though that only wears down shipping: reciprocal dumping. If
K binds, K / 2 abroad and (a - c - b K / 2) / (2 b) at home.

Source: Brander and Krugman, "A reciprocal dumping model of international trade", J. of
International Economics 15 (1983), 313-321, with linear demand; the numbers are this file's own.
Published: the formulas above.
"""


def cost(i, y, p):
    home, abroad = p.a - p.b * (y[i, 0] + y[1 - i, 1]), p.a - p.b * (y[1 - i, 0] + y[i, 1])
    return (p.c - home) * y[i, 0] + (p.c + p.t - abroad) * y[i, 1]


def constraints(y, p):
    yield "shipping", y[:, 1].sum() <= p.K
