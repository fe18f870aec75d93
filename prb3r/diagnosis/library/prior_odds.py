"""Prior odds of the presence of every hypothesis, from those of its kind."""

from collections import Counter
from collections.abc import Sequence

import numpy as np
from scipy.special import logit

from prb3r.diagnosis.library import SUSPECTS
from prb3r.diagnosis.library.hypothesis import Hypothesis
from prb3r.diagnosis.settings import Settings


def log_prior_odds(hypotheses: Sequence[Hypothesis], settings: Settings) -> list[float]:
    """ln of the prior odds of every hypothesis: the odds of its kind, divided among the hypotheses of that kind.

    Where a kind concerns the whole rig in some and single parts of it in others, half falls to each: what all parts
    have from one cause (strips that were wound up together, one sort of pulley, one force sensor) is as likely as a
    fault of any one of them, however many there are.
    """
    alike = Counter((hypothesis.kind, hypothesis.of_whole_rig) for hypothesis in hypotheses)
    halves = Counter(kind for kind, _ in alike)
    odds = np.array([logit(SUSPECTS[one.kind].presence(settings)) for one in hypotheses])
    among = np.array([halves[one.kind] * alike[one.kind, one.of_whole_rig] for one in hypotheses])
    return (odds - np.log(among)).tolist()
