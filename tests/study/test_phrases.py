"""Phrases on what became of cases."""

from prb3r.study.phrases import failures_in_words


def test_failures_are_told_by_what_became_of_the_cases():
    outcomes = {"converged": 1200, "no equilibrium": 1, "unstable": 1100, "failed": 2, "detour": 1}
    told = failures_in_words(outcomes, "of them ")
    assert told == "1,101 of them without a stable equilibrium, 1 reached by a detour alone and 2 failed"
    assert failures_in_words({"converged": 3}) == ""
    assert failures_in_words({"crashed": 1}, "of them ") == "1 of them crashed"
