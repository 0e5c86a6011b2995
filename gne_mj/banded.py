"""Banded matrices by rows, and how they are factorised and solved with.

Of a matrix with b diagonals on either side, ``band[r, c - r + b]`` is the entry in row r and
column c. Rows have 3 b + 1 entries: partial pivoting fills b more diagonals on the right. With
b = n - 1 it is a dense matrix.
"""

import numpy as np

from gne_mj.native import kernel


@kernel
def factorise(band, n, b, pivots):
    """LU factors of the first n rows in place, with partial pivoting; False if singular."""
    for k in range(n):
        last = min(k + b, n - 1)
        pivot, largest = k, abs(band[k, b])
        for r in range(k + 1, last + 1):
            size = abs(band[r, k - r + b])
            if size > largest:
                pivot, largest = r, size
        pivots[k] = pivot
        if not largest > 0.0:
            return False
        end = min(k + 2 * b, n - 1)
        if pivot != k:
            for c in range(k, end + 1):
                held = band[k, c - k + b]
                band[k, c - k + b] = band[pivot, c - pivot + b]
                band[pivot, c - pivot + b] = held
        inverse = 1.0 / band[k, b]
        for r in range(k + 1, last + 1):
            factor = band[r, k - r + b] * inverse
            band[r, k - r + b] = factor
            if factor != 0.0:
                for c in range(end - k):
                    band[r, k + 1 - r + b + c] -= factor * band[k, 1 + b + c]
    return True


@kernel
def solve(band, n, b, pivots, x):
    """Replace the right-hand side in x by the solution; band and pivots from ``factorise``."""
    for k in range(n):
        pivot = pivots[k]
        value = x[pivot]
        if pivot != k:
            x[pivot] = x[k]
            x[k] = value
        for r in range(k + 1, min(k + b, n - 1) + 1):
            x[r] -= band[r, k - r + b] * value
    for k in range(n - 1, -1, -1):
        value = x[k]
        for c in range(k + 1, min(k + 2 * b, n - 1) + 1):
            value -= band[k, c - k + b] * x[c]
        x[k] = value / band[k, b]


@kernel
def factorise_definite(band, n, b):
    """LU factors in place without pivoting; False if a pivot is not positive.

    For matrices whose symmetric part is positive definite, as those of strongly monotone
    equations: all leading minors are positive, so none is needed. Rows have 2 b + 1 entries;
    diagonals are left as their reciprocals.
    """
    for k in range(n):
        if not 0.0 < band[k, b] < np.inf:
            return False
        inverse = 1.0 / band[k, b]
        band[k, b] = inverse
        for r in range(k + 1, min(k + b, n - 1) + 1):
            factor = band[r, k - r + b] * inverse
            band[r, k - r + b] = factor
            if factor != 0.0:
                for c in range(1, min(b, n - 1 - k) + 1):
                    band[r, k + c - r + b] -= factor * band[k, c + b]
    return True


@kernel
def solve_definite(band, n, b, x):
    """Replace the right-hand side in x by the solution; band from ``factorise_definite``."""
    for r in range(1, n):
        value = x[r]
        for k in range(max(0, r - b), r):
            value -= band[r, k - r + b] * x[k]
        x[r] = value
    for r in range(n - 1, -1, -1):
        value = x[r]
        for c in range(r + 1, min(r + b, n - 1) + 1):
            value -= band[r, c - r + b] * x[c]
        x[r] = value * band[r, b]
