"""What is known of one effect as a suspect: where it could sit, how large it could be, what it means, what it teaches.

The families (`friction`, `cables`, `plates`, `loads`, `camera`) each have one record for each effect of the family of
the same name in `prb3r.model.effects`.
"""

from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass, replace
from typing import Any, Literal, NamedTuple

from prb3r.diagnosis.library.hypothesis import Free, Hypothesis
from prb3r.diagnosis.library.scope import Place, Scope, structure, whole_rig
from prb3r.diagnosis.settings import Settings
from prb3r.model.effects import EFFECT_KINDS, in_place_of
from prb3r.model.effects.base import Effect
from prb3r.model.manipulator import Manipulator


def _digits(value: float, form: str) -> str:
    """A number with a format; up to a million written out."""
    text = f"{value:{form}}"
    return f"{value:.0f}" if "e+" in text and abs(value) < 1e6 else text


class Estimate(NamedTuple):
    """A fitted parameter; without an interval where the fit does not deserve one."""

    value: float
    low: float | None = None
    high: float | None = None
    open: tuple[bool, bool] = (False, False)
    """Whether the lower and the upper end are only those of the search: what is beyond was not tried."""

    @property
    def record(self) -> dict[str, float | None]:
        """Value and ends by their names, as files have them."""
        return {"value": self.value, "low": self.low, "high": self.high}

    @property
    def numbers(self) -> tuple[float, float | None, float | None]:
        """Value and ends."""
        return self.value, self.low, self.high

    def __format__(self, form: str) -> str:
        """With the format of a number (default `.3g`): value (low to high), with words where an end is open."""
        value, low, high = (None if end is None else _digits(end, form or ".3g") for end in self.numbers)
        if low is None or high is None:
            return f"{value}"
        return f"{value} ({self.interval(low, high)})"

    def interval(self, low: str, high: str) -> str:
        """Its interval in words, by its ends as they are printed: what is open is not told."""
        if all(self.open):
            return "of any size"
        return f"up to {high}" if self.open[0] else f"{low} or more" if self.open[1] else f"{low} to {high}"

    def times(self, factor: float) -> "Estimate":
        """The estimate in another unit; `factor` is positive."""
        low, high = (None if end is None else factor * end for end in (self.low, self.high))
        return Estimate(factor * self.value, low, high, self.open)

    def less(self, whole: float) -> "Estimate":
        """The estimate of `whole` less the value, its ends exchanged."""
        low, high = (None if end is None else whole - end for end in (self.high, self.low))
        return Estimate(whole - self.value, low, high, (self.open[1], self.open[0]))


class Occurrence(NamedTuple):
    """An effect as it was fitted."""

    place: Place
    estimates: Mapping[str, Estimate]
    friction: float = 0.0
    """The calibrated coefficient beside it."""

    @property
    def size(self) -> Estimate:
        """The estimate of its first parameter, which says how large it is."""
        return next(iter(self.estimates.values()))

    @property
    def more(self) -> str:
        """`more` where the coefficient that was fitted is above the calibrated one beside it, else `less`."""
        return "more" if self.size.value > self.friction else "less"

    @property
    def of_cables(self) -> str:
        """The cables that it concerns, in words: `cable 1, 2` or `all cables`."""
        cables = self.place.get("cables")
        return f"cable {', '.join(cables)}" if cables else "all cables"


Group = Literal["material", "friction"]
"""What several rigs have in common: what their plates are made of, or the pair of surfaces that rubs."""


class Shared(NamedTuple):
    """What rigs of a group have in common of an effect."""

    group: Group
    parameters: tuple[str, ...] | None = None
    """Those that are the same on all; None: all are."""


OF_THE_MATERIAL, OF_THE_SURFACES = Shared("material"), Shared("friction")

Transfer = Callable[[Effect, Manipulator, Manipulator], Effect | str]
"""An effect of a manipulator on one of another geometry, or why it cannot be carried over."""


