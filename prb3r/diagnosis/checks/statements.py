"""What a recording states of Young's modulus, friction and markers, where the readings contradict it."""

from collections.abc import Collection
from dataclasses import replace

import numpy as np

from prb3r.diagnosis.checks.tolerated import tolerances_told
from prb3r.diagnosis.evidence.outliers import Doubts
from prb3r.diagnosis.fit.model import Fit
from prb3r.diagnosis.fit.tolerance import IN_RAD
from prb3r.recording.recording import Prior, Recording, Tolerance

STATED = {"log_stiffness": "youngs_modulus", "log_friction": "friction_coefficient"}
"""The fields of `[prior]` by the name of the constant that they state."""
WORDED = {"youngs_modulus": "Young's modulus", "friction_coefficient": "the friction coefficient"}
STIFFER = "whether clamps take up length of the plates or the cables themselves resist bending"
SOFTER = "whether the clamps give way"
"""What to look at besides where the arm is stiffer, or softer, than what is stated."""


def contradicted(calibrated: Fit) -> list[str]:
    """The fields of `[prior]` from which a fit of constants alone is away by more than `Settings.far_stated_sd` stated
    standard deviations."""
    away = np.abs(calibrated.p) / calibrated.model.deviations
    far = away > calibrated.model.settings.far_stated_sd
    return [
        STATED[name] for name, is_far in zip(calibrated.model.varied, far, strict=True) if name in STATED and is_far
    ]


def without_statements(recording: Recording, fields: Collection[str]) -> Recording:
    """The recording without what these `fields` of its `[prior]` state."""
    return replace(recording, prior=Prior(**recording.prior.model_dump() | dict.fromkeys(fields)))


def with_turned_markers(calibrated: Fit, doubts: Doubts) -> Tolerance | None:
    """The tolerances of a recording with a wider one of the angles of markers, if under a fit of constants alone
    several of these are turned far beyond the stated one; else None.

    None too where positions are not read: rest curvature of the plates turns the disks alike.
    """
    recording, settings = calibrated.recording, calibrated.model.settings
    told = tolerances_told(calibrated, doubts)
    turned = [k for k, name in enumerate(told.names) if name.endswith(IN_RAD)]
    far = np.abs(told.value[turned]) > settings.far_stated_sd * told.prior_sd[turned]
    if far.sum() < settings.fewest_turned or not recording.readings.is_position.any():
        return None
    wide = settings.wider_turn * recording.tolerance.marker_turn
    return recording.tolerance.model_copy(update={"marker_rad": wide})


def turned_markers(recording: Recording, freed: Fit, doubts: Doubts) -> str:
    """A remark that markers are turned on their disks by more than is stated.

    Parameters
    ----------
    recording : as it was recorded.
    freed : the fit of constants alone with a wide tolerance of these angles.
    """
    told = tolerances_told(freed, doubts)
    turned = np.array([value for name, value in zip(told.names, told.value, strict=True) if name.endswith(IN_RAD)])
    angles = np.sqrt(np.mean(turned**2)), recording.tolerance.marker_turn
    size, stated = (f"{180 / np.pi * angle:.2g} degrees" for angle in angles)
    return (
        f"markers are turned on their disks by some {size}, where {stated} were allowed for, and constants alone "
        "explain the readings with that: look at the markers, and state marker_rad under [tolerance]"
    )


def not_believed(recording: Recording, fields: Collection[str], freed: Fit) -> list[str]:
    """A remark on each of the `fields` of `[prior]` that are not believed.

    Parameters
    ----------
    recording : as it was recorded.
    freed : the fit of constants alone to the recording without these fields.
    """
    remarks = []
    for name, field in STATED.items():
        if field not in fields:
            continue
        stated, value = getattr(recording.prior, field), freed.p[freed.model.varied.index(name)]
        checked = f"{WORDED[field]} in the manipulator file"
        if field == "youngs_modulus":
            checked += f", the thickness of the plates, and {STIFFER if value > 0 else SOFTER}"
        remarks.append(
            f"what [prior] states of {WORDED[field]} (within {100 * stated:.2g} %) is {abs(value) / stated:.2g} "
            "standard deviations from what the readings say, and without it constants alone explain them: it is not "
            f"believed; check {checked}"
        )
    return remarks
