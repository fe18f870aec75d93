"""Decisions in sentences, tables and figures: what is told, and that it fits."""

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
from study.decided import TABLE, cases, greater, less

from prb3r.present.study.comparison import advice_on, decision_captions, publish_comparison
from prb3r.present.study.front import decision_figure, front_figure
from prb3r.quantities import describe
from prb3r.runs.store import read_arrow
from prb3r.study.advice import bindings, exclusions
from prb3r.study.decide import decide
from prb3r.study.designs import design_names, value_in_words
from prb3r.study.metrics.drive import DriveTension
from prb3r.study.recommend import recommendation
from prb3r.study.wishes import Requirement


def test_a_design_that_other_weights_favour_more_often_is_told_beside_the_recommended_one():
    told = [
        recommendation(decide(cases(TABLE, [], [greater("area", weight=weight), less("force")])))
        for weight in (9.0, 1.0)
    ]
    assert "thin" in told[0]
    assert " of all weights put it first, but 4" in told[0]
    assert told[0].rstrip(".").endswith("% put middle first")
    assert "middle" in told[1]
    assert "put it first, but" not in told[1]


def test_designs_of_equal_scores_are_said_to_be_level_first_and_told_apart_by_their_reserves():
    """With two designs on the front and equal weights each is best in one thing, whatever their numbers."""
    two = {"design": ["thin", "thick"], "area": [4.0, 1.0], "force": [90.0, 50.0]}
    bounds = [Requirement(metric="force", at_most=100)]
    level = decide(cases(two, bounds, [greater("area"), less("force")]))
    told = recommendation(level)
    assert told.startswith("**thick and thin are level.** 2 of 2 designs keep every requirement.")
    assert "Recommendation" not in told
    assert "What speaks for thick is its reserve" in told
    assert level.winner == "thick"  # 50 % inside its bound, thin 10 %
    close = decide(cases(two, [Requirement(metric="force", at_most=5000)], [greater("area"), less("force")]))
    assert "Their reserves do not tell them apart either" in recommendation(close)
    apart = decide(cases(two, bounds, [greater("area", weight=1.2), less("force")]))
    assert recommendation(apart).startswith("**Recommendation: thin.**")


def test_of_many_level_designs_the_best_of_each_kind_and_the_one_that_gives_up_least_are_told():
    """On a straight front all weights alike put none first; the middle one is half way to the best in both."""
    table = {"design": list("abcde"), "area": [5.0, 4, 3, 2, 1], "force": [50.0, 40, 30, 20, 10]}
    told = recommendation(
        decide(cases(table, [Requirement(metric="force", at_most=60)], [greater("area"), less("force")]))
    )
    assert told.startswith("**5 designs are level.** 5 of 5 designs keep every requirement.")
    assert "A has the best area (5" in told
    assert "E has the best force (10" in told
    assert "The one between them that gives up least is c: area 3 and force 30. Nearest to its bound, force" in told
    assert told.count("of all weights") == 0


def test_the_note_counts_the_cases_that_preferences_name():
    table = {"design": ["a", "a", "b", "b"], "force": [1.0, 2.0, 3.0, 1.0], "load": ["x", "y"] * 2}
    one = [less("force", where={"load": "x"})]
    assert "Preferences are over 1 of the 2 cases that all designs share" in advice_on(cases(table, [], one)).note
    assert "Preferences are over the 2 cases" in advice_on(cases(table, [], [less("force")])).note


def test_captions_tell_the_panels_that_there_are():
    """With one design on the front there is no worth to tell."""
    bounds = [Requirement(metric="force", at_most=100)]
    one = decision_captions(decide(cases(TABLE, bounds, [greater("area")])), "comparison")
    assert one["comparison"] == "How far each design is inside the requirements."
    both = decision_captions(decide(cases(TABLE, bounds, [greater("area"), less("force")])))
    assert both["decision"].endswith("requirements and what it is worth by each preference.")
    worth = decision_captions(decide(cases(TABLE, [], [greater("area"), less("force")])))
    assert worth["decision"] == "What each design is worth by each preference."


def test_an_arrow_never_stands_alone_on_a_line():
    """It goes with the word before it, however long the words of a preference are."""
    for letters in range(20, 60):
        wishes = [greater("area", words="a" * letters), less("force", words="b" * letters)]
        (axes,) = front_figure(decide(cases(TABLE, [], wishes))).axes
        lines = (axes.get_xlabel() + "\n" + axes.get_ylabel()).splitlines()
        assert not {"←", "→"} & {line.strip() for line in lines}


