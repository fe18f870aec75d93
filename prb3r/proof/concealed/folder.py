"""Writes the folder of a real rig's recording, which is all that the diagnosis gets."""

from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
import pandas as pd

from prb3r.proof.concealed.blundering import Tables
from prb3r.proof.concealed.blunders import blundered, sequence_names
from prb3r.proof.concealed.build import Build, applied_tensions, reading_noise, rig_as_built
from prb3r.proof.concealed.camera import exact_readings, truth
from prb3r.proof.concealed.design import Design, followed
from prb3r.proof.concealed.labels import Label
from prb3r.proof.concealed.real import build_of
from prb3r.proof.rig.simulate import RigStates
from prb3r.proof.settings import SETTINGS
from prb3r.recording.reading import load_recording
from prb3r.recording.recording import Measurement, Prior, Recording, RecordingFile
from prb3r.recording.writing import write_recording


def recording_from_folder(design: Design, label: Label) -> Recording:
    """The recording of a real rig as it is read from its folder.

    Raises
    ------
    ValueError
        Where the rig has no equilibrium.
    SpecError
        Where the folder is refused, as for some blunders.
    """
    with TemporaryDirectory() as folder:
        write_real_recording(design, label, Path(folder))
        return load_recording(folder)


def write_real_recording(design: Design, label: Label, folder: Path) -> None:
    """Write the folder of a real rig's recording, blunders included; ValueError where the rig has no equilibrium."""
    tables = recorded_tables(design, label)
    if label.blunder:
        tables = blundered(tables, label.blunder)
    described = RecordingFile(
        name=f"case {label.case}",
        manipulator="manipulator.toml",
        image_centre_m=design.image_centre,
        measurement=Measurement(**design.measurement),
        prior=Prior(**design.prior),
    )
    manipulator = {key: value for key, value in tables.manipulator.items() if key != "effect"}
    write_recording(folder, described, manipulator, tables.steps, tables.markers)


def recorded_tables(design: Design, label: Label) -> Tables:
    """The tables of a real rig's recording before any blunder; ValueError where the rig has no equilibrium."""
    rng, build, names = np.random.default_rng(label.noise_seed), build_of(label), sequence_names(design)
    manipulator = rig_as_built(truth(design, label.effects, *label.constants), build)
    states = followed(manipulator, [applied_tensions(rng, design, build, steps) for steps in design.program])
    if states is None:
        raise ValueError("the rig has no equilibrium at some step")
    marked = [_at_markers(part, np.array(build.marker_m)) for part in states]
    exact = exact_readings(design, manipulator, marked, [label.frame] * len(marked))
    sd = np.array([design.deviation(kind) for kind in design.kinds])
    value = exact + sd * reading_noise(rng, build, exact.shape)
    value = _with_slips(rng, design, build, value)
    noted = [
        {"sequence": name, "step": k + 1, **step}
        for name, steps in zip(names, design.program, strict=True)
        for k, step in enumerate(steps)
    ]
    table = pd.DataFrame(noted)
    rows = []
    for at, step in enumerate(noted):
        for disk, read in enumerate(value[at].round(SETTINGS.real.decimals).tolist(), 1):
            cells = {kind.column: number for kind, number in zip(design.kinds, read, strict=True)}
            rows.append({"sequence": step["sequence"], "step": step["step"], "disk": disk, **cells})
    return Tables(design.manipulator, table, pd.DataFrame(rows))


def _at_markers(states: RigStates, marker: np.ndarray) -> RigStates:
    """States with the positions of the markers in place of those of the disks after the base.

    `marker` (n, 2) holds their places in the disks' frames, m.
    """
    x, y, angle = states.x.copy(), states.y.copy(), states.angle[:, 1:]
    along, across = marker.T
    x[:, 1:] += np.cos(angle) * along - np.sin(angle) * across
    y[:, 1:] += np.sin(angle) * along + np.cos(angle) * across
    return RigStates(x, y, states.angle, states.converged, states.tension, states.slip)


def _with_slips(rng: np.random.Generator, design: Design, build: Build, value: np.ndarray) -> np.ndarray:
    """Readings with gross outliers and gaps (NaN), if the rig's recording has them."""
    chosen, of_all = SETTINGS.real, SETTINGS.imperfections
    gross, gap = rng.random(value.shape) < chosen.gross, rng.random(value.shape) < chosen.gaps
    away = rng.choice([-1, 1], value.shape) * rng.uniform(*of_all.gross_spread, value.shape)
    if build.gross:
        value = np.where(gross, value + away * np.array([of_all.gross[kind] for kind in design.kinds]), value)
    return np.where(gap & build.gaps, np.nan, value)
