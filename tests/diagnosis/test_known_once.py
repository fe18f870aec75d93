"""What is worked out once at a point serves again there, and nowhere else."""

from dataclasses import replace
from itertools import combinations

import numpy as np
import pytest
from diagnosis.simulated import Case, recorded

from prb3r.diagnosis.evidence import linearised
from prb3r.diagnosis.evidence.linearised import moved_readings
from prb3r.diagnosis.fit.calibrate import fit_constants
from prb3r.diagnosis.fit.least_squares import fit
from prb3r.diagnosis.fit.prediction import predictor
from prb3r.diagnosis.fit.tolerance import tolerances
from prb3r.diagnosis.library import hypotheses
from prb3r.diagnosis.library.joint import JointHypothesis, alone_on
from prb3r.diagnosis.library.scope import Scope
from prb3r.diagnosis.search.linear_selection import Column, LinearModel
from prb3r.recording.recording import Tolerance


@pytest.fixture(scope="module")
def calibrated():
    return fit_constants(predictor(recorded(Case())))


@pytest.fixture(scope="module")
def library(calibrated):
    predict = calibrated.model.predict
    return hypotheses(Scope.of(predict.recording, predict.chain, calibrated.solved.states))


@pytest.fixture(scope="module")
def others(calibrated, library):
    """Fits that differ in constants, in an effect, in its size or its place alone, and in the recording."""
    weak = next(each for each in library if each.name == "weakened_plate (plate 4)")
    p = calibrated.p + 0.05
    moved = replace(calibrated, p=p, solved=calibrated.model.solve(p))
    found = fit(calibrated.model.adding(weak), np.append(calibrated.p, 0.0))
    smaller = np.append(found.p[:-1], found.p[-1] / 2)
    other = calibrated.model.adding(next(each for each in library if each.name == "weakened_plate (plate 2)"))
    elsewhere = replace(found, model=other, solved=other.solve(found.p))
    recording = fit_constants(predictor(recorded(Case(hidden=()))))
    return moved, found, replace(found, p=smaller, solved=found.model.solve(smaller)), elsewhere, recording


def probes_of(library):
    kinds = {each.kind: each for each in library if each.kind != "weakened_plate"}
    return [(each, start) for each in list(kinds.values())[::3] for start in each.starts(0.3)]


def test_what_an_effect_would_do_is_known_by_all_that_it_depends_on(calibrated, library, others):
    probes, fits = probes_of(library), (calibrated, *others)
    fresh = []
    for fitted in fits:
        linearised._known_at.cache_clear()
        fresh.append(moved_readings(fitted, probes))
    linearised._known_at.cache_clear()
    for fitted, known in [*zip(fits, fresh, strict=True), *zip(fits, fresh, strict=True)]:
        again = moved_readings(fitted, probes[::2]) + moved_readings(fitted, probes[1::2])
        for one, other in zip([*known[::2], *known[1::2]], again, strict=True):
            assert one == pytest.approx(other, rel=1e-9, abs=1e-9 * np.abs(one).max())
    for known, others_known in combinations(fresh, 2):
        pairs = zip(known, others_known, strict=True)
        assert any(np.abs(one - other).max() > 1e-3 * np.abs(one).max() for one, other in pairs)


def test_of_another_noise_nothing_is_solved_again(calibrated, library, monkeypatch):
    probes = probes_of(library)
    before = moved_readings(calibrated, probes)
    monkeypatch.setattr(linearised, "response", None)
    monkeypatch.setattr(linearised, "_whole", None)
    noise = replace(calibrated.model.noise, sd=2 * calibrated.model.noise.sd)
    again = moved_readings(replace(calibrated, model=replace(calibrated.model, noise=noise)), probes)
    assert all(one is other for one, other in zip(before, again, strict=True))


def test_tolerances_are_those_of_the_solution_that_is_asked_for(calibrated, others):
    recording = replace(calibrated.model.predict.recording, tolerance=Tolerance())
    predict = predictor(recording)
    here, moved = (tolerances(predict, fitted.solved).moved for fitted in (calibrated, others[0]))
    tolerances.cache_clear()
    again = tolerances(predict, calibrated.solved)
    assert again.moved == pytest.approx(here, rel=1e-12)
    assert np.abs(here - moved).max() > 1e-3 * np.abs(here).max()
    thick = replace(recording, tolerance=Tolerance(length_m=0.0, offset_m=0.0, marker_m=0.0))
    known = tolerances(predictor(thick), calibrated.solved)
    felt = known.sd > 0
    assert known.names == again.names[: len(known.names)]
    assert ["stiffness" in name for name in known.names] == felt.tolist()
    assert known.moved[:, felt] == pytest.approx(here[:, : len(felt)][:, felt], rel=1e-12)
    assert not known.moved[:, ~felt].any()
    assert known.moved[:, felt].any(0).all()


def test_hypotheses_exclude_each_other_in_the_linearised_model_as_they_say(library):
    columns = [Column(each, np.zeros((3, 1)), start, log_odds=0.0) for each in library for start in each.starts(0.3)]
    barred = LinearModel(columns, np.zeros(3)).barred
    said = [
        [j == k or a.hypothesis.excludes(b.hypothesis) for k, b in enumerate(columns)] for j, a in enumerate(columns)
    ]
    assert (barred == np.array(said)).all()
    assert 0 < barred.mean() < 0.5


def test_joint_hypotheses_exclude_each_other_on_the_same_rig_alone(library):
    """Whichever of a kind come first: a law of bending on one rig bars another law there, and none on another rig."""
    first = {each.kind: each for each in library}
    laws = next([a, b] for a, b in combinations(first.values(), 2) if a.excludes(b))
    of_rigs = [(*(alone_on(rig, each, 2) for rig in (0, 1)), JointHypothesis(each.kind, (each, each))) for each in laws]
    mixed = [joint for rigs in zip(*of_rigs, strict=True) for joint in rigs]
    for joint in (mixed, mixed[::-1]):
        barred = LinearModel([Column(each, np.zeros((3, 1)), np.zeros(1)) for each in joint], np.zeros(3)).barred
        assert (barred == [[a is b or a.excludes(b) for b in joint] for a in joint]).all()
