"""A recording whose files can be made dirty."""

from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from prb3r.errors import RecordingError
from prb3r.recording.reading import load_recording
from prb3r.recording.recording import Kind, RecordingFile
from prb3r.recording.writing import write_recording

ROOT = Path(__file__).parents[2]
MANIPULATOR = (ROOT / "studies/manipulators/two-segment.toml").read_text()
READ = ["x_m", "y_m", "angle_rad"]
MEASUREMENT = {"position_sd_m": 3e-4, "angle_sd_rad": 0.005, "tension_sd_relative": 0.003}


class Bench:
    """A folder whose files can be made dirty; clean, it holds 2 sequences of 3 steps and 6 x 14 x 3 readings."""

    def __init__(self, folder):
        self.folder, self.manipulator = folder / "bench", MANIPULATOR
        self.described = {"name": "bench", "manipulator": "manipulator.toml", "measurement": dict(MEASUREMENT)}
        rng, disk = np.random.default_rng(1), np.arange(1, 15)
        self.steps = pd.DataFrame(
            {"sequence": np.repeat(["a", "b"], 3), "step": [1, 2, 3] * 2, "cable_1_n": [10.0, 20, 30, 5, 15, 25]}
        )
        self.markers = pd.DataFrame(
            {
                "sequence": np.repeat(self.steps["sequence"].to_numpy(), 14),
                "step": np.repeat(self.steps["step"].to_numpy(), 14),
                "disk": np.tile(disk, 6),
                "x_m": np.tile(0.034 * disk - 0.002, 6) + 1e-3 * rng.normal(size=84),
                "y_m": 1e-2 * rng.normal(size=84),
                "angle_rad": 0.1 * rng.normal(size=84),
            }
        )

    def write(self, suffix=".csv"):
        described = RecordingFile.model_validate(self.described)
        write_recording(self.folder, described, self.manipulator, self.steps, self.markers, suffix)
        return self.folder

    def load(self, suffix=".csv"):
        return load_recording(self.write(suffix))

    def refusal(self, written=True):
        with pytest.raises(RecordingError) as caught:
            load_recording(self.write() if written else self.folder)
        return [str(problem).replace(f"{self.folder}", "bench") for problem in caught.value.problems]

    def edit(self, file, old, new):
        path = self.folder / file
        assert old in path.read_text()
        path.write_text(path.read_text().replace(old, new, 1))

    @property
    def cells(self):
        return int(self.markers[[kind.column for kind in Kind if kind.column in self.markers]].count().sum())
