"""Phrases on what became of cases."""

import pandas as pd

from prb3r.quantities import describe
from prb3r.study.designs import design_names
from prb3r.study.phrases import failures_in_words, listed_names, wish_in_words
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


def test_designs_in_a_list_and_the_values_in_their_names_can_be_told_apart():
    frame = pd.DataFrame({"thickness_1_m": [9e-4, 1.1e-3], "plates_1": [4, 6], "thickness_m": [1e-3, 1e-3]})
    names = design_names(frame, ["thickness_1_m", "plates_1", "thickness_m"])
    assert names[0] == "Thickness 1 = 0.9 mm, Plates 1 = 4, Thickness 1 mm"
    assert listed_names(names) == f"{names[0]}; and {names[1]}"
    assert listed_names([names[0]] * 9) == "; ".join([names[0]] * 5) + "; and 4 more"
    assert listed_names(["thin", "thick", "odd"]) == "thin, thick and odd"
