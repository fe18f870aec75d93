"""Decisions between designs that show what they say."""

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
    """A decision between designs that shows what it says."""

    @property
    def frame(self) -> pd.DataFrame:
        """A row for each design: what requirements and preferences look at, and what follows."""
        return self.decision.table

    def plot(self, kind: str = "decision", *, axes: Panels = None) -> Figure:
        """Reserves and worth of the designs side by side (`decision`), or the Pareto front (`front`).

        Parameters
        ----------
        axes : to draw on, as many as the figure has panels; without them on a new figure.

        Raises
        ------
        ValueError
            If there is no such kind, nothing to show in it, or for another number of axes.
        """
        if kind not in COUNSEL_FIGURES:
            raise ValueError(f"no plot {kind!r}: the kinds are {', '.join(COUNSEL_FIGURES)}")
        with rc.in_use(), drawn_on(axes):
            return COUNSEL_FIGURES[kind](self.decision)

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

    def _repr_html_(self) -> str:
        told = [sentence for _, sentences in self.points for sentence in sentences]
        return briefly("", [self.recommendation, self.note, *told], self.table)


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
    return Counsel(**vars(advice_on(read_designs(folders, requirements))))
