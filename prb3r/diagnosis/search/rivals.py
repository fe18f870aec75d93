"""Which other effects explain a recording as well: refitted rivals, and how far their predictions are apart."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from prb3r.diagnosis.evidence.model_evidence import cost, plausible
from prb3r.diagnosis.fit.least_squares import fit
from prb3r.diagnosis.fit.model import Fit
from prb3r.diagnosis.library import SUSPECTS
from prb3r.diagnosis.library.hypothesis import Hypothesis
from prb3r.diagnosis.search.columns import beginning, linear_model
from prb3r.diagnosis.search.search import Search
from prb3r.diagnosis.search.selection import Choice

PROBES_FITTED = 2
"""Probes of one effect that full fits begin from."""


@dataclass(frozen=True, eq=False)
class Rival:
    """Another effect in place of a chosen one."""

    hypothesis: Hypothesis
    fitted: Fit
    distance: float
    """Squared whitened distance from the chosen model's prediction to the nearest of the rival's."""
    behind: float
    """How much worse it fits these readings: chi-square with its penalty."""

    @property
    def indistinguishable(self) -> bool:
        """Whether the recording cannot rank the two surely."""
        settings = self.fitted.model.settings
        near = self.distance < settings.alike or self.behind < settings.close_fit
        return near and self.behind < settings.hopeless_rise


def distance(of: Fit, to: Fit) -> float:
    """Least squared whitened distance between the prediction of `of` and any refit of `to` (linearised at `to`)."""
    apart, basis = to.apart(of), to.basis
    apart = apart - basis @ (basis.T @ apart)
    return float(apart @ apart)


def without_effect(fitted: Fit, number: int) -> Fit | None:
    """The model refitted without one of its effects; None where nothing of it is left to be compared."""
    return fit(fitted.model.without(number), fitted.model.without_share(fitted.p, number))


def replacements(chosen: Fit, number: int, search: Search) -> list[Fit]:
    """Full fits of the chosen model with effect `number` replaced by those that come nearest, linearised."""
    base, settings = without_effect(chosen, number), chosen.model.settings
    if base is None:
        return []
    least = settings.shortlist_share * (base.chi2 - chosen.chi2) / 2
    return added(base, search, least, barred=chosen.model.hypotheses[number])


def added(base: Fit, search: Search, least: float = 0.0, barred: Hypothesis | None = None) -> list[Fit]:
    """Full fits of a model with one more effect each, those that promise most in the linearised model.

    Parameters
    ----------
    least : rise of ln evidence that an effect must promise.
    barred : an effect that is not considered.
    """
    settings, library = base.model.settings, [hypothesis for hypothesis in search.library if hypothesis != barred]
    linear, present = linear_model(base, library, search.log_odds)
    rise = linear.additions(present)
    most = settings.costly_shortlist if base.costly else settings.shortlist
    tasks: list[tuple[Fit, tuple[Hypothesis, ...], np.ndarray]] = []
    tried = dict[Hypothesis, int]()
    for k in np.argsort(-rise).tolist():
        hypothesis = linear.columns[k].hypothesis
        costly = SUSPECTS[hypothesis.kind].costly and rise[k] < settings.costly_share * rise.max()
        if rise[k] < least or len(tasks) == most or costly or tried.get(hypothesis, 0) == PROBES_FITTED:
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
    base, hypotheses, start = task
    return fit(base.model.adding(hypotheses[-1]), start, useful=base.chi2)


def rivals(choice: Choice, number: int, search: Search) -> list[Rival]:
    """Rivals of the chosen effect `number`, the nearest first; those that cannot be told apart and those that can."""
    chosen = choice.fitted
    effects, others = chosen.model.hypotheses, chosen.model.without(number).hypotheses
    if effects[number] in choice.settled:
        return []
    refitted = [fitted for fitted in choice.tried if _replaces(fitted.model.hypotheses, effects[number], others)]
    out: dict[Hypothesis, Rival] = {}
    for fitted in [*refitted, *replacements(chosen, number, search)]:
        new = next(hypothesis for hypothesis in fitted.model.hypotheses if hypothesis not in others)
        if fitted.balanced and (plausible(fitted) or not new.free):
            rival = Rival(new, fitted, distance(chosen, fitted), cost(fitted) - cost(chosen))
            if new not in out or rival.behind < out[new].behind:
                out[new] = rival
    return sorted(out.values(), key=lambda rival: rival.behind)


def _replaces(hypotheses: Sequence[Hypothesis], old: Hypothesis, others: Sequence[Hypothesis]) -> bool:
    return len(hypotheses) == len(others) + 1 and set(others) <= set(hypotheses) and old not in hypotheses
