"""The verdict on a choice, why it is `unexplained`, and the empirical law that is offered then."""

from collections.abc import Sequence

import numpy as np

from prb3r.diagnosis.chance import normal_critical
from prb3r.diagnosis.checks.heldout import HeldOut
from prb3r.diagnosis.checks.residuals import ALONG_STEPS, ModelCheck
from prb3r.diagnosis.checks.unseen import JudgedSequence, Unseen
from prb3r.diagnosis.evidence.model_evidence import cost
from prb3r.diagnosis.evidence.stated_accuracy import share_of_stated
from prb3r.diagnosis.fit.model import Fit
from prb3r.diagnosis.search.empirical_law import Closure, close
from prb3r.diagnosis.search.search import Search
from prb3r.diagnosis.search.selection import Choice
from prb3r.diagnosis.search.unknown_law import OF_TENSIONS, STAYING, unknown_law
from prb3r.diagnosis.settings import Settings
from prb3r.markdown import listed

FIELDS_MEANT = {
    "loads": "moments on the plates that go smoothly with the loads",
    "loads and slips": "moments on the plates that go smoothly with loads and slips",
    "steps": "moments on the plates that last from step to step",
    STAYING: "moments that come to single plates and stay",
    OF_TENSIONS: "tensions that go smoothly with the noted ones",
}
"""The fields of :func:`unknown_law` in words."""
MOST_ODDS = 1000
"""Largest odds that are given as a number in sentences."""


def why_unexplained(
    choice: Choice, failed: Sequence[JudgedSequence], doubted: Sequence[str], checks: Sequence[ModelCheck]
) -> str:
    """Why the verdict is `unexplained`, to follow "since"; empty if it is not.

    Parameters
    ----------
    failed : sequences set aside that the chosen model does not predict.
    doubted : for every weight that is not believed, the name of its cable.
    checks : only :data:`ALONG_STEPS` is used, and only if no effect is chosen.
    """
    settings, level = choice.fitted.model.settings, choice.level
    if not choice.fitted.balanced:
        return "no model that was found is in balance at every recorded step"
    if not choice.fitted.converged:
        return "the fit of the best model has not converged"
    if choice.beyond_stated and choice.by_score_alone:
        often = round(1 / choice.scores_of_best.chance)
        return (
            f"a score test is as large as in one of {often} recordings in which nothing is missing: no effect of the "
            "library is sure enough to account for that, and it may be chance"
        )
    if choice.beyond_stated:
        return "a real mismatch remains that no effect of the library accounts for"
    for name, scale, sd in [
        ("noise", level.reading, settings.noise_log_sd),
        ("scatter of the tensions", level.tension, settings.tension_log_sd),
    ]:
        if np.log(scale.low) > normal_critical(settings.naming_rate / 2) * sd:
            return (
                f"the {name} would have to be {scale.text} times as large as stated: either it is, and should be "
                "stated so, or something disturbs the readings that no effect of the library accounts for"
            )
    if failed:
        names = " and ".join(sequence.name for sequence in failed)
        return f"what explains the fitted sequences does not predict {names}, which no fit has seen"
    again = sorted({name for name in doubted if doubted.count(name) > 1})
    if again:
        which = f"cable{'s' * (len(again) > 1)} {' and '.join(again)}"
        return f"weights on {which} do not go with the readings at several steps, which is more than a slip of a label"
    lasting = any(check.name == ALONG_STEPS and check.p < settings.naming_rate for check in checks)
    if lasting and not choice.kinds and share_of_stated(choice.fitted, choice.doubts) >= 1:
        return "what is left lasts from step to step, as noise does not: something moves that no effect here moves so"
    return ""


