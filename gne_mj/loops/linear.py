"""Linear algebra of small dense systems, for native loops that allocate nothing."""

import numpy as np

from gne_mj.native import kernel


@kernel
def factorise(matrix, pivot):
    """LU with partial pivoting, in place, the diagonal as its reciprocals; False if singular.

    Args:
        matrix: (n, n), overwritten by the factors.
        pivot: (n,) integers, filled with the rows exchanged.
    """
    n = len(pivot)
    for c in range(n):
        best = c
        for r in range(c + 1, n):
            if abs(matrix[r, c]) > abs(matrix[best, c]):
                best = r
        pivot[c] = best
        if not 0.0 < abs(matrix[best, c]) < np.inf:
            return False
        if best != c:
            for k in range(n):
                matrix[c, k], matrix[best, k] = matrix[best, k], matrix[c, k]
        inverse = 1.0 / matrix[c, c]
        for r in range(c + 1, n):
            factor = matrix[r, c] * inverse
            matrix[r, c] = factor
            for k in range(c + 1, n):
                matrix[r, k] -= factor * matrix[c, k]
        matrix[c, c] = inverse
    return True


@kernel
def substitute(matrix, pivot, b):
    """Solve for b (n,), in place, with what :func:`factorise` left."""
    n = len(b)
    for c in range(n):
        b[c], b[pivot[c]] = b[pivot[c]], b[c]
    for r in range(1, n):
        total = b[r]
        for c in range(r):
            total -= matrix[r, c] * b[c]
        b[r] = total
    for back in range(n):
        r = n - 1 - back
        total = b[r]
        for c in range(r + 1, n):
            total -= matrix[r, c] * b[c]
        b[r] = total * matrix[r, r]


@kernel
def add_multiple(scale, source, target):
    """target += scale * source, over the length of target."""
    for r in range(len(target)):
        target[r] += scale * source[r]
