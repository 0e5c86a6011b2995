"""A.18 Electricity market: two firms with two plants each sell in three regions, with arbitrage.

Prices S of regions differ by at most 1. Of each firm only what both plants sell in a region counts,
so that F is merely monotone: sales in all are unique, their shares of plants are not.

Source: Facchinei and Kanzow (2010), preprint's appendix A.18.
Published: no digits are known to us.
"""

import numpy as np

D, E = np.array([40.0, 35.0, 32.0]), np.array([500.0, 400.0, 600.0])


def cost(i, y, p):
    sold = y[:, :3] + y[:, 3:]
    return ((15 - D + D / E * sold.sum(axis=0)) * sold[i]).sum()


def constraints(y, p):
    S = D - D / E * (y[:, :3] + y[:, 3:]).sum(axis=0)
    for i in range(2):
        yield f"plant {2 * i + 1}", y[i, :3].sum() <= 100
        yield f"plant {2 * i + 2}", y[i, 3:].sum() <= 50
    yield "arbitrage", abs(S - S[[1, 2, 0]]) <= 1
