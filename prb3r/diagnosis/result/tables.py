"""The tables of a diagnosis: readings with predictions and residuals, missing moments, shapes, loads, a ranking of
effects, and the smallest effects that would have been detected."""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
import pandas as pd

from prb3r.diagnosis.evidence.detectable import detectable
from prb3r.diagnosis.evidence.missing_moments import mechanism, missing_moments
from prb3r.diagnosis.evidence.outliers import far_off
from prb3r.diagnosis.fit.model import Fit
from prb3r.diagnosis.fit.prediction import predictor
from prb3r.diagnosis.library.hypothesis import Hypothesis
from prb3r.diagnosis.result.investigation import Investigation
from prb3r.mechanics.equilibrium import Equilibria
from prb3r.quantities import Quantity
from prb3r.recording.recording import Kind, Readings, Recording

WITHIN_BOUNDS = 0.999
"""Share of the distance to a bound below which a detectable size counts as inside: a size at the bound was cut off
there."""

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
    Quantity("weighed_down", "", "1", "whether the reading is a gross outlier and was down-weighted"),
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
"""Columns of the written tables, with their symbols, units and meanings."""


def diagnosis_tables(investigation: Investigation) -> dict[str, pd.DataFrame]:
    """All tables by name; the whole recording is solved once with each model."""
    models = {"calibrated": investigation.refitted, "explained": investigation.reported}
    states = {name: _solved(investigation.recording, fitted) for name, fitted in models.items()}
    readings = residual_table(investigation, models, states)
    fitted = readings[~readings["held_out"]]
    return {
        "residuals": readings,
        "mismatch": moment_table(investigation),
        "detectable": detectable_table(investigation),
        "ranking": ranking_table(investigation),
        "shapes": shape_table(investigation.recording, models, states),
        "loads": load_table(investigation.recording),
        "outliers": fitted.iloc[far_off(investigation.explained, investigation.doubts)],
    }


def _solved(recording: Recording, fitted: Fit) -> Equilibria:
    """Equilibria of all steps of a recording under a fitted model, held-out sequences included."""
    return predictor(recording).equilibria(fitted.constants, fitted.effects)


def residual_table(
    investigation: Investigation, models: Mapping[str, Fit], states: Mapping[str, Equilibria]
) -> pd.DataFrame:
    """Every reading, fitted or held out, with the predictions of `models` and their whitened residuals.

    `states` are the equilibria of the whole recording by model.
    """
    whole, training, fresh = investigation.recording, investigation.training, investigation.fresh
    predict = predictor(whole)
    predicted = {name: predict.read(states[name], fitted.constants, fitted.effects) for name, fitted in models.items()}
    of_reading = whole.of_sequence[whole.readings.step]
    seen = np.isin(of_reading, [whole.sequences.index(name) for name in training.sequences])
    sd, believed = np.full(len(seen), np.nan), np.ones(len(seen), bool)
    white = {name: np.full(len(seen), np.nan) for name in models}
    for name, fitted in models.items():
        white[name][seen] = fitted.residual[: seen.sum()]
    sd[seen], believed[seen] = investigation.explained.model.noise.total_sd, investigation.doubts.inflation == 1
    if fresh is not None:
        noise = fresh.noise(investigation.reported)
        for name in models:
            misfit = fresh.predict.misfit(predicted[name][~seen])
            white[name][~seen] = np.where(np.isnan(misfit), np.nan, noise.whiten(np.nan_to_num(misfit)))
        sd[~seen], believed[~seen] = noise.total_sd, noise.believed
    return pd.DataFrame(
        {
            **_places(whole, whole.readings),
            "kind": [Kind(kind).column for kind in whole.readings.kind],
            "measured": whole.readings.value,
            **predicted,
            "sd": sd,
            **{f"residual_{name}": white[name] for name in models},
            "weighed_down": ~believed,
            "weight_doubted": np.isin(whole.readings.step, investigation.doubted_steps),
            "held_out": ~seen,
        }
    )


def moment_table(investigation: Investigation) -> pd.DataFrame:
    """The missing moment of every plate at every fitted step, with its standard deviation, N m."""
    _, fitted = investigation.unmet
    moments, steps = missing_moments(fitted, mechanism(fitted)), investigation.training.steps
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


