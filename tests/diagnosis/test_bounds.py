"""What is said of a constant whose interval reaches a bound of the fit: no number that nothing beyond was tried for."""

import re
from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from diagnosis.simulated import Case, diagnosed, investigated, recorded

from prb3r.diagnosis import check
from prb3r.diagnosis.fit.calibrate import fit_constants
from prb3r.diagnosis.fit.least_squares import fit
from prb3r.diagnosis.fit.prediction import predictor
from prb3r.diagnosis.library import hypotheses
from prb3r.diagnosis.library.hypothesis import Free, Hypothesis
from prb3r.diagnosis.library.scope import Scope
from prb3r.diagnosis.library.suspect import Estimate
from prb3r.diagnosis.result import tell as telling
from prb3r.diagnosis.result.answer import sureness
from prb3r.diagnosis.result.projection import as_json, summary_lines
from prb3r.diagnosis.result.rig_remarks import Ending, at_bounds, endings
from prb3r.diagnosis.result.tell import may_be_absent, tell
from prb3r.diagnosis.run import diagnosis_of
from prb3r.model.manipulator import Manipulator
from prb3r.present.diagnosis.sentences import bias_of_calibration
from prb3r.recording.recording import Prior

NOMINAL = 0.3
"""Friction coefficient that the file states of cables that do not rub."""


@cache
def found():
    """A rig without friction whose file states some, with nothing known of it beforehand."""
    known = recorded(Case(friction=0.0, seed=7))
    stated = Manipulator.model_validate(
        known.manipulator.model_dump(exclude_none=True) | {"friction": {"coefficient": NOMINAL}}
    )
    return diagnosis_of(replace(known, manipulator=stated, prior=Prior(youngs_modulus=0.1)))


def test_an_end_that_is_a_bound_of_the_fit_is_no_end():
    friction, lowest = found().constants["friction_coefficient"], NOMINAL / found().settings["widest_factor"]
    assert friction.low == pytest.approx(lowest)
    assert friction.open == (True, False)
    (line,) = [text for text in summary_lines(found()) if text.startswith("constants: ")]
    assert re.search(r"friction coefficient 0\.0\d+ \(up to 0\.0\d+\)$", line)
    told = [text for text in bias_of_calibration(found()) if "μ" in text]
    assert len(told) == 1
    assert "(up to 0.0" in told[0]


def test_the_record_has_both_numbers():
    record = as_json(found())["calibration"]["friction_coefficient"]
    assert list(record) == ["nominal", "calibrated", "explained", "low", "high"]
    assert record["low"] == pytest.approx(NOMINAL / found().settings["widest_factor"])


def test_a_constant_that_is_told_keeps_both_ends():
    modulus = found().constants["youngs_modulus_pa"]
    assert modulus.open == (False, False)
    assert modulus.low < 1.05 * modulus.nominal < modulus.high


def test_a_size_that_ends_on_a_bound_of_the_search_is_told():
    """A hole 16 mm off its place, where half of the cable's arm, 12.75 mm, is the most that is sought."""
    known = recorded(Case(hidden=((("kind", "hole_offset"), ("cable", "1"), ("offset_m", 0.016)),)))
    calibrated = fit_constants(predictor(known))
    predict = calibrated.model.predict
    library = hypotheses(Scope.of(predict.recording, predict.chain, calibrated.solved.states))
    offset = next(each for each in library if each.name == "hole_offset (cable 1)")
    found = fit(calibrated.model.adding(offset), np.append(calibrated.p, 0.0))
    (said,) = at_bounds(found)
    (end,) = endings(found)
    assert (end.hypothesis, end.above) == (offset, True)
    assert said.startswith("offset_m of hole_offset (cable 1) ends at 0.0127, as far as was sought: it may be larger")
    inside = fit(calibrated.model.adding(offset), np.append(calibrated.p, 0.1), fixed=(len(calibrated.p),))
    assert at_bounds(inside) == []
    assert at_bounds(calibrated) == []


@pytest.mark.long
def test_nothing_is_explained_by_a_number_that_ends_where_the_search_ended(monkeypatch):
    """The same recording with and without a remark on such a number."""
    assert diagnosed().verdict == "explained"
    for name, says in (("at_bounds", ["ends as far as was sought"]), ("impossible_rims", True)):
        with monkeypatch.context() as patched:
            patched.setattr(check, name, lambda fitted, says=says: says)
            assert diagnosis_of(recorded(Case())).verdict == "ambiguous"


def test_no_effect_is_certain_with_a_number_that_ends_where_the_search_ended(monkeypatch):
    """Or with one whose interval holds its absence; of one and the same investigation."""
    found = investigated(Case())
    (sure,) = tell(found).effects
    (hypothesis,) = found.explained.model.hypotheses
    end = Ending(hypothesis, hypothesis.free[0], 0.05, above=False)
    for name, says in (("endings", lambda fitted: [end]), ("may_be_absent", lambda *known: True)):
        with monkeypatch.context() as patched:
            patched.setattr(telling, name, says)
            (doubted,) = tell(found).effects
        assert (sure.certain, doubted.certain) == (True, False)
        assert (sureness(sure), sureness(doubted)) == ("certain", "in doubt")
        assert doubted.probability == sure.probability


def test_an_effect_all_of_whose_intervals_hold_its_absence_may_be_absent():
    """A share of nothing, a factor of one, and friction that is that of the other holes."""
    sag = Hypothesis("self_weight", free=(Free("x_n", 0.0, -1.0, 1.0), Free("y_n", 0.0, -1.0, 1.0)))
    soft = Hypothesis("clamp_compliance", free=(Free("compliance_rad_per_n_m", 0.0, 0.0, 1.0),))
    weak = Hypothesis("weakened_plate", free=(Free("factor", 1.0, 0.05, 20.0, log=True),))
    worn = Hypothesis("worn_hole", free=(Free("coefficient", 0.0, 0.0, 5.0, above=True),))
    for hypothesis, intervals, absent in (
        (sag, [(0.3, 0.1, 0.5), (0.01, -0.1, 0.1)], False),
        (sag, [(0.05, -0.05, 0.29), (0.01, -0.1, 0.1)], True),
        (soft, [(0.01, 1e-7, 0.07)], True),
        (soft, [(0.01, 1e-3, 0.07)], False),
        (weak, [(0.9, 0.8, 1.01)], True),
        (weak, [(0.7, 0.6, 0.8)], False),
        (worn, [(0.4, 0.28, 0.6)], True),
        (worn, [(0.4, 0.33, 0.6)], False),
        (soft, [(0.01, None, None)], False),
    ):
        told = {free.name: Estimate(*each) for free, each in zip(hypothesis.free, intervals, strict=True)}
        assert may_be_absent(hypothesis, told, friction=0.3) == absent
    probed = replace(soft, probes=((0.1,),))
    assert not may_be_absent(probed, {"compliance_rad_per_n_m": Estimate(0.01, 0.0, 0.07)}, 0.3)
