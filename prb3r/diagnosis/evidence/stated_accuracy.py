"""Whether what a model leaves is less than the recording itself states of its accuracy.

The noise that is estimated is what changes from reading to reading.  What a user states of a camera also holds what
does not: a scale, a lens, markers.  A misfit that changes smoothly and stays below what is stated is within what the
measurement can say, so that it does not speak against a model, though it is seen.
"""

from dataclasses import replace

import numpy as np

from prb3r.diagnosis.chance import chi2_tail
from prb3r.diagnosis.evidence.outliers import Doubts
from prb3r.diagnosis.evidence.renewal import renewed
from prb3r.diagnosis.fit.covariance import AS_STATED
from prb3r.diagnosis.fit.model import Fit


def share_of_stated(fitted: Fit, doubts: Doubts) -> float:
    """What a model leaves over what the recording states, root mean square; 1 or more unless it is less everywhere.

    Less: less than chance would have it if the stated noise were right, at the rate `Settings.naming_rate`, and on no
    disk and in no sequence more than what is stated there, which a small part of all readings could be.
    """
    stated = renewed(fitted, replace(doubts, level=AS_STATED))
    readings, of_sequence = stated.model.predict.recording.readings, stated.model.predict.recording.of_sequence
    squared = stated.residual[: readings.count] ** 2
    parts = [squared[of == one].mean() for of in (readings.disk, of_sequence[readings.step]) for one in np.unique(of)]
    by_chance = 1 - chi2_tail(stated.chi2, stated.freedom)
    share = float(np.sqrt(squared.mean()))
    return share if by_chance < fitted.model.settings.naming_rate and max(parts) <= 1.0 else max(share, 1.0)
