"""The suspect of each kind of effect: where the effect could sit, how large it could be, how it is said, and how it is
carried over to another design.

The families (`friction`, `cables`, `plates`, `sections`, `loads`, `camera`) each have one `Suspect` for each effect of
the family of the same name in `prb3r.model.effects`.
"""

from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass, replace
from typing import Any, Literal, NamedTuple

from prb3r.diagnosis.library.alike import same_parts
from prb3r.diagnosis.library.hypothesis import Free, Hypothesis
from prb3r.diagnosis.library.scope import Place, Scope, structure, whole_rig
from prb3r.diagnosis.library.totals import Contributed
from prb3r.diagnosis.settings import Settings
from prb3r.model.effects import EFFECT_KINDS, in_place_of
from prb3r.model.effects.base import Effect
from prb3r.model.files.cells import written_out
from prb3r.model.manipulator import Manipulator


class Estimate(NamedTuple):
    """A fitted parameter with its 95 % interval; without the interval where the fit does not deserve one."""

    value: float
    low: float | None = None
    high: float | None = None
    open: tuple[bool, bool] = (False, False)
    """Whether the lower and the upper end are bounds of the search, beyond which nothing was tried."""

    @property
    def record(self) -> dict[str, float | None]:
        """Value and ends of the interval by name, as files have them."""
        return {"value": self.value, "low": self.low, "high": self.high}

    @property
    def numbers(self) -> tuple[float, float | None, float | None]:
        """Value and ends of the interval."""
        return self.value, self.low, self.high

    def __format__(self, form: str) -> str:
        """The text `value (low to high)` in a number format (default `.3g`), with words in place of open ends."""
        value, low, high = (None if end is None else written_out(end, form or ".3g") for end in self.numbers)
        if low is None or high is None:
            return f"{value}"
        return f"{value} ({self.interval(low, high)})"

    def interval(self, low: str, high: str) -> str:
        """The interval in words, from its ends `low` and `high` as text; open ends are left out."""
        if all(self.open):
            return "of any size"
        return f"up to {high}" if self.open[0] else f"{low} or more" if self.open[1] else f"{low} to {high}"

    def times(self, factor: float) -> "Estimate":
        """The estimate in another unit; `factor` is positive."""
        low, high = (None if end is None else factor * end for end in (self.low, self.high))
        return Estimate(factor * self.value, low, high, self.open)

    def less(self, whole: float) -> "Estimate":
        """The estimate of `whole` minus the parameter."""
        low, high = (None if end is None else whole - end for end in (self.high, self.low))
        return Estimate(whole - self.value, low, high, (self.open[1], self.open[0]))


class Occurrence(NamedTuple):
    """A fitted effect, as far as its sentence needs it."""

    place: Place
    estimates: Mapping[str, Estimate]
    """The fitted parameters by name, in SI units, that which tells the size first."""
    friction: float = 0.0
    """The calibrated friction coefficient beside the effect."""
    total: float | None = None
    """The `Suspect.quantity` where the effect is, if other effects contribute to it there; else None."""

    @property
    def size(self) -> Estimate:
        """The estimate of the first parameter, which tells how large the effect is."""
        return next(iter(self.estimates.values()))

    @property
    def more(self) -> str:
        """`more` where the fitted friction coefficient of the effect exceeds the calibrated one, else `less`."""
        return "more" if self.size.value > self.friction else "less"

    def with_others(self, unit: str = "", in_unit: Callable[[float], float] = lambda total: total) -> str:
        """A clause on the `total`, converted to the `unit` in which the size is said; empty where that is all."""
        if self.total is None:
            return ""
        return f", which makes {written_out(in_unit(self.total), '.3g')}{unit} with all else that acts there"

    @property
    def of_cables(self) -> str:
        """The cables that the effect concerns, in words: `cable 1, 2` or `all cables`."""
        cables = self.place.get("cables")
        return f"cable {', '.join(cables)}" if cables else "all cables"


Group = Literal["material", "friction"]
"""By what several rigs share parameters: the material of their plates, or the pair of surfaces that rubs."""


class Shared(NamedTuple):
    """Which parameters of an effect the rigs of a group share."""

    group: Group
    parameters: tuple[str, ...] | None = None
    """Names of the shared parameters; None: all."""


OF_THE_MATERIAL, OF_THE_SURFACES = Shared("material"), Shared("friction")

Transfer = Callable[[Effect, Manipulator, Manipulator], Effect | str]
"""Carries an effect of one manipulator over to another one of other geometry: returns the effect there, or the reason
why it is left behind."""


def left_behind(reason: str) -> Transfer:
    """The transfer of an effect that is never carried over to another geometry, for this `reason`."""
    return lambda effect, here, there: f"{effect_in_words(effect)}, which {reason}"


def as_it_is(effect: Effect, here: Manipulator, there: Manipulator) -> Effect | str:
    """The transfer of an effect that is carried over unchanged, unless it sits on some cables only."""
    if getattr(effect, "cables", None):
        return f"{effect_in_words(effect)}, which sits on a cable of this rig"
    return effect


