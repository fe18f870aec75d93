"""Floating point rate of the kernels, as a share of the peak rate of the machine.

The operations of an equilibrium are counted on the kernel's own text (`counting.py`).  The peak is measured in turns
with the kernels: independent multiply-adds, scalar ones and vector ones as wide as the compiler makes them.  Kernels
are compiled for one number at a time.
"""

from collections.abc import Iterator, Sequence
from typing import Any

import numba
import numpy as np
import pandas as pd

from prb3r.bench.counting import OPERATION_WEIGHTS, count_solve, weighted
from prb3r.bench.methods import ELASTICA_ENGINE, PRB_ENGINE
from prb3r.bench.prototype import Timed, prototype, table_2
from prb3r.mechanics.plate import PlateModel, gauss_collocation, plate_model

SCALAR, APART, VECTOR = "one at a time, fused", "one at a time, apart", "side by side, fused"
"""Kinds of peak: scalar fused multiply-adds, scalar products and additions apart, and vector fused multiply-adds."""
CHAINS = 12
"""Independent chains of scalar operations: more than a processor has under way, no more than it has registers."""
LENGTH, DEPTH = 256, 16
"""Length of the array for vector operations, which fits into the first-level cache; multiply-adds of each number in a
round."""
ROUNDS = {SCALAR: 400_000, APART: 800_000, VECTOR: 8_000}
"""Rounds of each loop: some milliseconds."""
COUNTED_FRICTION = 0.3
"""Friction coefficient of the equilibria with friction whose operations are counted."""


def fused_one_by_one(x, m, p, rounds):
    """Replace each of `CHAINS` numbers x by m x + p, `rounds` times: independent chains of fused multiply-adds."""
    a, b, c, d, e, f, g, h, i, j, k, l = x[0], x[1], x[2], x[3], x[4], x[5], x[6], x[7], x[8], x[9], x[10], x[11]  # noqa: E741
    for _ in range(rounds):
        a, b, c, d, e, f = a * m + p, b * m + p, c * m + p, d * m + p, e * m + p, f * m + p
        g, h, i, j, k, l = g * m + p, h * m + p, i * m + p, j * m + p, k * m + p, l * m + p  # noqa: E741
    x[0], x[1], x[2], x[3], x[4], x[5], x[6], x[7], x[8], x[9], x[10], x[11] = a, b, c, d, e, f, g, h, i, j, k, l


def apart_one_by_one(x, m, p, rounds):
    """Multiply half of `CHAINS` numbers by m and add p to the others, in place, `rounds` times."""
    a, b, c, d, e, f, g, h, i, j, k, l = x[0], x[1], x[2], x[3], x[4], x[5], x[6], x[7], x[8], x[9], x[10], x[11]  # noqa: E741
    for _ in range(rounds):
        a, b, c, d, e, f = a * m, b + p, c * m, d + p, e * m, f + p
        g, h, i, j, k, l = g * m, h + p, i * m, j + p, k * m, l + p  # noqa: E741
    x[0], x[1], x[2], x[3], x[4], x[5], x[6], x[7], x[8], x[9], x[10], x[11] = a, b, c, d, e, f, g, h, i, j, k, l


def fused_side_by_side(x, m, p, rounds):
    """Do `DEPTH` multiply-adds on every number of an array, in place, `rounds` times; the compiler makes vectors."""
    for _ in range(rounds):
        for k in range(len(x)):
            y = x[k]
            y = (((y * m + p) * m + p) * m + p) * m + p
            y = (((y * m + p) * m + p) * m + p) * m + p
            y = (((y * m + p) * m + p) * m + p) * m + p
            y = (((y * m + p) * m + p) * m + p) * m + p
            x[k] = y


def peak_tasks() -> list[Timed]:
    """The three peak loops as tasks to be timed, compiled already; their `equilibria` are floating point operations."""
    fused = numba.njit(fastmath={"contract"})
    kinds = (
        (SCALAR, fused(fused_one_by_one), CHAINS, 2 * CHAINS),
        (APART, numba.njit(apart_one_by_one), CHAINS, CHAINS),
        (VECTOR, fused(fused_side_by_side), LENGTH, 2 * LENGTH * DEPTH),
    )
    return [_peak_task(*kind) for kind in kinds]


def _peak_task(name: str, loop: Any, length: int, operations: int) -> Timed:
    """A peak loop over `length` numbers, with so many `operations` in a round, as a compiled task."""
    x = np.linspace(0.1, 1.0, length)

    def run() -> np.ndarray:
        loop(x, 1.0 - 1e-9, 1e-9, ROUNDS[name])
        return x

    run()  # compiles
    return Timed(name, operations * ROUNDS[name], run)


def operation_counts() -> pd.DataFrame:
    """One row a method: mean operations of an equilibrium of Table 2, by kind and their weighted sum `operations`.

    The mean is over the second and third round of the 20 loads: the solution at rest, which belongs to the first round,
    does not count.
    """
    return pd.DataFrame([{"method": name} | _operations(*of) for name, of in _counted()])


def _counted() -> Iterator[tuple[str, tuple[PlateModel, float]]]:
    """Methods whose operations are counted: the name, and the plate model with the friction coefficient."""
    springs, elastica = plate_model("prb3r"), gauss_collocation()
    for name, plate in ((PRB_ENGINE, springs), (ELASTICA_ENGINE, elastica)):
        yield name, (plate, 0.0)
        yield f"{name}, mu {COUNTED_FRICTION}", (plate, COUNTED_FRICTION)


def _operations(plate: PlateModel, mu: float) -> dict[str, float]:
    """Mean operations of an equilibrium, by kind and weighted; see :func:`operation_counts`."""
    chain = prototype(plate, mu)
    once, again = (count_solve(chain, table_2(chain, times))[1] for times in (1, 3))
    again.subtract(once)
    per_call = {kind: again[kind] / 40 for kind in OPERATION_WEIGHTS}
    return per_call | {"operations": weighted(again) / 40}


def arithmetic_table(
    counted: pd.DataFrame, methods: Sequence[Timed], by_method: np.ndarray, peaks: np.ndarray
) -> pd.DataFrame:
    """Counts with the time, the rate (operations/s) and its shares of the scalar and vector peak; medians over rounds.

    `by_method` (rounds, methods) holds seconds per equilibrium, `peaks` (rounds, 3) seconds per operation.
    """
    places = [[task.name for task in methods].index(name) for name in counted["method"]]
    seconds = by_method[:, places]
    a_second = counted["operations"].to_numpy() / seconds
    return counted.assign(
        time_each_s=np.median(seconds, axis=0),
        operations_per_s=np.median(a_second, axis=0),
        of_scalar_peak=np.median(a_second * peaks[:, :1], axis=0),
        of_vector_peak=np.median(a_second * peaks[:, 2:], axis=0),
    )


def peak_table(tasks: Sequence[Timed], seconds: np.ndarray) -> pd.DataFrame:
    """One row a kind of peak: operations per second; `seconds` (rounds, peaks) holds seconds per operation."""
    return pd.DataFrame({"peak": [task.name for task in tasks], "operations_per_s": 1 / np.median(seconds, axis=0)})
