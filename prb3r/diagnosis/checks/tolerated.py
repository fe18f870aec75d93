"""The probable deviations of the parts of the rig from their drawing, under a fitted model."""

import numpy as np

from prb3r.diagnosis.evidence.outliers import Doubts
from prb3r.diagnosis.fit.covariance import noise_of
from prb3r.diagnosis.fit.model import Fit
from prb3r.diagnosis.fit.response import tension_response
from prb3r.diagnosis.fit.tolerance import EstimatedTolerances, estimated, tolerances


def tolerances_told(fitted: Fit, doubts: Doubts) -> EstimatedTolerances:
    """Estimates of the tolerances that the recording determines under a fitted model, the best determined first.

    These are the tolerances whose posterior standard deviation is below `Settings.told_share` of the prior one.
    """
    model, solved = fitted.model, fitted.solved
    predict, settings = model.predict, model.settings
    known = tolerances(predict, solved)
    inflation = doubts.inflated(predict.recording, settings)
    plain = noise_of(predict.recording, tension_response(predict, solved), inflation, doubts.level)
    misfit = predict.misfit(model.readings(solved))
    estimates = estimated(known, plain, misfit, model.moved(fitted.p, solved))
    told = np.flatnonzero(estimates.sd < settings.told_share * estimates.prior_sd)
    order = told[np.argsort(estimates.sd[told] / estimates.prior_sd[told])]
    return EstimatedTolerances(tuple(estimates.names[k] for k in order), *(part[order] for part in estimates[1:]))
