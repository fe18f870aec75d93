"""The saturated start of a search: every common effect that the whole rig could have, fitted at once.

Effects that act only together cannot be found one after another.  Plates that soften, for example, let a notch close
that otherwise would not, and in a model that lacks one of the two effects the other improves nothing.  With all common
effects and priors on their sizes the fit is well posed.  Readings are included from small loads to large, so that the
fit follows the rig as it bends.  Effects that are not needed are left out afterwards.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from prb3r.diagnosis.evidence.model_evidence import log_evidence
from prb3r.diagnosis.evidence.outliers import Doubts
from prb3r.diagnosis.fit.least_squares import fit
from prb3r.diagnosis.fit.model import Fit
from prb3r.diagnosis.library import SUSPECTS
from prb3r.diagnosis.library.hypothesis import FORMS, Hypothesis
from prb3r.diagnosis.search.columns import linear_model
from prb3r.diagnosis.search.exchange import without_effect
from prb3r.diagnosis.search.search import Search
from prb3r.diagnosis.search.small_loads import at_small_loads
from prb3r.diagnosis.settings import Settings


def saturated(calibrated: Fit, search: Search, doubts: Doubts) -> Fit | None:
    """The fit of all common effects of the whole rig; None where a prediction is slow, where the library has no common
    effect, or where the fit fails."""
    together = common_of_whole_rig(search.library, calibrated.model.settings)
    if calibrated.costly or not together:
        return None
    model = replace(calibrated.model, hypotheses=together)
    friction = calibrated.model.friction(calibrated.p)
    p = np.concatenate([calibrated.p, *(hypothesis.starts(friction)[0] for hypothesis in together)])
    for share in calibrated.model.settings.saturated_shares:
        begun = replace(calibrated, model=model, p=p, solved=model.solve(p))
        small = at_small_loads(begun, doubts, share)
        p = p if small is None else small.p
    return fit(model, p)


def eliminated(full: Fit, search: Search) -> list[Fit]:
    """Backward elimination: the full fit, then the fits with one effect after another left out, down to one effect.

    In each step the effect is left out whose removal costs least evidence in the linearised model around the fit.  A
    fall of the evidence does not stop the elimination, as a fit with fewer effects is better posed and may find a
    better minimum.
    """
    fits = [full]
    while len(fits[-1].model.hypotheses) > 1 and (less := _without_one(fits[-1], search)) is not None:
        fits.append(less)
    return fits


def _without_one(fitted: Fit, search: Search) -> Fit | None:
    """The fit without the effect that is needed least in the linearised model; None if no fit succeeds.

    Even without an effect that was not needed, a fit may leave its valley.  If the evidence falls by
    `Settings.useful_reach` or more, the next effects are tried too, `Settings.left_out` in all, and the most probable
    fit is returned.
    """
    linear, present = linear_model(fitted, fitted.model.hypotheses, search.log_odds)
    order = sorted(present, key=lambda number: -linear.evidence(present - {number}))
    enough = log_evidence(fitted, search.log_odds) - fitted.model.settings.useful_reach
    fewer = (without_effect(fitted, number) for number in order[: fitted.model.settings.left_out])
    best, worth = None, -np.inf
    for less in fewer:
        if less is not None and (evidence := log_evidence(less, search.log_odds)) > worth:
            best, worth = less, evidence
        if worth >= enough:
            break
    return best


def common_of_whole_rig(library: Sequence[Hypothesis], settings: Settings) -> tuple[Hypothesis, ...]:
    """One hypothesis of every kind whose prior probability is `Settings.common_presence` or more.

    It is the form with the most parameters that concerns the whole rig, keeps predictions quick and can stand beside
    the hypotheses chosen before.
    """
    chosen = dict[str, Hypothesis]()
    for hypothesis in sorted(library, key=lambda suspected: -len(suspected.free)):
        whole = hypothesis.free and not hypothesis.costly and {name for name, _ in hypothesis.place} <= FORMS
        alone = hypothesis.kind not in chosen and not any(hypothesis.excludes(other) for other in chosen.values())
        if whole and alone and SUSPECTS[hypothesis.kind].presence(settings) >= settings.common_presence:
            chosen[hypothesis.kind] = hypothesis
    return tuple(chosen.values())
