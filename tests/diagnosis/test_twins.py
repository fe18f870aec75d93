"""A segment that is softer than stated is the other that is stiffer, with a lower Young's modulus; plates beyond a knee
are plates on a plateau."""

from dataclasses import replace

import numpy as np
import pytest
from diagnosis.simulated import NITINOL, Case, recorded

from prb3r.diagnosis.evidence.outliers import Doubts
from prb3r.diagnosis.fit.calibrate import fit_constants
from prb3r.diagnosis.fit.least_squares import fit
from prb3r.diagnosis.fit.prediction import predictor
from prb3r.diagnosis.library import hypotheses
from prb3r.diagnosis.library.scope import Scope
from prb3r.diagnosis.search import twins as twins_module
from prb3r.diagnosis.search.pool import Pool
from prb3r.diagnosis.search.search import Search
from prb3r.diagnosis.search.selection import choose, explore_until_settled
from prb3r.diagnosis.search.twins import of_corners, of_flags, of_other_segments, of_plateaus, twins_of
from prb3r.diagnosis.settings import Settings
from prb3r.model.effects.plates import closing_angles
from prb3r.recording.recording import Prior

SOFT = Case(hidden=((("kind", "segment_stiffness"), ("segment", 2), ("factor", 0.7)),))


def softened(prior):
    """The fit of a soft second segment, and the library that it is of."""
    calibrated = fit_constants(predictor(replace(recorded(SOFT), prior=prior)))
    predict = calibrated.model.predict
    library = hypotheses(Scope.of(predict.recording, predict.chain, calibrated.solved.states))
    softer = next(each for each in library if each.name == "segment_stiffness (segment 2)")
    return fit(calibrated.model.adding(softer), np.append(calibrated.p, 0.0)), library


def test_two_segments_are_told_apart_by_what_is_known_of_the_modulus_alone():
    fitted, library = softened(Prior())
    (twin,) = of_other_segments(fitted, library)
    assert [each.name for each in twin.model.hypotheses] == ["segment_stiffness (segment 1)"]
    assert twin.chi2 == pytest.approx(fitted.chi2, abs=1e-3)
    factor, other = (each.model.shares(each.p)[0][0] for each in (fitted, twin))
    assert np.exp(factor) == pytest.approx(0.7, abs=0.02)
    assert other == pytest.approx(-factor, abs=1e-3)
    assert twin.constants.log_stiffness == pytest.approx(fitted.constants.log_stiffness + factor, abs=1e-3)
    known, library = softened(Prior(youngs_modulus=0.1))
    (strained,) = of_other_segments(known, library)
    assert strained.chi2 > known.chi2 + 5


PLATEAU = {"kind": "superelastic_plate", "plateau_strain": 0.0078, "compression_ratio": 1.35, "plateau_slope": 0.06}


def test_plates_that_soften_are_looked_at_as_plates_on_a_plateau():
    """From the knee that was fitted alone, wherever probes stand."""
    calibrated = fit_constants(predictor(recorded(Case(hidden=(tuple(PLATEAU.items()),), plates=NITINOL))))
    predict = calibrated.model.predict
    library = hypotheses(Scope.of(predict.recording, predict.chain, calibrated.solved.states))
    law = next(each for each in library if each.name == "nonlinear_plate (law bilinear)")
    strain, ratio = law.free
    knee = fit(calibrated.model.adding(law), np.array([*calibrated.p, strain.at(0.01), ratio.at(0.4)]))
    (twin,) = of_plateaus(knee, library)
    assert [each.kind for each in twin.model.hypotheses] == ["superelastic_plate"]
    assert twin.effects[0].plateau_strain == pytest.approx(0.0078, rel=0.05)
    assert twin.chi2 < knee.chi2 - 10
    assert not list(of_plateaus(twin, library))
    assert not list(of_plateaus(knee, [each for each in library if each.kind != "superelastic_plate"]))
    start = np.array([*calibrated.p, strain.at(0.005), ratio.at(1.2)])
    stiffer = fit(calibrated.model.adding(law), start, fixed=[len(start) - 1])
    assert stiffer.effects[0].ratio > 1
    assert not list(of_plateaus(stiffer, library))