def test_what_is_written_below_the_panels_fits_however_long_the_words_of_wishes_are():
    words = " ".join(["outline"] * 12)
    wishes = [greater("area", words=words), less("force", words=words)]
    figure = decision_figure(decide(cases(TABLE, [Requirement(metric="force", at_most=100, words=words)], wishes)))
    figure.draw_without_rendering()
    for axes in figure.axes:
        extent = axes.xaxis.label.get_window_extent()
        assert extent.x0 >= 0
        assert extent.x1 <= figure.bbox.x1


def test_what_says_nothing_is_left_out():
    """A design that is between the others in everything."""
    told = recommendation(decide(cases(TABLE, [], [greater("area"), less("force")])))
    assert told.startswith("**Recommendation: middle.**")
    assert "between the best and the worst" not in told


def test_what_excludes_and_by_how_much():
    known = decide(cases(TABLE, [Requirement(metric="force", at_most=75), Requirement(metric="area", at_least=1.5)]))
    assert known.margins[:, 0] == pytest.approx([-0.2, 0.2, 1 / 3, -1 / 15])
    assert known.feasible.tolist() == [False, True, False, False]
    assert known.excluded_alone(0) == ["thin", "odd"]
    assert known.excluded_alone(1) == ["thick"]
    assert known.winner == "middle"
    told = " ".join(exclusions(known))
    assert "**thin** is out: force is 90, at most 75 allowed (20 % off)" in told


def test_nothing_keeps_the_requirements_and_the_nearest_is_named():
    known = decide(cases(TABLE, [Requirement(metric="force", at_most=45)], [greater("area")]))
    assert known.winner is None
    assert not any(known.front)
    assert not known.ranking
    assert "thick comes closest" in recommendation(known)


def test_a_case_without_equilibrium_is_infinitely_bad_but_not_to_the_others():
    table = {
        "design": ["x", "x", "y", "y"],
        "a": [1.0, 5.0, 1.0, 0.5],
        "outcome": ["converged", "limit point", "converged", "converged"],
    }
    need = Requirement(metric="a", at_least=0.2)
    known = decide(cases(table, [need], [greater("a")]))
    assert known.feasible.tolist() == [False, True]
    assert known.failed == 0
    assert known.values["a"]["y"] == 0.5
    assert "no value in 1 of 2 cases" in " ".join(exclusions(known))
    assert decide(cases(table, [Requirement(metric="a", at_least=0.2, over="median")])).feasible.tolist() == [
        False,
        True,
    ]
    free = decide(cases(table, [], [greater("a")]))
    assert free.failed == 1
    assert free.values["a"].tolist() == [1.0, 1.0]


def test_designs_without_an_equilibrium_would_not_do_without_a_bound_and_the_reason_is_told():
    table = {
        "design": ["x", "y", "z"],
        "a": [np.nan, np.nan, 1.0],
        "outcome": ["no equilibrium", "failed", "converged"],
        "reason": ["No equilibrium was found; reached 4.3 % of the step.", "No tension reaches it.", ""],
    }
    need, wish = [Requirement(metric="a", at_least=2)], [greater("a")]
    known = decide(cases(table, need, wish))
    assert exclusions(known)[0] == (
        "**x** is out: a has no value in 1 of 1 case, at least 2 required "
        "(no equilibrium was found; reached 4.3 % of the step)."
    )
    assert known.excluded_alone(0) == ["y", "z"]
    assert "without it y and z would do" in bindings(known)[0]
    twice = {name: column[:1] * 2 for name, column in table.items()} | {"design": ["x", "y"]}
    lost = advice_on(cases(twice, need, wish))
    assert "would do" not in lost.markdown
    assert "each of them is without a stable equilibrium in some case" in lost.markdown
    assert "none comes close: each has no stable equilibrium in some case" in lost.markdown
    assert "Preferences have no case to go by: in the one case that all designs share a design fails" in lost.note