def verdict_on(choice: Choice, unsure: bool, impossible: bool = False) -> str:
    """The verdict on a choice that passes every check: `adequate`, `explained` or `ambiguous`.

    Constants alone are `ambiguous` where some effect is there with a probability of `Settings.any_presence`,
    though none is sure enough to be named, and where one of them is `impossible` and an effect is likelier there than
    not.  What is left within a noise that is stated too large speaks for no effect.

    Parameters
    ----------
    unsure : whether another effect, or a blunder of the set-up, explains the recording as well as a chosen effect, a
        number of a chosen effect ends where the search ended or is one that no rig has, or sequences set aside are
        predicted by other models alone.
    impossible : whether a constant ends as far from its nominal value as is allowed, and that one does not fit.
    """
    settings = choice.fitted.model.settings
    if not choice.kinds:
        some = choice.of_any > settings.any_presence and not choice.structured
        return "ambiguous" if some or (impossible and choice.likely) else "adequate"
    more = max(choice.likely.values(), default=0.0) > settings.positive_presence
    return "ambiguous" if unsure or more or choice.alternatives or choice.structured else "explained"


def why_misleading(errors: HeldOut | None, settings: Settings) -> str:
    """Why the effects of a choice mislead, to follow "since"; empty if they do not.

    They mislead if they predict the sequences set aside `Settings.misleading` times as far off as constants alone do.
    Parts that are off within their tolerances then make up for them on this rig, and on no other.

    Parameters
    ----------
    errors : of the constants alone and of the choice, both with all parts as drawn; None where nothing was set aside.
    """
    shown = None if errors is None else errors.shown
    if errors is None or shown is None or shown.explained <= settings.misleading * shown.calibrated:
        return ""
    return (
        f"with all parts as drawn, what is named predicts {listed(errors.sequences)}, which no fit has seen, to "
        f"{shown.explained:.3g} {shown.unit}, and constants alone do to {shown.calibrated:.3g}; its "
        "numbers here are those refitted to parts as drawn"
    )


def why_doubtful(choice: Choice, search: Search) -> str:
    """Why the effects of a choice that passes every check are doubtful nevertheless; empty if they are not.

    They are doubtful if a law outside the library is likelier than they are, by odds above `Settings.likelihood_ratio`.
    This is not examined if other recordings support the effects, nor where what is left is structured, but within the
    stated accuracy: any smooth field would explain it.
    """
    best, settings = choice.survivors[0].fitted, choice.fitted.model.settings
    if not choice.kinds or choice.structured or best.model.belief is not None:
        return ""
    law = unknown_law(best, search.log_odds)
    if law.log_odds <= np.log(settings.likelihood_ratio):
        return ""
    odds = f"{np.exp(law.log_odds):.0f}" if law.log_odds < np.log(MOST_ODDS) else f"more than {MOST_ODDS}"
    names = [hypothesis.name for hypothesis in law.instead_of]
    where = f"in the place of {', '.join(names)}" if names else "beside all effects that were found"
    return (
        f"a law that no effect of the library has, {FIELDS_MEANT[law.field]}, stands {where} at odds of {odds} to one"
    )


def empirical_law(
    fresh: Unseen | None, calibrated: Fit, explained: Fit, seed: int
) -> tuple[Closure | None, float | None]:
    """The empirical law that describes the recording best, and its gain on the held-out sequences.

    A law is fitted beside the constants alone and beside the explained model.  The law is None if none has a smaller
    :func:`cost` than the `explained` model, or if it predicts the held-out sequences worse than the constants alone.
    The gain is None without a law and without held-out sequences.

    Parameters
    ----------
    fresh : the sequences set aside; None without any.
    """
    bases = [calibrated, explained] if explained.model.hypotheses else [calibrated]
    laws = [law for base in bases if (law := close(base, seed)) is not None and cost(law.fitted) < cost(explained)]
    if not laws:
        return None, None
    best = min(laws, key=lambda law: cost(law.fitted))
    heldout = fresh.errors(calibrated, best.fitted) if fresh else None
    if heldout is not None and heldout.chi2_explained > heldout.chi2_calibrated:
        return None, None
    return best, None if heldout is None else heldout.gain
