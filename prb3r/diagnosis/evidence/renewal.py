"""A fit renewed under the covariance that its own prediction gives, and the noise level estimated around it."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from prb3r.diagnosis.evidence.linearised import moved_readings, probes_of
from prb3r.diagnosis.evidence.noise_level import EstimatedLevel, ReadingChanges, noise_level
from prb3r.diagnosis.evidence.outliers import Doubts
from prb3r.diagnosis.evidence.repeatability import Uncertain, of_sequences, repeatability
from prb3r.diagnosis.fit.covariance import reading_sd
from prb3r.diagnosis.fit.least_squares import fit
from prb3r.diagnosis.fit.model import Fit
from prb3r.diagnosis.fit.response import tension_response
from prb3r.diagnosis.fit.tolerance import tolerances
from prb3r.diagnosis.library.hypothesis import Hypothesis


def renewed(fitted: Fit, doubts: Doubts) -> Fit:
    """The model of `fitted`, refitted under the covariance around its own prediction; `fitted` if that fit fails.

    The covariance depends on the fit through the sensitivities to tensions and tolerances.
    """
    predict, settings = fitted.model.predict, fitted.model.settings
    model = replace(fitted.model, noise=doubts.noise(predict, fitted.solved, settings))
    return fit(model, fitted.p) or fitted


def level_under(fitted: Fit, doubts: Doubts, library: Sequence[Hypothesis]) -> EstimatedLevel:
    """The noise level estimated around a fit, where tensions, tolerances and further effects may be off too.

    These effects are the hypotheses of `library` that vanish continuously and are not in the model, each with its prior
    standard deviation.
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
    tensions = of_sequences(recording, scatter, lasts.lasting)
    changes = ReadingChanges(model.moved(fitted.p, fitted.solved), tensions, possible)
    return noise_level(recording, misfit, changes, inflation, settings, lasts)
