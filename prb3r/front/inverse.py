"""`reach` in Python: tensions that bring a disk to targets, as a result that can be plotted and written to files."""

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
from prb3r.model.given import Given
from prb3r.model.solve import solve
from prb3r.present import rc
from prb3r.present.canvas import Panels, drawn_on
from prb3r.present.figure_files import save_figure
from prb3r.present.page import briefly
from prb3r.present.study.reached import reached_figure, reached_table
from prb3r.runs.files import ensure_writable


@dataclass(frozen=True, eq=False, repr=False)
class Reach(Reached):
    """Tensions that bring a disk to each of its targets, or as near as possible, and the states to which they lead."""

    @property
    def frame(self) -> pd.DataFrame:
        """The table of the targets, `table`, under the name that all results have for their main table."""
        return self.table

    def plot(self, *, axes: Panels = None) -> Figure:
        """A figure of the path of the disk along its targets, with the manipulator at some of them.

        Parameters
        ----------
        axes : axes to draw on, in mm; absent: those of a new figure.
        """
        with rc.in_use(), drawn_on(axes):
            return reached_figure(self.manipulator, self.table, solve(self.manipulator, self.steps))

    def report(self, folder: str | Path) -> list[Path]:
        """Write `steps.csv`, `targets.csv` and the figure `reach` (PNG, SVG) into `folder`; returns the files written.

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
    """Find the tensions, of least sum or least stress, that bring a disk to a position, an angle, or both, or along a
    path of such targets.

    Parameters
    ----------
    manipulator : a `Manipulator`, the path of its file, or what the file would hold as a dict.
    path : instead of a single target, a table (or the file that holds it) of targets in their order, with columns among
        `x_m, y_m, angle_rad`; an empty cell leaves a coordinate free.  The pull for one target is followed to the next;
        another pull is looked for only where it leads no further.
    most_n : largest tension of a cable, N; default: the tension at which the cable alone would bend the plates that it
        crosses by a whole turn without friction.
    broken : names of cables that carry nothing.
    least : quantity to minimise among all pulls that reach the target: `"force"`, the sum of the tensions, or
        `"stress"`, the highest bending stress of a plate.
    wanted : the target: `disk`, its number or `"tip"` (default), and `x_m`, `y_m` and `angle_rad` of its centre.

    Returns
    -------
    The load steps to apply, and whether each target is reached; for a target that is not, the nearest state, where
    angles are compared with distances by the manipulator's length.  With declared friction, each cable's slip agrees
    with its travel in that step, and `applied` says in which order to pull them where it matters; with
    `direction = "history"` friction follows the whole path.  Friction that
    depends on the rate of the tension is that at the reference rate, as targets have no times.

    Raises
    ------
    SpecError
        With every problem of the manipulator or the targets.

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
    return Reach(**vars(pulls_to(manipulator, path=path, most_n=most_n, broken=broken, least=least, **wanted)))
