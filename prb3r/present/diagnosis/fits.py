"""Figures of how well the calibrated and the explained model fit: whitened residuals and held-out errors."""

from collections.abc import Sequence
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Circle, Patch

from prb3r.diagnosis.chance import chi2_critical
from prb3r.diagnosis.confidence import PLANE_REACH, TAIL
from prb3r.diagnosis.result.diagnosis import Diagnosis
from prb3r.present import style
from prb3r.present.diagnosis.panels import (
    LOOKS,
    MEASURED,
    NOISE,
    POSITIONS,
    StepAxis,
    breaks_between,
    has_positions,
    legend_entries,
    panel_grid,
)

OUTERMOST = 6.0
"""Residuals beyond so many standard deviations are counted in the outermost bars."""
HELD: dict[str, Any] = {"fc": "#f3ead2", "ec": "none"}
"""Look of held-out sequences."""


def residual_sizes(diagnosis: Diagnosis) -> Figure:
    """Whitened residuals of both models in three panels: their histogram against the normal law, and their root mean
    square by disk and by step.  Histogram and disks are of fitted readings, steps of held-out ones too."""
    rows, models = diagnosis.tables["residuals"], diagnosis.shown
    rows = rows[~rows["weighed_down"]]
    entries = legend_entries(
        models,
        Line2D([], [], color=style.INK, lw=0.9, ls=(0, (1.2, 1.3)), label="a right model"),
        Patch(**NOISE, label="95 % of the marks of a right model"),
        *([Patch(**HELD, label="held out")] if rows["held_out"].any() else []),
    )
    figure, grid = panel_grid(1, 3, 56, entries, gridspec_kw={"width_ratios": [1, 1, 1.5]})
    histogram, by_disk, by_step = grid[0]
    fitted = rows[~rows["held_out"]]
    _histogram(histogram, fitted, models)
    disk = fitted["disk"].to_numpy(float)
    _size(by_disk, fitted, models, disk)
    bends = set(rows["kind"]) == {"bend_rad"}
    by_disk.set(xlabel="plate" if bends else "disk", ylabel="r.m.s. residual (sd)")
    by_disk.locator_params(axis="x", integer=True)
    axis = StepAxis.of(rows)
    for name, (first, last) in axis.sequences.items():
        if rows["held_out"][rows["sequence"] == name].any():
            by_step.axvspan(first - 0.5, last + 0.5, **HELD, zorder=0.2)
    _size(by_step, rows, models, axis.at(rows))
    axis.name_sequences(by_step, 0.4 * style.DOUBLE)
    for axes in (by_disk, by_step):
        axes.set_ylim(bottom=0)
    return figure


def _histogram(axes: Axes, rows: pd.DataFrame, models: Sequence[str]) -> None:
    edges = np.linspace(-OUTERMOST, OUTERMOST, 25)
    for name in models:
        values = np.clip(rows[f"residual_{name}"].dropna(), -OUTERMOST, OUTERMOST)
        look = {key: value for key, value in LOOKS[name].items() if key in ("color", "ls", "lw")}
        axes.stairs(np.histogram(values, edges, density=True)[0], edges, **look)
    at = np.linspace(-OUTERMOST, OUTERMOST, 121)
    axes.plot(at, np.exp(-(at**2) / 2) / np.sqrt(2 * np.pi), color=style.INK, lw=0.9, ls=(0, (1.2, 1.3)))
    axes.set(xlabel="residual (sd of the noise)", ylabel="density", xlim=(-OUTERMOST, OUTERMOST))


def _size(axes: Axes, rows: pd.DataFrame, models: Sequence[str], at: np.ndarray) -> None:
    """Draw the root mean square residual at each place `at` (rows,), with the band in which a right model has 95 %."""
    places, number = np.unique(at, return_inverse=True)
    count = np.bincount(number)
    low, high = (np.sqrt(chi2_critical(share, count) / count) for share in (1 - TAIL, TAIL))
    for place, bottom, top in zip(places, low, high, strict=True):
        axes.fill_between([place - 0.5, place + 0.5], bottom, top, **NOISE, zorder=0.4)
    axes.axhline(1.0, color=style.INK, lw=0.9, ls=(0, (1.2, 1.3)))
    breaks = breaks_between(places)
    for name in models:
        size = np.sqrt(np.bincount(number, rows[f"residual_{name}"].to_numpy() ** 2) / count)
        for run in np.split(np.arange(len(places)), breaks):
            axes.plot(places[run], size[run], **LOOKS[name])


