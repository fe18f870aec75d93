"""Numbers of a diagnosis as plain data: how well models fit the recording, and the constants, noise and tolerances that
were found."""

from typing import NamedTuple

import numpy as np

from prb3r.diagnosis.fit.constants import Constants
from prb3r.diagnosis.library.suspect import Estimate
from prb3r.model.effects.base import Effect


class FittedModel(NamedTuple):
    """A fitted model without the means to fit it again."""

    constants: Constants
    effects: tuple[Effect, ...]
    """Effects beside those of the nominal manipulator."""


class ChiSquare(NamedTuple):
    """Chi-square of models on the fitted sequences: squared whitened residuals, those of priors included but for
    `nominal`."""

    nominal: float | None
    """Per reading, of the nominal constants in the calibrated frame, without priors; None where some step has no
    equilibrium."""
    calibrated: float
    """Per degree of freedom, of refitted constants alone."""
    explained: float
    """Per degree of freedom, of the chosen model."""
    total: float
    """Plain sum, of the chosen model."""
    threshold: float
    """Limit that `total` exceeds only by chance if the chosen model is right."""


class NoiseFound(NamedTuple):
    """The noise as the recording shows it."""

    scale: float
    """Factor on the stated standard deviations of the readings."""
    scale_low: float
    """Ends of the 95 % interval of `scale`."""
    scale_high: float
    common: float
    """Share of the variance of the readings that disks of a photograph have in common."""
    reach: float
    """Disks over which that share is common, correlated as exp(-distance / reach); 1000: the whole photograph."""
    tension_scale: float
    """Factor on the stated scatter of the tensions; 1 where none is stated."""
    tension_scale_low: float
    """Ends of the 95 % interval of `tension_scale`."""
    tension_scale_high: float
    lasting: float
    """Share of the variance of the tensions that lasts through a sequence, from sequences that repeat one another."""
    serial: float
    """Share of the variance that readings of a disk have in common along a sequence, from a log by itself or from
    sequences that repeat one another."""
    span: float
    """Steps over which that share is common, correlated as exp(-distance / span)."""
    tension_open: tuple[bool, bool] = (False, False)
    """Whether the ends of the interval of `tension_scale` are those of what was considered, beyond which it goes on."""

    @property
    def record(self) -> dict[str, float]:
        """All values by name, as files have them."""
        return {name: value for name, value in self._asdict().items() if name != "tension_open"}


class SurvivingModel(NamedTuple):
    """A set of effects that the recording does not rule out."""

    probability: float
    """Posterior probability among all surviving models."""
    effects: tuple[str, ...]
    """Names of the effects, each its kind and place."""
    reduced_chi2: float
    """Chi-square per degree of freedom on the fitted sequences."""
    heldout_log_score: float | None
    """Mean log density of the whitened held-out readings, up to a constant; None where none are held out or a step has
    no equilibrium."""


class ToleranceFound(NamedTuple):
    """The probable deviation of one part of the rig from its drawing."""

    name: str
    """Name of the tolerance, such as `segment.1.length_m`."""
    value: float
    """The deviation, in the unit of the name, or relative."""
    low: float
    """Ends of the 95 % interval of `value`."""
    high: float
    prior_sd: float
    """Standard deviation before the recording."""

    def beyond(self, sd: float) -> bool:
        """Whether the deviation is more than `sd` prior standard deviations, either way."""
        return abs(self.value) > sd * self.prior_sd


class LargestScore(NamedTuple):
    """The largest z of a score test."""

    z: float
    threshold: float
    """Limit that `z` exceeds only by chance if nothing is left."""


class CalibratedConstant(NamedTuple):
    """A constant of the manipulator, in its unit."""

    nominal: float
    calibrated: float
    """Refitted without effects."""
    explained: float
    """Refitted with the effects that are named."""
    low: float
    """Ends of the 95 % interval of `explained`; NaN where the fit does not deserve one."""
    high: float
    open: tuple[bool, bool] = (False, False)
    """Whether the ends are bounds of the search, beyond which nothing was tried."""

    @property
    def estimate(self) -> Estimate:
        """`explained` with its interval, if it has one."""
        low, high = (end if np.isfinite(end) else None for end in (self.low, self.high))
        return Estimate(self.explained, low, high, self.open)

    @property
    def record(self) -> dict[str, float]:
        """All values by name, as files have them."""
        return {name: value for name, value in self._asdict().items() if name != "open"}


class CameraFrame(NamedTuple):
    """The pose of the camera: by how much measured positions are turned and shifted against those of the
    manipulator."""

    rotation_rad: float
    x_m: float
    y_m: float
