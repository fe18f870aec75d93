"""Whether the misfit of a model is smaller than the accuracy that the recording states.

The noise that is estimated is what changes from reading to reading.  The accuracy that a user states of a camera also
holds what does not change: a scale, a lens, markers.  So a misfit that changes smoothly and stays below the stated
accuracy does not speak against a model, though it is noticed.
"""

from dataclasses import replace

import numpy as np

from prb3r.diagnosis.chance import chi2_tail
from prb3r.diagnosis.evidence.outliers import Doubts
from prb3r.diagnosis.evidence.renewal import renewed
from prb3r.diagnosis.fit.covariance import as_stated
from prb3r.diagnosis.fit.model import Fit


def share_of_stated(fitted: Fit, doubts: Doubts) -> float:
    """Root mean square misfit of a model over the stated noise, raised to 1 unless the misfit is smaller throughout.

    Smaller throughout means two things.  If the stated noise were right, chi-square would be as small at a rate below
    `Settings.naming_rate`.  And on no disk and in no sequence is the mean square above the stated one, as it could be
    for a small part of the readings while the whole is below.
    """
    stated = renewed(fitted, replace(doubts, level=as_stated(fitted.recording)))
    readings, squared = stated.recording.readings, stated.misfit**2
    labels = readings.disk, stated.recording.of_sequence[readings.step]
    parts = [squared[label == part].mean() for label in labels for part in np.unique(label)]
    by_chance = 1 - chi2_tail(stated.chi2, stated.freedom)
    share = float(np.sqrt(squared.mean()))
    return share if by_chance < fitted.model.settings.naming_rate and max(parts) <= 1.0 else max(share, 1.0)
