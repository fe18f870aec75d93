"""Recordings of sister rigs made by the independent rig: other geometry, plates of one stock, one pair of surfaces."""

from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
import pandas as pd
from diagnosis.simulated import EXACT, MEASUREMENT

from prb3r.model.files.toml import toml_text
from prb3r.proof.rig.simulate import observe, simulate
from prb3r.recording.reading import load_recording
from prb3r.recording.recording import Recording

E = 1.87e11
"""Nominal."""
LAW = {"kind": "nonlinear_plate", "law": "bilinear", "knee_strain": 0.0026, "ratio": 0.5}
GEOMETRIES = {
    "short": {"plates": 5, "length_m": 0.03, "clamp_m": 0.008, "width_m": 0.03, "thickness_m": 0.0008},
    "thick": {"plates": 4, "length_m": 0.04, "clamp_m": 0.008, "width_m": 0.03, "thickness_m": 0.0010},
}
PULLS = {"short": 100.0, "thick": 160.0}
"""Largest tension, N."""
SHARES = {"up": (0.3, 0.6, 0.8, 1.0), "down": (0.9, 0.7, 0.45, 0.2), "counter": (0.5, 0.85, 0.95, 0.4)}


def sister(name: str, modulus: float = E, friction: float = 0.3, effects=()) -> dict:
    """The file of a rig with two cables, as a table."""
    cables = [{"name": n, "offset_m": at, "ends_at_segment": 1} for n, at in (("a", 0.025), ("b", -0.025))]
    plain = {"name": name, "youngs_modulus_pa": modulus, "disk": {"thickness_m": 0.004, "mass_kg": 0.05}}
    plain |= {"friction": {"coefficient": friction}, "segment": [GEOMETRIES[name]], "cable": cables}
    return plain | ({"effect": list(effects)} if effects else {})


def write_sister(
    folder: Path, name: str, modulus: float = 1.05 * E, friction: float = 0.27, law=LAW, sharing=None, own=()
) -> Path:
    """Record a rig whose plates have the `law` into `folder`, and of which nominal values are a little off."""
    rng = np.random.default_rng(len(name) + int(1e3 * friction))
    true = sister(name, modulus, friction, [*([law] if law else []), *own])
    steps, markers = [], []
    for sequence, shares in SHARES.items():
        pulled = "b" if sequence == "counter" else "a"
        slip = np.where(np.diff(shares, prepend=0.0) > 0, -1, 1)
        rows = [
            {"sequence": sequence, "step": k + 1, "cable_a_n": 0.0, "cable_b_n": 0.0, "slip_a": -1, "slip_b": -1}
            | {f"cable_{pulled}_n": share * PULLS[name], f"slip_{pulled}": int(way)}
            for k, (share, way) in enumerate(zip(shares, slip, strict=True))
        ]
        steps += rows
        scattered = [
            {
                key: value * (1 + 0.003 * rng.standard_normal()) if key.startswith("cable") else value
                for key, value in row.items()
            }
            for row in rows
        ]
        x, y, angle = observe(true, simulate(true, scattered), image_centre=(0.0, 0.0), frame=(0.0, 0.0, 0.0))
        for k, row in enumerate(rows):
            for disk in range(1, x.shape[1]):
                seen = {"x_m": x[k, disk], "y_m": y[k, disk], "angle_rad": angle[k, disk]}
                sd = {"x_m": 3e-4, "y_m": 3e-4, "angle_rad": 0.005}
                noisy = {column: value + sd[column] * rng.standard_normal() for column, value in seen.items()}
                markers.append({"sequence": sequence, "step": row["step"], "disk": disk, **noisy})
    folder.mkdir(parents=True, exist_ok=True)
    described = {"name": name, "manipulator": "manipulator.toml", "measurement": MEASUREMENT, "tolerance": EXACT}
    described |= {"prior": {"youngs_modulus": 0.2, "friction_coefficient": 0.3}}
    described |= {"sharing": sharing} if sharing else {}
    (folder / "recording.toml").write_text(toml_text(described))
    (folder / "manipulator.toml").write_text(toml_text(sister(name)))
    pd.DataFrame(steps).to_csv(folder / "steps.csv", index=False)
    pd.DataFrame(markers).to_csv(folder / "markers.csv", index=False)
    return folder


@cache
def recorded_sister(name: str, modulus: float = 1.05 * E, friction: float = 0.27) -> Recording:
    """The recording of one rig."""
    with TemporaryDirectory() as folder:
        return load_recording(write_sister(Path(folder), name, modulus, friction))