KNEE = {"kind": "nonlinear_plate", "knee_strain": 0.004, "ratio": 0.5}
CORNER, BEND = {**KNEE, "law": "bilinear"}, {**KNEE, "law": "smooth", "sharpness": 3.0}


@pytest.mark.parametrize(("hidden", "found", "gain"), [(CORNER, "smooth", 0.0), (BEND, "bilinear", 10.0)])
def test_a_smooth_knee_is_looked_at_as_a_corner_and_a_corner_as_a_smooth_knee(hidden, found, gain):
    """From the knee that was fitted, and the law that made the readings is found with its size."""
    calibrated = fit_constants(predictor(recorded(Case(hidden=(tuple(hidden.items()),), plates=NITINOL))))
    predict = calibrated.model.predict
    library = hypotheses(Scope.of(predict.recording, predict.chain, calibrated.solved.states))
    law = next(each for each in library if each.name == f"nonlinear_plate (law {found})")
    begun = [free.at(value) for free, value in zip(law.free, (0.005, 0.6, 6.0), strict=False)]
    knee = fit(calibrated.model.adding(law), np.array([*calibrated.p, *begun]))
    (twin,) = of_corners(knee, library)
    (effect,) = twin.effects
    assert effect.law == hidden["law"]
    assert twin.chi2 < knee.chi2 + 0.5 - gain
    assert (effect.knee_strain, effect.ratio) == (pytest.approx(0.004, rel=0.05), pytest.approx(0.5, rel=0.05))
    if hidden is BEND:
        assert effect.sharpness == pytest.approx(3.0, rel=0.3)
    cubic = next(each for each in library if each.name == "nonlinear_plate (law cubic)")
    stiffer = fit(calibrated.model.adding(cubic), np.append(calibrated.p, cubic.free[0].at(1.0)))
    assert not list(of_corners(stiffer, library))


FLAG = {"kind": "flag_hysteresis", "reverse_ratio": 0.5}


def test_plates_that_dissipate_are_looked_at_as_plates_on_plateaus_that_give_back_less():
    """It takes two effects where one was found, of which none alone stands in its place."""
    hidden = (tuple(PLATEAU.items()), tuple(FLAG.items()))
    calibrated = fit_constants(predictor(recorded(Case(hidden=hidden, plates=NITINOL))))
    predict = calibrated.model.predict
    library = hypotheses(Scope.of(predict.recording, predict.chain, calibrated.solved.states))
    loops = next(each for each in library if each.kind == "hysteretic_plate")
    start = [free.at(value) for free, value in zip(loops.free, (0.009, 0.4), strict=True)]
    found = fit(calibrated.model.adding(loops), np.array([*calibrated.p, *start]))
    kinds = lambda twin: [each.kind for each in twin.model.hypotheses]  # noqa: E731
    twins = list(of_flags(found, library))
    assert {tuple(kinds(twin)) for twin in twins} == {
        ("nonlinear_plate", "flag_hysteresis"),
        ("superelastic_plate", "flag_hysteresis"),
    }
    best = min(twins, key=lambda twin: twin.chi2)
    assert kinds(best) == ["superelastic_plate", "flag_hysteresis"]
    assert best.chi2 < found.chi2 - 4
    assert best.effects[0].plateau_strain == pytest.approx(0.0078, rel=0.05)
    assert best.effects[1].reverse_ratio == pytest.approx(0.5, rel=0.05)
    assert not list(of_flags(best, library))
    assert not list(of_flags(found, [each for each in library if each.kind != "flag_hysteresis"]))
    law = next(each for each in library if each.name == "nonlinear_plate (law bilinear)")
    softer = replace(found.model, hypotheses=(loops, law))
    both = fit(softer, np.array([*found.p, law.free[0].at(0.01), law.free[1].at(0.9)]), most_steps=1)
    assert not list(of_flags(both, library))


