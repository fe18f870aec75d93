"""What a diagnosis leaves on disk: keys of the contract, files that load and run, numbers that agree."""

import json
import pickle
import re
from dataclasses import replace

import numpy as np
import pandas as pd
import pyarrow.parquet as pq
import pytest
from diagnosis.simulated import (
    UNEXPLAINED,
    WEAK,
    Case,
    diagnosed,
    investigated,
    recorded,
    rival_of,
    write_recording,
)

import prb3r
from prb3r import load_manipulator, solve
from prb3r.diagnosis.checks.verdict import why_unexplained
from prb3r.diagnosis.evidence.outliers import NotedWeight
from prb3r.diagnosis.fit.least_squares import fit
from prb3r.diagnosis.fit.prediction import predictor
from prb3r.diagnosis.investigate import run_stages
from prb3r.diagnosis.known import Task
from prb3r.diagnosis.result.design_prediction import read_posterior
from prb3r.diagnosis.result.effects import Separation
from prb3r.diagnosis.result.files import default_folder, manipulator_toml, write_record
from prb3r.diagnosis.result.mismatch import mismatch_of
from prb3r.diagnosis.result.named import separations
from prb3r.diagnosis.result.posterior import posterior_of
from prb3r.diagnosis.result.projection import as_json, proposed, summary_lines
from prb3r.diagnosis.result.tables import residual_table
from prb3r.diagnosis.result.tell import tell
from prb3r.diagnosis.search.experiment import Experiment, best_experiments, programs, separation
from prb3r.diagnosis.search.rivals import Rival
from prb3r.diagnosis.settings import Settings
from prb3r.model.manipulator import Manipulator
from prb3r.present.diagnosis.belief import carry_over

CONTRACT = {
    "": "schema verdict noise calibration effects models alternatives tolerances checks setup remarks mismatch closure "
    "heldout next_experiment posterior settings",
    "noise": "reduced_chi2_nominal reduced_chi2_calibrated reduced_chi2_explained scale scale_low scale_high common "
    "reach tension_scale tension_scale_low tension_scale_high lasting serial span",
    "calibration": "youngs_modulus_pa friction_coefficient frame",
    "calibration.youngs_modulus_pa": "nominal calibrated explained low high",
    "calibration.friction_coefficient": "nominal calibrated explained low high",
    "calibration.frame": "rotation_rad x_m y_m",
    "mismatch": "plates sequences depends_on statement",
    "heldout": "sequences rmse_calibrated_m rmse_explained_m noise_m rmse_calibrated_rad rmse_explained_rad noise_rad",
}
EFFECT = "effect parameters statement probability certain indistinguishable_from rivals delta_bic heldout_gain"


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    folder = tmp_path_factory.mktemp("weak")
    write_record(diagnosed(), folder)
    return folder


def disputed():
    """The diagnosis as if a rival could not be told from what it names."""
    found = investigated()
    other = rival_of(found)
    rival = Rival(other.model.hypotheses[0], other, 3.0, 1.0)
    named = replace(found.named[0], rivals=(rival,))
    experiment = best_experiments(found.explained, [other])[0]
    pair = Separation(named.hypothesis.name, rival.hypothesis.name, experiment)
    return tell(replace(found, verdict="ambiguous", named=(named,), experiments=(pair,)))


def test_the_keys_are_those_of_the_contract(folder):
    record = json.loads((folder / "diagnosis.json").read_text())
    for path, keys in CONTRACT.items():
        part = record
        for key in path.split(".") if path else ():
            part = part[key]
        assert list(part) == keys.split(), path
    assert record["schema"] == 2
    assert record["verdict"] == "explained"
    assert record["closure"] is None
    (effect,) = record["effects"]
    assert list(effect) == EFFECT.split()
    assert effect["effect"] == "weakened_plate"
    assert effect["parameters"]["plate"] == {"value": 4, "set": [4]}
    factor = effect["parameters"]["factor"]
    assert factor["low"] < WEAK["factor"] < factor["high"]
    assert effect["delta_bic"] < -10
    assert 0.9 < effect["heldout_gain"] <= 1
    modulus = record["calibration"]["youngs_modulus_pa"]
    assert modulus["low"] < 1.05 * modulus["nominal"] < modulus["high"]
    assert record["heldout"]["rmse_explained_m"] < record["heldout"]["rmse_calibrated_m"]


