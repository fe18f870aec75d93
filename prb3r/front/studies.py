"""`run_study` in Python: a study is run, and its tables and figures are at hand in the result."""

import shutil
from dataclasses import dataclass
from pathlib import Path

import pandas as pd
from matplotlib.figure import Figure

from prb3r.present.canvas import Panels, drawn_on
from prb3r.present.page import briefly
from prb3r.present.study.current import publish_what_changed
from prb3r.present.study.figures import study_figure
from prb3r.present.study.pictures import scene_of
from prb3r.present.study.report import first_cases, in_short
from prb3r.present.study.source import Source
from prb3r.present.study.thinning import states_to_draw
from prb3r.runs.files import ensure_writable
from prb3r.runs.tasks import Workers
from prb3r.study.plan import Silent, plan_study
from prb3r.study.run import Options, Result, execute, writing


@dataclass(frozen=True, eq=False, repr=False)
class StudyResult(Result):
    """A finished study whose tables and figures can be used, shown in a notebook and copied to a folder."""

    files: tuple[Path, ...] = ()
    """Figures and pages in the study's folder."""

    @property
    def frame(self) -> pd.DataFrame:
        """A row for each case: factors, outcome, metrics and comparisons."""
        return self.cases

    @property
    def tables(self) -> dict[str, pd.DataFrame]:
        """All tables by name: `cases`, and as far as the study has them `states`, `quantiles`, `shares`, `indices`."""
        states, rigs = self.states(), self.rigs
        tables = {"cases": self.cases} | ({} if states is None else {"states": states})
        return tables | ({} if rigs is None else {name: table for name, table in vars(rigs).items() if len(table)})

    def plot(self, name: str | None = None, *, axes: Panels = None) -> Figure:
        """A figure of the plot with this `name` in the study file; without a name, of the first plot.

        Parameters
        ----------
        axes : axes to draw on, as many as the plot has panels; absent: those of a new figure.

        Raises
        ------
        ValueError
            If the study has no such plot, or for a wrong number of axes.
        """
        plots = {plot.name: plot for plot in self.plan.study.plot}
        if not plots or (name is not None and name not in plots):
            raise ValueError(f"no plot {name or ''!r}: the study has {', '.join(plots) or 'none'}")
        plot = next(iter(plots.values())) if name is None else plots[name]
        with drawn_on(axes):
            return study_figure(plot, self.cases, states_to_draw(self), scene_of(self))

    def report(self, folder: str | Path) -> list[Path]:
        """Copy all files of `prb3r run` (tables, manifest, figures, report) into `folder`; returns the copies.

        Raises
        ------
        SpecError
            If the folder cannot be made or written to.
        """
        into = Path(folder)
        ensure_writable(into)
        written = [path for path in sorted(self.folder.iterdir()) if path.is_file() and not path.name.startswith(".")]
        return written if into.samefile(self.folder) else [Path(shutil.copy2(path, into)) for path in written]

    def __repr__(self) -> str:
        return f"{self.plan.study.name}: {in_short(self._source)}; in {self.folder}"

    def _repr_html_(self) -> str:
        study = self.plan.study
        return briefly(
            study.title, [study.question, f"{in_short(self._source)}, in {self.folder}."], first_cases(self._source)
        )

    @property
    def _source(self) -> Source:
        """The study with its results, as the functions that write tables and sentences take it."""
        return Source(self.plan.study, self.cases, self.plan.quantities, self.manifest)


def run_study(path: str | Path, *, output: str | Path = "results", jobs: int = 1, fresh: bool = False) -> StudyResult:
    """Run one study and write what `prb3r run` writes (tables, figures, summary and report) into `output/<name>`.

    Parameters
    ----------
    path : file of the study.
    output : folder that receives a folder for each study.
    jobs : number of worker processes.
    fresh : compute everything anew instead of continuing from stored results.

    Raises
    ------
    SpecError
        With every problem of the input, before any work.
    EngineError
        If workers or the disk fail; results so far stay, and the next run continues from them.

    Examples
    --------
    >>> import prb3r
    >>> result = prb3r.run_study("studies/friction-direction.toml")
    >>> (result.folder / "report.html").exists(), result.failed
    (True, 0)
    >>> result.plot("configurations").axes[0].get_xlabel()
    '$x$ (mm)'
    """
    options = Options(Path(output), Workers(jobs=jobs), fresh)
    plan = plan_study(path, output)
    with writing(plan):
        result = execute(plan, options, Silent())
        files = publish_what_changed(result)
    return StudyResult(plan, result.cases, result.manifest, result.computed, tuple(files))
