"""`compare` in Python: a decision between designs that can be plotted, shown in a notebook and written to files."""

from dataclasses import dataclass
from pathlib import Path

import pandas as pd
from matplotlib.figure import Figure

from prb3r.errors import Problem, SpecError
from prb3r.present import rc
from prb3r.present.canvas import Panels, drawn_on
from prb3r.present.page import briefly
from prb3r.present.study.comparison import Advice, advice_on, publish_comparison
from prb3r.present.study.front import decision_figure, front_figure
from prb3r.study.designs import read_designs
from prb3r.study.run import Result

COUNSEL_FIGURES = {"decision": decision_figure, "front": front_figure}


@dataclass(frozen=True, eq=False, repr=False)
class Counsel(Advice):
    """A decision between designs that can be plotted, shown in a notebook and written to files."""

    @property
    def frame(self) -> pd.DataFrame:
        """The table of the decision, a row for each design: the columns that requirements and preferences use, and the
        result."""
        return self.decision.table

    def plot(self, kind: str = "decision", *, axes: Panels = None) -> Figure:
        """A figure of the reserves and the worth of the designs side by side (`decision`), or of the Pareto front
        (`front`).

        Parameters
        ----------
        axes : axes to draw on, as many as the figure has panels; absent: those of a new figure.

        Raises
        ------
        ValueError
            If there is no such kind, if there is nothing to show in it, or for a wrong number of axes.
        """
        if kind not in COUNSEL_FIGURES:
            raise ValueError(f"no plot {kind!r}: the kinds are {', '.join(COUNSEL_FIGURES)}")
        with rc.in_use(), drawn_on(axes):
            return COUNSEL_FIGURES[kind](self.decision)

    def report(self, folder: str | Path) -> list[Path]:
        """Write all files of `prb3r compare -o` into `folder`; returns the files written.

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

    def _repr_html_(self) -> str:
        told = [sentence for _, sentences in self.points for sentence in sentences]
        return briefly("", [self.recommendation, self.note, *told], self.table)


def compare(*results: Result | str | Path, requirements: str | Path | None = None) -> Counsel:
    """Decide which design to build, of those in the results of one or several studies.

    Parameters
    ----------
    results : results of `run_study`, or the folders that hold them.
    requirements : a file of requirements and preferences to use instead of those of the studies.

    Raises
    ------
    SpecError
        With every reason why the designs cannot be compared.

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
    return Counsel(**vars(advice_on(read_designs(folders, requirements))))
