"""The camera: what is read, not what is."""

from collections.abc import Iterator

import numpy as np

from prb3r.proof.rig.draft import Draft
from prb3r.proof.rig.effects.candidate import Candidate, Conditions
from prb3r.proof.rig.effects.record import POSITIVE, Record, Scale, size


def _scale(draft: Draft, scale):
    draft.scale *= scale


def _scaled(given: Conditions) -> Iterator[Candidate]:
    if given.positions:
        # a calibration board held 15 % too near or too far
        yield Candidate((), lambda u: {"scale": float(np.exp(u))}, -0.15, 0.15)


def _distort(draft: Draft, k1_per_m2):
    draft.lens += k1_per_m2


def _distorted(given: Conditions) -> Iterator[Candidate]:
    if given.positions:
        # at the ends of the arm, half a length off the centre, 15 % of the radius: a wide-angle lens
        yield Candidate((), lambda u: {"k1_per_m2": u / given.length**2}, -0.6, 0.6)


CAMERA_RECORDS = (
    Record("camera_scale", _scale, (size("scale", POSITIVE, Scale.LOGARITHM),), _scaled, turn=15),
    Record("lens_distortion", _distort, (size("k1_per_m2"),), _distorted, turn=16),
)
