"""Blunders whose mending moves nothing with the effects found are none, and those that no fit has seen are some."""

from dataclasses import replace
from functools import partial

import numpy as np
import pytest
from diagnosis.planted import (
    PLANTED,
    in_kilograms,
    mirrored,
    other_cables,
)
from diagnosis.simulated import RUBBING, YIELDING, Case, recorded

from prb3r.diagnosis import blunders as weighed
from prb3r.diagnosis.blunders import without_blunders
from prb3r.diagnosis.checks.setup.factors import factor_blunders
from prb3r.diagnosis.checks.setup.find import Blunder, blunder_by
from prb3r.diagnosis.checks.setup.weigh import is_left_behind, moves_nothing
from prb3r.diagnosis.known import Task
from prb3r.diagnosis.search.apply import serially
from prb3r.diagnosis.settings import Settings
from prb3r.diagnosis.stages import to_search, to_test

pytestmark = pytest.mark.long

DEAD = ((("kind", "dead_cable"), ("cable", "1")),)


@pytest.fixture(scope="module")
def dead():
    """A recording of a rig with a dead cable, and the same with the sign of that cable's offset exchanged."""
    right = recorded(Case(hidden=DEAD))
    (cable,) = (cable for cable in right.manipulator.cable if cable.name == "1")
    return right, other_cables(right, cable_1={"offset_m": -cable.offset_m})


def test_what_explains_a_recording_leaves_a_mended_one_behind_unless_the_blunder_is_there(dead):
    right, turned = dead
    explained = to_search(Task(turned), lambda stage: None, serially).choice

    def behind(mended):
        tested = to_test(Task(mended), lambda stage: None, serially)
        return is_left_behind(tested.doubted.fitted, tested.doubted.doubts, explained)

    assert not behind(right)
    assert behind(PLANTED["disks 5 and 6 are exchanged"](turned))


def test_a_mending_moves_nothing_where_its_cable_is_dead(dead):
    right, turned = dead
    searched = to_search(Task(turned), lambda stage: None, serially)
    assert searched.choice.kinds == {"dead_cable"}
    fitted, (aside, *_) = searched.choice.fitted, searched.tested.doubted.aside
    unseen = partial(mirrored, sequences=(right.sequences[aside],))
    others = (PLANTED["offset_m of cable 3 has the wrong sign"], mirrored, unseen)
    assert moves_nothing(right, turned, fitted)
    assert not any(moves_nothing(blunder(right), turned, fitted) for blunder in others)


@pytest.mark.parametrize("sure", [False, True])
def test_what_moves_nothing_is_no_blunder_and_what_was_found_with_it_stands(dead, monkeypatch, sure):
    """Of a rig of seed 101 with a dead cable and touching disks constants alone bent so far otherwise that the search
    missed both, but for a cable of the other sign."""
    right, turned = dead
    blunder = Blunder("offset_m of cable 1 has the wrong sign", (), "manipulator.toml", turned, sure, 1.0)
    monkeypatch.setattr(weighed, "blunders_of", lambda *_: (blunder,))
    monkeypatch.setattr(weighed, "speaks_for", lambda *_: True)
    searched, blunders, *_ = without_blunders(Task(right), lambda stage: None, serially)
    assert not blunders
    assert searched.choice.kinds == {"dead_cable"}
    doubted = searched.tested.doubted
    assert doubted.recording is right
    assert {hypothesis.kind for hypothesis in doubted.search.start_from.values} == {"dead_cable"}
    assert not doubted.search.assumed.values  # found in the same readings, it is not likelier beforehand


def test_of_blunders_that_move_nothing_together_none_is_said(monkeypatch):
    """Weights of a cable that transmits nothing: with constants alone, those of a sequence would be as good as none."""
    dead = recorded(Case(hidden=DEAD))
    rows = [dead.of_sequence == number for number in range(len(dead.sequences))]
    pulled = [name for name, own in zip(dead.sequences, rows, strict=True) if dead.loads.tension[own, 0].any()]
    settings, found, mended = Settings(), [], dead
    for name in pulled[:2]:
        among = [way for way in factor_blunders(mended, [name]) if "of cable 1 " in way.blunder]
        found.append(replace(blunder_by(among[0], mended, among, settings), plain=True))
        mended = found[-1].mended
    assert len(found) == 2
    monkeypatch.setattr(weighed, "blunders_of", lambda *_: tuple(found))
    searched, blunders, *_ = without_blunders(Task(dead, without=RUBBING | YIELDING), lambda stage: None, serially)
    assert blunders == ()
    assert searched.choice.kinds == {"dead_cable"}
    np.testing.assert_array_equal(searched.tested.doubted.recording.loads.tension, dead.loads.tension)


def test_a_blunder_that_no_fit_has_seen_is_said():
    """Mended, the sequence is set aside; as it is noted it hardly pulls, and another one is."""
    right = recorded(Case(hidden=()))
    (aside, *_) = to_test(Task(right), lambda stage: None, serially).doubted.aside
    name = right.sequences[aside]
    searched, blunders, *_ = without_blunders(Task(in_kilograms(right, name)), lambda stage: None, serially)
    assert [said.blunder for said in blunders] == [f"weights of sequence {name} noted as newtons are kilograms"]
    assert searched.choice.kinds == frozenset()
