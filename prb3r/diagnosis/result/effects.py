"""What accounts for a misfit: effects by name with their rivals, an empirical law, or where it sits at least."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np

from prb3r.diagnosis.result.statements import Estimate
from prb3r.diagnosis.search.experiment import Experiment
from prb3r.model.effects.empirical import EmpiricalMoment


class ProfileCurve(NamedTuple):
    """Rise of chi-square as a parameter leaves its best value, all others refitted."""

    value: np.ndarray
    """(k,) of the parameter, in its unit."""
    rise: np.ndarray
    """(k,) of chi-square, at `value`."""
    fine_value: np.ndarray
    """(m,) values between; empty where only the best value is known."""
    fine_rise: np.ndarray
    """(m,) interpolated at `fine_value`."""


@dataclass(frozen=True)
class RivalEffect:
    """An effect of another kind that cannot be told from a named one."""

    name: str
    kind: str
    place: Mapping[str, Any]
    distance: float
    """Squared whitened distance from the explanation's prediction to the nearest of the rival's."""
    behind: float
    """How much worse it fits: chi-square with its penalty."""
    parameters: Mapping[str, float] = field(default_factory=dict)
    """The values that it would have to have, by which a reader judges whether it can be."""


@dataclass(frozen=True, eq=False)
class NamedEffect:
    """An effect that a diagnosis names."""

    name: str
    """Kind and place as one text."""
    kind: str
    place: Mapping[str, Any]
    """Parameters that are not fitted: plate, cable, law."""
    among: Mapping[str, tuple[Any, ...]]
    """All values of a place that cannot be told from the best one."""
    parameters: Mapping[str, Estimate]
    profiles: Mapping[str, ProfileCurve] = field(repr=False)
    """Of the parameters that have an interval."""
    statement: str
    rivals: tuple[RivalEffect, ...]
    probability: float
    """That an effect of its kind is there, over all surviving models and places."""
    certain: bool
    """Whether nearly every surviving model has it."""
    delta_bic: float
    """Negative: better with the effect than without."""
    heldout_gain: float | None
    """Share of the excess squared error on held-out sequences that this effect removes."""
    partial: bool
    """Whether it helps without explaining all."""


@dataclass(frozen=True)
class Mismatch:
    """Where the calibrated model misses, and what that depends on."""

    plates: tuple[int, ...]
    sequences: tuple[str, ...]
    depends_on: tuple[str, ...]
    statement: str


@dataclass(frozen=True)
class FittedLaw:
    """An empirical law that describes what no effect explains."""

    effect: EmpiricalMoment
    statement: str
    reduced_chi2: float
    heldout_gain: float | None
    """Share of the excess squared error on held-out sequences that it removes."""
    beside_named: bool
    """Whether the named effects are kept beside it."""


class Separation(NamedTuple):
    """Two rival explanations by name, and the load program that tells them apart best."""

    first: str
    second: str
    experiment: Experiment
