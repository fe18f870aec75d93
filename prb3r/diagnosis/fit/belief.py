"""What other recordings say of parameters of a model: a normal distribution, added to its least squares as rows."""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

NOTHING_TOLD = 1e-10
"""Share of the largest information below which a direction is not told."""


class Rows(NamedTuple):
    """Residuals root p - target of the parameters p."""

    root: np.ndarray
    """(k, p) derivatives of the residuals."""
    target: np.ndarray
    """(k,) what the residuals are without the parameters, with the other sign."""


@dataclass(frozen=True, eq=False)
class Belief:
    """A normal distribution by its information; directions that are not told have none."""

    names: tuple[object, ...]
    """(k,) parameters, in any terms that tell them apart."""
    precision: np.ndarray
    """(k, k) inverse covariance."""
    vector: np.ndarray
    """(k,) precision times mean."""

    def of(self, names: tuple[object, ...]) -> "Belief":
        """What is believed of some of the parameters, whatever the others are."""
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
        """The belief as rows of the least squares of a model with parameters `names` (p,)."""
        known = self.of(names)
        if not known.names:
            return Rows(np.zeros((0, len(names))), np.zeros(0))
        size, axes = np.linalg.eigh(known.precision)
        told = size > NOTHING_TOLD * max(size[-1], 1e-300)
        length, axes = np.sqrt(size[told]), axes[:, told]
        root = np.zeros((int(told.sum()), len(names)))
        root[:, [names.index(name) for name in known.names]] = length[:, None] * axes.T
        return Rows(root, axes.T @ known.vector / length)
