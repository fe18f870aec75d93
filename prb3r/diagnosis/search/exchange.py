"""One effect of a fitted model left out, added, or exchanged for the likeliest others.

Beside plates that stiffen, disks that touch change next to nothing.  Around a model with the one effect the other is
therefore not seen, and the linearised model never proposes to exchange them.  What could replace an effect is seen
around the model that is fitted without it.
"""

from collections.abc import Callable

import numpy as np

from prb3r.diagnosis.fit.least_squares import fit
from prb3r.diagnosis.fit.model import Fit
from prb3r.diagnosis.library import SUSPECTS
from prb3r.diagnosis.library.hypothesis import Hypothesis
from prb3r.diagnosis.search.columns import beginning, linear_model
from prb3r.diagnosis.search.linear_selection import LinearModel
from prb3r.diagnosis.search.search import Search


def without_effect(fitted: Fit, number: int, useful: float = np.inf) -> Fit | None:
    """The model refitted without effect `number`; None where the fit fails or is of no use (`useful` as of
    :func:`fit`)."""
    return fit(fitted.model.without(number), fitted.model.without_share(fitted.p, number), useful=useful)


def replacements(chosen: Fit, number: int, search: Search) -> list[Fit]:
    """Full fits of the chosen model with effect `number` replaced by those that promise most in the linearised model
    without it: at least `Settings.shortlist_share` of the ln likelihood that the effect gains."""
    base, settings = without_effect(chosen, number), chosen.model.settings
    if base is None:
        return []
    least = settings.shortlist_share * (base.chi2 - chosen.chi2) / 2
    return added(base, search, least, barred=chosen.model.hypotheses[number])


def added(
    base: Fit,
    search: Search,
    least: float = 0.0,
    barred: Hypothesis | None = None,
    worth: Callable[[LinearModel, frozenset[int]], np.ndarray] = LinearModel.additions,
) -> list[Fit]:
    """Full fits of a model with one more effect each, of those that promise most in the linearised model; the best fit
    of each effect.

    Parameters
    ----------
    least : what an effect must promise, such as a rise of ln evidence.
    barred : a hypothesis that is not considered.
    worth : what every column promises (columns,) beside those of the model: by itself the rise of ln evidence.
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
        if rise[k] < least or costly or enough:
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
    return fit(base.model.adding(hypotheses[-1]), start, useful=base.chi2)
