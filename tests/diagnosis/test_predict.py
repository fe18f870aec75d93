"""What was learnt carries over to another design, and files of it run."""

import json

import numpy as np
import pandas as pd
import pytest
from diagnosis.learnt import STEPS, run
from diagnosis.simulated import MU, PROGRAM, WEAK, Case, E, diagnosed, manipulator, steps_of

from prb3r import SpecError, load_manipulator, predict, solve
from prb3r.diagnosis.fit.constants import Constants
from prb3r.diagnosis.result.carried_constants import carried_constants
from prb3r.model.effects.cables import TensionOffset
from prb3r.model.manipulator import Manipulator
from prb3r.proof.rig.simulate import simulate


def test_bands_hold_the_truth_of_the_same_rig_and_are_narrow(weak_rig):
    table = predict(weak_rig, weak_rig / "same.toml", weak_rig / "steps.csv").positions
    true = manipulator(E * 1.05, MU * 0.9, [WEAK])
    states = [simulate(true, steps_of(name)) for name in PROGRAM]
    beyond = table["disk"] > 0
    for name, field in (("x_m", "x"), ("y_m", "y"), ("angle_rad", "angle")):
        stem, unit = name.rsplit("_", 1)
        low, high = table[f"{stem}_low_{unit}"], table[f"{stem}_high_{unit}"]
        truth = np.concatenate([getattr(state, field).ravel() for state in states])
        held = (low <= truth) & (truth <= high)
        assert held[beyond].mean() > 0.85, name
        assert (high - low).max() < {"m": 2e-3, "rad": 0.03}[unit], name
        assert table[name][beyond].between(low[beyond], high[beyond]).all(), name


def test_weights_in_kilograms_pull_every_rig_that_is_drawn(weak_rig):
    """As their newtons do, where the design's kilogram weighs what its file says."""
    design = Manipulator.model_validate(manipulator() | {"gravity_m_s2": 4.0})
    steps = {"sequence": "a", "step": [1, 2], "slip_1": -1}
    hung, pulled = (
        predict(weak_rig, design, steps | {f"cable_1_{unit}": loads}, draws=40).positions
        for unit, loads in (("kg", [5.0, 15.0]), ("n", [20.0, 60.0]))
    )
    pd.testing.assert_frame_equal(hung, pulled)
    tip = pulled["disk"] == 6
    assert (pulled["y_high_m"] > pulled["y_low_m"])[tip].all()


def test_another_number_of_plates_carries_material_and_leaves_the_fault_behind(weak_rig):
    result = run(weak_rig, weak_rig / "longer.toml", "-o", weak_rig / "learnt.toml")
    assert result.exit_code == 0, result.output
    assert (
        "# left behind: weakened plate, which is a fault of one part of this rig"
        in (weak_rig / "learnt.toml").read_text()
    )
    learnt, constants = load_manipulator(weak_rig / "learnt.toml"), diagnosed().constants
    assert learnt.plates == 8
    assert not learnt.effect
    assert learnt.youngs_modulus_pa == pytest.approx(constants["youngs_modulus_pa"].explained)
    assert learnt.friction.coefficient == pytest.approx(constants["friction_coefficient"].explained)
    assert (solve(learnt, STEPS)["outcome"] == "converged").all()


@pytest.mark.long
def test_of_pulleys_it_is_said_that_their_loss_carries_over():
    rubbing = {"kind": "pulley_friction", "efficiency": 0.8}
    lossy = diagnosed(Case(hidden=(tuple(rubbing.items()),), program="reversing"))
    assert [effect.kind for effect in lossy.effects] == ["pulley_friction"]
    rig = manipulator()
    sister = rig | {"segment": [segment | {"plates": 4} for segment in rig["segment"]]}
    said = [[remark for remark in predict(lossy, each).remarks if "pulleys" in remark] for each in (rig, sister)]
    assert [len(remarks) for remarks in said] == [0, 1]


def test_plates_of_known_bending_stiffness_get_the_same_factor(weak_rig):
    plain = manipulator()
    known = {"plates": 3, "length_m": 0.03, "clamp_m": 0.008, "bending_stiffness_n_m2": 0.2}
    plain["segment"] = [known, known]
    learnt = predict(weak_rig, Manipulator.model_validate(plain)).manipulator
    factor = diagnosed().constants["youngs_modulus_pa"].explained / E
    assert [segment.bending_stiffness_n_m2 for segment in learnt.segment] == pytest.approx([0.2 * factor] * 2)


