"""What the independent side says of an effect, all in one record: parameters, deed, and how it can be concealed.

The rig takes from a record what the effect does to a draft and which parameters it takes; those who draw labels take
where it can sit and how large it can be; those who judge take how its numbers are compared.
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
"""Of a value as written: what is wrong with it, empty if nothing is."""


class Scale(Enum):
    """In which a parameter is compared: its deviation from no effect is the whole to which an error is related."""

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
    """Of a parameter that says where or which: what it counts (`plates`, `disks`, ...); empty for a size."""
    optional: bool = False


@dataclass(frozen=True)
class Record:
    """One kind of effect."""

    kind: str
    act: Callable[..., None]
    """Changes a draft by the parameters, which it takes by name; a ValueError says what does not fit together."""
    taken: tuple[EffectParameter, ...]
    conceal: Callable[[Conditions], Iterable[Candidate]] | None = None
    """Its forms under the conditions of a design, their `kind` left open; None: it is never concealed."""
    turn: int = 0
    """When labels ask for it, the kinds that rigs show most often first: a run of few cases has those alone."""
    rare: bool = False
    """Whether it is concealed in recordings of a class of their own only: what few rigs show, or no suspect is."""
    once: bool = False
    """Whether a rig can have it only once."""
    of_the_kind: bool = False
    """Whether another design of the same plates' length, disks, clamps, holes, cables and steel has it as well, unless
    it is one cable's; else it is a fault of one part, or belongs to one set-up."""
    excludes: frozenset[str] = frozenset()
    """Kinds that the rig does not know beside it."""
    vector: bool = False
    """Whether its forms are directions of one vector: they act together, and its parameters are judged by length."""
    reshaped: Callable[[Conditions, Candidate, np.random.Generator], Candidate] | None = None
    """A form with its shape drawn anew; None: forms have no shape."""
    twins: Callable[[Conditions, Candidate, float], Iterable[Candidate]] | None = None
    """Of a form and its size: what is the same law, or nearly so, under the name of another kind."""

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
        """Parameters that say where or which, and what they count."""
        return {parameter.name: parameter.place for parameter in self.taken if parameter.place}

    @property
    def scales(self) -> Mapping[str, Scale]:
        """The scale on which the stated and the true value of each parameter are compared, by its name."""
        return {parameter.name: parameter.scale for parameter in self.taken}

    def candidates(self, conditions: Conditions) -> Iterator[list[Candidate]]:
        """All forms that the conditions allow, in groups that act together."""
        forms = [] if self.conceal is None else [replace(form, kind=self.kind) for form in self.conceal(conditions)]
        yield from [forms] if self.vector and forms else ([form] for form in forms)

    def drawn(self, conditions: Conditions, candidate: Candidate, rng: np.random.Generator) -> Candidate:
        """The candidate with its shape drawn anew, where it has one."""
        if self.reshaped is None:
            return candidate
        return replace(self.reshaped(conditions, candidate, rng), kind=self.kind)


def number_in(low: float = -np.inf, high: float = np.inf, open_low: bool = False) -> Check:
    """Of a finite number from `low`, itself left out if `open_low`, to `high`."""

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
    """A parameter that names one of the draft's cables, disks, ..., or one of the words given."""
    counted = options if isinstance(options, str) else name
    return EffectParameter(name, lambda value, draft: _not_one(value, _options(draft, options)), place=counted)


def several(name: str, options: str) -> EffectParameter:
    """A parameter that lists some of the draft's cables, disks, ...; absent, the effect acts on all."""

    def check(value: Any, draft: Draft) -> str:
        if not isinstance(value, Sequence) or isinstance(value, str) or not value:
            return f"must be a list, not {value!r}"
        return "; ".join(filter(None, (_not_one(member, _options(draft, options)) for member in value)))

    return EffectParameter(name, check, place=options, optional=True)


def _options(draft: Draft, options: str | Sequence[str]) -> Sequence[Any]:
    return getattr(draft, options) if isinstance(options, str) else options


def _not_one(value: Any, valid: Sequence[Any]) -> str:
    if isinstance(value, str | Integral) and not isinstance(value, bool) and value in valid:
        return ""
    return f"{value!r} is not one of {', '.join(map(str, valid))}"
