"""Candidates: effects at one place as a function of one size, zero being no effect; and the conditions of a design."""

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any

RigPlace = tuple[tuple[str, Any], ...]
"""Parameters that say where an effect acts or which law it is, with their values; lists as tuples."""
PROBE = 2e-3
"""Step of a one-sided derivative by size, in parts of the largest size.  The error by the response's nonlinearity is
then a few parts in a thousand, and the tolerance of the rig (1e-6 of a sub-step) is far below the step."""


@dataclass(frozen=True)
class Conditions:
    """Properties of a design that decide which effects can be concealed on it, and in which units their sizes are.

    In these units one range of sizes serves all designs.
    """

    segments: tuple[int, ...]
    """Number of plates of each segment."""
    reach: Mapping[str, int]
    """Number of plates that each cable crosses, by the cable's name."""
    friction: float
    """Nominal friction coefficient."""
    declared: bool
    """Whether slip directions are declared."""
    tip_loaded: bool
    """Whether a transverse load acts at the tip at some step."""
    positions: bool
    """Whether a camera reads positions."""
    pull: float
    """Largest tension, N."""
    arm: float
    """Largest offset of a cable, m."""
    length: float
    """Length of the straight manipulator, m."""
    bend: float
    """Largest bend of a plate of the nominal manipulator, rad."""
    arc: float
    """Flexible length of the first plate, m."""
    rigidity: float
    """EI of the first plate, N m^2."""
    modulus: float
    """Stated Young's modulus, Pa."""
    fibre: float
    """Distance of the first plate's outermost fibre from the neutral axis, m."""
    steps: int
    """Number of load steps of all sequences together."""

    @property
    def plates(self) -> int:
        """Number of plates of all segments together, which is the number of the tip disk too."""
        return sum(self.segments)

    @property
    def curvature(self) -> float:
        """Largest curvature, 1/m: the largest bend of a nominal plate over the first plate's flexible length."""
        return self.bend / self.arc

    @property
    def stiffness(self) -> float:
        """Moment per bend of the first plate, N m/rad."""
        return self.rigidity / self.arc

    @property
    def tip(self) -> float:
        """Force at the tip whose moment about the base is that of the strongest cable, N."""
        return self.pull * self.arm / self.length

    def of_cables(self) -> Iterator[RigPlace]:
        """Places of an effect of cables: without a parameter, which means all cables, then each cable alone."""
        yield ()
        yield from ((("cables", (name,)),) for name in self.reach)


@dataclass(frozen=True)
class Candidate:
    """One kind of effect at one place and with one shape; its size is free, or it has none."""

    place: RigPlace = ()
    parameters: Callable[[float], Mapping[str, Any]] = field(default=lambda size: {}, compare=False)
    """Parameters of the effect at a size, as a manipulator file has them."""
    low: float = 1.0
    """Smallest size that a rig could have, zero being no effect; `low = high = 1`: there is no size."""
    high: float = 1.0
    """Largest size that a rig could have."""
    shape: tuple[float, ...] = ()
    """Other numbers that were chosen for the form: a threshold, a direction."""
    variant: str = ""
    """Name of the law where its kind has several; the law is drawn before the place."""
    kind: str = ""

    @property
    def sized(self) -> bool:
        """Whether the effect comes in sizes, between `low` and `high`."""
        return self.low < self.high

    @property
    def probe(self) -> float:
        """A small size for a one-sided derivative; 1, the whole effect, where there is no size."""
        if not self.sized:
            return 1.0
        return PROBE * (self.high if self.high > -self.low else self.low)

    def effect(self, size: float) -> dict[str, Any]:
        """The effect at a size in the candidate's own unit, as a table of a manipulator file."""
        place = {key: list(value) if isinstance(value, tuple) else value for key, value in self.place}
        return {"kind": self.kind, **place, **self.parameters(size)}
