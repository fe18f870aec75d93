"""What a set of columns can explain."""

from collections.abc import Callable, Sequence

import numpy as np

INDEPENDENT = 1e-8
"""Singular value, of columns of length 1, up to which a combination of them repeats others but for rounding."""


def basis_of(jacobian: np.ndarray) -> np.ndarray:
    """Orthonormal basis of the columns, without those that are nothing or repeat others."""
    size = np.linalg.norm(jacobian, axis=0)
    columns = jacobian[:, size > 0] / size[size > 0]
    if not columns.size:
        return np.zeros((len(jacobian), 0))
    basis, length, _ = np.linalg.svd(columns, full_matrices=False)
    return basis[:, length > INDEPENDENT]


def freed(values: np.ndarray, basis: np.ndarray) -> np.ndarray:
    """What constants cannot imitate of how effects move the readings.

    Parameters
    ----------
    values : (r, k) whitened readings, without the rows of priors, where effects move nothing.
    basis : (r + c, c) orthonormal, of what the constants do to readings and priors.

    Returns
    -------
    (r + c, k) orthogonal to `basis`; taken off twice, against rounding.
    """
    whole = np.vstack([values, np.zeros((len(basis) - len(values), values.shape[1]))])
    whole -= basis @ (basis.T @ whole)
    return whole - basis @ (basis.T @ whole)


def all_at_once(function: Callable[[np.ndarray], np.ndarray], parts: Sequence[np.ndarray]) -> list[np.ndarray]:
    """What a linear `function` of columns makes of each of `parts` (r, k each), of all at once, as that takes less
    time."""
    if not parts:
        return []
    return np.split(function(np.hstack(parts)), np.cumsum([part.shape[1] for part in parts])[:-1], axis=1)
