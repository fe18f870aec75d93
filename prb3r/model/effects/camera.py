"""Effects of the camera, which change what is measured and not the chain."""

from typing import Annotated, ClassVar, Literal

import numpy as np
from pydantic import Field

from prb3r.model.effects.base import Observation
from prb3r.model.files.numbers import Positive


class CameraScale(Observation):
    """Measured = scale x true, about the base origin."""

    kind: Literal["camera_scale"]
    scale: Positive

    def observe(self, points: np.ndarray, centre: np.ndarray, elapsed: np.ndarray | float) -> np.ndarray:
        return self.scale * points


class CameraAspect(Observation):
    """Measured y = `y_over_x` x true y, about the base origin, and x as it is: of pixels that are not square, or of a
    camera that does not look squarely at the plane, as far as that shortens all lengths alike. Angles are read as they
    are."""

    kind: Literal["camera_aspect"]
    y_over_x: Annotated[Positive, Field(description="Measured length along y, over that of an equal one along x.")]

    def observe(self, points: np.ndarray, centre: np.ndarray, elapsed: np.ndarray | float) -> np.ndarray:
        return points * (1.0, self.y_over_x)


class LensDistortion(Observation):
    """Measured = c + (p - c)(1 + k1 r^2), r the distance of p from the image centre c."""

    kind: Literal["lens_distortion"]
    late: ClassVar[int] = 1
    k1_per_m2: float

    def observe(self, points: np.ndarray, centre: np.ndarray, elapsed: np.ndarray | float) -> np.ndarray:
        away = points - centre
        return centre + away * (1 + self.k1_per_m2 * (away**2).sum(-1, keepdims=True))


class CameraDrift(Observation):
    """The camera, or the frame on which it is mounted, moves steadily: for every step of the table before, what is
    measured is turned by `angle_rad_per_step` about the base origin and shifted by `x_m_per_step` and `y_m_per_step`,
    before scale and distortion."""

    kind: Literal["camera_drift"]
    late: ClassVar[int] = -1
    x_m_per_step: Annotated[float, Field(description="Shift of the picture along x, m a step.")] = 0.0
    y_m_per_step: Annotated[float, Field(description="Shift of the picture along y, m a step.")] = 0.0
    angle_rad_per_step: Annotated[float, Field(description="Turn of the picture about the origin, rad a step.")] = 0.0

    def observe(self, points: np.ndarray, centre: np.ndarray, elapsed: np.ndarray | float) -> np.ndarray:
        turned, passed = self.turn(elapsed), np.asarray(elapsed)[..., None]
        cos, sin, x, y = np.cos(turned), np.sin(turned), points[..., 0], points[..., 1]
        shift = np.array([self.x_m_per_step, self.y_m_per_step])
        return np.stack([cos * x - sin * y, sin * x + cos * y], -1) + passed * shift

    def turn(self, elapsed: np.ndarray | float) -> np.ndarray | float:
        return np.asarray(elapsed) * self.angle_rad_per_step
