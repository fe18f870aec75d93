"""Predictions after an unexplained recording: on which model they rest, and how wide their bands are."""

import json
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from diagnosis.learnt import STEPS
from diagnosis.simulated import UNEXPLAINED, Case, E, diagnosed, investigated, manipulator, recorded

from prb3r import predict, solve
from prb3r.diagnosis.check import better_as_filed
from prb3r.diagnosis.confidence import NORMAL_REACH
from prb3r.diagnosis.fit.calibrate import constants_as_filed, fit_constants
from prb3r.diagnosis.fit.constants import Constants
from prb3r.diagnosis.fit.prediction import predictor
from prb3r.diagnosis.result.discrepancy import share_moved
from prb3r.diagnosis.result.remarks import as_the_file_has_it
from prb3r.diagnosis.result.unexplained import best_elsewhere, best_of_rig
from prb3r.mechanics.chain import pose
from prb3r.model.effects.plates import SegmentStiffness
from prb3r.model.manipulator import Manipulator
from prb3r.recording.recording import Prior

ELASTICA = {"model": "elastica"}
"""What a diagnosis calculates with."""


@pytest.fixture
def unexplained(weak_rig, tmp_path):
    """Predicts the recorded rig from a record in which one model is reported in the place of those that survive."""
    record = json.loads((weak_rig / "diagnosis.json").read_text())
    posterior = record["posterior"]
    posterior["tolerance"] = dict.fromkeys(posterior["tolerance"], 0.0)
    plain = {"probability": 1.0, "named": True, "constants": {}, "free": [], "covariance": []}
    soft = [{"kind": "segment_stiffness", "segment": k, "factor": 0.8} for k in (1, 2)]

    def predicted(**discrepancy):
        posterior["reported"] = plain | {"effects": soft} | ({"discrepancy": discrepancy} if discrepancy else {})
        (tmp_path / "diagnosis.json").write_text(json.dumps(record))
        return predict(tmp_path, weak_rig / "same.toml", STEPS, draws=400)

    return predicted


def test_predictions_rest_on_the_model_that_is_reported(unexplained):
    """Both segments softer is a lower Young's modulus."""
    found = unexplained().positions
    soft = solve(Manipulator.model_validate(manipulator(0.8 * E) | ELASTICA), STEPS)
    for name in ("x_m", "y_m", "angle_rad"):
        np.testing.assert_allclose(found[name], soft[name], atol=1e-9)
    np.testing.assert_allclose(found["y_high_m"], found["y_low_m"], atol=1e-9)


def test_what_is_taken_from_an_unexplained_recording_is_said(weak_rig, tmp_path):
    """Constants alone, where the weak plate that is named does not help to predict; and a study that draws rigs."""
    record = json.loads((weak_rig / "diagnosis.json").read_text()) | {"verdict": "unexplained"}
    (named, *_) = record["posterior"]["models"]
    constants = named | {"probability": 1.0, "effects": [], "free": [], "covariance": [], "discrepancy": {"share": 0.1}}
    for reported, said in ((constants, True), (named | {"discrepancy": {"share": 0.1}}, False)):
        record["posterior"]["reported"] = reported
        (tmp_path / "diagnosis.json").write_text(json.dumps(record))
        remarks = predict(tmp_path, weak_rig / "same.toml", STEPS, draws=40).remarks
        assert any(remark.startswith("constants alone are taken") for remark in remarks) == said
        assert any(remark.startswith("the recording is unexplained") for remark in remarks)
    (modulus, *_) = (part for part in named["free"] if part["name"] == "youngs_modulus_pa")
    filed = constants | {"constants": named["constants"] | {"youngs_modulus_pa": modulus["null"]}}
    filed |= {"free": [modulus | {"u": 0.0}], "covariance": [[1e-4]]}
    record["posterior"]["reported"] = filed
    (tmp_path / "diagnosis.json").write_text(json.dumps(record))
    remarks = predict(tmp_path, weak_rig / "same.toml", STEPS, draws=40).remarks
    assert any(remark.startswith("constants alone of the recorded rig's file are taken") for remark in remarks)


