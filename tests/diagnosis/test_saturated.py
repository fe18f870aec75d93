"""Starting with all common effects at once finds what is there only together."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from diagnosis.simulated import Case, recorded

from prb3r.diagnosis.evidence.model_evidence import log_evidence
from prb3r.diagnosis.fit.covariance import NoiseLevel
from prb3r.diagnosis.fit.least_squares import fit
from prb3r.diagnosis.known import Task
from prb3r.diagnosis.library import SUSPECTS
from prb3r.diagnosis.library.hypothesis import FORMS
from prb3r.diagnosis.search import starts
from prb3r.diagnosis.search.apply import serially
from prb3r.diagnosis.search.exchange import without_effect
from prb3r.diagnosis.search.pairs import paired, softening_to_a_stop
from prb3r.diagnosis.search.pool import Pool
from prb3r.diagnosis.search.saturated import common_of_whole_rig, eliminated, saturated
from prb3r.diagnosis.search.selection import choose, explore_until_settled
from prb3r.diagnosis.search.starts import add_refitted, mean_log_odds, search_effects
from prb3r.diagnosis.search.worth import worth
from prb3r.diagnosis.stages import calibrate, doubt

pytestmark = pytest.mark.long

TOGETHER = (
    {"kind": "nonlinear_plate", "law": "smooth", "knee_strain": 0.0018, "ratio": 0.3, "sharpness": 4.0},
    {"kind": "disk_contact", "angle_rad": 0.2, "stiffness_n_m_per_rad": 40.0},
    {"kind": "tension_offset", "offset_n": 4.0},
)
"""Plates that soften until their disks touch, and a load cell off zero."""


@pytest.fixture(scope="module")
def doubted():
    hidden = tuple(tuple(effect.items()) for effect in TOGETHER)
    return doubt(calibrate(Task(recorded(Case(hidden=hidden)))), serially)


@pytest.fixture(scope="module")
def full(doubted):
    """All common effects of the whole rig at once."""
    return saturated(doubted.fitted, doubted.search, doubted.doubts)


@pytest.fixture(scope="module")
def whole(doubted):
    """What the search finds with the whole library."""
    return search_effects(doubted.fitted, doubted.search, doubted.doubts)


def test_it_has_every_common_kind_once_and_no_part_of_the_rig(doubted):
    settings, library = doubted.fitted.model.settings, doubted.search.library
    together = common_of_whole_rig(library, settings)
    kinds = [hypothesis.kind for hypothesis in together]
    assert len(set(kinds)) == len(kinds) > 8
    assert all(SUSPECTS[kind].presence(settings) >= settings.common_presence for kind in kinds)
    assert all(name in FORMS for hypothesis in together for name, _ in hypothesis.place)
    assert not any(one.excludes(other) for one in together for other in together if one is not other)
    assert {"nonlinear_plate", "disk_contact", "tension_offset"} <= set(kinds)


def test_elimination_tries_another_effect_where_a_fit_loses_its_valley(doubted, full, monkeypatch):
    tried = []

    def losing(fitted, number, *rest):
        """The first effect to go takes the valley with it: its fit stays at the start of the search."""
        tried.append(fitted.model.hypotheses[number])
        if len(tried) > 1:
            return without_effect(fitted, number, *rest)
        fewer, friction = fitted.model.without(number), doubted.fitted.model.friction(doubted.fitted.p)
        sizes = (hypothesis.starts(friction)[0] for hypothesis in fewer.hypotheses)
        return fit(fewer, np.concatenate([doubted.fitted.p, *sizes]), most_steps=1)

    plain = eliminated(full, doubted.search)[1]
    monkeypatch.setattr("prb3r.diagnosis.search.saturated.without_effect", losing)
    found = eliminated(full, doubted.search)[1]
    assert tried[0] not in plain.model.hypotheses
    assert tried[0] in found.model.hypotheses
    assert tried[1] not in found.model.hypotheses
    worth = [log_evidence(each, doubted.search.log_odds) for each in (full, found)]
    assert worth[1] > worth[0] - full.model.settings.useful_reach


def test_all_at_once_takes_away_most_of_what_constants_leave(doubted, full):
    assert doubted.fitted.reduced > 10
    assert full.reduced < 0.5 * doubted.fitted.reduced


def test_what_all_effects_do_without_is_left_out_as_long_as_that_is_more_probable(doubted, full):
    search, settings = doubted.search, doubted.fitted.model.settings
    pool = Pool(search, settings, [doubted.fitted, full])
    pool.thin()
    assert {hypothesis.kind for hypothesis in pool.best.model.hypotheses} == {"nonlinear_plate", "disk_contact"}
    for number in range(2):
        less = without_effect(pool.best, number)
        assert log_evidence(less, search.log_odds) < log_evidence(pool.best, search.log_odds)
    tried = len(pool.fits)
    pool.thin()
    assert len(pool.fits) == tried
    assert pool.under(full.model.noise).thinned == pool.thinned


def test_taken_away_one_after_another_what_is_there_is_left_last(doubted, full):
    fits = eliminated(full, doubted.search)
    sets = [frozenset(fitted.model.hypotheses) for fitted in fits]
    assert fits[0] is full
    assert [len(effects) for effects in sets] == list(range(len(sets[0]), 0, -1))
    assert all(less < more for more, less in pairwise(sets))
    assert {hypothesis.kind for hypothesis in sets[-2]} == {"nonlinear_plate", "disk_contact"}
    evidence = [log_evidence(fitted, doubted.search.log_odds) for fitted in fits]
    assert evidence[-2] == max(evidence) > evidence[0] + 5


def test_from_the_full_side_the_same_effects_are_left_as_from_the_empty_one(doubted, whole, full):
    fitted, search, doubts = doubted.fitted, doubted.search, doubted.doubts
    pool = Pool(search, fitted.model.settings, [fitted, full])
    assert choose(explore_until_settled(pool, search, doubts), search).kinds == whole.kinds


def test_of_two_choices_the_one_with_what_is_there_leads_under_the_noise_of_either(doubted, whole):
    library = tuple(each for each in doubted.search.library if each.kind in ("nonlinear_plate", "tension_offset"))
    blind = replace(doubted.search, library=library)
    pool = Pool(blind, doubted.fitted.model.settings, [doubted.fitted])
    part = choose(explore_until_settled(pool, blind, doubted.doubts), blind)
    assert "disk_contact" in whole.kinds
    assert part.structured
    best, lesser = (each.survivors[0].fitted for each in (whole, part))
    ahead = mean_log_odds(best, lesser, doubted.search)
    assert ahead > 10
    assert mean_log_odds(lesser, best, doubted.search) == pytest.approx(-ahead)


def test_plates_that_soften_until_something_stops_them_are_found_together(doubted):
    """Neither law nor stop alone leaves less than three times as much."""
    fitted, search = doubted.fitted, doubted.search
    tried = {
        each.name: replace(each, probes=each.probes[:4])
        for each in search.library
        if each.name in ("nonlinear_plate (law smooth)", "disk_contact", "gravity")
    }
    few = replace(search, library=tuple(tried.values()))
    ((law, stop),) = softening_to_a_stop(few.library)
    (both,) = paired(fitted, few)
    assert both.model.hypotheses == (law, stop)
    alone = [fit(fitted.model.adding(each), np.append(fitted.p, each.starts(0.0)[0])) for each in (law, stop)]
    assert min(each.chi2 for each in alone if each) > 3 * both.chi2
    strict = replace(fitted.model.settings, saturated_leaves=0.1)
    assert paired(replace(fitted, model=replace(fitted.model, settings=strict)), few) == []


@pytest.fixture
def begun(monkeypatch):
    """What each exploration began from."""
    pools = []

    def explored(pool, search, doubts):
        pools.append(pool)
        return explore_until_settled(pool, search, doubts)

    monkeypatch.setattr(starts, "explore_until_settled", explored)
    return pools


def among(search, *kinds):
    """The search among some kinds alone."""
    return replace(search, library=tuple(each for each in search.library if each.kind in kinds))


@pytest.mark.parametrize("useless", [True, False])
def test_all_effects_together_that_explain_nothing_are_not_searched_from(doubted, begun, monkeypatch, useless):
    if useless:
        monkeypatch.setattr(starts, "saturated", lambda calibrated, search, doubts: calibrated)
    few, model = among(doubted.search, "nonlinear_plate", "tension_offset"), doubted.fitted.model
    brief = replace(model, settings=replace(model.settings, most_expansions=1, later_expansions=1, renewals=1))
    choice = search_effects(replace(doubted.fitted, model=brief), few, doubted.doubts)
    assert choice.structured  # so that what is left of them is searched from too
    assert len(begun) == (1 if useless else 3)


@pytest.mark.parametrize(("several", "sides"), [(2, 2), (3, 1)])
def test_both_sides_are_searched_from_though_one_end_explains_the_recording_by_several(doubted, begun, several, sides):
    """It may be far from the best: of a notched wrist an end of five effects with chi-square 283 of 293 passed every
    check where the other, of four, had 217.  Here the first end has two."""
    model = doubted.fitted.model
    asked = replace(model, settings=replace(model.settings, several_effects=several))
    few = among(doubted.search, *(effect["kind"] for effect in TOGETHER))
    choice = search_effects(replace(doubted.fitted, model=asked), few, doubted.doubts)
    assert not choice.structured
    assert len(choice.kinds) == 2
    assert len(begun) == sides


@pytest.mark.parametrize(("least_worth", "ends"), [(np.inf, 1), (-1e9, 2)])
def test_a_search_whose_first_end_is_worth_too_little_is_given_up_there(doubted, begun, least_worth, ends):
    few = among(doubted.search, *(effect["kind"] for effect in TOGETHER))
    settings = replace(doubted.fitted.model.settings, several_effects=2)
    fitted = replace(doubted.fitted, model=replace(doubted.fitted.model, settings=settings))
    choice = search_effects(fitted, few, doubted.doubts, least_worth)
    assert len(begun) == ends
    assert choice.worth_of_first_start == pytest.approx(worth(choice, few), abs=1)  # it explains the recording


@pytest.mark.parametrize(("least_worth", "asked"), [(-np.inf, 1), (-1e9, 0)])
def test_softening_with_a_stop_is_begun_from_where_much_is_left_of_a_recording_as_it_is(
    doubted, monkeypatch, least_worth, asked
):
    """Much, here, is anything at all."""
    times, model = [], doubted.fitted.model
    monkeypatch.setattr(starts, "paired", lambda *_: times.append(1) or [])
    brief = {"gross": 0.0, "most_expansions": 1, "later_expansions": 1, "renewals": 1}
    few = among(doubted.search, "disk_contact", "tension_offset")
    fitted = replace(doubted.fitted, model=replace(model, settings=replace(model.settings, **brief)))
    search_effects(fitted, few, doubted.doubts, least_worth)
    assert len(times) == asked


def test_what_another_search_ended_in_stands_beside_the_best_under_its_noise(doubted):
    fitted, search = doubted.fitted, among(doubted.search, *(effect["kind"] for effect in TOGETHER))
    other = saturated(fitted, search, doubted.doubts)
    pool = Pool(search, fitted.model.settings, [fitted])
    louder = pool.under(
        replace(doubted.doubts, level=NoiseLevel(scale=2.0)).noise(
            fitted.model.predict, fitted.solved, fitted.model.settings
        )
    )
    add_refitted([other], louder)
    there = louder.fits[frozenset(other.model.hypotheses)]
    assert there.model.noise is louder.best.model.noise
    assert there.chi2 < 0.5 * other.chi2  # twice the noise
    assert louder.survivors()[0].fitted is there


def test_what_is_enough_ends_a_search_alike_here_and_in_workers(doubted):
    """Workers do at once what this process leaves out, and it does not count."""
    done = []

    def square(number):
        done.append(number)
        return number**2

    here = doubted.search.here
    there = replace(here, apply=lambda function, tasks: list(map(function, tasks)))
    for search, tried in ((here, [1, 2]), (there, [1, 2, 3])):
        done.clear()
        assert search.until(square, [1, 2, 3], lambda result: result > 3) == [1, 4]
        assert done == tried
