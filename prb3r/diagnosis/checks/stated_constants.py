"""What a recording states of Young's modulus and of friction, where the readings contradict it."""

from collections.abc import Collection
from dataclasses import replace

import numpy as np

from prb3r.diagnosis.fit.model import Fit
from prb3r.recording.recording import Prior, Recording

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
