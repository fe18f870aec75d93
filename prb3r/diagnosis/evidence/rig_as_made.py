r"""The posterior of the tolerances of a recorded rig: how its parts came out of the workshop.

The covariance of the readings holds the tolerances as :math:`G G^T`, with the change `G` of the readings by one
standard deviation of each.  Let `G`, the residuals `r` and their derivatives `J` by the parameters `u` be whitened by
the whole covariance, and `z` be standard normal.  Given the readings, the tolerances `t`, in units of their standard
deviations, are

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
    """(t,) names of the tolerances, as of :func:`prb3r.diagnosis.fit.tolerance.tolerances`; those stated as 0 are left
    out."""
    sd: np.ndarray
    """(t,) prior standard deviations, m; of the ln of a stiffness."""
    mean: np.ndarray
    """(t,) posterior means at the fitted parameters, in units of `sd`."""
    covariance: np.ndarray
    """(p + t, p + t) posterior covariance of the parameters and of the tolerances, these in units of `sd`."""

    def among(self, names: Sequence[str]) -> tuple[np.ndarray, np.ndarray]:
        """Means (k,) of the tolerances `names`, and covariance (p + k, p + k) of the parameters and these.

        A tolerance that the recording does not feel, as of a cable that is not pulled, keeps its prior: 0, variance 1.
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
    """The posterior of the tolerances of the rig, and of the parameters of `fitted`.

    The covariance of the readings is made anew around the fit.  Where parameters and tolerances move the readings
    alike, readings are told to a thousandth of what the tolerances scatter them by, so the covariance has to hold the
    sensitivities to the tolerances that exactly.

    Parameters
    ----------
    doubts : readings and weights that are not believed, and the level of the noise.
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
