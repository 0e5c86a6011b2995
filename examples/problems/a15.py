"""A.15 Electricity market: three generating companies with 1, 2 and 3 units.

Source: Facchinei and Kanzow (2010), preprint's appendix A.15; Contreras, Klusch and Krawczyk
(2004).
Published: right to four digits; to all digits it solves F(x) + 1e-5 x = 0.
"""

import numpy as np

PUBLISHED = [46.66150692423980, 32.15293850189938, 15.00419467998705, 22.10485810522063,
             12.34076570922471, 12.34076570922471]  # fmt: skip
C = [0.04, np.array([0.035, 0.125]), np.array([0.0166, 0.05, 0.05])]
D = [2.0, np.array([1.75, 1.0]), np.array([3.25, 3.0, 3.0])]


def cost(i, y, p):
    total = sum(each.sum() for each in y)
    return (2 * total - 378.4) * y[i].sum() + (C[i] * y[i] ** 2 / 2 + D[i] * y[i]).sum()
