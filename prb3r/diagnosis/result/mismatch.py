"""Where the model misses, and on what that depends."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from prb3r.diagnosis.evidence.missing_moments import Mechanism, MomentMap, mechanism, missing_moments
from prb3r.diagnosis.evidence.score_test import Scores
from prb3r.diagnosis.fit.model import Fit
from prb3r.diagnosis.library.hypothesis import Hypothesis
from prb3r.diagnosis.result.named import Named
from prb3r.diagnosis.search.selection import Choice


@dataclass(frozen=True, eq=False)
class Mismatch:
    """Where the calibrated model misses, and what that depends on."""

    plates: tuple[int, ...]
    sequences: tuple[str, ...]
    depends_on: tuple[str, ...]
    statement: str
    moments: MomentMap
    mechanics: Mechanism


def mismatch(calibrated: Fit, choice: Choice, before: Scores, named: Sequence[Named]) -> Mismatch:
    """Where and on what: of what calibration leaves, or of what the best model leaves where that is structured."""
    judged, fitted = (choice.scores, choice.fitted) if choice.structured else (before, calibrated)
    mechanics = mechanism(fitted)
    moments = missing_moments(fitted, mechanics)
    strong = [
        (float(z), d.subject)
        for z, d in zip(judged.z, judged.alternatives, strict=True)
        if not isinstance(d.subject, Hypothesis) and z > judged.threshold
    ]
    strong.sort(key=lambda pair: -pair[0])
    top = [law for z, law in strong if z > fitted.model.settings.near_largest * strong[0][0]]
    if top and top[0].plate is None:  # a law of the whole arm is felt on single plates too
        top = [law for law in top if law.plate is None]
    depends = tuple(dict.fromkeys({"bend_cubed": "bend", "constant": "position"}.get(law.of, law.of) for law in top))
    plates = [law.plate for law in top if law.plate]
    plates += [p for n in named for key, (_, among) in n.places.items() if key in ("plate",) for p in among]
    count = fitted.model.predict.recording.readings.count
    recording = fitted.model.predict.recording
    of_reading = recording.of_sequence[recording.readings.step]
    squared = np.array(
        [np.mean(fitted.residual[:count][of_reading == k] ** 2) for k in range(len(recording.sequences))]
    )
    rows = np.bincount(of_reading, minlength=len(squared))
    loud = squared > 1 + fitted.model.settings.loud_sd * np.sqrt(2 / np.maximum(rows, 1))
    sequences = tuple(name for name, on in zip(recording.sequences, loud, strict=True) if on)
    if not strong and not named and not choice.structured:
        statement = "Nothing is left that chance does not explain."
    else:
        where = f"at {', '.join(dict.fromkeys(law.place for law in top[:4]))}" if top else "at no single place"
        on = " and ".join(depends[:3]) or "nothing that was tried"
        what = "What is left after the best explanation" if choice.structured and named else "What calibration leaves"
        statement = f"{what} sits {where} and goes with {on}."
        if sequences and len(sequences) < len(recording.sequences):
            statement += f" It is seen in {', '.join(sequences)}."
    return Mismatch(tuple(sorted(set(plates))), sequences, depends, statement, moments, mechanics)
