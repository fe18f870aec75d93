"""The library of effects: physics that real rigs have, each one small class that changes the chain.

An effect is switched on by an `[[effect]]` table in a manipulator file.  To add one, write a class with its parameters
and `change(chain, manipulator)`, list it in `Effect`, and test its law against an independent calculation.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterable, Iterator, Sequence
from typing import TYPE_CHECKING, Annotated, ClassVar, Literal, get_args

import numpy as np
from pydantic import BaseModel, ConfigDict, Field, model_validator

from prb3r.errors import did_you_mean
from prb3r.mechanics.chain import Chain, Contact, Law, Term, no_loads
from prb3r.mechanics.plate import with_end_hinges
from prb3r.model.moment_law import influences_of_place

if TYPE_CHECKING:
    from prb3r.model.manipulator import Manipulator

Positive = Annotated[float, Field(gt=0)]
NonNegative = Annotated[float, Field(ge=0)]
Efficiency = Annotated[float, Field(gt=0, le=1)]
Number = Annotated[int, Field(ge=1)]


class Base(BaseModel, ABC):
    """One effect; `kind` names it in a manipulator file."""

    model_config = ConfigDict(extra="forbid", frozen=True)
    late: ClassVar[int] = 0
    """Effects are applied in this order, then in that of the file."""
    kind: str

    @abstractmethod
    def change(self, chain: Chain, manipulator: Manipulator) -> Chain:
        """The chain with the effect."""

    def problems(self, manipulator: Manipulator) -> Iterator[str]:
        """What the effect names that the manipulator does not have."""
        names = manipulator.cable_names
        for cable in [*(getattr(self, "cables", None) or ()), *filter(None, [getattr(self, "cable", None)])]:
            if cable not in names:
                yield f"effect {self.kind}: there is no cable {cable!r}{did_you_mean(cable, names)}"
        segment, plates = (
            getattr(self, "segment", 1),
            [*(getattr(self, "plates", None) or ()), getattr(self, "plate", 1)],
        )
        if segment > len(manipulator.segment):
            yield f"effect {self.kind}: there is no segment {segment}, only {len(manipulator.segment)}"
        for plate in plates:
            if plate > manipulator.plates:
                yield f"effect {self.kind}: there is no plate {plate}, only {manipulator.plates}"
        if (disk := getattr(self, "disk", 0)) >= manipulator.plates:
            yield f"effect {self.kind}: cables rub at disks 0 to {manipulator.plates - 1}, not at {disk}"


def _columns(cables: Sequence[str] | None, manipulator: Manipulator) -> list[int]:
    """Numbers of the named cables, of all where none is named."""
    names = manipulator.cable_names
    return list(range(len(names))) if cables is None else [names.index(cable) for cable in cables]


class CableFriction(Base):
    """Belt friction where the nominal model has none."""

    kind: Literal["cable_friction"]
    coefficient: NonNegative

    def change(self, chain: Chain, manipulator: Manipulator) -> Chain:
        return chain._replace(friction=np.full_like(chain.friction, self.coefficient))


class PulleyFriction(Base):
    """A pulley before the base hole takes its share: drawn in, the tension behind it is `efficiency` times as large."""

    kind: Literal["pulley_friction"]
    efficiency: Efficiency
    cables: list[str] | None = None

    def change(self, chain: Chain, manipulator: Manipulator) -> Chain:
        pulley = np.ones(len(chain.reach)) * chain.pulley
        pulley[_columns(self.cables, manipulator)] *= self.efficiency
        return chain._replace(pulley=pulley)


class SlipHistory(Base):
    """Slip follows from the load path instead of being declared."""

    kind: Literal["slip_history"]
    presliding_m: Annotated[float, Field(ge=1e-7, le=0.1)]

    def change(self, chain: Chain, manipulator: Manipulator) -> Chain:
        return chain._replace(presliding=self.presliding_m)


class WornHole(Base):
    """Another friction coefficient at one disk (0 is the base)."""

    kind: Literal["worn_hole"]
    late: ClassVar[int] = 1
    disk: Annotated[int, Field(ge=0)]
    coefficient: NonNegative
    cables: list[str] | None = None

    def change(self, chain: Chain, manipulator: Manipulator) -> Chain:
        friction = chain.friction.copy()
        friction[self.disk, _columns(self.cables, manipulator)] = self.coefficient
        return chain._replace(friction=friction)


class EdgeWrap(Base):
    """Friction at both edges of every hole where the nominal model counts the net turn."""

    kind: Literal["edge_wrap"]

    def change(self, chain: Chain, manipulator: Manipulator) -> Chain:
        return chain._replace(edges=True)


class DeadCable(Base):
    """A cable that transmits nothing."""

    kind: Literal["dead_cable"]
    cable: str

    def change(self, chain: Chain, manipulator: Manipulator) -> Chain:
        reach = chain.reach.copy()
        reach[manipulator.cable_names.index(self.cable)] = 0
        return chain._replace(reach=reach)


class TensionOffset(Base):
    """Added to the applied tension of all (or the named) cables, idle ones too; no tension is below zero."""

    kind: Literal["tension_offset"]
    offset_n: float
    cables: list[str] | None = None

    def change(self, chain: Chain, manipulator: Manipulator) -> Chain:
        constant = chain.constant or no_loads(chain)
        tension = constant.tension.copy()
        tension[0, _columns(self.cables, manipulator)] += self.offset_n
        return chain._replace(constant=constant._replace(tension=tension))


class HoleOffset(Base):
    """Error of a cable's offset, added to it."""

    kind: Literal["hole_offset"]
    cable: str
    offset_m: float

    def change(self, chain: Chain, manipulator: Manipulator) -> Chain:
        offset = chain.offset.copy()
        offset[:, manipulator.cable_names.index(self.cable)] += self.offset_m
        return chain._replace(offset=offset)


