"""What other recordings tell of a model's parameters: a normal distribution, added to the least squares as rows."""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

NOTHING_TOLD = 1e-10
"""Eigenvalue of a precision matrix, relative to the largest, at or below which nothing is known along its direction."""


def marginal_precision(precision: np.ndarray, kept: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The Schur complement by which a normal distribution of all parameters is reduced to the kept ones.

    Parameters
    ----------
    precision : (k, k) inverse covariance of all parameters.
    kept : (k,) which parameters are kept.

    Returns
    -------
    (m, m) the precision of the `m` kept parameters, and (m, k - m) a matrix `A`: with the vector `v` of all parameters
    (precision times mean), that of the kept ones is ``v[kept] - A @ v[~kept]``.
    """
    others = np.linalg.pinv(precision[np.ix_(~kept, ~kept)], NOTHING_TOLD, hermitian=True)
    across = precision[np.ix_(kept, ~kept)] @ others
    return precision[np.ix_(kept, kept)] - across @ precision[np.ix_(~kept, kept)], across


class Rows(NamedTuple):
    """Residuals target - root p of a model with the parameters p."""

    root: np.ndarray
    """(k, p) derivatives of the residuals, with opposite sign."""
    target: np.ndarray
    """(k,) residuals where all parameters are 0."""


@dataclass(frozen=True, eq=False)
class Belief:
    """A normal distribution of k parameters by its precision, which is 0 along directions of which nothing is known."""

    names: tuple[object, ...]
    """(k,) keys of the parameters: any values that tell them apart, as of `Parametrisation.names`."""
    precision: np.ndarray
    """(k, k) inverse covariance."""
    vector: np.ndarray
    """(k,) precision times mean."""

    def of(self, names: tuple[object, ...]) -> "Belief":
        """The marginal distribution of the parameters that are among `names`."""
        kept = np.array([name in names for name in self.names], bool)
        if kept.all():
            return self
        precision, across = marginal_precision(self.precision, kept)
        vector = self.vector[kept] - across @ self.vector[~kept]
        return Belief(tuple(name for name, keep in zip(self.names, kept, strict=True) if keep), precision, vector)

    def rows(self, names: tuple[object, ...]) -> Rows:
        """The distribution as rows of the least squares of a model whose parameters are `names` (p,)."""
        known = self.of(names)
        if not known.names:
            return Rows(np.zeros((0, len(names))), np.zeros(0))
        size, axes = np.linalg.eigh(known.precision)
        told = size > NOTHING_TOLD * max(size[-1], 1e-300)
        length, axes = np.sqrt(size[told]), axes[:, told]
        root = np.zeros((int(told.sum()), len(names)))
        root[:, [names.index(name) for name in known.names]] = length[:, None] * axes.T
        return Rows(root, axes.T @ known.vector / length)
