"""What a recording tells, whole."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from prb3r.diagnosis.checks.heldout import HeldOut
from prb3r.diagnosis.checks.outliers import Doubts, far_off
from prb3r.diagnosis.evidence.constants_by_part import Clue
from prb3r.diagnosis.evidence.detectable import Detectable
from prb3r.diagnosis.evidence.score_test import Scores
from prb3r.diagnosis.fit.model import Fit
from prb3r.diagnosis.fit.prediction import Constants
from prb3r.diagnosis.result.mismatch import Mismatch
from prb3r.diagnosis.result.named import Named
from prb3r.diagnosis.search.empirical_law import Closure
from prb3r.diagnosis.search.experiment import Experiment
from prb3r.diagnosis.search.selection import Choice
from prb3r.model.effects.base import Effect
from prb3r.model.manipulator import Manipulator
from prb3r.recording.recording import Recording


@dataclass(frozen=True, eq=False)
class Diagnosis:
    """What a recording tells."""

    recording: Recording
    seed: int
    verdict: str
    why: str
    """Of `unexplained`: what no effect of the library accounts for."""
    training: Recording
    """The sequences that were fitted."""
    nominal_chi2: float | None
    """Reduced, of the nominal model; None where it has no equilibrium."""
    calibrated: Fit
    explained: Fit
    doubts: Doubts
    choice: Choice
    before: Scores
    """Score test of what calibration leaves."""
    named: tuple[Named, ...]
    mismatch: Mismatch
    closure: Closure | None
    """An empirical law of the unexplained."""
    closure_gain: float | None
    """Share of the excess squared error on held-out sequences that it removes."""
    heldout: HeldOut | None
    clues: tuple[Clue, ...]
    detectable: tuple[Detectable, ...]
    experiments: tuple[tuple[str, str, Experiment], ...]
    """Two rivals by name, and the load program that separates them."""
    remarks: tuple[str, ...]

    @property
    def outliers(self) -> list[int]:
        """Readings of the training part beyond 4 sd of the explained model."""
        return far_off(self.explained, self.doubts)

    def manipulator(self, fitted: Fit) -> Manipulator:
        """The recorded manipulator with the constants and effects of a fitted model."""
        return adjusted(self.recording.manipulator, fitted.constants, fitted.effects)


def adjusted(nominal: Manipulator, constants: Constants, effects: Sequence[Effect]) -> Manipulator:
    """A manipulator with calibrated constants and more effects, on the elastica plate model."""
    plain = nominal.model_dump(exclude_none=True)
    stiffer = float(np.exp(constants.log_stiffness))
    plain["model"] = "elastica"
    plain["youngs_modulus_pa"] *= stiffer
    for segment in plain["segment"]:
        if "bending_stiffness_n_m2" in segment:
            segment["bending_stiffness_n_m2"] *= stiffer
    plain["friction"]["coefficient"] *= float(np.exp(constants.log_friction))
    plain["effect"] = [*plain.get("effect", []), *(effect.model_dump(exclude_none=True) for effect in effects)]
    return Manipulator.model_validate(plain)
