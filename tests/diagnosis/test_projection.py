"""What a diagnosis leaves on disk: keys of the contract, files that load and run, numbers that agree."""

import json
import pickle

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
    write_recording,
)

import prb3r
from prb3r import load_manipulator, solve
from prb3r.diagnosis.investigate import run_stages
from prb3r.diagnosis.known import Task
from prb3r.diagnosis.result.files import default_folder, manipulator_toml, write_record
from prb3r.diagnosis.result.projection import as_json
from prb3r.diagnosis.settings import Settings
from prb3r.model.manipulator import Manipulator

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


@pytest.mark.parametrize("case", [Case(), pytest.param(UNEXPLAINED, marks=pytest.mark.long)])
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


@pytest.mark.long
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


def test_tables_say_their_units(folder):
    fields = {name: pq.read_schema(folder / f"{name}.parquet") for name in ("residuals", "mismatch", "detectable")}
    assert fields["mismatch"].names == ["sequence", "step", "plate", "moment_n_m", "sd_n_m", "known"]
    assert fields["mismatch"].field("moment_n_m").metadata[b"unit"] == b"N m"
    assert fields["residuals"].field("residual_explained").metadata[b"unit"] == b"1"
    assert all(field.metadata[b"description"] for schema in fields.values() for field in schema)
    assert len(diagnosed().tables["mismatch"]) == 6 * len(investigated().training.steps)
    assert not list(folder.glob("*.tmp"))


@pytest.mark.long
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
