"""Time and error of the engine in all its models, of the seed's method and of the integral model."""

from collections.abc import Iterator, Sequence

import numpy as np
import pandas as pd

from prb3r.bench.prototype import (
    NO_LOAD,
    PRESLIDING,
    TIP_LOAD,
    Timed,
    engine_task,
    prototype,
    reversals,
    table_2,
    tips,
)
from prb3r.mechanics.chain import pose
from prb3r.mechanics.plate import gauss_collocation, plate_model
from prb3r.mechanics.reference import integral_fsolve, seed_fsolve

CONVERGED_POINTS = 6
"""Gauss points per plate of the elastica that is taken as exact."""
PRB_ENGINE, ELASTICA_ENGINE = "engine, PRB 3R", "engine, elastica"
ONE_HINGE_ENGINE, ARC_ENGINE = "engine, PRB 1R", "engine, constant curvature"
TIP_ENGINE, HISTORY_ENGINE = "engine, PRB 3R, tip load 5 N", "engine, PRB 3R, mu 0.3, loading history"
FSOLVE, INTEGRAL = "reference: fsolve on Eq. 12", "reference: integral model"
SIDE_BY_SIDE = "engine, PRB 3R, side by side", "engine, PRB 3R, mu 0.3, side by side"
"""Names of methods that solve each load from rest, several in lanes at once: without friction and with it."""
COMPARED = (ONE_HINGE_ENGINE, PRB_ENGINE, ELASTICA_ENGINE, ARC_ENGINE, FSOLVE, INTEGRAL)
"""Methods that solve the same problem: cables alone, without friction."""


def method_tasks(times: int) -> Iterator[tuple[Timed, float]]:
    """Every method as a task, with its largest tip error, % of length, against the converged elastica.

    The engine solves the loads of Table 2 `times` over in one call; the references solve them once, each load from the
    last solution.
    """
    yield from _without_history(times)
    yield from _side_by_side(times)
    yield from _with_history()
    yield from _references()


def method_table(tasks: Sequence[Timed], errors: Sequence[float], seconds: np.ndarray) -> pd.DataFrame:
    """One row a method; `seconds` (rounds, tasks) per equilibrium.

    `times_engine` is the ratio to the first task, the median of the ratios within a round.
    """
    median = np.median(seconds, axis=0)
    return pd.DataFrame(
        {
            "method": [task.name for task in tasks],
            "equilibria_per_call": [task.equilibria for task in tasks],
            "time_of_20_s": 20 * median,
            "time_each_s": median,
            "times_engine": np.median(seconds / seconds[:, :1], axis=0),
            "tip_error_percent": errors,
        }
    )


def _without_history(times: int) -> Iterator[tuple[Timed, float]]:
    """The engine along the loads of Table 2, each from the step before, in all plate models."""
    springs, elastica = plate_model("prb3r"), gauss_collocation()
    bare = prototype(springs)
    cases = [
        (PRB_ENGINE, bare, NO_LOAD),
        (ELASTICA_ENGINE, prototype(elastica), NO_LOAD),
        (ONE_HINGE_ENGINE, prototype(plate_model("prb3r", "one")), NO_LOAD),
        ("engine, PRB 3R, mu 0.3", prototype(springs, 0.3), NO_LOAD),
        ("engine, elastica, mu 0.3", prototype(elastica, 0.3), NO_LOAD),
        (TIP_ENGINE, bare, TIP_LOAD),
        ("engine, elastica, tip load 5 N", prototype(elastica), TIP_LOAD),
        (ARC_ENGINE, prototype(elastica)._replace(tied=True), NO_LOAD),
    ]
    for name, chain, tip in cases:
        task = engine_task(name, chain, table_2(chain, times, tip))
        yield task, _error(task, float(chain.friction[0, 0]), tip)


def _side_by_side(times: int) -> Iterator[tuple[Timed, float]]:
    """The engine on the loads of Table 2, each from rest, several in lanes at once."""
    names = (*SIDE_BY_SIDE, *(name.replace("PRB 3R", "elastica") for name in SIDE_BY_SIDE))
    for name, plate in zip(names, [plate_model("prb3r")] * 2 + [gauss_collocation()] * 2, strict=True):
        mu = 0.3 if "mu" in name else 0.0
        chain = prototype(plate, mu)
        task = engine_task(name, chain, table_2(chain, times), alone=True)
        yield task, _error(task, mu)


def _with_history() -> Iterator[tuple[Timed, float]]:
    """The engine along 40 steps with reversals, with friction that follows the cables' travel."""
    plates = {HISTORY_ENGINE: plate_model("prb3r"), "engine, elastica, mu 0.3, loading history": gauss_collocation()}
    exact = prototype(gauss_collocation(CONVERGED_POINTS), 0.3)._replace(presliding=PRESLIDING)
    for name, plate in plates.items():
        chain = prototype(plate, 0.3)._replace(presliding=PRESLIDING)
        task = engine_task(name, chain, reversals(chain))
        converged = engine_task("converged elastica", exact, reversals(exact)).run()
        yield task, _percent(task.run(), converged, exact.length)


def _references() -> Iterator[tuple[Timed, float]]:
    """The seed's method and the integral model on the 20 loads of Table 2."""
    bare = prototype(plate_model("prb3r"))
    once = table_2(bare)

    def by_fsolve() -> np.ndarray:
        shape = pose(bare, seed_fsolve(bare, once)[0])
        return tips(shape.x, shape.y)

    def by_integrals() -> np.ndarray:
        shape = integral_fsolve(bare, once)[1]
        return tips(shape.x, shape.y)

    for task in (Timed(FSOLVE, 20, by_fsolve), Timed(INTEGRAL, 20, by_integrals)):
        yield task, _error(task)


def _error(task: Timed, mu: float = 0.0, tip: tuple[float, float] = NO_LOAD) -> float:
    """Largest tip error of a task over the loads of Table 2, % of length; `mu` and `tip` (N) are those of the task."""
    exact = prototype(gauss_collocation(CONVERGED_POINTS), mu)
    converged = engine_task("converged elastica", exact, table_2(exact, tip=tip)).run()
    return _percent(task.run()[:20], converged, exact.length)


def _percent(tip: np.ndarray, converged: np.ndarray, length: float) -> float:
    """Largest distance between tips (s,), m, as complex numbers, in % of `length`."""
    return float(100 * np.abs(tip - converged).max() / length)
