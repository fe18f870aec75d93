"""Rivals of a chosen effect: models with another effect in its place, refitted, and how far predictions are apart."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

from prb3r.diagnosis.evidence.model_evidence import cost, plausible
from prb3r.diagnosis.fit.model import Fit
from prb3r.diagnosis.library.hypothesis import Hypothesis
from prb3r.diagnosis.search.exchange import replacements_of
from prb3r.diagnosis.search.search import Search
from prb3r.diagnosis.search.selection import Choice


@dataclass(frozen=True, eq=False)
class Rival:
    """Another effect that could replace a chosen one."""

    hypothesis: Hypothesis
    """The other effect."""
    fitted: Fit
    """The chosen model with it, refitted."""
    distance: float
    """Squared whitened distance between the prediction of the chosen model and the nearest prediction of the rival."""
    behind: float
    """How much worse the rival fits: its penalised chi-square (`cost`) less that of the chosen model."""
    known: float = 0.0
    """Twice the ln of the prior odds of the chosen effect against the rival if the former was found before; else 0."""

    @property
    def parameters(self) -> Mapping[str, float]:
        """The fitted parameters of the other effect by name, in SI units."""
        model, p = self.fitted.model, self.fitted.p
        share = model.shares(p)[model.hypotheses.index(self.hypothesis)]
        pairs = zip(self.hypothesis.free, share, strict=True)
        return {free.name: free.value(u, model.friction(p)) for free, u in pairs}

    @property
    def indistinguishable(self) -> bool:
        """Whether neither the recording nor prior knowledge ranks the two with certainty."""
        settings = self.fitted.model.settings
        if self.known and self.behind + self.known >= settings.close_fit:
            return False
        near = self.distance < settings.alike or self.behind < settings.close_fit
        return near and self.behind < settings.hopeless_rise


def distance(of: Fit, to: Fit) -> float:
    """Least squared whitened distance of the prediction of fit `of` from predictions of the model of fit `to`.

    The minimum is over all parameters of that model, linearised at `to`.
    """
    apart, basis = to.apart(of), to.basis
    apart = apart - basis @ (basis.T @ apart)
    return float(apart @ apart)


def with_replacements(choice: Choice, numbers: Sequence[int], search: Search) -> Choice:
    """The choice with the replacements of its effects `numbers` among what was tried; itself if the search has
    exchanged every effect of this set."""
    if choice.effects in choice.exchanged:
        return choice
    chosen = choice.fitted
    open_ones = [number for number in numbers if chosen.model.hypotheses[number] not in choice.settled]
    return replace(choice, tried=(*choice.tried, *replacements_of(chosen, open_ones, search)))


def rivals(choice: Choice, number: int, search: Search) -> list[Rival]:
    """All rivals of the chosen effect `number`, distinguishable or not: each hypothesis once, the best fit first.

    They are among what was tried, to which :func:`with_replacements` adds what the search has not exchanged.
    An effect that other recordings show too (`Choice.settled`) has none.
    """
    chosen = choice.fitted
    effects, others = chosen.model.hypotheses, chosen.model.without(number).hypotheses
    if effects[number] in choice.settled:
        return []
    refitted = [fitted for fitted in choice.tried if _replaces(fitted.model.hypotheses, effects[number], others)]
    out, odds = dict[Hypothesis, Rival](), search.log_odds
    for fitted in refitted:
        new = next(hypothesis for hypothesis in fitted.model.hypotheses if hypothesis not in others)
        if fitted.balanced and (plausible(fitted) or not new.free):
            before = effects[number] in search.assumed.values and new in odds
            known = 2 * (odds[effects[number]] - odds[new]) if before else 0.0
            rival = Rival(new, fitted, distance(chosen, fitted), cost(fitted) - cost(chosen), known)
            if new not in out or rival.behind < out[new].behind:
                out[new] = rival
    return sorted(out.values(), key=lambda rival: rival.behind)


def _replaces(hypotheses: Sequence[Hypothesis], old: Hypothesis, others: Sequence[Hypothesis]) -> bool:
    """Whether `hypotheses` are the `others` and one more that is not `old`."""
    return len(hypotheses) == len(others) + 1 and set(others) <= set(hypotheses) and old not in hypotheses
