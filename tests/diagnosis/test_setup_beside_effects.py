"""Blunders of the set-up and physics: neither is taken for the other, beside each other both are told."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from diagnosis.planted import (
    FORGOTTEN_SLIPS,
    PLANTED,
    backward,
    late,
    misnoted,
    other_steps,
    steps_swapped,
    without_slips,
)
from diagnosis.simulated import IMITATING, RUBBING, WEAK, YIELDING, Case, recorded

from prb3r.diagnosis import blunders as weighed
from prb3r.diagnosis import investigate as around
from prb3r.diagnosis.blunders import without_blunders
from prb3r.diagnosis.check import check
from prb3r.diagnosis.checks.setup.factors import factor_blunders
from prb3r.diagnosis.checks.setup.find import Blunder, blunders_of, find_blunder
from prb3r.diagnosis.checks.setup.weigh import speaks_for
from prb3r.diagnosis.fit.calibrate import fit_constants
from prb3r.diagnosis.fit.covariance import NoiseLevel
from prb3r.diagnosis.fit.prediction import predictor
from prb3r.diagnosis.investigate import investigate
from prb3r.diagnosis.known import Task
from prb3r.diagnosis.result.answer import what_to_do
from prb3r.diagnosis.result.tell import tell
from prb3r.diagnosis.search.apply import serially
from prb3r.diagnosis.search.search import Search
from prb3r.diagnosis.settings import Settings
from prb3r.diagnosis.stages import to_search
from prb3r.recording.plausibility import contradicted_slips

pytestmark = pytest.mark.long

RIGHT = {
    "nothing": (),
    "a dead cable": ({"kind": "dead_cable", "cable": "1"},),
    "two dead cables": ({"kind": "dead_cable", "cable": "2"}, {"kind": "dead_cable", "cable": "3"}),
    "heavy friction that lags": (
        {"kind": "pulley_friction", "efficiency": 0.7},
        {"kind": "slip_history", "presliding_m": 1e-4},
    ),
    "four effects": (
        {"kind": "segment_stiffness", "segment": 2, "factor": 0.6},
        {"kind": "precurvature", "curvature_per_m": 1.5},
        {"kind": "hole_offset", "cable": "1", "offset_m": 0.004},
        {"kind": "gravity", "x_m_s2": 0.0, "y_m_s2": -9.8},
    ),
}


@pytest.mark.parametrize("hidden", RIGHT)
def test_physics_is_no_blunder(hidden):
    case = recorded(Case(hidden=tuple(tuple(effect.items()) for effect in RIGHT[hidden])))
    blunders = blunders_of(case, Settings())
    assert not blunders or not blunders[-1].plain
    if blunders and not blunders[-1].faint:
        assert not without_blunders(Task(case), lambda stage: None, serially).blunders


def test_a_blunder_is_told_from_the_physics_that_was_left_out_beside_it():
    hidden = ({"kind": "pulley_friction", "efficiency": 0.85}, {"kind": "precurvature", "curvature_per_m": 1.5})
    right = recorded(Case(hidden=tuple(tuple(effect.items()) for effect in hidden)))
    wrong = PLANTED["disks 5 and 6 are exchanged"](right)
    without = (RUBBING | YIELDING) - {"pulley_friction"}
    searched, blunders, *_ = without_blunders(Task(wrong, without=without), lambda stage: None, serially)
    assert [blunder.blunder for blunder in blunders] == ["disks 5 and 6 are exchanged"]
    assert searched.choice.kinds == {"pulley_friction", "precurvature"}


def test_a_blunder_that_effects_hide_shows_beside_those_that_were_found():
    """In a sequence that was set aside: what the others tell predicts it no more."""
    hidden = RIGHT["four effects"]
    right = recorded(Case(hidden=tuple(tuple(effect.items()) for effect in hidden)))
    wrong = backward(right, "out")
    assert find_blunder(wrong, Settings()) is None
    found = investigate(Task(wrong, without=RUBBING | YIELDING | IMITATING))
    assert found.verdict == "set-up"
    assert [blunder.blunder for blunder in found.blunders] == ["the pictures of sequence out are in backward order"]
    assert found.choice.kinds == {effect["kind"] for effect in hidden}
    there = found.choice.fitted.effects
    assert find_blunder(right, Settings(), there) is None
    moved = find_blunder(late(right, "mixed"), Settings(), there)
    assert moved.blunder == "the pictures of sequence mixed belong to the step before the one they are noted at"


def test_steps_that_are_exchanged_are_said():
    """Their weights are not believed, each being the other's; beside a plate that is weak."""
    found = investigate(Task(steps_swapped(recorded(), "mixed", 2, 3), without=RUBBING | YIELDING))
    assert found.verdict == "set-up"
    (blunder,) = found.blunders
    assert blunder.blunder == "the pictures of steps 2 and 3 of sequence mixed are exchanged"
    assert (found.choice.kinds, found.doubted_steps) == ({"weakened_plate"}, [])