def test_the_same_design_gets_everything_and_runs_as_predicted(weak_rig):
    learnt = predict(weak_rig / "diagnosis.json", weak_rig / "same.toml", STEPS, draws=40)
    explained = load_manipulator(weak_rig / "explained.toml")
    assert learnt.left_behind == ()
    assert [effect.kind for effect in learnt.manipulator.effect] == ["weakened_plate"]
    alone = solve(explained, STEPS)["x_m"]
    np.testing.assert_allclose(solve(learnt.manipulator, STEPS)["x_m"], alone, atol=1e-9)
    np.testing.assert_allclose(learnt.positions["x_m"], alone, atol=1e-4)  # other models survive, hardly probable
    again = predict(weak_rig, weak_rig / "same.toml", STEPS, draws=40)
    pd.testing.assert_frame_equal(learnt.positions, again.positions)


def test_what_a_diagnosis_returned_tells_the_same_as_its_folder(weak_rig):
    of_folder, of_itself = (
        predict(weak_rig, weak_rig / "same.toml", STEPS, draws=40),
        predict(diagnosed(), weak_rig / "same.toml", STEPS, draws=40),
    )
    pd.testing.assert_frame_equal(of_itself.positions, of_folder.positions)


def test_the_command_writes_the_table(weak_rig):
    result = run(weak_rig, weak_rig / "same.toml", weak_rig / "steps.csv", "-o", weak_rig / "predicted.csv")
    assert result.exit_code == 0, result.output
    columns = "sequence step disk x_m x_low_m x_high_m y_m y_low_m y_high_m angle_rad angle_low_rad angle_high_rad"
    assert list(pd.read_csv(weak_rig / "predicted.csv")) == columns.split()


def test_what_cannot_be_used_is_refused(weak_rig, tmp_path):
    (tmp_path / "diagnosis.json").write_text("{")
    assert "not valid JSON" in (result := run(tmp_path, weak_rig / "same.toml")).output
    assert result.exit_code == 2
    record = json.loads((weak_rig / "diagnosis.json").read_text())
    del record["posterior"]
    (tmp_path / "diagnosis.json").write_text(json.dumps(record))
    assert "diagnose the recording again" in (result := run(tmp_path, weak_rig / "same.toml")).output
    assert result.exit_code == 2
    assert "no such file" in (result := run(tmp_path / "nowhere", weak_rig / "same.toml")).output
    (tmp_path / "both/short").mkdir(parents=True)
    (tmp_path / "both/short/diagnosis.json").write_text("{}")
    assert "give that of one, short" in (result := run(tmp_path / "both", weak_rig / "same.toml")).output
    assert result.exit_code == 2
    assert run(weak_rig, weak_rig / "same.toml", "-o", tmp_path / "learnt.csv").exit_code == 2
    with pytest.raises(SpecError, match="at least 40"):
        predict(weak_rig, weak_rig / "same.toml", STEPS, draws=10)


def test_a_stated_stiffness_goes_by_what_was_learnt_and_not_by_another_material():
    """Young's modulus only turns strain into stress there."""
    segment = {"plates": 3, "length_m": 0.03, "clamp_m": 0.008, "bending_stiffness_n_m2": 0.2}
    plain = manipulator() | {"segment": [segment, segment]}
    here, there = (Manipulator.model_validate(plain | {"youngs_modulus_pa": e}) for e in (1.87e11, 1e11))
    found = Constants(log_stiffness=0.05)
    assert carried_constants(found, here, there).log_stiffness == pytest.approx(0.05)
    of_sections = Manipulator.model_validate(manipulator(1e11))
    carried = carried_constants(found, Manipulator.model_validate(manipulator()), of_sections)
    assert carried.log_stiffness == pytest.approx(0.05 + np.log(1.87))


ZERO, DRIFT = (
    {"kind": "tension_offset", "cables": ["1"], "offset_n": 4.0},
    {"kind": "tension_drift", "offset_n_per_step": 0.1},
)


def on_benches(weak_rig, tmp_path, effects, **bench):
    """The design of more plates as predicted from a record whose models have `effects` and no free parameters."""
    record = json.loads((weak_rig / "diagnosis.json").read_text())
    for model in record["posterior"]["models"]:
        model |= {"effects": effects, "free": [], "covariance": [], "constants": {}}
    (tmp_path / "diagnosis.json").write_text(json.dumps(record))
    return predict(tmp_path, weak_rig / "longer.toml", STEPS, draws=60, **bench)


