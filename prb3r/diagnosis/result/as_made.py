r"""How the parts of a recorded rig came out of the workshop, as far as its readings tell.

The covariance of the readings holds the tolerances of the parts as :math:`G G^T`, `G` the change of the readings by one
standard deviation of each.  With `G`, the residuals `r` and the derivatives `J` of the residuals by the parameters `u`
whitened by all of it, the tolerances `t` in units of their standard deviations are normal given the readings:

.. math::

    t = G^T r - G^T J (\hat u - u) + (1 - G^T G)^{1/2} z

and what is free beside `u`, the frame of the camera, is averaged over.  On the same rig under other loads this is what
its parts are; another rig is made anew.
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from prb3r.diagnosis.evidence.outliers import Doubts
from prb3r.diagnosis.fit.model import Fit
from prb3r.diagnosis.fit.tolerance import mechanical_tolerances, mechanical_tolerances_of, tolerances
from prb3r.errors import Problem, SpecError
from prb3r.mechanics.chain import Chain
from prb3r.model.manipulator import Manipulator, Strict
from prb3r.recording.recording import Tolerance

TOLD_VARIANCE = 0.05
"""Share of a direction's variance from which on it counts that a recording takes it away."""


class PartsPosterior(Strict):
    """The tolerances of a rig's parts, given its readings under one model: a normal distribution."""

    names: list[str]
    """(t,) as in :func:`prb3r.diagnosis.fit.tolerance.mechanical_tolerances`."""
    sd: list[float]
    """(t,) before the recording, in the unit of the name or of the logarithm of a stiffness."""
    mean: list[float]
    """(t,) with the best parameters, in these standard deviations."""
    slope: list[list[float]]
    """(t, f) by which they go with the parameters `u`."""
    axes: list[list[float]]
    """(t, k) orthonormal directions that the recording tells something of."""
    shrink: list[float]
    """(k,) 1 - standard deviation along them; elsewhere they scatter as before."""

    def at(self, away: np.ndarray, scatter: np.ndarray | None = None) -> dict[str, float]:
        """How far each is off, by name, where the parameters are `away` (f,) from the best.

        `scatter`: (t,) standard normal, for a draw; absent: the mean.
        """
        off = np.array(self.mean) + np.array(self.slope).reshape(len(self.mean), -1) @ away
        if scatter is not None:
            axes = np.array(self.axes).reshape(len(self.mean), -1)
            off += scatter - axes @ (np.array(self.shrink) * (axes.T @ scatter))
        return dict(zip(self.names, (off * self.sd).tolist(), strict=True))


def parts_posterior(fitted: Fit, doubts: Doubts, kept: Sequence[int]) -> PartsPosterior | None:
    """What a fit tells of the rig's parts; None where they are exactly known.

    The covariance is made anew around the fit: along what parameters and tolerances do alike, readings are told to a
    thousandth of what the tolerances scatter them, and so closely the covariance has to hold these tolerances.

    Parameters
    ----------
    doubts : what of the recording is not believed, and the level of its noise.
    kept : the parameters that are told of; the others are averaged over.
    """
    predict, solved = fitted.model.predict, fitted.solved
    acting = mechanical_tolerances_of(predict, solved)
    felt = [k for k, tolerance in enumerate(acting) if tolerance.sd > 0]
    if not felt:
        return None
    model = replace(fitted.model, noise=doubts.noise(predict, solved, fitted.model.settings))
    residual = model.noise.whiten(predict.misfit(model.readings(solved)))
    moved = model.noise.whiten(tolerances(predict, solved).moved[:, felt])
    together = -moved.T @ model.noise.whiten(model.moved(fitted.p, solved))  # (t, p): G^T J
    covariance = fitted.covariance
    mixed = together @ covariance[:, list(kept)]
    slope = np.linalg.solve(covariance[np.ix_(kept, kept)], mixed.T).T if len(kept) else mixed
    left = np.eye(len(felt)) - moved.T @ moved + together @ covariance @ together.T - slope @ mixed.T
    variance, axes = np.linalg.eigh((left + left.T) / 2)
    told = variance < 1 - TOLD_VARIANCE
    return PartsPosterior(
        names=[acting[k].name for k in felt],
        sd=[acting[k].sd for k in felt],
        mean=_short(moved.T @ residual),
        slope=_short(slope),
        axes=_short(axes[:, told]),
        shrink=_short(1 - np.sqrt(np.clip(variance[told], 0.0, 1.0))),
    )


def _short(numbers: np.ndarray) -> list:
    """As lists for a file, to four digits."""
    size = 10.0 ** (3 - np.floor(np.log10(np.maximum(np.abs(numbers), 1e-12))))
    return (np.round(numbers * size) / size).tolist()


def as_made(manipulator: Manipulator, off: Mapping[str, float]) -> Chain:
    """The chain of a manipulator whose parts are off by so much, by name.

    Raises
    ------
    SpecError
        If it has no such part.
    """
    chain = manipulator.chain()
    pulled = np.ones(chain.offset.shape[1], bool)
    parts = {part.name: part for part in mechanical_tolerances(manipulator, Tolerance(), chain, pulled)}
    for name, by in off.items():
        if name not in parts:
            raise SpecError(Problem(f"{manipulator.name} {name}", "no such part is off by a tolerance"))
        chain = parts[name].change(chain, by)
    return chain
