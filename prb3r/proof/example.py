"""Simulates the shipped example of a recording anew: `python -m prb3r.proof.example FOLDER`.

It is a two-segment prototype on its bench.  The true rig has other constants than the nominal manipulator, and lossy
pulleys that the file does not mention; camera frame, tensions and readings scatter.
"""

import sys
from pathlib import Path
from typing import Any

import numpy as np

from prb3r.proof.rig.simulate import observe, simulate
from prb3r.recording.recording import Measurement, Prior, RecordingFile
from prb3r.recording.writing import write_recording

EXAMPLE_SEED = 20261123
"""Seed of the example's noise; any other would do."""
PLATE = {"plates": 7, "length_m": 0.030, "clamp_m": 0.008, "width_m": 0.030, "thickness_m": 0.0008}
"""Either segment of the prototype (Table 3 of IEEE Access 2018)."""
ARMS = {"1": (0.0255, 2), "2": (0.021, 1), "3": (-0.021, 1), "4": (-0.0255, 2)}
"""Offset of the holes (m) and last segment of each cable, by its name."""
NOMINAL: dict[str, Any] = {
    "name": "two-segment prototype on its bench",
    "youngs_modulus_pa": 1.87e11,
    "gravity_m_s2": 9.785,
    "disk": {"thickness_m": 0.004, "mass_kg": 0.0447},
    "friction": {"coefficient": 0.3, "direction": "declared"},
    "segment": [PLATE, PLATE],
    "cable": [{"name": name, "offset_m": y, "ends_at_segment": end} for name, (y, end) in ARMS.items()],
}
"""Contents of the manipulator file."""
CONCEALED = NOMINAL | {
    "youngs_modulus_pa": 0.95 * NOMINAL["youngs_modulus_pa"],
    "friction": {"coefficient": 1.1 * NOMINAL["friction"]["coefficient"], "direction": "declared"},
    "effect": [{"kind": "pulley_friction", "efficiency": 0.90}],
}
"""The true rig: constants within their priors, and pulleys that take a tenth of every tension.  A choice."""
CAMERA_FRAME = (0.003, 0.0012, -0.0008)
"""Rotation (rad) and shift (x, y in m) of the camera's frame: about half of a standard deviation of `MEASUREMENT`.  A
choice."""
MEASUREMENT = Measurement(
    position_sd_m=3e-4,
    angle_sd_rad=0.005,
    tension_sd_relative=0.003,
    frame_rotation_sd_rad=0.005,
    frame_position_sd_m=0.002,
)
"""Standard deviations that the recording states; its noise has them."""
HIDDEN_ROWS, HIDDEN_CELLS = 0.015, 0.015
"""Shares of markers that the camera did not see, and of single readings that are missing."""

LOAD_COLUMNS, SLIP_COLUMNS = [f"cable_{name}_n" for name in ARMS], [f"slip_{name}" for name in ARMS]


def programme() -> list[dict[str, Any]]:
    """The rows of the table of steps: each cable alone loaded and unloaded, then two pairs against each other."""
    rows: list[dict[str, Any]] = []
    for name, most in (("1", 48.0), ("2", 60.0), ("3", 60.0), ("4", 48.0)):
        for share, slip in ((0.25, -1), (0.5, -1), (0.75, -1), (1.0, -1), (0.75, 1), (0.5, 1), (0.25, 1)):
            rows.append({"sequence": f"cable-{name}", f"cable_{name}_n": share * most, f"slip_{name}": slip})
    for held, pulled in (("3", "1"), ("2", "4")):  # the cable held is paid out by the one pulled, drawn in after it
        for a, b in ((30, 0), (60, 0), (60, 8), (60, 16), (60, 24), (60, 16), (60, 8)):
            falls = b < (rows[-1].get(f"cable_{pulled}_n", 0.0) if b else 0.0)
            slips = {f"slip_{held}": 1 if b and not falls else -1, f"slip_{pulled}": 1 if falls else -1}
            loads = {f"cable_{held}_n": float(a), f"cable_{pulled}_n": float(b)}
            rows.append({"sequence": f"cable-{held}-then-{pulled}"} | loads | slips)
    idle: dict[str, Any] = dict.fromkeys(LOAD_COLUMNS, 0.0) | dict.fromkeys(SLIP_COLUMNS, -1)
    return [{"sequence": row["sequence"], "step": k % 7 + 1} | idle | row for k, row in enumerate(rows)]


def measured(rows: list[dict[str, Any]], rng: np.random.Generator) -> list[dict[str, Any]]:
    """The rows of the table of markers: noisy readings of the true rig under the steps `rows`, gaps included."""
    markers = []
    for name in dict.fromkeys(row["sequence"] for row in rows):
        steps = [row for row in rows if row["sequence"] == name]
        scatter = 1 + MEASUREMENT.tension_sd_relative * rng.normal(size=(len(steps), len(LOAD_COLUMNS)))
        applied = [
            row | {load: row[load] * factor for load, factor in zip(LOAD_COLUMNS, factors, strict=True)}
            for row, factors in zip(steps, scatter, strict=True)
        ]
        seen = np.stack(observe(CONCEALED, simulate(CONCEALED, applied), frame=CAMERA_FRAME), 2)[:, 1:]
        sd = np.array([MEASUREMENT.position_sd_m, MEASUREMENT.position_sd_m, MEASUREMENT.angle_sd_rad])
        seen = seen + sd * rng.normal(size=seen.shape)
        seen[rng.random(seen.shape) < HIDDEN_CELLS] = np.nan
        for k, disk in zip(*np.nonzero(rng.random(seen.shape[:2]) >= HIDDEN_ROWS), strict=True):
            x, y, angle = seen[k, disk]
            key = {"sequence": name, "step": steps[k]["step"], "disk": int(disk) + 1}
            markers.append(key | {"x_m": x.round(5), "y_m": y.round(5), "angle_rad": angle.round(4)})
    return markers


def write_example(folder: str | Path) -> None:
    """Simulate the example from its fixed seed and write recording, manipulator, steps and markers into a folder.

    Raises SpecError for a folder that cannot be written.
    """
    described = RecordingFile(
        name="bench example",
        manipulator="manipulator.toml",
        measurement=MEASUREMENT,
        prior=Prior(youngs_modulus=0.05, friction_coefficient=0.3),
    )
    rows = programme()
    markers = measured(rows, np.random.default_rng(EXAMPLE_SEED))
    write_recording(folder, described, NOMINAL, _columns(rows), _columns(markers))


def _columns(rows: list[dict[str, Any]]) -> dict[str, list[Any]]:
    return {name: [row[name] for row in rows] for name in rows[0]}


if __name__ == "__main__":
    write_example(sys.argv[1] if len(sys.argv) > 1 else "studies/recordings/bench-example")
