"""Decisions: hand-computed tables and laws that hold for any table."""

import itertools

import numpy as np
import pandas as pd
import pytest
from study.decided import TABLE, cases, greater, less, random_cases

from prb3r.errors import SpecError
from prb3r.study.decide import decide
from prb3r.study.designs import DesignCases
from prb3r.study.wishes import Requirement


def test_a_small_table_by_hand():
    known = decide(cases(TABLE, [Requirement(metric="force", at_most=100)], [greater("area"), less("force")]))
    assert known.feasible.all()
    assert known.front == [True, True, True, False]  # odd has less area than middle, and needs more force
    assert known.worth[:3] == pytest.approx(np.array([[1, 0], [2 / 3, 0.75], [0, 1]]))
    assert known.score[:3] == pytest.approx([0.5, (2 / 3 + 0.75) / 2, 0.5])
    assert known.winner == "middle"
    # with share t of the weight on area: thin t, middle 0.75 - t/12, thick 1 - t; they cross at 9/13 and at 3/11
    assert known.win_share == pytest.approx([4 / 13, 9 / 13 - 3 / 11, 3 / 11, 0], abs=0.015)
    move = known.move(0)
    assert (move.below, move.above) == ("thick", "thin")
    assert (move.low, move.high) == pytest.approx(((3 / 11) / (8 / 11), (9 / 13) / (4 / 13)))


@pytest.mark.parametrize("seed", range(20))
def test_a_dominated_design_is_never_recommended_and_changes_nothing(seed):
    known = random_cases(seed)
    before = decide(known)
    winner = before.designs.index(before.winner)
    assert before.front[winner]
    assert all(before.win_share[k] == 0 for k, on in enumerate(before.front) if not on)
    worse = known.frame.iloc[[winner]].assign(design="worse", a=lambda f: f["a"] - 9, b=lambda f: f["b"] + 9)
    after = decide(DesignCases(pd.concat([known.frame, worse], ignore_index=True), [], known.wishes))
    assert after.winner == before.winner
    assert not after.front[-1]
    assert np.array_equal(after.win_share[:-1], before.win_share)
    assert np.array_equal(after.worth[:-1][before.front], before.worth[before.front])


@pytest.mark.parametrize("seed", range(10))
def test_a_tighter_requirement_lets_no_more_designs_through(seed):
    kept = [
        set(np.flatnonzero(decide(random_cases(seed, [Requirement(metric="a", at_least=bound)])).feasible))
        for bound in (-2.0, -0.5, 0.0, 0.5, 2.0)
    ]
    assert all(after <= before for before, after in itertools.pairwise(kept))
    assert len(kept[0]) > len(kept[-1])


@pytest.mark.parametrize("seed", range(20))
def test_another_design_comes_first_exactly_beyond_the_bounds_of_a_weight(seed):
    weights = np.random.default_rng(seed).uniform(0.5, 3, 3)
    before = decide(random_cases(seed, weights=weights))
    bounds = 0
    for j in range(3):
        move = before.move(j)
        for bound, taker, out in ((move.low, move.below, 1 - 1e-6), (move.high, move.above, 1 + 1e-6)):
            if taker is None:
                continue
            bounds += 1
            assert (bound < weights[j]) == (out < 1)
            for factor, winner in ((out, taker), (2 - out, before.winner)):
                moved = weights.copy()
                moved[j] = bound * factor
                assert decide(random_cases(seed, weights=moved)).winner == winner
    assert bounds


def test_units_do_not_matter():
    before = decide(random_cases(3))
    frame = random_cases(3).frame.assign(a=lambda f: 1e3 * f["a"], b=lambda f: 1e-3 * f["b"])
    after = decide(DesignCases(frame, [], random_cases(3).wishes))
    assert after.ranking == before.ranking
    assert after.score == pytest.approx(before.score)


@pytest.mark.parametrize(
    ("over", "expected"),
    [({}, 1.0), ({"over": "mean"}, 3.0), ({"over": "median"}, 2.0), ({"over": "quantile", "quantile": 0.25}, 1.5)],
)
def test_statistics_over_the_cases_of_a_design(over, expected):
    table = {"design": ["x"] * 3, "a": [2.0, 1.0, 6.0]}
    assert decide(cases(table, [Requirement(metric="a", at_least=0, **over)])).bounded[0, 0] == expected
    upper = decide(cases(table, [Requirement(metric="a", at_most=0, **over)])).bounded[0, 0]
    assert upper == (6.0 if not over else expected)  # the worst is the other end; statistics are what they are


def test_a_quantile_is_one_of_rigs_each_at_the_worst_of_its_circumstances():
    """Of twenty rigs each lifts 1 to 20 unloaded and half of that loaded: one in ten lifts less than 1.45."""
    lifts = np.arange(1.0, 21.0)
    table = {"design": ["x"] * 40, "a": np.concatenate([lifts, lifts / 2]), "drawn_rig": list(range(20)) * 2}
    asked = [Requirement(metric="a", at_least=1.4, over="quantile", quantile=0.1)]
    decision = decide(cases(table, asked))
    assert decision.bounded[0, 0] == pytest.approx(np.quantile(lifts / 2, 0.1))
    assert decision.feasible.all()
    pooled = decide(cases({key: table[key] for key in ("design", "a")}, asked))
    assert pooled.bounded[0, 0] > decision.bounded[0, 0]


def test_cases_of_a_study_that_draws_no_rigs_count_one_by_one_beside_one_that_does():
    lifts = np.arange(1.0, 21.0)
    table = {"design": ["x"] * 20 + ["y"] * 20, "a": np.concatenate([lifts, lifts])}
    table |= {"drawn_rig": [*np.repeat(range(10), 2), *[np.nan] * 20], "scenario": [*range(20)] * 2}
    asked = [Requirement(metric="a", at_least=0, over="quantile", quantile=0.5)]
    drawn, plain = decide(cases(table, asked)).bounded[:, 0]
    assert drawn == pytest.approx(np.median(lifts[::2]))  # the worse of each pair
    assert plain == pytest.approx(np.median(lifts))


@pytest.mark.parametrize(
    "wrong", [{}, {"at_least": 1, "at_most": 2}, {"at_least": 1, "over": "quantile"}, {"at_least": 1, "quantile": 0.1}]
)
def test_requirements_that_say_too_little_or_too_much(wrong):
    with pytest.raises(ValueError, match=r"give one of|go together"):
        Requirement(metric="a", **wrong)


def test_designs_that_share_no_case():
    table = {"design": ["x", "y"], "a": [1.0, 2.0], "scenario": ["p", "q"]}
    with pytest.raises(SpecError, match="share no case"):
        decide(cases(table, [], [greater("a")]))


def test_designs_behind_a_single_one_are_ranked_by_what_they_are_worth():
    table = TABLE | {"force": [50.0, 80.0, 90.0, 60.0]}  # thin has most area and needs least force
    alone = decide(cases(TABLE, (), [greater("area")]))
    assert [alone.designs[k] for k in alone.ranking] == ["thin", "middle", "odd", "thick"]
    both = decide(cases(table, (), [greater("area", weight=1), less("force", weight=3)]))
    assert both.front == [True, False, False, False]
    assert [both.designs[k] for k in both.ranking] == ["thin", "odd", "middle", "thick"]
