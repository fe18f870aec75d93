"""What was learnt carries over: bands that hold the truth of the rig, and files that run."""

import json
import tomllib

import numpy as np
import pandas as pd
import pytest
from click.testing import CliRunner
from diagnosis.simulated import MU, PROGRAM, WEAK, E, diagnosed, manipulator, steps_of

from prb3r import SpecError, load_manipulator, predict, solve
from prb3r.cli import main
from prb3r.diagnosis.fit.constants import Constants
from prb3r.diagnosis.result.carried_constants import carried_constants
from prb3r.diagnosis.result.files import write_record
from prb3r.diagnosis.result.posterior import FreeParameter, ModelPosterior, Posterior, averaged
from prb3r.model.files.toml import toml_text
from prb3r.model.manipulator import Manipulator
from prb3r.proof.rig.simulate import simulate
from prb3r.study.plan import plan_study

ELASTICA = {"model": "elastica"}
"""What a diagnosis calculates with."""
STEPS = pd.DataFrame([row for name in PROGRAM for row in steps_of(name)])


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    folder = tmp_path_factory.mktemp("learnt")
    write_record(diagnosed(), folder)
    (folder / "same.toml").write_text(toml_text(manipulator()))
    longer = manipulator()
    longer["segment"] = [segment | {"plates": 4} for segment in longer["segment"]]
    (folder / "longer.toml").write_text(toml_text(longer))
    STEPS.to_csv(folder / "steps.csv", index=False)
    return folder


def run(*arguments):
    return CliRunner().invoke(main, ["predict", *map(str, arguments)])


def test_bands_hold_the_truth_of_the_same_rig_and_are_narrow(folder):
    table = predict(folder, folder / "same.toml", folder / "steps.csv").positions
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


def test_another_number_of_plates_carries_material_and_leaves_the_fault_behind(folder):
    result = run(folder, folder / "longer.toml", "-o", folder / "learnt.toml")
    assert result.exit_code == 0, result.output
    assert (
        "# left behind: weakened plate, which is a fault of one part of this rig"
        in (folder / "learnt.toml").read_text()
    )
    learnt, constants = load_manipulator(folder / "learnt.toml"), diagnosed().constants
    assert learnt.plates == 8
    assert not learnt.effect
    assert learnt.youngs_modulus_pa == pytest.approx(constants["youngs_modulus_pa"].explained)
    assert learnt.friction.coefficient == pytest.approx(constants["friction_coefficient"].explained)
    assert (solve(learnt, STEPS)["outcome"] == "converged").all()


def test_plates_of_known_bending_stiffness_get_the_same_factor(folder):
    plain = manipulator()
    known = {"plates": 3, "length_m": 0.03, "clamp_m": 0.008, "bending_stiffness_n_m2": 0.2}
    plain["segment"] = [known, known]
    learnt = predict(folder, Manipulator.model_validate(plain)).manipulator
    factor = diagnosed().constants["youngs_modulus_pa"].explained / E
    assert [segment.bending_stiffness_n_m2 for segment in learnt.segment] == pytest.approx([0.2 * factor] * 2)


def test_the_same_design_gets_everything_and_runs_as_predicted(folder):
    learnt = predict(folder / "diagnosis.json", folder / "same.toml", STEPS)
    explained = load_manipulator(folder / "explained.toml")
    assert learnt.left_behind == ()
    assert [effect.kind for effect in learnt.manipulator.effect] == ["weakened_plate"]
    alone = solve(explained, STEPS)["x_m"]
    np.testing.assert_allclose(solve(learnt.manipulator, STEPS)["x_m"], alone, atol=1e-9)
    np.testing.assert_allclose(learnt.positions["x_m"], alone, atol=1e-4)  # other models survive, hardly probable
    again = predict(folder, folder / "same.toml", STEPS)
    pd.testing.assert_frame_equal(learnt.positions, again.positions)


