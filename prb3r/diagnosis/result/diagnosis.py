"""What a recording tells, as plain data: every number, table and sentence made once.

Nothing here holds a fit or can be solved again.  A diagnosis can be pickled, and files, page, figures, scores of the
benchmark and the transfer to other recordings read nothing else.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np
import pandas as pd

from prb3r.diagnosis.checks.heldout import HeldOut
from prb3r.diagnosis.checks.residuals import ModelCheck
from prb3r.diagnosis.checks.setup.find import Blunder
from prb3r.diagnosis.evidence.constants_by_part import Clue
from prb3r.diagnosis.fit.prediction import Constants
from prb3r.diagnosis.result.posterior import Posterior
from prb3r.diagnosis.result.statements import Estimate
from prb3r.diagnosis.search.experiment import Experiment
from prb3r.model.effects.base import Effect
from prb3r.model.effects.empirical import EmpiricalMoment
from prb3r.model.manipulator import Manipulator


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
    """The reading noise as the recording shows it."""

    scale: float
    """Factor on the stated standard deviations."""
    scale_low: float
    """Ends of its 95 % interval."""
    scale_high: float
    common: float
    """Share of the variance that disks of a photograph have in common."""
    reach: float
    """Disks over which they do; 1000: the whole photograph."""


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

    @property
    def beyond(self) -> bool:
        """Whether it is farther off than tolerances are: three of their standard deviations."""
        return abs(self.value) > 3 * self.prior_sd


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


class ProfileCurve(NamedTuple):
    """Rise of chi-square as a parameter leaves its best value, all others refitted."""

    value: np.ndarray
    """(k,) of the parameter, in its unit."""
    rise: np.ndarray
    """(k,) at `value`."""
    fine_value: np.ndarray
    """(m,) values between; empty where only the best value is known."""
    fine_rise: np.ndarray
    """(m,) interpolated at `fine_value`."""


@dataclass(frozen=True)
class RivalEffect:
    """An effect of another kind that cannot be told from a named one."""

    name: str
    kind: str
    place: Mapping[str, Any]
    distance: float
    """Squared whitened distance from the explanation's prediction to the nearest of the rival's."""
    behind: float
    """How much worse it fits: chi-square with its penalty."""


@dataclass(frozen=True, eq=False)
class NamedEffect:
    """An effect that a diagnosis names."""

    name: str
    """Kind and place as one text."""
    kind: str
    place: Mapping[str, Any]
    """Parameters that are not fitted: plate, cable, law."""
    among: Mapping[str, tuple[Any, ...]]
    """All values of a place that cannot be told from the best one."""
    parameters: Mapping[str, Estimate]
    profiles: Mapping[str, ProfileCurve] = field(repr=False)
    """Of the parameters that have an interval."""
    statement: str
    rivals: tuple[RivalEffect, ...]
    probability: float
    """That an effect of its kind is there, over all surviving models and places."""
    certain: bool
    """Whether nearly every surviving model has it."""
    delta_bic: float
    """Negative: better with the effect than without."""
    heldout_gain: float | None
    """Share of the excess squared error on held-out sequences that this effect removes."""
    partial: bool
    """Whether it helps without explaining all."""


@dataclass(frozen=True)
class Mismatch:
    """Where the calibrated model misses, and what that depends on."""

    plates: tuple[int, ...]
    sequences: tuple[str, ...]
    depends_on: tuple[str, ...]
    statement: str


@dataclass(frozen=True)
class FittedLaw:
    """An empirical law that describes what no effect explains."""

    effect: EmpiricalMoment
    statement: str
    reduced_chi2: float
    heldout_gain: float | None
    """Share of the excess squared error on held-out sequences that it removes."""
    beside_named: bool
    """Whether the named effects are kept beside it."""


class Separation(NamedTuple):
    """Two rival explanations by name, and the load program that tells them apart best."""

    first: str
    second: str
    experiment: Experiment


@dataclass(frozen=True, eq=False, repr=False)
class Diagnosis:
    """What a recording tells."""

    name: str
    """Of the recording."""
    seed: int
    verdict: str
    """adequate, explained, ambiguous, unexplained, or set-up where a blunder is to be mended first."""
    why: str
    """Of `unexplained`: what no effect of the library accounts for."""
    structured: bool
    """Whether the explanation leaves something that chance does not explain."""
    nominal: Manipulator
    calibrated: FittedModel
    explained: FittedModel
    manipulators: Mapping[str, Manipulator]
    """The nominal one with the constants of `calibrated`, with constants and effects of `explained`, and where there is
    a `closure` with its empirical law, on the elastica plate model."""
    chi2: ChiSquare
    noise: NoiseFound
    models: tuple[SurvivingModel, ...]
    """Most probable first."""
    posterior: Posterior
    """Parameters of all of them and how sure they are, to predict from."""
    alternatives: tuple[tuple[str, ...], ...]
    """Kinds of surviving models that lack something named, with a probability that counts."""
    tolerances: tuple[ToleranceFound, ...]
    checks: tuple[ModelCheck, ...]
    score_calibrated: LargestScore
    score_explained: LargestScore
    constants: Mapping[str, CalibratedConstant]
    """`youngs_modulus_pa` and `friction_coefficient`."""
    frame: CameraFrame
    """Of the explained model."""
    effects: tuple[NamedEffect, ...]
    mismatch: Mismatch
    closure: FittedLaw | None
    heldout: HeldOut | None
    experiments: tuple[Separation, ...]
    clues: tuple[Clue, ...]
    remarks: tuple[str, ...]
    tables: Mapping[str, pd.DataFrame]
    """`residuals`, `mismatch`, `detectable`, `ranking`, `shapes`, `loads`, `outliers`: see `tables.py`."""
    settings: Mapping[str, Any] = field(default_factory=dict)
    """What the diagnosis was made with."""
    setup: tuple[Blunder, ...] = ()
    """Blunders of the set-up: all else is said of the recording without them."""

    def __repr__(self) -> str:
        return f"<{type(self).__name__} of {self.name!r}: {self.verdict}>"

    @property
    def shown(self) -> Sequence[str]:
        """Columns of the tables that hold predictions worth showing: both models, or one where nothing was added."""
        return ("calibrated", "explained") if self.explained.effects else ("calibrated",)
