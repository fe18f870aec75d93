"""What a recording states of Young's modulus, friction, markers and the camera's frame, where the readings contradict
it."""

from collections.abc import Collection, Mapping
from dataclasses import replace

import numpy as np
from scipy.special import expit, logit, logsumexp

from prb3r.diagnosis.checks.frame import with_frame
from prb3r.diagnosis.checks.tolerated import tolerances_told
from prb3r.diagnosis.evidence.model_evidence import log_evidence
from prb3r.diagnosis.evidence.outliers import Doubts
from prb3r.diagnosis.fit.constants import CONSTANTS_IN_WORDS
from prb3r.diagnosis.fit.least_squares import fit
from prb3r.diagnosis.fit.model import Fit, normal_matrix
from prb3r.diagnosis.fit.prediction import predictor
from prb3r.diagnosis.fit.tolerance import IN_M, IN_RAD, MARKER, EstimatedTolerances
from prb3r.diagnosis.search.pool import Survivor
from prb3r.diagnosis.search.selection import Choice
from prb3r.diagnosis.settings import Settings
from prb3r.model.files.cells import count
from prb3r.recording.recording import Prior, Recording, Tolerance

STATED = {"log_stiffness": "youngs_modulus", "log_friction": "friction_coefficient"}
"""The fields of `[prior]` by the name of the constant that they state."""
STIFFER = "whether clamps take up length of the plates or the cables themselves resist bending"
SOFTER = "whether the clamps give way"
"""What to look at besides where the arm is stiffer, or softer, than what is stated."""


def contradicted(calibrated: Fit) -> list[str]:
    """The fields of `[prior]` from which a fit of constants alone is away by more than `Settings.far_stated_sd` stated
    standard deviations, if they state more than handbooks do."""
    model, fields = calibrated.model, list[str]()
    known = handbook_sd(model.settings)
    for name, value, sd in zip(model.varied, calibrated.p, model.deviations, strict=True):
        if name in STATED and sd < known[STATED[name]] and abs(value) > model.settings.far_stated_sd * sd:
            fields.append(STATED[name])
    return fields


def handbook_sd(settings: Settings) -> dict[str, float]:
    """What handbooks tell of each field of `[prior]`: standard deviation of the ln of the constant."""
    return {"youngs_modulus": settings.modulus_sd, "friction_coefficient": settings.friction_sd}


def stated_otherwise(
    recording: Recording, fields: Collection[str], frame: Mapping[str, float], settings: Settings
) -> Recording:
    """The recording with handbook knowledge in the place of what these `fields` of its `[prior]` state, and with these
    standard deviations of the `frame`."""
    known = handbook_sd(settings)
    prior = recording.prior.model_dump() | {field: known[field] for field in fields}
    return with_frame(replace(recording, prior=Prior(**prior)), frame)


def constants_stated_otherwise(choice: Choice, fields: Collection[str], frame: Mapping[str, float]) -> Survivor | None:
    """The constants alone, if what these `fields` and the lines of the `frame` state is wrong, as one more model beside
    the surviving ones of a choice, with its probability among these; None where they cannot be fitted.

    That a statement is wrong has the prior probability `Settings.misstated`; the lines of the frame are one statement.
    A coordinate of the frame that the others have at zero counts as a parameter of an effect does.
    """
    model, settings = choice.calibrated.model, choice.calibrated.model.settings
    wide = predictor(stated_otherwise(model.recording, fields, frame, settings), settings)
    freer = replace(model, predict=wide, noise=choice.fitted.model.noise, varied=())
    fitted = fit(freer, np.array([getattr(choice.calibrated.constants, name) for name in freer.varied]))
    if fitted is None:
        return None
    stated = dict(zip(model.varied, model.priors, strict=True))
    taken = dict(zip(freer.varied, freer.priors, strict=True))
    more = np.array([name not in stated for name in freer.varied])
    normal = normal_matrix(fitted)
    narrower = (np.linalg.slogdet(normal[np.ix_(~more, ~more)])[1] - np.linalg.slogdet(normal)[1]) / 2
    for name, sd in taken.items():
        if sd != stated.get(name):
            narrower += np.log(stated.get(name, 1.0) / sd)
    odds = (len(fields) + bool(frame)) * logit(settings.misstated)
    worth = log_evidence(fitted, {}) + float(narrower + odds)
    others = np.array([survivor.log_evidence for survivor in choice.survivors])
    return Survivor(fitted, worth, float(expit(worth - logsumexp(others))))


def with_turned_markers(calibrated: Fit, doubts: Doubts) -> Tolerance | None:
    """The tolerances of a recording with a wider one of the angles of markers, if under a fit of constants alone
    several of these are turned far beyond the stated one; else None.

    None too where positions are not read: rest curvature of the plates turns the disks alike.
    """
    recording, settings = calibrated.recording, calibrated.model.settings
    few = len(_far_markers(calibrated, doubts, IN_RAD)) < settings.fewest_turned
    if few or not recording.readings.is_position.any():
        return None
    wide = settings.wider_marker * recording.tolerance.marker_turn
    return recording.tolerance.model_copy(update={"marker_rad": wide})