def test_effects_that_would_move_another_design_much_farther_do_not_carry_over(weak_rig, tmp_path):
    """Plates of 0.8 times their stiffness move a thicker arm by a fifth of its way and more; they carry over where they
    moved the recorded one by as much, and not where they moved it by a twentieth."""
    record = json.loads((weak_rig / "diagnosis.json").read_text())
    posterior = record["posterior"]
    posterior["tolerance"] = dict.fromkeys(posterior["tolerance"], 0.0)
    plain = {"probability": 1.0, "named": True, "constants": {}, "free": [], "covariance": [], "effects": []}
    soft = [{"kind": "segment_stiffness", "segment": k, "factor": 0.8} for k in (1, 2)]
    thicker = manipulator(thickness=1.2 * manipulator()["segment"][0]["thickness_m"])
    found = {}
    for moved in (0.05, 0.9):
        carried = plain | {"effects": soft, "moved": moved}
        posterior |= {"reported": carried, "carried": carried, "on_bench": carried, "alone": plain}
        (tmp_path / "diagnosis.json").write_text(json.dumps(record))
        found[moved] = predict(tmp_path, thicker, STEPS, draws=40)
    thickness = thicker["segment"][0]["thickness_m"]
    alone, with_effects = (
        solve(Manipulator.model_validate(manipulator(modulus, thickness=thickness) | ELASTICA), STEPS)
        for modulus in (E, 0.8 * E)
    )
    for name in ("x_m", "y_m"):
        np.testing.assert_allclose(found[0.05].positions[name], alone[name], atol=1e-9)
        np.testing.assert_allclose(found[0.9].positions[name], with_effects[name], atol=1e-9)
    said = "constants alone are taken: what carries over would move this design by"
    assert [any(remark.startswith(said) for remark in each.remarks) for each in found.values()] == [True, False]
    far, near = (plain | {"effects": soft, "moved": moved} for moved in (0.9, 0.05))
    posterior |= {"on_bench": far, "carried": near}
    (tmp_path / "diagnosis.json").write_text(json.dumps(record))

    def modulus_of(steps, same_bench):
        """Over the nominal one: what carries over of both segments is a lower Young's modulus."""
        found = predict(tmp_path, thicker, steps, draws=40, same_bench=same_bench).manipulator
        return found.youngs_modulus_pa / E

    assert modulus_of(STEPS, same_bench=True) == pytest.approx(0.8)  # each by how far it moves the recorded rig
    assert modulus_of(STEPS, same_bench=False) == pytest.approx(1.0)
    still = STEPS.assign(**{name: 0.0 for name in STEPS if name.endswith("_n")})
    assert modulus_of(still, same_bench=False) == pytest.approx(0.8)  # nothing moves, so nothing is too far


def test_the_share_that_is_moved_is_of_the_way_from_the_straight_manipulator():
    chain = Manipulator.model_validate(manipulator() | ELASTICA).chain()
    straight = pose(chain, np.zeros_like(chain.rest))
    places = np.stack([straight.x, straight.y])[:, None]
    bent = places + np.random.default_rng(0).normal(0, 0.01, places.shape)
    assert share_moved(chain, places + 1.1 * (bent - places), bent) == pytest.approx(0.1)
    lost = bent.copy()
    lost[:, 0, 3] = np.nan
    assert share_moved(chain, places + 1.1 * (lost - places), lost) == pytest.approx(0.1)
    assert share_moved(chain, bent, places) == np.inf


def test_bands_widen_by_the_share_of_the_way_from_the_straight_manipulator(unexplained):
    """Disks of the straight one stand 34 mm apart, the first with its middle 2 mm behind the base."""
    found = unexplained(share=0.1)
    table = found.positions
    away = np.hypot(table["x_m"] - 0.034 * table["disk"] + 0.002, table["y_m"])
    for stem, unit, sd in (("x", "m", 0.1 * away), ("y", "m", 0.1 * away), ("angle", "rad", 0.1 * table["angle_rad"])):
        half = (table[f"{stem}_high_{unit}"] - table[f"{stem}_low_{unit}"]) / 2
        np.testing.assert_allclose(half, NORMAL_REACH * abs(sd), rtol=0.15, atol=1e-9)
    assert any("as an error of 10 % (root mean square)" in remark for remark in found.remarks)


@pytest.mark.long
def test_what_is_unexplained_widens_bands_until_they_hold_another_design(tmp_path):
    """One effect is left out of the library.  What the diagnosis says of plates of another thickness is held against
    the design with all that was hidden which carries over."""
    found = diagnosed(UNEXPLAINED)
    thicker = manipulator(thickness=1.2 * manipulator()["segment"][0]["thickness_m"])
    true = solve(
        Manipulator.model_validate(thicker | ELASTICA | {"effect": [dict(each) for each in UNEXPLAINED.hidden]}), STEPS
    )
    table = predict(found, thicker, STEPS).positions
    outer = table["disk"] > 0
    for stem, unit in (("x", "m"), ("y", "m"), ("angle", "rad")):
        held = true[f"{stem}_{unit}"].between(table[f"{stem}_low_{unit}"], table[f"{stem}_high_{unit}"])
        assert held[outer].mean() > 0.9, stem


@pytest.mark.long
def test_constants_alone_carry_over_where_they_predict_what_was_set_aside_better():
    found = investigated(UNEXPLAINED)
    best, missed = best_of_rig(found)
    assert best is found.reported
    exchanged = replace(found, reported=found.refitted, refitted=found.reported)
    assert best_of_rig(exchanged)[0] is exchanged.refitted
    for same_bench in (True, False):  # two holes off their places and gravity stand for a weak plate
        elsewhere = best_elsewhere(found, same_bench)
        assert elsewhere[0] is found.refitted
        assert missed.share < elsewhere[1].share


