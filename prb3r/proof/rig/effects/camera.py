"""Effects of the camera: they change the readings and not the arm."""

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


def _stretch(draft: Draft, y_over_x):
    draft.aspect *= y_over_x


def _stretched(given: Conditions) -> Iterator[Candidate]:
    if given.positions:
        # seen from 30 degrees off the normal, a seventh shorter
        yield Candidate((), lambda u: {"y_over_x": float(np.exp(u))}, -0.14, 0.14)


def _distort(draft: Draft, k1_per_m2):
    draft.lens += k1_per_m2


def _distorted(given: Conditions) -> Iterator[Candidate]:
    if given.positions:
        # at the ends of the arm, half a length off the centre, 15 % of the radius: a wide-angle lens
        yield Candidate((), lambda u: {"k1_per_m2": u / given.length**2}, -0.6, 0.6)


def _move_on(draft: Draft, x_m_per_step=0.0, y_m_per_step=0.0, angle_rad_per_step=0.0):
    draft.camera_shift += [x_m_per_step, y_m_per_step]
    draft.camera_turn += angle_rad_per_step


def _moving_on(given: Conditions) -> Iterator[Candidate]:
    if given.positions:  # in the end by a fiftieth of the length, in an oblique direction
        step = given.length / given.steps
        yield Candidate((), lambda u: {"x_m_per_step": 0.8 * u * step, "y_m_per_step": 0.6 * u * step}, -0.02, 0.02)


CAMERA_RECORDS = (
    Record("camera_scale", _scale, (size("scale", POSITIVE, Scale.LOGARITHM),), _scaled, turn=15),
    Record("camera_aspect", _stretch, (size("y_over_x", POSITIVE, Scale.LOGARITHM),), _stretched, rare=True),
    Record("lens_distortion", _distort, (size("k1_per_m2"),), _distorted, turn=16),
    Record(
        "camera_drift",
        _move_on,
        tuple(size(f"{name}_per_step", optional=True) for name in ("x_m", "y_m", "angle_rad")),
        _moving_on,
        rare=True,
    ),
)
