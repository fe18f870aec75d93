"""What a recording tells, as plain data: every number, table and sentence made once.

Nothing here holds a fit or can be solved again.  A diagnosis can be pickled, and files, page, figures, scores of the
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
    """What a recording tells."""

    name: str
    """Of the recording."""
    seed: int
    verdict: str
    """adequate, explained, ambiguous, unexplained, or set-up where a blunder is to be mended first."""
    why: str
    """Of `unexplained`: what no effect of the library accounts for."""
    structured: bool
    """Whether the explanation leaves something that neither chance nor the stated accuracy explains."""
    share_of_stated: float
    """Below 1: what is left does not look like noise, but is this share of what is stated of readings and tensions."""
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
