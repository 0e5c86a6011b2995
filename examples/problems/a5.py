"""A.5 As A.3 with other numbers, and actions from 0 to 10.

Source: Facchinei and Kanzow (2010), preprint's appendix A.5.
Published: right to three digits; entries that are 0 are published as small negative numbers,
outside their bound.
"""

import numpy as np

from gne_mj.expressions import private

PUBLISHED = [-0.00006229891126, 0.20279012064850, -0.00003469558295, -0.00028322020054,
             0.07258934064261, 0.02531280162415, -0.00007396699835]  # fmt: skip

A = [np.array(a) for a in ([[20, 6, 0], [6, 6, -1], [0, -1, 8]], [[11, 1], [1, 7]],
                           [[28, 14], [14, 29]])]  # fmt: skip
b = [np.array([1, -1, 1]), np.array([1, 0]), np.array([-1, 2])]
B = {key: np.array(block) for key, block in {
    (0, 1): [[-1, -2], [0, -3], [0, 1]], (0, 2): [[-4, -3], [0, -4], [9, 6]],
    (1, 0): [[-1, 0, 0], [-2, -3, 1]], (1, 2): [[-7, 4], [4, 11]],
    (2, 0): [[-4, 0, 9], [-3, -4, 6]], (2, 1): [[-7, 4], [4, 11]],
}.items()}  # fmt: skip


def cost(i, y, p):
    others = sum(B[i, j] @ y[j] for j in range(3) if j != i)
    return y[i] @ (A[i] @ y[i] / 2 + others + b[i])


def constraints(y, p):
    yield "total", private(0, y[0].sum() <= 20)
    yield "first", private(0, y[0][0] + y[0][1] - y[0][2] <= y[1][0] - y[2][1] + 5)
    yield "second", private(1, y[1][0] - y[1][1] <= y[0][1] + y[0][2] - y[2][0] + 7)
    yield "third", private(2, y[2][1] <= y[0][0] + y[0][2] - y[1][0] + 4)
