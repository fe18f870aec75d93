"""What the bench records: from a design and a label to a recording with all its noise."""

from collections.abc import Sequence

import numpy as np
import pandas as pd

from prb3r.diagnosis.fit.prediction import Constants, predictor
from prb3r.model.manipulator import Manipulator
from prb3r.model.steps import loads_of
from prb3r.proof.concealed.camera import read, truth
from prb3r.proof.concealed.designs import Design, Steps, followed
from prb3r.proof.concealed.foreign import followed_foreign, knocks
from prb3r.proof.concealed.labels import Label
from prb3r.proof.concealed.responses import Bench
from prb3r.recording.recording import Measurement, Prior, Readings, Recording

GROSS = {0: 0.02, 1: 0.02, 2: 0.3, 3: 0.3}
"""Size of a gross outlier of each kind of reading, m or rad."""


def steps_of(design: Design, program: Sequence[Steps], names: Sequence[str]) -> pd.DataFrame:
    """The table of steps, tensions as noted."""
    rows = [
        {"sequence": name, "step": k + 1, **step}
        for name, steps in zip(names, program, strict=True)
        for k, step in enumerate(steps)
    ]
    return pd.DataFrame(rows).fillna(0.0)


def recording_of(design: Design, label: Label, extra: Steps = ()) -> Recording:
    """What the bench records; `extra`: steps of one more sequence.

    Raises
    ------
    ValueError
        Where the bench finds no equilibrium.
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
        image_centre_m=design.image_centre,
        sequences=tuple(names),
        steps=table,
        of_sequence=np.repeat(np.arange(len(program)), [len(each) for each in program]),
        loads=loads_of(manipulator, manipulator.chain(), table),
        readings=Readings(steps, disks + 1, np.array(design.kinds)[read_kinds], value[keep]),
    )


def _applied(design: Design, label: Label, program: Sequence[Steps], rng: np.random.Generator) -> list[Steps]:
    """Tensions as they really were: scattered, and one of them perhaps noted wrongly."""
    names = [f"cable_{name}_n" for name in design.cables]
    out: list[Steps] = []
    for q, steps in enumerate(program):
        rows = []
        for k, step in enumerate(steps):
            scatter = rng.standard_normal(len(names))
            far = rng.random(len(names)) < 0.1
            if "scatter" in label.awkward:
                scatter = np.where(far, 2 * np.sign(scatter), scatter)
            row: dict[str, float] = dict(step)
            for name, s in zip(names, scatter, strict=True):
                row[name] = max(step[name] * (1 + design.measurement["tension_sd_relative"] * s), 0.0)
            if label.wrong_weight is not None and (q, k) == tuple(label.wrong_weight[:2]):
                row[f"cable_{label.wrong_weight[2]}_n"] *= label.wrong_weight[3]
            rows.append(row)
        out.append(tuple(rows))
    return out


def _exact(design: Design, label: Label, program: Sequence[Steps]) -> np.ndarray:
    """(steps, disks, kinds) readings without reading noise."""
    manipulator = truth(design, label.effects, *label.constants)
    frames = [label.frame] * len(program)
    if label.foreign is None:
        found = followed(manipulator, program)
    else:
        found = followed_foreign(design, manipulator, program, *label.foreign)
        moved = [*knocks(design, *label.foreign), (0.0, 0.0, 0.0)][: len(program)]
        frames = [tuple(np.add(a, b).tolist()) for a, b in zip(frames, moved, strict=True)]
    if found is None:
        raise ValueError("the bench has no equilibrium at some step")
    return read(design, manipulator, found, frames)


def _noisy(design: Design, label: Label, exact: np.ndarray, rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    """Readings with noise, and which of them there are."""
    unit = rng.standard_normal(exact.shape)
    if "heavy" in label.awkward:
        unit = rng.standard_t(5, exact.shape) / np.sqrt(5 / 3)
    elif "uniform" in label.awkward:
        unit = rng.uniform(-np.sqrt(3), np.sqrt(3), exact.shape)
    value = exact + unit * np.array([design.deviation(kind) for kind in design.kinds])
    if "outliers" in label.awkward:
        gross = rng.random(exact.shape) < 0.02
        away = rng.choice([-1, 1], exact.shape) * rng.uniform(0.5, 1.5, exact.shape)
        value = value + gross * away * np.array([GROSS[kind] for kind in design.kinds])
    keep = np.ones(exact.shape, bool)
    if "missing" in label.awkward:
        keep = rng.random(exact.shape) >= 0.2
    return value, keep


def bias_of(design: Design) -> float:
    """Whitened norm of engine less rig for a recording without effects; infinite without equilibrium."""
    bench = Bench(design)
    label = Label(0, "clean", design.number, 0)
    predicted = predictor(recording_of(design, label))(Constants())
    if not np.isfinite(predicted).all():
        return np.inf
    return float(np.linalg.norm(bench.whiten(predicted.reshape(bench.nominal.shape) - bench.nominal)))
