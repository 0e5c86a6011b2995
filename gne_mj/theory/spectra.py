"""Eigenvalues and norms of matrices of any size.

Up to DENSE rows they are NumPy's. Beyond that a matrix that is a narrow band in some order, as that
of a line of robots, is treated as one, and of others no more is computed than is asked for.
"""

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from gne_mj.ordering import reverse_cuthill_mckee

if TYPE_CHECKING:
    from scipy.sparse import csr_array

Array = NDArray[np.float64]

DENSE, NARROW = 300, 32
# Of many eigenvalues those of the greatest magnitude, and how accurately
_GREATEST, _TOLERANCE = 6, 1e-4


def least_eigenvalue(symmetric: Array) -> float:
    """The least eigenvalue of a symmetric matrix (m, m)."""
    if len(symmetric) <= DENSE:
        return float(np.linalg.eigvalsh(symmetric)[0])
    return _eigenvalue(_sparse(symmetric), 0)


def norm(matrix: Array) -> float:
    """The greatest singular value of a matrix (m, m)."""
    if len(matrix) <= DENSE:
        return float(np.linalg.norm(matrix, 2))
    sparse = _sparse(matrix)
    few = sparse.nnz <= NARROW * len(matrix)
    square = sparse.T @ sparse if few else matrix.T @ matrix
    return float(np.sqrt(_eigenvalue(_sparse(square), len(matrix) - 1)))


def gram(matrix: Array) -> Array:
    """The products of the columns with each other, (m, m), of a matrix (n, m)."""
    if matrix.shape[1] <= DENSE:
        return matrix.T @ matrix
    sparse = _sparse(matrix)
    return (sparse.T @ sparse).toarray()


def positive_definite(symmetric: Array) -> bool:
    """Whether a symmetric matrix (m, m) is, by Cholesky's method."""
    try:
        if len(symmetric) > DENSE and (band := _band(_sparse(symmetric))) is not None:
            from scipy.linalg import cholesky_banded

            cholesky_banded(band, lower=True)
        else:
            np.linalg.cholesky(symmetric)
    except np.linalg.LinAlgError:  # SciPy's is the same
        return False
    return True


def eigenvalues(matrix: Array) -> NDArray[np.complex128]:
    """All eigenvalues of a matrix (m, m); of a large one some of the greatest magnitude."""
    if len(matrix) <= DENSE:
        return np.asarray(np.linalg.eigvals(matrix), dtype=np.complex128)
    from scipy.sparse.linalg import ArpackNoConvergence, eigs

    start = np.random.default_rng(0).normal(size=len(matrix))
    try:
        found = eigs(_sparse(matrix), k=_GREATEST, v0=start, tol=_TOLERANCE,
                     return_eigenvectors=False)  # fmt: skip
    except ArpackNoConvergence as error:
        found = error.eigenvalues
    return np.asarray(found, dtype=np.complex128)


def _sparse(matrix: "Array | csr_array") -> "csr_array":
    from scipy.sparse import csr_array  # slow to load, and for large matrices only

    return csr_array(matrix)


def _eigenvalue(symmetric: "csr_array", index: int) -> float:
    """One of the eigenvalues, which are numbered from the least."""
    from scipy.linalg import eig_banded, eigh

    if (band := _band(symmetric)) is not None:
        (value,) = eig_banded(
            band, lower=True, eigvals_only=True, select="i", select_range=(index, index)
        )
    else:
        (value,) = eigh(symmetric.toarray(), eigvals_only=True, subset_by_index=[index, index])
    return float(value)


def _band(symmetric: "csr_array") -> Array | None:
    """The lower diagonals of a symmetric matrix in a good order; None if they are many."""
    size = symmetric.shape[0]
    place = np.empty(size, dtype=np.int64)
    place[reverse_cuthill_mckee(symmetric.indptr, symmetric.indices)] = np.arange(size)
    entries = symmetric.tocoo()
    row, column = place[entries.coords[0]], place[entries.coords[1]]
    width = int(np.max(np.abs(row - column), initial=0))
    if width > NARROW:
        return None
    band, lower = np.zeros((width + 1, size)), row >= column
    band[(row - column)[lower], column[lower]] = entries.data[lower]
    return band