@pytest.mark.parametrize("case", [Case(), UNEXPLAINED])
def test_a_diagnosis_can_be_pickled_and_is_small(case, tmp_path):
    """A live fit would take its predictor, whose recording and kernels' inputs are larger, and the closures of it."""
    stored = pickle.dumps(diagnosed(case))
    assert len(stored) < 300_000
    again = pickle.loads(stored)
    assert as_json(again) == as_json(diagnosed(case))
    assert again.tables.keys() == diagnosed(case).tables.keys()
    first, second = (write_record(found, tmp_path / name) for name, found in (("a", again), ("b", diagnosed(case))))
    assert [path.read_bytes() for path in first] == [path.read_bytes() for path in second]


def test_settings_are_in_the_record():
    told = as_json(diagnosed())["settings"]
    assert told == as_json(diagnosed(Case(hidden=())))["settings"]
    assert told["alarm_rate"] == Settings().alarm_rate
    assert (
        Settings(**{key: tuple(value) if isinstance(value, list) else value for key, value in told.items()})
        == Settings()
    )


def test_the_same_seed_gives_the_same_bytes(tmp_path):
    """In one process: another one may have compiled the kernels anew, which can move the tenth digit."""
    recording = prb3r.load_recording(write_recording(tmp_path / "rig"))
    for name, found in (("one", prb3r.diagnose(recording)), ("other", run_stages(Task(recorded())))):
        (tmp_path / name).mkdir()
        write_record(found, tmp_path / name)
    for name in ("diagnosis.json", "explained.toml", "residuals.parquet", "mismatch.parquet"):
        assert (tmp_path / "one" / name).read_bytes() == (tmp_path / "other" / name).read_bytes(), name


def test_both_manipulators_run_in_solve_and_give_the_predictions_of_the_table(folder):
    table, steps = pd.read_parquet(folder / "residuals.parquet"), recorded().steps
    for name, fitted in (("calibrated", diagnosed().calibrated), ("explained", diagnosed().explained)):
        manipulator = load_manipulator(folder / f"{name}.toml")
        assert manipulator.model == "elastica"
        assert (folder / f"{name}.toml").read_text().startswith('# prb3r diagnose, recording "small rig", seed 0')
        found = solve(manipulator, steps).set_index(["sequence", "step", "disk"])
        turn = fitted.constants.rotation
        seen = {
            "x_m": np.cos(turn) * found["x_m"] - np.sin(turn) * found["y_m"] + fitted.constants.x,
            "y_m": np.sin(turn) * found["x_m"] + np.cos(turn) * found["y_m"] + fitted.constants.y,
            "angle_rad": found["angle_rad"] + turn,
        }
        for kind, rows in table.groupby("kind"):
            expected = seen[kind][pd.MultiIndex.from_frame(rows[["sequence", "step", "disk"]])]
            np.testing.assert_allclose(rows[name], expected, atol=1e-7)
        drawn = diagnosed().tables["shapes"]
        drawn = drawn[drawn["model"] == name].set_index(["sequence", "step", "disk"])
        for kind, values in seen.items():
            np.testing.assert_allclose(drawn[kind], values.loc[drawn.index], atol=1e-7)
    (effect,) = load_manipulator(folder / "explained.toml").effect
    assert effect == diagnosed().explained.effects[0]


def test_residuals_are_those_of_the_fits_and_of_the_sequences_set_aside(tmp_path):
    found = investigated()
    write_record(tell(found), tmp_path)
    table = pd.read_parquet(tmp_path / "residuals.parquet")
    assert len(table) == found.recording.readings.count
    assert set(table["sequence"][table["held_out"]]) == set(found.heldout.sequences)
    assert (table["residual_explained"][table["held_out"]] ** 2).sum() == pytest.approx(found.heldout.chi2_explained)
    assert (table["residual_calibrated"][table["held_out"]] ** 2).sum() == pytest.approx(found.heldout.chi2_calibrated)
    fitted = table[~table["held_out"]]
    np.testing.assert_array_equal(fitted["residual_calibrated"], found.calibrated.residual[: len(fitted)])
    assert fitted["residual_explained"].std() < 0.6 * fitted["residual_calibrated"].std()
    np.testing.assert_array_equal(fitted["weighed_down"], found.doubts.inflation > 1)
    assert (table["sd"] > 0).all()


def test_a_held_out_step_that_is_lost_leaves_the_other_residuals():
    found = investigated()
    models = {"calibrated": found.calibrated, "explained": found.explained}
    states = {
        name: predictor(found.recording).equilibria(each.constants, each.effects) for name, each in models.items()
    }
    whole = residual_table(found, models, states)
    (step,) = np.flatnonzero(found.recording.steps["sequence"] == found.heldout.sequences[0])[:1]
    for each in states.values():
        each.x[step], each.y[step], each.angle[step] = np.nan, np.nan, np.nan
    lost = residual_table(found, models, states)
    gone = lost["residual_explained"].isna()
    key = found.recording.steps.iloc[step]
    assert (lost[gone]["sequence"] == key["sequence"]).all()
    assert (lost[gone]["step"] == key["step"]).all()
    assert gone.sum() == (whole["sequence"].eq(key["sequence"]) & whole["step"].eq(key["step"])).sum()


