"""What could have been left out: every effect of the library at every place where it could sit.

A hypothesis is one kind of effect at one place with its free parameters.  To let the diagnosis consider a new effect,
add a function that yields its hypotheses and list it in `LIBRARY`.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from prb3r.mechanics.chain import Chain
from prb3r.mechanics.equilibrium import Equilibria
from prb3r.model.effects import EFFECT_KINDS
from prb3r.model.effects.base import Effect
from prb3r.model.manipulator import Manipulator
from prb3r.recording.recording import Recording

FARTHEST = 50.0
"""Beyond it an exponential is any bound."""
SMALL = 1e-3
"""Step of a free parameter, in its own scale, that stands for a derivative."""


class Free(NamedTuple):
    """A parameter that is fitted: value = null exp(u) if `log`, else null + scale u."""

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

    def value(self, u: float, friction: float = 0.0) -> float:
        plain = self.null * np.exp(min(u, FARTHEST)) if self.log else self.null + self.scale * u
        return float(np.clip(plain + (friction if self.above else 0.0), self.low, self.high))

    def at(self, value: float, friction: float = 0.0) -> float:
        """The `u` of a value."""
        value -= friction if self.above else 0.0
        return float(np.log(value / self.null)) if self.log else (value - self.null) / self.scale

    def bounds(self, friction: float = 0.0) -> tuple[float, float]:
        return self.at(self.low, friction), self.at(self.high, friction)


@dataclass(frozen=True)
class Hypothesis:
    """One kind of effect at one place."""

    kind: str
    place: tuple[tuple[str, Any], ...] = ()
    """Parameters that are not fitted: plate, cable, law."""
    free: tuple[Free, ...] = ()
    probes: tuple[tuple[float, ...], ...] = ()
    """Values of the free parameters at which an effect that does not vanish by degrees is tried."""
    sided: bool = False
    """Whether the effect has one direction only."""
    mechanical: bool = True
    """Whether the states change, not only their reading."""
    kinked: bool = False
    """Whether the two signs of the effect differ already when it is small."""

    @property
    def by_degrees(self) -> bool:
        """Whether the effect vanishes smoothly, so that a derivative tells its direction."""
        return not self.probes

    @property
    def name(self) -> str:
        places = ", ".join(
            f"{key} {'+'.join(map(str, value)) if isinstance(value, tuple) else value}" for key, value in self.place
        )
        return self.kind + (f" ({places})" if places else "")

    def effect(self, u: np.ndarray, friction: float) -> Effect:
        """The effect for free parameters `u` and the calibrated friction coefficient."""
        values = {free.name: free.value(each, friction) for free, each in zip(self.free, u, strict=True)}
        place = {key: list(value) if isinstance(value, tuple) else value for key, value in self.place}
        return EFFECT_KINDS[self.kind](kind=self.kind, **place, **values)

    def starts(self, friction: float) -> list[np.ndarray]:
        """Points `u` from which a fit begins, or where a probe stands."""
        if self.kinked:
            return [np.array([-SMALL]), np.array([SMALL])]
        if self.by_degrees:
            return [np.zeros(len(self.free))]
        return [
            np.array([free.at(value, friction) for free, value in zip(self.free, probe, strict=True)])
            for probe in self.probes
        ]


class Bench(NamedTuple):
    """What the library needs to know of a recording."""

    recording: Recording
    manipulator: Manipulator
    chain: Chain
    bend: np.ndarray
    """(s, n) bends of the plates in the calibrated model, rad."""

    @property
    def plates(self) -> range:
        return range(1, self.chain.plates + 1)

    @property
    def pull(self) -> float:
        """Largest tension, N."""
        return float(self.recording.loads.tension.max(initial=0.0)) or 1.0

    @property
    def curvature(self) -> float:
        """Largest curvature, 1/m."""
        return float(np.nanmax(np.abs(self.bend) / self.chain.arc)) or 1.0

    @property
    def pulled(self) -> list[str]:
        """Cables that are ever loaded."""
        names = self.manipulator.cable_names
        return [names[j] for j in np.flatnonzero((self.recording.loads.tension > 0).any(0))]

    @property
    def moment(self) -> float:
        """Typical largest bending moment, N m."""
        return self.pull * float(np.abs(self.chain.offset).max(initial=0.0)) or 1.0


def bench(recording: Recording, chain: Chain, states: Equilibria) -> Bench:
    """The bench of a recording with the calibrated states of its model."""
    return Bench(recording, recording.manipulator, chain, np.diff(states.angle, axis=1))


def _of_cables(bench: Bench) -> Iterator[tuple[tuple[str, Any], ...]]:
    """All cables together, then each that is pulled alone."""
    yield ()
    if len(bench.manipulator.cable_names) > 1:
        yield from (((("cables", (name,)),)) for name in bench.pulled)


def _cable_friction(bench: Bench) -> Iterator[Hypothesis]:
    if bench.manipulator.friction.coefficient == 0:
        yield Hypothesis("cable_friction", free=(Free("coefficient", 0.0, 0.0, 2.0),), sided=True)


def _pulley_friction(bench: Bench) -> Iterator[Hypothesis]:
    for place in _of_cables(bench):
        yield Hypothesis("pulley_friction", place, (Free("efficiency", 1.0, 0.2, 1.0, log=True),), sided=True)


def _slip_history(bench: Bench) -> Iterator[Hypothesis]:
    if bench.manipulator.friction.coefficient > 0 and bench.manipulator.friction.direction == "declared":
        yield Hypothesis(
            "slip_history",
            free=(Free("presliding_m", 3e-5, 1e-6, 1e-2, log=True, limit=True),),
            probes=((3e-5,), (3e-4,)),
        )


def _worn_hole(bench: Bench) -> Iterator[Hypothesis]:
    for disk in range(bench.chain.plates):
        for place in _of_cables(bench):
            crossing = place and bench.chain.reach[bench.manipulator.cable_names.index(place[0][1][0])] <= disk
            if not crossing:
                free = Free("coefficient", 0.0, 0.0, 5.0, above=True)
                yield Hypothesis("worn_hole", (("disk", disk), *place), (free,))


def _edge_wrap(bench: Bench) -> Iterator[Hypothesis]:
    if bench.manipulator.friction.coefficient > 0 and bench.manipulator.friction.wrap == "net":
        yield Hypothesis("edge_wrap", probes=((),))


def _dead_cable(bench: Bench) -> Iterator[Hypothesis]:
    for name in bench.pulled:
        yield Hypothesis("dead_cable", (("cable", name),), probes=((),))


def _tension_offset(bench: Bench) -> Iterator[Hypothesis]:
    for place in _of_cables(bench):
        span = 0.5 * bench.pull
        free = Free("offset_n", 0.0, -span, span, scale=bench.pull)
        yield Hypothesis("tension_offset", place, (free,), kinked=True)  # idle cables feel only what is added


def _hole_offset(bench: Bench) -> Iterator[Hypothesis]:
    for name in bench.pulled:
        arm = float(np.abs(bench.chain.offset[:, bench.manipulator.cable_names.index(name)]).max())
        free = Free("offset_m", 0.0, -0.5 * arm, 0.5 * arm, scale=arm)
        yield Hypothesis("hole_offset", (("cable", name),), (free,))


def _hole_clearance(bench: Bench) -> Iterator[Hypothesis]:
    arm = float(np.abs(bench.chain.offset).max(initial=0.0))
    if arm:
        yield Hypothesis("hole_clearance", free=(Free("clearance_m", 0.0, 0.0, 0.5 * arm, scale=arm),), sided=True)


def _weakened_plate(bench: Bench) -> Iterator[Hypothesis]:
    for plate in bench.plates:
        yield Hypothesis("weakened_plate", (("plate", plate),), (Free("factor", 1.0, 0.05, 20.0, log=True),))


def _segment_stiffness(bench: Bench) -> Iterator[Hypothesis]:
    """Of every segment with more than one plate; of one plate it is `weakened_plate`, of the only one it is E."""
    for number, segment in enumerate(bench.manipulator.segment, 1):
        if segment.plates > 1 and len(bench.manipulator.segment) > 1:
            free = Free("factor", 1.0, 0.05, 20.0, log=True)
            yield Hypothesis("segment_stiffness", (("segment", number),), (free,))


def _nonlinear_plate(bench: Bench) -> Iterator[Hypothesis]:
    k = bench.curvature
    cubic = Free("cubic_m2", 0.0, 0.0, 100 / k**2, scale=1 / k**2)
    yield Hypothesis("nonlinear_plate", (("law", "cubic"),), (cubic,), sided=True)
    free = (Free("knee_per_m", k / 2, k / 50, k, log=True), Free("ratio", 1.0, 0.02, 10.0, log=True))
    probes = tuple((share * k, ratio) for share in (0.3, 0.55, 0.8) for ratio in (0.7, 1.4))
    yield Hypothesis("nonlinear_plate", (("law", "bilinear"),), free, probes)


def _precurvature(bench: Bench) -> Iterator[Hypothesis]:
    k = bench.curvature
    free = Free("curvature_per_m", 0.0, -k, k, scale=k)
    yield Hypothesis("precurvature", free=(free,))
    segments = bench.manipulator.segment
    ends = bench.manipulator.segment_ends
    if len(segments) > 1:
        for segment, end in zip(segments, ends, strict=True):
            if segment.plates > 1:
                yield Hypothesis(
                    "precurvature", (("plates", tuple(range(end - segment.plates + 1, end + 1))),), (free,)
                )
    if bench.chain.plates > 1:
        yield from (Hypothesis("precurvature", (("plates", (plate,)),), (free,)) for plate in bench.plates)


def _disk_contact(bench: Bench) -> Iterator[Hypothesis]:
    bend = float(np.nanmax(np.abs(bench.bend))) or 1.0
    stiff = float(np.median(bench.chain.stiffness.sum(1) / bench.chain.stiffness.shape[1] ** 2))
    free = (
        Free("angle_rad", bend / 2, bend / 50, bend, log=True),
        Free("stiffness_n_m_per_rad", stiff, stiff / 1e3, 1e4 * stiff, log=True),
    )
    probes = tuple((share * bend, size * stiff) for share in (0.15, 0.4, 0.65, 0.85) for size in (0.3, 3.0))
    yield Hypothesis("disk_contact", free=free, probes=probes)


def _clamp_compliance(bench: Bench) -> Iterator[Hypothesis]:
    soft = float(np.median(bench.chain.arc / (bench.chain.stiffness * bench.chain.arc[:, None]).mean(1)))
    free = Free("compliance_rad_per_n_m", 1e-6 * soft, 1e-7 * soft, 10 * soft, scale=soft)
    yield Hypothesis("clamp_compliance", free=(free,), sided=True)


def _cable_bending(bench: Bench) -> Iterator[Hypothesis]:
    if len(bench.manipulator.cable_names):
        rigid = float(np.median((bench.chain.stiffness * bench.chain.arc[:, None]).mean(1)))
        yield Hypothesis("cable_bending", free=(Free("stiffness_n_m2", 0.0, 0.0, 10 * rigid, scale=rigid),), sided=True)


def _gravity(bench: Bench) -> Iterator[Hypothesis]:
    if bench.manipulator.disk.mass_kg > 0:
        yield Hypothesis("gravity", free=tuple(Free(f"{axis}_m_s2", 0.0, -20.0, 20.0, scale=10.0) for axis in "xy"))


def _tip_force(bench: Bench) -> Iterator[Hypothesis]:
    size = bench.moment / bench.chain.length
    free = tuple(Free(f"{axis}_n", 0.0, -5 * size, 5 * size, scale=size) for axis in "xy")
    yield Hypothesis("tip_force", free=free)


def _tip_load_friction(bench: Bench) -> Iterator[Hypothesis]:
    if bench.recording.loads.tip.any():
        yield Hypothesis("tip_load_friction", free=(Free("efficiency", 1.0, 0.05, 1.0, log=True),), sided=True)


def _camera(bench: Bench) -> Iterator[Hypothesis]:
    if (bench.recording.readings.kind <= 1).any():
        scale = Free("scale", 1.0, 0.8, 1.25, log=True)
        yield Hypothesis("camera_scale", free=(scale,), mechanical=False)
        size = 1 / bench.chain.length**2
        yield Hypothesis("lens_distortion", free=(Free("k1_per_m2", 0.0, -size, size, scale=size),), mechanical=False)


LIBRARY: tuple[Callable[[Bench], Iterator[Hypothesis]], ...] = (
    _cable_friction,
    _pulley_friction,
    _slip_history,
    _worn_hole,
    _edge_wrap,
    _dead_cable,
    _tension_offset,
    _hole_offset,
    _hole_clearance,
    _weakened_plate,
    _segment_stiffness,
    _nonlinear_plate,
    _precurvature,
    _disk_contact,
    _clamp_compliance,
    _cable_bending,
    _gravity,
    _tip_force,
    _tip_load_friction,
    _camera,
)


def hypotheses(bench: Bench, without: frozenset[str] = frozenset()) -> tuple[Hypothesis, ...]:
    """Every hypothesis that makes sense for a recording; `without` names kinds to leave out."""
    present = {effect.kind for effect in bench.manipulator.effect}
    singular = present & {"cable_friction", "slip_history", "edge_wrap", "nonlinear_plate", "disk_contact"}
    return tuple(
        each for family in LIBRARY for each in family(bench) if each.kind not in without and each.kind not in singular
    )
