"""What a diagnosis says at the end: constants, errors on what was set aside, what remains."""

import re
from dataclasses import replace

import numpy as np
import pytest
from diagnosis.simulated import (
    Case,
    diagnosed,
    investigated,
)

from prb3r.diagnosis.checks.verdict import why_unexplained
from prb3r.diagnosis.library import SUSPECTS
from prb3r.diagnosis.result.design_prediction import read_posterior
from prb3r.diagnosis.result.mismatch import mismatch_of
from prb3r.diagnosis.result.projection import summary_lines
from prb3r.present.diagnosis.belief import carry_over


def test_the_closing_lines_tell_the_constants_and_what_is_not_predicted():
    found = diagnosed()
    (line,) = [line for line in summary_lines(found) if line.startswith("constants: ")]
    modulus, low, high = map(float, re.match(r"constants: Young's modulus (\S+) \((\S+) to (\S+)\) GPa", line).groups())
    assert low < 1.05 * found.nominal.youngs_modulus_pa / 1e9 < high
    assert low < modulus < high
    assert ", friction coefficient 0." in line
    lines = summary_lines(replace(found, heldout=replace(found.heldout, lost=8)))
    held = [line for line in lines if line.startswith("held out")]
    assert held
    assert all(line.endswith("; 8 readings not predicted") for line in held)


@pytest.mark.long
def test_refitted_constants_never_leave_more_than_the_nominal_ones():
    """Plates bent before any load turn the picture by far more than the camera may be turned, which has its price."""
    bent = ({"kind": "precurvature", "curvature_per_m": 4.0},)
    case = Case(tuple(tuple(effect.items()) for effect in bent), read=("x_m", "y_m"), without=frozenset(SUSPECTS))
    chi2 = diagnosed(case).chi2
    assert chi2.calibrated > 2
    assert chi2.nominal > chi2.calibrated


def test_what_is_left_once_a_blunder_is_mended_is_said(tmp_path):
    left = replace(diagnosed(), verdict="set-up", why="a real mismatch remains")
    assert any("unexplained, since a real mismatch remains" in line for line in summary_lines(left))
    assert read_posterior(left)[1] == "unexplained"
    assert "while a mismatch remains" in " ".join(carry_over(left))


def test_where_nothing_is_named_the_error_on_what_was_set_aside_is_said():
    clean = diagnosed(Case(hidden=()))
    assert clean.verdict == "adequate"
    (line, *_) = [line for line in summary_lines(clean) if line.startswith("held out")]
    assert "->" not in line
    assert f"error {1e3 * clean.heldout.rmse_explained_m:.3g} mm" in line


def test_smooth_moments_that_chance_does_not_leave_are_unexplained_and_said():
    found = investigated()
    rate = found.choice.fitted.model.settings.naming_rate
    assert found.verdict == "explained"
    assert found.choice.smooth_moments > rate
    smooth = replace(found, choice=replace(found.choice, smooth_moments=rate / 2))
    assert why_unexplained(found.choice, (), (), ()) == ""
    assert why_unexplained(smooth.choice, (), (), ()).startswith("a real mismatch remains")
    assert mismatch_of(smooth).statement.startswith("What is left after the best explanation changes smoothly")


def test_a_score_that_may_be_chance_is_said_to_be():
    """Between the levels of alarm and of naming, where nothing else speaks against constants alone."""
    found = investigated(Case(hidden=()))
    scores = found.choice.scores_of_best
    assert why_unexplained(found.choice, (), (), ()) == ""
    for share, said in ((0.5, "a score test is as large as in one of "), (1.5, "a real mismatch remains")):
        large = np.full(len(scores.z), scores.threshold + share * (scores.naming - scores.threshold))
        choice = replace(found.choice, scores_of_best=replace(scores, z=large))
        assert why_unexplained(choice, (), (), ()).startswith(said)


def test_errors_with_parts_as_told_stand_beside_those_as_drawn_where_they_are_much_smaller():
    found = diagnosed()
    drawn = found.heldout.rmse_explained_m
    near = replace(found, heldout=replace(found.heldout, rmse_made_m=0.95 * drawn, rmse_made_rad=None))
    far = replace(found, heldout=replace(found.heldout, rmse_made_m=0.5 * drawn, rmse_made_rad=None))
    lines = {
        each: [line for line in summary_lines(each) if line.startswith(("held out", "next"))] for each in (near, far)
    }
    assert not any("as drawn" in line or "prb3r predict, with its parts" in line for line in lines[near])
    told = f"{1e3 * drawn:.3g} mm with all parts as drawn, {500 * drawn:.3g} mm with parts as the other sequences"
    assert told in lines[far][0]
    assert "Predict this rig by prb3r predict, with its parts as the recording tells them" in lines[far][-1]


@pytest.mark.long
def test_what_is_named_in_part_is_never_certain():
    """Of an unexplained recording no probability of a model says that the model is right."""
    case = Case(
        hidden=(tuple({"kind": "weakened_plate", "plate": 4, "factor": 0.7}.items()),),
        without=frozenset({"weakened_plate"}),
    )
    found = diagnosed(case)
    assert found.why
    assert not any(effect.certain for effect in found.effects if effect.partial)
