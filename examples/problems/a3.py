"""A.3 Three players with 3, 2 and 2 variables, quadratic costs and bounds of their own.

Source: Facchinei and Kanzow (2010), preprint's appendix A.3.
Published: right to five digits. No bound binds there, and to all digits it solves F(x) + 1e-5 x = 0
where F(x) = 0 is right. F is not monotone: gradient play moves away from this equilibrium.
"""

import numpy as np

from gne_mj.expressions import private

PUBLISHED = [-0.38046562696258, -0.12266997083581, -0.99322817120517, 0.39034789080544,
             1.16385412687962, 0.05039533464000, 0.01757740533460]  # fmt: skip

A = [np.array(a) for a in ([[20, 5, 3], [5, 5, -5], [3, -5, 15]], [[11, -1], [-1, 9]],
                           [[48, 39], [39, 53]])]  # fmt: skip
b = [np.array([1, -1, 1]), np.array([1, 0]), np.array([-1, 2])]
B = {key: np.array(block) for key, block in {
    (0, 1): [[-6, 10], [10, -4], [15, 8]], (0, 2): [[11, 20], [-17, 9], [-22, 21]],
    (1, 0): [[20, 1, -3], [10, -4, 8]], (1, 2): [[12, 1], [16, 21]],
    (2, 0): [[10, -2, 22], [9, 19, 21]], (2, 1): [[12, 16], [-4, 20]],
}.items()}  # fmt: skip


def cost(i, y, p):
    others = sum(B[i, j] @ y[j] for j in range(3) if j != i)
    return y[i] @ (A[i] @ y[i] / 2 + others + b[i])


def constraints(y, p):
    yield "total", private(0, y[0].sum() <= 20)
    yield "first", private(0, y[0][0] + y[0][1] - y[0][2] <= y[1][0] - y[2][1] + 5)
    yield "second", private(1, y[1][0] - y[1][1] <= y[0][1] + y[0][2] - y[2][0] + 7)
    yield "third", private(2, y[2][1] <= y[0][0] + y[0][2] - y[1][0] + 4)