def with_shifted_markers(fitted: Fit, doubts: Doubts) -> Tolerance | None:
    """The tolerances of a recording with a wider one of the places of markers, if under a fit with effects some marker
    sits off by far more than the stated one; else None."""
    recording = fitted.recording
    if not fitted.effects or not _far_markers(fitted, doubts, IN_M):
        return None
    wide = fitted.model.settings.wider_marker * recording.tolerance.marker(recording.manipulator.segment)
    return recording.tolerance.model_copy(update={"marker_m": wide, "marker_rad": recording.tolerance.marker_turn})


def _far_markers(fitted: Fit, doubts: Doubts, unit: str) -> set[str]:
    """The numbers of the disks whose markers are far beyond their tolerance, of angles (`IN_RAD`) or places (`IN_M`),
    under a fit."""
    settings, told = fitted.model.settings, tolerances_told(fitted, doubts)
    far = np.abs(told.value) > settings.far_stated_sd * told.prior_sd
    return {disk for disk, name in _of_markers(told, unit) if far[told.names.index(name)]}


def _of_markers(told: EstimatedTolerances, unit: str) -> list[tuple[str, str]]:
    """The number of the disk, and the name, of each tolerance of a marker in a unit."""
    return [(name.split()[1], name) for name in told.names if name.startswith(MARKER) and name.endswith(unit)]


def _usually_off(fitted: Fit, doubts: Doubts, unit: str) -> float:
    """By how much markers are off under a fit, m or rad: root mean square over the markers."""
    told = tolerances_told(fitted, doubts)
    names = _of_markers(told, unit)
    squares = sum(told.value[told.names.index(name)] ** 2 for _, name in names)
    return float(np.sqrt(squares / len({disk for disk, _ in names})))


def shifted_markers(recording: Recording, before: Choice, freed: Choice) -> str:
    """A remark that markers sit off their places on their disks by more than is stated.

    Parameters
    ----------
    recording : as it was recorded.
    before, freed : the choice with what is stated, and with a wide tolerance of these places.
    """
    lengths = _usually_off(freed.fitted, freed.doubts, IN_M), recording.tolerance.marker(recording.manipulator.segment)
    size, stated = (f"{1e3 * length:.2g} mm" for length in lengths)
    fewer, more = len(freed.effects), len(before.effects)
    return (
        f"markers sit off their places on their disks by some {size}, where {stated} were allowed for, and with that "
        f"{count(fewer, 'effect')} in the place of {more} {'explains' if fewer == 1 else 'explain'} the readings "
        "better: measure where they sit, and state marker_m under [tolerance]"
    )


def turned_markers(recording: Recording, freed: Fit, doubts: Doubts) -> str:
    """A remark that markers are turned on their disks by more than is stated.

    Parameters
    ----------
    recording : as it was recorded.
    freed : the fit of constants alone with a wide tolerance of these angles.
    """
    angles = _usually_off(freed, doubts, IN_RAD), recording.tolerance.marker_turn
    size, stated = (f"{180 / np.pi * angle:.2g} degrees" for angle in angles)
    return (
        f"markers are turned on their disks by some {size}, where {stated} were allowed for, and constants alone "
        "explain the readings with that: look at the markers, and state marker_rad under [tolerance]"
    )


def may_be_misstated(
    recording: Recording, fields: Collection[str], frame: Mapping[str, float], freed: Survivor
) -> list[str]:
    """A remark on each of the `fields` of `[prior]`, and one on the lines of the `frame`, that the readings contradict.

    Parameters
    ----------
    recording : as it was recorded.
    freed : the constants alone without these statements (:func:`constants_stated_otherwise`).
    """
    remarks, fitted = [], freed.fitted
    wrong = f"it is wrong with a probability of {freed.probability:.2f}"
    for name, field in STATED.items():
        if field not in fields:
            continue
        stated, value = getattr(recording.prior, field), fitted.p[fitted.model.varied.index(name)]
        text = CONSTANTS_IN_WORDS[name]
        checked = f"{text} in the manipulator file"
        if field == "youngs_modulus":
            checked += f", the thickness of the plates, the unit of the weights, and {STIFFER if value > 0 else SOFTER}"
        remarks.append(
            f"what [prior] states of {text} (within {100 * stated:.2g} %) is {abs(value) / stated:.2g} "
            "standard deviations from what the readings say if nothing else is at work, and if it is wrong, constants "
            f"alone explain them: {wrong}; check {checked}"
        )
    if frame:
        lines = [f"{line} = {getattr(recording.measurement, line):g}" for line in frame]
        remarks.append(
            f"what recording.toml states of the camera's frame ({' and '.join(lines)}) is far from what the readings "
            f"say if nothing else is at work: {moved_in_words(fitted)} and constants alone explain them; {wrong}; "
            "check the camera's axes and origin, and state how exactly they are known"
        )
    return remarks


def moved_in_words(fitted: Fit) -> str:
    """Where the camera's frame of a fit stands, in words: a turn and, where positions are read, a shift."""
    frame = fitted.constants
    moved = f"a turn by {frame.rotation:.2g} rad"
    if "x" in fitted.model.varied:
        moved += f" and a shift by {1e3 * frame.x:.2g} mm along x and {1e3 * frame.y:.2g} mm along y"
    return moved
