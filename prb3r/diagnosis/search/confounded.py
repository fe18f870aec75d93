"""Effects that are not in a model, but would leave Young's modulus or friction much less certain.

Soft clamps bend an arm as a lower modulus does.  A recording that tells the two hardly apart is described as well
without the clamps, and the search, which looks for more evidence, leaves them out.  Their probability is small then,
but not zero, and intervals of the modulus and predictions for other designs have to hold them.
"""

from collections.abc import Iterable, Sequence
from typing import TypeVar

import numpy as np

from prb3r.diagnosis.evidence.linearised import moved_readings, probes_of
from prb3r.diagnosis.fit.joint import JointFit
from prb3r.diagnosis.fit.model import Fit
from prb3r.diagnosis.library.hypothesis import Hypothesis
from prb3r.diagnosis.library.joint import JointHypothesis
from prb3r.diagnosis.search.joint_columns import frictions_of, moved_together

Suspected = TypeVar("Suspected", Hypothesis, JointHypothesis)


def confounded(fitted: Fit, library: Sequence[Hypothesis]) -> set[Hypothesis]:
    """The hypotheses of a `library` that are not in a fit, and beside which the ln of Young's modulus or of friction
    has `Settings.confounded` times its standard deviation or more from what is added."""
    model = fitted.model
    probes = probes_of(fitted, [one for one in library if one not in model.hypotheses and one.continuous])
    moved = [
        model.noise.whiten(change * hypothesis.deviations)
        for (hypothesis, _), change in zip(probes, moved_readings(fitted, probes), strict=True)
    ]
    among = zip([hypothesis for hypothesis, _ in probes], moved, strict=True)
    return _confounding(fitted, among, [k for k, name in enumerate(model.varied) if name in model.widest])


def jointly_confounded(fitted: JointFit, library: Sequence[JointHypothesis]) -> set[JointHypothesis]:
    """As :func:`confounded`, of a joint fit: the constants are those of all recordings; those of a rig's own for what
    it should share are left out."""
    model, frictions = fitted.model, frictions_of(fitted)
    others = [one for one in library if one not in model.hypotheses and one.continuous and one.parting is None]
    moved = moved_together(fitted, [(one, one.starts(frictions)[0]) for one in others])
    scales = [k for k, (name, rigs) in enumerate(model.varied) if name in model.rigs[rigs[0]].widest]
    return _confounding(fitted, zip(others, moved, strict=True), scales)


def _confounding(
    fitted: Fit | JointFit, among: Iterable[tuple[Suspected, np.ndarray]], constants: Sequence[int]
) -> set[Suspected]:
    """The hypotheses, each with its whitened changes as for :func:`widening`, beside which one of the `constants`, by
    number, is much less certain."""
    known = np.sqrt(np.diag(fitted.covariance)[constants])
    least = fitted.model.settings.confounded * known
    return {hypothesis for hypothesis, white in among if (widening(fitted, white)[constants] > least).any()}


def widening(fitted: Fit | JointFit, white: np.ndarray) -> np.ndarray:
    """(p,) what an effect adds to the standard deviation of every parameter of a fit, in the linearised model.

    Parameters
    ----------
    white : (r, k) whitened changes of the readings per prior standard deviation of each free parameter of the effect,
        of which each is taken by itself, and the largest result counts.
    """
    along = fitted.jacobian[: len(white)].T @ white
    shift = fitted.covariance @ along
    told = np.sum(white**2, axis=0) - np.sum(along * shift, axis=0)
    return np.max(np.abs(shift) / np.sqrt(1 + np.maximum(told, 0.0)), axis=1, initial=0.0)
