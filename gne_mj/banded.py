"""Banded matrices by rows, and how they are factorised and solved with.

Of a matrix with b diagonals on either side, ``band[r, c - r + b]`` is the entry in row r and
column c. Rows have 3 b + 1 entries: partial pivoting fills b more diagonals on the right. With
b = n - 1 it is a dense matrix.
"""

import numpy as np

from gne_mj.linear import add_part
from gne_mj.native import kernel

# Columns that a dense matrix is factorised by, and from how many on
BLOCK, LARGE = 32, 128
FEW = 4  # entries, of which a vector is not worth its beginning


@kernel
def factorise(band, n, b, pivots):
    """LU factors of the first n rows in place, with partial pivoting; False if singular.

    The package's only one with pivoting, for dense matrices too (b = n - 1).
    """
    if n < LARGE or b < n - 1:
        return eliminate(band, 0, n, n, n, b, pivots)
    for first in range(0, n, BLOCK):
        last = min(first + BLOCK, n)
        if not eliminate(band, first, last, last, n, b, pivots):
            return False
        catch_up(band, first, last, n, b, pivots)
    return True


@kernel
def eliminate(band, first, last, width, n, b, pivots):
    """Eliminate some columns, up to ``last``, from columns up to ``width``; False if singular.

    Diagonals are left as their reciprocals.
    """
    long = band.shape[1]
    for k in range(first, last):
        lowest = min(k + b, n - 1)
        pivot, largest = k, abs(band[k, b])
        for r in range(k + 1, lowest + 1):
            size = abs(band[r, k - r + b])
            if size > largest:
                pivot, largest = r, size
        pivots[k] = pivot
        if not largest > 0.0:
            return False
        end = min(k + 2 * b, width - 1)
        swap(band, k, pivot, k, end + 1, b)
        inverse = 1.0 / band[k, b]
        band[k, b] = inverse
        for r in range(k + 1, lowest + 1):
            factor = band[r, k - r + b] * inverse
            band[r, k - r + b] = factor
            if factor == 0.0:
                continue
            if end - k < FEW:
                for c in range(end - k):
                    band[r, k + 1 - r + b + c] -= factor * band[k, 1 + b + c]
            else:
                target = r * long + k + 1 - r + b
                add_part(-factor, band, k * long + b + 1, band, target, end - k)
    return True


@kernel
def swap(band, k, pivot, first, last, b):
    """Swap two rows in columns from ``first`` up to ``last``."""
    if pivot != k:
        for c in range(first, last):
            held = band[k, c - k + b]
            band[k, c - k + b] = band[pivot, c - pivot + b]
            band[pivot, c - pivot + b] = held


@kernel
def catch_up(band, first, last, n, b, pivots):
    """Do to the columns from ``last`` on what eliminating those from ``first`` on did to others.

    Each entry goes through the same operations in the same order as without blocks, so that the
    factors are the same to the last bit, but a row stays in the cache meanwhile. Until then the
    block's multipliers are swapped along with their rows.
    """
    for k in range(first, last):
        swap(band, k, pivots[k], last, n, b)
        swap(band, k, pivots[k], first, k, b)
    for r in range(first + 1, n):
        reduce_row(band, r, first, last, n, b)
    for k in range(last - 1, first - 1, -1):
        swap(band, k, pivots[k], first, k, b)


@kernel
def reduce_row(band, r, first, last, n, b):
    """Take multiples of the block's rows off row r, its columns from ``last`` on."""
    row, k = band[r, last - r + b : n - r + b], first
    end = min(r, last)
    while k < end:
        f0, u0 = band[r, k - r + b], band[k, last - k + b : n - k + b]
        if k + 4 <= end:
            f1, f2, f3 = band[r, k - r + b + 1], band[r, k - r + b + 2], band[r, k - r + b + 3]
            if f0 != 0.0 and f1 != 0.0 and f2 != 0.0 and f3 != 0.0:
                u1 = band[k + 1, last - k - 1 + b : n - k - 1 + b]
                u2 = band[k + 2, last - k - 2 + b : n - k - 2 + b]
                u3 = band[k + 3, last - k - 3 + b : n - k - 3 + b]
                for c in range(len(row)):
                    row[c] = row[c] - f0 * u0[c] - f1 * u1[c] - f2 * u2[c] - f3 * u3[c]
                k += 4
                continue
        if f0 != 0.0:
            for c in range(len(row)):
                row[c] -= f0 * u0[c]
        k += 1


@kernel
def solve(band, n, b, pivots, x):
    """Replace the right-hand side in x by the solution; band and pivots from ``factorise``.

    Each entry waits for the one before. It is therefore handed on as a number, and is what enters
    the next one last.
    """
    if n == 0:
        return
    ahead = x[0]
    for k in range(n):
        pivot = pivots[k]
        value = ahead
        if pivot != k:
            value = x[pivot]
            x[pivot] = ahead
        x[k] = value
        last = min(k + b, n - 1)
        if k + 1 < n:
            ahead = x[k + 1]
        if k < last:
            ahead -= band[k + 1, b - 1] * value
        for r in range(k + 2, last + 1):
            x[r] -= band[r, k - r + b] * value
    found = x[n - 1] * band[n - 1, b]
    x[n - 1] = found
    for k in range(n - 2, -1, -1):
        value = x[k]
        for c in range(min(k + 2 * b, n - 1), k + 1, -1):
            value -= band[k, c - k + b] * x[c]
        if b > 0:
            value -= band[k, b + 1] * found
        found = value * band[k, b]
        x[k] = found


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
