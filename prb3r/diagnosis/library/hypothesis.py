"""A hypothesis: one kind of effect at one place, with the parameters that a fit may move."""

from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from prb3r.model.effects import EFFECT_KINDS, in_place_of
from prb3r.model.effects.base import Effect, Observation

LARGEST_EXPONENT = 50.0
"""Of a logarithmic parameter: e^50 times its null is beyond every bound, and no overflow yet."""
KINK_STEP = 1e-3
"""How far from nothing, in its own scale, a kinked effect is looked at to either side.

A thousandth of the largest tension is below the scatter of weighed tensions (0.3 %) and far above what equilibria are
solved to.
"""


class Free(NamedTuple):
    """A parameter that is fitted by its `u`: value = null exp(u) if `log`, else null + scale u."""

    name: str
    null: float
    """Where the effect vanishes, or where a fit would begin for one that does not vanish anywhere."""
    low: float
    high: float
    scale: float = 1.0
    log: bool = False
    above: bool = False
    """The value is what the calibrated friction coefficient is exceeded by."""
    limit: bool = False
    """The lowest value stands for all below it, which act alike: an estimate may well end there."""
    sd: float | None = None
    """Prior standard deviation of `u`; absent: see `prior_sd`."""

    @property
    def prior_sd(self) -> float:
        """Prior standard deviation of `u`: where nothing else is said the farther bound is two of them away."""
        low, high = self.bounds()
        return max(-low, high) / 2 if self.sd is None else self.sd

    def value(self, u: float, friction: float = 0.0) -> float:
        """The value within its bounds, beside a calibrated coefficient of `friction`."""
        plain = self.null * np.exp(min(u, LARGEST_EXPONENT)) if self.log else self.null + self.scale * u
        return float(min(max(plain + (friction if self.above else 0.0), self.low), self.high))

    def at(self, value: float, friction: float = 0.0) -> float:
        """The `u` of a value of the parameter, beside a calibrated coefficient of `friction`."""
        value -= friction if self.above else 0.0
        return float(np.log(value / self.null)) if self.log else (value - self.null) / self.scale

    def bounds(self, friction: float = 0.0) -> tuple[float, float]:
        """Lowest and highest `u` that a fit may go to."""
        return self.at(self.low, friction), self.at(self.high, friction)

    def open_ends(self, low: float, high: float) -> tuple[bool, bool]:
        """Whether the ends of an interval are bounds of the search at which the effect does not vanish."""
        below, above = np.isclose([low, high], [self.low, self.high], rtol=1e-9, atol=0.0)
        return bool(below and self.low != self.null), bool(above and self.high != self.null)

    def sided(self, friction: float = 0.0) -> bool:
        """Whether the value can leave its null in one direction only, as a coefficient can beside one of nothing."""
        return 0.0 in self.bounds(friction)


def place_text(value: Any) -> str:
    """A plate, cable or law, or several of them together, in words: `4`, `1+3`."""
    return "+".join(map(str, value)) if isinstance(value, tuple) else str(value)


@dataclass(frozen=True)
class Hypothesis:
    """One kind of effect at one place."""

    kind: str
    place: tuple[tuple[str, Any], ...] = ()
    """Parameters that are not fitted: plate, cable, law."""
    free: tuple[Free, ...] = ()
    probes: tuple[tuple[float, ...], ...] = ()
    """Values of the free parameters at which an effect that does not vanish by degrees is tried."""
    kinked: bool = False
    """Whether the two signs of the effect differ already when it is small."""
    structural: bool = False
    """Whether the chain with the effect, however small, is of another structure than without (`scope.structure`), so
    that the effect cannot be differentiated around a chain that lacks it."""

    @property
    def by_degrees(self) -> bool:
        """Whether the effect vanishes smoothly, so that a derivative tells its direction."""
        return bool(self.free) and not self.probes

    def sided(self, friction: float = 0.0) -> bool:
        """Whether the effect has one direction only, beside a calibrated coefficient of `friction`."""
        return any(free.sided(friction) for free in self.free)

    @property
    def once(self) -> bool:
        """Whether there is only one of its kind on a rig."""
        return EFFECT_KINDS[self.kind].once

    @property
    def costly(self) -> bool:
        """Whether every prediction with it is slow, as states follow the load path where else each stands alone."""
        return EFFECT_KINDS[self.kind].follows_history

    def excludes(self, other: "Hypothesis") -> bool:
        """Whether a model cannot have both: the same, of a kind that occurs once, or of kinds in the place of each
        other."""
        if self.kind == other.kind:
            return self.once or self == other
        return in_place_of(self.kind, other.kind)

    @property
    def mechanical(self) -> bool:
        """Whether the states change, not only their reading."""
        return not issubclass(EFFECT_KINDS[self.kind], Observation)

    @property
    def name(self) -> str:
        """Kind and place, such as `worn_hole (disk 2, cables 1)`."""
        places = ", ".join(f"{key} {place_text(value)}" for key, value in self.place)
        return self.kind + (f" ({places})" if places else "")

    def effect(self, u: np.ndarray, friction: float) -> Effect:
        """The effect for free parameters `u` and the calibrated friction coefficient."""
        values = {free.name: free.value(size, friction) for free, size in zip(self.free, u, strict=True)}
        place = {key: list(value) if isinstance(value, tuple) else value for key, value in self.place}
        return EFFECT_KINDS[self.kind](kind=self.kind, **place, **values)

    def starts(self, friction: float) -> list[np.ndarray]:
        """Points `u` from which a fit begins, or where a probe stands; `friction` is the calibrated coefficient."""
        if self.kinked:
            return [np.array([-KINK_STEP]), np.array([KINK_STEP])]
        if self.structural and not self.probes:
            return [np.full(len(self.free), KINK_STEP)]  # there is no such chain without any of it
        if not self.probes:
            return [np.zeros(len(self.free))]
        return [
            np.array([free.at(value, friction) for free, value in zip(self.free, probe, strict=True)])
            for probe in self.probes
        ]
