"""The result of a diagnosis as plain data: every number, table and sentence, made once.

Nothing here holds a fit or can be solved again.  A diagnosis can be pickled; files, page, figures, scores of the
benchmark and the transfer to other recordings read nothing else.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import pandas as pd

from prb3r.diagnosis.checks.heldout import HeldOut
from prb3r.diagnosis.checks.residuals import ModelCheck
from prb3r.diagnosis.checks.setup.find import Blunder
from prb3r.diagnosis.evidence.constants_by_part import Clue
from prb3r.diagnosis.result.effects import FittedLaw, Mismatch, NamedEffect, Separation
from prb3r.diagnosis.result.numbers import (
    CalibratedConstant,
    CameraFrame,
    ChiSquare,
    FittedModel,
    LargestScore,
    NoiseFound,
    SurvivingModel,
    ToleranceFound,
)
from prb3r.diagnosis.result.posterior import Posterior
from prb3r.model.manipulator import Manipulator


@dataclass(frozen=True, eq=False, repr=False)
class Diagnosis:
    """The result of a diagnosis of one recording."""

    name: str
    """Name of the recording."""
    seed: int
    verdict: str
    """adequate, explained, ambiguous, unexplained, or set-up where a blunder is to be mended first."""
    why: str
    """Why the verdict is `unexplained`, to follow "since"; else empty."""
    structured: bool
    """Whether the explanation leaves structure that neither chance nor the stated accuracy explains."""
    share_of_stated: float
    """Below 1: the residual of the chosen model does not look like noise, but is this share of what the recording
    states of its accuracy in readings and tensions; else 1."""
    nominal: Manipulator
    """The manipulator of the recording's file."""
    calibrated: FittedModel
    """The model with refitted constants alone."""
    explained: FittedModel
    """The chosen model; the calibrated one where no effect is chosen."""
    manipulators: Mapping[str, Manipulator]
    """By name, on the elastica plate model: `calibrated`, the nominal manipulator with refitted constants; `explained`,
    with the constants and effects of the chosen model; and where there is a closure, `closure`, with that empirical
    law."""
    chi2: ChiSquare
    noise: NoiseFound
    models: tuple[SurvivingModel, ...]
    """The surviving models, most probable first."""
    posterior: Posterior
    """Parameters of all surviving models with their covariances, from which predictions are drawn."""
    alternatives: tuple[tuple[str, ...], ...]
    """Sets of kinds of effects in surviving models that lack a named kind, as far as their probability counts."""
    tolerances: tuple[ToleranceFound, ...]
    """Those that the recording tells something of."""
    checks: tuple[ModelCheck, ...]
    """Checks of what the best model leaves."""
    score_calibrated: LargestScore
    """Of what calibration leaves."""
    score_explained: LargestScore
    """Of what the chosen model leaves."""
    constants: Mapping[str, CalibratedConstant]
    """`youngs_modulus_pa` and `friction_coefficient`."""
    frame: CameraFrame
    """The camera's frame in the explained model."""
    effects: tuple[NamedEffect, ...]
    mismatch: Mismatch
    closure: FittedLaw | None
    """An empirical law of the unexplained; None where none is fitted."""
    heldout: HeldOut | None
    """Errors on sequences set aside; None where none were."""
    experiments: tuple[Separation, ...]
    """Load programs that tell rivals apart; none unless the verdict is `ambiguous`."""
    clues: tuple[Clue, ...]
    """Constants as parts of the recording alone would have them."""
    remarks: tuple[str, ...]
    tables: Mapping[str, pd.DataFrame]
    """`residuals`, `mismatch`, `detectable`, `ranking`, `shapes`, `loads`, `outliers`; their columns: `tables.py`."""
    settings: Mapping[str, Any] = field(default_factory=dict)
    """The settings that the diagnosis was made with, by name."""
    setup: tuple[Blunder, ...] = ()
    """Blunders of the set-up, in the order in which they are mended; all else is said of the recording without them."""
    rival_blunder: Blunder | None = None
    """A blunder that would explain the recording in the place of effects, but with too little evidence to be said."""

    def __repr__(self) -> str:
        return f"<{type(self).__name__} of {self.name!r}: {self.verdict}>"

    @property
    def shown(self) -> Sequence[str]:
        """Names of the models, as columns of the tables, whose predictions are worth showing: both, or the calibrated
        one where no effect was added."""
        return ("calibrated", "explained") if self.explained.effects else ("calibrated",)
