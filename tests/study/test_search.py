"""The search for the best design: optima known in closed form, fronts, budgets, and a run that goes on."""

from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from command import prb3r

from prb3r.check import check_file
from prb3r.errors import SpecError
from prb3r.present.study.publish import publish
from prb3r.study.decision import Decision
from prb3r.study.plan import plan_study
from prb3r.study.run import Options, Workers, solve_study
from prb3r.study.search import Evaluated, directions, searched_designs
from prb3r.study.settled import front_shift, unsettled
from prb3r.study.spec import Study
from prb3r.study.wishes import Preference

MANIPULATOR = Path(__file__).parents[2] / "studies" / "manipulators" / "two-segment.toml"


def searching(ranges: list[dict], preferences: int, designs: int) -> Study:
    """A study that searches; what is preferred is up to its judge."""
    factors = [
        {"name": f"f{k}", "path": f"segment.{k}.plates", "range": ends} for k, ends in enumerate(ranges, start=1)
    ]
    wanted = [{"metric": "m", "better": "less"}] * preferences
    spec = {"name": "s", "title": "s", "manipulator": "m", "factor": factors, "preference": wanted}
    requirement = [] if preferences else [{"metric": "m", "at_least": 1.0}]
    return Study.model_validate(spec | {"search": {"designs": designs}, "requirement": requirement})


def least(*objectives, margin=lambda *x: np.zeros(len(x[0]))):
    """A judge of functions to be made small, under a margin to be kept."""

    def judge(designs: np.ndarray) -> Evaluated:
        x = designs.T
        scores = [-function(*x) for function in objectives]
        return Evaluated(margin(*x)[:, None], np.stack(scores, 1) if scores else np.zeros((len(designs), 0)))

    return judge


def test_the_bound_of_a_requirement_is_found_with_a_whole_number():
    """Nearest to (3, 5) with x at most 2: (2, 5)."""
    study = searching([{"low": 0.0, "high": 4.0}, {"low": 0, "high": 9, "step": 1}], 1, 400)
    judge = least(lambda x, n: (x - 3) ** 2 + (n - 5) ** 2, margin=lambda x, n: 2 - x)
    designs = searched_designs(study, judge)
    worth = judge(designs)
    best = designs[np.argmax(np.where(worth.broken == 0, worth.scores[:, 0], -np.inf))]
    assert best == pytest.approx([2.0, 5.0], abs=0.02)
    assert (designs[:, 1] == np.round(designs[:, 1])).all()


def test_without_preferences_the_largest_reserve_is_searched():
    study = searching([{"low": 0.0, "high": 4.0}], 0, 200)
    designs = searched_designs(study, least(margin=lambda x: 1 - (x - 1.7) ** 2))
    assert np.abs(designs - 1.7).min() < 5e-3


@pytest.mark.parametrize("high", [1, 3])
def test_of_few_possible_designs_all_are_tried(high):
    designs = searched_designs(searching([{"low": 0, "high": high, "step": 1}], 1, 64), least(lambda n: (n - 1) ** 2))
    assert sorted(designs[:, 0]) == list(range(high + 1))


def test_the_front_of_schaffer_is_covered_from_end_to_end():
    """x^2 and (x - 2)^2: all between 0 and 2 (Schaffer 1985)."""
    study = searching([{"low": -5.0, "high": 5.0}], 2, 240)
    x = np.sort(searched_designs(study, least(lambda x: x**2, lambda x: (x - 2) ** 2)).ravel())
    on_front = np.concatenate([[0.0], x[(x > 0) & (x < 2)], [2.0]])
    assert np.diff(on_front).max() < 0.25


def test_the_middle_of_a_concave_front_is_found():
    """A quarter of a circle, of which no sum with weights ever finds more than the ends."""
    study = searching([{"low": 0.0, "high": 1.0}, {"low": 0.0, "high": 1.0}], 2, 480)
    judge = least(lambda x, d: x + d, lambda x, d: np.sqrt(1 - x**2) + d)
    designs = searched_designs(study, judge)
    middle = designs[(designs[:, 0] > 0.6) & (designs[:, 0] < 0.8)]
    assert middle[:, 1].min() < 0.02


def test_no_design_is_tried_twice_and_no_more_than_asked_for():
    study = searching([{"low": 0, "high": 30, "step": 1}, {"low": 0.0, "high": 1.0, "step": 0.25}], 2, 100)
    designs = searched_designs(study, least(lambda x, y: x + y, lambda x, y: 1 - x * y))
    assert len(np.unique(designs, axis=0)) == len(designs) <= 100
    again = searched_designs(study, least(lambda x, y: x + y, lambda x, y: 1 - x * y))
    assert (designs == again).all()


def test_with_one_preference_more_designs_go_on_where_fewer_ended():
    few, more = (
        searched_designs(searching([{"low": 0.0, "high": 4.0}] * 2, 1, count), least(lambda x, y: (x - 1) ** 2 + y))
        for count in (128, 256)
    )
    assert (few == more[: len(few)]).all()


def test_a_design_without_a_value_is_never_preferred():
    study = searching([{"low": 0.0, "high": 4.0}], 1, 200)

    def judge(designs):
        x = designs[:, 0]
        return Evaluated(np.zeros((len(x), 1)), np.where(x > 2, -np.inf, x)[:, None])

    designs = searched_designs(study, judge)
    assert designs[designs <= 2].max() > 1.99


