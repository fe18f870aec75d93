"""How far an equilibrium is from the arithmetic limit of the machine.

The operations of an equilibrium are counted on the kernel's own text (`counting.py`); what the machine does at most is
measured beside it, by turns: multiply-adds that do not wait for each other, one number at a time and as many side by
side as the compiler puts into a register.  Kernels are compiled for one number at a time.
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
"""Peaks: multiply-adds as one instruction, products and additions as one each, and fused ones of whole registers."""
CHAINS = 12
"""Results that are worked out independently: more than a processor has under way, no more than it has registers."""
LENGTH, DEPTH = 256, 16
"""Of the array for whole registers, which stays in the cache next to the processor; multiply-adds of a number."""
ROUNDS = {SCALAR: 400_000, APART: 800_000, VECTOR: 8_000}
"""Some milliseconds each."""
COUNTED_FRICTION = 0.3


def fused_one_by_one(x, m, p, rounds):
    """Put m x + p in the place of each of `CHAINS` numbers x, `rounds` times: independent chains of operations."""
    a, b, c, d, e, f, g, h, i, j, k, l = x[0], x[1], x[2], x[3], x[4], x[5], x[6], x[7], x[8], x[9], x[10], x[11]  # noqa: E741
    for _ in range(rounds):
        a, b, c, d, e, f = a * m + p, b * m + p, c * m + p, d * m + p, e * m + p, f * m + p
        g, h, i, j, k, l = g * m + p, h * m + p, i * m + p, j * m + p, k * m + p, l * m + p  # noqa: E741
    x[0], x[1], x[2], x[3], x[4], x[5], x[6], x[7], x[8], x[9], x[10], x[11] = a, b, c, d, e, f, g, h, i, j, k, l


def apart_one_by_one(x, m, p, rounds):
    """A product or an addition of each of `CHAINS` numbers, in place."""
    a, b, c, d, e, f, g, h, i, j, k, l = x[0], x[1], x[2], x[3], x[4], x[5], x[6], x[7], x[8], x[9], x[10], x[11]  # noqa: E741
    for _ in range(rounds):
        a, b, c, d, e, f = a * m, b + p, c * m, d + p, e * m, f + p
        g, h, i, j, k, l = g * m, h + p, i * m, j + p, k * m, l + p  # noqa: E741
    x[0], x[1], x[2], x[3], x[4], x[5], x[6], x[7], x[8], x[9], x[10], x[11] = a, b, c, d, e, f, g, h, i, j, k, l


def fused_side_by_side(x, m, p, rounds):
    """`DEPTH` multiply-adds of every number of an array, in place."""
    for _ in range(rounds):
        for k in range(len(x)):
            y = x[k]
            y = (((y * m + p) * m + p) * m + p) * m + p
            y = (((y * m + p) * m + p) * m + p) * m + p
            y = (((y * m + p) * m + p) * m + p) * m + p
            y = (((y * m + p) * m + p) * m + p) * m + p
            x[k] = y


def peak_tasks() -> list[Timed]:
    """The loops as tasks; their `equilibria` are operations."""
    fused = numba.njit(fastmath={"contract"})
    kinds = (
        (SCALAR, fused(fused_one_by_one), CHAINS, 2 * CHAINS),
        (APART, numba.njit(apart_one_by_one), CHAINS, CHAINS),
        (VECTOR, fused(fused_side_by_side), LENGTH, 2 * LENGTH * DEPTH),
    )
    return [_peak_task(*kind) for kind in kinds]


def _peak_task(name: str, loop: Any, length: int, operations: int) -> Timed:
    x = np.linspace(0.1, 1.0, length)

    def run() -> np.ndarray:
        loop(x, 1.0 - 1e-9, 1e-9, ROUNDS[name])
        return x

    run()  # compiles
    return Timed(name, operations * ROUNDS[name], run)


def operation_counts() -> pd.DataFrame:
    """One row a method of the bench: operations of one of the equilibria of Table 2, of each kind and as weighted.

    Those of two rounds of the 20 loads that follow a first one, so that coming to rest is not among them.
    """
    return pd.DataFrame([{"method": name} | _operations(*of) for name, of in _counted()])


def _counted() -> Iterator[tuple[str, tuple[PlateModel, float]]]:
    springs, elastica = plate_model("prb3r"), gauss_collocation()
    for name, plate in ((PRB_ENGINE, springs), (ELASTICA_ENGINE, elastica)):
        yield name, (plate, 0.0)
        yield f"{name}, mu {COUNTED_FRICTION}", (plate, COUNTED_FRICTION)


def _operations(plate: PlateModel, mu: float) -> dict[str, float]:
    chain = prototype(plate, mu)
    once, again = (count_solve(chain, table_2(chain, times))[1] for times in (1, 3))
    again.subtract(once)
    per_call = {kind: again[kind] / 40 for kind in OPERATION_WEIGHTS}
    return per_call | {"operations": weighted(again) / 40}


def arithmetic_table(
    counted: pd.DataFrame, methods: Sequence[Timed], by_method: np.ndarray, peaks: np.ndarray
) -> pd.DataFrame:
    """Counts with what is reached of the machine's peaks, medians of the ratios within a round.

    `by_method` (rounds, methods) seconds an equilibrium, `peaks` (rounds, 3) seconds an operation.
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
    """One row a peak: operations a second; `seconds` (rounds, peaks) an operation."""
    return pd.DataFrame({"peak": [task.name for task in tasks], "operations_per_s": 1 / np.median(seconds, axis=0)})
