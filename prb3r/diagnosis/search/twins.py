"""What constants make alike: one segment softer than stated, or the others stiffer with a lower Young's modulus.

A search that adds and exchanges one effect at a time stays on the side that it found first, since every other constant
and effect has settled there; which side a rig is on decides what another design does.
"""

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from prb3r.diagnosis.fit.least_squares import fit
from prb3r.diagnosis.fit.model import Fit
from prb3r.diagnosis.library.hypothesis import Hypothesis

OF_SEGMENTS = "segment_stiffness"


def of_other_segments(fitted: Fit, library: Sequence[Hypothesis]) -> Iterator[Fit]:
    """The fitted model with the stiffness of another segment in the place of one, Young's modulus making up for it."""
    model = fitted.model
    if "log_stiffness" not in model.varied:
        return
    present, shares = model.hypotheses, model.shares(fitted.p)
    number = model.varied.index("log_stiffness")
    others = [each for each in library if each.kind == OF_SEGMENTS and each not in present]
    for k, own in enumerate(present):
        for other in others if own.kind == OF_SEGMENTS else ():
            twin = replace(model, hypotheses=(*present[:k], other, *present[k + 1 :]))
            constants = fitted.p[: len(model.varied)].copy()
            constants[number] += shares[k][0]  # the logarithm of a factor, as the constant is
            start = np.concatenate([constants, *shares[:k], -shares[k], *shares[k + 1 :]])
            if (found := fit(twin, np.clip(start, *twin.bounds(start)))) is not None:
                yield found
