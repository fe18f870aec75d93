"""The tables of a diagnosis: every reading before and after, missing moments, shapes, what would have been seen."""

from dataclasses import replace

import numpy as np
import pandas as pd

from prb3r.diagnosis.checks.heldout import Unseen
from prb3r.diagnosis.fit.model import Fit
from prb3r.diagnosis.fit.prediction import predictor
from prb3r.diagnosis.result.diagnosis import Diagnosis
from prb3r.quantities import Quantity
from prb3r.recording.recording import Kind, Readings, Recording

_EITHER = "m or rad, as kind says"
QUANTITIES = (
    Quantity("sequence", "", "", "load sequence; each starts from rest"),
    Quantity("kind", "", "", "what was read: x_m, y_m, angle_rad, or bend_rad of the plate that ends at the disk"),
    Quantity("measured", "", _EITHER, "the reading"),
    Quantity("calibrated", "", _EITHER, "prediction of the nominal physics with refitted constants"),
    Quantity("explained", "", _EITHER, "prediction with the effects that the diagnosis names"),
    Quantity("sd", "", _EITHER, "standard deviation of the reading, tension scatter included"),
    Quantity("residual_calibrated", "", "1", "what calibration leaves, in units of the noise, made independent"),
    Quantity("residual_explained", "", "1", "what the explanation leaves, in units of the noise, made independent"),
    Quantity("weighed_down", "", "1", "whether the reading is a gross outlier and was weighed down"),
    Quantity("weight_doubted", "", "1", "whether a weight of its step was not believed"),
    Quantity("held_out", "", "1", "whether its sequence was set aside before anything was fitted"),
    Quantity("moment_n_m", "M", "N m", "moment that the model misses on the plate"),
    Quantity("sd_n_m", "", "N m", "standard deviation of the missing moment"),
    Quantity("known", "", "1", "share of the prior variance that the readings took away: 0 nothing is known, 1 all"),
    Quantity("effect", "", "", "kind of effect"),
    Quantity("place", "", "", "where it would be seen best"),
    Quantity("parameter", "", "", "its first parameter; empty for an effect without degrees"),
    Quantity(
        "size", "", "as parameter says", "smallest change of the parameter that these recordings would have shown"
    ),
    Quantity("shown", "", "1", "whether the effect would have been seen"),
)


def residuals(diagnosis: Diagnosis) -> pd.DataFrame:
    """Every reading, fitted or held out, with both predictions and what they leave."""
    whole = diagnosis.recording
    of_reading = whole.of_sequence[whole.readings.step]
    fitted = np.isin(of_reading, [whole.sequences.index(name) for name in diagnosis.training.sequences])
    predict = predictor(whole)
    fits = {"calibrated": diagnosis.calibrated, "explained": diagnosis.explained}
    predicted = {name: predict(each.constants, each.effects) for name, each in fits.items()}
    white = {name: np.full(len(fitted), np.nan) for name in fits}
    sd, believed = np.full(len(fitted), np.nan), np.ones(len(fitted), bool)
    for name, each in fits.items():
        white[name][fitted] = each.residual[: fitted.sum()]
    sd[fitted], believed[fitted] = diagnosis.explained.model.noise.total_sd, diagnosis.doubts.inflation == 1
    if not fitted.all():
        aside = predictor(whole.only(set(of_reading[~fitted].tolist())))
        fresh = Unseen(aside, diagnosis.explained.model.settings)
        noise = fresh.noise(fresh.solved(diagnosis.explained))
        for name in fits:
            white[name][~fitted] = noise.whiten(aside.misfit(predicted[name][~fitted]))
        sd[~fitted], believed[~fitted] = noise.total_sd, noise.believed
    doubted = np.zeros(len(whole.of_sequence), bool)
    rows = np.flatnonzero(np.isin(whole.of_sequence, of_reading[fitted]))
    doubted[rows[[weight.step for weight in diagnosis.doubts.weights]]] = True
    return pd.DataFrame(
        {
            **_places(whole, whole.readings),
            "kind": [Kind(kind).column for kind in whole.readings.kind],
            "measured": whole.readings.value,
            **predicted,
            "sd": sd,
            **{f"residual_{name}": white[name] for name in fits},
            "weighed_down": ~believed,
            "weight_doubted": doubted[whole.readings.step],
            "held_out": ~fitted,
        }
    )


def missing_moments(diagnosis: Diagnosis) -> pd.DataFrame:
    """The missing moment of every plate at every fitted step."""
    moments, steps = diagnosis.mismatch.moments, diagnosis.training.steps
    count, plates = moments.moment.shape
    return pd.DataFrame(
        {
            "sequence": np.repeat(steps["sequence"].to_numpy(str), plates),
            "step": np.repeat(steps["step"].to_numpy(), plates),
            "plate": np.tile(np.arange(1, plates + 1), count),
            "moment_n_m": moments.moment.ravel(),
            "sd_n_m": moments.sd.ravel(),
            "known": moments.known.ravel(),
        }
    )


def shapes(diagnosis: Diagnosis, fitted: Fit) -> pd.DataFrame:
    """`sequence, step, disk, x_m, y_m, angle_rad` of all disks of all steps as the camera would see a fitted model."""
    whole = diagnosis.recording
    steps, disks = len(whole.of_sequence), whole.manipulator.plates + 1
    step, disk = np.repeat(np.arange(steps), disks), np.tile(np.arange(disks), steps)
    kinds = (Kind.X, Kind.Y, Kind.ANGLE)
    readings = [Readings(step, disk, np.full(len(step), kind), np.zeros(len(step))) for kind in kinds]
    seen = [predictor(replace(whole, readings=each))(fitted.constants, fitted.effects) for each in readings]
    return pd.DataFrame(_places(whole, readings[0]) | {k.column: v for k, v in zip(kinds, seen, strict=True)})


def detectable(diagnosis: Diagnosis) -> pd.DataFrame:
    """The smallest effect of each kind that these recordings would have shown, where they would have shown it best.

    A size beyond what a fit of the effect would allow is none: the effect would not have been seen.
    """
    rows = []
    for each in diagnosis.detectable:
        place = each.hypothesis.name.removeprefix(each.hypothesis.kind).strip(" ()")
        row = {"effect": each.hypothesis.kind, "place": place, "parameter": "", "size": np.nan, "shown": each.shown}
        if each.size is not None:
            free = each.hypothesis.free[0]
            within = each.size < 0.999 * max(free.high - free.null, free.null - free.low)
            row |= {"parameter": free.name, "size": each.size if within else np.nan, "shown": each.shown and within}
        rows.append(row)
    return pd.DataFrame(rows, columns=["effect", "place", "parameter", "size", "shown"])


def _places(recording: Recording, readings: Readings) -> dict[str, np.ndarray]:
    steps = recording.steps.iloc[readings.step]
    return {"sequence": steps["sequence"].to_numpy(str), "step": steps["step"].to_numpy(), "disk": readings.disk}
