"""Predictions of a diagnosis for other loads and other designs, made from the files that it writes."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
import pandas as pd

from prb3r.diagnosis.result.carried_constants import carried_constants
from prb3r.diagnosis.result.design_prediction import PREDICTED, predict_design
from prb3r.diagnosis.result.diagnosis import Diagnosis
from prb3r.diagnosis.result.files import write_record
from prb3r.diagnosis.result.tell import adjusted
from prb3r.model.given import manipulator_of
from prb3r.model.solve import solve


@dataclass(frozen=True, eq=False)
class Forecast:
    """Prediction at one target: `s` steps, disks 0..n, and x, y (m) and angle (rad)."""

    name: str
    """Name of the target."""
    calibrated: np.ndarray
    """(s, n + 1, 3) with calibrated constants and no effect; NaN without an equilibrium."""
    explained: np.ndarray
    """(s, n + 1, 3) mean over the surviving models; NaN without an equilibrium."""
    low: np.ndarray
    """(s, n + 1, 3) lower ends of 95 % bands."""
    high: np.ndarray
    """(s, n + 1, 3) upper ends."""


def forecasts(diagnosis: Diagnosis, targets: Sequence[Mapping[str, Any]]) -> tuple[Forecast, ...]:
    """Predictions at targets, each a `name`, the contents of a `manipulator` file and a `program`."""
    with TemporaryDirectory() as folder:
        write_record(diagnosis, folder)
        return tuple(_forecast(diagnosis, Path(folder), target) for target in targets)


def _forecast(diagnosis: Diagnosis, folder: Path, target: Mapping[str, Any]) -> Forecast:
    """The prediction at one target, from the files of the diagnosis in `folder`."""
    steps = pd.DataFrame(
        [
            {"sequence": f"t{q}", "step": k, **step}
            for q, sequence in enumerate(target["program"], 1)
            for k, step in enumerate(sequence, 1)
        ]
    )
    design = manipulator_of(target["manipulator"])
    shape = (len(steps), design.plates + 1, len(PREDICTED))
    table = predict_design(folder, design, steps, same_bench=False).positions
    assert table is not None
    constants = carried_constants(diagnosis.calibrated.constants, diagnosis.nominal, design)
    alone = solve(adjusted(design, constants, ()), steps)
    ends = [
        [f"{name.rsplit('_', 1)[0]}_{end}_{name.rsplit('_', 1)[1]}" for name in PREDICTED] for end in ("low", "high")
    ]
    return Forecast(
        target["name"],
        alone[list(PREDICTED)].to_numpy().reshape(shape),
        table[list(PREDICTED)].to_numpy().reshape(shape),
        *(table[names].to_numpy().reshape(shape) for names in ends),
    )
