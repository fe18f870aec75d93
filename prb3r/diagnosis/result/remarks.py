"""What a diagnosis remarks on beside its verdict: noise, readings and weights that were not believed."""

from collections.abc import Sequence

import numpy as np

from prb3r.diagnosis.checks.outliers import Doubts, NotedWeight
from prb3r.diagnosis.checks.repeats import Scatter
from prb3r.diagnosis.fit.model import Fit
from prb3r.recording.recording import Recording


def scattered(repeated: Scatter | None) -> list[str]:
    """How much repeated sequences scatter beside what the recording states; nothing where none repeats another."""
    if repeated is None:
        return []
    taken = (
        "more than chance allows: the noise is taken to be so"
        if repeated.beyond_chance
        else "and what is stated is kept"
    )
    often = f"{repeated.factor:.2g} times as much as stated"
    return [f"what was pulled again ({repeated.steps} steps) scatters {often}, {taken}"]


CONSTANT_NAMES = {
    "log_stiffness": "Young's modulus",
    "log_friction": "the friction coefficient",
    "rotation": "the camera's rotation",
    "x": "the camera's shift along x",
    "y": "the camera's shift along y",
}


def strained(fitted: Fit) -> list[str]:
    """Constants far from what was known of them beforehand, and those at the end of what is allowed."""
    model, remarks = fitted.model, []
    for name, value, sd in zip(model.varied, fitted.p, model.priors, strict=False):
        text, far = CONSTANT_NAMES[name], abs(value) / sd
        ended = f"{np.exp(value):.3g} times the nominal one" if name.startswith("log") else f"{value:.3g}"
        if name.startswith("log") and abs(value) > model.settings.farthest - 1e-6:
            remarks.append(f"{text} ends at {ended}, as far off as is allowed: something else is wrong")
        elif far > model.settings.strained_sd:
            remarks.append(
                f"{text} ends at {ended}, {far:.0f} standard deviations from what the recording states of it"
            )
    return remarks


def refusals(refuted: Sequence[str]) -> list[str]:
    """Effects, by name, that held-out sequences refuted."""
    which = " and ".join(refuted)
    return [f"{which} fitted the training sequences but predicted those set aside worse: not kept"] if refuted else []


def wrong_weights(recording: Recording, doubted: Sequence[NotedWeight]) -> list[str]:
    """The weights of a recording that are not believed, a sentence each."""
    remarks = []
    for step, cable in doubted:
        row, name = recording.steps.iloc[step], recording.manipulator.cable_names[cable]
        noted = recording.loads.tension[step, cable]
        remarks.append(
            f"sequence {row['sequence']}, step {row['step']}: the weight on cable {name}, noted as {noted:.4g} N, does "
            "not go with its readings; it was not believed"
        )
    return remarks


def weighed(doubts: Doubts) -> list[str]:
    """How many readings were weighed down as gross outliers, if any were."""
    count = int((doubts.inflation > 1).sum())
    far, down = ("reading is", "it was") if count == 1 else ("readings are", "they were")
    return [f"{count} {far} far from what the neighbours show; {down} weighed down"] if count else []
