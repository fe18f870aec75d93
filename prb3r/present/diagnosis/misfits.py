"""The figure of measured and modelled shapes at the steps that the calibrated model misses most."""

from collections.abc import Sequence
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from prb3r.diagnosis.confidence import NORMAL_REACH, PLANE_REACH
from prb3r.diagnosis.result.diagnosis import Diagnosis
from prb3r.present import style
from prb3r.present.diagnosis.panels import (
    LOOKS,
    MEASURED,
    NOISE,
    POSITIONS,
    has_positions,
    legend_entries,
    noise_patch,
    panel_grid,
)
from prb3r.present.framing import to_scale, view_of
from prb3r.quantities import describe

PANELS = 3
"""Steps that are shown."""


def telling_steps(residuals: pd.DataFrame, count: int = PANELS) -> list[tuple[str, int]]:
    """Up to `count` steps (sequence, step) that the calibrated model misses most, in the order of the recording.

    Each sequence is shown once before any is shown twice.  Outliers and steps with a doubted weight do not count.
    """
    believed = residuals[~residuals["weighed_down"] & ~residuals["weight_doubted"]]
    misfit = (believed["residual_calibrated"] ** 2).groupby([believed["sequence"], believed["step"]]).mean()
    ranked = misfit.sort_values(ascending=False, kind="stable").index.to_list()
    first = [key for k, key in enumerate(ranked) if key[0] not in {other for other, _ in ranked[:k]}]
    chosen = [*first, *(key for key in ranked if key not in first)][:count]
    order = list(dict.fromkeys(zip(residuals["sequence"], residuals["step"], strict=True)))
    return sorted(chosen, key=order.index)


def misfits(diagnosis: Diagnosis) -> Figure:
    """Measured and modelled shapes at telling steps, and below them the differences disk by disk.

    Where positions were not read, bends or else angles stand for the shapes.
    """
    rows = diagnosis.tables["residuals"]
    steps = telling_steps(rows)
    parts = [rows[(rows["sequence"] == name) & (rows["step"] == step)] for name, step in steps]
    if has_positions(rows):
        return _shapes(diagnosis, steps, parts)
    kind = "bend_rad" if (rows["kind"] == "bend_rad").any() else "angle_rad"
    return _along(diagnosis, steps, [part[part["kind"] == kind] for part in parts], kind)


def _title(diagnosis: Diagnosis, key: tuple[str, int], part: pd.DataFrame) -> str:
    """Two lines above a panel: sequence and step, and whether they were held out; then which cables are pulled, up to
    two of them with their tensions to three digits, N."""
    loads = diagnosis.tables["loads"]
    row = loads[(loads["sequence"] == key[0]) & (loads["step"] == key[1])].iloc[0]
    tension = {name: float(row[f"cable_{name}_n"]) for name in diagnosis.nominal.cable_names}
    pulled = [f"{name}: {style.digits(float(f'{t:.3g}'))} N" for name, t in tension.items() if t > 0]
    held = " (held out)" if part["held_out"].any() else ""
    cables = "no cable" if not pulled else f"cable {', '.join(pulled)}" if len(pulled) < 3 else f"{len(pulled)} cables"
    return f"{key[0]}, step {key[1]}{held}\n{cables}"


def _shapes(diagnosis: Diagnosis, steps: list[tuple[str, int]], parts: list[pd.DataFrame]) -> Figure:
    """The figure of positions; `parts` are the rows of readings of each step."""
    seen = [part.pivot_table(index="disk", columns="kind", values="measured") for part in parts]
    drawn = {name: [_shape(diagnosis, name, key) for key in steps] for name in diagnosis.shown}
    everything = [*seen, *(shape for shapes in drawn.values() for shape in shapes)]
    corners = np.concatenate([points.reindex(columns=[*POSITIONS]).to_numpy(float) for points in everything])
    inner = (style.DOUBLE - 16) / len(steps)
    shape_height = float(np.clip(inner * view_of(corners)[2], 22, 70))
    entries = legend_entries(diagnosis.shown, noise_patch(), measured=True)
    ratios = {"height_ratios": [shape_height, 28]}
    figure, axes = panel_grid(2, len(steps), shape_height + 28 + 20, entries, gridspec_kw=ratios, sharey="row")
    unit = style.shown(describe("x_m"), corners)
    for k, (key, part) in enumerate(zip(steps, parts, strict=True)):
        above, below = axes[:, k]
        above.set_title(_title(diagnosis, key, part), pad=3)
        for name in diagnosis.shown:
            line = drawn[name][k]
            look = {**LOOKS[name], "marker": "", "lw": 1.3}
            above.plot(1e3 * line["x_m"], 1e3 * line["y_m"], **look)
        marks = seen[k].reindex(columns=[*POSITIONS])
        above.plot(1e3 * marks["x_m"], 1e3 * marks["y_m"], **MEASURED)
        to_scale(above, corners)
        above.set_xlabel("$x$ (mm)")
        _distances(below, part, diagnosis.shown)
    axes[0, 0].set_ylabel("$y$ (mm)")
    axes[1, 0].set_ylabel(f"distance to\nmeasured ({unit.unit})")
    axes[1, 0].set_ylim(bottom=0)
    return figure


def _shape(diagnosis: Diagnosis, model: str, key: tuple[str, int]) -> pd.DataFrame:
    """Rows of all disks at the step `key` (sequence, step), as the camera would see the state of a model."""
    rows = diagnosis.tables["shapes"]
    return rows[(rows["model"] == model) & (rows["sequence"] == key[0]) & (rows["step"] == key[1])]


def _distances(axes: Axes, part: pd.DataFrame, models: Sequence[str]) -> None:
    """Draw the distance of each measured disk from where the models have it, mm, with the band of noise."""
    part = part[part["kind"].isin(POSITIONS)]
    sure = part[~part["weighed_down"]]
    sd = 1e3 * np.sqrt((sure["sd"] ** 2).groupby(sure["disk"]).mean())
    axes.fill_between(sd.index, 0, PLANE_REACH * sd, **NOISE, zorder=0.5)
    for name in models:
        away = np.sqrt(((part["measured"] - part[name]) ** 2).groupby(part["disk"]).sum())
        axes.plot(away.index, 1e3 * away, **LOOKS[name])
    axes.set_xlabel("disk")
    axes.locator_params(axis="x", integer=True)


def _along(diagnosis: Diagnosis, steps: list[tuple[str, int]], parts: list[pd.DataFrame], kind: str) -> Figure:
    """The figure of angles or bends, as `kind` says, along the arm; `parts` are the rows of readings of each step."""
    bends = kind == "bend_rad"
    entries = legend_entries(diagnosis.shown, noise_patch(), measured=True)
    shared: dict[str, Any] = {"gridspec_kw": {"height_ratios": [42, 28]}, "sharey": "row", "sharex": "col"}
    figure, axes = panel_grid(2, len(steps), 82, entries, **shared)
    for k, (key, part) in enumerate(zip(steps, parts, strict=True)):
        above, below = axes[:, k]
        above.set_title(_title(diagnosis, key, part), pad=3)
        sd = NORMAL_REACH * np.degrees(part[~part["weighed_down"]].groupby("disk")["sd"].mean())
        below.fill_between(sd.index, -sd, sd, **NOISE, zorder=0.5)
        part = part.groupby("disk")[["measured", *diagnosis.shown]].mean()
        for name in diagnosis.shown:
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
