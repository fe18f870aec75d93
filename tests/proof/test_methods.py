"""The methods that the diagnosis is compared with choose by chi-square alone; which pairs of effects are preferred."""

from itertools import product

import pytest
from diagnosis.simulated import Case, recorded

from prb3r.proof.concealed.pairs import pair_rank
from prb3r.proof.judging.methods import MethodTask, verdict_of
from prb3r.proof.settings import SETTINGS

CLEAN = Case(hidden=(), seed=3)


def judged(method, case):
    verdict = verdict_of(MethodTask(0, recorded(case), frozenset(), method, 0))
    assert not verdict.reason
    return verdict


def test_the_lowest_error_names_an_effect_even_where_there_is_none():
    alone, lowest = judged("E and mu alone", CLEAN), judged("lowest error", CLEAN)
    assert (alone.verdict, alone.named) == ("adequate", ())
    assert lowest.verdict == "explained"
    assert len(lowest.named) == 1
    assert lowest.reduced[1] < lowest.reduced[0] == pytest.approx(alone.reduced[1])


@pytest.mark.parametrize("method", ["lowest error", "BIC, no covariance"])
def test_what_stands_out_is_named_by_the_simpler_methods_too(method):
    (claim,) = judged(method, Case(seed=3)).named
    assert (claim.kind, claim.place) == ("weakened_plate", {"plate": 4})


def test_a_pair_that_nothing_imitates_is_preferred_whatever_its_cosine():
    apart, near = {"gravity": 1.1 * SETTINGS.sizes.apart}, {"gravity": 0.9 * SETTINGS.sizes.apart}
    cosines = (-0.9, -0.1, 0.0, 0.1, 0.9)
    for cancelling, one, other in product((False, True), cosines, cosines):
        assert pair_rank(one, apart, cancelling) > pair_rank(other, near, cancelling)
    assert pair_rank(-0.5, apart, True) > pair_rank(-0.4, apart, True) > pair_rank(0.2, apart, True)
    assert pair_rank(-0.5, apart, False) == pair_rank(0.2, apart, False)
    assert pair_rank(0.2, {}, True) == pair_rank(0.2, apart, True)
