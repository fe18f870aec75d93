"""Remarks of a diagnosis on its constants: Young's modulus, the friction coefficient and the frame of the camera.

Each function returns sentences, and none where there is nothing to remark.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from prb3r.diagnosis.checks.statements import moved_in_words
from prb3r.diagnosis.confidence import INTERVAL_RISE, NORMAL_REACH
from prb3r.diagnosis.evidence.model_evidence import AT_BOUND
from prb3r.diagnosis.fit.constants import CONSTANTS_IN_WORDS, FRAME
from prb3r.diagnosis.fit.least_squares import fit
from prb3r.diagnosis.fit.model import Fit
from prb3r.markdown import listed

FRAME_COORDINATES = {
    "rotation": ("the camera's rotation", "frame_rotation_sd_rad", "rad"),
    "x": ("the camera's shift along x", "frame_position_sd_m", "m"),
    "y": ("the camera's shift along y", "frame_position_sd_m", "m"),
}
"""Coordinates of the camera's frame in words, where a recording states how exactly each is known, and its unit."""


def far_frame(fitted: Fit, taken: Sequence[str] = ()) -> list[str]:
    """Coordinates of the camera's frame that end far from zero, in standard deviations as stated, a sentence each;
    `taken`: lines of `recording.toml` that are not stated."""
    model, remarks = fitted.model, []
    for name, value, sd in zip(model.varied, fitted.p, model.priors, strict=False):
        if name not in FRAME or abs(value) <= model.settings.far_frame_sd * sd:
            continue
        text, line, unit = FRAME_COORDINATES[name]
        if not any(each.startswith(line) for each in taken):
            remarks.append(
                f"{text} ends at {value:.3g} {unit}, {abs(value) / sd:.1f} standard deviations from zero, where the "
                f"recording states {line} = {sd:g}: look at the camera's axes and origin; if they are right, the frame "
                "has taken up something of the rig, such as a bent base or plates that are bent before any load"
            )
    return remarks


def frame_of_constants_alone(refitted: Fit | None) -> list[str]:
    """A sentence on the camera's frame with constants alone, where it ends far from zero: their errors are in it.

    Parameters
    ----------
    refitted : the constants alone with all parts as drawn; None where no effect is named.
    """
    if refitted is None:
        return []
    model = refitted.model
    far = [
        f"{text} by {value:.3g} {unit} ({abs(value) / sd:.0f} standard deviations)"
        for name, value, sd in zip(model.varied, refitted.p, model.priors, strict=False)
        if name in FRAME and abs(value) > model.settings.far_frame_sd * sd
        for text, _, unit in (FRAME_COORDINATES[name],)
    ]
    if not far:
        return []
    return [
        f"constants alone come as near as is said only by moving the camera: {listed(far)}; calibrated.toml, which has "
        "no camera, is farther off"
    ]


def frame_that_was_taken(fitted: Fit, lines: Sequence[str]) -> list[str]:
    """A sentence on the frame that was fitted though the recording does not state it, with the `lines` to write; none
    without lines."""
    if not lines:
        return []
    return [
        "how exactly the camera's frame is known is not stated, and a rigid motion alone removes most of what "
        f"constants leave: it is fitted, {moved_in_words(fitted)}. Write into recording.toml, under [measurement], "
        f"{' and '.join(lines)}, as taken here, or what you know; 0 if the frame is known, since it may have taken up "
        "something of the rig, such as a bent base"
    ]


def far_constants(fitted: Fit) -> list[str]:
    """Young's modulus and friction where they end on their bounds, far from what the recording states of them, or far
    from their nominal values, a sentence each."""
    model, settings, remarks = fitted.model, fitted.model.settings, []
    for name, value, sd in zip(model.varied, fitted.p, model.priors, strict=False):
        if name in FRAME:
            continue
        text, (low, high) = CONSTANTS_IN_WORDS[name], model.widest[name]
        ended = f"ends at {np.exp(value):.3g} times the nominal one"
        bound = not low + AT_BOUND < value < high - AT_BOUND
        if not bound and abs(value) > settings.far_stated_sd * sd:
            far = abs(value) / sd
            remarks.append(f"{text} {ended}, {far:.1f} standard deviations from what the recording states of it")
        elif bound or abs(value) > np.log(settings.far_factor):
            if not excludes_nominal(fitted, name):
                loading = "" if fitted.recording.lets_go else ", as cables are only drawn in: let them out in steps too"
                untold = f"but the nominal one fits as well: this recording does not tell it{loading}"
                remarks.append(f"{text} {ended}, {untold}")
            elif bound:
                remarks.append(f"{text} {ended}, as far off as is allowed: something else is wrong")
            else:
                remarks.append(
                    f"{text} {ended}, and the nominal one does not fit: look whether it is that of this rig, or "
                    "whether something else has been taken for it"
                )
    return remarks


def end_on_bounds(fitted: Fit) -> bool:
    """Whether Young's modulus or friction ends on a bound, and its nominal value does not fit."""
    model = fitted.model
    return any(
        not model.widest[name][0] + AT_BOUND < value < model.widest[name][1] - AT_BOUND
        and excludes_nominal(fitted, name)
        for name, value in zip(model.varied, fitted.p, strict=False)
        if name not in FRAME
    )


def excludes_nominal(fitted: Fit, name: str) -> bool:
    """Whether the 95 % interval of a constant, given by the `name` of its logarithm, excludes its nominal value.

    For friction all else is refitted at the nominal coefficient, as the logarithm of a coefficient near zero is never
    told.
    """
    model = fitted.model
    number = model.varied.index(name)
    if name == "log_stiffness":
        return bool(abs(fitted.p[number]) > NORMAL_REACH * np.sqrt(fitted.covariance[number, number]))
    nominal = replace(model, varied=tuple(other for other in model.varied if other != name))
    held = fit(nominal, np.delete(fitted.p, number))
    return held is None or held.chi2 - fitted.chi2 > INTERVAL_RISE