class HoleClearance(Base):
    """Cables lie against the inner (concave) side of their holes."""

    kind: Literal["hole_clearance"]
    clearance_m: NonNegative

    def change(self, chain: Chain, manipulator: Manipulator) -> Chain:
        return chain._replace(clearance=chain.clearance + self.clearance_m)


class WeakenedPlate(Base):
    """One plate's bending stiffness times a factor."""

    kind: Literal["weakened_plate"]
    plate: Number
    factor: Positive

    def change(self, chain: Chain, manipulator: Manipulator) -> Chain:
        stiffness = chain.stiffness.copy()
        stiffness[self.plate - 1] *= self.factor
        return chain._replace(stiffness=stiffness)


class SegmentStiffness(Base):
    """One segment's bending stiffness times a factor."""

    kind: Literal["segment_stiffness"]
    segment: Number
    factor: Positive

    def change(self, chain: Chain, manipulator: Manipulator) -> Chain:
        factor = np.where(chain.segment == self.segment - 1, self.factor, 1.0)
        return chain._replace(stiffness=chain.stiffness * factor[:, None])


class NonlinearPlate(Base):
    """``M = EI k (1 + c k^2)``, or beyond the curvature `knee` a tangent stiffness of `ratio` times EI."""

    kind: Literal["nonlinear_plate"]
    law: Literal["cubic", "bilinear"]
    cubic_m2: NonNegative | None = None
    knee_per_m: Positive | None = None
    ratio: Annotated[float, Field(gt=0, le=10)] | None = None

    @model_validator(mode="after")
    def _complete(self) -> NonlinearPlate:
        given = {name for name in ("cubic_m2", "knee_per_m", "ratio") if getattr(self, name) is not None}
        needed = {"cubic_m2"} if self.law == "cubic" else {"knee_per_m", "ratio"}
        if given != needed:
            raise ValueError(f"the {self.law} law takes {' and '.join(sorted(needed))}, nothing else")
        return self

    def change(self, chain: Chain, manipulator: Manipulator) -> Chain:
        if self.cubic_m2 is not None:
            return chain._replace(law=chain.law._replace(cubic=self.cubic_m2))
        return chain._replace(law=Law(chain.law.cubic, self.knee_per_m or np.inf, self.ratio or 1.0))


