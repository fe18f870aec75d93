"""Spec of the distributions that values of sampled factors are drawn from."""

from abc import ABC, abstractmethod
from typing import Annotated

import numpy as np
import scipy
from pydantic import Field, model_validator

from prb3r.model.files.numbers import Positive
from prb3r.model.manipulator import Strict


class Distribution(Strict, ABC):
    """What a sampled factor is drawn from."""

    @abstractmethod
    def values(self, share: np.ndarray, neutral: float) -> np.ndarray:
        """Quantiles of the distribution at each `share`, from 0 to 1.

        Parameters
        ----------
        neutral : mean or median of a distribution that gives none.
        """


class Interval(Distribution):
    """The ends between which a factor is sampled, all values alike likely, or searched."""

    low: float
    high: float
    step: Positive | None = None
    """Only low, low + step, and so on up to high: numbers of plates, thicknesses of sheets."""

    @model_validator(mode="after")
    def _ordered(self) -> "Interval":
        if not self.low < self.high:
            raise ValueError(f"low ({self.low:g}) must be less than high ({self.high:g})")
        if self.step is not None and self.step > self.high - self.low:
            raise ValueError(f"a step of {self.step:g} leaves low ({self.low:g}) alone; give a shorter one")
        return self

    @property
    def steps(self) -> int:
        """Number of steps from `low` up to `high`; 0 without `step`, where any value between them is allowed."""
        return 0 if self.step is None else int((self.high - self.low) / self.step * (1 + 1e-9))

    def values(self, share: np.ndarray, neutral: float = 0.0) -> np.ndarray:
        if self.step is None:
            return self.low + (self.high - self.low) * share
        return self.low + self.step * np.minimum(np.floor(share * (self.steps + 1)), self.steps)


class Normal(Distribution):
    """A normal distribution, cut off at `low` and `high` where they are given."""

    mean: float | None = None
    """Absent: 0 where it is added, 1 where it multiplies."""
    sd: Positive
    """Standard deviation."""
    low: float | None = None
    """Nothing lies below it."""
    high: float | None = None
    """Nothing lies above it."""

    @model_validator(mode="after")
    def _ordered(self) -> "Normal":
        if self.low is not None and self.high is not None and not self.low < self.high:
            raise ValueError(f"low ({self.low:g}) must be less than high ({self.high:g})")
        return self

    def values(self, share: np.ndarray, neutral: float) -> np.ndarray:
        mean = neutral if self.mean is None else self.mean
        if self.low is None and self.high is None:
            return scipy.stats.norm.ppf(share, mean, self.sd)
        low, high = (-np.inf if self.low is None else self.low), (np.inf if self.high is None else self.high)
        return scipy.stats.truncnorm.ppf(share, (low - mean) / self.sd, (high - mean) / self.sd, mean, self.sd)


class Lognormal(Distribution):
    """A distribution whose logarithm is normal: of what is positive and known within a factor."""

    median: Positive | None = None
    """Absent: 1 where it multiplies."""
    sd: Positive
    """Standard deviation of the natural logarithm: 0.1 is about 10 %."""

    def values(self, share: np.ndarray, neutral: float) -> np.ndarray:
        return scipy.stats.lognorm.ppf(share, self.sd, scale=self.median or neutral)


class Alternatives(Distribution):
    """Some alternatives, all alike likely."""

    count: Annotated[int, Field(ge=1)]

    def values(self, share: np.ndarray, neutral: float = 0.0) -> np.ndarray:
        """The number of an alternative, from 0, as a float, at each `share` from 0 to 1."""
        return np.minimum(np.floor(share * self.count), self.count - 1)
