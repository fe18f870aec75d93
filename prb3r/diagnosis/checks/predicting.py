"""What sequences set aside say of the models that survive a search."""

from dataclasses import replace

import numpy as np

from prb3r.diagnosis.checks.heldout import Unseen
from prb3r.diagnosis.fit.model import Fit
from prb3r.diagnosis.search.search import Search, examine
from prb3r.diagnosis.search.selection import Choice


def predicting(choice: Choice, fresh: Unseen | None, search: Search) -> Choice:
    """The choice, or the surviving model that the sequences set aside speak for.

    Where the chosen model does not predict them, that is the most probable one that does.  It has at most as many
    effects, as one more has to be named by the evidence of the fitted sequences.  Where the chosen model is but a part
    of the most probable one, it is the smallest such part that is not much less probable by all sequences together, in
    which every effect is named by the evidence of both.  Where there is none, the choice stays.
    """
    if fresh is None:
        return choice
    if fresh.refutes(choice.fitted):
        count, least = len(choice.fitted.model.hypotheses), choice.fitted.model.settings.alike_rate
        likely = [s.fitted for s in choice.survivors if s.probability >= least and len(s.effects) <= count]
        other = next((fitted for fitted in likely if not fresh.refutes(fitted)), None)
        if other is not None:
            return replace(choice, fitted=other, scores=examine(other, search))
    fuller = _by_all_sequences(choice, fresh)
    return choice if fuller is choice.fitted else replace(choice, fitted=fuller, scores=examine(fuller, search))


def _by_all_sequences(choice: Choice, fresh: Unseen) -> Fit:
    """The smallest part of the most probable model, with all that is chosen, whose ln density of fitted and held-out
    sequences is within `Settings.simpler_reach` of the largest; the chosen fit where that is it.

    It also stays where the smallest part misses a held-out sequence by more than noise does in one recording of
    twenty: of models that are all wrong, densities do not tell which names are right.
    """
    best, count, settings = choice.survivors[0], fresh.recording.readings.count, choice.fitted.model.settings
    told = {}
    for survivor in choice.survivors:
        if choice.effects <= survivor.effects <= best.effects:
            fitted = choice.fitted if survivor.effects == choice.effects else survivor.fitted
            score = fresh.log_score(fitted)
            told[fitted] = survivor.log_evidence + (-np.inf if score is None else count * score)
    least = max(told.values(), default=-np.inf) - settings.simpler_reach
    near = [fitted for fitted, worth in told.items() if worth >= least > -np.inf]
    chosen = min(near, key=lambda fitted: (len(fitted.model.hypotheses), -told[fitted]), default=choice.fitted)
    predicts = all(sequence.p >= settings.alike_rate for sequence in fresh.judged(chosen))
    return chosen if predicts else choice.fitted