class Precurvature(Base):
    """Stress-free curvature of the arc of all (or the named) plates."""

    kind: Literal["precurvature"]
    curvature_per_m: float
    plates: list[Number] | None = None

    def change(self, chain: Chain, manipulator: Manipulator) -> Chain:
        bent = np.ones(chain.plates) if self.plates is None else np.isin(np.arange(chain.plates) + 1, self.plates)
        return chain._replace(
            rest=chain.rest + self.curvature_per_m * (bent * chain.arc)[:, None] / chain.plate.stiffness
        )


class DiskContact(Base):
    """Disks (or the edges of notches) touch where a plate bends further than `angle`, and help to carry."""

    kind: Literal["disk_contact"]
    angle_rad: Positive
    stiffness_n_m_per_rad: Positive

    def change(self, chain: Chain, manipulator: Manipulator) -> Chain:
        return chain._replace(contact=Contact(self.angle_rad, self.stiffness_n_m_per_rad))


class ClampCompliance(Base):
    """A hinge at each end of the arc."""

    kind: Literal["clamp_compliance"]
    late: ClassVar[int] = 3
    compliance_rad_per_n_m: Positive

    def change(self, chain: Chain, manipulator: Manipulator) -> Chain:
        hinge = np.full((chain.plates, 1), 1 / self.compliance_rad_per_n_m)
        return chain._replace(
            plate=with_end_hinges(chain.plate),
            stiffness=np.hstack([hinge, chain.stiffness, hinge]),
            rest=np.pad(chain.rest, ((0, 0), (1, 1))),
            curvature=np.pad(chain.plate.stiffness, 1),
        )


class CableBending(Base):
    """Each cable routed through a plate (idle too, dead not) adds its own bending stiffness to it."""

    kind: Literal["cable_bending"]
    late: ClassVar[int] = 2
    stiffness_n_m2: NonNegative

    def change(self, chain: Chain, manipulator: Manipulator) -> Chain:
        routed = (np.arange(chain.plates)[:, None] < chain.reach).sum(1)
        added = self.stiffness_n_m2 * routed / chain.arc
        return chain._replace(stiffness=chain.stiffness + added[:, None] * chain.plate.stiffness)


class MomentTerm(BaseModel):
    """One term of a fitted moment law: `coefficient` times what `of` names, on all (or the named) plates.

    `constant` (1), `position` (-1 at the first plate to 1 at the last) and `time` (step number over the last one of the
    sequence) take N m; `bend` (rad) N m/rad, `bend_cubed` N m/rad^3; the others are multiples of the moment of the
    cables, tension times offset: `tension` of the moment itself, `wrap` (1/rad) of the moment times all bends up to
    the plate, `direction` of the moment signed by the cable's slip.
    """

    model_config = ConfigDict(extra="forbid", frozen=True)
    of: Literal["constant", "position", "bend", "bend_cubed", "tension", "wrap", "direction", "time"]
    coefficient: float
    plates: Annotated[list[Number], Field(min_length=1)] | None = None


class EmpiricalMoment(Base):
    """A fitted moment law without a mechanism: the sum of its terms bends the arc of each plate."""

    kind: Literal["empirical_moment"]
    terms: Annotated[list[MomentTerm], Field(min_length=1)]

    def change(self, chain: Chain, manipulator: Manipulator) -> Chain:
        constant, closure = chain.constant or no_loads(chain), chain.closure
        for term in self.terms:
            acts = np.isin(np.arange(chain.plates) + 1, term.plates) if term.plates else np.ones(chain.plates)
            if term.of in ("constant", "position"):
                follows = influences_of_place(chain)[term.of]
                constant = constant._replace(moment=constant.moment + term.coefficient * acts * follows)
            else:
                closure = (*closure, Term(term.of, term.coefficient * acts))
        return chain._replace(constant=constant, closure=closure)

    def problems(self, manipulator: Manipulator) -> Iterator[str]:
        for number, term in enumerate(self.terms, 1):
            for plate in term.plates or ():
                if plate > manipulator.plates:
                    yield f"effect {self.kind}: term {number}: there is no plate {plate}, only {manipulator.plates}"


