"""Laws outside the library: one that effects imitate within the noise comes out `unexplained`; which kinds hold one."""

from dataclasses import replace
from types import SimpleNamespace

import pytest

from prb3r.diagnosis.checks.verdict import why_doubtful, why_unexplained
from prb3r.diagnosis.investigate import investigate
from prb3r.diagnosis.known import Task
from prb3r.proof.concealed.composition import drawn_design
from prb3r.proof.concealed.design import Flavour
from prb3r.proof.concealed.foreign import LAWS
from prb3r.proof.concealed.labels import Label
from prb3r.proof.concealed.recordings import recording_of
from prb3r.proof.judging.opened import OpenedCase
from prb3r.proof.judging.scores import GOALS, INFORMATION
from prb3r.proof.judging.verdict import Claim, Verdict
from prb3r.proof.rig.effects import RECORDS


@pytest.fixture(scope="module")
def leaking():
    """The diagnosis of a rig whose cables drag each other along: tensions grow by 7 % of the sum of the others.

    A payload that is larger than noted, or load cells that all read too little, would imitate that too well.
    """
    design = drawn_design((201, 3, Flavour.PLAIN))
    recording = recording_of(design, Label(0, "foreign", 3, 1417186782690373192, foreign=("leak", 0.07)))
    return investigate(Task(recording, without=frozenset({"payload_scale", "load_cell"})))


@pytest.mark.long
def test_a_law_that_effects_imitate_within_the_noise_is_unexplained(leaking):
    """Every other check passes, so that the effects would be named as if they were there."""
    assert why_unexplained(leaking.choice, leaking.failed, (), leaking.checks) == ""
    assert leaking.verdict == "unexplained"
    assert leaking.why.startswith("a law that no effect of the library has, moments on the plates")
    assert "hole_offset (cable 2)" in leaking.why
    assert leaking.named
    assert all(effect.partial for effect in leaking.named)


@pytest.mark.long
def test_what_is_left_anyway_is_judged_by_its_size(leaking):
    """As on a rig that is read far more exactly than it is modelled, whose accuracy is stated."""
    search = SimpleNamespace(log_odds=dict.fromkeys(leaking.choice.survivors[0].effects, -4.0))
    assert why_doubtful(leaking.choice, search).startswith(leaking.why.partition(" at odds")[0])
    assert why_doubtful(replace(leaking.choice, smooth_moments=0.0), search) == ""


HELD = [name for name, law in LAWS.items() if law.held_by]


def test_laws_are_held_by_kinds_of_effects():
    assert HELD == ["friction_grows", "waves"]
    assert all(LAWS[name].held_by in RECORDS for name in HELD)


@pytest.mark.parametrize("law", list(LAWS))
def test_a_law_that_effects_of_one_kind_are_is_scored_apart(law):
    claims = (Claim(LAWS[law].held_by or "worn_hole", {}),)
    label = Label(0, "foreign", 0, 0, foreign=(law, 0.1), nearest={"gravity": 200.0})
    case = OpenedCase(label, Verdict(0, "diagnose", "explained", named=claims), 0.3)
    scores = {goal.name: goal.measure([case]) for goal in INFORMATION}
    no_law = "outside, no law that effects of one kind are: wrong confident name"
    counted = scores[no_law].count, scores["outside, a law that effects of one kind are: this kind named"].count
    assert counted == ((0, 1) if law in HELD else (1, 0))


def test_a_diagnosis_that_fails_on_a_law_outside_the_library_counts_against_it():
    label = Label(0, "foreign", 0, 0, foreign=("leak", 0.1), nearest={"gravity": 200.0}, pair_distance=200.0)
    failed, silent = (OpenedCase(label, Verdict(0, "diagnose", said), 0.3) for said in ("failed", "unexplained"))
    for name, ends in (("wrong confident name", (1.0, 0.0)), ("`unexplained`", (0.0, 1.0))):
        for words in ("outside the library", "outside, two effects together included"):
            goal = next(goal for goal in (*GOALS, *INFORMATION) if goal.name == f"{words}: {name}")
            assert tuple(goal.measure([case]).value for case in (failed, silent)) == ends
