"""A.1 Internet switching with one privileged player: 10 players share a buffer of size B = 1.

Player 1 has bounds 0.3 and 0.5 and no part in the buffer's bound, which is the others' alone.

Source: Facchinei and Kanzow, "Penalty methods for the solution of generalized Nash equilibrium
problems", SIAM J. Optim. 20 (2010), preprint's appendix A.1; a variant of Kesselman, Leonardi and
Bonifaci (2005).
Published: right to two digits, since x_1 = 0.29924 is below its bound. Here x_1 = 0.3 and the
others have 0.0694364..., where 0.3 + 8 x = (0.3 + 9 x)^2.
"""

from gne_mj.expressions import private

PUBLISHED = [0.29923815223336, *[0.06951127617805] * 9]


def cost(i, y, p):
    return -y[i] / y.sum() * (1 - y.sum())


def constraints(y, p):
    yield "buffer", private(range(1, 10), y.sum() <= 1)
