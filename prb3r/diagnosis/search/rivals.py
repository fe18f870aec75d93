"""Which other effects explain a recording as well: refitted rivals, and how far their predictions are apart."""

from collections.abc import Sequence
from dataclasses import dataclass

from prb3r.diagnosis.evidence.model_evidence import cost, plausible
from prb3r.diagnosis.fit.model import Fit
from prb3r.diagnosis.library.hypothesis import Hypothesis
from prb3r.diagnosis.search.exchange import replacements
from prb3r.diagnosis.search.search import Search
from prb3r.diagnosis.search.selection import Choice


@dataclass(frozen=True, eq=False)
class Rival:
    """Another effect in place of a chosen one."""

    hypothesis: Hypothesis
    fitted: Fit
    distance: float
    """Squared whitened distance from the chosen model's prediction to the nearest of the rival's."""
    behind: float
    """How much worse it fits these readings: chi-square with its penalty."""
    known: float = 0.0
    """By how much less it was to be expected, where the chosen one was found before: twice the ln of the odds."""

    @property
    def indistinguishable(self) -> bool:
        """Whether the recording, and what was known before, cannot rank the two surely."""
        settings = self.fitted.model.settings
        if self.known and self.behind + self.known >= settings.close_fit:
            return False
        near = self.distance < settings.alike or self.behind < settings.close_fit
        return near and self.behind < settings.hopeless_rise


def distance(of: Fit, to: Fit) -> float:
    """Least squared whitened distance between the prediction of `of` and any refit of `to` (linearised at `to`)."""
    apart, basis = to.apart(of), to.basis
    apart = apart - basis @ (basis.T @ apart)
    return float(apart @ apart)


def rivals(choice: Choice, number: int, search: Search) -> list[Rival]:
    """Rivals of the chosen effect `number`, each hypothesis once, those that fit best first, whether they can be told
    apart or not; none of an effect that other recordings show too."""
    chosen = choice.fitted
    effects, others = chosen.model.hypotheses, chosen.model.without(number).hypotheses
    if effects[number] in choice.settled:
        return []
    refitted = [fitted for fitted in choice.tried if _replaces(fitted.model.hypotheses, effects[number], others)]
    out, odds = dict[Hypothesis, Rival](), search.log_odds
    if frozenset(effects) not in choice.exchanged:
        refitted += replacements(chosen, number, search)
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
    return len(hypotheses) == len(others) + 1 and set(others) <= set(hypotheses) and old not in hypotheses
