"""The choice among surviving models by how well they predict the sequences set aside."""

from dataclasses import replace

import numpy as np

from prb3r.diagnosis.checks.unseen import Unseen
from prb3r.diagnosis.fit.calibrate import constants_as_drawn
from prb3r.diagnosis.fit.least_squares import polished
from prb3r.diagnosis.fit.model import Fit
from prb3r.diagnosis.search.search import Search, examine
from prb3r.diagnosis.search.selection import Choice


def predicting(choice: Choice, fresh: Unseen | None, search: Search) -> Choice:
    """The choice, changed to another surviving model where the sequences set aside favour that one.

    If the chosen model does not predict them, the most probable model that does takes its place, of those with no more
    effects than the chosen one if there is one: further effects should be named by the evidence of the fitted sequences
    alone.  Otherwise, if the chosen model is a proper part of the most probable one, its place is taken by the smallest
    part that contains it and is not much less probable by fitted and held-out sequences together.  No model takes the
    place that misleads (:func:`_misleads`).  One that does is fitted until it converges, as the verdict rests on it.
    """
    if fresh is None:
        return choice
    if fresh.refutes(choice.fitted):
        count, least = len(choice.fitted.model.hypotheses), choice.fitted.model.settings.alike_rate
        likely = [s.fitted for s in choice.survivors if s.probability >= least and len(s.effects) <= count]
        other = next((fitted for fitted in likely if not fresh.refutes(fitted)), None)
        if other is not None:
            return _with(other, choice, search)
    fuller = _by_all_sequences(choice, fresh)
    if fuller is choice.fitted and fresh.refutes(choice.fitted):
        fuller = _likeliest_that_predicts(choice, fresh) or choice.fitted
    if fuller is choice.fitted or _misleads(fuller, choice, fresh):
        return choice
    return _with(fuller, choice, search)


def is_picked(choice: Choice, before: Fit, fresh: Unseen | None) -> bool:
    """Whether a model with more effects than the one chosen `before` was taken since that one does not predict the
    sequences set aside."""
    more = len(choice.fitted.model.hypotheses) > len(before.model.hypotheses)
    return more and fresh is not None and fresh.refutes(before)


def _likeliest_that_predicts(choice: Choice, fresh: Unseen) -> Fit | None:
    """The most probable surviving model that predicts the sequences set aside, of any number of effects; None without
    one that is not much less probable than all others together (`Settings.alike_rate`)."""
    likely = [s for s in choice.survivors if s.probability >= choice.fitted.model.settings.alike_rate]
    ranked = sorted(likely, key=lambda survivor: -survivor.probability)
    return next((survivor.fitted for survivor in ranked if not fresh.refutes(survivor.fitted)), None)


def _misleads(fuller: Fit, choice: Choice, fresh: Unseen) -> bool:
    """Whether a model would be the first to name an effect, and predicts the sequences set aside worse than constants
    alone do, both with all parts as drawn (`Settings.worse`): parts within their tolerances would make up for it."""
    if choice.effects:
        return False
    return fresh.errors(constants_as_drawn(choice.calibrated), fuller).is_worse(fuller.model.settings.worse)


def _with(other: Fit, choice: Choice, search: Search) -> Choice:
    """The choice with another model, fitted until it converges, and the scores of what that leaves."""
    fitted = other if other.converged else polished(other)
    return replace(choice, fitted=fitted, scores=examine(fitted, search))


def _by_all_sequences(choice: Choice, fresh: Unseen) -> Fit:
    """The smallest part of the most probable model that contains the chosen effects and is nearly as probable.

    Its ln density of fitted and held-out sequences is within `Settings.simpler_reach` of the largest.  The chosen fit
    comes back if it is the smallest, and also if the smallest part misses a held-out sequence significantly
    (`Settings.alike_rate`): if all models are wrong, densities do not tell which effects are right.
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
    predicts = all(sequence.p >= settings.alike_rate for sequence in fresh.by_sequence(chosen))
    return chosen if predicts else choice.fitted
