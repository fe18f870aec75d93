"""What a set of columns can explain."""

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
