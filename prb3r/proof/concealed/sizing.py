"""Effects at multiples of their smallest detectable size, and their distances from all other effects."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from prb3r.proof.concealed.candidates import shaped, twins
from prb3r.proof.concealed.distances import linear_distance, nearest_by_kind
from prb3r.proof.concealed.responses import Response, Responses
from prb3r.proof.rig.effects import RECORDS
from prb3r.proof.rig.effects.candidate import Candidate
from prb3r.proof.settings import SETTINGS


@dataclass(frozen=True)
class SizedEffect:
    """An effect at a size, with its response."""

    candidate: Candidate
    size: float
    """Size in the candidate's unit; 1 where it has none."""
    change: np.ndarray
    """(r + c,) whitened change of the readings."""
    norm: float
    """Norm of what calibration leaves of it."""

    @property
    def effect(self) -> dict[str, Any]:
        """The effect at this size as a table of a manipulator file: kind, place and parameters in SI units."""
        return self.candidate.effect(self.size)

    @property
    def kind(self) -> str:
        """Kind of the effect as manipulator files name it, such as `weakened_plate`."""
        return self.candidate.kind


def effect_of_norm(responses: Responses, candidate: Candidate, norm: float, sign: float) -> SizedEffect | None:
    """The effect at the size, of the given sign, at which calibration leaves `norm` of its change with the full rig.

    A candidate without a size is taken as it is.  None if that size is beyond the candidate's limits, is not met in a
    few secant steps, or leaves no equilibrium.
    """
    if not candidate.sized:
        change = responses.to([candidate.effect(1.0)])
        return None if change is None else SizedEffect(candidate, 1.0, change, responses.norm(change))
    probe = abs(candidate.probe) * sign
    if not candidate.low <= probe <= candidate.high:
        return None
    size, change = probe, responses.to([candidate.effect(probe)])
    for _ in range(SETTINGS.sizes.size_trials):
        if change is None or not (strength := responses.norm(change)):
            return None
        if abs(strength / norm - 1) < SETTINGS.sizes.size_tolerance:
            return SizedEffect(candidate, size, change, strength)
        size *= norm / strength
        if not candidate.low <= size <= candidate.high:
            return None
        change = responses.to([candidate.effect(size)])
    return None


def candidate_of_kind(responses: Responses, kind: str, rng: np.random.Generator) -> Candidate | None:
    """A candidate of a kind (any that is not rare, if empty) at a random place with a random shape; None if the design
    has none."""
    asked = [each for each in responses.groups if not RECORDS[each].rare and kind in ("", each)]
    of_kind = [response for each in asked for response in responses.of_kind(each)]
    if not of_kind:
        return None
    kind = _any_of(sorted({response.kind for response in of_kind}), rng)
    of_kind = [response for response in of_kind if response.kind == kind]
    variant = _any_of(sorted({response.group[0].variant for response in of_kind}), rng)
    of_variant = [response for response in of_kind if response.group[0].variant == variant]
    return shaped(responses.design, _any_of(of_variant, rng).group[0], rng)


def _any_of(options, rng: np.random.Generator):
    return options[int(rng.integers(len(options)))]


def draw_effect(responses: Responses, kind: str, multiple: float, rng: np.random.Generator) -> SizedEffect | None:
    """A random effect of a kind (any, if empty) at a multiple of its smallest detectable size; None if not met."""
    candidate = candidate_of_kind(responses, kind, rng)
    if candidate is None:
        return None
    signs = [1.0] if candidate.low >= 0 else rng.permutation([-1.0, 1.0]).tolist()
    for sign in signs:
        drawn = effect_of_norm(responses, candidate, multiple * SETTINGS.sizes.detectable, sign)
        if drawn is not None:
            return drawn
    return None


def distances_by_kind(
    responses: Responses, drawn: SizedEffect, near: float = SETTINGS.sizes.refitted_below
) -> dict[str, float]:
    """Squared distance to the nearest effect of every other kind, nearly equal laws of other kinds (twins) included.

    Parameters
    ----------
    near : linear distance below which rivals are refitted, see :func:`nearest_by_kind`
    """
    twin = []
    for candidate in twins(responses.design, drawn.candidate, drawn.size):
        if (column := responses.per_unit(candidate)) is not None:
            twin.append(Response((candidate,), column[:, None]))
    return nearest_by_kind(responses, drawn.change, [*responses.of_candidates, *twin], [drawn.kind], near)


def places_near(responses: Responses, drawn: SizedEffect) -> tuple[Any, ...]:
    """Other places of the same kind that cannot be told apart, each with its squared distance in the linear model."""
    out = []
    for response in responses.of_candidates:
        form = response.group[0]
        if form.kind == drawn.kind and form.place != drawn.candidate.place:
            far = round(linear_distance(responses, drawn.change, response), 3)
            if far < SETTINGS.sizes.apart:
                out.append((dict(form.place), far))
    return tuple(out)
