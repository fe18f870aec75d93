"""The camera: what is read, not what is."""

from typing import ClassVar, Literal

import numpy as np

from prb3r.model.effects.base import Observation
from prb3r.model.files.numbers import Positive


class CameraScale(Observation):
    """Measured = scale x true, about the base origin."""

    kind: Literal["camera_scale"]
    scale: Positive

    def observe(self, points: np.ndarray, centre: np.ndarray) -> np.ndarray:
        return self.scale * points


class LensDistortion(Observation):
    """Measured = c + (p - c)(1 + k1 r^2), r the distance of p from the image centre c."""

    kind: Literal["lens_distortion"]
    late: ClassVar[int] = 1
    k1_per_m2: float

    def observe(self, points: np.ndarray, centre: np.ndarray) -> np.ndarray:
        away = points - centre
        return centre + away * (1 + self.k1_per_m2 * (away**2).sum(-1, keepdims=True))
