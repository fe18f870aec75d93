"""Tensions for targets that show where they lead."""

from collections.abc import Collection
from dataclasses import dataclass
from pathlib import Path
from typing import Unpack

import pandas as pd
from matplotlib.figure import Figure

from prb3r.inverse.pull import Least
from prb3r.inverse.reach import Wanted, pulls_to
from prb3r.inverse.reached import Reached
from prb3r.model.files.table import write_table
from prb3r.model.given import Given, manipulator_of
from prb3r.model.manipulator import Manipulator
from prb3r.model.solve import solve
from prb3r.present import rc
from prb3r.present.canvas import Panels, drawn_on
from prb3r.present.page import briefly, save_figure
from prb3r.present.study.reached import reached_figure, reached_table
from prb3r.runs.files import ensure_writable


@dataclass(frozen=True, eq=False, repr=False)
class Reach(Reached):
    """Tensions that bring a disk along its targets, or as near as it comes, and where they lead."""

    manipulator: Manipulator

    @property
    def frame(self) -> pd.DataFrame:
        """The table `table`, a row for each target; other results offer theirs as `frame` too."""
        return self.table

    def plot(self, *, axes: Panels = None) -> Figure:
        """The way of the disk past its targets, and the manipulator at some of them.

        Parameters
        ----------
        axes : to draw on, in mm; without them on a new figure.
        """
        with rc.in_use(), drawn_on(axes):
            return reached_figure(self.manipulator, self.table, solve(self.manipulator, self.steps))

    def report(self, folder: str | Path) -> list[Path]:
        """Write `steps.csv`, `targets.csv` and the figure `reach` (PNG, SVG) into `folder`; the files written.

        Raises
        ------
        SpecError
            If the folder cannot be made or written to.
        """
        into = Path(folder)
        ensure_writable(into)
        tables = {into / "steps.csv": self.steps, into / "targets.csv": self.table}
        for path, table in tables.items():
            write_table(table, path)
        return [*tables, *save_figure(self.plot(), into, "reach")]

    def __repr__(self) -> str:
        return "\n".join(self.sentences)

    def _repr_html_(self) -> str:
        return briefly("", self.sentences, reached_table(self.steps, self.table))


def reach(
    manipulator: Given,
    *,
    path: pd.DataFrame | str | Path | None = None,
    most_n: float | None = None,
    broken: Collection[str] = (),
    least: Least = "force",
    **wanted: Unpack[Wanted],
) -> Reach:
    """Tensions of least sum, or of least stress, that bring a disk to a place, an angle, both, or along a path of them.

    Parameters
    ----------
    path : instead of a place, a table (or the file that holds it) of targets in their order, with columns among
        `x_m, y_m, angle_rad`; an empty cell leaves a coordinate free.  The pull that leads to one is followed to the
        next, and another one is looked for only where it leads no further.
    most_n : largest tension of a cable, N; by itself where the cable alone would bend what it drives by a
        whole turn if nothing rubbed.
    broken : cables that carry nothing.
    least : what is least of all pulls that lead there: `"force"`, the sum of the tensions, or `"stress"`, the highest
        bending stress of a plate.
    wanted : `disk`, its number or `"tip"` (by itself), and `x_m`, `y_m`, `angle_rad` of its centre.

    Returns
    -------
    The steps to pull, and whether each target is reached; where one is not, the nearest state (distances and angles
    compare by the manipulator's length) is told.  Where friction is declared, each cable's slip goes with its travel
    in that step; with `direction = "history"` friction follows the whole path.

    Raises
    ------
    SpecError
        With everything that is wrong with what is asked.

    Examples
    --------
    >>> import prb3r
    >>> manipulator = prb3r.load_manipulator("studies/manipulators/two-segment.toml")
    >>> answer = prb3r.reach(manipulator, x_m=0.40, y_m=0.15)
    >>> answer.reached
    True
    >>> markers = prb3r.solve(manipulator, answer.steps)
    >>> markers[["x_m", "y_m"]].iloc[-1].round(6).tolist()
    [0.4, 0.15]
    """
    manipulator = manipulator_of(manipulator)
    reached = pulls_to(manipulator, path=path, most_n=most_n, broken=broken, least=least, **wanted)
    return Reach(**vars(reached), manipulator=manipulator)
