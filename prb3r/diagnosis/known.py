"""The task of a diagnosis and the results of its stages: frozen data that each stage hands to the next."""

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
    """The task of a diagnosis: a recording, and the options."""

    recording: Recording
    seed: int = 0
    """Seed of the simulated critical values and of the choice of held-out sequences; the same seed gives the same
    diagnosis."""
    without: frozenset[str] = frozenset()
    """Kinds of effects that are not considered."""
    frame_taken: tuple[str, ...] = ()
    """Lines on the camera's frame that `recording.toml` lacks, as they are taken in `recording`, since a rigid motion
    removes most of what constants leave; mostly none."""
    hold_out: bool = True
    """Whether sequences are set aside; False where the diagnosis is judged on other recordings instead."""
    settings: Settings = Settings()
    assumed: Manipulator | None = None
    """A manipulator with effects that were found before: they are refitted, with a high prior probability."""
    start_from: Manipulator | None = None
    """A manipulator whose effects are one more start of the search, with their usual prior probability."""


@dataclass(frozen=True, eq=False)
class Calibrated:
    """A recording, the sequences that are set aside, and the constants that fit the others."""

    task: Task
    recording: Recording
    """All that was recorded, including the sequences that are set aside."""
    aside: tuple[int, ...]
    """Numbers of the sequences that are set aside."""
    repeated: Scatter | None
    """Scatter of repeated sequences; None where too few steps are repeated."""
    fitted: Fit
    """The constants alone, fitted to the other sequences."""


@dataclass(frozen=True, eq=False)
class Doubted(Calibrated):
    """A calibrated recording with gross outliers down-weighted and wrong weights set aside, and `fitted` refitted."""

    doubts: Doubts
    search: Search
    """The effects that may explain what is left, and how they are searched."""


@dataclass(frozen=True, eq=False)
class Tested:
    """A doubted recording, and the score tests of what its constants alone leave."""

    doubted: Doubted
    scores: Scores


@dataclass(frozen=True, eq=False)
class Searched:
    """A tested recording, and the effects that were chosen for it."""

    tested: Tested
    choice: Choice
