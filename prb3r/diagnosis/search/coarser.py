r"""A coarser likelihood: the effects that can be named although no set of effects explains the recording.

In that case the exact likelihood favours every effect that imitates a part of the remaining misfit.  This misfit is
correlated from step to step and from disk to disk, and is treated as correlated noise: with the reduced chi-square
:math:`\chi^2_r` and the correlations :math:`\rho` of neighbouring residuals along disks and steps, a reading is worth

.. math:: \eta = \frac{1}{\chi^2_r} \prod \frac{1 - \rho}{1 + \rho}

independent ones (the effective number of an autoregressive series), and the likelihood is raised to that power: Miller
and Dunson, J. Am. Stat. Assoc. 114 (2019) 1113, "Robust Bayesian inference via coarsening".
"""

from dataclasses import replace

import numpy as np

from prb3r.diagnosis.evidence.model_evidence import chi2_threshold
from prb3r.diagnosis.evidence.neighbours import NEIGHBOURS_ALONG, correlation
from prb3r.diagnosis.evidence.smooth_moments import chance_of_smooth_moments
from prb3r.diagnosis.fit.least_squares import fit, polished
from prb3r.diagnosis.fit.model import Fit
from prb3r.diagnosis.search.pool import Pool
from prb3r.diagnosis.search.search import Search, examine
from prb3r.diagnosis.search.selection import Choice, simplest


def coarsened(choice: Choice, search: Search) -> Choice:
    """The choice of effects under a coarser likelihood, for a `choice` with structured residuals.

    The survivors and their probabilities are those under the coarser likelihood.  The chosen model is refitted under
    the exact one, and both score tests are those of that fit.
    """
    fitted, settings = choice.fitted, choice.fitted.model.settings
    level = choice.doubts.level
    coarser = replace(choice.doubts, level=level._replace(scale=level.scale / np.sqrt(told_share(fitted))))
    noise = coarser.noise(fitted.model.predict, fitted.solved, settings)
    pool = Pool(search, settings, choice.tried).under(noise)
    pool.explore(settings.later_expansions)
    survivors = pool.survivors()
    standing = simplest(survivors, settings)
    exact = fit(replace(standing.model, noise=fitted.model.noise), standing.p)
    if exact is None:
        return choice
    exact = polished(exact)
    scores = examine(exact, search)
    return replace(
        choice,
        fitted=exact,
        survivors=survivors,
        scores=scores,
        scores_of_best=scores,
        smooth_moments=min(choice.smooth_moments, chance_of_smooth_moments(exact, search.seed)),
        chi2_threshold=chi2_threshold(exact),
    )


def told_share(fitted: Fit) -> float:
    """Number of independent readings, at most 1, that one reading is worth given the residuals of `fitted`: the power
    to which the likelihood is raised."""
    recording, most = fitted.recording, fitted.model.settings.most_alike
    alike = np.clip([correlation(recording, fitted.misfit, line) for line in NEIGHBOURS_ALONG], 0.0, most)
    return float(np.prod((1 - alike) / (1 + alike)) / max(fitted.reduced, 1.0))
