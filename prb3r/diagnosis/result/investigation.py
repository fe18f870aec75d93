"""All results of the stages of a diagnosis, fits included, from which `tell.py` makes the plain result."""

from dataclasses import dataclass

from prb3r.diagnosis.checks.heldout import HeldOut
from prb3r.diagnosis.checks.residuals import ModelCheck
from prb3r.diagnosis.checks.setup.find import Blunder
from prb3r.diagnosis.checks.unseen import Unseen
from prb3r.diagnosis.evidence.outliers import Doubts
from prb3r.diagnosis.evidence.score_test import Scores
from prb3r.diagnosis.fit.model import Fit
from prb3r.diagnosis.fit.tolerance import EstimatedTolerances
from prb3r.diagnosis.result.effects import Separation
from prb3r.diagnosis.result.named import Named
from prb3r.diagnosis.result.numbers import SurvivingModel
from prb3r.diagnosis.search.empirical_law import Closure
from prb3r.diagnosis.search.selection import Choice
from prb3r.model.manipulator import Manipulator
from prb3r.recording.recording import Recording


@dataclass(frozen=True, eq=False)
class Investigation:
    """A recording, all that was fitted to it, and all tests of the fits."""

    recording: Recording
    """The whole recording, mended if its set-up had blunders."""
    seed: int
    verdict: str
    why: str
    """Why the verdict is `unexplained`, to follow "since"; else empty."""
    training: Recording
    """The sequences that were fitted, as a recording."""
    fresh: Unseen | None
    """The sequences set aside, as they were judged; None where none was."""
    calibrated: Fit
    """The constants alone, fitted, with parts and tensions anywhere within their tolerances."""
    refitted: Fit
    """The constants alone, as they predict best with every part as drawn (`constants_as_drawn`); the same as `reported`
    if the chosen model has no effects."""
    filed: Fit | None
    """The constants of the manipulator file, where the recording is unexplained and they predict the sequences set
    aside better than refitted ones; else None."""
    reported: Fit
    """The chosen model with the parameters that are reported: those of its fit or, if the verdict is `unexplained`,
    those with which it predicts best with every part as drawn (`as_drawn`)."""
    before: Scores
    """Score test of the residuals of calibration."""
    choice: Choice
    """The chosen model and those that survive beside it."""
    doubts: Doubts
    """Readings and weights of `training` that are not believed."""
    named: tuple[Named, ...]
    """Effects that are named, in the order of the chosen model."""
    models: tuple[SurvivingModel, ...]
    """The surviving models, most probable first."""
    tolerances: EstimatedTolerances
    """Tolerances of the parts about which the recording tells something."""
    checks: tuple[ModelCheck, ...]
    """Checks of the residuals of the best model."""
    closure: Closure | None
    """An empirical law of the unexplained; None where none is fitted."""
    closure_gain: float | None
    """Share of the excess squared error on held-out sequences that the closure removes."""
    heldout: HeldOut | None
    """Errors on the sequences set aside; None where none was."""
    experiments: tuple[Separation, ...]
    """Load programs that tell rivals apart."""
    remarks: tuple[str, ...]
    """What else a reader should know, a sentence each."""
    failed: tuple[str, ...] = ()
    """Names of sequences set aside that the chosen model does not predict."""
    blunders: tuple[Blunder, ...] = ()
    """Blunders of the set-up; everything else refers to the recording with these mended."""
    as_filed: Manipulator | None = None
    """The nominal manipulator as the recording's file has it, where a blunder was mended there; else None."""
    rival_blunder: Blunder | None = None
    """A blunder that would explain the recording instead of effects, but has too little evidence to be reported."""

    @property
    def explained(self) -> Fit:
        """The fit of the chosen model; without effects, the constants alone."""
        return self.choice.fitted

    @property
    def doubted_steps(self) -> list[int]:
        """Rows of the steps of `recording` with a weight that is not believed, among fitted and held-out sequences."""
        parts = [(self.training, self.doubts.weights)]
        parts += [(self.fresh.recording, self.fresh.doubted)] if self.fresh else []
        return [int(self.recording.rows_of(part)[weight.step]) for part, weights in parts for weight in weights]

    @property
    def missed_steps(self) -> list[int]:
        """Rows of the held-out steps of `recording` that the chosen model does not predict."""
        if self.fresh is None:
            return []
        return self.recording.rows_of(self.fresh.recording)[self.fresh.missed_steps(self.explained)].tolist()

    @property
    def unmet(self) -> tuple[Scores, Fit]:
        """Score test and fit that describe the mismatch: those of the chosen model if its residuals are structured
        beyond the stated accuracy, else those of calibration."""
        if self.choice.beyond_stated:
            return self.choice.scores, self.choice.fitted
        return self.before, self.calibrated