def test_directions_begin_with_the_given_weights_and_reach_every_corner():
    weights = directions(np.array([3.0, 1.0]))
    assert weights[0] == pytest.approx([0.75, 0.25])
    assert weights.max(0).min() > 0.95
    assert weights.sum(1) == pytest.approx(1.0)
    assert len(directions(np.ones(5))) == 6


STUDY = f"""
name = "best"
title = "Best"
manipulator = "{MANIPULATOR}"
states = "none"
[[factor]]
name = "thickness_m"
path = "segment.1.thickness_m"
range = {{ low = 0.0008, high = 0.001 }}
[search]
designs = DESIGNS
generation = 16
[[step]]
cable_3_n = 50
[[metric]]
kind = "safety"
[[metric]]
kind = "position"
disk = 7
[[requirement]]
metric = "safety_factor"
at_least = 4.0
[[preference]]
metric = "disk7_angle_rad"
better = "less"
"""


def run(folder: Path, designs: int, text: str = STUDY):
    (folder / "best.toml").write_text(text.replace("DESIGNS", str(designs)))
    return solve_study(folder / "best.toml", Options(folder / "out", Workers(jobs=1)))


def test_a_search_ends_at_the_stress_that_is_allowed_and_goes_on_from_there(tmp_path):
    """The softest Segment 1 that bends far enough (to negative angles) without too much stress."""
    first = run(tmp_path, 16)
    assert run(tmp_path, 16).computed == 0
    more = run(tmp_path, 32)
    assert (len(first.cases), len(more.cases), more.computed) == (16, 32, 16)
    able = more.cases[more.cases["safety_factor"] >= 4]
    best = able.loc[able["disk7_angle_rad"].idxmin()]
    assert best["safety_factor"] == pytest.approx(4.0, rel=0.03)
    publish(more)
    summary = (more.folder / "summary.md").read_text()
    assert "32 designs were tried" in summary
    assert f"The best of them was number {best['case_id'] + 1};" in summary
    assert f"Recommendation: Thickness {1e3 * best['thickness_m']:.6g} mm." in summary


def tried(*scores: tuple[float, float]) -> Decision:
    """A decision between designs with two preferred numbers, in the order in which they were tried."""
    wishes = [Preference(metric=name, better="greater") for name in ("a", "b")]
    names = [str(number) for number in range(len(scores))]
    values = pd.DataFrame(scores, names, ["a", "b"])
    return Decision(names, [], wishes, np.zeros((len(scores), 0)), values, [], 1, 0, 0)


def test_a_front_that_moves_in_the_last_third_has_not_settled():
    """The front from (0, 10) to (10, 0): a last design at (6, 6) is ahead of (5, 5) by a tenth of its extent."""
    start = [(0.0, 10.0), (10.0, 0.0), (5.0, 5.0), (4.0, 4.0), (3.0, 3.0), (2.0, 2.0)]
    assert front_shift(tried(*start, (1.0, 1.0), (6.0, 6.0))) == pytest.approx(0.1)
    assert "by 10 % of its extent" in unsettled(tried(*start, (1.0, 1.0), (6.0, 6.0)))
    assert unsettled(tried(*start, (1.0, 1.0), (5.2, 5.2))) == ""
    assert front_shift(tried(*start[:3], (6.0, 6.0), *start[3:], (1.0, 1.0))) == 0.0


def test_what_a_search_may_take_is_told_before_it_begins(tmp_path):
    """Of each design it may try two cases are solved, and not only of those of the first generation."""
    payload = '[[factor]]\nname = "load"\n' + "".join(
        f'[[factor.level]]\nlabel = "{mass}"\nset = {{ "disk.mass_kg" = {mass} }}\n' for mass in (0.04, 0.05)
    )
    text = STUDY.replace("[search]", payload + "[search]").replace(
        "[[step]]", "[designs]\nfactors = ['thickness_m']\n[[step]]"
    )
    (tmp_path / "best.toml").write_text(text.replace("DESIGNS", "40"))
    assert "study of at most 80 cases" in check_file(tmp_path / "best.toml")
    done = prb3r("run", tmp_path / "best.toml", "-o", tmp_path / "out", "--dry-run")
    assert "best: at most 80 cases of 40 designs, of the first 32 0 stored, about" in done.stdout
    assert len(run(tmp_path, 40, text).cases) <= 80


@pytest.mark.parametrize(
    ("old", "new", "what"),
    [
        ("range = { low = 0.0008, high = 0.001 }", "values = [0.001]", "needs factors with a range to search"),
        (
            "[search]",
            "[designs]\nfactors = []\n[search]",
            "has a range, so it is searched, but [designs] does not name it",
        ),
        ("high = 0.001", "high = 1.0", "not what rigs are made with"),
        ("generation = 16", "generation = 64", "designs must not be fewer"),
    ],
)
def test_a_wrong_search_is_refused(tmp_path, old, new, what):
    assert old in STUDY
    (tmp_path / "best.toml").write_text(STUDY.replace(old, new).replace("DESIGNS", "24"))
    with pytest.raises(SpecError) as error:
        plan_study(tmp_path / "best.toml")
    assert what in str(error.value)


def test_a_search_must_know_what_is_best(tmp_path):
    (tmp_path / "best.toml").write_text(STUDY.replace("DESIGNS", "24").partition("[[requirement]]")[0])
    with pytest.raises(SpecError, match=r"give \[\[preference\]\] or \[\[requirement\]\]"):
        plan_study(tmp_path / "best.toml")
