"""Manipulator and load steps to states."""

from pathlib import Path

import numpy as np
import pandas as pd

from prb3r.mechanics.equilibrium import Outcome
from prb3r.model.effects import observed
from prb3r.model.laws.self_consistent import equilibria_of
from prb3r.model.manipulator import Manipulator, ModelName
from prb3r.model.steps import sequences_of


def solve(
    manipulator: Manipulator,
    steps: pd.DataFrame | str | Path,
    model: ModelName | None = None,
    as_measured: bool = False,
    image_centre_m: tuple[float, float] = (0.0, 0.0),
) -> pd.DataFrame:
    """Equilibria along each sequence of load steps, every one from rest.

    Parameters
    ----------
    steps : table of steps, or the CSV or Parquet file that holds it (see the contract of the format in the README).
    model : instead of the manipulator's own.
    as_measured : positions as a camera with the manipulator's observation effects reads them.
    image_centre_m : of that camera.

    Returns
    -------
    DataFrame with `sequence, step, disk, x_m, y_m, angle_rad, outcome` for disks 0..n of every step; positions of a
    step without equilibrium are NaN.

    Raises
    ------
    SpecError
        With every problem of the table.
    """
    if model is not None:
        manipulator = Manipulator.model_validate(manipulator.model_dump(exclude_none=True) | {"model": model})
    chain, tables = manipulator.chain(), []
    for sequence in sequences_of(manipulator, steps):
        states = equilibria_of(chain, sequence.loads, eigenvalue=True, number=sequence.steps)
        count, disks = states.x.shape
        tables.append(
            pd.DataFrame(
                {
                    "sequence": sequence.name,
                    "step": np.repeat(sequence.steps, disks),
                    "disk": np.tile(np.arange(disks), count),
                    "x_m": states.x.ravel(),
                    "y_m": states.y.ravel(),
                    "angle_rad": states.angle.ravel(),
                    "outcome": np.repeat([Outcome(code).label for code in states.outcome], disks),
                }
            )
        )
    table = pd.concat(tables, ignore_index=True)
    if as_measured:
        table[["x_m", "y_m"]] = observed(table[["x_m", "y_m"]].to_numpy(), manipulator.effect, image_centre_m)
    return table
