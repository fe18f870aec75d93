"""One effect of a fitted model left out, added, or exchanged for the most probable others.

If plates already stiffen in a model, disks that touch change hardly anything, and the linearised model around it never
proposes to exchange the one for the other.  What could replace an effect shows only around the model that is refitted
without it.
"""

from collections.abc import Callable, Iterable

import numpy as np

from prb3r.diagnosis.evidence.model_evidence import log_evidence
from prb3r.diagnosis.fit.least_squares import fit
from prb3r.diagnosis.fit.model import Fit
from prb3r.diagnosis.library import SUSPECTS
from prb3r.diagnosis.library.hypothesis import Hypothesis
from prb3r.diagnosis.search.columns import beginning, linear_model
from prb3r.diagnosis.search.confounded import confounded
from prb3r.diagnosis.search.linear_selection import LinearModel
from prb3r.diagnosis.search.search import Search


def without_effect(fitted: Fit, number: int, give_up_above: float = np.inf) -> Fit | None:
    """The model refitted without effect `number`; None if the fit fails or is given up (see :func:`fit`)."""
    start = fitted.model.without_share(fitted.p, number)
    return fit(fitted.model.without(number), start, give_up_above=give_up_above)


def replacements(chosen: Fit, number: int, search: Search) -> list[Fit]:
    """Full fits of the chosen model with effect `number` replaced by others.

    The others are the most promising ones in the linearised model without the effect: those whose gain in ln likelihood
    is at least `Settings.shortlist_share` of that of the effect, but `Settings.fewest_replacements` in any case, as one
    that refits much else gains far more than that model promises.  Of effects beside which the constants are much less
    certain (:func:`confounded`), for which linearised gains are poor guides, all are fitted that may survive.
    """
    base, settings = without_effect(chosen, number), chosen.model.settings
    if base is None:
        return []
    gain = (base.chi2 - chosen.chi2) / 2
    lost = log_evidence(chosen, search.log_odds) - log_evidence(base, search.log_odds)
    among = confounded(base, search.general_forms)

    def worth(linear: LinearModel, present: frozenset[int]) -> np.ndarray:
        rise = linear.additions(present)
        survives = linear.has_any_of(among) & (rise >= lost - np.log(settings.survival_odds))
        best = np.sort(rise)[-settings.fewest_replacements :]
        least = min([settings.shortlist_share * gain, *best])
        return np.where((rise >= least) | survives, rise, -np.inf)

    return added(base, search, worth, barred=chosen.model.hypotheses[number])


def replacements_of(chosen: Fit, numbers: Iterable[int], search: Search) -> list[Fit]:
    """The :func:`replacements` of each of the effects `numbers` of a model; the effects are tasks of their own."""
    found = search.apply(_replacements, [(chosen, number, search.here) for number in numbers])
    return [fitted for fits in found for fitted in fits]


def _replacements(task: tuple[Fit, int, Search]) -> list[Fit]:
    return replacements(*task)


def with_confounded(fitted: Fit, search: Search) -> list[Fit]:
    """Full fits of a model with one more effect each: those that the recording does not rule out
    (`Settings.survival_odds`) and beside which the constants are much less certain (:func:`confounded`)."""
    among, least = confounded(fitted, search.general_forms), -np.log(fitted.model.settings.survival_odds)

    def worth(linear: LinearModel, present: frozenset[int]) -> np.ndarray:
        rise = linear.additions(present)
        return np.where(linear.has_any_of(among) & (rise >= least), rise, -np.inf)

    return added(fitted, search, worth)


def added(
    base: Fit,
    search: Search,
    worth: Callable[[LinearModel, frozenset[int]], np.ndarray],
    barred: Hypothesis | None = None,
) -> list[Fit]:
    """Full fits of a model with one more effect each, the most promising ones in the linearised model.

    An effect with several starts is fitted from its best ones, and the best of these fits comes back.

    Parameters
    ----------
    worth : returns (columns,) how promising each column of the linearised model is beside the given ones; minus
        infinity where it is not to be fitted.
    barred : a hypothesis that is not considered.
    """
    settings, library = base.model.settings, [hypothesis for hypothesis in search.general_forms if hypothesis != barred]
    linear, present = linear_model(base, library, search.log_odds)
    rise = worth(linear, present)
    most = settings.costly_shortlist if base.costly else settings.shortlist
    tasks: list[tuple[Fit, tuple[Hypothesis, ...], np.ndarray]] = []
    tried = dict[Hypothesis, int]()
    for k in np.argsort(-rise).tolist():
        hypothesis = linear.columns[k].hypothesis
        costly = SUSPECTS[hypothesis.kind].costly and rise[k] < settings.costly_share * rise.max()
        enough = len(tasks) == most or tried.get(hypothesis, 0) == settings.probes_fitted
        if np.isneginf(rise[k]) or costly or enough:
            continue
        tried[hypothesis] = tried.get(hypothesis, 0) + 1
        tasks.append((base, *beginning(base, linear, [*sorted(present), k])))
    best: dict[Hypothesis, Fit] = {}
    for fitted in search.apply(_refitted, tasks):
        if fitted is not None:
            new = fitted.model.hypotheses[-1]
            best[new] = fitted if new not in best else min(best[new], fitted, key=lambda known: known.chi2)
    return list(best.values())


def _refitted(task: tuple[Fit, tuple[Hypothesis, ...], np.ndarray]) -> Fit | None:
    """The fit of a model with the last of the hypotheses added, from a start; None where it is no better."""
    base, hypotheses, start = task
    return fit(base.model.adding(hypotheses[-1]), start, give_up_above=base.chi2)
