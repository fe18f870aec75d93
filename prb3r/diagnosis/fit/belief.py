"""What other recordings say of the parameters of a model: a normal distribution, added to the least squares as rows."""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

NOTHING_TOLD = 1e-10
"""Eigenvalue of the precision, as a share of the largest, up to which nothing counts as told along its direction."""


class Rows(NamedTuple):
    """Residuals target - root p of a model with the parameters p."""

    root: np.ndarray
    """(k, p) derivatives of the residuals, with the other sign."""
    target: np.ndarray
    """(k,) residuals of parameters that are all 0."""


@dataclass(frozen=True, eq=False)
class Belief:
    """A normal distribution of k parameters, held as its precision, which is 0 along directions that nothing is known
    of."""

    names: tuple[object, ...]
    """(k,) keys of the parameters: any values that tell them apart, as of `Parametrisation.names`."""
    precision: np.ndarray
    """(k, k) inverse covariance."""
    vector: np.ndarray
    """(k,) precision times mean."""

    def of(self, names: tuple[object, ...]) -> "Belief":
        """The marginal distribution of those parameters that are among `names`."""
        kept = np.array([name in names for name in self.names], bool)
        precision, vector = self.precision[np.ix_(kept, kept)], self.vector[kept]
        if not kept.all():
            across = self.precision[np.ix_(kept, ~kept)] @ np.linalg.pinv(
                self.precision[np.ix_(~kept, ~kept)], NOTHING_TOLD, hermitian=True
            )
            precision = precision - across @ self.precision[np.ix_(~kept, kept)]
            vector = vector - across @ self.vector[~kept]
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
