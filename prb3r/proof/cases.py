"""What a run consists of, and what a bench records: requests from a number of cases, recordings from labels."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import pandas as pd

from prb3r.model.manipulator import Manipulator
from prb3r.model.steps import loads_of
from prb3r.proof.candidates import kinds
from prb3r.proof.designs import HISTORY, LOADING, PLAIN, POOR, Design, Steps, Y, design_of, followed
from prb3r.proof.foreign import LAWS, followed_foreign, knocks, possible
from prb3r.proof.labels import Label, Request, label_of
from prb3r.proof.responses import Bench, read, truth
from prb3r.recording.recording import Measurement, Prior, Readings, Recording

FULL = 1200
SHARES = {
    "clean": 400,
    "single": 420,
    "pair": 84,
    "foreign": 84,
    "deleted": 44,
    "decoy": 44,
    "confusable": 60,
    "hidden": 64,
}
"""Recordings of each class in a full run."""
KINDS = (
    "weakened_plate",
    "pulley_friction",
    "worn_hole",
    "precurvature",
    "tension_offset",
    "hole_offset",
    "segment_stiffness",
    "nonlinear_plate",
    "disk_contact",
    "clamp_compliance",
    "cable_bending",
    "hole_clearance",
    "gravity",
    "tip_force",
    "tip_load_friction",
    "camera_scale",
    "lens_distortion",
    "cable_friction",
    "slip_history",
    "edge_wrap",
    "dead_cable",
)
MULTIPLES = (1.0, 2.0, 5.0)
HISTORY_SHARE = 0.03
"""Of clean and single recordings, those with friction along the load path."""
GROSS = {0: 0.02, 1: 0.02, 2: 0.3, 3: 0.3}
"""Size of a gross outlier of each kind of reading, m or rad."""


def flavours(cases: int) -> list[str]:
    """Of the designs of a run."""
    share = cases / FULL
    plain, special = max(4, round(24 * share)), max(1, round(4 * share))
    return [PLAIN] * plain + [LOADING] * special + [POOR] * special + [HISTORY] * (2 if cases >= 300 else 0)


def counts(cases: int) -> dict[str, int]:
    """Recordings of every class; they add up to `cases`."""
    exact = {name: cases * share / FULL for name, share in SHARES.items()}
    out = {name: int(value) for name, value in exact.items()}
    late = sorted(exact, key=lambda name: out[name] - exact[name])
    for name in late[: cases - sum(out.values())]:
        out[name] += 1
    return out


def requests(seed: int, cases: int, designs: Sequence[Design]) -> list[Request]:
    """Every recording of a run, on designs that can show it."""
    rng, shows = np.random.default_rng([seed, 0]), [kinds(design) for design in designs]
    asked: list[tuple[str, str, float]] = []
    for cls, count in counts(cases).items():
        for i in range(count):
            kind, multiple = KINDS[i % len(KINDS)], MULTIPLES[(i + i // len(KINDS)) % 3]
            if cls == "clean":
                kind = "awkward" if i % 2 else ""
            elif cls == "pair":
                kind, multiple = ("cancelling" if i % 2 else "", 5.0)
            elif cls == "foreign":
                kind = list(LAWS)[i % len(LAWS)]
            elif cls == "decoy":
                kind = "frame" if i % 4 == 3 else "weight"
            elif cls == "confusable":
                kind, multiple = (("disk_contact", "nonlinear_plate")[i % 2] if i % 5 == 4 else "", 5.0)
            elif cls == "hidden":
                kind = ("pulley_friction", "tension_offset", "", "worn_hole", "hole_offset")[i % 5]
            asked.append((cls, kind, multiple))
    load = np.zeros(len(designs))
    out = []
    for case, (cls, kind, multiple) in enumerate(asked):
        able = [k for k, design in enumerate(designs) if _able(design, shows[k], cls, kind, case)]
        able = able or [k for k, design in enumerate(designs) if design.flavour == PLAIN]
        chosen = min(able, key=lambda k: (load[k], rng.random()))
        load[chosen] += 1
        out.append(Request(case, seed, cls, chosen, kind, multiple))
    return out


def _able(design: Design, shown: set[str], cls: str, kind: str, case: int) -> bool:
    slow = case % round(1 / HISTORY_SHARE) == 0 and cls in ("clean", "single")
    flavour = {"hidden": LOADING, "confusable": POOR}.get(cls, PLAIN)
    if cls == "confusable" and kind:
        flavour = PLAIN
    if cls in ("single", "deleted") and kind not in shown:
        return False
    if cls == "foreign" and kind not in possible(design):
        return False
    return design.flavour == (HISTORY if slow else flavour) or (design.flavour == PLAIN and slow)


def labels_of(task: tuple[Design, Sequence[Request]]) -> list[Label]:
    """The labels of all requests for one design."""
    design, asked = task
    bench = Bench(design)
    loading = Bench(design, design.loading_only) if design.flavour == LOADING else None
    return [label_of(each, bench, loading) for each in asked]


def drawn_design(task: tuple[int, int, str]) -> Design:
    """A design from its seed, number and flavour."""
    return design_of(*task)


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
        unit = rng.standard_t(4, exact.shape) / np.sqrt(2)
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
    """Whitened norm of engine less rig for a whole recording without effects, at the nominal constants."""
    from prb3r.recording.predict import Constants, predictor

    bench = Bench(design)
    label = Label(0, "clean", design.number, 0)
    predicted = predictor(recording_of(design, label))(Constants())
    return float(np.linalg.norm(bench.whiten(predicted.reshape(bench.nominal.shape) - bench.nominal)))


def public(design: Design) -> Mapping[str, Any]:
    """What may be said of a design before the seal is broken."""
    return {
        "design": design.number,
        "flavour": design.flavour,
        "segments": len(design.manipulator["segment"]),
        "plates": design.plates,
        "cables": len(design.cables),
        "sequences": len(design.program),
        "steps": sum(len(steps) for steps in design.program),
        "read": ", ".join(("x", "y", "angle", "bend")[kind] for kind in design.kinds),
        "positions": design.kinds[0] <= Y,
        "friction": design.friction,
        "largest_bend_rad": design.largest_bend,
    }