TOUCHING = (("kind", "disk_contact"), ("angle_rad", 0.1), ("stiffness_n_m_per_rad", 40.0))


def test_disks_that_touch_are_looked_at_as_notches_that_close_and_the_other_way_round(monkeypatch):
    """At 0.1 rad; notches of this rig close a little later beyond the end of its inner cables."""
    calibrated = fit_constants(predictor(recorded(Case(hidden=(TOUCHING,)))))
    predict = calibrated.model.predict
    early = Settings(closing_range=(0.05, 2.0))
    library = hypotheses(Scope.of(predict.recording, predict.chain, calibrated.solved.states, early))
    disks = next(each for each in library if each.kind == "disk_contact")
    starts = [np.concatenate([calibrated.p, start]) for start in disks.starts(0.3)]
    touching = min((fit(calibrated.model.adding(disks), start) for start in starts), key=lambda found: found.chi2)
    begun = []
    monkeypatch.setattr(
        twins_module, "fit", lambda model, start: begun.append(model.effects(start)) or fit(model, start)
    )
    twins = {twin.model.hypotheses[0].name: twin for twin in twins_of(touching, library)}
    assert set(twins) == {"notch_closing", "notch_closing (side negative)", "notch_closing (side positive)"}
    closing = twins["notch_closing"]
    assert calibrated.chi2 - closing.chi2 > 0.95 * (calibrated.chi2 - touching.chi2) > 50
    assert twins["notch_closing (side negative)"].chi2 > closing.chi2 + 10
    closes = closing_angles(predict.chain.arc, predict.recording.manipulator)
    for (started,) in [*begun, closing.effects]:  # where disks were found to touch, before and after the fit
        angles = started.factor * closes
        assert angles.min() < 0.1 < 1.05 * angles.max()
        assert started.stiffness_n_m_per_rad == pytest.approx(touching.effects[0].stiffness_n_m_per_rad, rel=0.2)
    (back,) = twins_of(closing, library)
    assert back.effects[0].angle_rad == pytest.approx(touching.effects[0].angle_rad, rel=1e-3)
    assert not list(twins_of(touching, [disks]))
    beside = touching.model.adding(twins["notch_closing (side negative)"].model.hypotheses[0])
    both = fit(beside, np.concatenate([touching.p, [0.0, 0.0]]), most_steps=1)
    kinds = {tuple(each.kind for each in twin.model.hypotheses) for twin in twins_of(both, library)}
    assert not kinds  # a manipulator has either stop but once


STIFF = (("kind", "segment_stiffness"), ("segment", 1), ("factor", 1.7))
CLAMPED = Case(hidden=(STIFF, (("kind", "clamp_compliance"), ("compliance_rad_per_n_m", 0.03))), seed=3)
"""A stiff segment and soft clamps, which the other segment, softer, and a modulus near the stated one imitate."""


@pytest.mark.long
def test_the_other_side_of_the_best_model_is_looked_at_too():
    calibrated = fit_constants(predictor(recorded(CLAMPED)))
    predict = calibrated.model.predict
    library = hypotheses(Scope.of(predict.recording, predict.chain, calibrated.solved.states))
    search = Search(library, 0)
    doubts = Doubts(np.ones(predict.recording.readings.count))
    found = choose(explore_until_settled(Pool(search, Settings(), [calibrated]), search, doubts), search)
    first, second = (next(each for each in library if each.name == f"segment_stiffness (segment {k})") for k in (1, 2))
    best = found.survivors[0].effects
    assert second in best
    assert first not in best
    assert best - {second} | {first} in {frozenset(each.model.hypotheses) for each in found.tried}
    assert any(survivor.effects >= {first} for survivor in found.survivors)
