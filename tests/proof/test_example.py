"""The shipped example is what its script writes, and the engine explains it once it knows what was hidden."""

from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from prb3r.mechanics.equilibrium import solve_chain
from prb3r.model.manipulator import Manipulator
from prb3r.proof.example import CAMERA_FRAME, CONCEALED, EXAMPLE_SEED, measured, programme
from prb3r.recording.reading import load_recording

FOLDER = Path(__file__).parents[2] / "studies/recordings/bench-example"


def test_the_first_sequence_is_simulated_again():
    """Another machine may round the last written digit otherwise."""
    rows = programme()
    shipped = load_recording(FOLDER)
    pd.testing.assert_frame_equal(shipped.steps, pd.DataFrame(rows), check_dtype=False)
    again = pd.DataFrame(measured(rows[:7], np.random.default_rng(EXAMPLE_SEED)))
    markers = pd.read_csv(FOLDER / "markers.csv").iloc[: len(again)]
    assert (again.iloc[:, :3] == markers.iloc[:, :3]).all(axis=None)
    assert (again.isna() == markers.isna()).all(axis=None)
    assert (again.iloc[:, 3:] - markers.iloc[:, 3:]).abs().max().to_numpy() == pytest.approx(0, abs=1.01e-4)


def test_it_is_explained_by_what_was_hidden_and_by_nothing_less():
    recording = load_recording(FOLDER)
    readings, measurement = recording.readings, recording.measurement
    sd = np.array([measurement.position_sd_m] * 2 + [measurement.angle_sd_rad])[readings.kind]

    def chi2(description, frame):
        chain = Manipulator.model_validate(description | {"model": "elastica"}).chain()
        parts = [recording.only([k]).loads for k in range(len(recording.sequences))]
        states = [solve_chain(chain, loads) for loads in parts]
        x, y, angle = (np.concatenate([getattr(each, name) for each in states]) for name in ("x", "y", "angle"))
        turn, shift = np.exp(1j * frame[0]), complex(*frame[1:])
        moved = turn * (x + 1j * y) + shift
        expected = np.stack([moved.real, moved.imag, angle + frame[0]], 2)[readings.step, readings.disk, readings.kind]
        return np.mean(((expected - readings.value) / sd) ** 2)

    assert chi2(CONCEALED, CAMERA_FRAME) < 1.6  # 1 and the scatter of the weights
    assert chi2(CONCEALED | {"effect": []}, CAMERA_FRAME) > 100
    assert len(recording.readings.value) == pytest.approx(0.97 * 42 * 14 * 3, rel=0.005)
