"""An effect as it can be concealed: at one place, a function of one size that vanishes with the effect."""

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any

RigPlace = tuple[tuple[str, Any], ...]
"""Parameters that say where or which, with their values; lists as tuples."""
PROBE = 2e-3
"""Part of the largest size that stands for a derivative: one-sided, so that it errs by parts in a thousand of how bent
the response is; the tolerance of the rig (1e-6 of a sub-step) is far below it."""


@dataclass(frozen=True)
class Conditions:
    """Under which effects are concealed on a design, and what their sizes are measured by.

    Sizes of effects are written in these units, so that one range of sizes serves all designs.
    """

    segments: tuple[int, ...]
    """Plates of each segment."""
    reach: Mapping[str, int]
    """Plates that each cable crosses."""
    friction: float
    """Nominal coefficient."""
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
    """Of the straight manipulator, m."""
    bend: float
    """Largest bend of a plate of the nominal manipulator, rad."""
    arc: float
    """Flexible length of the first plate, m."""
    rigidity: float
    """EI of the first plate, N m^2."""
    modulus: float
    """Stated Young's modulus, Pa."""
    fibre: float
    """Distance of its outermost fibre from the neutral axis, m."""
    steps: int
    """Load steps of all sequences."""

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
    """One kind of effect at one place, with one shape; its size is free, or it has none."""

    place: RigPlace = ()
    parameters: Callable[[float], Mapping[str, Any]] = field(default=lambda size: {}, compare=False)
    """Of a size."""
    low: float = 1.0
    """Sizes that a rig could have, zero for no effect; `low = high = 1`: there is no size."""
    high: float = 1.0
    shape: tuple[float, ...] = ()
    """What else was chosen: a threshold, a direction."""
    variant: str = ""
    """Which of several laws of its kind it is; a law is drawn before a place is."""
    kind: str = ""

    @property
    def sized(self) -> bool:
        """Whether the effect comes in sizes, between `low` and `high`."""
        return self.low < self.high

    @property
    def probe(self) -> float:
        """A small size for a derivative, or the whole effect."""
        if not self.sized:
            return 1.0
        return PROBE * (self.high if self.high > -self.low else self.low)

    def effect(self, size: float) -> dict[str, Any]:
        """The effect at a size in the candidate's own unit, as a table of a manipulator file."""
        place = {key: list(value) if isinstance(value, tuple) else value for key, value in self.place}
        return {"kind": self.kind, **place, **self.parameters(size)}
