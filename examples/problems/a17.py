"""A.17 Two players, of two variables and one, share two bounds.

Source: Facchinei and Kanzow (2010), preprint's appendix A.17.
Published: (0, 11, 8) to five digits: the variational one, where x_1 = 0 has the multiplier 0. There
is a whole set of others.
"""

PUBLISHED = [0.00000737, 11.00002440, 7.99997560]


def cost(i, y, p):
    (a, b), c = y
    return a**2 + a * b + b**2 + (a + b) * c - 25 * a - 38 * b if i == 0 else c * (c + a + b - 25)


def constraints(y, p):
    (a, b), c = y
    yield "first", a + 2 * b - c <= 14
    yield "second", 3 * a + 2 * b + c <= 30
