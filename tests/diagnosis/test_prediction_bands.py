"""Predictions over all models that survive: their mean, their bands, and what is said of them."""

import json

import numpy as np
import pandas as pd
import pytest
from diagnosis.learnt import STEPS
from diagnosis.simulated import MU, E, manipulator

from prb3r import predict, solve
from prb3r.diagnosis.result.posterior import FreeParameter, ModelPosterior, Posterior, averaged
from prb3r.model.manipulator import Manipulator

ELASTICA = {"model": "elastica"}
"""What a diagnosis calculates with."""
RECORDED = (
    "the design's file is that of the recorded rig, which is taken to be this one: say --another-copy where it is "
    "another rig of one drawing",
)
"""What is said of the recorded rig under other loads, where all parts are as drawn."""


def test_positions_are_the_mean_over_the_models_that_survive(weak_rig, tmp_path):
    """Of two models, three to one, the second has both segments softer, which is a lower Young's modulus."""
    record = json.loads((weak_rig / "diagnosis.json").read_text())
    posterior = record["posterior"]
    first = next(model for model in posterior["models"] if model["named"]) | {"probability": 0.75}
    first = first | {"effects": [], "free": [], "covariance": [], "constants": {}}
    second = json.loads(json.dumps(first)) | {"probability": 0.25, "named": False}
    second["effects"] = [{"kind": "segment_stiffness", "segment": k, "factor": 0.8} for k in (1, 2)]
    posterior["models"] = [first, second]
    (tmp_path / "diagnosis.json").write_text(json.dumps(record))
    found = predict(tmp_path, weak_rig / "same.toml", STEPS, draws=40).positions
    stiff, soft = (solve(Manipulator.model_validate(manipulator(E * part) | ELASTICA), STEPS) for part in (1, 0.8))
    for name in ("x_m", "y_m", "angle_rad"):
        np.testing.assert_allclose(found[name], 0.75 * stiff[name] + 0.25 * soft[name], atol=1e-9)


def test_where_a_model_has_no_equilibrium_the_others_are_averaged():
    mean = averaged([(0.5, np.array([1.0, np.nan, np.nan])), (0.25, np.array([4.0, 4.0, np.nan]))])
    np.testing.assert_allclose(mean, [2.0, 4.0, np.nan])


def test_where_most_draws_have_no_equilibrium_there_is_no_band(weak_rig, tmp_path):
    """Six rigs of ten have plates that give way beyond the slightest bend."""
    record = json.loads((weak_rig / "diagnosis.json").read_text())
    (plain, *_) = record["posterior"]["models"]
    limp = {"kind": "nonlinear_plate", "law": "bilinear", "knee_per_m": 0.01, "ratio": 1e-3}
    gone = plain | {"probability": 0.6, "named": False, "effects": [*plain["effects"], limp]}
    record["posterior"]["models"] = [gone, plain | {"probability": 0.4}]
    (tmp_path / "diagnosis.json").write_text(json.dumps(record))
    found = predict(tmp_path, weak_rig / "same.toml", weak_rig / "steps.csv", draws=100)
    assert any("there are none where more than 50 % are lost" in remark for remark in found.remarks)
    assert found.positions["x_m"].notna().all()  # of the model that is in balance
    assert found.positions[found.positions["disk"] > 0]["x_low_m"].isna().all()


def test_where_no_draw_has_an_equilibrium_all_of_them_are_said_to_have_none(weak_rig, tmp_path):
    record = json.loads((weak_rig / "diagnosis.json").read_text())
    limp = {"kind": "nonlinear_plate", "law": "bilinear", "knee_per_m": 0.01, "ratio": 1e-3}
    for model in record["posterior"]["models"]:
        model["effects"] = [*model["effects"], limp]
    (tmp_path / "diagnosis.json").write_text(json.dumps(record))
    found = predict(tmp_path, weak_rig / "same.toml", weak_rig / "steps.csv", draws=40)
    assert any(remark.startswith("at some step 100 % of the draws have no equilibrium") for remark in found.remarks)


def test_what_a_mended_recording_leaves_unexplained_is_said_from_its_file_too(weak_rig, tmp_path):
    """The verdict on it is `set-up`."""
    record = json.loads((weak_rig / "diagnosis.json").read_text()) | {"verdict": "set-up"}
    said = "the recording is unexplained: what carries over may stand in for something else"
    for partial in (False, True):
        record["effects"] = [effect | {"partial": partial} for effect in record["effects"]]
        (tmp_path / "diagnosis.json").write_text(json.dumps(record))
        pulled = {"sequence": ["a"], "step": [1], "cable_1_n": [5.0]}
        remarks = predict(tmp_path, weak_rig / "same.toml", pulled, draws=40).remarks
        assert (said in remarks) == partial
        carried = predict(tmp_path, weak_rig / "same.toml")
        assert (f"# {said}\n" in carried.to_toml()) == partial


