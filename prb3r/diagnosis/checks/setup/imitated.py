"""A blunder in the place of an effect that was found: one that the effect imitates, so that only the other effects show
it.

Screened with constants alone (`find.py`), a blunder is hidden by physics that was left out.  Beside what explains the
recording it shows nevertheless: an effect that imitates it is not needed once the recording is mended.
"""

from dataclasses import replace

import numpy as np

from prb3r.diagnosis.checks.setup.find import Blunder, blunder_by, remedies
from prb3r.diagnosis.checks.setup.remedy import Remedy
from prb3r.diagnosis.fit.least_squares import fit
from prb3r.diagnosis.fit.prediction import predictor
from prb3r.diagnosis.search.search import Search
from prb3r.diagnosis.search.selection import Choice
from prb3r.diagnosis.search.worth import worth_of
from prb3r.recording.recording import Recording


def blunder_in_place(recording: Recording, choice: Choice, search: Search) -> Blunder | None:
    """The blunder that is likeliest in the place of those chosen effects that imitate it; None if none is likelier than
    they are by `Settings.better_exchanged` in worth (:func:`worth_of`).

    Parameters
    ----------
    recording : with the sequences that were set aside.
    """
    settings = choice.fitted.model.settings
    among = remedies(recording, settings)
    gains = {remedy: _gain(remedy, recording, choice, search) for remedy in among if remedy.imitators & choice.kinds}
    best = max(gains, key=gains.__getitem__, default=None)
    if best is None or gains[best] <= settings.better_exchanged:
        return None
    close = gains[best] - settings.close_fit / 2
    alike = tuple(other.blunder for other, gain in gains.items() if other is not best and gain > close)
    return replace(blunder_by(best, recording, among, settings), alike=alike, faint=True)


def _gain(remedy: Remedy, recording: Recording, choice: Choice, search: Search) -> float:
    """By how much the worth of a choice rises if a remedy stands in the place of the effects that imitate it; minus
    infinity where that cannot be fitted."""
    fitted = choice.fitted
    model, p = fitted.model, fitted.p
    for number in reversed(range(len(model.hypotheses))):
        if model.hypotheses[number].kind in remedy.imitators:
            model, p = model.without(number), model.without_share(p, number)
    mended = remedy.mend(recording).recording
    of_fit = mended.only([k for k, name in enumerate(mended.sequences) if name in fitted.recording.sequences])
    instead = fit(replace(model, predict=predictor(of_fit, model.settings)), p)
    level = choice.level.level
    return -np.inf if instead is None else worth_of(instead, level, search) - worth_of(fitted, level, search)
