"""Effects found before whose size a recording contradicts: they have the usual prior odds in it, as others do."""

from dataclasses import replace

import numpy as np

from prb3r.diagnosis.library.hypothesis import Hypothesis
from prb3r.diagnosis.search.assumed import another_size
from prb3r.diagnosis.search.search import Search
from prb3r.diagnosis.search.selection import Choice


def without_contradicted(choice: Choice, search: Search) -> Choice:
    """The choice with the surviving models weighed anew, where these contradict the size of effects found before.

    That an effect was found before says that it is there in that size.  One of next to no size is another finding,
    for which `Settings.assumed_presence` does not speak.
    """
    gone = [hypothesis for hypothesis in search.assumed.values if _is_contradicted(hypothesis, choice, search)]
    if not gone:
        return choice
    lost = {hypothesis: search.usual_odds[hypothesis] - search.log_odds[hypothesis] for hypothesis in gone}
    change = [sum(lost.get(one, 0.0) for one in survivor.effects) for survivor in choice.survivors]
    shares = np.array([survivor.probability for survivor in choice.survivors]) * np.exp(change)
    weighed = [
        replace(survivor, log_evidence=survivor.log_evidence + less, probability=float(share))
        for survivor, less, share in zip(choice.survivors, change, shares / shares.sum(), strict=True)
    ]
    return replace(choice, survivors=tuple(sorted(weighed, key=lambda survivor: -survivor.probability)))


def _is_contradicted(hypothesis: Hypothesis, choice: Choice, search: Search) -> bool:
    """Whether an effect found before is not chosen, and has another size in the most probable model that has it."""
    having = [survivor.fitted for survivor in choice.survivors if hypothesis in survivor.effects]
    if not having or hypothesis in choice.fitted.model.hypotheses:
        return False
    return bool(another_size(having[0], hypothesis, search.assumed.values[hypothesis]))
