"""A beginning from the full side: every common effect that the whole rig could have, at once.

Effects that go together are not found one after another: plates that soften let a notch close that else would not, and
of a model that lacks one of them the other makes nothing better.  With all of them and the priors of their sizes a fit
is well posed, taken from small loads to large it follows the rig as it bends, and what is not needed is left out later.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from prb3r.diagnosis.evidence.outliers import Doubts
from prb3r.diagnosis.fit.least_squares import fit
from prb3r.diagnosis.fit.model import Fit
from prb3r.diagnosis.library import SUSPECTS
from prb3r.diagnosis.library.hypothesis import Hypothesis
from prb3r.diagnosis.search.columns import linear_model
from prb3r.diagnosis.search.exchange import without_effect
from prb3r.diagnosis.search.linear_selection import excludes
from prb3r.diagnosis.search.search import Search
from prb3r.diagnosis.search.small_loads import at_small_loads
from prb3r.diagnosis.settings import Settings

FORMS = frozenset({"law", "side", "sections"})
"""What a hypothesis may say beside its kind and still concern the whole rig: of what form the effect is, not where."""


def saturated(calibrated: Fit, search: Search, doubts: Doubts) -> Fit | None:
    """A fit of all common effects of the whole rig; None where a prediction is slow, or where no fit succeeds."""
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
    """A fit and those that are left as one effect after another is taken from it: backward elimination, down to one.

    Each time the effect goes that is missed least around the fit by the linearised model.  With fewer effects a fit is
    better posed and finds what the full one has not come to, so that one with less evidence is no reason to stop.
    """
    fits = [full]
    while len(fits[-1].model.hypotheses) > 1:
        linear, present = linear_model(fits[-1], fits[-1].model.hypotheses, search.log_odds)
        less = without_effect(fits[-1], max(present, key=lambda number: linear.evidence(present - {number})))
        if less is None:
            break
        fits.append(less)
    return fits


def common_of_whole_rig(library: Sequence[Hypothesis], settings: Settings) -> tuple[Hypothesis, ...]:
    """Of every kind that is as common as `Settings.common_presence` or more, the form with the most parameters, if it
    concerns the whole rig and can stand beside those before."""
    chosen = dict[str, Hypothesis]()
    for hypothesis in sorted(library, key=lambda suspected: -len(suspected.free)):
        whole = hypothesis.free and not hypothesis.costly and {name for name, _ in hypothesis.place} <= FORMS
        alone = hypothesis.kind not in chosen and not any(excludes(hypothesis, other) for other in chosen.values())
        if whole and alone and SUSPECTS[hypothesis.kind].presence(settings) >= settings.common_presence:
            chosen[hypothesis.kind] = hypothesis
    return tuple(chosen.values())
