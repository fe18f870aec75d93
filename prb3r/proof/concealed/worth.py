"""The worth of an effect: the error of predictions of other loads without it, constants and frame refitted."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from prb3r.proof.concealed.build import Build, rig_as_built
from prb3r.proof.concealed.camera import exact_readings, truth
from prb3r.proof.concealed.design import Design, LoadSteps, followed
from prb3r.proof.settings import SETTINGS


def worths(
    design: Design,
    effects: Sequence[Mapping[str, Any]],
    constants: Sequence[float],
    frame: Sequence[float],
    build: Build,
    loads: Sequence[LoadSteps],
) -> list[float]:
    """For every effect: root mean square error of the readings under `loads` without it, in stated deviations.

    The other effects stay; constants and frame are refitted to the recording in the linear model, with their priors.
    An effect without which there is no equilibrium gets `SETTINGS.real.largest_worth`.  Raises ValueError if the rig
    has no equilibrium with all effects.
    """
    if not effects:
        return []
    programs = (design.program, loads)

    def seen(acting: Sequence[Mapping[str, Any]], p: Sequence[float], at: Sequence[float]) -> list[np.ndarray] | None:
        """Readings (r,) in stated deviations of the recording and of `loads`, with effects, constants and frame."""
        manipulator = rig_as_built(truth(design, acting, *p), build)
        states = [followed(manipulator, program) for program in programs]
        if any(solved is None for solved in states):
            return None
        sd = np.array([design.deviation(kind) for kind in design.kinds])
        read = [
            exact_readings(design, manipulator, solved, [at] * len(solved)) for solved in states if solved is not None
        ]
        return [(solved / sd).reshape(-1) for solved in read]

    whole = seen(effects, constants, frame)
    if whole is None:
        raise ValueError("the rig has no equilibrium at some step")
    columns, priors = nuisances(design, lambda p, at: seen(effects, p, at), whole, constants, frame)
    out, largest = [], SETTINGS.real.largest_worth
    for k in range(len(effects)):
        without = seen([*effects[:k], *effects[k + 1 :]], constants, frame)
        if without is None:
            out.append(largest)
            continue
        here, there = (a - b for a, b in zip(whole, without, strict=True))
        rows = np.vstack([columns[0], np.diag(priors)])
        refit = np.linalg.lstsq(rows, np.append(here, np.zeros(len(priors))), rcond=None)[0]
        left = there - columns[1] @ refit
        out.append(round(float(min(np.sqrt(np.mean(left**2)), largest)), 4))
    return out


def nuisances(
    design: Design, seen: Any, whole: Sequence[np.ndarray], constants: Sequence[float], frame: Sequence[float]
) -> tuple[list[np.ndarray], np.ndarray]:
    """Derivatives (r, c) of each program's readings by ln E, ln mu and frame, and the inverse prior sd (c,) of these.

    Parameters
    ----------
    seen : returns the scaled readings (r,) of each program at given constants and frame; None without an equilibrium
    whole : these readings at `constants` and `frame`
    """
    step, measurement = SETTINGS.sizes.relative_change, design.measurement
    sds = [
        design.prior.get("youngs_modulus", np.inf),
        design.prior.get("friction_coefficient", np.inf) if design.friction > 0 else 0.0,
        measurement["frame_rotation_sd_rad"],
        *([measurement.get("frame_position_sd_m", 0.0)] * 2),
    ]
    columns, priors = [], []
    for k, sd in enumerate(sds):
        if sd == 0:
            continue
        size = step * (design.length if k > 2 else 1.0)
        point = np.array([*constants, *frame], float)
        point[k] += size
        moved = seen(point[:2].tolist(), point[2:].tolist())
        if moved is not None:
            columns.append([(a - b) / size for a, b in zip(moved, whole, strict=True)])
            priors.append(1 / sd)
    return [np.stack([column[q] for column in columns], 1) for q in range(len(whole))], np.array(priors)
