"""A.14 Internet switching: 10 players share a buffer of size B = 1.

Source: Facchinei and Kanzow (2010), preprint's appendix A.14; Kesselman, Leonardi and Bonifaci
(2005).
Published: 0.09 for each, to six digits; exactly it is B (N - 1) / N^2. To all digits the published
one solves F(x) + 1e-5 x = 0.
"""

PUBLISHED = [0.08999991899425] * 10


def cost(i, y, p):
    return -y[i] / y.sum() * (1 - y.sum())


def constraints(y, p):
    yield "buffer", y.sum() <= 1
