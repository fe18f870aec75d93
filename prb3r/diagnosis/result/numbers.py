"""How well models fit a recording, and what was found of constants, noise and tolerances: numbers made once."""

from typing import NamedTuple

from prb3r.diagnosis.fit.constants import Constants
from prb3r.model.effects.base import Effect


class FittedModel(NamedTuple):
    """A fitted model without the means to fit it again."""

    constants: Constants
    effects: tuple[Effect, ...]
    """Beside those of the nominal manipulator."""


class ChiSquare(NamedTuple):
    """Squared whitened residuals of the fitted sequences, priors included."""

    nominal: float | None
    """Per degree of freedom, of the nominal constants in the calibrated frame; None where they have no equilibrium."""
    calibrated: float
    """Per degree of freedom."""
    explained: float
    """Per degree of freedom."""
    total: float
    """Of the explanation, their plain sum."""
    threshold: float
    """What the sum exceeds only by chance if the explanation is right."""


class NoiseFound(NamedTuple):
    """The noise as the recording shows it."""

    scale: float
    """Factor on the stated standard deviations of the readings."""
    scale_low: float
    """Ends of its 95 % interval."""
    scale_high: float
    common: float
    """Share of the variance that disks of a photograph have in common."""
    reach: float
    """Disks over which they do; 1000: the whole photograph."""
    tension_scale: float
    """Factor on the stated scatter of the tensions; 1 where none is stated."""
    tension_scale_low: float
    """Ends of its 95 % interval."""
    tension_scale_high: float
    lasting: float
    """Share of the variance of the tensions that lasts through a sequence, as what was pulled again tells."""
    serial: float
    """Share of the variance that readings of a disk have in common along a sequence, likewise."""
    span: float
    """Steps over which they do."""


class SurvivingModel(NamedTuple):
    """A set of effects that the recording leaves standing."""

    probability: float
    effects: tuple[str, ...]
    """By name."""
    reduced_chi2: float
    heldout_log_score: float | None
    """Mean log density of the whitened readings set aside, up to a constant; None where there are none."""


class ToleranceFound(NamedTuple):
    """How far the rig probably is off its drawing somewhere."""

    name: str
    value: float
    low: float
    """Ends of its 95 % interval."""
    high: float
    prior_sd: float

    def beyond(self, sd: float) -> bool:
        """Whether it is more than `sd` prior standard deviations off, either way."""
        return abs(self.value) > sd * self.prior_sd


class LargestScore(NamedTuple):
    """The maximum of a score test."""

    z: float
    threshold: float
    """What it exceeds only by chance if nothing is left."""


class CalibratedConstant(NamedTuple):
    """A constant of the manipulator, in its unit."""

    nominal: float
    calibrated: float
    """Refitted alone."""
    explained: float
    """Refitted with the effects that are named."""
    low: float
    """95 % interval of `explained`; NaN where none is deserved."""
    high: float


class CameraFrame(NamedTuple):
    """Where the camera stood: measured positions are turned and shifted against the manipulator's by this much."""

    rotation_rad: float
    x_m: float
    y_m: float
