"""Effects that are not in a model, but would leave Young's modulus or friction much less certain.

Soft clamps bend an arm as a lower modulus does.  A recording that tells the two hardly apart is described as well
without the clamps, and the search, which looks for more evidence, leaves them out.  Their probability is small then,
but not zero, and intervals of the modulus and predictions for other designs have to hold them.
"""

from collections.abc import Sequence

import numpy as np

from prb3r.diagnosis.evidence.linearised import moved_readings, probes_of
from prb3r.diagnosis.fit.model import Fit
from prb3r.diagnosis.library.hypothesis import Hypothesis


def confounded(fitted: Fit, library: Sequence[Hypothesis]) -> set[Hypothesis]:
    """The hypotheses of a `library` that are not in a fit, and beside which the ln of Young's modulus or of friction
    has `Settings.confounded` times its standard deviation or more from what is added."""
    model, settings = fitted.model, fitted.model.settings
    others = [hypothesis for hypothesis in library if hypothesis not in model.hypotheses and hypothesis.continuous]
    probes = probes_of(fitted, others)
    constants = [k for k, name in enumerate(model.varied) if name in model.widest]
    known = np.sqrt(np.diag(fitted.covariance)[constants])
    return {
        hypothesis
        for (hypothesis, _), change in zip(probes, moved_readings(fitted, probes), strict=True)
        if (widening(fitted, change * hypothesis.deviations)[constants] > settings.confounded * known).any()
    }


def widening(fitted: Fit, change: np.ndarray) -> np.ndarray:
    """(p,) what an effect adds to the standard deviation of every parameter of a fit, in the linearised model.

    Parameters
    ----------
    change : (r, k) changes of the readings per prior standard deviation of each free parameter of the effect, of which
        each is taken by itself, and the largest result counts.
    """
    white = fitted.model.noise.whiten(change)
    along = fitted.jacobian[: len(white)].T @ white
    shift = fitted.covariance @ along
    told = np.sum(white**2, axis=0) - np.sum(along * shift, axis=0)
    return np.max(np.abs(shift) / np.sqrt(1 + np.maximum(told, 0.0)), axis=1, initial=0.0)