def test_steps_that_are_exchanged_in_a_sequence_that_was_set_aside_are_said():
    found = investigate(Task(steps_swapped(recorded(Case(hidden=())), "out", 1, 3)))
    (blunder,) = found.blunders
    assert blunder.blunder == "the pictures of steps 1 and 3 of sequence out are exchanged"
    assert (found.verdict, found.choice.kinds, found.missed_steps) == ("set-up", frozenset(), [])


@pytest.mark.parametrize(("hidden", "share"), [((), 0.7), ((WEAK,), 0.8)])
def test_weights_that_are_noted_as_a_multiple_in_a_sequence_that_was_set_aside_are_said(hidden, share):
    right = recorded(Case(hidden=tuple(tuple(effect.items()) for effect in hidden)))
    found = investigate(Task(misnoted(right, "1", "out", share), without=RUBBING | YIELDING | IMITATING))
    assert (found.verdict, found.choice.kinds) == ("set-up", {effect["kind"] for effect in hidden})
    (blunder,) = found.blunders
    assert blunder.whose == "of cable 1 in sequence out"
    pulled = right.loads.tension > 0
    mended = found.recording.loads.tension
    np.testing.assert_allclose(mended[pulled], right.loads.tension[pulled], rtol=0.02)


def test_a_blunder_by_another_factor_on_the_same_weights_is_the_same():
    """Beside other effects another factor fits best."""
    noted, finer, others = (
        Blunder(f"the weights {whose} are noted as {times} times", (), "steps.csv", recorded(), False, 1.0, whose=whose)
        for whose, times in (("of cable 1", 1.25), ("of cable 1", 1.26), ("of cable 2", 1.25))
    )
    assert noted.is_same(finer)
    assert not noted.is_same(others)
    assert not replace(noted, whose="").is_same(replace(finer, whose=""))


def test_weights_are_only_multiplied_where_the_cable_is_pulled_as_far_in_another_sequence():
    right = recorded()
    said = {remedy.factor.whose for remedy in factor_blunders(right, ["out", "in"])}
    assert said == {"of cable 1 in sequence out", "of cable 2 in sequence in", "of cable 1 in sequence in",
                    "of sequence in"}  # fmt: skip
    harder = other_steps(right, cable_1_n=right.steps["cable_1_n"].where(right.steps["sequence"].ne("out"), 500.0))
    assert not list(factor_blunders(harder, ["out"]))


def test_forgotten_slips_show_although_slip_along_the_path_stands_in_for_them():
    """Without the weak plate they gain too little; and slip along the path leaves no slip to be declared."""
    found = investigate(Task(without_slips(recorded())))
    assert [blunder.blunder for blunder in found.blunders] == [FORGOTTEN_SLIPS]
    assert (found.verdict, found.choice.kinds) == ("set-up", {"weakened_plate"})


def slipping_the_other_way(known, name):
    """A recording with the sign of all declared slips of a sequence exchanged."""
    here = known.steps["sequence"] == name
    return other_steps(
        known, **{f"slip_{k}": known.steps[f"slip_{k}"].where(~here, -known.steps[f"slip_{k}"]) for k in "1234"}
    )


def test_where_slip_goes_against_the_tension_its_sign_is_said_to_be_wrong():
    """Friction that lags by a millimetre would explain it as well."""
    wrong = slipping_the_other_way(recorded(Case(hidden=())), "in")
    assert contradicted_slips(wrong) == {"2": ["in"]}
    searched, blunders, rival, _ = without_blunders(Task(wrong), lambda stage: None, serially)
    assert [blunder.blunder for blunder in blunders] == ["slip is declared with the wrong sign in sequence in"]
    assert not searched.choice.kinds
    assert rival is None


@pytest.fixture(scope="module")
def set_up():
    """Of a recording with the wrong sign of slip where several cables are pulled and let go at once."""
    wrong = slipping_the_other_way(recorded(Case(hidden=())), "mixed")
    assert not contradicted_slips(wrong)
    without = (RUBBING | YIELDING | IMITATING) - {"slip_history"}
    return without_blunders(Task(wrong, without=without), lambda stage: None, serially)