@pytest.mark.long
def test_what_alone_makes_bands_wide_is_said(weak_rig, tmp_path):
    """A survivor that is hardly probable and moves far."""
    record = json.loads((weak_rig / "diagnosis.json").read_text())
    (plain, *_), case = record["posterior"]["models"], {"kind": "base_compliance", "compliance_rad_per_n_m": 0.03}
    rare = plain | {"probability": 0.1, "named": False, "effects": [*plain["effects"], case]}
    said = []
    for models in ([plain | {"probability": 1.0}], [plain | {"probability": 0.9}, rare]):
        record["posterior"]["models"] = models
        (tmp_path / "diagnosis.json").write_text(json.dumps(record))
        said.append(predict(tmp_path, weak_rig / "same.toml", weak_rig / "steps.csv").remarks)
    assert said[0] == RECORDED
    (*_, remark) = said[1]
    assert "times as wide as without base_compliance, of which the recording leaves a probability of 0.10" in remark


def test_loads_that_bend_plates_further_than_the_recording_did_are_told(weak_rig, tmp_path):
    """The largest mean strain of a plate is half its thickness by its bend over the length between its clamps."""
    first, further = {"sequence": "a", "step": 1}, {}
    for tension in (10.0, 200.0):
        steps = first | {"cable_1_n": [tension]}
        result = predict(weak_rig, weak_rig / "same.toml", steps, draws=40)
        further[tension] = result.remarks
    bends = np.abs(np.diff(result.positions["angle_rad"]))
    free = [
        (segment.length_m - 2 * segment.clamp_m, segment.thickness_m)
        for segment in result.manipulator.segment
        for _ in range(segment.plates)
    ]
    most = max(thickness / 2 * bend / length for bend, (length, thickness) in zip(bends, free, strict=True))
    assert further[10.0] == RECORDED
    _, said, *_ = further[200.0]
    assert f"plates are strained by up to {most:.2%} here" in said
    record = json.loads((weak_rig / "diagnosis.json").read_text())

    def told() -> list[str]:
        (tmp_path / "diagnosis.json").write_text(json.dumps(record))
        return [
            text
            for text in predict(tmp_path, weak_rig / "same.toml", steps, draws=40).remarks
            if text.startswith("plates are")
        ]

    del record["posterior"]["bending"]["strain"]  # of plates of which no outermost fibre is known
    assert told()[0].startswith("plates are bent up to ")
    del record["posterior"]["bending"]  # as it was written before
    assert told() == []


@pytest.mark.long
def test_loads_that_bend_plates_back_are_told_where_no_recorded_step_did(weak_rig, tmp_path):
    record, told = json.loads((weak_rig / "diagnosis.json").read_text()), []
    assert record["posterior"]["bending"]["unloads"] is True  # every sequence lets go
    for unloads in (True, False, None):
        record["posterior"]["bending"]["unloads"] = unloads
        (tmp_path / "diagnosis.json").write_text(json.dumps(record))
        for tension in ([30.0, 60.0], [60.0, 30.0]):
            steps = {"sequence": "a", "step": [1, 2], "cable_1_n": tension}
            remarks = predict(tmp_path, weak_rig / "same.toml", steps, draws=40).remarks
            told.append(any(remark.startswith("plates bend back here, which they never do") for remark in remarks))
    assert told == [False, False, False, True, False, False]


def test_another_rig_of_the_same_drawing_has_no_fault_of_the_recorded_one_and_bands_hold_its_tolerances(weak_rig):
    """The weak plate stays behind; parts that nobody has measured make the bands wide."""
    recorded, copy = (
        predict(weak_rig, weak_rig / "same.toml", STEPS, another_copy=another, draws=60) for another in (False, True)
    )
    assert [effect.kind for effect in recorded.manipulator.effect] == ["weakened_plate"]
    assert recorded.remarks == RECORDED
    assert copy.manipulator.effect == []
    assert "is a fault of one part of this rig" in copy.left_behind[0]
    assert not set(copy.remarks) & set(RECORDED)
    plain = copy.manipulator.model_copy(update={"effect": []})
    np.testing.assert_allclose(copy.positions["y_m"], solve(plain, STEPS)["y_m"], atol=1e-4)  # over all models


