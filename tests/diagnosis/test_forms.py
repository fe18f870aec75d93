"""One effect in several forms: what is said of it where readings do not tell the forms apart."""

from dataclasses import replace

import pytest
from diagnosis.simulated import NITINOL, Case, investigated

from prb3r.diagnosis.library.hypothesis import Hypothesis
from prb3r.diagnosis.result.answer import what_to_do
from prb3r.diagnosis.result.projection import as_json, summary_lines
from prb3r.diagnosis.result.tell import tell
from prb3r.model.effects import EFFECT_KINDS
from prb3r.present.diagnosis.sentences import other_explanations

KNEE = {"kind": "nonlinear_plate", "law": "smooth", "knee_strain": 0.004, "ratio": 0.8, "sharpness": 3.0}
"""A knee that is nearly a corner; the bends of plates are read too coarsely to tell."""
FORMS_ALONE = frozenset(EFFECT_KINDS) - {"nonlinear_plate"}


@pytest.fixture(scope="module")
def bent():
    return investigated(Case(hidden=(tuple(KNEE.items()),), read=("bend_rad",), plates=NITINOL, without=FORMS_ALONE))


def test_an_effect_whose_forms_readings_do_not_tell_apart_explains_and_the_forms_are_said(bent):
    assert bent.verdict == "explained"
    (effect,) = bent.named
    assert (effect.hypothesis.name, effect.rivals) == ("nonlinear_plate (law smooth)", ())
    assert [form.hypothesis.name for form in effect.forms] == ["nonlinear_plate (law bilinear)"]
    told = tell(bent)
    (said,) = [line for line in summary_lines(told) if "forms" in line]
    assert said.startswith("note: one effect in 2 forms: nonlinear_plate (law smooth), as said, and ")
    assert "and nonlinear_plate (law bilinear) with knee_strain 0.00" in said
    assert "these readings do not tell between them" in said
    assert "Look at the rig" not in what_to_do(told)
    assert not any("cannot be told apart" in line for line in summary_lines(told))
    (named,) = as_json(told)["effects"]
    assert named["indistinguishable_from"] == ["nonlinear_plate (law bilinear)"]
    (other,) = other_explanations(told)
    assert "in another form, nonlinear plate (law bilinear) with " in other


def test_nobody_is_sent_to_the_rig_to_look_for_the_form_of_an_effect(bent):
    """Where the verdict is ambiguous for another reason."""
    told = replace(tell(bent), verdict="ambiguous")
    assert what_to_do(told).startswith("Look first at what the notes doubt")


def test_forms_are_of_one_kind_on_the_same_parts():
    smooth, corner = (Hypothesis("nonlinear_plate", (("law", law),)) for law in ("smooth", "bilinear"))
    assert smooth.in_another_form(corner)
    assert not smooth.in_another_form(smooth)
    assert smooth.in_another_form(Hypothesis("nonlinear_plate", (("law", "smooth"), ("side", "positive"))))
    assert Hypothesis("hysteretic_plate").in_another_form(Hypothesis("hysteretic_plate", (("elements", 2),)))
    assert not Hypothesis("precurvature").in_another_form(Hypothesis("precurvature", (("plates", (2,)),)))
    assert not Hypothesis("weakened_plate", (("plate", 1),)).in_another_form(
        Hypothesis("weakened_plate", (("plate", 2),))
    )
