"""What the stages of a diagnosis found, with the fits they found it by: what is told of it is made in `tell.py`."""

from dataclasses import dataclass

from prb3r.diagnosis.checks.heldout import HeldOut, Unseen
from prb3r.diagnosis.checks.residuals import ModelCheck
from prb3r.diagnosis.checks.setup.find import Blunder
from prb3r.diagnosis.evidence.outliers import Doubts
from prb3r.diagnosis.evidence.score_test import Scores
from prb3r.diagnosis.fit.model import Fit
from prb3r.diagnosis.fit.tolerance import EstimatedTolerances
from prb3r.diagnosis.result.effects import Separation
from prb3r.diagnosis.result.named import Named
from prb3r.diagnosis.result.numbers import SurvivingModel
from prb3r.diagnosis.search.empirical_law import Closure
from prb3r.diagnosis.search.selection import Choice
from prb3r.recording.recording import Recording


@dataclass(frozen=True, eq=False)
class Investigation:
    """A recording and all that was fitted to it and tested on it."""

    recording: Recording
    """With the noise that was taken for its own."""
    seed: int
    verdict: str
    why: str
    """Of `unexplained`: what no effect of the library accounts for."""
    training: Recording
    """The sequences that were fitted."""
    fresh: Unseen | None
    """Those set aside, as they were judged; None where none was."""
    calibrated: Fit
    before: Scores
    """Score test of what calibration leaves."""
    choice: Choice
    doubts: Doubts
    """What of the training part was not believed."""
    named: tuple[Named, ...]
    models: tuple[SurvivingModel, ...]
    tolerances: EstimatedTolerances
    """Those that the recording tells something of."""
    checks: tuple[ModelCheck, ...]
    closure: Closure | None
    """An empirical law of the unexplained."""
    closure_gain: float | None
    """Share of the excess squared error on held-out sequences that it removes."""
    heldout: HeldOut | None
    experiments: tuple[Separation, ...]
    remarks: tuple[str, ...]
    failed: tuple[str, ...] = ()
    """Sequences set aside that the choice does not predict."""
    blunders: tuple[Blunder, ...] = ()
    """Of the set-up: all else is said of the recording without them."""

    @property
    def explained(self) -> Fit:
        """The chosen model; without effects, the calibrated one."""
        return self.choice.fitted

    @property
    def doubted_steps(self) -> list[int]:
        """Rows of the steps of `recording` of which a weight is not believed, those set aside included."""
        parts = [(self.training, self.doubts.weights)]
        parts += [(self.fresh.predict.recording, self.fresh.doubted)] if self.fresh else []
        return [int(self.recording.rows_of(part)[weight.step]) for part, weights in parts for weight in weights]

    @property
    def missed_steps(self) -> list[int]:
        """Rows of the steps of `recording` that were set aside and are not predicted."""
        if self.fresh is None:
            return []
        return self.recording.rows_of(self.fresh.predict.recording)[self.fresh.missed_steps(self.explained)].tolist()

    @property
    def unmet(self) -> tuple[Scores, Fit]:
        """Score test and model that the mismatch is told of: the best one where structure is left, else calibration."""
        if self.choice.beyond_stated:
            return self.choice.scores, self.choice.fitted
        return self.before, self.calibrated
