"""The parts of a recorded rig in files, and its chain with them: what it is under other loads.

Another rig is made anew.
"""

from collections.abc import Mapping, Sequence

import numpy as np

from prb3r.diagnosis.evidence.outliers import Doubts
from prb3r.diagnosis.evidence.rig_as_made import rig_as_made
from prb3r.diagnosis.fit.model import Fit
from prb3r.diagnosis.fit.tolerance import mechanical_tolerances, mechanical_tolerances_of
from prb3r.errors import Problem, SpecError
from prb3r.mechanics.chain import Chain
from prb3r.model.manipulator import Manipulator, Strict
from prb3r.recording.recording import Tolerance

DIGITS = 4
"""To which numbers stand in a file: far more than are told."""
LEAST_ROUNDED = 1e-12
"""Number below which one is rounded to the same place as this: zero has no first digit."""


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

    Parameters
    ----------
    doubts : what of the recording is not believed, and the level of its noise.
    kept : the parameters that are told of; the others are averaged over.
    """
    acting = {tolerance.name for tolerance in mechanical_tolerances_of(fitted.model.predict, fitted.solved)}
    known, count = rig_as_made(fitted, doubts), len(fitted.p)
    felt = [k for k, name in enumerate(known.names) if name in acting]
    if not felt:
        return None
    told, rows = np.ix_(kept, kept), [count + k for k in felt]
    mixed = known.covariance[np.ix_(rows, kept)]
    slope = np.linalg.solve(known.covariance[told], mixed.T).T if len(kept) else mixed
    left = known.covariance[np.ix_(rows, rows)] - slope @ mixed.T
    variance, axes = np.linalg.eigh(left)
    shrunk = variance < 1 - fitted.model.settings.told_variance
    return PartsPosterior(
        names=[known.names[k] for k in felt],
        sd=known.sd[felt].tolist(),
        mean=_short(known.mean[felt]),
        slope=_short(slope),
        axes=_short(axes[:, shrunk]),
        shrink=_short(1 - np.sqrt(np.clip(variance[shrunk], 0.0, 1.0))),
    )


def _short(numbers: np.ndarray) -> list:
    """As lists for a file, each number to `DIGITS` digits."""
    size = 10.0 ** (DIGITS - 1 - np.floor(np.log10(np.maximum(np.abs(numbers), LEAST_ROUNDED))))
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
