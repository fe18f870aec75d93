"""A start from small loads, where a rig is nearly linear: effects are found in the order in which loads show them."""

from dataclasses import replace

import numpy as np

from prb3r.diagnosis.evidence.outliers import Doubts
from prb3r.diagnosis.fit.least_squares import fit
from prb3r.diagnosis.fit.model import Fit
from prb3r.diagnosis.search.pool import Pool
from prb3r.diagnosis.search.search import Search
from prb3r.mechanics.chain import Loads


def load_share(loads: Loads) -> np.ndarray:
    """(s,) largest ratio of any tension or dead force of a step to its own maximum over all steps; 0 without loads."""
    every = np.abs(np.concatenate([loads.tension, loads.tip, loads.force.reshape(loads.steps, -1)], axis=1))
    largest = every.max(0, initial=0.0)
    return (every[:, largest > 0] / largest[largest > 0]).max(1, initial=0.0)


def from_small_loads(calibrated: Fit, search: Search, doubts: Doubts) -> Fit | None:
    """A model fitted to the whole recording with the effects that explain its small loads; None if there are too few
    readings under small loads.

    Effects are sought under loads up to each of `Settings.load_shares` in turn.
    """
    settings, whole, known = calibrated.model.settings, calibrated.model, None
    for share in settings.load_shares:
        small = at_small_loads(known or calibrated, doubts, share)
        if small is not None:
            pool = Pool(search, settings, [small])
            pool.explore(settings.later_expansions)
            best = pool.best
            known = fit(replace(whole, hypotheses=best.model.hypotheses), best.p)
    return known


def at_small_loads(known: Fit, doubts: Doubts, share: float) -> Fit | None:
    """The model `known` refitted to the readings under loads up to a `share` of the largest (:func:`load_share`).

    None where there are fewer than `Settings.fewest_small_loads` readings a parameter, or where the fit fails.
    """
    model, recording = known.model, known.recording
    read = (load_share(recording.loads) <= share)[recording.readings.step]
    if read.sum() < model.settings.fewest_small_loads * model.count:
        return None
    predict = replace(model.predict, recording=replace(recording, readings=recording.readings.where(read)))
    noise = replace(doubts, inflation=doubts.inflation[read]).noise(predict, known.solved, model.settings)
    return fit(replace(model, predict=predict, noise=noise), known.p)
