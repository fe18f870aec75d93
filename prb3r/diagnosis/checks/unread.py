"""Disks that nobody read, of which readings under the recorded loads would tell what is named from what could stand in
its place."""

from dataclasses import replace

import numpy as np

from prb3r.diagnosis.fit.covariance import reading_sd
from prb3r.diagnosis.fit.model import Fit
from prb3r.diagnosis.search.selection import Choice
from prb3r.markdown import few
from prb3r.recording.recording import Readings, Recording


def disk_to_read(choice: Choice) -> list[str]:
    """A remark on the disk that tells most of those that were never read; none where it would not tell the chosen set
    of effects from half of what else stands, by probability (`Settings.resolved`).

    Each set predicts readings as it is fitted, the frame of the camera included.  At disks that were read the sets
    differ too, where parts within their tolerances make up for that: what counts is by how much more they differ.
    """
    settings, chosen = choice.fitted.model.settings, choice.fitted
    others = [s for s in choice.survivors if s.kinds != choice.kinds and s.probability >= settings.alike_rate]
    recording = chosen.recording
    disks, known = np.arange(1, recording.manipulator.plates + 1), np.unique(recording.readings.disk)
    unread = ~np.isin(disks, known)
    if not others or not unread.any():
        return []
    imagined = _reading(recording, disks)
    here, sd = _read(chosen, imagined), reading_sd(imagined)
    away = np.nan_to_num([(_read(other.fitted, imagined) - here) / sd for other in others])
    apart = np.stack([(away[:, imagined.readings.disk == disk] ** 2).sum(1) for disk in disks], 1)
    told = apart - apart[:, ~unread].max(1, keepdims=True) >= settings.resolved
    shares = np.array([other.probability for other in others])
    weight = np.where(unread, shares @ told, 0.0)
    if weight.max() < shares.sum() / 2:
        return []
    best = int(weight.argmax())
    names = dict.fromkeys(
        hypothesis.name
        for other, differs in zip(others, told[:, best], strict=True)
        for hypothesis in sorted(other.effects - choice.effects, key=lambda each: each.name)
        if differs
    )
    rivals = few(list(names)) or "no effect at all"
    return [f"read disk {disks[best]} too, under the same loads: it would tell what is named from {rivals}"]


def _reading(recording: Recording, disks: np.ndarray) -> Recording:
    """The recording with readings of `disks` (d,) in the place of its own, of the same steps and kinds."""
    readings = recording.readings
    grid = np.meshgrid(np.unique(readings.step), disks, np.unique(readings.kind), indexing="ij")
    step, disk, kind = (part.ravel() for part in grid)
    return replace(recording, readings=Readings(step, disk, kind, np.zeros(len(step))))


def _read(fitted: Fit, imagined: Recording) -> np.ndarray:
    """(r,) readings of an imagined recording as a fit predicts them, m and rad; NaN where a step has no equilibrium."""
    predict = replace(fitted.model.predict, recording=imagined)
    return predict.read(fitted.solved.states, fitted.constants, fitted.effects)
