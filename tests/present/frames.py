"""Tables of cases and states as studies write them, and what is read from a figure."""

import numpy as np
import pandas as pd
from matplotlib.collections import PolyCollection
from pydantic import TypeAdapter

from prb3r import load_manipulator
from prb3r.mechanics.chain import loads
from prb3r.mechanics.equilibrium import solve_chain
from prb3r.present.study.sheet import Scene
from prb3r.quantities import Quantity
from prb3r.study.plots import AnyPlot

MANIPULATOR = load_manipulator("studies/manipulators/two-segment.toml")
SCENE = Scene(lambda case_id: MANIPULATOR, (Quantity("tip_shift_m", "", "m", "shift of the tip"),))


CHART = {"x": "cable_1_n", "y": ["tip_y_m"]}
OWN_FIELDS = {"lines": CHART, "bars": CHART, "loops": CHART, "shapes": {}, "workspace": {}, "path": {}}
"""Of each kind of plot, the fields that it cannot do without."""


def plot_of(**fields):
    """A plot as a study file has it."""
    return TypeAdapter(AnyPlot).validate_python(fields)


def states_of(tensions, first_case: int = 0) -> pd.DataFrame:
    """The states of one case for each row of tensions."""
    chain = MANIPULATOR.chain()
    applied = loads(chain, tensions)
    found = solve_chain(chain, applied, from_rest=True)
    tension = np.concatenate([applied.tension[:, None], found.tension], 1)
    cases, disks = found.x.shape
    columns = {"case_id": first_case + np.repeat(np.arange(cases), disks), "step": 0}
    columns |= {"disk": np.tile(np.arange(disks), cases), "x_m": found.x.ravel(), "y_m": found.y.ravel()}
    columns |= {"angle_rad": found.angle.ravel()}
    names = {f"cable_{name}_n": tension[:, :, j].ravel() for j, name in enumerate(MANIPULATOR.cable_names)}
    return pd.DataFrame(columns | names)


def cases_of(**columns) -> pd.DataFrame:
    table = pd.DataFrame(columns)
    return table.assign(case_id=range(len(table)), broken_cables="", outcome="converged", reason="")


def polygons(axes) -> list:
    return [each for each in axes.collections if isinstance(each, PolyCollection)]


def texts(figure) -> list[str]:
    return [text.get_text() for legend in figure.legends for text in legend.get_texts()]
