"""What a method says of a recording."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from prb3r.proof.judging.forecast import Forecast


@dataclass(frozen=True)
class Claim:
    """One effect that a verdict names."""

    kind: str
    place: Mapping[str, Any]
    parameters: Mapping[str, tuple[float, float | None, float | None]] = field(default_factory=dict)
    """Value, low and high."""
    sets: Mapping[str, Sequence[Any]] = field(default_factory=dict)
    """Places that are not told apart."""
    rivals: tuple[tuple[str, Mapping[str, Any], float, float], ...] = ()
    """Kind, place, squared distance, and how much worse they fit."""
    partial: bool = False


@dataclass(frozen=True)
class ExperimentClaim:
    """An experiment that is to tell two explanations apart."""

    names: tuple[str, str]
    """Of the two effects."""
    separation: float
    """Squared distance that it promises."""
    steps: tuple[Mapping[str, float], ...]
    """Load columns of each step."""


@dataclass(frozen=True)
class Verdict:
    """What a method says of a recording."""

    case: int
    method: str
    verdict: str
    """That of the diagnosis, or `failed`."""
    named: tuple[Claim, ...] = ()
    reduced: tuple[float, float] = (np.nan, np.nan)
    """Chi-square per degree of freedom, calibrated and explained."""
    largest: tuple[float, float, float, float] = (np.nan,) * 4
    """Largest z and its threshold, of what calibration leaves and of what the explanation leaves."""
    chi2: tuple[float, float] = (np.nan, np.nan)
    """Of the explanation, and its threshold."""
    heldout: tuple[float, float, int] | None = None
    """Squared whitened error on held-out sequences, calibrated and explained, and the number of readings."""
    calibrated: tuple[float, float] = (0.0, 0.0)
    """ln of the factors on E and mu."""
    explained: tuple[float, float] = (0.0, 0.0)
    loading: tuple[float, float, float] | None = None
    """From the sequences with loading only: ln of the factors on E and mu, and the chance of so large a chi-square."""
    models: tuple[tuple[str, ...], ...] = ()
    """Effects by name of every surviving model, most probable first."""
    setup: tuple[tuple[str, ...], ...] = ()
    """Of each blunder that is said: it, and those that look the same."""
    noise: float = np.nan
    """Factor that is found on the stated noise."""
    elsewhere: tuple[Forecast, ...] = ()
    """At the targets that were asked for."""
    forecasting: float = 0.0
    """Time of a processor that these took, s."""
    proposals: tuple[ExperimentClaim, ...] = ()
    remarks: tuple[str, ...] = ()
    seconds: float = 0.0
    """Of a processor, without what forecasts took."""
    reason: str = ""