def test_what_likely_models_beside_the_named_one_leave_behind_is_told_with_its_probability(weak_rig, tmp_path):
    record = json.loads((weak_rig / "diagnosis.json").read_text())
    first = next(model for model in record["posterior"]["models"] if model["named"]) | {"probability": 0.7}
    first |= {"effects": [], "free": [], "covariance": [], "constants": {}}
    worn = first | {"named": False, "effects": [{"kind": "worn_hole", "disk": 2, "coefficient": 0.5}]}
    record["posterior"]["models"] = [first, worn | {"probability": 0.27}, worn | {"probability": 0.03}]
    (tmp_path / "diagnosis.json").write_text(json.dumps(record))
    left = predict(tmp_path, weak_rig / "longer.toml").left_behind
    assert left == ("worn hole, which is a fault of one part of this rig (probability 0.30)",)


def test_a_draw_at_a_bound_keeps_what_the_recording_tells_of_two_parameters_together():
    """Stiffness and friction are hardly known, their difference closely; the one stands at its bound."""
    nominal, bound = Manipulator.model_validate(manipulator()), 0.02
    frees = [
        FreeParameter(
            name=name, u=u, null=null, scale=1.0, log=True, above=False, low=null / 9, high=null * np.exp(high)
        )
        for name, u, null, high in (
            ("youngs_modulus_pa", bound, E, bound),
            ("friction_coefficient", 0.1, MU, 2.0),
        )
    ]
    loose, close = 0.5**2, 0.01**2
    covariance = loose * np.ones((2, 2)) + close * np.diag([0.0, 1.0])
    model = ModelPosterior(
        probability=1.0, named=True, constants={}, effects=[], free=frees, covariance=covariance.tolist()
    )
    rigs = Posterior(manipulator=nominal, models=[model]).draws(400, 0)
    stiffness, friction = np.array([(rig.constants.log_stiffness, rig.constants.log_friction) for rig in rigs]).T
    assert stiffness.max() == pytest.approx(bound)
    assert np.mean(stiffness > bound - 1e-9) == pytest.approx(0.5, abs=0.1)
    assert np.ptp(stiffness) > 1.0
    apart = friction - stiffness
    assert apart.mean() == pytest.approx(0.1 - bound, abs=0.003)
    assert apart.std() == pytest.approx(0.01, rel=0.2)


@pytest.mark.long
def test_bands_of_a_roughly_made_rig_are_as_wide_as_its_tolerances(weak_rig, tmp_path):
    """A lone cable's tip angle grows as arm times thickness^-3: one per cent of thickness is three of the angle, of two
    segments as wholes and of six plates."""
    record = json.loads((weak_rig / "diagnosis.json").read_text())
    record["posterior"]["tolerance"] = dict.fromkeys(record["posterior"]["tolerance"], 0.0)
    widths = []
    for rough in (0.0, 0.03):
        record["posterior"]["tolerance"]["thickness_relative"] = rough
        (tmp_path / "diagnosis.json").write_text(json.dumps(record))
        tip = predict(
            tmp_path, weak_rig / "same.toml", {"sequence": ["a"], "step": [1], "cable_1_n": [20.0]}
        ).positions.iloc[-1]
        widths.append((tip["angle_high_rad"] - tip["angle_low_rad"]) / abs(tip["angle_rad"]))
    assert widths[0] < 0.04
    assert np.sqrt(widths[1] ** 2 - widths[0] ** 2) == pytest.approx(
        2 * 1.96 * 3 * 0.03 * np.sqrt(1 / 2 + 1 / 6), rel=0.3
    )


def test_an_arm_that_would_buckle_is_not_predicted(weak_rig):
    """Straight under a thousand newtons along it: an equilibrium at which nothing stays."""
    steps = pd.DataFrame({"sequence": "a", "step": [1, 2], "tip_x_n": [-0.1, -1000.0], "cable_1_n": 0.0})
    found = predict(weak_rig, weak_rig / "same.toml", steps, draws=40)
    tip = found.positions.query("disk == 6").set_index("step")
    assert np.isfinite(tip.loc[1, "x_m"])
    assert tip.loc[2, ["x_m", "y_m", "y_low_m", "y_high_m"]].isna().all()
    assert any("no equilibrium" in remark for remark in found.remarks)