def test_what_belongs_to_the_bench_carries_over_where_the_design_stands_on_it(weak_rig, tmp_path):
    """The zero of a force sensor stays with the bench, its drift was that of one day."""
    plain = load_manipulator(weak_rig / "longer.toml").replace("model", "elastica")
    wrong = Manipulator.model_validate(plain.model_dump(exclude_none=True) | {"effect": [ZERO]})
    without, felt = (solve(rig, STEPS) for rig in (plain, wrong))
    same, other, unsaid = (
        on_benches(weak_rig, tmp_path, [ZERO, DRIFT], **bench)
        for bench in ({"same_bench": True}, {"same_bench": False}, {})
    )
    assert same.manipulator.effect == unsaid.manipulator.effect == [TensionOffset(**ZERO)]
    assert len(same.left_behind) == 1
    assert "tension drift, which went with the course of this recording" in same.left_behind[0]
    assert other.manipulator.effect == []
    assert "tension offset, which belongs to the bench of this recording" in other.left_behind[0]
    for found, expected in ((same, felt), (other, without), (unsaid, felt)):
        np.testing.assert_allclose(found.positions["y_m"], expected["y_m"], atol=1e-9)
    beyond = unsaid.positions["disk"] > 0

    def held(found, rig):
        ends = (found.positions[f"y_{end}_m"][beyond] for end in ("low", "high"))
        return rig["y_m"][beyond].between(*ends)

    assert held(unsaid, without).all()
    assert held(unsaid, felt).all()
    assert np.abs(felt["y_m"] - without["y_m"]).max() > 3e-3
    assert not held(other, felt).any()


def test_only_where_it_matters_the_bench_is_asked_for(weak_rig, tmp_path):
    asked = [
        any("say --same-bench or --other-bench" in remark for remark in on_benches(weak_rig, tmp_path, effects).remarks)
        for effects in ([ZERO], [DRIFT], [WEAK])
    ]
    assert asked == [True, False, False]
    assert not any("bench" in remark for remark in on_benches(weak_rig, tmp_path, [ZERO], same_bench=False).remarks)
    stays = "of what stays with the recorded rig"
    told = [
        any(remark.startswith(stays) for remark in on_benches(weak_rig, tmp_path, effects).remarks)
        for effects in ([ZERO], [WEAK])
    ]
    assert told == [False, True]


BENT = {"kind": "precurvature", "curvature_per_m": 0.8}


def test_whether_another_rig_is_bent_at_rest_alike_is_left_open(weak_rig, tmp_path):
    """All plates of the recorded rig are bent before any load: half of the draws of another one have plates of the same
    coil, and what is predicted has straight ones, unless its file says what it has."""
    plain = load_manipulator(weak_rig / "longer.toml").replace("model", "elastica")
    bent = Manipulator.model_validate(plain.model_dump(exclude_none=True) | {"effect": [BENT]})
    straight, alike = (solve(rig, STEPS) for rig in (plain, bent))
    found = on_benches(weak_rig, tmp_path, [BENT])
    assert found.manipulator.effect == []
    np.testing.assert_allclose(found.positions["y_m"], straight["y_m"], atol=1e-9)
    beyond = found.positions["disk"] > 0
    ends = (found.positions[f"y_{end}_m"][beyond] for end in ("low", "high"))
    low, high = ends
    for rig in (straight, alike):
        assert rig["y_m"][beyond].between(low, high).all()
    assert np.abs(alike["y_m"] - straight["y_m"]).max() > 3e-3
    (said,) = [remark for remark in found.remarks if "of one coil" in remark]
    assert "the precurvature of all plates" in said
    one = {"kind": "precurvature", "curvature_per_m": 0.8, "plates": [2]}
    assert not any("of one coil" in remark for remark in on_benches(weak_rig, tmp_path, [one]).remarks)
    record = weak_rig / "longer.toml"
    own = Manipulator.model_validate(load_manipulator(record).model_dump(exclude_none=True) | {"effect": [BENT]})
    assert not any("of one coil" in remark for remark in predict(tmp_path, own, STEPS, draws=40).remarks)


def test_the_command_takes_the_bench_and_its_file_says_what_was_supposed(weak_rig, tmp_path):
    on_benches(weak_rig, tmp_path, [ZERO])
    files = {}
    for option in ([], ["--same-bench"], ["--other-bench"]):
        result = run(tmp_path, weak_rig / "longer.toml", *option)
        assert result.exit_code == 0
        files[" ".join(option)] = result.output
    assert ["tension_offset" in text for text in files.values()] == [True, True, False]
    supposed = "# the design is taken to stand on the bench of the recording, mounted alike, with tension offset: say"
    assert [supposed in text for text in files.values()] == [True, False, False]
