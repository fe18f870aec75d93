"""What does not look like noise, held against what the recording states of its accuracy."""

from dataclasses import replace

import numpy as np
import pytest
from diagnosis.simulated import UNEXPLAINED, Case, recorded

from prb3r.diagnosis.check import check
from prb3r.diagnosis.evidence.outliers import Doubts
from prb3r.diagnosis.evidence.stated_accuracy import share_of_stated
from prb3r.diagnosis.fit.calibrate import fit_constants
from prb3r.diagnosis.fit.covariance import reading_sd
from prb3r.diagnosis.fit.prediction import predictor
from prb3r.diagnosis.investigate import investigate
from prb3r.diagnosis.known import Task
from prb3r.diagnosis.result.tell import tell
from prb3r.diagnosis.search.apply import serially
from prb3r.diagnosis.stages import to_search
from prb3r.present.diagnosis.sentences import verdict_sentences


def stated(recording, factor):
    """The recording with so many times the noise stated for its readings."""
    was = recording.measurement
    louder = {name: getattr(was, name) * factor for name in ("position_sd_m", "angle_sd_rad")}
    return replace(recording, measurement=was.model_copy(update=louder))


def share(recording):
    fitted = fit_constants(predictor(recording))
    return share_of_stated(fitted, Doubts(np.ones(recording.readings.count)))


@pytest.mark.parametrize("factor", [2.0, 5.0])
def test_the_share_is_one_over_the_factor_by_which_the_noise_is_stated_too_large(factor):
    right = recorded(Case(hidden=()))
    assert share(right) >= 1.0  # what is stated rightly leaves no room for more
    assert share(stated(right, factor)) == pytest.approx(1 / factor, rel=0.1)


def test_a_disk_that_is_off_by_more_than_is_stated_is_not_hidden_among_the_others():
    quiet = stated(recorded(Case(hidden=())), 4.0)
    readings = quiet.readings
    turns = np.cos(np.arange(readings.count))  # what no constant and no frame can follow
    off = np.where(readings.disk == 3, 2.0 * reading_sd(quiet) * turns, 0.0)
    assert share(replace(quiet, readings=readings._replace(value=readings.value + off))) >= 1.0
    assert share(replace(quiet, readings=readings._replace(value=readings.value + off / 2))) < 1.0


def test_as_much_as_is_stated_but_for_chance_leaves_no_room():
    """0.98 of what is stated on every disk and in every sequence is what noise may well be."""
    right = recorded(Case(hidden=()))
    met = fit_constants(predictor(right)).solved.readings
    off = 0.98 * reading_sd(right) * np.sign(np.cos(np.arange(right.readings.count)))
    assert share(right.with_values(met + off)) >= 1.0
    assert share(right.with_values(met + off / 2)) == pytest.approx(0.49, rel=0.05)


@pytest.mark.long
def test_one_set_of_effects_is_not_explained_while_it_leaves_what_does_not_look_like_noise():
    """Even where no other set comes near it."""
    searched = to_search(Task(stated(recorded(), 3.0)), lambda stage: None, serially)
    assert check(searched).verdict == "explained"
    smooth = replace(searched, choice=replace(searched.choice, smooth_moments=0.0))
    assert check(smooth).verdict == "ambiguous"


@pytest.mark.long
def test_what_the_library_lacks_is_never_explained_where_it_is_below_what_is_stated():
    """What is named may stand in for it, and that is said; as it is stated it is `unexplained`."""
    without = UNEXPLAINED.without - {"cable_bending"}
    louder = investigate(Task(stated(recorded(UNEXPLAINED), 2.0), without=without))
    assert louder.choice.structured
    assert not louder.choice.beyond_stated
    assert louder.verdict == "ambiguous"
    assert any("times what is stated of readings and tensions" in remark for remark in louder.remarks)
    assert verdict_sentences(tell(louder)).startswith("Explained within the accuracy that is stated, not to the noise")
