"""Spec of requirements that designs must keep, and of preferences that rank the designs which keep them."""

from abc import ABC, abstractmethod
from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import Field, model_validator

from prb3r.errors import Problem, SpecError
from prb3r.model.files.numbers import Positive
from prb3r.model.files.toml import read_toml
from prb3r.model.manipulator import Strict

Scalar = float | int | str | bool
"""A value of a factor or a column."""


class Criterion(Strict, ABC):
    """One number of a design: a column of its cases, over those of them that count."""

    metric: str
    """A column of the cases."""
    over: Literal["worst", "mean", "median", "quantile"] = "worst"
    """The cases of a design: the worst of them, or a statistic of all."""
    quantile: Annotated[float, Field(ge=0, le=1)] | None = None
    """With `over = "quantile"`: the share of the cases that lie below; of the rigs, where rigs are drawn."""
    where: dict[str, Scalar | list[Scalar]] = {}
    """Cases that count, such as `{ broken_cables = "" }`; of a list, any of its values."""
    words: str = ""
    """The number in words, as the subject of a sentence: `coupling of Segment 2 into Segment 1`."""

    @model_validator(mode="after")
    def _quantile_where_asked(self) -> "Criterion":
        if (self.over == "quantile") != (self.quantile is not None):
            raise ValueError("over = 'quantile' and a quantile, such as quantile = 0.05, go together")
        return self

    @property
    @abstractmethod
    def sign(self) -> float:
        """+1 where more is better, -1 where less is better."""

    def value(self, values: np.ndarray, rig: np.ndarray | None = None) -> float:
        """The number of a design from the `values` (cases,) of its column, NaN being cases without a value.

        A case without a value counts as infinitely bad.  The result is NaN if there are no cases.

        Parameters
        ----------
        rig : (cases,) number of the rig that each case is of, where rigs are drawn: a quantile is over rigs then, each
            at the worst of its cases.
        """
        if not len(values):
            return np.nan
        scores = np.where(np.isnan(values), -np.inf, self.sign * values)
        if rig is not None and self.over == "quantile":
            order = np.argsort(rig, kind="stable")
            scores = np.minimum.reduceat(scores[order], np.unique(rig[order], return_index=True)[1])
        if np.isneginf(scores).all() or (self.over == "mean" and np.isneginf(scores).any()):
            return -self.sign * np.inf
        if self.over in ("worst", "mean"):
            return self.sign * float(scores.min() if self.over == "worst" else scores.mean())
        share = 0.5 if self.quantile is None else self.quantile if self.sign > 0 else 1 - self.quantile
        if np.isfinite(scores).all():
            return self.sign * float(np.quantile(scores, share))
        return self.sign * float(np.quantile(scores, share, method="lower"))  # nothing lies between a number and none


class Requirement(Criterion):
    """A bound that a design must keep."""

    at_least: float | None = None
    at_most: float | None = None

    @model_validator(mode="after")
    def _one_bound(self) -> "Requirement":
        if (self.at_least is None) == (self.at_most is None):
            raise ValueError("give one of at_least and at_most")
        return self

    @property
    def sign(self) -> float:
        return 1.0 if self.at_least is not None else -1.0

    @property
    def limit(self) -> float:
        """The bound, `at_least` or `at_most`."""
        return self.at_most if self.at_least is None else self.at_least  # type: ignore[return-value]

    def margin(self, value: float) -> float:
        """Distance of `value` inside the bound (negative: outside), as a share of the bound, or in its unit if it is 0.

        -inf where `value` is NaN.
        """
        if np.isnan(value):
            return -np.inf
        return self.sign * (value - self.limit) / (abs(self.limit) or 1.0)


class Preference(Criterion):
    """A column of which more, or less, is wanted."""

    better: Literal["greater", "less"]
    weight: Positive = 1.0
    """What the way from the worst to the best of the designs to choose from is worth, against that of the others."""

    @property
    def sign(self) -> float:
        return 1.0 if self.better == "greater" else -1.0


class Designs(Strict):
    """What tells designs apart; the other factors are the circumstances in which all of them are looked at."""

    factors: list[str]


class Wishes(Strict):
    """A file for `prb3r compare --requirements`: what designs must keep, and what is wanted of them beyond that."""

    designs: Designs | None = None
    requirement: list[Requirement] = []
    preference: list[Preference] = []

    @property
    def criteria(self) -> list[Criterion]:
        """All requirements and then all preferences, each in the order of the file."""
        return [*self.requirement, *self.preference]

    @property
    def placed(self) -> list[tuple[tuple[str, int], Criterion]]:
        """Requirements, then preferences, with their keys in the file: `requirement` or `preference`, number from 0."""
        return [((key, k), wish) for key in ("requirement", "preference") for k, wish in enumerate(getattr(self, key))]

    @property
    def given(self) -> bool:
        """Whether there is any requirement or preference."""
        return bool(self.requirement or self.preference)


def load_wishes(path: str | Path) -> Wishes:
    """Read a file of requirements and preferences.

    Raises
    ------
    SpecError
        With every problem of the file and its line, or if the file has no requirement, preference or designs.
    """
    wishes = read_toml(path, Wishes)
    if not wishes.given and wishes.designs is None:
        raise SpecError(Problem(str(path), "wants nothing of designs: give [[requirement]] or [[preference]]"))
    return wishes


def plain_text(value: Any) -> str:
    """A value of a factor as text, numbers with six digits."""
    return f"{value:.6g}" if isinstance(value, (int, float)) else str(value)
