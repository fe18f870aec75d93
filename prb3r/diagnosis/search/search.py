"""Among what is searched, and how."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any, TypeVar

import numpy as np
from scipy.special import logit

from prb3r.diagnosis.evidence.missing_moments import law_alternatives, laws, mechanism
from prb3r.diagnosis.evidence.score_test import Alternative, Scores, alternatives, scores
from prb3r.diagnosis.fit.model import Fit
from prb3r.diagnosis.library import SUSPECTS
from prb3r.diagnosis.library.hypothesis import Hypothesis
from prb3r.diagnosis.search.apply import Apply, serially
from prb3r.diagnosis.search.assumed import Assumed
from prb3r.diagnosis.settings import Settings

Done = TypeVar("Done")


@dataclass(frozen=True)
class Search:
    """Among what is searched, and how."""

    library: tuple[Hypothesis, ...]
    seed: int
    """Of the draws that tell how large the largest score is by chance."""
    apply: Apply = serially
    """Where full fits and costly tests are made."""
    assumed: Assumed = field(default_factory=Assumed)
    """What was found before, and is likely beforehand."""
    begun: Assumed = field(default_factory=Assumed)
    """What else is begun from, instead."""
    settings: Settings = Settings()
    """Of which it takes how probable kinds of effects are beforehand."""

    @cached_property
    def log_odds(self) -> Mapping[Hypothesis, float]:
        """ln of the prior odds of every hypothesis: those of its kind, shared among its places; where it was found
        before, its own."""
        kinds = [hypothesis.kind for hypothesis in self.library]
        odds = {kind: logit(SUSPECTS[kind].presence(self.settings)) - np.log(kinds.count(kind)) for kind in set(kinds)}
        known = dict.fromkeys(self.assumed.values, float(logit(self.settings.assumed_presence)))
        return {hypothesis: float(odds[hypothesis.kind]) for hypothesis in self.library} | known

    @property
    def here(self) -> "Search":
        """The same in this process alone: it can be handed to another one."""
        return replace(self, apply=serially)

    def until(
        self, function: Callable[[Any], Done], tasks: Sequence[Any], enough: Callable[[Done], bool]
    ) -> list[Done]:
        """What a function returns of tasks, up to the first that is enough; worker processes do all of them at once."""
        found = list[Done]()
        for result in map(function, tasks) if self.apply is serially else self.apply(function, tasks):
            found.append(result)
            if enough(result):
                break
        return found


def examine(fitted: Fit, search: Search) -> Scores:
    """Score test of what `fitted` leaves: every hypothesis that it lacks, and every law without a mechanism."""
    rest = [hypothesis for hypothesis in search.library if hypothesis not in fitted.model.hypotheses]
    history = fitted.solved.chain.presliding > 0
    share = fitted.model.settings.tested_together if history else max(len(rest), 1)
    tasks = [(fitted, rest[k : k + share]) for k in range(0, len(rest), share)]
    parts = (search.apply if history else serially)(_alternatives, tasks)
    mechanics = mechanism(fitted)
    unnamed = law_alternatives(fitted, mechanics, laws(fitted, mechanics))
    return scores(fitted, [*(candidate for part in parts for candidate in part), *unnamed], search.seed)


def _alternatives(task: tuple[Fit, Sequence[Hypothesis]]) -> list[Alternative]:
    return alternatives(*task)
