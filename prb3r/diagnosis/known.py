"""What is asked, and what is known after each stage of a diagnosis: frozen data that the stages hand on."""

from dataclasses import dataclass

from prb3r.diagnosis.checks.repeats import Scatter
from prb3r.diagnosis.evidence.outliers import Doubts
from prb3r.diagnosis.evidence.score_test import Scores
from prb3r.diagnosis.fit.model import Fit
from prb3r.diagnosis.search.search import Search
from prb3r.diagnosis.search.selection import Choice
from prb3r.diagnosis.settings import Settings
from prb3r.model.manipulator import Manipulator
from prb3r.recording.recording import Recording


@dataclass(frozen=True)
class Task:
    """What is asked: a recording, and how it is to be judged."""

    recording: Recording
    seed: int = 0
    """Of thresholds and of the choice of held-out sequences; the same seed, the same diagnosis."""
    without: frozenset[str] = frozenset()
    """Kinds of effects that are not considered."""
    hold_out: bool = True
    """Whether sequences are set aside; not where another recording is held out instead."""
    settings: Settings = Settings()
    assumed: Manipulator | None = None
    """A manipulator with effects that were found before; they are refitted."""
    begun: Manipulator | None = None
    """A manipulator from whose effects the search begins too; they are as probable beforehand as any others."""


@dataclass(frozen=True, eq=False)
class Calibrated:
    """A recording without the sequences that are set aside, and the constants that fit it."""

    task: Task
    recording: Recording
    """All that was recorded, with the sequences that are set aside."""
    aside: tuple[int, ...]
    repeated: Scatter | None
    fitted: Fit


@dataclass(frozen=True, eq=False)
class Doubted(Calibrated):
    """The same with the constants under the readings and weights that are believed."""

    doubts: Doubts
    search: Search
    """What may explain what is left."""


@dataclass(frozen=True, eq=False)
class Tested:
    """What calibration leaves unexplained, as the score tests see it."""

    doubted: Doubted
    scores: Scores


@dataclass(frozen=True, eq=False)
class Searched:
    """The effects that were chosen, and what was known before."""

    tested: Tested
    choice: Choice