def test_the_model_that_is_named_is_marked_though_it_was_fitted_again():
    choice = investigated().choice
    again = fit(choice.fitted.model, choice.fitted.p)
    choice = replace(choice, fitted=again)
    marked = [model.named for model in posterior_of(choice).models]
    assert marked == [survivor.effects == choice.effects for survivor in choice.survivors]
    assert sum(marked) == 1
    assert choice.refuted_by(lambda fitted: fitted is not again) == tuple(
        survivor for survivor in choice.survivors if survivor.effects != choice.effects
    )


def test_tables_say_their_units(folder):
    fields = {name: pq.read_schema(folder / f"{name}.parquet") for name in ("residuals", "mismatch", "detectable")}
    assert fields["mismatch"].names == ["sequence", "step", "plate", "moment_n_m", "sd_n_m", "known"]
    assert fields["mismatch"].field("moment_n_m").metadata[b"unit"] == b"N m"
    assert fields["residuals"].field("residual_explained").metadata[b"unit"] == b"1"
    assert all(field.metadata[b"description"] for schema in fields.values() for field in schema)
    assert len(diagnosed().tables["mismatch"]) == 6 * len(investigated().training.steps)
    assert not list(folder.glob("*.tmp"))


def test_gross_outliers_and_disbelieved_weights_are_flagged():
    found = investigated()
    inflation = np.where(np.arange(len(found.doubts.inflation)) == 7, 9.0, 1.0)
    doubts = replace(found.doubts, inflation=inflation, weights=(NotedWeight(step=5, cable=0),))
    table = tell(replace(found, doubts=doubts)).tables["residuals"]
    fitted = table[~table["held_out"]].reset_index(drop=True)
    assert np.flatnonzero(fitted["weighed_down"]).tolist() == [7]
    row = found.training.steps.iloc[5]
    assert set(zip(*fitted.loc[fitted["weight_doubted"], ["sequence", "step"]].to_numpy().T, strict=True)) == {
        (row["sequence"], row["step"])
    }


def test_a_dispute_names_the_rival_and_proposes_steps_that_run(tmp_path):
    found = disputed()
    (tmp_path / "next_experiment_2.csv").write_text("of an earlier diagnosis\n")
    write_record(found, tmp_path)
    record = json.loads((tmp_path / "diagnosis.json").read_text())
    assert record["effects"][0]["indistinguishable_from"] == [found.experiments[0].second]
    (rival,) = record["effects"][0]["rivals"]
    assert rival["name"] == found.experiments[0].second
    factor = 3 / (2 + 1 / WEAK["factor"])  # of three plates with the compliance of these two and the weak one
    assert rival["parameters"] == {"factor": pytest.approx(factor, abs=0.06)}
    (proposed,) = record["next_experiment"]
    assert list(proposed) == ["statement", "separates", "separation", "steps"]
    assert proposed["separates"] == [list(found.experiments[0][:2])]
    assert not (tmp_path / "next_experiment_2.csv").exists()
    steps = pd.read_csv(tmp_path / "next_experiment.csv")
    assert len(steps) == len(proposed["steps"])
    states = solve(load_manipulator(tmp_path / "explained.toml"), tmp_path / "next_experiment.csv")
    assert (states["outcome"] == "converged").all()
    assert "cannot be told apart" in "\n".join(summary_lines(found))


def test_a_set_of_effects_that_stands_in_the_place_of_what_is_named_is_said_and_has_a_program():
    found, other = investigated(), rival_of(investigated())
    survivor = replace(found.choice.survivors[0], fitted=other, probability=0.4)
    choice = replace(found.choice, survivors=(*found.choice.survivors, survivor))
    (apart,) = separations(choice, found.named)
    assert (apart.first, apart.second) == ("weakened_plate (plate 4)", "segment_stiffness (segment 2)")
    best = best_experiments(found.explained, [other])[0]
    assert (apart.experiment.title, apart.experiment.separation) == (best.title, best.separation)
    rival = Rival(other.model.hypotheses[0], other, 3.0, 1.0)
    (once,) = separations(choice, [replace(found.named[0], rivals=(rival,))])  # as a rival, and not as a set again
    assert (once.first, once.second) == (apart.first, apart.second)
    none = replace(survivor, fitted=choice.calibrated)
    (alone,) = separations(replace(choice, survivors=(*found.choice.survivors, none)), found.named)
    assert alone.second == "constants alone"
    lines = summary_lines(tell(replace(found, verdict="ambiguous", choice=choice, experiments=(apart,))))
    assert "- or instead of what is named: segment_stiffness" in lines


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