def test_to_lose_photographs_is_no_gain():
    """Noise of three times the stated: every photograph that is left out would be a gain of ln 9 / 2."""
    recording = recorded()
    kept = replace(recording, readings=recording.readings.where(recording.readings.step % 4 > 0))
    level = SimpleNamespace(level=NoiseLevel(scale=3.0))
    outcomes = []
    for some in (kept, recording):
        fitted = fit_constants(predictor(some))
        outcomes.append((SimpleNamespace(fitted=fitted, tried=(fitted,), level=level, structured=False), Search((), 0)))
    fall = [outcome[0].fitted.reduced for outcome in outcomes]
    honest = len(np.unique(recording.readings.step)) * np.log(fall[1] / fall[0]) / 2
    assert not speaks_for(*outcomes, honest + 1)
    assert speaks_for(*outcomes, honest - 1)


def test_a_blunder_that_explains_by_fewer_effects_stands_beside_them(set_up):
    assert not set_up.blunders
    assert set_up.rival.blunder == "slip is declared with the wrong sign in sequence mixed"
    assert set_up.searched.choice.kinds == {"slip_history"}
    assert not set_up.without_rival.choice.kinds
    found = check(set_up.searched, set_up.rival)
    assert any(
        remark.startswith(f"it looks as if {set_up.rival.blunder}") and "just as well, which would explain" in remark
        for remark in found.remarks
    )


def test_it_is_said_where_nothing_but_its_mending_explains_what_was_set_aside(set_up, monkeypatch):
    monkeypatch.setattr(around, "without_blunders", lambda *_: set_up)
    found = investigate(set_up.searched.tested.doubted.task)
    assert found.verdict == "set-up"
    assert [blunder.blunder for blunder in found.blunders] == ["slip is declared with the wrong sign in sequence mixed"]
    assert not found.choice.kinds


@pytest.fixture(scope="module")
def weak():
    """What is found of a rig with a weak plate."""
    return to_search(Task(recorded()), lambda stage: None, serially)


def test_a_rival_blunder_leaves_an_explanation_ambiguous(weak):
    rival = Blunder("cables 1 and 2 are exchanged", (), "steps.csv", recorded(), False, 10.0, True)
    assert check(weak).verdict == "explained"
    beside = check(weak, rival)
    assert beside.verdict == "ambiguous"
    assert any("cables 1 and 2 are exchanged just as well" in remark for remark in beside.remarks)
    assert what_to_do(tell(beside)).startswith("Look first whether cables 1 and 2 are exchanged. ")


@pytest.mark.parametrize("later", ["the same", "what looked the same", "another", None])
def test_a_blunder_must_still_show_beside_what_explains_the_mended_recording(weak, later, monkeypatch):
    """With other physics than was supposed a wrist showed another blunder than the one that it was mended of."""
    hidden = Blunder("the same", ("what looked the same",), "markers.csv", recorded(), False, 10.0)
    shown = iter([hidden, later and replace(hidden, blunder=later)])
    monkeypatch.setattr(around, "find_blunder", lambda *_, **__: next(shown))
    unexplained = replace(check(weak), verdict="unexplained")
    monkeypatch.setattr(around, "searched_as", lambda *_: weak)
    found, blunders = around.beside_effects(Task(recorded()), weak, unexplained, (), serially)
    assert blunders == ((hidden,) if later in ("the same", "what looked the same") else ())
    assert (found is unexplained) == (not blunders)


def test_a_recording_with_a_clear_blunder_is_not_searched_to_the_end_as_it_is(monkeypatch):
    """What a blunder has spoiled is searched for long, and in vain."""
    wrong = PLANTED["cables 1 and 4 are exchanged"](recorded(Case(hidden=(tuple(WEAK.items()),))))
    limits, real = [], weighed.search

    def searched(tested, least_worth=-np.inf):
        limits.append((tested.doubted.recording is wrong, least_worth))
        return real(tested, least_worth)

    monkeypatch.setattr(weighed, "search", searched)
    found, (blunder,), *_ = without_blunders(Task(wrong), lambda stage: None, serially)
    assert blunder.blunder == "cables 1 and 4 are exchanged"
    assert found.choice.kinds == {"weakened_plate"}
    assert [limit for as_it_is, limit in limits if as_it_is] == [np.inf]
