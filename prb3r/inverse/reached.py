"""What comes of a search for tensions, and how it is told."""

from dataclasses import dataclass

import numpy as np
import pandas as pd

from prb3r.inverse.target import COORDINATES

IS_REACHED, BEYOND_YIELD, NOT_REACHED, NO_PULL = "reached", "beyond yield", "not reached", "no equilibrium"
"""Outcomes of a target; beyond yield the disk would come there if plates could take any stress, which they cannot."""


@dataclass(frozen=True)
class Reached:
    """Tensions that bring a disk along its targets, or as near as it comes."""

    steps: pd.DataFrame
    """A table of steps, as `solve` takes it: tensions and, where friction is declared, slips."""
    table: pd.DataFrame
    """A row for each target: `step, disk`, what was wanted (`wanted_x_m`, ...), where the disk comes (`x_m`, ...),
    `distance_m`, `turn_off_rad`, `total_n` (the sum of the tensions), `peak_stress_pa` and `safety_factor` (of
    the plates against yield, as far as the manipulator tells), `reached`, its `outcome` (`reached`, `beyond yield`,
    `not reached` or `no equilibrium`), and a `note`."""

    @property
    def reached(self) -> bool:
        """Whether every target is reached, within the tolerance of the search, be it beyond yield."""
        return bool(self.table["reached"].all())

    @property
    def beyond_yield(self) -> int:
        """Number of targets that are reached by pulls which make plates yield."""
        return int((self.table["outcome"] == BEYOND_YIELD).sum())

    @property
    def sentences(self) -> list[str]:
        """A sentence for each target: the force that it is reached with, or how near the disk comes."""
        return [_sentence(row) for row in self.table.to_dict("records")]


def _sentence(row: dict) -> str:
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
    """How far the plates are from yield, or what is known of their stress."""
    if row["safety_factor"] < 1:
        return f", beyond yield: safety factor {row['safety_factor']:.3g}"
    if np.isfinite(row["safety_factor"]):
        return f", safety factor {row['safety_factor']:.3g}"
    return f", highest stress {1e-6 * row['peak_stress_pa']:.4g} MPa" if row["peak_stress_pa"] > 0 else ""


def _in_words(place: list[float]) -> str:
    parts = [
        f"{name.split('_')[0]} {value:.5g} {name.split('_')[1]}"
        for name, value in zip(COORDINATES, place, strict=True)
        if np.isfinite(value)
    ]
    return ", ".join(parts)
