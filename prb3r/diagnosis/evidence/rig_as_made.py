r"""How the parts of a recorded rig came out of the workshop, as far as its readings tell.

The covariance of the readings holds the tolerances of the parts as :math:`G G^T`, `G` the change of the readings by one
standard deviation of each.  With `G`, the residuals `r` and the derivatives `J` of the residuals by the parameters `u`
whitened by all of it, the tolerances `t` in units of their standard deviations are normal given the readings:

.. math::

    t = G^T r + G^T J (u - \hat u) + (1 - G^T G)^{1/2} z
"""

from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from prb3r.diagnosis.evidence.outliers import Doubts
from prb3r.diagnosis.fit.model import Fit
from prb3r.diagnosis.fit.tolerance import tolerances


class RigAsMade(NamedTuple):
    """Parameters and tolerances of a rig, given its readings under one model: a normal distribution."""

    names: tuple[str, ...]
    """(t,) of the tolerances, as of :func:`prb3r.diagnosis.fit.tolerance.tolerances`."""
    sd: np.ndarray
    """(t,) before the recording, in the unit of the name or of the logarithm of a stiffness."""
    mean: np.ndarray
    """(t,) with the best parameters, in these standard deviations."""
    covariance: np.ndarray
    """(p + t, p + t) of the parameters and of the tolerances in these standard deviations."""

    def among(self, names: Sequence[str]) -> tuple[np.ndarray, np.ndarray]:
        """Means (k,) of tolerances by name and the covariance (p + k, p + k) of the parameters and these.

        What the recording did not feel is as it was before.
        """
        count, numbers = len(self.covariance) - len(self.names), {name: k for k, name in enumerate(self.names)}
        here = [k for k, name in enumerate(names) if name in numbers]
        there = [numbers[names[k]] for k in here]
        mean, covariance = np.zeros(len(names)), np.eye(count + len(names))
        mean[here] = self.mean[there]
        rows, known = ([*range(count), *(count + k for k in part)] for part in (here, there))
        covariance[np.ix_(rows, rows)] = self.covariance[np.ix_(known, known)]
        return mean, covariance


def rig_as_made(fitted: Fit, doubts: Doubts) -> RigAsMade:
    """What the recording of a fit tells of its rig's parts.

    The covariance is made anew around the fit: along what parameters and tolerances do alike, readings are told to a
    thousandth of what the tolerances scatter them, and so closely the covariance has to hold these tolerances.

    Parameters
    ----------
    doubts : what of the recording is not believed, and the level of its noise.
    """
    predict, solved = fitted.model.predict, fitted.solved
    known = tolerances(predict, solved)
    felt = np.flatnonzero(known.sd > 0)
    model = replace(fitted.model, noise=doubts.noise(predict, solved, fitted.model.settings))
    moved = model.noise.whiten(known.moved[:, felt])
    mean = moved.T @ model.noise.whiten(predict.misfit(model.readings(solved)))
    together = -moved.T @ model.noise.whiten(model.moved(fitted.p, solved))  # G^T J
    mixed = together @ fitted.covariance
    unshared = np.eye(len(felt)) - moved.T @ moved + mixed @ together.T
    covariance = np.block([[fitted.covariance, mixed.T], [mixed, (unshared + unshared.T) / 2]])
    return RigAsMade(tuple(known.names[k] for k in felt), known.sd[felt], mean, covariance)
