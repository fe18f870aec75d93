"""What is alike, or nearly so, under another name: one segment softer than stated, or the others stiffer with a lower
Young's modulus; plates that soften beyond a knee, or whose material follows a plateau.

A search that adds and exchanges one effect at a time stays on the side that it found first, since every other constant
and effect has settled there; which side a rig is on decides what another design does.
"""

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from prb3r.diagnosis.fit.least_squares import fit
from prb3r.diagnosis.fit.model import Fit
from prb3r.diagnosis.library.hypothesis import Hypothesis
from prb3r.model.effects.plates import NonlinearPlate

OF_SEGMENTS, OF_PLATEAUS = "segment_stiffness", "superelastic_plate"


def of_other_segments(fitted: Fit, library: Sequence[Hypothesis]) -> Iterator[Fit]:
    """The fitted model with the stiffness of another segment in the place of one, Young's modulus making up for it."""
    model = fitted.model
    if "log_stiffness" not in model.varied:
        return
    present, shares = model.hypotheses, model.shares(fitted.p)
    number = model.varied.index("log_stiffness")
    others = [suspected for suspected in library if suspected.kind == OF_SEGMENTS and suspected not in present]
    for k, replaced in enumerate(present):
        for other in others if replaced.kind == OF_SEGMENTS else ():
            twin = replace(model, hypotheses=(*present[:k], other, *present[k + 1 :]))
            constants = fitted.p[: len(model.varied)].copy()
            constants[number] += shares[k][0]  # the logarithm of a factor, as the constant is
            start = np.concatenate([constants, *shares[:k], -shares[k], *shares[k + 1 :]])
            if (ended := fit(twin, np.clip(start, *twin.bounds(start)))) is not None:
                yield ended


def of_plateaus(fitted: Fit, library: Sequence[Hypothesis]) -> Iterator[Fit]:
    """The fitted model with plates that follow a plateau in the place of plates that soften beyond a knee in strain."""
    model = fitted.model
    present, shares, constants = model.hypotheses, model.shares(fitted.p), fitted.p[: len(model.varied)]
    plateau = next((suspected for suspected in library if suspected.kind == OF_PLATEAUS), None)
    for k, effect in enumerate(fitted.effects):
        if plateau is None or not isinstance(effect, NonlinearPlate) or effect.knee_strain is None:
            continue
        if (effect.ratio or 1.0) >= 1:
            continue
        start = np.zeros(len(plateau.free))
        start[0] = plateau.free[0].at(effect.knee_strain / model.settings.knee_of_plateau)
        twin = replace(model, hypotheses=(*present[:k], plateau, *present[k + 1 :]))
        whole = np.concatenate([constants, *shares[:k], start, *shares[k + 1 :]])
        if (ended := fit(twin, np.clip(whole, *twin.bounds(whole)))) is not None:
            yield ended
