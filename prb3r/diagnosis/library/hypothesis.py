"""A hypothesis: one kind of effect at one place, with the parameters that a fit may move."""

from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from prb3r.model.effects import EFFECT_KINDS, in_place_of
from prb3r.model.effects.base import Effect, Observation

LARGEST_EXPONENT = 50.0
"""Largest `u` of a logarithmic parameter: e^50 times its null is beyond every bound, and no overflow yet."""
KINK_STEP = 1e-3
"""The `u`, to either side of 0, at which a kinked effect is differentiated.

A thousandth of the largest tension is below the scatter of weighed tensions (0.3 %) and far above what equilibria are
solved to.
"""
NAMES_OF_PARTS = frozenset({"plate", "plates", "segment", "disk", "cable", "cables"})
"""Names in the place of an effect that tell which parts of a rig it concerns."""
FORMS = frozenset({"law", "side", "sections", "elements"})
"""Keys of `Hypothesis.place` that state the form of an effect, not its place: with these alone it concerns the whole
rig."""


class Free(NamedTuple):
    """A free parameter of an effect, fitted in its own scale `u`: value = null exp(u) if `log`, null / (1 - scale u) if
    `inverse`, else null + scale u."""

    name: str
    null: float
    """Where the effect vanishes, or where a fit would begin for one that does not vanish anywhere."""
    low: float
    """Lowest value, in the unit of the parameter."""
    high: float
    """Highest value, in the unit of the parameter."""
    scale: float = 1.0
    log: bool = False
    above: bool = False
    """Whether the value is a friction coefficient of which `u` tells the difference from the calibrated one; that one
    is then added to the value."""
    limit: bool = False
    """Whether all values below the lowest one act as it does, so that an estimate may well end there."""
    sd: float | None = None
    """Prior standard deviation of `u`; None: see `prior_sd`."""
    inverse: bool = False
    pole: bool = False
    """Whether the law has a pole where the value vanishes, as the stiffness of a hinge where its compliance does."""

    @property
    def prior_sd(self) -> float:
        """Prior standard deviation of `u`: `sd`, or if that is None half the distance of the farther bound."""
        low, high = self.bounds()
        return max(-low, high) / 2 if self.sd is None else self.sd

    def value(self, u: float, friction: float = 0.0) -> float:
        """The value of the parameter at `u`, cut off at its bounds; `friction` is the calibrated coefficient."""
        if self.log:
            plain = self.null * np.exp(min(u, LARGEST_EXPONENT))
        elif self.inverse:
            plain = self.null / (1 - self.scale * u) if self.scale * u < 1 else np.inf
        else:
            plain = self.null + self.scale * u
        return float(min(max(plain + (friction if self.above else 0.0), self.low), self.high))

    def at(self, value: float, friction: float = 0.0) -> float:
        """The `u` of a `value` of the parameter; `friction` is the calibrated coefficient."""
        value -= friction if self.above else 0.0
        if self.log:
            return float(np.log(value / self.null))
        return (1 - self.null / value if self.inverse else value - self.null) / self.scale

    def bounds(self, friction: float = 0.0) -> tuple[float, float]:
        """Lowest and highest `u` that a fit may reach; `friction` is the calibrated coefficient."""
        return self.at(self.low, friction), self.at(self.high, friction)

    @property
    def pole_at(self) -> float:
        """The `u` of the law's pole; -inf without one."""
        return self.at(0.0) if self.pole else -np.inf

    def open_ends(self, low: float, high: float) -> tuple[bool, bool]:
        """Whether the lower and the upper end of an interval of values are bounds of the search, unless the bound is
        the null, at which the effect vanishes."""
        below, above = np.isclose([low, high], [self.low, self.high], rtol=1e-9, atol=0.0)
        return bool(below and self.low != self.null), bool(above and self.high != self.null)

    def sided(self, friction: float = 0.0) -> bool:
        """Whether `u` can leave 0 in one direction only, as that of a friction coefficient where the calibrated one is
        0."""
        return 0.0 in self.bounds(friction)


def place_text(value: Any) -> str:
    """A plate, cable or law as text, such as `4`; several of them as `1+3`."""
    return "+".join(map(str, value)) if isinstance(value, tuple) else str(value)


