"""Metrics of the distance of the loads from yield, instability and the end of the equilibrium branch."""

from collections.abc import Sequence
from typing import Annotated, ClassVar, Literal

import numpy as np
from pydantic import Field

from prb3r.mechanics.chain import Loads
from prb3r.mechanics.limit import limit_load
from prb3r.mechanics.strain import peak_strain
from prb3r.model.laws.self_consistent import equilibria_of
from prb3r.model.manipulator import Manipulator
from prb3r.quantities import Quantity
from prb3r.study.metrics.base import Metric, Solved, lacking_for_stress, largest


class Safety(Metric):
    """Highest strain and stress of a plate over all load steps, and the safety factor against yield.

    Of a cloud over those loads that its own `safety` lets count.
    """

    kind: Literal["safety"]
    together: ClassVar[bool] = True
    of_clouds: ClassVar[bool] = True

    def quantities(self) -> list[Quantity]:
        meaning = "yield stress over the highest bending stress, without bound where nothing bends"
        return [
            Quantity("peak_strain", "ε", "1", "highest bending strain of a plate over all load steps"),
            Quantity("peak_stress_pa", "σ", "Pa", "highest bending stress of a plate over all load steps"),
            Quantity("safety_factor", "S", "1", meaning),
        ]

    def lacking(self, manipulator: Manipulator) -> dict[str, str]:
        needs = {quantity.name: quantity.name == "safety_factor" for quantity in self.quantities()}
        told = {name: lacking_for_stress(manipulator, to_yield=to_yield) for name, to_yield in needs.items()}
        return {name: field for name, field in told.items() if field}

    def values(self, cases: Solved) -> Sequence[np.ndarray]:
        if cases.tips is None:
            strain = peak_strain(cases.states, cases.manipulator.bending_stiffness, cases.manipulator.outer_fibre)
        else:
            strain = cases.tips.without(cases.tips.beyond(cases.manipulator, cases.safety)).strain
        peak = largest(cases.by_case(strain).reshape(cases.count, -1))
        stress = peak * cases.manipulator.youngs_modulus_pa
        with np.errstate(divide="ignore"):
            safety = np.where(stress == 0, np.inf, (cases.manipulator.yield_stress_pa or np.nan) / stress)
        return peak, stress, safety


class Stability(Metric):
    """Lowest eigenvalue of the tangent over all load steps, relative to that of the unloaded manipulator."""

    kind: Literal["stability"]
    together: ClassVar[bool] = True
    about: ClassVar[str] = "lowest eigenvalue of the tangent over all load steps, relative to the unloaded one"

    def quantities(self) -> list[Quantity]:
        return [Quantity("stability_margin", "", "1", self.about)]

    def values(self, cases: Solved) -> Sequence[np.ndarray | float]:
        rest = equilibria_of(cases.chain, Loads(*(np.zeros_like(field[:1]) for field in cases.last)), eigenvalue=True)
        loaded, unloaded = cases.states.lowest_eigenvalue, rest.lowest_eigenvalue
        if loaded is None or unloaded is None:
            return [np.nan]
        return [-largest(-cases.by_case(loaded)) / unloaded[0]]


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
        return [Quantity("limit_load_factor", "", "1", f"{meaning}, without bound beyond {self.up_to:g}")]

    def values(self, case: Solved) -> Sequence[float]:
        return [limit_load(case.chain, case.loads, from_rest=self.since == "rest", most=self.up_to).factor]
