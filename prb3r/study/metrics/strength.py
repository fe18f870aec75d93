"""How far the loads are from yield, instability and the end of the branch."""

from collections.abc import Sequence
from typing import Annotated, ClassVar, Literal

import numpy as np
from pydantic import Field

from prb3r.mechanics.chain import Loads
from prb3r.mechanics.limit import limit_load
from prb3r.mechanics.strain import peak_strain
from prb3r.model.laws.self_consistent import equilibria_of
from prb3r.quantities import Quantity
from prb3r.study.metrics.base import Metric, Solved


class Safety(Metric):
    """Highest strain and stress of a plate over all load steps, and the safety factor against yield."""

    kind: Literal["safety"]

    def quantities(self) -> list[Quantity]:
        return [
            Quantity("peak_strain", "ε", "1", "highest bending strain of a plate over all load steps"),
            Quantity("peak_stress_pa", "σ", "Pa", "highest bending stress of a plate over all load steps"),
            Quantity("safety_factor", "S", "1", "yield stress over the highest bending stress"),
        ]

    def values(self, case: Solved) -> Sequence[float]:
        strain = peak_strain(case.states, case.manipulator.bending_stiffness, case.manipulator.outer_fibre)
        peak = float(np.nanmax(strain)) if np.isfinite(strain).any() else np.nan
        stress = peak * case.manipulator.youngs_modulus_pa
        return peak, stress, (case.manipulator.yield_stress_pa or np.nan) / stress if stress else np.inf


class Stability(Metric):
    """Lowest eigenvalue of the tangent over all load steps, relative to that of the unloaded manipulator."""

    kind: Literal["stability"]
    about: ClassVar[str] = "lowest eigenvalue of the tangent over all load steps, relative to the unloaded one"

    def quantities(self) -> list[Quantity]:
        return [Quantity("stability_margin", "", "1", self.about)]

    def values(self, case: Solved) -> Sequence[float]:
        rest = equilibria_of(case.chain, Loads(*(np.zeros_like(field) for field in case.last)), eigenvalue=True)
        loaded, unloaded = case.states.lowest_eigenvalue, rest.lowest_eigenvalue
        return [float(np.nanmin(loaded) / unloaded[0]) if loaded is not None and unloaded is not None else np.nan]


class LimitLoad(Metric):
    """Factor by which all loads of the last step can grow before the branch ends or loses stability.

    Infinite where they can grow to `up_to` times what they are.
    """

    kind: Literal["limit-load"]
    since: Literal["path", "rest"] = "path"
    """Grow from the end of the case's path, or the last step's loads alone from rest."""
    up_to: Annotated[float, Field(gt=1, le=1e6)] = 20.0

    def quantities(self) -> list[Quantity]:
        meaning = "factor by which all loads of the last step can grow before the branch ends or loses stability"
        return [Quantity("limit_load_factor", "", "1", meaning)]

    def values(self, case: Solved) -> Sequence[float]:
        return [limit_load(case.chain, case.loads, from_rest=self.since == "rest", most=self.up_to).factor]