def test_positions_are_the_mean_over_the_models_that_survive(folder, tmp_path):
    """Of two models, three to one, the second has both segments softer, which is a lower Young's modulus."""
    record = json.loads((folder / "diagnosis.json").read_text())
    posterior = record["posterior"]
    first = next(model for model in posterior["models"] if model["named"]) | {"probability": 0.75}
    first = first | {"effects": [], "free": [], "covariance": [], "constants": {}}
    second = json.loads(json.dumps(first)) | {"probability": 0.25, "named": False}
    second["effects"] = [{"kind": "segment_stiffness", "segment": k, "factor": 0.8} for k in (1, 2)]
    posterior["models"] = [first, second]
    (tmp_path / "diagnosis.json").write_text(json.dumps(record))
    found = predict(tmp_path, folder / "same.toml", STEPS).positions
    stiff, soft = (solve(Manipulator.model_validate(manipulator(E * part) | ELASTICA), STEPS) for part in (1, 0.8))
    for name in ("x_m", "y_m", "angle_rad"):
        np.testing.assert_allclose(found[name], 0.75 * stiff[name] + 0.25 * soft[name], atol=1e-9)


def test_where_a_model_has_no_equilibrium_the_others_are_averaged():
    mean = averaged([(0.5, np.array([1.0, np.nan, np.nan])), (0.25, np.array([4.0, 4.0, np.nan]))])
    np.testing.assert_allclose(mean, [2.0, 4.0, np.nan])


def test_where_most_draws_have_no_equilibrium_there_is_no_band(folder, tmp_path):
    """Six rigs of ten have plates that give way beyond the slightest bend."""
    record = json.loads((folder / "diagnosis.json").read_text())
    (plain, *_) = record["posterior"]["models"]
    limp = {"kind": "nonlinear_plate", "law": "bilinear", "knee_per_m": 0.01, "ratio": 1e-3}
    gone = plain | {"probability": 0.6, "named": False, "effects": [*plain["effects"], limp]}
    record["posterior"]["models"] = [gone, plain | {"probability": 0.4}]
    (tmp_path / "diagnosis.json").write_text(json.dumps(record))
    found = predict(tmp_path, folder / "same.toml", folder / "steps.csv", draws=100)
    assert any("there are none where more than 50% are lost" in remark for remark in found.remarks)
    assert found.positions["x_m"].notna().all()  # of the model that is in balance
    assert found.positions[found.positions["disk"] > 0]["x_low_m"].isna().all()


def test_what_a_mended_recording_leaves_unexplained_is_said_from_its_file_too(folder, tmp_path):
    """The verdict on it is `set-up`."""
    record = json.loads((folder / "diagnosis.json").read_text()) | {"verdict": "set-up"}
    said = "the diagnosis leaves part of its recording unexplained, and the bands leave that out"
    for partial in (False, True):
        record["effects"] = [effect | {"partial": partial} for effect in record["effects"]]
        (tmp_path / "diagnosis.json").write_text(json.dumps(record))
        remarks = predict(tmp_path, folder / "same.toml", {"sequence": ["a"], "step": [1], "cable_1_n": [5.0]}).remarks
        assert (said in remarks) == partial


def test_what_alone_makes_bands_wide_is_said(folder, tmp_path):
    """A survivor that is hardly probable and moves far."""
    record = json.loads((folder / "diagnosis.json").read_text())
    (plain, *_), case = record["posterior"]["models"], {"kind": "base_compliance", "compliance_rad_per_n_m": 0.03}
    rare = plain | {"probability": 0.1, "named": False, "effects": [*plain["effects"], case]}
    said = []
    for models in ([plain | {"probability": 1.0}], [plain | {"probability": 0.9}, rare]):
        record["posterior"]["models"] = models
        (tmp_path / "diagnosis.json").write_text(json.dumps(record))
        said.append(predict(tmp_path, folder / "same.toml", folder / "steps.csv").remarks)
    assert said[0] == ()
    (remark,) = said[1]
    assert "times as wide as without base_compliance, of which the recording leaves a probability of 0.10" in remark


