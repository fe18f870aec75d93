"""The input of a search for effects, and the score test of the residuals of a fit."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any, TypeVar

from scipy.special import logit

from prb3r.diagnosis.evidence.missing_moments import law_alternatives, laws, mechanism
from prb3r.diagnosis.evidence.score_test import Alternative, Scores, alternatives, scores
from prb3r.diagnosis.fit.model import Fit
from prb3r.diagnosis.library.hypothesis import Hypothesis
from prb3r.diagnosis.library.prior_odds import log_prior_odds
from prb3r.diagnosis.search.apply import Apply, serially
from prb3r.diagnosis.search.assumed import Assumed
from prb3r.diagnosis.settings import Settings

Done = TypeVar("Done")


@dataclass(frozen=True)
class Search:
    """The input of a search: the hypotheses to choose from, effects found before, and where tasks are run."""

    library: tuple[Hypothesis, ...]
    """All hypotheses that may be in a model."""
    seed: int
    """Seed of the draws that give the critical values of the largest score."""
    apply: Apply = serially
    """Runs full fits and costly tests, in this process or in workers."""
    assumed: Assumed = field(default_factory=Assumed)
    """Effects that were found before: a start of the search, with the prior probability `Settings.assumed_presence`."""
    start_from: Assumed = field(default_factory=Assumed)
    """Effects that replace `assumed` as a start, if there are any; they have the usual prior odds."""
    settings: Settings = Settings()
    """Source of the prior odds."""

    @cached_property
    def log_odds(self) -> Mapping[Hypothesis, float]:
        """ln of the prior odds of every hypothesis (`log_prior_odds`); of an effect that was found before those of
        `Settings.assumed_presence`."""
        known = dict.fromkeys(self.assumed.values, float(logit(self.settings.assumed_presence)))
        return {**self.usual_odds, **known}

    @cached_property
    def usual_odds(self) -> Mapping[Hypothesis, float]:
        """ln of the prior odds of every hypothesis where nothing was found before."""
        return dict(zip(self.library, log_prior_odds(self.library, self.settings), strict=True))

    @cached_property
    def general_forms(self) -> tuple[Hypothesis, ...]:
        """The library without special forms of effects, such as gravity along one axis.

        The search uses the general forms; :func:`prb3r.diagnosis.search.twins.in_special_forms` then tries special ones
        in the models that are found.
        """
        return tuple(one for one in self.library if not any(other.generalises(one) for other in self.library))

    @property
    def found_before(self) -> Assumed:
        """The effects found before from which the search starts too: `start_from` if it has any, else `assumed`."""
        return self.start_from if self.start_from.values else self.assumed

    @property
    def here(self) -> "Search":
        """A copy that runs its tasks serially, for use in a worker process."""
        return replace(self, apply=serially)

    def until(
        self, function: Callable[[Any], Done], tasks: Sequence[Any], enough: Callable[[Done], bool]
    ) -> list[Done]:
        """Results of `function` for the tasks in their order, up to and including the first result that is `enough`.

        In this process the tasks after it are not run; worker processes run all tasks at once.
        """
        found = list[Done]()
        for result in map(function, tasks) if self.apply is serially else self.apply(function, tasks):
            found.append(result)
            if enough(result):
                break
        return found


def examine(fitted: Fit, search: Search) -> Scores:
    """Score test on the residuals of `fitted`: of every hypothesis that it lacks, and of every moment law without a
    mechanism (`laws`)."""
    rest = [hypothesis for hypothesis in search.general_forms if hypothesis not in fitted.model.hypotheses]
    history = fitted.solved.chain.presliding > 0
    share = fitted.model.settings.tested_together if history else max(len(rest), 1)
    tasks = [(fitted, rest[k : k + share]) for k in range(0, len(rest), share)]
    parts = (search.apply if history else serially)(_alternatives, tasks)
    mechanics = mechanism(fitted)
    unnamed = law_alternatives(fitted, mechanics, laws(fitted, mechanics))
    return scores(fitted, [*(candidate for part in parts for candidate in part), *unnamed], search.seed)


def _alternatives(task: tuple[Fit, Sequence[Hypothesis]]) -> list[Alternative]:
    return alternatives(*task)
