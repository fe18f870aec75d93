"""What accounts for a misfit, as plain data: named effects with their rivals, an empirical law, or at least where the
misfit sits."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np

from prb3r.diagnosis.result.numbers import FittedModel
from prb3r.diagnosis.result.statements import Estimate
from prb3r.diagnosis.search.experiment import Experiment
from prb3r.model.effects.empirical import EmpiricalMoment


class ProfileCurve(NamedTuple):
    """The profile of a parameter: the rise of chi-square as the parameter leaves its best value and all others are
    refitted."""

    value: np.ndarray
    """(k,) values of the parameter, in its unit."""
    rise: np.ndarray
    """(k,) rise of chi-square at `value`."""
    fine_value: np.ndarray
    """(m,) values of the smooth curve, in the unit of the parameter; empty where only the best value is known."""
    fine_rise: np.ndarray
    """(m,) interpolated rise at `fine_value`."""


@dataclass(frozen=True)
class RivalEffect:
    """An effect of another kind, on parts of another sort or in another form, that cannot be told from a named one."""

    name: str
    """Kind and place as one text."""
    kind: str
    place: Mapping[str, Any]
    """Parameters that are not fitted, by name."""
    distance: float
    """Squared whitened distance from the prediction of the chosen model to the nearest prediction with the rival."""
    behind: float
    """How much worse the model with the rival fits: its chi-square with the penalty on parameters, less that of the
    chosen model."""
    parameters: Mapping[str, float] = field(default_factory=dict)
    """The fitted values that the rival would have to have, by which a reader judges whether it can be; SI units."""


@dataclass(frozen=True, eq=False)
class NamedEffect:
    """An effect that a diagnosis names."""

    name: str
    """Kind and place as one text."""
    kind: str
    place: Mapping[str, Any]
    """Parameters that are not fitted (plate, cable, law), by name."""
    among: Mapping[str, tuple[Any, ...]]
    """For each part of the place, all values that cannot be told from the best one, itself included."""
    parameters: Mapping[str, Estimate]
    """The fitted parameters by name, in SI units."""
    profiles: Mapping[str, ProfileCurve] = field(repr=False)
    """Profiles of the parameters that have one."""
    statement: str
    """What the effect means, in words."""
    rivals: tuple[RivalEffect, ...]
    """Effects that cannot be told from this one, but for the same effect at the places `among` and in other `forms`."""
    probability: float
    """Probability that an effect of this kind is there, over all surviving models and places; of several of one kind,
    that as many are (`Choice.probability_of`)."""
    certain: bool
    """Whether that probability reaches `Settings.certain`, of a recording that is explained, and the effect is not in
    doubt."""
    delta_bic: float
    """Bayesian information criterion with the effect less that without; negative: better with it."""
    heldout_gain: float | None
    """Share of the excess squared error on held-out sequences that the effect removes; None where nothing is held out,
    where the effect is none of the rigs that were, or where there is no fit without it."""
    partial: bool
    """Whether the effect helps without the model explaining all."""
    without: FittedModel | None = field(repr=False)
    """The chosen model without the effect, refitted; None if the fit fails."""
    in_doubt: bool = False
    """Whether the intervals of all its parameters hold the values at which it vanishes, or one of them ends on a bound
    of the search or is one that no rig has, so that something else may be at work."""
    forms: tuple[RivalEffect, ...] = ()
    """Other forms of this effect, such as another law of the plates, that cannot be told from the named one."""


@dataclass(frozen=True)
class Mismatch:
    """Where the model misses, and what the mismatch depends on."""

    plates: tuple[int, ...]
    """Numbers of the plates, from 1, where the mismatch sits or a named effect may sit."""
    sequences: tuple[str, ...]
    """Names of the fitted sequences that show the mismatch."""
    depends_on: tuple[str, ...]
    """Quantities that the mismatch goes with, the strongest first, as keys of `mismatch.GOES_WITH` where it has
    them."""
    statement: str
    """All of this in words."""


@dataclass(frozen=True)
class FittedLaw:
    """An empirical law of missing moments that describes what no effect explains."""

    effect: EmpiricalMoment
    statement: str
    reduced_chi2: float
    """Chi-square per degree of freedom with the law."""
    heldout_gain: float | None
    """Share of the excess squared error on held-out sequences that the law removes; None where it is not known."""
    beside_named: bool
    """Whether the law stands beside the named effects instead of in their place."""


class Separation(NamedTuple):
    """Two rival explanations by name, and the load program that tells them apart best."""

    first: str
    second: str
    experiment: Experiment