def held_out_errors(diagnosis: Diagnosis) -> Figure | None:
    """Held-out sequences in two panels: errors of the last disk in the plane, and root mean square errors by step.

    Without positions the first panel shows the angle or bend that calibration misses most.  None without held-out data.
    """
    models, rows = diagnosis.shown, diagnosis.tables["residuals"]
    rows = rows[rows["held_out"] & ~rows["weighed_down"]]
    if rows.empty:
        return None
    positions = has_positions(rows)
    entries = legend_entries(models, Patch(**NOISE, label="the noise of the readings"), measured=not positions)
    figure, grid = panel_grid(1, 2, 58, entries, gridspec_kw={"width_ratios": [1, 1.25]})
    path, errors = grid[0]
    factor, unit = (1e3, "mm") if positions else (180 / np.pi, "°")
    rows = rows[rows["kind"].isin(POSITIONS)] if positions else rows
    axis = StepAxis.of(rows)
    if positions:
        _target(path, rows, models)
    else:
        _angles(path, rows, models, axis)
    steps = rows.assign(at=axis.at(rows)).groupby("at")
    noise = np.sqrt(steps["sd"].apply(lambda sd: (sd**2).mean()))
    for place, sd in noise.items():
        errors.fill_between([place - 0.5, place + 0.5], 0, factor * sd, **NOISE, zorder=0.4)
    breaks = breaks_between(noise.index)
    for name in models:
        size = rows.assign(at=axis.at(rows), off=_off(rows, name) ** 2).groupby("at")["off"].mean() ** 0.5
        for part in np.split(np.arange(len(size)), breaks):
            errors.plot(size.index[part], factor * size.to_numpy()[part], **LOOKS[name])
    axis.name_sequences(errors, 0.5 * style.DOUBLE)
    errors.set_ylabel(f"r.m.s. error ({unit})")
    errors.set_ylim(bottom=0)
    return figure


def _off(rows: pd.DataFrame, name: str) -> pd.Series:
    """(rows,) measured less predicted by the model `name`; angles modulo 2 pi, by the shorter way."""
    away = rows["measured"] - rows[name]
    return away.where(rows["kind"] != "angle_rad", away - 2 * np.pi * np.round(away / (2 * np.pi)))


def _target(axes: Axes, rows: pd.DataFrame, models: Sequence[str]) -> None:
    """Draw predicted less measured positions of the last disk, mm, with the circle of 95 % of the noise."""
    last = rows[rows["disk"] == rows["disk"].max()]
    keys = ["sequence", "step"]
    sd = 1e3 * float(np.sqrt((last["sd"] ** 2).mean()))
    axes.add_patch(Circle((0, 0), PLANE_REACH * sd, **NOISE, zorder=0.4))
    axes.axhline(0, color=style.QUIET, lw=0.5, zorder=0.5)
    axes.axvline(0, color=style.QUIET, lw=0.5, zorder=0.5)
    reach = 1.4 * PLANE_REACH * sd
    for name in models:
        off = last.assign(off=-1e3 * _off(last, name)).pivot_table(index=keys, columns="kind", values="off")
        off = off.reindex(columns=["x_m", "y_m"]).fillna(0.0)
        axes.plot(off["x_m"], off["y_m"], **{**LOOKS[name], "ls": "", "ms": 4.2})
        reach = max(reach, 1.1 * float(off.abs().max().max()))
    axes.set(xlim=(-reach, reach), ylim=(-reach, reach), aspect="equal")
    disk = last["disk"].max()
    axes.set(xlabel=f"predicted less measured $x$ of disk {disk} (mm)", ylabel="the same of $y$ (mm)")
    axes.locator_params(nbins=6, steps=[1, 2, 5, 10])


def _angles(axes: Axes, rows: pd.DataFrame, models: Sequence[str], axis: StepAxis) -> None:
    """Draw by step the angle, or the bend, of the disk that the calibrated model misses most."""
    kind = "bend_rad" if (rows["kind"] == "bend_rad").any() else "angle_rad"
    rows = rows[rows["kind"] == kind]
    worst = (_off(rows, "calibrated") ** 2).groupby(rows["disk"]).mean().idxmax()
    rows = rows[rows["disk"] == worst].groupby(["sequence", "step"], sort=False).mean(numeric_only=True).reset_index()
    for _, part in rows.groupby("sequence", sort=False):
        at = axis.at(part)
        for name in models:
            axes.plot(at, np.degrees(part[name]), **{**LOOKS[name], "lw": 0.8})
        axes.plot(at, np.degrees(part["measured"]), **{**MEASURED, "ms": 4.6})
    axis.name_sequences(axes, 0.4 * style.DOUBLE)
    axes.set_ylabel(f"bend of plate {worst} (°)" if kind == "bend_rad" else f"angle of disk {worst} (°)")