def test_proposed_readings_are_as_noisy_as_those_that_were_recorded():
    """Twice the noise leaves at least a quarter of the squared distance, and less than all of it."""
    fitted = investigated().explained
    other = rival_of(investigated())
    (_, steps), *_ = programs(fitted.model.predict.recording, Settings())
    noise = fitted.model.noise
    loud = replace(noise, level=noise.level._replace(scale=2 * noise.level.scale, tension=2 * noise.level.tension))
    apart = separation(fitted, other, steps)
    louder = separation(replace(fitted, model=replace(fitted.model, noise=loud)), other, steps)
    assert apart / 4 <= louder < 0.98 * apart


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


def test_a_program_that_separates_two_pairs_is_proposed_once(tmp_path):
    found = disputed()
    a, b, experiment = found.experiments[0]
    other = Experiment("read the shape without any load", experiment.steps[:1], 30.0, experiment.asked)
    weaker = replace(experiment, separation=experiment.separation / 2)
    pairs = Separation(a, b, experiment), Separation(a, "gravity", weaker), Separation(a, "precurvature", other)
    found = replace(found, experiments=pairs)
    first, second = proposed(found.experiments)
    assert first.separates == ((a, b), (a, "gravity"))
    assert first.separation == weaker.separation
    assert "enough to rank them rightly" in second.statement
    asked = experiment.asked
    few = proposed([Separation(a, b, replace(experiment, separation=asked / 3))])[0].statement
    assert few.startswith("No load program that was tried tells")
    write_record(found, tmp_path)
    assert {path.name for path in tmp_path.glob("*.csv")} == {"next_experiment_1.csv", "next_experiment_2.csv"}


def test_unexplained_lists_partial_effects_without_intervals_and_a_law(tmp_path):
    record = as_json(diagnosed(UNEXPLAINED))
    assert record["verdict"] == "unexplained"
    assert record["effects"]
    for effect in record["effects"]:
        assert effect["partial"] is True
        assert all(each["low"] is None for each in effect["parameters"].values() if "low" in each)
    assert record["calibration"]["youngs_modulus_pa"]["low"] is None
    assert record["mismatch"]["plates"]
    closure = record["closure"]
    assert list(closure) == ["statement", "effect", "reduced_chi2", "heldout_gain"]
    assert closure["effect"]["kind"] == "empirical_moment"
    write_record(diagnosed(UNEXPLAINED), tmp_path)
    assert load_manipulator(tmp_path / "closure.toml").effect[-1] == diagnosed(UNEXPLAINED).closure.effect
    json.dumps(record, allow_nan=False)


def test_every_effect_survives_the_file_format(tmp_path):
    plain = diagnosed().manipulators["calibrated"].model_dump(exclude_none=True)
    plain["effect"] = [
        {"kind": "pulley_friction", "efficiency": 0.9, "cables": ["1", "4"]},
        {"kind": "precurvature", "curvature_per_m": -1 / 3, "plates": [2, 3]},
        {"kind": "edge_wrap"},
    ]
    plain["cable"][0]["offset_m"] = [0.02, 0.01]
    manipulator = Manipulator.model_validate(plain)
    path = tmp_path / "m.toml"
    path.write_text(manipulator_toml(manipulator, "a comment"))
    assert load_manipulator(path) == manipulator


def test_the_folder_is_named_after_the_recording():
    assert default_folder("small rig").as_posix() == "results/diagnoses/small-rig"
    assert default_folder("../é/x y").as_posix() == "results/diagnoses/é-x-y"


def test_smooth_moments_that_chance_does_not_leave_are_unexplained_and_said():
    found = investigated()
    rate = found.choice.fitted.model.settings.naming_rate
    assert found.verdict == "explained"
    assert found.choice.smooth_moments > rate
    smooth = replace(found, choice=replace(found.choice, smooth_moments=rate / 2))
    assert why_unexplained(found.choice, (), (), ()) == ""
    assert why_unexplained(smooth.choice, (), (), ()).startswith("a real mismatch remains")
    assert mismatch_of(smooth).statement.startswith("What is left after the best explanation changes smoothly")
