"""`diagnose` in Python: diagnoses of recordings that draw their figures and write their files."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from html import escape
from pathlib import Path
from typing import Literal, overload
from urllib.parse import quote

import pandas as pd
from matplotlib.figure import Figure

from prb3r.diagnosis.result.common import write_common
from prb3r.diagnosis.result.diagnosis import Diagnosis
from prb3r.diagnosis.result.files import default_folder, write_record
from prb3r.diagnosis.run import diagnosis_of, joint_diagnosis_of
from prb3r.diagnosis.together import JointDiagnosis
from prb3r.errors import Problem, SpecError
from prb3r.model.given import Given
from prb3r.present.canvas import Panels, drawn_on
from prb3r.present.diagnosis.report import FIGURES, brief, figure_of, publish_diagnosis
from prb3r.present.diagnosis.sentences import headlines
from prb3r.present.diagnosis.together import SHARED_FIGURE, publish_together, shared_figure
from prb3r.recording.recording import Recording
from prb3r.runs.threads import one_thread


@dataclass(frozen=True, eq=False, repr=False)
class DiagnosisReport(Diagnosis):
    """A diagnosis that draws its figures and writes its files."""

    def plot(self, kind: str, *, axes: Panels = None) -> Figure:
        """A figure of the report: shapes, missing-moment, ranking, profiles, residuals or held-out.

        Parameters
        ----------
        axes : axes to draw on, as many as the figure has panels; absent: those of a new figure.

        Raises
        ------
        ValueError
            If there is no such kind, if this diagnosis has nothing to show in it, or for a wrong number of axes.
        """
        if kind not in FIGURES:
            raise ValueError(f"no plot {kind!r}: the kinds are {', '.join(FIGURES)}")
        with drawn_on(axes):
            figure = figure_of(self, kind)
        if figure is None:
            raise ValueError(f"nothing to plot: this diagnosis has no {kind.replace('-', ' ')}")
        return figure

    def report(self, folder: str | Path) -> list[Path]:
        """Write all files of `prb3r diagnose` into `folder`; returns the files written.

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

    @property
    def frame(self) -> pd.DataFrame:
        """The shared parameters, a row for each estimate: `effect` (empty for a constant), `parameter`, `recording`
        (name, or `together` for the joint estimate), `value, low, high`, and `agrees`, whether the recordings agree."""
        return pd.DataFrame(
            [
                {"effect": shared.effect, "parameter": shared.parameter, "recording": name}
                | estimate.record
                | {"agrees": shared.agrees}
                for shared in self.common.shared
                for name, estimate in zip(
                    ("together", *shared.recordings), (shared.together, *shared.alone), strict=True
                )
            ]
        )

    def plot(self, kind: str = SHARED_FIGURE, *, axes: Panels = None) -> Figure:
        """A figure of the parameters that the rigs share, estimated from all recordings together and from each alone.

        The figures of a single recording are those of its entry in `diagnoses`.

        Parameters
        ----------
        axes : axes to draw on, one for each shared parameter; absent: those of a new figure.

        Raises
        ------
        ValueError
            If there is no such kind, if nothing is shared, or for a wrong number of axes.
        """
        if kind != SHARED_FIGURE:
            raise ValueError(
                f"no plot {kind!r}: the kind is {SHARED_FIGURE}; .diagnoses[0].plot draws a recording's own"
            )
        with drawn_on(axes):
            figure = shared_figure(self.common)
        if figure is None:
            raise ValueError("nothing to plot: these recordings share nothing")
        return figure

    def report(self, folder: str | Path) -> list[Path]:
        """Write all files of `prb3r diagnose --together` into `folder`; returns the files written.

        Raises
        ------
        SpecError
            If the folder cannot be made or written to.
        EngineError
            If the disk is full.
        """
        inner = {diagnosis.name: default_folder(diagnosis.name).name for diagnosis in self.diagnoses}
        files = [
            path for diagnosis in self.diagnoses for path in diagnosis.report(Path(folder) / inner[diagnosis.name])
        ]
        pages = {name: quote(f"{place}/report.html") for name, place in inner.items()}
        whole = publish_together(self.diagnoses, self.common, folder, pages)
        return [write_common(self.common, folder), *whole, *files]

    def __repr__(self) -> str:
        return "\n".join([*map(repr, self.diagnoses), *self.common.sentences])

    def _repr_html_(self) -> str:
        return "\n".join([*map(brief, self.diagnoses), *(f"<p>{escape(text)}</p>" for text in self.common.sentences)])


Recorded = Recording | str | Path
"""A recording, or the path of its folder."""


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
    """Diagnose a recording, or with `together` several recordings of rigs that share parameters.

    A recording is given as the path of its folder or as `load_recording` returns it.  The other parameters and the
    errors are those of `diagnosis_of` and `joint_diagnosis_of`.

    Examples
    --------
    A simulated rig with four plates, one of which is cracked without its owner's knowledge.

    >>> from pathlib import Path
    >>> import pandas as pd
    >>> import prb3r
    >>> arm = prb3r.load_manipulator("studies/manipulators/two-segment.toml").replace("model", "elastica")
    >>> arm = arm.replace("segment.1.plates", 2).replace("segment.2.plates", 2)
    >>> rig = arm.replace("effect", [prb3r.effects.WeakenedPlate(plate=2, factor=0.7)])
    >>> pulls = {"sequence": list("aaabbbccc"), "step": [1, 2, 3] * 3}
    >>> pulls |= {"cable_1_n": [20, 40, 60, 0, 0, 0, 10, 20, 30], "cable_4_n": [0, 0, 0, 20, 40, 60, 0, 0, 0]}
    >>> read = prb3r.solve(rig, pulls).query("disk > 0")[["sequence", "step", "disk", "x_m", "y_m"]]
    >>> bench = Path("bench")
    >>> bench.mkdir()
    >>> read.round(4).to_csv(bench / "markers.csv", index=False)  # to a tenth of a millimetre
    >>> pd.DataFrame(pulls).to_csv(bench / "steps.csv", index=False)
    >>> recording = ['name = "bench"', 'manipulator = "manipulator.toml"', "[measurement]", "position_sd_m = 3e-5"]
    >>> for name, text in {"recording": "\\n".join(recording), "manipulator": arm.to_toml()}.items():
    ...     _ = (bench / f"{name}.toml").write_text(text)
    >>> diagnosis = prb3r.diagnose(bench)
    >>> effect = diagnosis.effects[0]
    >>> diagnosis.verdict, effect.name, round(effect.parameters["factor"].value, 1)
    ('explained', 'weakened_plate (plate 2)', 0.7)
    """
    if together != (not isinstance(recording, Recording | str | Path)):
        raise SpecError(Problem("diagnose", "several recordings are given with together=True, one without"))
    with one_thread():
        if isinstance(recording, Recording | str | Path):
            diagnosis = diagnosis_of(recording, holdout=holdout, assume=assume, seed=seed, jobs=jobs, report=report)
            return DiagnosisReport(**vars(diagnosis))
        joint = joint_diagnosis_of(recording, holdout=holdout, assume=assume, seed=seed, jobs=jobs, report=report)
    return JointReport(tuple(DiagnosisReport(**vars(diagnosis)) for diagnosis in joint.diagnoses), joint.common)
