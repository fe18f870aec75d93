"""Where a model misses the readings, and what the mismatch depends on."""

import numpy as np

from prb3r.diagnosis.evidence.missing_moments import WHOLE
from prb3r.diagnosis.library.hypothesis import Hypothesis
from prb3r.diagnosis.result.effects import Mismatch
from prb3r.diagnosis.result.investigation import Investigation
from prb3r.markdown import few, listed
from prb3r.recording.recording import Recording

GOES_WITH = {
    "bend": "the bend of the plates",
    "tension": "the tensions",
    "wrap": "the tensions times how far the cables are wrapped",
    "direction": "the direction in which the cables slip",
    "position": "the place along the arm",
    "time": "the order in time",
    "sequence": "the sequence",
    "frame": "where the camera stands",
}
"""Quantities that a mismatch may depend on, in words."""


def mismatch_of(investigation: Investigation) -> Mismatch:
    """Where the mismatch sits and what it depends on: what calibration leaves, or what the chosen model leaves where
    that is structured beyond the stated accuracy.

    Laws of missing moments count whose score is near the largest one.  Where nothing is left there is none, although
    the test under the stated noise may have shown one.
    """
    scores, fitted = investigation.unmet
    settings, structured = fitted.model.settings, investigation.choice.beyond_stated
    nothing = "Nothing is left that chance does not explain."
    if investigation.why:
        nothing = "What is left in the sequences that were fitted is no larger than chance leaves."
    if not (investigation.named or investigation.choice.structured or investigation.why):
        return Mismatch((), (), (), nothing)
    strong = [
        (float(z), direction.subject)
        for z, direction in zip(scores.z, scores.alternatives, strict=True)
        if not isinstance(direction.subject, Hypothesis) and z > scores.threshold
    ]
    strong.sort(key=lambda pair: -pair[0])
    top = [law for z, law in strong if z > settings.near_largest * strong[0][0]]
    if top and top[0].plate is None:  # a law of the whole arm is felt on single plates too
        top = [law for law in top if law.plate is None]
    depends = tuple(dict.fromkeys({"bend_cubed": "bend", "constant": "position"}.get(law.of, law.of) for law in top))
    plates = {law.plate for law in top if law.plate}
    for named in investigation.named:
        plates |= set(named.places["plate"][1]) if "plate" in named.places else set()
    recording = fitted.recording
    sequences = loud_sequences(recording, fitted.misfit, settings.loud_sd)
    if not (strong or investigation.named or investigation.choice.structured):
        statement = nothing
    else:
        places = dict.fromkeys(_place_in_words(law.place) for law in top[: settings.most_places_said])
        where = ", ".join(places) if places else "at no single place"
        said = depends[: settings.most_quantities_said]
        on = listed([GOES_WITH.get(of, of) for of in said] or ["nothing that was tried"])
        explained = structured and investigation.named
        left = "What is left after the best explanation" if explained else "What refitted constants leave"
        statement = f"{left} sits {where}, and goes with {on}."
        if not places and not said:
            statement = f"{left} is more than noise; no single plate and no pattern along the arm stands out."
        if not top and structured and investigation.choice.smooth:
            statement = f"{left} changes smoothly with the loads and along the arm, as noise does not."
        told = any(law.place.startswith("sequence ") for law in top)
        if sequences and not told and len(sequences) < len(recording.sequences):
            statement += f" It is seen in sequence{'s' * (len(sequences) > 1)} {few(sequences, len(sequences))}."
    return Mismatch(tuple(sorted(plates)), sequences, depends, statement)


def _place_in_words(place: str) -> str:
    """The place of a law as part of a sentence, such as `at plate 4` or `over the whole arm`."""
    if place.startswith("sequence "):
        return f"in sequence {few([place.removeprefix('sequence ')])}"
    return f"{'over' if place == WHOLE else 'at'} {place}"


def loud_sequences(recording: Recording, residual: np.ndarray, sd: float) -> tuple[str, ...]:
    """Names of the sequences whose mean squared residual exceeds 1 by more than `sd` standard deviations of the mean
    square of independent standard normal residuals (r,)."""
    of_reading = recording.of_sequence[recording.readings.step]
    rows = np.maximum(np.bincount(of_reading, minlength=len(recording.sequences)), 1)  # some may have no readings
    squared = np.bincount(of_reading, residual**2, minlength=len(recording.sequences)) / rows
    loud = squared > 1 + sd * np.sqrt(2 / rows)
    return tuple(name for name, beyond in zip(recording.sequences, loud, strict=True) if beyond)