def left_behind(reason: str) -> Transfer:
    """The transfer of what does not carry over to another geometry, whatever the two are, for this `reason`."""
    return lambda effect, here, there: f"{effect_in_words(effect)}, which {reason}"


def as_it_is(effect: Effect, here: Manipulator, there: Manipulator) -> Effect | str:
    """What carries over unchanged, unless it sits on some cables only."""
    if getattr(effect, "cables", None):
        return f"{effect_in_words(effect)}, which sits on a cable of this rig"
    return effect


def with_the_same(parts: str, of: Callable[[Manipulator], object]) -> Transfer:
    """What carries over where the `parts` are the same: what `of` says of both manipulators."""

    def transfer(effect: Effect, here: Manipulator, there: Manipulator) -> Effect | str:
        if of(here) == of(there):
            return effect
        return f"{effect_in_words(effect)}, which belongs to the {parts}, and these differ"

    return transfer


def effect_in_words(effect: Effect) -> str:
    """The kind of an effect as a sentence has it, `worn hole` of `worn_hole`."""
    return effect.kind.replace("_", " ")


def usual(settings: Settings) -> float:
    """Prior probability of a kind of which nothing else is known: `Settings.usual_presence`."""
    return settings.usual_presence


def rare(settings: Settings) -> float:
    """Prior probability of a kind that few rigs have, and whoever built one knows of: `Settings.rare_presence`."""
    return settings.rare_presence


OF_A_PART = left_behind("is a fault of one part of this rig")
OF_THE_SETUP = left_behind("belongs to the set-up of this recording")


@dataclass(frozen=True)
class Suspect:
    """An effect that could have been left out.

    Places, free parameters and probes depend on what is recorded; the last two on the place too.
    """

    kind: str
    sentence: Callable[[Occurrence], str]
    """What it means, in one sentence that a mechanical engineer can act upon."""
    transfer: Transfer
    places: Callable[[Scope], Iterable[Place]] = whole_rig
    free: Callable[[Scope, Place], tuple[Free, ...]] = lambda scope, place: ()
    """Parameters that are fitted, with their bounds and scales."""
    probes: Callable[[Scope, Place], tuple[tuple[float, ...], ...]] = lambda scope, place: ()
    """Values of the free parameters to begin from, for an effect that does not vanish by degrees."""
    kinked: bool = False
    """As in `Hypothesis`."""
    shared: Shared | None = None
    """What several rigs may have in common of it; None: each has its own."""
    presence: Callable[[Settings], float] = usual
    """Prior probability that a rig has it, at any place.  More than usual where nearly every rig has it, less where
    somebody would have had to overlook what is seen without a model."""

    @property
    def once(self) -> bool:
        """Whether there is only one of it on a rig, as the effect itself says."""
        return EFFECT_KINDS[self.kind].once

    @property
    def costly(self) -> bool:
        """Whether every prediction with it is slow, as states follow the load path where else each stands alone."""
        return EFFECT_KINDS[self.kind].follows_history

    def hypotheses(self, scope: Scope) -> Iterator[Hypothesis]:
        """The effect at every place where it makes sense."""
        there = {effect.kind for effect in scope.manipulator.effect}
        if (self.once and self.kind in there) or any(in_place_of(self.kind, kind) for kind in there):
            return
        for place in self.places(scope):
            free, probes = self.free(scope, place), self.probes(scope, place)
            plain = Hypothesis(self.kind, tuple(place.items()), free, probes, self.kinked)
            yield replace(plain, structural=_is_structural(plain, scope))


def _is_structural(hypothesis: Hypothesis, scope: Scope) -> bool:
    """Whether the chain with the effect at its start is of another structure than without."""
    friction = scope.manipulator.friction.coefficient
    effect: Any = hypothesis.effect(hypothesis.starts(friction)[0], friction)
    return structure(effect.change(scope.chain, scope.manipulator)) != structure(scope.chain)
