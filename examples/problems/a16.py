"""A.16 Five firms share a bound P on what they produce in all.

The library has P = 75, 100, 150 and 200; P is a parameter here.

Source: Facchinei and Kanzow (2010), preprint's appendix A.16; Murphy, Sherali and Soyster (1982),
Outrata, Kocvara and Zowe (1998).
Published: right to five digits for all four.
"""

PUBLISHED = {
    75: [10.403965, 13.035817, 15.407354, 17.381556, 18.771308],
    100: [14.050088, 17.798379, 20.907187, 23.111429, 24.132916],
    150: [23.588799, 28.684248, 32.021533, 33.287258, 32.418182],
    200: [35.785329, 40.748959, 42.802485, 41.966381, 38.696846],
}


def cost(i, y, p):
    c, d = 10.0 - 2 * i, 1.2 - 0.1 * i
    made = c * y[i] + d / (1 + d) * 5 ** (-1 / d) * y[i] ** ((1 + d) / d)
    return made - 5000 ** (1 / 1.1) * y[i] * y.sum() ** (-1 / 1.1)


def constraints(y, p):
    yield "total", y.sum() <= p.P