def unchanged(effect: Effect, here: Manipulator, there: Manipulator) -> Effect | str:
    """The transfer of an effect that is carried over as it is, also if it sits on some cables only."""
    return effect


def with_the_same(parts: str, of: Callable[[Manipulator], float]) -> Transfer:
    """The transfer of an effect that is carried over unchanged where certain `parts` are the same: where `of` returns
    numbers for both manipulators that are alike."""

    def transfer(effect: Effect, here: Manipulator, there: Manipulator) -> Effect | str:
        if same_parts([[of(here)]], [[of(there)]]):
            return effect
        return f"{effect_in_words(effect)}, which belongs to the {parts}, and these differ"

    return transfer


def effect_in_words(effect: Effect) -> str:
    """The kind of an effect as text, such as `worn hole` for `worn_hole`."""
    return effect.kind.replace("_", " ")


def usual(settings: Settings) -> float:
    """Prior probability of an effect of which nothing else is known: `Settings.usual_presence`."""
    return settings.usual_presence


def rare(settings: Settings) -> float:
    """Prior probability of an effect that few rigs have, and that whoever built one knows of:
    `Settings.rare_presence`."""
    return settings.rare_presence


OF_A_PART = left_behind("is a fault of one part of this rig")
OF_THE_COURSE = left_behind("went with the course of this recording, from step to step")
OF_THE_CAMERA = left_behind("is in the pictures of this recording, not in the rig")
OF_THE_SETUP = left_behind("belongs to the bench of this recording, and this design stands elsewhere")


@dataclass(frozen=True)
class Suspect:
    """A kind of effect that could have been left out of the nominal model.

    Its places depend on the recording; its free parameters and probes on the recording and the place.
    """

    kind: str
    sentence: Callable[[Occurrence], str]
    """What the fitted effect means, in one sentence that a mechanical engineer can act upon."""
    transfer: Transfer
    """How the effect is carried over to another geometry."""
    bench: Transfer | None = None
    """How it is carried over to another geometry on the bench of the recording, mounted alike, if that differs."""
    places: Callable[[Scope], Iterable[Place]] = whole_rig
    """Where the effect could sit on the rig of a recording; none where it makes no sense."""
    free: Callable[[Scope, Place], tuple[Free, ...]] = lambda scope, place: ()
    """Parameters that are fitted, with their bounds, scales and priors."""
    probes: Callable[[Scope, Place], tuple[tuple[float, ...], ...]] = lambda scope, place: ()
    """Values of the free parameters to begin from, for an effect that does not vanish continuously."""
    kinked: bool = False
    """See `Hypothesis.kinked`."""
    shared: Shared | None = None
    """What several rigs may share of the effect; None: each rig has its own."""
    referred: Callable[[Effect, Place], tuple[Effect, float]] | None = None
    """The same law with the reference of another place, and the factor on the friction coefficient, which holds at the
    reference, that goes with it; None: the place is no reference."""
    quantity: Contributed | None = None
    """What the effect contributes to where others may do so too: those of its kind at other places, and kinds with the
    same quantity.  None: no other effect adds to what its sentence tells."""
    presence: Callable[[Settings], float] = usual
    """Prior probability that a rig has the effect at any place: above the usual one where nearly every rig has it,
    below where somebody would have had to overlook what is seen without a model."""

    @property
    def of_the_setup(self) -> bool:
        """Whether the effect belongs to the set-up of a recording, not to the rig."""
        return self.transfer in (OF_THE_SETUP, OF_THE_COURSE, OF_THE_CAMERA)

    def carries(self, same_bench: bool) -> Transfer:
        """How the effect is carried over to another geometry, which may stand on the bench of the recording."""
        if not same_bench:
            return self.transfer
        return self.bench or (unchanged if self.transfer is OF_THE_SETUP else self.transfer)

    @property
    def once(self) -> bool:
        """Whether a rig has at most one effect of this kind, as the effect class says."""
        return EFFECT_KINDS[self.kind].once

    @property
    def costly(self) -> bool:
        """Whether every prediction with the effect is slow, as friction then follows the load path: each state takes
        the states before it."""
        return EFFECT_KINDS[self.kind].follows_history

    def hypotheses(self, scope: Scope) -> Iterator[Hypothesis]:
        """The hypotheses on this kind of effect at every place where it makes sense.

        None where the nominal manipulator has an effect that excludes it: one of a kind that occurs once, or one that
        stands in its place.
        """
        there = {effect.kind for effect in scope.manipulator.effect}
        if (self.once and self.kind in there) or any(in_place_of(self.kind, kind) for kind in there):
            return
        for place in self.places(scope):
            free, probes = self.free(scope, place), self.probes(scope, place)
            plain = Hypothesis(self.kind, tuple(place.items()), free, probes, self.kinked)
            yield replace(plain, structural=_is_structural(plain, scope))


def _is_structural(hypothesis: Hypothesis, scope: Scope) -> bool:
    """Whether the chain with the effect at its start has another structure than the chain without."""
    friction = scope.manipulator.friction.coefficient
    effect: Any = hypothesis.effect(hypothesis.starts(friction)[0], friction)
    return structure(effect.change(scope.chain, scope.manipulator)) != structure(scope.chain)
