"""How far the parts of a recorded rig are off their drawing, as `diagnosis.json` holds it, and the chain with such
parts, which predicts that rig under other loads.

Another rig has parts of its own, to which none of this applies.
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
"""Significant digits of numbers in the file: far more than are shown to readers."""
LEAST_ROUNDED = 1e-12
"""Smallest number whose own digits set the rounding: zero has no first digit."""


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
        """Deviations of all parts by name, each in the unit of its tolerance, where the parameters `u` are `away` (f,)
        from the best ones.

        `scatter`: (t,) standard normal numbers, for a random draw; None: the mean.
        """
        off = np.array(self.mean) + np.array(self.slope).reshape(len(self.mean), -1) @ away
        if scatter is not None:
            axes = np.array(self.axes).reshape(len(self.mean), -1)
            off += scatter - axes @ (np.array(self.shrink) * (axes.T @ scatter))
        return dict(zip(self.names, (off * self.sd).tolist(), strict=True))


def parts_posterior(fitted: Fit, doubts: Doubts, kept: Sequence[int]) -> PartsPosterior | None:
    """The distribution of the tolerances of a rig's parts, given its readings under a fit; None where all parts are
    exactly known.

    Parameters
    ----------
    doubts : readings and weights that are not believed, and the level of the noise.
    kept : numbers of the parameters that the distribution depends on; it is averaged over the others.
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
    """The numbers as lists for a file, each rounded to `DIGITS` significant digits."""
    size = 10.0 ** (DIGITS - 1 - np.floor(np.log10(np.maximum(np.abs(numbers), LEAST_ROUNDED))))
    return (np.round(numbers * size) / size).tolist()


def as_made(manipulator: Manipulator, off: Mapping[str, float]) -> Chain:
    """The chain of a manipulator whose parts are `off` by these amounts, by the name of their tolerance, each in its
    unit.

    Raises
    ------
    SpecError
        If the manipulator has no such part.
    """
    chain = manipulator.chain()
    pulled = np.ones(chain.offset.shape[1], bool)
    parts = {part.name: part for part in mechanical_tolerances(manipulator, Tolerance(), chain, pulled, apart=True)}
    for name, by in off.items():
        if name not in parts:
            raise SpecError(Problem(f"{manipulator.name} {name}", "no such part is off by a tolerance"))
        chain = parts[name].change(chain, by)
    return chain
