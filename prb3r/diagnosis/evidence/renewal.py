"""A fit renewed under the covariance that its own prediction gives, and the noise level estimated around it."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from prb3r.diagnosis.evidence.linearised import moved_readings, probes_of
from prb3r.diagnosis.evidence.noise_level import Around, EstimatedLevel, noise_level
from prb3r.diagnosis.evidence.outliers import Doubts
from prb3r.diagnosis.evidence.repeatability import Uncertain, of_sequences, repeatability
from prb3r.diagnosis.fit.covariance import reading_sd
from prb3r.diagnosis.fit.least_squares import fit
from prb3r.diagnosis.fit.model import Fit
from prb3r.diagnosis.fit.response import tension_response
from prb3r.diagnosis.fit.tolerance import tolerances
from prb3r.diagnosis.library.hypothesis import Hypothesis


def renewed(fitted: Fit, doubts: Doubts) -> Fit:
    """The model of `fitted`, refitted under the covariance around its prediction; `fitted` itself if that fit fails.

    Sensitivities to tensions and tolerances, and so the covariance, depend on the model.
    """
    predict, settings = fitted.model.predict, fitted.model.settings
    model = replace(fitted.model, noise=doubts.noise(predict, fitted.solved, settings))
    return fit(model, fitted.p) or fitted


def level_under(fitted: Fit, doubts: Doubts, library: Sequence[Hypothesis]) -> EstimatedLevel:
    """The estimated noise level around a fit, if tensions and tolerances may be off and effects of `library` present.

    Of the library, hypotheses that come by degrees and are not in the model count, each with its prior size.
    """
    predict, model = fitted.model.predict, fitted.model
    recording = predict.recording
    scatter = tension_response(predict, fitted.solved) * recording.measurement.tension_sd_relative
    smooth = [hypothesis for hypothesis in library if hypothesis.continuous and hypothesis not in model.hypotheses]
    probes = probes_of(fitted, smooth)
    moved = [
        values * hypothesis.deviations
        for (hypothesis, _), values in zip(probes, moved_readings(fitted, probes), strict=True)
    ]
    possible = np.hstack([tolerances(predict, fitted.solved).moved, *moved])
    misfit, settings = predict.misfit(model.readings(fitted.solved)), model.settings
    inflation = doubts.inflated(recording, settings)
    uncertain = Uncertain(reading_sd(recording) * inflation, scatter)
    lasts = repeatability(recording, misfit, uncertain, settings, doubts.level)
    around = Around(model.moved(fitted.p, fitted.solved), of_sequences(recording, scatter, lasts.lasting), possible)
    return noise_level(recording, misfit, around, inflation, settings, lasts)
