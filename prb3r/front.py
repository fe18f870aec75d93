"""The front door of studies, comparisons and diagnoses: files in, objects out that show what they say."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Literal, overload

from matplotlib.figure import Figure

from prb3r.diagnosis.result.common import write_common
from prb3r.diagnosis.result.diagnosis import Diagnosis
from prb3r.diagnosis.result.files import default_folder, write_record
from prb3r.diagnosis.run import diagnosis_of, joint_diagnosis_of
from prb3r.diagnosis.together import JointDiagnosis
from prb3r.errors import Problem, SpecError
from prb3r.model.given import Given
from prb3r.present.diagnosis.report import FIGURES, brief, figure_of, publish_diagnosis
from prb3r.present.diagnosis.sentences import headlines
from prb3r.present.study.comparison import Advice, advice_on, publish_comparison
from prb3r.present.study.current import publish_what_changed
from prb3r.recording.recording import Recording
from prb3r.runs.tasks import Workers
from prb3r.study.designs import read_designs
from prb3r.study.plan import Silent, plan_study
from prb3r.study.run import Options, Result, execute, writing
from prb3r.study.wishes import load_wishes


def run_study(path: str | Path, *, output: str | Path = "results", jobs: int = 1, fresh: bool = False) -> Result:
    """Run one study and write what `prb3r run` writes: tables, figures, summary and report, into `output/<name>`.

    Parameters
    ----------
    output : folder that receives one folder a study.
    jobs : worker processes.
    fresh : compute everything anew instead of going on from what is stored.

    Raises
    ------
    SpecError
        Before any work, for anything wrong with the input.
    EngineError
        If workers or disk fail; what is already computed stays and the next run goes on from there.

    Examples
    --------
    >>> import prb3r
    >>> result = prb3r.run_study("studies/friction-direction.toml")
    >>> (result.folder / "report.html").exists(), result.failed
    (True, 0)
    """
    options = Options(Path(output), Workers(jobs=jobs), fresh)
    plan = plan_study(path, output)
    with writing(plan):
        result = execute(plan, options, Silent())
        publish_what_changed(result)
    return result


@dataclass(frozen=True, eq=False, repr=False)
class Counsel(Advice):
    """A decision between designs that shows what it says."""

    def report(self, folder: str | Path) -> list[Path]:
        """Write into `folder` all that `prb3r compare -o` writes; the files written.

        Raises
        ------
        SpecError
            If the folder cannot be made or written to.
        """
        return [Path(folder) / name for name in publish_comparison(self, Path(folder))]

    def __repr__(self) -> str:
        return self.recommendation.replace("**", "")

    def _repr_markdown_(self) -> str:
        return self.markdown


def compare(*results: Result | str | Path, requirements: str | Path | None = None) -> Counsel:
    """Which design to build, of those in one or several results.

    Parameters
    ----------
    results : of `run_study`, or the folders that hold them.
    requirements : file of requirements and preferences, instead of those of the studies.

    Raises
    ------
    SpecError
        With everything that keeps the designs from being compared.

    Examples
    --------
    >>> import prb3r
    >>> counsel = prb3r.compare(prb3r.run_study("studies/which-design.toml"))
    >>> counsel.decision.winner in counsel.decision.designs
    True
    """
    folders = [result.folder if isinstance(result, Result) else Path(result) for result in results]
    if not folders:
        raise SpecError(Problem("results", "none are given"))
    return Counsel(**vars(advice_on(read_designs(folders, load_wishes(requirements) if requirements else None))))


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


@dataclass(frozen=True, eq=False, repr=False)
class JointReport(JointDiagnosis):
    """Several recordings diagnosed together, each a diagnosis that draws its figures and writes its files."""

    diagnoses: tuple[DiagnosisReport, ...]

    def report(self, folder: str | Path) -> list[Path]:
        """Write into `folder` all that `prb3r diagnose --together` writes; the files written.

        Raises
        ------
        SpecError
            If the folder cannot be made or written to.
        EngineError
            If the disk is full.
        """
        files = [
            path
            for diagnosis in self.diagnoses
            for path in diagnosis.report(Path(folder) / default_folder(diagnosis.name).name)
        ]
        return [write_common(self.common, folder), *files]

    def __repr__(self) -> str:
        return "\n".join([*map(repr, self.diagnoses), *self.common.sentences])


Recorded = Recording | str | Path
"""A recording, or its folder."""


@overload
def diagnose(
    recording: Recorded,
    *,
    together: Literal[False] = False,
    holdout: Sequence[Recorded] = (),
    assume: Given | None = None,
    seed: int = 0,
    jobs: int = 1,
    report: Callable[[str], None] = ...,
) -> DiagnosisReport: ...


@overload
def diagnose(
    recording: Sequence[Recorded],
    *,
    together: Literal[True],
    holdout: Sequence[Recorded] = (),
    assume: Given | None = None,
    seed: int = 0,
    jobs: int = 1,
    report: Callable[[str], None] = ...,
) -> JointReport: ...


def diagnose(
    recording: Recorded | Sequence[Recorded],
    *,
    together: bool = False,
    holdout: Sequence[Recorded] = (),
    assume: Given | None = None,
    seed: int = 0,
    jobs: int = 1,
    report: Callable[[str], None] = lambda step: None,
) -> DiagnosisReport | JointReport:
    """Diagnose a recording, given as its folder or read already, or several `together` with what their rigs share.

    Parameters and errors as of `diagnosis_of` and `joint_diagnosis_of`.
    """
    if together != (not isinstance(recording, Recording | str | Path)):
        raise SpecError(Problem("diagnose", "several recordings are given with together=True, one without"))
    if isinstance(recording, Recording | str | Path):
        diagnosis = diagnosis_of(recording, holdout=holdout, assume=assume, seed=seed, jobs=jobs, report=report)
        return DiagnosisReport(**vars(diagnosis))
    found = joint_diagnosis_of(recording, holdout=holdout, assume=assume, seed=seed, jobs=jobs, report=report)
    return JointReport(tuple(DiagnosisReport(**vars(diagnosis)) for diagnosis in found.diagnoses), found.common)
