"""Targets: where a disk should be, how far a state is from there, and how targets are read from tables."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pandas as pd

from prb3r.errors import Problem, SpecError, did_you_mean
from prb3r.mechanics.chain import Chain
from prb3r.mechanics.derivatives.sensitivity import Sensitivities
from prb3r.mechanics.equilibrium import Equilibria
from prb3r.model.files.cells import blank_rows, number_problems, numbers
from prb3r.model.files.table import read_table

COORDINATES = ("x_m", "y_m", "angle_rad")
"""Coordinates that can be asked of a disk, in the order of all arrays here."""
ARRIVED = 1e-6
"""A target is reached within this norm of its errors, in straight lengths and rad: a thousandth of what a camera reads,
and a thousand times what equilibria are solved to."""
FARTHEST_SOUGHT = 1e3
"""Norm of a scaled target beyond which the disk is brought toward another one of this norm in the same direction.  The
point nearest to that one is, of what can be reached, the nearest to the target within a thousandth of the length; of
distances much larger rounding leaves too little.  At 1e9 m the point found was 14 mm behind the nearest one."""
FAR_LENGTHS = 20.0
"""Distance of a target, in lengths of the manipulator, beyond which it is most likely given in millimetres.  Choice."""
COILED_RAD = 3 * math.pi
"""Angle of a target, rad, beyond which it is most likely given in degrees, if it is beyond `most_turned` too.
Choice."""


@dataclass(frozen=True)
class Target:
    """A place and an angle that one disk is to be brought to; either may be left free."""

    disk: int
    """Number of the disk, 1 to n."""
    wanted: np.ndarray
    """(3,) wanted x, y (m) and angle (rad); NaN where a coordinate is free."""
    length: float
    """Straight length of the manipulator, m: it makes distances and angles comparable."""

    @property
    def asked(self) -> np.ndarray:
        """(3,) whether x, y and the angle are asked for, or else free."""
        return np.isfinite(self.wanted)

    @property
    def scale(self) -> np.ndarray:
        """(3,) divisors of the errors in x, y and angle: the straight length, m, for x and y, and 1 rad."""
        return np.array([self.length, self.length, 1.0])

    @property
    def row(self) -> dict[str, float]:
        """The coordinates by name, m and rad; NaN where free."""
        return dict(zip(COORDINATES, self.wanted.tolist(), strict=True))

    @property
    def sought(self) -> "Target":
        """The target that a search takes for this one: itself or, beyond `FARTHEST_SOUGHT`, one so near that way."""
        far = np.linalg.norm((self.wanted / self.scale)[self.asked]) / FARTHEST_SOUGHT
        return self if far <= 1 else replace(self, wanted=self.wanted / far)

    def place(self, states: Equilibria) -> np.ndarray:
        """(s, 3) x and y (m) and angle (rad) of the disk in each of `s` states."""
        return np.stack([states.x[:, self.disk], states.y[:, self.disk], states.angle[:, self.disk]], 1)

    def off(self, place: np.ndarray) -> np.ndarray:
        """(..., k) scaled errors of the `k` coordinates asked for, reached less wanted: shares of the length and rad.

        `place` (..., 3) holds x, y (m) and angle (rad) of the disk.
        """
        return ((place - self.wanted) / self.scale)[..., self.asked]

    def off_in_words(self, place: np.ndarray) -> str:
        """How far a place (3,) of the disk is off the coordinates asked for: `3.1 mm and 0.02 rad`."""
        off = np.where(self.asked, place - self.wanted, 0.0)
        parts = [f"{1e3 * float(np.hypot(off[0], off[1])):.3g} mm"] if self.asked[:2].any() else []
        return " and ".join([*parts, *([f"{abs(off[2]):.3g} rad"] if self.asked[2] else [])])

    def rate(self, derivatives: Sensitivities) -> np.ndarray:
        """(k, p) derivatives of :meth:`off` by `p` parameters at the last step, per unit of each."""
        disk = np.stack([field[-1, self.disk] for field in (derivatives.dx, derivatives.dy, derivatives.dangle)])
        return (disk / self.scale[:, None])[self.asked]

    def reached(self, place: np.ndarray) -> bool:
        """Whether a place (3,) of the disk meets the target within `ARRIVED`."""
        return bool(np.linalg.norm(self.off(place)) <= ARRIVED)


def targets_of(chain: Chain, disk: int | str, wanted: dict[str, float], path: pd.DataFrame | str | Path | None):
    """The targets (`list[Target]`) in order: the one with the coordinates `wanted`, or one for each row of `path`.

    Raises
    ------
    SpecError
        With everything that is wrong.
    """
    problems, rows = [], []
    number = chain.plates if disk == "tip" else disk
    if not isinstance(number, int) or not 1 <= number <= chain.plates:
        problems.append(Problem("disk", f"there is no disk {disk!r} to bring anywhere; 1 to {chain.plates}, or tip"))
    if path is not None and wanted:
        problems.append(Problem(_place_of(path), f"a path and {', '.join(wanted)} exclude each other"))
    try:
        rows = target_rows(pd.DataFrame([wanted]) if path is None else path)
    except SpecError as error:
        problems += error.problems
    if problems:
        raise SpecError(*problems)
    return chain_targets(chain, int(number), rows)


def out_of_reach(chain: Chain, rows: Sequence[Mapping[str, float]]) -> list[str]:
    """What is said of targets that are far out of reach, most likely in another unit: words for each coordinate of
    which there is such a target."""
    farthest = {
        name: max((row[name] for row in rows if np.isfinite(row.get(name, np.nan))), key=abs, default=0.0)
        for name in COORDINATES
    }
    said = [
        f"{name} = {value:g} m is far beyond the manipulator, which is {chain.length:.3g} m long; "
        f"lengths are given in metres: {value:g} mm is {value / 1e3:g}"
        for name, value in farthest.items()
        if name != "angle_rad" and abs(value) > FAR_LENGTHS * chain.length
    ]
    if abs(angle := farthest["angle_rad"]) > max(COILED_RAD, most_turned(chain)):
        right = f"angles are given in radians: {angle:g} degrees is {math.radians(angle):.4g}"
        said.append(f"angle_rad = {angle:g} rad is {abs(angle) / (2 * math.pi):.2g} turns; {right}")
    return said


def most_turned(chain: Chain) -> float:
    """Angle, rad, by which evenly bent plates turn the tip where the cables of least offset are drawn in wholly.

    On a plate of length l that is a bend of l over the offset, or less where its clamps are rigid.
    """
    crossed = np.arange(chain.plates)[:, None] < chain.reach
    arm = np.where(crossed & (chain.offset != 0), np.abs(chain.offset), np.inf).min(1)
    return float(np.sum((chain.arc + 2 * chain.clamp) / arm))


def chain_targets(chain: Chain, disk: int, rows: list[dict[str, float]]) -> list[Target]:
    """A target of a disk of a chain for each of `rows`, which name the coordinates that are asked for."""
    return [Target(disk, np.array([row.get(name, np.nan) for name in COORDINATES]), chain.length) for row in rows]


def target_rows(table: pd.DataFrame | str | Path) -> list[dict[str, float]]:
    """The coordinates that each row of a table, or of the file that holds it, asks for: name to value, m or rad.

    Raises
    ------
    SpecError
        With everything that is wrong.
    """
    where = _place_of(table)
    frame = (table if isinstance(table, pd.DataFrame) else read_table(table)).reset_index(drop=True)
    frame, problems = frame[~blank_rows(frame)], []
    for name in frame:
        if name in COORDINATES:
            problems += number_problems(frame[name], f"{where} column {name}")
        elif name != "step":
            problems.append(Problem(where, f"unknown column {name!r}{did_you_mean(str(name), COORDINATES)}"))
    if problems:
        raise SpecError(*problems)
    columns = {name: numbers(frame[name]).to_numpy() for name in COORDINATES if name in frame}
    rows = [
        {name: float(column[k]) for name, column in columns.items() if np.isfinite(column[k])}
        for k in range(len(frame))
    ]
    if not all(rows) or not rows:
        raise SpecError(Problem(where, "say where to: x_m and y_m, angle_rad, or all of them"))
    return rows


def _place_of(path: pd.DataFrame | str | Path) -> str:
    """How messages name the table of a path: by its file, or `path`."""
    return "path" if isinstance(path, pd.DataFrame) else str(path)
