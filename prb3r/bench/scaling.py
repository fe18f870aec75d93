"""Growth of the time with the number of plates: the same rod in ever finer parts."""

from collections.abc import Sequence

import numpy as np
import pandas as pd

from prb3r.bench.prototype import NO_LOAD, PLATES, TIP_LOAD, Timed, engine_task, prototype, table_2
from prb3r.mechanics.plate import plate_model

LENGTHS = (PLATES, 10 * PLATES, 100 * PLATES)
"""Numbers of plates, shortest chain first."""
LINEAR_GROWTH = 1.25
"""Growth counts as linear if a plate of the longest chain costs at most this many times one of the shortest."""


def scaling_tasks(lengths: Sequence[int], equilibria: int) -> list[Timed]:
    """For each number of plates in `lengths` (multiples of 14) a task without and one with a tip load.

    A chain ten times as long solves a tenth of the `equilibria`.
    """
    return [_task(plates, tip, equilibria) for plates in lengths for tip in (NO_LOAD, TIP_LOAD)]


def scaling_table(lengths: Sequence[int], tasks: Sequence[Timed], seconds: np.ndarray) -> pd.DataFrame:
    """One row a task; `seconds` (rounds, tasks) per equilibrium.

    `per_plate_of_shortest` is the ratio to the shortest chain, the median of the ratios within a round.
    """
    plates = np.repeat(lengths, 2)
    per_plate = seconds / plates
    shortest = np.tile(per_plate[:, :2], len(lengths))
    return pd.DataFrame(
        {
            "plates": plates,
            "loads": [task.name for task in tasks],
            "equilibria_per_call": [task.equilibria for task in tasks],
            "time_each_s": np.median(seconds, axis=0),
            "time_per_plate_s": np.median(per_plate, axis=0),
            "per_plate_of_shortest": np.median(per_plate / shortest, axis=0),
        }
    )


def _task(plates: int, tip: tuple[float, float], equilibria: int) -> Timed:
    """The loads of Table 2 on the prototype in `plates` parts, run once; it bends as far for all numbers of plates."""
    finer, name = plates // PLATES, "tip load 5 N" if any(tip) else "no dead load"
    chain = prototype(plate_model("prb3r"), finer=finer)
    task = engine_task(name, chain, table_2(chain, max(1, equilibria // 20 // finer), tip))
    task.run()  # fills caches
    return task
