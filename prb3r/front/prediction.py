"""`predict` in Python: another design as a diagnosis predicts it, with a figure and files."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from prb3r.diagnosis.result.design_prediction import DesignPrediction, predict_design
from prb3r.diagnosis.result.diagnosis import Diagnosis
from prb3r.diagnosis.settings import Settings
from prb3r.model.files.table import write_table
from prb3r.model.given import Given
from prb3r.present import rc
from prb3r.present.figure_files import save_figure
from prb3r.present.page import briefly
from prb3r.present.study.drawing import plot
from prb3r.runs.files import ensure_writable, write_whole
from prb3r.runs.threads import one_thread


@dataclass(frozen=True, eq=False, repr=False)
class Prediction(DesignPrediction):
    """A design as a diagnosis predicts it; the prediction can be plotted, shown in a notebook and written to files."""

    @property
    def frame(self) -> pd.DataFrame | None:
        """The table `positions` (None without steps), under the name that all results have for their main table."""
        return self.positions

    def plot(self, *, axes: Axes | None = None) -> Figure:
        """A figure of the design at the end of every load sequence, with the 95 % bands of its disks; without steps, of
        the straight design.

        Parameters
        ----------
        axes : axes to draw on, in mm; absent: those of a new figure.
        """
        figure = plot(self.manipulator, self.positions, axes=axes)
        if self.positions is None:
            return figure
        panel = axes or figure.axes[0]
        last = self.positions.groupby("sequence")["step"].transform("max") == self.positions["step"]
        with rc.in_use():
            for row in self.positions[last & (self.positions["disk"] > 0)].to_dict("records"):
                panel.plot([1e3 * row["x_low_m"], 1e3 * row["x_high_m"]], [1e3 * row["y_m"]] * 2, color="k", lw=0.8)
                panel.plot([1e3 * row["x_m"]] * 2, [1e3 * row["y_low_m"], 1e3 * row["y_high_m"]], color="k", lw=0.8)
        return figure

    def report(self, folder: str | Path) -> list[Path]:
        """Write `manipulator.toml`, with steps `positions.csv`, and the figure `prediction` into `folder`.

        Returns the files written.

        Raises
        ------
        SpecError
            If the folder cannot be made or written to.
        """
        into = Path(folder)
        ensure_writable(into)
        files = [write_whole(into / "manipulator.toml", self.to_toml().encode())]
        if self.positions is not None:
            write_table(self.positions, into / "positions.csv")
            files.append(into / "positions.csv")
        return [*files, *save_figure(self.plot(), into, "prediction")]

    def __repr__(self) -> str:
        steps = 0 if self.positions is None else len(self.positions[["sequence", "step"]].drop_duplicates())
        return f"{self.manipulator.name}: {', '.join(self._said)}, positions at {steps} step{'s' * (steps != 1)}"

    def _repr_html_(self) -> str:
        return briefly(self.manipulator.name, [f"{text}." for text in (*self._said, *self.remarks)])

    @property
    def _said(self) -> list[str]:
        """Phrases on the effects that are carried over to the design, and on those that are not."""
        kinds = ", ".join(effect.kind.replace("_", " ") for effect in self.manipulator.effect)
        return [f"carried over: {kinds or 'constants alone'}", *(f"left behind: {text}" for text in self.left_behind)]


def predict_on(
    diagnosis: str | Path | Diagnosis,
    manipulator: Given,
    steps: pd.DataFrame | Mapping[str, Any] | str | Path | None = None,
    *,
    same_bench: bool | None = None,
    another_copy: bool = False,
    draws: int = Settings.band_draws,
    seed: int = 0,
) -> Prediction:
    """Predict another design, or the same one, from a diagnosis: its effects, constants and, with `steps`, positions.

    Parameters
    ----------
    diagnosis : a result of `prb3r.diagnose`, the folder that `prb3r diagnose` wrote, or its diagnosis.json.
    manipulator : the design: a `Manipulator`, the path of its file, or what the file would hold as a dict.
    steps : a table of load steps as for `solve`, if positions are wanted.
    same_bench : whether the design stands on the bench of the recording, mounted alike: then the zero of a force
        sensor, a tilt of the base or gravity carry over too. None: it probably does; the bands hold both.
    another_copy : whether the design, even if its file describes the recorded rig, is another one of its drawing: then
        faults of single parts stay behind, and the bands hold tolerances.
    draws : number of draws of model and parameters that are solved for the bands.
    seed : seed of these draws; the same seed gives the same bands.

    Raises
    ------
    SpecError
        With every problem of a file, or if there are too few `draws` for a band.

    Examples
    --------
    A rig that is as its file says, read to a tenth of a millimetre at three steps, and a prediction for a rig of three
    segments.

    >>> from pathlib import Path
    >>> import pandas as pd
    >>> import prb3r
    >>> arm = prb3r.load_manipulator("studies/manipulators/two-segment.toml").replace("model", "elastica")
    >>> arm = arm.replace("segment.1.plates", 2).replace("segment.2.plates", 2)
    >>> pulls = {"sequence": "a", "step": [1, 2, 3], "cable_1_n": [20, 40, 60]}
    >>> read = prb3r.solve(arm, pulls).query("disk > 0")[["sequence", "step", "disk", "x_m", "y_m"]]
    >>> bench = Path("bench")
    >>> bench.mkdir()
    >>> read.round(4).to_csv(bench / "markers.csv", index=False)  # to a tenth of a millimetre
    >>> pd.DataFrame(pulls).assign(sequence="a").to_csv(bench / "steps.csv", index=False)
    >>> recording = ['name = "bench"', 'manipulator = "manipulator.toml"', "[measurement]", "position_sd_m = 3e-5"]
    >>> for name, text in {"recording": "\\n".join(recording), "manipulator": arm.to_toml()}.items():
    ...     _ = (bench / f"{name}.toml").write_text(text)
    >>> load = {"sequence": ["a"], "step": [1], "cable_tip+_n": [20]}
    >>> learnt = prb3r.predict(prb3r.diagnose(bench), "studies/manipulators/three-segment.toml", load)
    >>> tip = learnt.positions.iloc[-1]
    >>> bool(tip["y_low_m"] < tip["y_m"] < tip["y_high_m"])
    True
    """
    with one_thread():
        return Prediction(
            **vars(
                predict_design(
                    diagnosis,
                    manipulator,
                    steps,
                    same_bench=same_bench,
                    another_copy=another_copy,
                    draws=draws,
                    seed=seed,
                )
            )
        )
