"""Makes the recordings of bench rigs: from a design and a label to readings with all their noise."""

from collections.abc import Sequence

import numpy as np
import pandas as pd

from prb3r.diagnosis.fit.constants import Constants
from prb3r.diagnosis.fit.prediction import predictor
from prb3r.model.manipulator import Manipulator
from prb3r.model.steps import loads_of
from prb3r.proof.concealed.camera import exact_readings, truth
from prb3r.proof.concealed.design import Design, LoadSteps, followed
from prb3r.proof.concealed.foreign import followed_foreign, knocks
from prb3r.proof.concealed.labels import Label
from prb3r.proof.concealed.responses import Responses
from prb3r.proof.settings import SETTINGS
from prb3r.recording.recording import Measurement, Prior, Readings, Recording, Tolerance

EXACT = Tolerance(offset_m=0.0, length_m=0.0, thickness_relative=0.0, marker_m=0.0)
"""Tolerance of bench rigs, which are built exactly as drawn and say so."""


def steps_of(design: Design, program: Sequence[LoadSteps], names: Sequence[str]) -> pd.DataFrame:
    """The table of steps: `sequence` (by `names`), `step` from 1, loads as noted; 0 where a step has no value."""
    rows = [
        {"sequence": name, "step": k + 1, **step}
        for name, steps in zip(names, program, strict=True)
        for k, step in enumerate(steps)
    ]
    return pd.DataFrame(rows).fillna(0.0)


def recording_of(design: Design, label: Label, extra: LoadSteps = ()) -> Recording:
    """The recording of a bench rig, with the steps `extra` as one more sequence if there are any.

    Raises
    ------
    ValueError
        Where the rig has no equilibrium.
    """
    rng = np.random.default_rng(label.noise_seed)
    program = [*design.program, extra] if extra else list(design.program)
    names = [f"s{k + 1}" for k in range(len(design.program))] + ["proposed"] * bool(extra)
    exact = _exact(design, label, _applied(design, label, program, rng))
    value, keep = _noisy(design, label, exact, rng)
    steps, disks, read_kinds = np.nonzero(keep)
    table, manipulator = steps_of(design, program, names), Manipulator.model_validate(design.manipulator)
    return Recording(
        name=f"case {label.case}",
        manipulator=manipulator,
        measurement=Measurement(**design.measurement),
        prior=Prior(**design.prior),
        tolerance=EXACT,
        image_centre_m=design.image_centre,
        sequences=tuple(names),
        steps=table,
        of_sequence=np.repeat(np.arange(len(program)), [len(sequence) for sequence in program]),
        loads=loads_of(manipulator, manipulator.chain(), table),
        readings=Readings(steps, disks + 1, np.array(design.kinds)[read_kinds], value[keep]),
    )


def _applied(design: Design, label: Label, program: Sequence[LoadSteps], rng: np.random.Generator) -> list[LoadSteps]:
    """The program with true tensions: scattered about the noted ones, and the wrong weight of the label applied."""
    names, chosen = [f"cable_{name}_n" for name in design.cables], SETTINGS.imperfections
    out: list[LoadSteps] = []
    for q, steps in enumerate(program):
        rows = []
        for k, step in enumerate(steps):
            scatter = rng.standard_normal(len(names))
            far = rng.random(len(names)) < chosen.far_tensions
            if "scatter" in label.awkward:
                scatter = np.where(far, chosen.far_by * np.sign(scatter), scatter)
            row: dict[str, float] = dict(step)
            for name, s in zip(names, scatter, strict=True):
                row[name] = max(step[name] * (1 + design.measurement["tension_sd_relative"] * s), 0.0)
            if label.wrong_weight is not None and (q, k) == tuple(label.wrong_weight[:2]):
                row[f"cable_{label.wrong_weight[2]}_n"] *= label.wrong_weight[3]
            rows.append(row)
        out.append(tuple(rows))
    return out


def _exact(design: Design, label: Label, program: Sequence[LoadSteps]) -> np.ndarray:
    """(steps, disks, kinds) readings, m and rad, without reading noise but under the tensions of `program` and the
    frame of the label. Raises ValueError where the rig has no equilibrium."""
    manipulator = truth(design, label.effects, *label.constants)
    frames = [label.frame] * len(program)
    if label.foreign is None:
        states = followed(manipulator, program)
    else:
        states = followed_foreign(design, manipulator, program, *label.foreign)
        moved = [*knocks(design, *label.foreign), (0.0, 0.0, 0.0)][: len(program)]
        frames = [tuple(np.add(a, b).tolist()) for a, b in zip(frames, moved, strict=True)]
    if states is None:
        raise ValueError("the rig has no equilibrium at some step")
    return exact_readings(design, manipulator, states, frames)


def _noisy(design: Design, label: Label, exact: np.ndarray, rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    """(steps, disks, kinds) readings with noise and gross outliers, and which of them are there (bool)."""
    unit, chosen = rng.standard_normal(exact.shape), SETTINGS.imperfections
    if "heavy" in label.awkward:
        nu = chosen.heavy_freedom
        unit = rng.standard_t(nu, exact.shape) / np.sqrt(nu / (nu - 2))
    elif "uniform" in label.awkward:
        unit = rng.uniform(-np.sqrt(3), np.sqrt(3), exact.shape)
    value = exact + unit * np.array([design.deviation(kind) for kind in design.kinds])
    if "outliers" in label.awkward:
        gross = rng.random(exact.shape) < chosen.outliers
        away = rng.choice([-1, 1], exact.shape) * rng.uniform(*chosen.gross_spread, exact.shape)
        value = value + gross * away * np.array([chosen.gross[kind] for kind in design.kinds])
    keep = np.ones(exact.shape, bool)
    if "missing" in label.awkward:
        keep = rng.random(exact.shape) >= chosen.missing
    return value, keep


def bias_of(design: Design) -> float:
    """Whitened norm of the difference of engine and rig on a design without effects; infinite if the engine has no
    equilibrium."""
    responses = Responses(design)
    predicted = predictor(recording_of(design, Label(0, "clean", design.number, 0)))(Constants())
    if not np.isfinite(predicted).all():
        return np.inf
    change = predicted.reshape(responses.nominal.shape) - responses.nominal
    return float(np.linalg.norm(responses.whiten(change)))