def test_loads_that_bend_plates_further_than_the_recording_did_are_told(folder, tmp_path):
    """The largest mean strain of a plate is half its thickness by its bend over the length between its clamps."""
    first, further = {"sequence": "a", "step": 1}, {}
    for tension in (10.0, 200.0):
        steps = first | {"cable_1_n": [tension]}
        result = predict(folder, folder / "same.toml", steps, draws=40)
        further[tension] = result.remarks
    bends = np.abs(np.diff(result.positions["angle_rad"]))
    free = [
        (segment.length_m - 2 * segment.clamp_m, segment.thickness_m)
        for segment in result.manipulator.segment
        for _ in range(segment.plates)
    ]
    most = max(thickness / 2 * bend / length for bend, (length, thickness) in zip(bends, free, strict=True))
    assert further[10.0] == ()
    said, *_ = further[200.0]
    assert f"plates are strained by up to {most:.2%} here" in said
    record = json.loads((folder / "diagnosis.json").read_text())

    def told() -> list[str]:
        (tmp_path / "diagnosis.json").write_text(json.dumps(record))
        return [
            text for text in predict(tmp_path, folder / "same.toml", steps).remarks if text.startswith("plates are")
        ]

    del record["posterior"]["bending"]["strain"]  # of plates of which no outermost fibre is known
    assert told()[0].startswith("plates are bent up to ")
    del record["posterior"]["bending"]  # as it was written before
    assert told() == []


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


def test_bands_of_a_roughly_made_rig_are_as_wide_as_its_tolerances(folder, tmp_path):
    """A lone cable's tip angle grows as arm times thickness^-3: one per cent of thickness is three of the angle, of two
    segments as wholes and of six plates."""
    record = json.loads((folder / "diagnosis.json").read_text())
    record["posterior"]["tolerance"] = dict.fromkeys(record["posterior"]["tolerance"], 0.0)
    widths = []
    for rough in (0.0, 0.03):
        record["posterior"]["tolerance"]["thickness_relative"] = rough
        (tmp_path / "diagnosis.json").write_text(json.dumps(record))
        tip = predict(
            tmp_path, folder / "same.toml", {"sequence": ["a"], "step": [1], "cable_1_n": [20.0]}
        ).positions.iloc[-1]
        widths.append((tip["angle_high_rad"] - tip["angle_low_rad"]) / abs(tip["angle_rad"]))
    assert widths[0] < 0.04
    assert np.sqrt(widths[1] ** 2 - widths[0] ** 2) == pytest.approx(
        2 * 1.96 * 3 * 0.03 * np.sqrt(1 / 2 + 1 / 6), rel=0.3
    )


def test_what_a_diagnosis_returned_tells_the_same_as_its_folder(folder):
    of_folder, of_itself = (
        predict(folder, folder / "same.toml", STEPS),
        predict(diagnosed(), folder / "same.toml", STEPS),
    )
    pd.testing.assert_frame_equal(of_itself.positions, of_folder.positions)


def test_the_command_writes_the_table(folder):
    result = run(folder, folder / "same.toml", folder / "steps.csv", "-o", folder / "predicted.csv")
    assert result.exit_code == 0, result.output
    columns = "sequence step disk x_m x_low_m x_high_m y_m y_low_m y_high_m angle_rad angle_low_rad angle_high_rad"
    assert list(pd.read_csv(folder / "predicted.csv")) == columns.split()


def test_what_cannot_be_used_is_refused(folder, tmp_path):
    (tmp_path / "diagnosis.json").write_text("{")
    assert "not valid JSON" in (result := run(tmp_path, folder / "same.toml")).output
    assert result.exit_code == 2
    record = json.loads((folder / "diagnosis.json").read_text())
    del record["posterior"]
    (tmp_path / "diagnosis.json").write_text(json.dumps(record))
    assert "diagnose the recording again" in (result := run(tmp_path, folder / "same.toml")).output
    assert result.exit_code == 2
    assert "no such file" in (result := run(tmp_path / "nowhere", folder / "same.toml")).output
    (tmp_path / "both/short").mkdir(parents=True)
    (tmp_path / "both/short/diagnosis.json").write_text("{}")
    assert "give that of one, short" in (result := run(tmp_path / "both", folder / "same.toml")).output
    assert result.exit_code == 2
    assert run(folder, folder / "same.toml", "-o", tmp_path / "learnt.csv").exit_code == 2
    with pytest.raises(SpecError, match="at least 40"):
        predict(folder, folder / "same.toml", STEPS, draws=10)


