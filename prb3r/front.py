"""The front door of the diagnosis: a recording in, an object out that shows what it says."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

from matplotlib.figure import Figure

from prb3r.diagnosis.result.diagnosis import Diagnosis
from prb3r.diagnosis.result.files import write_record
from prb3r.diagnosis.run import diagnosis_of
from prb3r.present.diagnosis.report import FIGURES, brief, figure_of, publish_diagnosis
from prb3r.present.diagnosis.sentences import headlines
from prb3r.recording.recording import Recording


@dataclass(frozen=True, eq=False, repr=False)
class DiagnosisReport(Diagnosis):
    """A diagnosis that draws its figures and writes its files."""

    def plot(self, kind: str) -> Figure:
        """A figure of the report: shapes, missing-moment, ranking, profiles, residuals or held-out.

        Raises
        ------
        ValueError
            If there is no such kind, or if this diagnosis has nothing to show in it.
        """
        if kind not in FIGURES:
            raise ValueError(f"no plot {kind!r}: the kinds are {', '.join(FIGURES)}")
        figure = figure_of(self, kind)
        if figure is None:
            raise ValueError(f"nothing to plot: this diagnosis has no {kind.replace('-', ' ')}")
        return figure

    def report(self, folder: str | Path) -> list[Path]:
        """Write into `folder` all that `prb3r diagnose` writes; the files written.

        Raises
        ------
        SpecError
            If the folder cannot be made or written to.
        EngineError
            If the disk is full.
        """
        return [*write_record(self, folder), *publish_diagnosis(self, Path(folder))]

    def __repr__(self) -> str:
        return "\n".join(headlines(self))

    def _repr_html_(self) -> str:
        return brief(self)


def diagnose(
    recording: Recording | str | Path,
    *,
    holdout: Sequence[Recording | str | Path] = (),
    seed: int = 0,
    jobs: int = 1,
    report: Callable[[str], None] = lambda step: None,
) -> DiagnosisReport:
    """Diagnose a recording, given as its folder or read already; parameters and errors as of `diagnosis_of`."""
    diagnosis = diagnosis_of(recording, holdout=holdout, seed=seed, jobs=jobs, report=report)
    return DiagnosisReport(**vars(diagnosis))
