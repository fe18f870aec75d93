"""Blunders of the set-up that effects imitate: each is told in the place of the other."""

from dataclasses import replace

import pytest
from diagnosis.planted import (
    CABLES_N,
    LADEN,
    PLANTED,
    in_pounds,
)
from diagnosis.simulated import IMITATING, RUBBING, YIELDING, Case, recorded

from prb3r.diagnosis import blunders as weighed
from prb3r.diagnosis.blunders import without_blunders
from prb3r.diagnosis.investigate import investigate
from prb3r.diagnosis.known import Task
from prb3r.diagnosis.search.apply import serially
from prb3r.recording.recording import Prior

pytestmark = pytest.mark.long

SURE = {"tip_y_n and disk4_y_n hold pounds", "weights of all cables are half of what pulled"}
"""Of the blunders with loads and lengths those that no effect imitates: more than the whole would arrive."""


LENGTHS = [blunder for blunder in PLANTED if "length_m" in blunder]


@pytest.mark.parametrize(
    "effect",
    [
        {"kind": "weight_friction", "efficiency": 0.75},
        {"kind": "camera_scale", "scale": 0.9},
        {"kind": "tip_load_friction", "efficiency": 0.9},
        {"kind": "tip_load_friction", "efficiency": 0.5},
    ],
)
def test_an_effect_that_looks_like_a_blunder_of_another_size_stays_an_effect(effect):
    """Pounds would let 45.4 % of a tip load arrive, a pitch for lengths would be a scale of 0.882."""
    right = recorded(Case(hidden=(tuple(effect.items()),), program="laden"))
    found = investigate(Task(right, without=RUBBING | YIELDING | IMITATING))
    assert (found.verdict, found.choice.kinds) == ("explained", {effect["kind"]})
    assert found.rival_blunder is None


@pytest.mark.parametrize("blunder", [*LADEN, *LENGTHS])
def test_a_blunder_that_an_effect_imitates_is_said_in_its_place(blunder):
    wrong = (LADEN | PLANTED)[blunder](recorded(Case(hidden=(), program="laden")))
    found = investigate(Task(wrong, without=RUBBING | YIELDING | IMITATING))
    assert (found.verdict, found.choice.kinds) == ("set-up", frozenset())
    (said,) = found.blunders
    assert said.blunder == blunder
    assert said.sure == (blunder in SURE)


def test_a_blunder_that_constants_alone_do_not_show_is_weighed_against_the_effect_that_imitates_it(monkeypatch):
    """As on an arm that sags so far that they leave everything: a lever that is shorter by a disk is friction there."""
    monkeypatch.setattr(weighed, "blunders_of", lambda *_: ())
    sags = {"kind": "gravity", "x_m_s2": 0.0, "y_m_s2": -9.81}
    right = recorded(Case(hidden=(tuple(sags.items()),), program="laden"))
    wrong = LADEN["what hung at disk 4 is noted as loads on disk 5"](right)
    without = RUBBING | YIELDING | IMITATING
    found = without_blunders(Task(wrong, without=without), lambda stage: None, serially)
    assert [said.blunder for said in found.blunders] == ["what hung at disk 4 is noted as loads on disk 5"]
    assert found.searched.choice.kinds == {"gravity"}


def test_a_pulley_that_rubs_is_no_lever_that_is_shorter(monkeypatch):
    monkeypatch.setattr(weighed, "blunders_of", lambda *_: ())
    right = recorded(Case(hidden=((("kind", "weight_friction"), ("efficiency", 0.75)),), program="laden"))
    found = without_blunders(Task(right, without=RUBBING | YIELDING | IMITATING), lambda stage: None, serially)
    assert found.searched.choice.kinds == {"weight_friction"}
    assert (found.blunders, found.rival) == ((), None)


def test_a_unit_that_stiffnesses_of_single_segments_stand_in_for_is_a_rival():
    """As one of them is thinner, and the modulus is stated, constants alone explain neither recording; mended, there is
    one effect less, though of the same kind."""
    thinner = {"kind": "segment_stiffness", "segment": 1, "factor": 0.7}
    wrong = in_pounds(recorded(Case(hidden=(tuple(thinner.items()),))), CABLES_N)
    task = Task(replace(wrong, prior=Prior(youngs_modulus=0.05)), without=RUBBING | IMITATING)
    found = without_blunders(task, lambda stage: None, serially)
    assert found.rival.blunder == "weights noted as newtons are pounds"
    assert [effect.name for effect in found.without_rival.choice.effects] == ["segment_stiffness (segment 1)"]
    assert found.searched.choice.kinds == {"segment_stiffness"}
    assert len(found.searched.choice.effects) == 2
