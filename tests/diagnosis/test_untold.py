"""Recordings that tell a constant nothing: rigs that hang weights alone, begin at rest, or are not loaded at all."""

import numpy as np
import pandas as pd
import pytest
from diagnosis.simulated import EXACT, WEAK, manipulator

import prb3r
from prb3r.diagnosis.investigate import run_stages
from prb3r.diagnosis.known import Task
from prb3r.diagnosis.search.experiment import programs
from prb3r.diagnosis.settings import Settings
from prb3r.recording.reading import load_recording
from prb3r.recording.recording import RecordingFile
from prb3r.recording.writing import write_recording

NOISE = 1e-4
WEIGHTS = {"a": [-3.0, -6.0, -9.0], "b": [3.0, 6.0, 9.0], "c": [-4.0, -8.0, -12.0], "d": [2.5, 5.0, 7.5]}


def recording(folder, column, sequences, hidden=(WEAK,)):
    """Positions of all disks of a rig with `hidden` effects, whose load in `column` takes the values of `sequences`."""
    rows = [(name, k, load) for name, loads in sequences.items() for k, load in enumerate(loads, 1)]
    steps = dict(zip(("sequence", "step", column), map(list, zip(*rows, strict=True)), strict=True))
    steps.setdefault("cable_1_n", [0.0] * len(rows))
    nominal = manipulator() | {"model": "elastica"}
    rig = prb3r.Manipulator.model_validate(nominal | {"effect": list(hidden)})
    markers = prb3r.solve(rig, steps).query("disk > 0")[["sequence", "step", "disk", "x_m", "y_m"]]
    markers[["x_m", "y_m"]] += NOISE * np.random.default_rng(0).standard_normal((len(markers), 2))
    measurement = {"position_sd_m": NOISE, "tension_sd_relative": 0.003}
    described = {"name": "hung", "manipulator": "manipulator.toml", "measurement": measurement, "tolerance": EXACT}
    write_recording(folder, RecordingFile.model_validate(described), nominal, steps, markers)
    return load_recording(folder)


SEEN = "[measurement]\nangle_sd_rad = 0.003\nframe_rotation_sd_rad = 0.005\nframe_position_sd_m = 0.002\n"
"""Beside positions angles, by a camera whose frame is fitted: what of it depends on what was read."""


def found_in(recorded):
    return run_stages(Task(recorded))


@pytest.mark.long
def test_weights_alone_tell_a_weak_plate_and_leave_friction_as_handbooks_know_it(tmp_path):
    found = found_in(recording(tmp_path, "tip_y_n", WEIGHTS, [WEAK | {"factor": 0.3}]))
    assert [(effect.kind, effect.place) for effect in found.effects] == [("weakened_plate", {"plate": 4})]
    friction = found.constants["friction_coefficient"]
    assert friction.explained == pytest.approx(0.3)
    reach = np.exp(1.96 * Settings().friction_sd)
    assert (friction.low, friction.high) == pytest.approx((0.3 / reach, 0.3 * reach), rel=0.01)


def test_sequences_that_go_from_rest_to_large_loads_are_searched(tmp_path):
    """Of the small loads none is left but rest, which tells neither stiffness nor friction."""
    pulls = {name: [0.0, 45.0, 90.0] for name in "abcd"}
    found = found_in(recording(tmp_path, "cable_1_n", pulls, [WEAK | {"factor": 0.3}]))
    assert found.verdict == "explained"
    assert [effect.kind for effect in found.effects] == ["weakened_plate"]


@pytest.mark.long
@pytest.mark.parametrize("seed", range(4))
def test_a_sequence_that_was_read_otherwise_is_held_against_what_was_found(tmp_path, seed):
    """Of one of four only angles were read, and two more were not read at all."""
    pulls = {name: [20.0, 45.0, 70.0, 90.0] for name in "abcdef"}
    recording(tmp_path, "cable_1_n", pulls)
    markers = pd.read_csv(tmp_path / "markers.csv").query("sequence not in ['e', 'f']")
    rig = prb3r.load_manipulator(tmp_path / "manipulator.toml").replace("effect", [prb3r.effects.WeakenedPlate(**WEAK)])
    angles = prb3r.solve(rig, pd.read_csv(tmp_path / "steps.csv")).set_index(["sequence", "step", "disk"])["angle_rad"]
    markers["angle_rad"] = angles.loc[pd.MultiIndex.from_frame(markers[["sequence", "step", "disk"]])].to_numpy()
    markers.loc[markers["sequence"] == "d", ["x_m", "y_m"]] = np.nan
    markers.to_csv(tmp_path / "markers.csv", index=False)
    text = (tmp_path / "recording.toml").read_text()
    (tmp_path / "recording.toml").write_text(text.replace("[measurement]\n", SEEN))
    found = run_stages(Task(load_recording(tmp_path), seed=seed))
    assert [effect.kind for effect in found.effects] == ["weakened_plate"]
    assert not {"e", "f"} & set(found.heldout.sequences)


def test_a_rig_without_pulls_is_asked_for_none(tmp_path):
    recorded = recording(tmp_path, "tip_y_n", WEIGHTS)
    titles = [title for title, _ in programs(recorded, Settings())]
    assert titles == ["read the shape without any load"]


def test_without_any_slip_friction_is_known_to_its_bounds(tmp_path):
    pulls = {name: [30.0, 60.0, 90.0] for name in "abcd"}
    recorded = recording(tmp_path, "cable_1_n", pulls, [])
    steps = pd.read_csv(tmp_path / "steps.csv").assign(slip_1=0)
    steps.to_csv(tmp_path / "steps.csv", index=False)
    rig = prb3r.load_manipulator(tmp_path / "manipulator.toml")
    markers = prb3r.solve(rig, steps).query("disk > 0")[["sequence", "step", "disk", "x_m", "y_m"]]
    markers.round(4).to_csv(tmp_path / "markers.csv", index=False)
    assert recorded.name == "hung"
    friction = found_in(load_recording(tmp_path)).constants["friction_coefficient"]
    assert friction.high / friction.low > 100


def test_without_any_load_nothing_is_found_and_nothing_ends(tmp_path):
    found = found_in(recording(tmp_path, "cable_1_n", {"a": [0.0, 0.0], "b": [0.0, 0.0], "c": [0.0]}))
    assert (found.verdict, found.effects) == ("adequate", ())
    modulus = found.constants["youngs_modulus_pa"]
    assert np.log(modulus.high / modulus.low) == pytest.approx(2 * 1.96 * Settings().modulus_sd, rel=0.01)
