"""The library of effects: physics that real rigs have, each a small class that changes the chain or what is measured.

An effect is switched on by an `[[effect]]` table in a manipulator file.  To add one, write a class with its parameters
and `change(chain, manipulator)` in the file of its family, and test its law against an independent calculation.
"""

from collections.abc import Iterable, Iterator, Sequence
from functools import cache, reduce
from operator import or_
from typing import TYPE_CHECKING, Annotated, get_args

import numpy as np
from pydantic import Field

from prb3r.mechanics.chain import Chain
from prb3r.model.effects import cables, camera, empirical, friction, loads, plates, sections
from prb3r.model.effects.base import Effect, Host, Observation

FAMILIES = (friction, cables, plates, sections, loads, camera, empirical)


def _kinds() -> Iterator[tuple[str, type[Effect]]]:
    """Pairs of kind and class of every effect, in the order in which the files of `FAMILIES` define them."""
    for family in FAMILIES:
        for member in vars(family).values():
            if isinstance(member, type) and issubclass(member, Effect) and member.__module__ == family.__name__:
                yield get_args(member.model_fields["kind"].annotation)[0], member


EFFECT_KINDS: dict[str, type[Effect]] = dict(_kinds())
"""Every effect class by its kind."""


@cache
def in_place_of(first: str, other: str) -> bool:
    """Whether one of two kinds excludes the other (`Effect.instead_of`), so that a manipulator cannot have both."""
    return other in EFFECT_KINDS[first].instead_of or first in EFFECT_KINDS[other].instead_of


if TYPE_CHECKING:
    AnyEffect = Effect
else:
    AnyEffect = Annotated[reduce(or_, EFFECT_KINDS.values()), Field(discriminator="kind")]


def with_effects(chain: Chain, manipulator: Host, effects: Iterable[Effect]) -> Chain:
    """The `chain` of a manipulator with all `effects`, applied in the order of `Effect.late`."""
    for effect in sorted(effects, key=lambda effect: effect.late):
        chain = effect.change(chain, manipulator)
    return chain


def observed(
    points: np.ndarray, effects: Iterable[Effect], image_centre_m: Sequence[float], elapsed: np.ndarray | float
) -> np.ndarray:
    """(..., 2) positions as a camera with all observation effects measures `points` (..., 2), m.

    Drift is applied before scale, and scale before distortion.  `elapsed` (...) is the number of steps that had passed
    before each position.
    """
    for effect in sorted(effects, key=lambda effect: effect.late):
        if isinstance(effect, Observation):
            points = effect.observe(points, np.asarray(image_centre_m), elapsed)
    return points


def turned(effects: Iterable[Effect], elapsed: np.ndarray) -> np.ndarray:
    """(...) angle that all observation effects add to measured angles after so many `elapsed` (...) steps, rad."""
    total = np.zeros(elapsed.shape)
    for effect in effects:
        if isinstance(effect, Observation):
            total += effect.turn(elapsed)
    return total