@dataclass(frozen=True)
class Hypothesis:
    """One kind of effect at one place, with the parameters that a fit may move."""

    kind: str
    place: tuple[tuple[str, Any], ...] = ()
    """Names and values of the parameters that are not fitted: plate, cable, law."""
    free: tuple[Free, ...] = ()
    """Parameters that are fitted."""
    probes: tuple[tuple[float, ...], ...] = ()
    """Values of the free parameters from which fits begin and at which the effect is tested as a whole, if it does not
    vanish continuously; else empty."""
    kinked: bool = False
    """Whether readings respond differently to the two signs of the effect, however small it is, so that they have one
    derivative to each side."""
    structural: bool = False
    """Whether the chain with the effect, however small, is of another structure than without (`scope.structure`), so
    that readings cannot be differentiated around a chain that lacks the effect."""

    def same_effect(self, other: "Hypothesis") -> bool:
        """Whether both are the same kind of effect at the same place, whatever their bounds."""
        return (self.kind, self.place) == (other.kind, other.place)

    def same_form(self, other: "Hypothesis") -> bool:
        """Whether both are the same effect and have the same free parameters."""
        return self.same_effect(other) and [free.name for free in self.free] == [free.name for free in other.free]

    def in_another_form(self, other: "Hypothesis") -> bool:
        """Whether both are the same kind of effect on the same parts, in different forms (:data:`FORMS`)."""
        here, there = (tuple(part for part in each.place if part[0] not in FORMS) for each in (self, other))
        return self.kind == other.kind and here == there and self.place != other.place

    @property
    def of_whole_rig(self) -> bool:
        """Whether the effect concerns the whole rig, not some of its parts alone."""
        return not any(name in NAMES_OF_PARTS for name, _ in self.place)

    @property
    def continuous(self) -> bool:
        """Whether the effect vanishes continuously, so that a derivative at nothing tells how it moves the readings."""
        return bool(self.free) and not self.probes

    def sided(self, friction: float = 0.0) -> bool:
        """Whether some parameter of the effect can leave its null in one direction only; `friction` is the calibrated
        coefficient."""
        return any(free.sided(friction) for free in self.free)

    def one_sided(self, friction: float = 0.0) -> bool:
        """Whether only positive multiples of the effect's linearised change of the readings make sense.

        That is so if a parameter can leave its null in one direction only, if the two signs act differently (`kinked`,
        each sign being tested by itself), and for an effect that is there as a whole or not at all.  `friction` is the
        calibrated coefficient.
        """
        return self.sided(friction) or self.kinked or not self.continuous

    @property
    def deviations(self) -> np.ndarray:
        """(k,) prior standard deviations of the free parameters, in their own scale `u`."""
        return np.array([free.prior_sd for free in self.free])

    @property
    def once(self) -> bool:
        """Whether a rig has at most one effect of this kind."""
        return EFFECT_KINDS[self.kind].once

    @property
    def costly(self) -> bool:
        """Whether every prediction with the effect is slow, as friction then follows the load path: each state takes
        the states before it."""
        return EFFECT_KINDS[self.kind].follows_history

    def excludes(self, other: "Hypothesis") -> bool:
        """Whether a model cannot have both hypotheses: they are equal, or of one kind that occurs once or of which one
        holds what the other fits, or of kinds that stand in the place of each other."""
        if self.kind == other.kind:
            return self.once or self == other or self.holds_parameter_of(other) or other.holds_parameter_of(self)
        return in_place_of(self.kind, other.kind)

    def holds_parameter_of(self, other: "Hypothesis") -> bool:
        """Whether the hypothesis holds a parameter that `other`, on the same kind of effect, fits: as gravity along one
        axis holds its part along the other one."""
        return self.kind == other.kind and not {name for name, _ in self.place}.isdisjoint(
            free.name for free in other.free
        )

    def generalises(self, other: "Hypothesis") -> bool:
        """Whether the hypothesis fits what `other` holds, and all that it fits, so that it does as well always."""
        return other.holds_parameter_of(self) and not self.holds_parameter_of(other)

    @property
    def mechanical(self) -> bool:
        """Whether the effect changes the states, not only how they are read."""
        return not issubclass(EFFECT_KINDS[self.kind], Observation)

    @property
    def name(self) -> str:
        """Kind and place, such as `worn_hole (disk 2, cables 1)`."""
        places = ", ".join(f"{key} {place_text(value)}" for key, value in self.place)
        return self.kind + (f" ({places})" if places else "")

    def effect(self, u: np.ndarray, friction: float) -> Effect:
        """The effect for free parameters `u` (k,) and the calibrated `friction` coefficient."""
        values = {free.name: free.value(size, friction) for free, size in zip(self.free, u, strict=True)}
        place = {key: list(value) if isinstance(value, tuple) else value for key, value in self.place}
        return EFFECT_KINDS[self.kind](kind=self.kind, **place, **values)

    def starts(self, friction: float) -> list[np.ndarray]:
        """Points `u` (k,) from which a fit begins, and around or at which the effect is tested; `friction` is the
        calibrated coefficient.

        Those of the probes, if there are any; else 0, or a small step away from it for an effect that is kinked (one to
        either side) or structural.
        """
        if self.kinked:
            return [np.array([-KINK_STEP]), np.array([KINK_STEP])]
        if self.structural and not self.probes:
            return [np.full(len(self.free), KINK_STEP)]  # at 0 the chain would lack the effect
        if not self.probes:
            return [np.zeros(len(self.free))]
        return [
            np.array([free.at(value, friction) for free, value in zip(self.free, probe, strict=True)])
            for probe in self.probes
        ]
