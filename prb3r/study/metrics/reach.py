"""Metrics of the workspace of the tip, and of how a disk follows a path of targets."""

from collections.abc import Iterator, Sequence
from typing import Annotated, ClassVar, Literal

import numpy as np
from pydantic import Field

from prb3r.mechanics.equilibrium import Outcome
from prb3r.model.files.numbers import Positive
from prb3r.model.manipulator import Manipulator
from prb3r.quantities import Quantity
from prb3r.study.metrics.base import Metric, Solved, lacking_for_stress
from prb3r.study.workspace import area, extrapolated, outline, tips_reached


class Workspace(Metric):
    """Area that the tip disk's centre reaches, counted in square cells, with its convergence, outline and width.

    The area of a region hardly wider than the cells is mostly that of the cells along its boundary: what is left of it
    in smaller cells is `workspace_extrapolated_m2`, which for a curve is 0.

    Loads that bring a plate nearer to yield than the factor `safety` do not count, where the manipulator gives a yield
    stress.
    """

    kind: Literal["workspace"]
    of_clouds: ClassVar[bool] = True
    of_loads: ClassVar[frozenset[str]] = frozenset({"workspace_tension_n"})
    cell: Annotated[float, Field(ge=0.0005, le=0.5)] = 0.01
    """Side of a cell over the straight length."""
    count: Annotated[int, Field(ge=16, le=4_194_304)] = 8192
    """With `tension_n`: number of loads."""
    tension_n: dict[str, Positive] | None = None
    """Largest tension of each cable that is driven, N; absent: the loads are the study's own cloud."""
    safety: Annotated[float, Field(ge=0)] | None = None
    """Safety factor against yield of what counts; 0: all do.  Absent: 1, or that of the study's cloud."""

    def quantities(self) -> list[Quantity]:
        cell = f"cells of {100 * self.cell:g} % of the length"
        return [
            Quantity("workspace_area_m2", "A", "m^2", f"area reached by the tip disk's centre, {cell}"),
            Quantity(
                "workspace_half_share",
                "",
                "1",
                "share of that area that the first half of the loads reaches: convergence",
            ),
            Quantity("workspace_hull_m2", "", "m^2", "area inside the outline (convex hull) of all points reached"),
            Quantity("workspace_width_m", "", "m", "extent of all points reached across the manipulator"),
            Quantity("workspace_failed", "", "1", "share of the loads that have no equilibrium"),
            Quantity("workspace_beyond_yield", "", "1", "share of the loads nearer to yield than the safety asked for"),
            Quantity("workspace_tension_n", "T_max", "N", "highest tension of a cable among the loads that count"),
            Quantity("workspace_loads", "", "1", "number of loads that count: solved, and not too near to yield"),
            Quantity("workspace_dropped", "", "1", "share of the loads that do not count"),
            Quantity("workspace_coarse_m2", "", "m^2", "that area in cells twice as wide: how far it depends on them"),
            Quantity(
                "workspace_extrapolated_m2", "A_0", "m^2", "that area extrapolated to cells of no size, from both"
            ),
        ]

    def problems(self, manipulator: Manipulator, cloud: bool) -> Iterator[str]:
        yield from super().problems(manipulator, cloud)
        if not cloud and self.tension_n is None:
            yield "needs tension_n, as there is no cloud of loads"
        if self.safety is not None and self.tension_n is None:
            yield "safety goes with tension_n; that of the study's own loads is said in [cloud]"

    def lacking(self, manipulator: Manipulator) -> dict[str, str]:
        field = lacking_for_stress(manipulator, to_yield=True)
        return {"workspace_beyond_yield": field} if field else {}

    def values(self, case: Solved) -> Sequence[float]:
        tips, safety = case.tips, case.safety
        if tips is None or self.tension_n is not None:
            drawn = self.tension_n or {}
            limits = {name: tension for name, tension in drawn.items() if case.chain.reach[case.cable(name)]}
            safety = 1.0 if self.safety is None else self.safety
            tips = tips_reached(case.manipulator, case.chain, limits, self.count, safety)
        told = not self.lacking(case.manipulator) and bool(np.isfinite(tips.strain).any())
        yielding = float(np.mean(tips.beyond(case.manipulator, safety or 1.0))) if told else np.nan
        tips = tips.without(tips.beyond(case.manipulator, safety))
        x, y, good = tips.x, tips.y, tips.solved
        half, side = len(x) // 2, self.cell * case.chain.length
        whole, coarse = area(x, y, side), area(x, y, 2 * side)
        share = area(x[:half], y[:half], side) / whole if whole else np.nan
        hull, width = outline(x[tips.corner], y[tips.corner])
        counted = np.isfinite(x)
        return (
            whole,
            share,
            hull,
            width,
            float(np.mean(~good)),
            yielding,
            float(np.fmax.reduce(tips.pull)),
            float(counted.sum()),
            float(np.mean(~counted)),
            coarse,
            extrapolated(whole, coarse),
        )


class Follow(Metric):
    """How well a disk follows the targets of the study's `[reach]`, from one to the next, and with what tensions."""

    kind: Literal["follow"]
    of_paths: ClassVar[bool] = True

    def quantities(self) -> list[Quantity]:
        return [
            Quantity("reached_share", "", "1", "share of the targets that are reached"),
            Quantity("first_missed", "", "1", "number of the first target that is not reached; empty: none"),
            Quantity("farthest_off_m", "", "m", "largest distance of the disk from its target"),
            Quantity("most_turned_off_rad", "", "rad", "largest angle between the disk and its target"),
            Quantity("highest_tension_n", "T_max", "N", "highest tension of a cable on the way"),
            Quantity("highest_sum_n", "", "N", "highest sum of the tensions on the way"),
            Quantity("reachable_share", "", "1", "share of the targets reached on the way or, alone, from rest"),
        ]

    def values(self, case: Solved) -> Sequence[float]:
        places = case.targets[0].place(case.states)
        wanted, asked = (np.array([getattr(target, name) for target in case.targets]) for name in ("wanted", "asked"))
        off = np.where(asked, places - wanted, 0.0)
        good = case.states.outcome == Outcome.CONVERGED
        reached = good & [target.reached(place) for target, place in zip(case.targets, places, strict=True)]
        missed = np.flatnonzero(~reached)
        return (
            float(reached.mean()),
            float(missed[0] + 1) if len(missed) else np.nan,
            float(np.hypot(off[:, 0], off[:, 1]).max()),
            float(np.abs(off[:, 2]).max()),
            float(case.loads.tension.max()),
            float(case.loads.tension.sum(1).max()),
            float(np.mean(reached | np.array(case.from_rest))),
        )