def shape_table(recording: Recording, models: Mapping[str, Fit], states: Mapping[str, Equilibria]) -> pd.DataFrame:
    """`model, sequence, step, disk, x_m, y_m, angle_rad` of all disks at all steps, as the camera would see them."""
    steps, disks = len(recording.of_sequence), recording.manipulator.plates + 1
    kinds = (Kind.X, Kind.Y, Kind.ANGLE)
    kind = np.repeat(kinds, steps * disks)
    step = np.tile(np.repeat(np.arange(steps), disks), len(kinds))
    everything = Readings(step, np.tile(np.arange(disks), steps * len(kinds)), kind, np.zeros(len(kind)))
    predict = predictor(replace(recording, readings=everything))
    place = _places(recording, everything.where(kind == Kind.X))
    parts = []
    for name, fitted in models.items():
        seen = predict.read(states[name], fitted.constants, fitted.effects)
        parts.append(pd.DataFrame({"model": name, **place} | {k.column: seen[kind == k] for k in kinds}))
    return pd.concat(parts, ignore_index=True)


def load_table(recording: Recording) -> pd.DataFrame:
    """`sequence, step` and the applied tension of every cable, `cable_<name>_n`."""
    tension = {
        f"cable_{name}_n": recording.loads.tension[:, cable]
        for cable, name in enumerate(recording.manipulator.cable_names)
    }
    return recording.steps[["sequence", "step"]].assign(**tension)


def ranking_table(investigation: Investigation) -> pd.DataFrame:
    """The place of each kind of effect with the largest score on what calibration leaves, the largest score first.

    `effect, place, z, role`, where the role is `named`, `rival` or `other`, and `winner`: the named kind that a rival
    cannot be told from, else empty.
    """
    best: dict[str, tuple[float, Hypothesis]] = {}
    for z, alternative in zip(investigation.before.z, investigation.before.alternatives, strict=True):
        subject = alternative.subject
        if isinstance(subject, Hypothesis) and alternative.freedom and z > best.get(subject.kind, (-1.0,))[0]:
            best[subject.kind] = float(z), subject
    named = {effect.hypothesis.kind for effect in investigation.named}
    winner = {
        rival.hypothesis.kind: effect.hypothesis.kind for effect in investigation.named for rival in effect.rivals
    }
    rows = []
    for kind, (z, subject) in sorted(best.items(), key=lambda item: -item[1][0]):
        role = "named" if kind in named else "rival" if kind in winner else "other"
        rows.append((kind, _place(subject), z, role, winner[kind] if role == "rival" else ""))
    return pd.DataFrame(rows, columns=["effect", "place", "z", "role", "winner"])


def detectable_table(investigation: Investigation) -> pd.DataFrame:
    """The smallest effect of each kind that the recording would have shown, at the place where it would have shown it
    best.

    A size beyond the bounds of a fit is left empty, as such an effect would not have been seen.
    """
    rows = []
    for smallest in detectable(investigation.choice.scores, investigation.explained.model.settings):
        hypothesis, size, free, shown = smallest.hypothesis, smallest.size, smallest.free, smallest.shown
        row = {"effect": hypothesis.kind, "place": _place(hypothesis), "parameter": "", "size": np.nan, "shown": shown}
        if size is not None and free is not None:
            within = size < WITHIN_BOUNDS * max(free.high - free.null, free.null - free.low)
            row |= {"parameter": free.name, "size": size if within else np.nan, "shown": shown and within}
        rows.append(row)
    return pd.DataFrame(rows, columns=["effect", "place", "parameter", "size", "shown"])


def _place(hypothesis: Hypothesis) -> str:
    """The place of a hypothesis as text, without the kind: `plate 4` of `weakened_plate (plate 4)`."""
    return hypothesis.name.removeprefix(hypothesis.kind).strip(" ()")


def _places(recording: Recording, readings: Readings) -> dict[str, np.ndarray]:
    """Columns `sequence`, `step` and `disk` of the readings, (r,) each."""
    steps = recording.steps.iloc[readings.step]
    return {"sequence": steps["sequence"].to_numpy(str), "step": steps["step"].to_numpy(), "disk": readings.disk}
