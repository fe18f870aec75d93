"""A diagnosis judged on other recordings (`--holdout`): its errors there, what its effects are worth, and what is to be
said of each."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from prb3r.diagnosis.chance import chi2_tail
from prb3r.diagnosis.checks.heldout import HeldOut
from prb3r.diagnosis.checks.setup.remedy import with_manipulator
from prb3r.diagnosis.result.diagnosis import Diagnosis
from prb3r.diagnosis.result.effects import NamedEffect
from prb3r.diagnosis.result.rig_remarks import off_drawing
from prb3r.diagnosis.result.same_rig import same_geometry
from prb3r.diagnosis.result.transfer import Carried, on_other, supposed
from prb3r.diagnosis.settings import Settings
from prb3r.markdown import listed
from prb3r.model.manipulator import Manipulator
from prb3r.recording.recording import Recording

NOTICED = 1.05
"""How many times as far as noise allows another recording has to be missed to be told of, if that is no chance.
Choice: of many readings even the smallest share is none."""


def judged_on(diagnosis: Diagnosis, others: Sequence[Recording], filed: Manipulator) -> Diagnosis:
    """The diagnosis with its held-out errors and gains replaced by those on other recordings; as it is without any.

    Where a blunder was mended in the manipulator file `filed`, other recordings of that file are judged with it mended.
    """
    if not others:
        return diagnosis
    mended = [_mended_too(other, diagnosis, filed) for other in others]
    remarks = [text for _, text in mended if text]
    carried = [(other, on_other(diagnosis, other)) for other, _ in mended]
    for other, prediction in carried:
        remarks += [f"{other.name} does without {reason}" for reason in prediction.left_behind]
        if prediction.of_the_bench:
            remarks.append(
                f"{other.name} is taken to stand on the bench of {diagnosis.name}, mounted alike, with "
                f"{listed(prediction.of_the_bench)}: bench = false under [sharing] in its file where it does not"
            )
        remarks += [f"{other.name}: {text}" for text in supposed(prediction.effects)]
        remarks += _missed(other, prediction, diagnosis)

    def judged(effect: NamedEffect, number: int) -> NamedEffect:
        errors = [(other, error) for other, prediction in carried if (error := prediction.without[number])]
        return replace(effect, heldout_gain=pooled(errors).gain if errors else None)

    return replace(
        diagnosis,
        heldout=pooled([(other, prediction.heldout) for other, prediction in carried]),
        effects=tuple(judged(effect, number) for number, effect in enumerate(diagnosis.effects)),
        remarks=(*diagnosis.remarks, *remarks),
    )


def _missed(other: Recording, prediction: Carried, diagnosis: Diagnosis) -> list[str]:
    """A sentence on another recording that is missed by more than noise, that has no equilibrium, or whose rig has a
    part that is not as drawn; else none."""
    error, odd, noise = prediction.heldout, prediction.odd, diagnosis.noise
    lost = f", and {error.lost} of its readings have no equilibrium" if error.lost else ""
    chi2 = error.chi2_explained / max(noise.scale, noise.tension_scale, 1.0) ** 2
    size = float(np.sqrt(chi2 / error.readings)) if error.readings else np.inf
    if not lost and not is_missed(size, error.readings, diagnosis):
        told = f"{other.name} is predicted within noise and tolerances as a whole, but its"
        return [f"{told} {off_drawing(odd)}, {abs(odd.z):.1f} times what these allow: look at it"] if odd else []
    remedy = f"with its {off_drawing(odd)} it would not be: look at it" if odd and odd.suffices else ""
    return [
        f"{other.name} is missed by {size:.2g} times what noise and tolerances allow{lost}: "
        + (remedy or "what was learnt here does not predict it; diagnose it too, or both --together")
    ]


def is_missed(size: float, readings: int, diagnosis: Diagnosis) -> bool:
    """Whether an error of `size`, in units of what noise and tolerances allow, is one.

    It is if it comes by chance in fewer than `Settings.naming_rate` of recordings; where readings of the diagnosed
    recording share noise, so that they are fewer than they seem, beyond `Settings.missed_in_shared_noise`.
    """
    settings, noise = Settings(**diagnosis.settings), diagnosis.noise
    if max(noise.common, noise.lasting, noise.serial) > 0:
        return size > settings.missed_in_shared_noise
    return size > NOTICED and (not readings or chi2_tail(size**2 * readings, readings) < settings.naming_rate)


def _mended_too(other: Recording, diagnosis: Diagnosis, filed: Manipulator) -> tuple[Recording, str]:
    """Another recording with what `diagnosis` mends in the manipulator file `filed`, if it has the same file; and what
    is to be said of it, empty if nothing."""
    files, remark = {blunder.file for blunder in diagnosis.setup}, ""
    if "manipulator" in files and same_geometry(other.manipulator, filed):
        mended = other.manipulator.model_copy(update={"cable": diagnosis.nominal.cable})
        other, remark = with_manipulator(other, mended).recording, "is judged with its manipulator file mended too"
        files.discard("manipulator")
    elif same_geometry(other.manipulator, diagnosis.nominal):
        files.discard("manipulator")
    if files:
        remark = "is judged as it was recorded: whether the same blunder was made there was not looked for"
    return other, remark and f"{other.name} {remark}"


def pooled(judged: Sequence[tuple[Recording, HeldOut]]) -> HeldOut:
    """The held-out errors of several recordings as one.

    Sequences are named after their recording; mean squares are averaged by the number of readings of each.
    """
    positions = np.array([int(recording.readings.is_position.sum()) for recording, _ in judged])
    readings = np.array([recording.readings.count for recording, _ in judged])
    errors = [error for _, error in judged]

    def rms(name: str) -> float | None:
        """Root mean square, over all recordings, of the error of this name; None where no recording has it."""
        counts = positions if name.endswith("_m") else readings - positions
        values = np.array([getattr(error, name) for error in errors], float)  # None as NaN
        known = np.isfinite(values)
        return float(np.sqrt(counts[known] @ values[known] ** 2 / counts[known].sum())) if known.any() else None

    return HeldOut(
        sequences=tuple(f"{recording.name}: {name}" for recording, _ in judged for name in recording.sequences),
        rmse_calibrated_m=rms("rmse_calibrated_m"),
        rmse_explained_m=rms("rmse_explained_m"),
        noise_m=rms("noise_m"),
        rmse_calibrated_rad=rms("rmse_calibrated_rad"),
        rmse_explained_rad=rms("rmse_explained_rad"),
        noise_rad=rms("noise_rad"),
        chi2_calibrated=sum(error.chi2_calibrated for error in errors),
        chi2_explained=sum(error.chi2_explained for error in errors),
        readings=sum(error.readings for error in errors),
        lost=sum(error.lost for error in errors),
        positions=sum(error.positions for error in errors),
        felt=any(error.felt for error in errors),
    )
