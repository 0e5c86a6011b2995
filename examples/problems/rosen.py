"""Rosen's two players, who share x_1 + x_2 >= 1, with his weights r of players.

With the costs weighted by r the variational equilibrium is his normalised one, x_2 = (r_1 - r_2) /
(2 r_1 + r_2), x_1 = 1 - x_2, as long as that is not negative.

Source: after Rosen, "Existence and uniqueness of equilibrium points for concave n-person games",
Econometrica 33 (1965), 520-534; used by von Heusinger and Kanzow (2009) among others.
Published: (1, 0) for r = (1, 1), exactly.
"""

PUBLISHED = [1.0, 0.0]


def cost(i, y, p):
    return p.r[i] * [y[0] ** 2 / 2 - y[0] * y[1], y[1] ** 2 + y[0] * y[1]][i]


def constraints(y, p):
    yield "total", y.sum() >= 1