def test_one_metric_wanted_in_two_circumstances(tmp_path):
    table = {"design": ["x", "x", "y", "y"], "a": [1.0, 5.0, 2.0, 3.0], "broken_cables": ["", "2", "", "2"]}
    wishes = [greater("a", where={"broken_cables": ""}), greater("a", where={"broken_cables": "2"}, weight=2)]
    counsel = advice_on(cases(table, [], wishes, ["broken_cables"]))
    assert counsel.decision.values.to_numpy().tolist() == [[1, 5], [2, 3]]
    assert counsel.decision.winner == "x"
    assert "all cables intact" in counsel.markdown
    assert "weight 2" in counsel.markdown
    names = publish_comparison(counsel, tmp_path)
    assert {"comparison.md", "comparison.parquet", "comparison.png", "comparison-front.svg"} <= set(names)
    table = read_arrow(tmp_path / "comparison.parquet").to_pandas()
    assert table[["a_1", "a_2"]].to_numpy().tolist() == [[1, 5], [2, 3]]
    assert table["on_pareto_front"].tolist() == [True, True]


def test_a_tension_that_no_pull_reaches_is_told_as_such():
    metric = DriveTension(kind="drive-tension", cable="1", segment=1, bend_rad=6.0, up_to_n=300.0)
    quantities = {quantity.name: quantity for quantity in metric.quantities()}
    table = {"design": ["x", "y"], "drive_tension_n": [np.nan, 90.0]}
    known = replace(cases(table, [Requirement(metric="drive_tension_n", at_most=100)]), quantities=quantities)
    assert exclusions(decide(known)) == [
        "**x** is out: drive tension has no value in 1 of 1 case, at most 100 N required (none up to 300 N does)."
    ]
    assert quantities["drive_tension_n"].meaning.endswith("by 344 degrees; empty: none up to 300 N does")


def test_a_value_without_bound_is_told_in_the_table_and_a_missing_one_is_a_dash():
    table = {"design": ["x", "y", "z"], "a": [np.inf, 3.0, np.nan]}
    told = advice_on(cases(table, [Requirement(metric="a", at_least=2)], [greater("a")]))
    assert [row[1:] for row in told.table.rows[:2]] == [["without bound", "3", "- ✗"], ["without bound", "3", "-"]]


def test_a_single_design_has_numbers_and_no_rank():
    one = {name: column[:1] for name, column in TABLE.items()}
    told = advice_on(cases(one, [Requirement(metric="force", at_most=100)], [greater("area")]))
    assert told.table.rows[1] == ["area (greater is better)", "4"]
    for said in ("rank", "Pareto", "share", "bold", "Recommendation"):
        assert said not in told.markdown


def test_scores_are_told_where_preferences_make_them():
    need = [Requirement(metric="force", at_most=100)]
    for wish in ([], [greater("area"), less("force")]):
        markdown = advice_on(cases(TABLE, need, wish)).markdown.lower()
        for said in ("score", "of all weights", "worst in everything"):
            assert (said in markdown) == bool(wish)


def test_circumstances_by_themselves():
    table = {"design": ["x", "x", "y", "y"], "a": [1.0, 5.0, 2.0, 3.0], "mu": [0.0, 0.3, 0.0, 0.3]}
    counsel = advice_on(cases(table, [], [greater("a")], ["mu"]))
    assert ("In each circumstance", ["Friction coefficient: y at 0; x at 0.3."]) in counsel.points


def test_circumstances_with_names_stand_in_a_row_and_a_lack_of_designs_is_a_sentence():
    table = {"design": ["x", "x", "y", "y"], "a": [1.0, 5.0, 2.0, 3.0], "state": ["intact", "cable 3"] * 2}
    counsel = advice_on(cases(table, [Requirement(metric="a", at_least=9)], [greater("a")], ["state"]))
    said = "State: no design will do at each value by itself (intact and cable 3)."
    assert ("In each circumstance", [said]) in counsel.points


def test_one_preference_alone_has_a_table_and_no_figure(tmp_path):
    files = publish_comparison(advice_on(cases(TABLE, [], [greater("area")])), tmp_path)
    assert not [name for name in files if name.endswith("png")]
    page = (tmp_path / "report.html").read_text()
    assert "Recommendation: thin. No other design is better in anything that was preferred." in page


LOADED = {"design": ["soft"] * 3 + ["stiff"] * 3, "payload_n": [0.0, -2.0, -4.0] * 2}


