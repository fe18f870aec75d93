"""Phrases on what became of cases."""

from prb3r.quantities import describe
from prb3r.study.phrases import failures_in_words, wish_in_words
from prb3r.study.wishes import Requirement


def test_failures_are_told_by_what_became_of_the_cases():
    outcomes = {"converged": 1200, "no equilibrium": 1, "unstable": 1100, "failed": 2, "detour": 1}
    told = failures_in_words(outcomes, "of them ")
    assert told == "1,101 of them without a stable equilibrium, 1 reached by a detour alone and 2 failed"
    assert failures_in_words({"converged": 3}) == ""
    assert failures_in_words({"crashed": 1}, "of them ") == "1 of them crashed"


def test_over_what_a_bounded_number_is_taken_is_told_whatever_it_is_called():
    wish = {"metric": "safety_factor", "at_least": 4.5}
    for words in ({}, {"words": "safety against yield"}):
        worst, *others = (
            wish_in_words(Requirement(**wish, **words, **over), describe("safety_factor"))
            for over in ({}, {"over": "mean"}, {"over": "quantile", "quantile": 0.05})
        )
        assert "(" not in worst
        assert others == [f"{worst} (mean)", f"{worst} (0.05 quantile)"]
