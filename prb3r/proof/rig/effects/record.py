"""The record of an effect: all that rig, labels and scores need to know of one kind.

The rig takes from it the parameters and what the effect does to a draft; the drawing of labels takes the places and
sizes at which it can be concealed; the scores take how its numbers are compared.
"""

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from enum import Enum
from numbers import Integral, Real
from typing import Any

import numpy as np

from prb3r.proof.rig.draft import Draft
from prb3r.proof.rig.effects.candidate import Candidate, Conditions

Check = Callable[[Any, Draft], str]
"""Check of a parameter: from its value in a file and the draft, a message on what is wrong; empty if nothing is."""


class Scale(Enum):
    """On which scale a parameter is compared: errors are relative to its deviation from no effect on this scale."""

    PLAIN = "the value itself"
    LOGARITHM = "its logarithm: the effect vanishes at one"
    EXCESS = "the value less the friction coefficient of all other holes"

    def deviation(self, value: float, friction: float) -> float:
        """How far a value is from no effect where the friction coefficient of the rig is `friction`."""
        if self is Scale.LOGARITHM:
            return float(np.log(value))
        return value - friction if self is Scale.EXCESS else value


@dataclass(frozen=True)
class EffectParameter:
    """One parameter of an effect."""

    name: str
    check: Check
    scale: Scale = Scale.PLAIN
    place: str = ""
    """Of a parameter that says where or which: what it refers to (`plates`, `disks`, ...); empty for a size."""
    optional: bool = False
    """Whether a file may leave it out."""


@dataclass(frozen=True)
class Record:
    """One kind of effect."""

    kind: str
    act: Callable[..., None]
    """Changes a draft by the parameters, which it takes by name; raises ValueError where these do not fit together."""
    taken: tuple[EffectParameter, ...]
    """All parameters that a file may give."""
    conceal: Callable[[Conditions], Iterable[Candidate]] | None = None
    """Candidates for concealing it under the conditions of a design, without their `kind`; None: never concealed."""
    turn: int = 0
    """Rank in the order in which labels ask for kinds; those that rigs show most come first, as a short run has only
    these."""
    rare: bool = False
    """Whether it is concealed only in recordings of the class `rare`: few rigs show it, or nobody suspects it."""
    once: bool = False
    """Whether a rig can have it only once."""
    of_the_kind: bool = False
    """Whether another design of the same plates' length, disks, clamps, holes, cables and steel has it as well, unless
    it is one cable's; else it is a fault of one part, or belongs to one set-up."""
    excludes: frozenset[str] = frozenset()
    """Kinds that the rig refuses beside it."""
    vector: bool = False
    """Whether its candidates are directions of one vector: they act together, and parameters are judged by the length
    of their error."""
    reshaped: Callable[[Conditions, Candidate, np.random.Generator], Candidate] | None = None
    """A candidate with its shape drawn at random; None: candidates have no shape to draw."""
    twins: Callable[[Conditions, Candidate, float], Iterable[Candidate]] | None = None
    """Candidates of other kinds that are the same law, or nearly so, as a given candidate at a given size."""

    @property
    def parameters(self) -> tuple[str, ...]:
        """Names of all parameters that a manipulator file may give."""
        return tuple(parameter.name for parameter in self.taken)

    @property
    def optional(self) -> frozenset[str]:
        """Names of the parameters without which a manipulator file may describe the effect."""
        return frozenset(parameter.name for parameter in self.taken if parameter.optional)

    @property
    def places(self) -> Mapping[str, str]:
        """Names of the parameters that say where or which, each with what it refers to (`plates`, `disks`, ...)."""
        return {parameter.name: parameter.place for parameter in self.taken if parameter.place}

    @property
    def scales(self) -> Mapping[str, Scale]:
        """The scale on which the stated and the true value of each parameter are compared, by its name."""
        return {parameter.name: parameter.scale for parameter in self.taken}

    def candidates(self, conditions: Conditions) -> Iterator[list[Candidate]]:
        """All candidates that the conditions allow, in groups that act together."""
        forms = [] if self.conceal is None else [replace(form, kind=self.kind) for form in self.conceal(conditions)]
        yield from [forms] if self.vector and forms else ([form] for form in forms)

    def drawn(self, conditions: Conditions, candidate: Candidate, rng: np.random.Generator) -> Candidate:
        """The candidate with its shape drawn at random, where it has one."""
        if self.reshaped is None:
            return candidate
        return replace(self.reshaped(conditions, candidate, rng), kind=self.kind)


def number_in(low: float = -np.inf, high: float = np.inf, open_low: bool = False) -> Check:
    """The check that a value is a finite number from `low` (excluded if `open_low`) to `high`."""

    def check(value: Any, _: Draft) -> str:
        good = isinstance(value, Real) and not isinstance(value, bool) and np.isfinite(float(value))
        if good and low <= value <= high and not (open_low and value == low):
            return ""
        return f"must be a number {'above' if open_low else 'from'} {low:g} to {high:g}, not {value!r}"

    return check


ANY, FROM_ZERO = number_in(), number_in(0)
POSITIVE, FRACTION = number_in(0, open_low=True), number_in(0, 1, open_low=True)
"""Checks of a size: any number; not negative; above zero; above zero and at most one."""


def size(name: str, check: Check = ANY, scale: Scale = Scale.PLAIN, optional: bool = False) -> EffectParameter:
    """A parameter that says how large an effect is: the `check` of its values, the `scale` on which they are compared,
    and whether files may leave it out."""
    return EffectParameter(name, check, scale, optional=optional)


def one_of(name: str, options: str | Sequence[str]) -> EffectParameter:
    """A parameter naming one of `options`: a field of the draft (`cables`, `disks`, ...) or words to choose from."""
    counted = options if isinstance(options, str) else name
    return EffectParameter(name, lambda value, draft: _not_one(value, _options(draft, options)), place=counted)


def several(name: str, options: str) -> EffectParameter:
    """A parameter that lists some of `options`, a field of the draft (`cables`, `plates`); absent, the effect acts on
    all."""

    def check(value: Any, draft: Draft) -> str:
        if not isinstance(value, Sequence) or isinstance(value, str) or not value:
            return f"must be a list, not {value!r}"
        return "; ".join(filter(None, (_not_one(member, _options(draft, options)) for member in value)))

    return EffectParameter(name, check, place=options, optional=True)


def _options(draft: Draft, options: str | Sequence[str]) -> Sequence[Any]:
    """The values to choose from: those of the named field of the draft, or the words themselves."""
    return getattr(draft, options) if isinstance(options, str) else options


def _not_one(value: Any, valid: Sequence[Any]) -> str:
    """Message where a value is none of the valid ones; else empty."""
    if isinstance(value, str | Integral) and not isinstance(value, bool) and value in valid:
        return ""
    return f"{value!r} is not one of {', '.join(map(str, valid))}"