STUDY = """# which one?
name = "next"
title = "next"
manipulator = "same.toml"
{}
[[factor]]
name = "mu_factor"
times = "friction.coefficient"
normal = {{ sd = 0.01 }}
[[step]]
cable_1_n = 20
[[metric]]
kind = "position"
"""


def test_a_study_starts_from_what_was_learnt_with_its_uncertainty(folder, tmp_path):
    study = folder / "study.toml"
    study.write_text(STUDY.format('[sampling]\nmethod = "latin-hypercube"\ncount = 128\n'))
    result = run(folder, study, "-o", tmp_path / "learnt.toml")
    assert result.exit_code == 0, result.output
    text = (tmp_path / "learnt.toml").read_text()
    assert text.startswith("# which one?\n")
    plan = plan_study(tmp_path / "learnt.toml")
    assert [factor.name for factor in plan.study.factor] == ["learnt", "mu_factor"]
    assert len(plan.cases) == 128
    constants = diagnosed().constants["youngs_modulus_pa"]
    moduli = np.array([case.settings["manipulator"]["youngs_modulus_pa"] for case in plan.cases])
    assert moduli.mean() == pytest.approx(constants.explained, rel=0.005)
    sd = (constants.high - constants.low) / (2 * 1.96)
    assert moduli.std() == pytest.approx(sd, rel=0.3)
    assert all(case.settings["manipulator"]["effect"][0]["kind"] == "weakened_plate" for case in plan.cases)
    frictions = {case.settings["manipulator"]["friction"]["coefficient"] for case in plan.cases}
    assert len(frictions) == 128 > len(set(moduli))  # errors of the next rig are drawn beside what was learnt
    study.write_text(STUDY.format(""))
    assert run(folder, study, folder / "steps.csv").exit_code == 2
    again = run(folder, tmp_path / "learnt.toml")
    assert "has what was learnt already" in again.output


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


def test_words_that_look_like_toml_stay_words(folder):
    """A bracket, and the name of a key, at the beginning of a line of the question."""
    study = folder / "asking.toml"
    asked = 'question = """\nWhich?\n[1] Howell, Compliant Mechanisms\nmanipulator = the next one?\n"""\n'
    plain = STUDY.format("").replace("times =", "path =").replace("normal = { sd = 0.01 }", "values = [0.1, 0.2]")
    study.write_text(asked + plain)
    result = run(folder, study)
    assert result.exit_code == 0, result.output
    spec = tomllib.loads(result.stdout)
    assert spec["question"] == tomllib.loads(asked)["question"]
    assert spec["factor"][0]["name"] == "learnt"
    (folder / "asking-learnt.toml").write_text(result.stdout)
    assert len(plan_study(folder / "asking-learnt.toml").cases) == 2 * 64


def test_an_arm_that_would_buckle_is_not_predicted(folder):
    """Straight under a thousand newtons along it: an equilibrium at which nothing stays."""
    steps = pd.DataFrame({"sequence": "a", "step": [1, 2], "tip_x_n": [-0.1, -1000.0], "cable_1_n": 0.0})
    found = predict(folder, folder / "same.toml", steps)
    tip = found.positions.query("disk == 6").set_index("step")
    assert np.isfinite(tip.loc[1, "x_m"])
    assert tip.loc[2, ["x_m", "y_m", "y_low_m", "y_high_m"]].isna().all()
    assert any("no equilibrium" in remark for remark in found.remarks)


def test_a_study_without_sampling_gets_it(folder):
    study = folder / "plain.toml"
    study.write_text(
        STUDY.format("").replace("times =", "path =").replace("normal = { sd = 0.01 }", "values = [0.1, 0.2]")
    )
    result = run(folder, study)
    assert result.exit_code == 0, result.output
    assert "left behind" not in result.output
    (folder / "plain-learnt.toml").write_text(result.stdout)
    assert len(plan_study(folder / "plain-learnt.toml").cases) == 2 * 64


def test_a_study_of_another_design_says_what_was_left_behind(folder):
    study = folder / "longer-study.toml"
    study.write_text(STUDY.format('[sampling]\nmethod = "sobol"\ncount = 64\n').replace("same.toml", "longer.toml"))
    assert "# left behind: weakened plate, which is a fault of one part of this rig\n" in run(folder, study).output