class Gravity(Base):
    """In-plane gravity on every disk's mass."""

    kind: Literal["gravity"]
    x_m_s2: float = 0.0
    y_m_s2: float = 0.0

    def change(self, chain: Chain, manipulator: Manipulator) -> Chain:
        constant = chain.constant or no_loads(chain)
        force = constant.force + manipulator.disk.mass_kg * np.array([self.x_m_s2, self.y_m_s2])
        return chain._replace(constant=constant._replace(force=force))


class TipForce(Base):
    """An unrecorded constant force where tip loads act."""

    kind: Literal["tip_force"]
    x_n: float = 0.0
    y_n: float = 0.0

    def change(self, chain: Chain, manipulator: Manipulator) -> Chain:
        constant = chain.constant or no_loads(chain)
        return chain._replace(constant=constant._replace(tip=constant.tip + np.array([self.x_n, self.y_n])))


class TipLoadFriction(Base):
    """The recorded tip load arrives times `efficiency`."""

    kind: Literal["tip_load_friction"]
    efficiency: Efficiency

    def change(self, chain: Chain, manipulator: Manipulator) -> Chain:
        return chain._replace(tip_efficiency=chain.tip_efficiency * self.efficiency)


class Observation(Base):
    """An effect of the measurement: it changes what is read, not the chain."""

    def change(self, chain: Chain, manipulator: Manipulator) -> Chain:
        return chain

    @abstractmethod
    def observe(self, points: np.ndarray, centre: np.ndarray) -> np.ndarray:
        """Measured positions (..., 2) of `points`; `centre` (2,) of the image, m."""


class CameraScale(Observation):
    """measured = scale x true, about the base origin."""

    kind: Literal["camera_scale"]
    scale: Positive

    def observe(self, points: np.ndarray, centre: np.ndarray) -> np.ndarray:
        return self.scale * points


class LensDistortion(Observation):
    """measured = c + (p - c)(1 + k1 r^2), r = |p - c|."""

    kind: Literal["lens_distortion"]
    late: ClassVar[int] = 1
    k1_per_m2: float

    def observe(self, points: np.ndarray, centre: np.ndarray) -> np.ndarray:
        away = points - centre
        return centre + away * (1 + self.k1_per_m2 * (away**2).sum(-1, keepdims=True))


Effect = Annotated[
    CableFriction
    | PulleyFriction
    | SlipHistory
    | WornHole
    | EdgeWrap
    | DeadCable
    | TensionOffset
    | HoleOffset
    | HoleClearance
    | WeakenedPlate
    | SegmentStiffness
    | NonlinearPlate
    | Precurvature
    | DiskContact
    | ClampCompliance
    | CableBending
    | EmpiricalMoment
    | Gravity
    | TipForce
    | TipLoadFriction
    | CameraScale
    | LensDistortion,
    Field(discriminator="kind"),
]


EFFECT_KINDS: dict[str, type[Base]] = {
    get_args(member.model_fields["kind"].annotation)[0]: member for member in get_args(get_args(Effect)[0])
}
"""Every effect class by its kind."""


def with_effects(chain: Chain, manipulator: Manipulator, effects: Iterable[Base]) -> Chain:
    """The chain with all effects, in their order."""
    for effect in sorted(effects, key=lambda effect: effect.late):
        chain = effect.change(chain, manipulator)
    return chain


def observed(points: np.ndarray, effects: Iterable[Base], image_centre_m: Sequence[float]) -> np.ndarray:
    """Positions (..., 2) as read with all observation effects, scale before distortion."""
    for effect in sorted(effects, key=lambda effect: effect.late):
        if isinstance(effect, Observation):
            points = effect.observe(points, np.asarray(image_centre_m))
    return points
