"""Measured, calibrated and explained over each other, at the steps that calibration misses most."""

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from prb3r.present import style
from prb3r.present.diagnosis.sheet import (
    DISTANCE_95,
    LOOKS,
    MEASURED,
    NOISE,
    SPREAD_95,
    Evidence,
    noise_patch,
    sheet,
)
from prb3r.present.study.shapes import to_scale, view_of
from prb3r.quantities import describe

PANELS = 3


def telling_steps(residuals: pd.DataFrame, count: int = PANELS) -> list[tuple[str, int]]:
    """The steps with the largest misfit, one of each sequence as far as that goes, in the order of the recording."""
    believed = residuals[~residuals["weighed_down"] & ~residuals["weight_doubted"]]
    misfit = (believed["residual_calibrated"] ** 2).groupby([believed["sequence"], believed["step"]]).mean()
    ranked = misfit.sort_values(ascending=False, kind="stable").index.to_list()
    first = [key for k, key in enumerate(ranked) if key[0] not in {other for other, _ in ranked[:k]}]
    chosen = [*first, *(key for key in ranked if key not in first)][:count]
    order = list(dict.fromkeys(zip(residuals["sequence"], residuals["step"], strict=True)))
    return sorted(chosen, key=order.index)


def misfits(evidence: Evidence) -> Figure:
    """Shapes (or bends, or angles, where positions were not read) at telling steps, and below what is left of each."""
    rows, steps = evidence.residuals, telling_steps(evidence.residuals)
    parts = [rows[(rows["sequence"] == name) & (rows["step"] == step)] for name, step in steps]
    if evidence.positions:
        return _shapes(evidence, steps, parts)
    kind = "bend_rad" if (rows["kind"] == "bend_rad").any() else "angle_rad"
    return _along(evidence, steps, [part[part["kind"] == kind] for part in parts], kind)


def _title(evidence: Evidence, key: tuple[str, int], part: pd.DataFrame) -> str:
    """`down, step 2: cable 4 95 N`."""
    recording = evidence.diagnosis.recording
    steps = recording.steps
    row = np.flatnonzero((steps["sequence"] == key[0]) & (steps["step"] == key[1]))[0]
    tension = recording.loads.tension[row]
    pulled = [
        f"{name}: {style.digits(float(f'{t:.3g}'))} N"
        for name, t in zip(recording.manipulator.cable_names, tension, strict=True)
        if t > 0
    ]
    held = " (held out)" if part["held_out"].any() else ""
    cables = "no cable" if not pulled else f"cable {', '.join(pulled)}" if len(pulled) < 3 else f"{len(pulled)} cables"
    return f"{key[0]}, step {key[1]}{held}\n{cables}"


def _shapes(evidence: Evidence, steps: list[tuple[str, int]], parts: list[pd.DataFrame]) -> Figure:
    seen = [part.pivot_table(index="disk", columns="kind", values="measured") for part in parts]
    drawn = {
        name: [table[(table["sequence"] == key[0]) & (table["step"] == key[1])] for key in steps]
        for name, table in evidence.shapes.items()
    }
    everything = [*seen, *(one for tables in drawn.values() for one in tables)]
    corners = np.concatenate([one.reindex(columns=["x_m", "y_m"]).to_numpy(float) for one in everything])
    inner = (style.DOUBLE - 16) / len(steps)
    shape_height = float(np.clip(inner * view_of(corners)[2], 22, 70))
    handles = evidence.handles(noise_patch(), measured=True)
    ratios = {"height_ratios": [shape_height, 28]}
    figure, axes = sheet(2, len(steps), shape_height + 28 + 20, handles, gridspec_kw=ratios, sharey="row")
    unit = style.shown(describe("x_m"), corners)
    for k, (key, part) in enumerate(zip(steps, parts, strict=True)):
        above, below = axes[:, k]
        above.set_title(_title(evidence, key, part), pad=3)
        for name in evidence.models:
            line = drawn[name][k]
            look = {**LOOKS[name], "marker": "", "lw": 1.3}
            above.plot(1e3 * line["x_m"], 1e3 * line["y_m"], **look)
        marks = seen[k].reindex(columns=["x_m", "y_m"])
        above.plot(1e3 * marks["x_m"], 1e3 * marks["y_m"], **MEASURED)
        to_scale(above, corners)
        above.set_xlabel("$x$ (mm)")
        _distances(evidence, below, part)
    axes[0, 0].set_ylabel("$y$ (mm)")
    axes[1, 0].set_ylabel(f"distance to\nmeasured ({unit.unit})")
    axes[1, 0].set_ylim(bottom=0)
    return figure


def _distances(evidence: Evidence, axes: Axes, part: pd.DataFrame) -> None:
    """How far each disk is from where a model has it, mm."""
    part = part[part["kind"].isin(["x_m", "y_m"])]
    sure = part[~part["weighed_down"]]
    sd = 1e3 * np.sqrt((sure["sd"] ** 2).groupby(sure["disk"]).mean())
    axes.fill_between(sd.index, 0, DISTANCE_95 * sd, **NOISE, zorder=0.5)
    for name in evidence.models:
        away = np.sqrt(((part["measured"] - part[name]) ** 2).groupby(part["disk"]).sum())
        axes.plot(away.index, 1e3 * away, **LOOKS[name])
    axes.set_xlabel("disk")
    axes.locator_params(axis="x", integer=True)


def _along(evidence: Evidence, steps: list[tuple[str, int]], parts: list[pd.DataFrame], kind: str) -> Figure:
    bends = kind == "bend_rad"
    handles = evidence.handles(noise_patch(), measured=True)
    shared = {"gridspec_kw": {"height_ratios": [42, 28]}, "sharey": "row", "sharex": "col"}
    figure, axes = sheet(2, len(steps), 82, handles, **shared)
    for k, (key, part) in enumerate(zip(steps, parts, strict=True)):
        above, below = axes[:, k]
        above.set_title(_title(evidence, key, part), pad=3)
        sd = SPREAD_95 * np.degrees(part[~part["weighed_down"]].groupby("disk")["sd"].mean())
        below.fill_between(sd.index, -sd, sd, **NOISE, zorder=0.5)
        part = part.groupby("disk")[["measured", *evidence.models]].mean()
        for name in evidence.models:
            above.plot(part.index, np.degrees(part[name]), **{**LOOKS[name], "marker": ""})
            away = part["measured"] - part[name]
            turns = 0.0 if bends else 2 * np.pi * np.round(away / (2 * np.pi))
            below.plot(part.index, np.degrees(away - turns), **LOOKS[name])
        above.plot(part.index, np.degrees(part["measured"]), **MEASURED)
        below.set_xlabel("plate" if bends else "disk")
        below.locator_params(axis="x", integer=True)
    axes[0, 0].set_ylabel("bend of the plate (°)" if bends else "angle of the disk (°)")
    axes[1, 0].set_ylabel("measured less\nmodel (°)")
    return figure
