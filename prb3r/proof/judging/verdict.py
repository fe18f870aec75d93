"""Verdicts: what a method says of a recording."""

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
    """Parameters that are not fitted: plate, cable, law."""
    parameters: Mapping[str, tuple[float, float | None, float | None]] = field(default_factory=dict)
    """Fitted value, and the ends of its interval or None, of each free parameter."""
    sets: Mapping[str, Sequence[Any]] = field(default_factory=dict)
    """All values of each place parameter that cannot be told from the best one."""
    rivals: tuple[tuple[str, Mapping[str, Any], float, float], ...] = ()
    """Effects of other kinds that cannot be told apart: kind, place, squared distance, and by how much chi-square with
    its penalty is larger."""
    partial: bool = False
    """Whether the effect helps without explaining all."""


@dataclass(frozen=True)
class ExperimentClaim:
    """An experiment that is to tell two explanations apart."""

    names: tuple[str, str]
    """Names of the two effects, or of the sets of effects by which two models differ."""
    separation: float
    """Squared distance of the two explanations that it promises."""
    steps: tuple[Mapping[str, float], ...]
    """Load columns of each step."""


@dataclass(frozen=True)
class Verdict:
    """The verdict of a method on a recording, with the numbers that scores need."""

    case: int
    """Number of the recording in its run."""
    method: str
    verdict: str
    """The word of the diagnosis (`adequate`, `explained`, `ambiguous`, ...), or `failed`."""
    named: tuple[Claim, ...] = ()
    reduced: tuple[float, float] = (np.nan, np.nan)
    """Chi-square per degree of freedom of calibration alone and of the explanation."""
    largest: tuple[float, float, float, float] = (np.nan,) * 4
    """Largest score z and its threshold, for the residuals of calibration, then for those of the explanation."""
    chi2: tuple[float, float] = (np.nan, np.nan)
    """Chi-square of the explanation, and its threshold."""
    heldout: tuple[float, float, int] | None = None
    """Squared whitened error on held-out sequences by calibration alone and by the explanation, and the number of
    readings."""
    calibrated: tuple[float, float] = (0.0, 0.0)
    """ln of the factors on E and mu by calibration alone."""
    explained: tuple[float, float] = (0.0, 0.0)
    """ln of the factors on E and mu with the explanation."""
    loading: tuple[float, float, float] | None = None
    """From the loading-only sequences: ln of the factors on E and mu, and the p-value of chi-square."""
    models: tuple[tuple[str, ...], ...] = ()
    """Names of the effects of every surviving model, most probable model first."""
    setup: tuple[tuple[str, ...], ...] = ()
    """For each blunder that is said: its sentence, and those of the blunders that look the same."""
    noise: float = np.nan
    """Estimated factor on the stated noise."""
    elsewhere: tuple[Forecast, ...] = ()
    """Predictions at the targets that were asked for."""
    forecasting: float = 0.0
    """Processor time that these took, s."""
    proposals: tuple[ExperimentClaim, ...] = ()
    remarks: tuple[str, ...] = ()
    seconds: float = 0.0
    """Processor time, without that of forecasts, s."""
    reason: str = ""
    """Why there is no verdict, if it failed."""
