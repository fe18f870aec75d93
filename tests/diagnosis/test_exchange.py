"""An effect that is not seen beside the one that stands in its place is found once that one is left out."""

from dataclasses import replace

import numpy as np
import pytest
from diagnosis.simulated import Case, recorded

from prb3r.diagnosis.fit.least_squares import fit
from prb3r.diagnosis.known import Task
from prb3r.diagnosis.search.apply import serially
from prb3r.diagnosis.search.assumed import Assumed
from prb3r.diagnosis.search.exchange import replacements, without_effect
from prb3r.diagnosis.search.pool import Pool
from prb3r.diagnosis.search.rivals import rivals, with_replacements
from prb3r.diagnosis.search.selection import choose, exchange_effects, explore_until_settled
from prb3r.diagnosis.stages import calibrate, doubt

TOUCHING = (
    {"kind": "disk_contact", "angle_rad": 0.08, "stiffness_n_m_per_rad": 40.0},
    {"kind": "tension_offset", "offset_n": 8.0, "cables": ("2",)},
)
IMITATED = ("nonlinear_plate (law bilinear)", "clamp_compliance", "tension_offset (cables 2)")
"""Plates that stiffen, with soft clamps, bend nearly as plates whose disks touch."""


@pytest.fixture(scope="module")
def doubted():
    hidden = tuple(tuple(effect.items()) for effect in TOUCHING)
    return doubt(calibrate(Task(recorded(Case(hidden=hidden)))), serially)


@pytest.fixture(scope="module")
def imitation(doubted):
    """A fit of what imitates disks that touch."""
    fitted, library = doubted.fitted, {each.name: each for each in doubted.search.library}
    chosen = [library[name] for name in IMITATED]
    model = fitted.model.adding(*chosen)
    starts = [
        np.concatenate([fitted.p, knee, [0.0, 0.0]]) for knee in chosen[0].starts(fitted.model.friction(fitted.p))
    ]
    return min((found for start in starts if (found := fit(model, start))), key=lambda found: found.chi2)


@pytest.fixture
def found(doubted, imitation):
    pool = Pool(doubted.search, imitation.model.settings, [doubted.fitted, imitation])
    return explore_until_settled(pool, doubted.search, doubted.doubts)


@pytest.mark.long
def test_beside_what_imitates_it_an_effect_is_not_seen_but_without_that_it_is(doubted, found):
    before = choose(found, doubted.search)
    after = choose(exchange_effects(found, doubted.search), doubted.search)
    assert not before.structured  # so that nothing but the exchange leads on
    assert before.kinds == {"nonlinear_plate", "tension_offset"}
    assert after.kinds == {"disk_contact", "tension_offset"}
    imitating = next(survivor for survivor in after.survivors if survivor.kinds == before.kinds)
    assert after.survivors[0].log_evidence > imitating.log_evidence + 1  # under one noise


def test_of_two_models_that_evidence_does_not_tell_strongly_apart_the_one_that_explains_is_chosen(doubted, found):
    """Not one that is less probable by odds of 20 or more, as then the evidence speaks strongly against it."""
    pool, scale = found.pool, next(each for each in doubted.search.library if each.kind == "camera_scale")
    explains, explained = frozenset(pool.best.model.hypotheses), pool.best
    poor = fit(pool.fits[frozenset()].model.adding(scale), np.append(pool.fits[frozenset()].p, 0.0))
    pool.fits = {frozenset(): pool.fits[frozenset()], explains: explained, frozenset([scale]): poor}
    for ahead, chosen in ((0.5, explains), (2.9, explains), (3.1, frozenset([scale]))):
        pool.evidence = {frozenset(): -1e9, explains: 0.0, frozenset([scale]): ahead}
        choice = choose(found, doubted.search)
        assert (choice.survivors[0].effects, choice.structured) == (chosen, chosen != explains)
        assert choice.effects == chosen
        assert sum(survivor.probability for survivor in choice.survivors) == pytest.approx(1.0)


@pytest.mark.long
def test_of_two_models_nearly_as_probable_that_explain_the_one_with_fewer_effects_is_chosen(doubted, found):
    pool, scale = found.pool, next(each for each in doubted.search.library if each.kind == "camera_scale")
    imitates = frozenset(pool.best.model.hypotheses)
    with_scale = fit(pool.best.model.adding(scale), np.append(pool.best.p, 0.0))
    larger, fewer = frozenset(with_scale.model.hypotheses), exchange_effects(found, doubted.search).pool.best
    smaller = frozenset(fewer.model.hypotheses)
    assert len(smaller) == len(imitates) < len(larger)
    assert not smaller <= larger
    pool.fits = {frozenset(): pool.fits[frozenset()], smaller: fewer, larger: with_scale}
    for ahead, chosen in ((0.5, smaller), (1.5, larger)):
        pool.evidence = {frozenset(): -1e9, smaller: 0.0, larger: ahead}
        choice = choose(found, doubted.search)
        assert (choice.effects, choice.structured) == (chosen, False)
        assert max(choice.survivors, key=lambda survivor: survivor.probability).effects == larger


def test_what_stands_in_the_place_of_an_effect_stands_beside_all_others(doubted, imitation):
    for number, effect in enumerate(imitation.model.hypotheses):
        others = set(imitation.model.hypotheses) - {effect}
        assert set(without_effect(imitation, number).model.hypotheses) == others
        for other in replacements(imitation, number, doubted.search):
            assert others < set(other.model.hypotheses)
            assert effect not in other.model.hypotheses
            assert len(other.model.hypotheses) == len(others) + 1


@pytest.mark.long
def test_a_model_is_exchanged_once_and_rivals_are_taken_from_what_was_fitted_then(doubted, found):
    """None of what was found before too: its odds are better by far."""
    choice = choose(exchange_effects(found, doubted.search), doubted.search)
    assert frozenset(choice.fitted.model.hypotheses) in choice.exchanged
    everyone = range(len(choice.fitted.model.hypotheses))
    assert with_replacements(choice, everyone, doubted.search) is choice
    fresh = replace(choice, tried=(), exchanged=frozenset())
    assert len(with_replacements(fresh, everyone, doubted.search).tried) > len(everyone)
    contact = [each.kind for each in choice.fitted.model.hypotheses].index("disk_contact")
    near = [rival for rival in rivals(choice, contact, doubted.search) if rival.indistinguishable]
    assert "nonlinear_plate" in {rival.hypothesis.kind for rival in near}
    before = choice.fitted.model.hypotheses[contact]
    sizes = {free.name: free.value(0.0) for free in before.free}
    search = replace(doubted.search, assumed=Assumed({before: sizes}))
    assert not [rival for rival in rivals(choice, contact, search) if rival.indistinguishable]


def test_a_few_replacements_are_fitted_whatever_the_linearised_model_promises(imitation, doubted):
    """One that refits much else gains far more than that."""
    chosen = imitation.model.hypotheses
    none = replace(imitation.model.settings, shortlist_share=1e3, survival_odds=1e-300)
    for fewest in (1, 4):
        asked = replace(imitation, model=replace(imitation.model, settings=replace(none, fewest_replacements=fewest)))
        with_patience = replacements(asked, 0, doubted.search)
        new = {fitted.model.hypotheses[-1] for fitted in with_patience}
        assert 1 <= len(new) <= fewest
        assert not new & set(chosen)
