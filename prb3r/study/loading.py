"""Spec of loads other than steps: a cloud of independent loads, a sweep of one column, a path of targets."""

import itertools
from typing import Annotated, Literal

from pydantic import Field, model_validator

from prb3r.inverse.pull import Least
from prb3r.model.files.numbers import Positive
from prb3r.model.manipulator import Strict


class Cloud(Strict):
    """Many independent loads on one case: tensions drawn by a Sobol sequence, each ramped from rest."""

    count: Annotated[int, Field(ge=16, le=4_194_304)]
    """Number of loads."""
    tension_n: dict[str, Positive]
    """Largest tension of each cable that is driven, N."""
    limit: Literal["tension", "bend"] = "tension"
    """`bend`: instead, each cable is driven up to where it alone bends the last segment that it drives by `bend_rad`,
    which is sought up to 20 times `tension_n`."""
    bend_rad: Positive | None = None
    """With `limit = "bend"`: that bend, rad."""
    safety: Annotated[float, Field(ge=0)] = 1.0
    """Loads that bring a plate nearer to yield than this factor are left out, where `yield_stress_pa` is given; 0: all
    loads count."""

    @model_validator(mode="after")
    def _consistent(self) -> "Cloud":
        if self.limit == "bend" and self.bend_rad is None:
            raise ValueError("limit = 'bend' needs bend_rad, the largest bend of a segment")
        return self


class LoadSweep(Strict):
    """Load steps of one column, after all others: from turning point to turning point in equal parts."""

    column: Annotated[str, Field(min_length=1)]
    """Such as `cable_1_n`."""
    turns: Annotated[list[float], Field(min_length=1)]
    """Values that it is brought to, one after the other; it starts where the steps before have left it."""
    count: Annotated[int, Field(ge=1, le=10_000)]
    """Steps from one turning point to the next."""

    @model_validator(mode="after")
    def _turning(self) -> "LoadSweep":
        if any(turn == next_turn for turn, next_turn in itertools.pairwise(self.turns)):
            raise ValueError("turns must differ from one to the next")
        return self


class DiskPlace(Strict):
    """Where a disk should be; what is left out is free."""

    x_m: float | None = None
    """Along the straight manipulator, m."""
    y_m: float | None = None
    """Across the manipulator, m."""
    angle_rad: float | None = None
    """Angle of the disk, rad."""

    @model_validator(mode="after")
    def _somewhere(self) -> "DiskPlace":
        if not self.model_dump(exclude_none=True):
            raise ValueError("say where to: x_m and y_m, angle_rad, or all of them")
        return self


class TargetPath(Strict):
    """Tensions of least sum, or of least stress, that bring a disk from target to target, in place of steps."""

    disk: Annotated[int, Field(ge=1)] | Literal["tip"] = "tip"
    path: str | None = None
    """A table of x_m, y_m, angle_rad, one target after the other; relative to the study file."""
    target: Annotated[list[DiskPlace], Field(min_length=1)] | None = None
    """Instead: targets one after the other."""
    count: Annotated[int, Field(ge=1, le=10_000)] = 1
    """Targets from each one of `target` to the next, in equal parts."""
    most_n: Positive | None = None
    """Largest tension of a cable, N; absent: where it alone would bend what it drives by a whole turn."""
    least: Least = "force"
    """What is least of all pulls that lead to a target: the sum of the tensions, or the highest stress of a plate."""

    @model_validator(mode="after")
    def _consistent(self) -> "TargetPath":
        if (self.path is None) == (self.target is None):
            raise ValueError("give one of path and target")
        kinds = {tuple(place.model_dump(exclude_none=True)) for place in self.target or ()}
        if self.count > 1 and len(kinds) > 1:
            raise ValueError("between targets that ask for different coordinates lies nothing: leave out count")
        return self