def test_a_design_that_fails_in_some_case_is_recommended_with_a_word_on_it_and_in_no_case_where_it_fails():
    """Preferences are over the first case alone, in which soft reaches farther; under 2 N it has no equilibrium, under
    4 N neither design has."""
    reach = [3.0, np.nan, np.nan, 2.0, 1.0, np.nan]
    outcome = ["limit point" if np.isnan(value) else "converged" for value in reach]
    table = LOADED | {"reach_m": reach, "outcome": outcome, "scenario": [0, 1, 2] * 2}
    counsel = advice_on(cases(table, [], [greater("reach_m")], ["payload_n"]))
    assert "In 2 of 3 cases soft has no stable equilibrium." in counsel.recommendation
    assert "Preferences are over the 1 of 3 cases in which no design fails." in counsel.recommendation
    said = "Payload: soft at 0 N; stiff at −2 N; no design at −4 N."
    assert ("In each circumstance", [said]) in counsel.points


def test_designs_that_are_alike_in_some_case_come_first_there_together():
    table = LOADED | {"reach_m": [1.0, 1.0, 2.0, 1.0, 3.0, 2.0]}
    counsel = advice_on(cases(table, [], [greater("reach_m")], ["payload_n"]))
    said = "Payload: all of them alike at 0 N and −4 N; stiff at −2 N."
    assert ("In each circumstance", [said]) in counsel.points


def test_numbers_that_look_alike_are_told_apart_by_their_difference():
    table = {"design": ["x", "y"], "a_m": [0.3241, 0.3242], "b": [2.0, 1.0]}
    said = advice_on(cases(table, [], [greater("a_m"), greater("b", weight=3)])).markdown
    assert "y** is better at this: a is 0.324 m (more by 0.1 mm) against 0.324 m; the price: b is 1 against 2;" in said


def test_a_factor_may_be_called_rig():
    table = LOADED | {"reach_m": [3.0, 2.0, 1.0, 2.0, 1.5, 0.5], "rig": ["old", "new", "new"] * 2}
    assert "Recommendation: soft." in advice_on(cases(table, [], [greater("reach_m")], ["payload_n"])).recommendation


def test_designs_of_one_number_have_no_price():
    table = {"design": ["x", "y", "z"], "a": [2.0, 2.0, 1.0]}
    assert "y** is as good in everything; " in advice_on(cases(table, [], [greater("a")])).markdown


def test_a_design_without_a_value_is_worse_than_the_only_one_that_has_one():
    """And what it is better at and what it costs are both told."""
    table = {"design": ["thin", "thick"], "force": [60.0, np.nan], "area": [1.0, 2.0]}
    wishes = [less("force"), greater("area", weight=3)]
    counsel = advice_on(cases(table, [Requirement(metric="area", at_least=0)], wishes))
    assert "Recommendation: thick." in counsel.recommendation
    assert "Of force it has no value." in counsel.recommendation
    assert counsel.decision.worth[:, 0].tolist() == [1.0, -1.0]
    assert counsel.decision.score.tolist() == pytest.approx([0.25, 0.5])
    assert "thin** is better at this: force is 60 against" in counsel.markdown
    assert "; the price: area is 1 against 2;" in counsel.markdown


@pytest.mark.parametrize(
    ("bound", "told"), [(0.1, "at least 100 mm"), (0.4, "at least 400 mm"), (0.0, "at least 0 mm")]
)
def test_a_value_and_its_bound_are_told_in_one_unit(bound, told):
    wished = [Requirement(metric="tip_y_m", at_least=bound)], [greater("tip_y_m")]
    counsel = advice_on(cases({"design": ["x", "y"], "tip_y_m": [0.02, 0.5]}, *wished))
    assert told in counsel.markdown
    assert "500 mm" in counsel.markdown
    assert "0.5 m" not in counsel.markdown
    assert "over the one case that all designs share" in counsel.note


def test_areas_have_their_square_and_factors_their_names():
    frame = pd.DataFrame({"mu": [0.1, 0.3]})
    assert design_names(frame, ["mu"]) == ["Friction coefficient 0.1", "Friction coefficient 0.3"]
    assert value_in_words(0.0181, describe("workspace_area_m2")) == "0.0181 m²"
    assert value_in_words(0.0181, describe("workspace_area_m2"), beside=[0.00343]) == "181 cm²"
    assert value_in_words(1.73e8, describe("peak_stress_pa")) == "173 MPa"
    assert value_in_words(250.0, describe("pressure_pa")) == "250 Pa"
