"""A search that ended after its first start goes on from there."""

from unittest.mock import Mock

import numpy as np
import pytest
from diagnosis.simulated import LOSSY, WEAK, Case, recorded

from prb3r.diagnosis.known import Task
from prb3r.diagnosis.search import starts
from prb3r.diagnosis.search.apply import serially
from prb3r.diagnosis.stages import search, searched_on, to_test


@pytest.mark.long
def test_a_search_that_ended_early_goes_on_from_there_to_the_same_end(monkeypatch):
    """What is reached from the first start is not sought again."""
    tested = to_test(
        Task(recorded(Case(hidden=(tuple(WEAK.items()), tuple(LOSSY.items()))))), lambda stage: None, serially
    )
    whole, ended = search(tested), search(tested, np.inf)
    assert whole.choice.begun is None
    assert ended.choice.begun is not None
    assert searched_on(ended, np.inf) is ended
    assert searched_on(whole) is whole
    for start in ("_from_small_loads", "_from_known"):
        monkeypatch.setattr(starts, start, Mock(side_effect=AssertionError("the first start is searched again")))
    gone_on = searched_on(ended)
    assert gone_on.choice.effects == whole.choice.effects
    assert gone_on.choice.fitted.chi2 == pytest.approx(whole.choice.fitted.chi2, rel=1e-6)
