"""The result of a search for tensions: tables of steps and targets, and a sentence for each target."""

from dataclasses import dataclass

import numpy as np
import pandas as pd

from prb3r.inverse.target import COORDINATES
from prb3r.model.manipulator import Manipulator

IS_REACHED, BEYOND_YIELD, NOT_REACHED, NO_PULL = "reached", "beyond yield", "not reached", "no equilibrium"
"""Outcomes of a target; `beyond yield`: the pull that leads there stresses a plate beyond the yield stress."""


@dataclass(frozen=True)
class Reached:
    """Tensions that bring a disk along its targets, or as near to them as it comes."""

    manipulator: Manipulator
    """The one to which the steps belong: broken cables are dead ones, and without effects that go by times, as targets
    have none.  `solve` with it and `steps` finds the places of `table`."""
    steps: pd.DataFrame
    """A table of steps, one for each target, as `solve` takes it: tensions, N, and, where friction is declared, slips.
    Where no pull leads to a stable equilibrium the tensions of the step before are held."""
    table: pd.DataFrame
    """A row for each target: `step, disk`, the coordinates that were wanted (`wanted_x_m`, ...), those where the disk
    comes (`x_m`, ...), its errors `distance_m` and `turn_off_rad`, `total_n` (the sum of the tensions),
    `peak_stress_pa` and `safety_factor` (of the plates against yield, as far as the manipulator tells), `reached`, the
    `outcome` (`reached`, `beyond yield`, `not reached` or `no equilibrium`), and a `note`."""
    applied: str
    """How the tensions have to be applied for cables to slip as declared, where pulling all of them together leads
    elsewhere; else empty."""

    @property
    def reached(self) -> bool:
        """Whether every target is reached within the tolerance of the search, also by pulls beyond yield."""
        return bool(self.table["reached"].all())

    @property
    def beyond_yield(self) -> int:
        """Number of targets that are reached by pulls which make plates yield."""
        return int((self.table["outcome"] == BEYOND_YIELD).sum())

    @property
    def sentences(self) -> list[str]:
        """A sentence for each target: the sum of tensions with which it is reached, or how near the disk comes; and how
        the tensions have to be applied, where that matters."""
        said = [_sentence(row) for row in self.table.to_dict("records")]
        return [*said, self.applied] if self.applied else said


def _sentence(row: dict) -> str:
    """The sentence on a target, from its row of `Reached.table`."""
    wanted = _in_words([row[f"wanted_{name}"] for name in COORDINATES])
    if not np.isfinite(row["x_m"]):
        return f"step {row['step']}: disk {row['disk']} at {wanted}: {row['note']}"
    if row["reached"]:
        note = f"; {row['note']}" if row["note"] else ""
        force = f"{row['total_n']:.4g} N in sum{_strength(row)}"
        return f"step {row['step']}: disk {row['disk']} at {wanted}: reached with {force}{note}"
    asked = [row[name] if np.isfinite(row[f"wanted_{name}"]) else np.nan for name in COORDINATES]
    parts = [f"{1e3 * row['distance_m']:.3g} mm"] if np.isfinite(asked[:2]).any() else []
    parts += [f"{row['turn_off_rad']:.3g} rad"] if np.isfinite(asked[2]) else []
    return (
        f"step {row['step']}: disk {row['disk']} at {wanted} is not reached; nearest is {_in_words(asked)}, "
        f"{' and '.join(parts)} off, with {row['total_n']:.4g} N in sum{_strength(row)}; {row['note']}"
    )


def _strength(row: dict) -> str:
    """Ending of a sentence: the safety factor against yield, else the highest stress; empty if neither is known."""
    if row["safety_factor"] < 1:
        return f", beyond yield: safety factor {row['safety_factor']:.3g}"
    if np.isfinite(row["safety_factor"]):
        return f", safety factor {row['safety_factor']:.3g}"
    return f", highest stress {1e-6 * row['peak_stress_pa']:.4g} MPa" if row["peak_stress_pa"] > 0 else ""


def _in_words(place: list[float]) -> str:
    """The finite coordinates of a place (x, y, angle) with their units: `x 0.4 m, y 0.15 m`."""
    parts = [
        f"{name.split('_')[0]} {value:.5g} {name.split('_')[1]}"
        for name, value in zip(COORDINATES, place, strict=True)
        if np.isfinite(value)
    ]
    return ", ".join(parts)