def test_effects_of_an_unexplained_recording_carry_over_only_if_they_remove_most_of_what_constants_leave():
    """Constants of the reported model that are half as far off remove three quarters of the squared excess, those that
    are nine tenths as far a fifth."""
    found = investigated(Case(hidden=()))
    right = found.reported.constants

    def off(log, model=found.reported.model):
        constants = right._replace(log_stiffness=right.log_stiffness + log)
        p = np.where(np.array(model.varied) == "log_stiffness", constants.log_stiffness, found.reported.p)
        return SimpleNamespace(constants=constants, effects=(), p=p, model=model)

    alone, rest = off(0.2), {"recording": found.recording, "fresh": None, "filed": None}
    for log, better, enough in ((0.1, True, True), (0.18, True, False), (0.3, False, False)):
        held = SimpleNamespace(reported=off(log), refitted=alone, **rest)
        assert (best_of_rig(held)[0] is held.reported) == better
        assert (best_elsewhere(held, True)[0] is held.reported) == enough
    plain = found.reported.model.predict  # refitted constants will be eight deviations off
    known = replace(plain, recording=replace(plain.recording, prior=Prior(youngs_modulus=0.03)))
    model = replace(found.reported.model, predict=known)
    held = SimpleNamespace(reported=off(0.3), refitted=off(0.2, model), **rest)
    assert best_of_rig(held)[0] is held.refitted
    filed, missed = best_elsewhere(held, True)
    assert filed.constants == Constants()
    assert missed.share > 0


def test_constants_of_the_file_are_taken_where_they_predict_what_was_set_aside_better():
    """The rig of 1.05 times the nominal modulus beside a fit that was led astray, and beside the right one."""
    found = investigated(Case(hidden=()))
    right, fresh = found.reported, found.fresh
    model = right.model
    astray = np.where(np.array(model.varied) == "log_stiffness", 0.4, right.p)
    solved = model.solve(astray)
    astray = model.fitted(astray, model.residuals(astray, solved), right.jacobian, solved, True)
    filed = constants_as_filed(found.choice.calibrated)
    assert filed.constants == Constants()  # the recording states how exactly the camera's frame is known
    errors = fresh.errors(astray, filed)
    assert errors.gain > 0.9
    (said,) = as_the_file_has_it(fresh, astray, filed)
    assert (
        f"to {1e3 * errors.rmse_explained_m:.3g} mm, and those refitted to {1e3 * errors.rmse_calibrated_m:.3g}" in said
    )
    assert better_as_filed(found.choice.calibrated, right, fresh) is None
    assert better_as_filed(found.choice.calibrated, astray, fresh).constants == filed.constants
    led = replace(found, reported=astray, refitted=astray, filed=filed)
    assert best_of_rig(led)[0] is filed
    assert best_elsewhere(led, same_bench=True)[0] is filed


def test_constants_of_the_file_are_not_taken_where_most_of_what_was_fitted_refutes_them():
    """A rig of 1.6 times the modulus in one sequence, or in all but one, beside an unseen sequence that is as the
    file says."""
    right = recorded(Case(hidden=()))
    stiffer, as_filed = (predictor(right)(Constants(log_stiffness=log)) for log in (np.log(1.6), 0.0))
    of_reading = right.of_sequence[right.readings.step]
    unlike = SimpleNamespace(errors=lambda filed, refitted: SimpleNamespace(is_worse=lambda times: True))
    for one in (True, False):
        mixed = right.with_values(np.where((of_reading == 0) == one, stiffer, as_filed))
        fitted = fit_constants(predictor(mixed))
        assert 0.02 < fitted.constants.log_stiffness < np.log(1.6) - 0.02
        assert (better_as_filed(fitted, fitted, unlike) is not None) == one


def test_segments_all_of_which_differ_are_judged_with_the_modulus_that_carries_their_mean():
    """Plates half as stiff as twice the modulus are what they were; without either the rig is missed."""
    found = investigated(Case(hidden=()))
    right, segments = found.reported.constants, range(1, 1 + len(found.recording.manipulator.segment))
    halves = tuple(SegmentStiffness(kind="segment_stiffness", segment=k, factor=0.5) for k in segments)
    twice = right._replace(log_stiffness=right.log_stiffness + np.log(2.0))
    reported = SimpleNamespace(constants=twice, effects=halves, model=found.reported.model)
    alone = SimpleNamespace(constants=right._replace(log_stiffness=right.log_stiffness + 0.1), effects=())
    held = SimpleNamespace(reported=reported, refitted=alone, recording=found.recording, fresh=None, filed=None)
    assert best_elsewhere(held, True)[0] is reported
