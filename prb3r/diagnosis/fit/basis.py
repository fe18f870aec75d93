"""Orthonormal bases of columns such as Jacobians, and projections by them."""

from collections.abc import Callable, Sequence

import numpy as np
import scipy

INDEPENDENT = 1e-8
"""Singular value, of columns scaled to length 1, up to which a direction is nothing but rounding."""


def left_singular(columns: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Left singular vectors (r, min(r, k)) and singular values of `columns` (r, k), largest first.

    By divide and conquer; where that does not converge, as it may for columns of low rank, by QR iterations, which take
    twice the time.
    """
    try:
        axes, size, _ = np.linalg.svd(columns, full_matrices=False)
    except np.linalg.LinAlgError:
        axes, size, _ = scipy.linalg.svd(columns, full_matrices=False, lapack_driver="gesvd")
    return axes, size


def basis_of(jacobian: np.ndarray) -> np.ndarray:
    """(r, b) orthonormal basis of the space of the columns of `jacobian` (r, p)."""
    size = np.linalg.norm(jacobian, axis=0)
    columns = jacobian[:, size > 0] / size[size > 0]
    if not columns.size:
        return np.zeros((len(jacobian), 0))
    basis, length = left_singular(columns)
    return basis[:, length > INDEPENDENT]


def projected_out(values: np.ndarray, basis: np.ndarray) -> np.ndarray:
    """The part of changes of the readings that parameters fitted already cannot imitate.

    Parameters
    ----------
    values : (r, k) changes of the whitened readings; those of the rows of priors are 0.
    basis : (r + c, b) orthonormal basis of what these parameters do to readings and rows of priors.

    Returns
    -------
    (r + c, k) orthogonal to `basis`; projected twice, against rounding.
    """
    whole = np.vstack([values, np.zeros((len(basis) - len(values), values.shape[1]))])
    whole -= basis @ (basis.T @ whole)
    return whole - basis @ (basis.T @ whole)


def all_at_once(function: Callable[[np.ndarray], np.ndarray], parts: Sequence[np.ndarray]) -> list[np.ndarray]:
    """A linear `function` of columns applied to each of `parts` (r, k each), in one call, which takes less time."""
    if not parts:
        return []
    return np.split(function(np.hstack(parts)), np.cumsum([part.shape[1] for part in parts])[:-1], axis=1)
