"""Effects on plates: stiffness, bending law, hysteresis, stress-free shape, contact, compliance of the clamps."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Annotated, ClassVar, Literal

import numpy as np
from pydantic import Field, model_validator

from prb3r.mechanics.chain import Chain
from prb3r.mechanics.plate_law import MOST_ELEMENTS, Contact, Hysteresis, Law
from prb3r.model.effects.base import SIDE_COLUMN, Effect, Host, Number, Side, mask_of
from prb3r.model.effects.hinges import RIGID, hinged
from prb3r.model.files.numbers import NonNegative, Positive
from prb3r.model.files.plausible import BendAngle


class WeakenedPlate(Effect):
    """One plate's bending stiffness times a factor."""

    kind: Literal["weakened_plate"]
    plate: Number
    factor: Positive

    def change(self, chain: Chain, manipulator: Host) -> Chain:
        stiffness = chain.stiffness.copy()
        stiffness[self.plate - 1] *= self.factor
        return chain._replace(stiffness=stiffness)


class SegmentStiffness(Effect):
    """One segment's bending stiffness times a factor."""

    kind: Literal["segment_stiffness"]
    segment: Number
    factor: Positive

    def change(self, chain: Chain, manipulator: Host) -> Chain:
        factor = np.where(chain.segment == self.segment - 1, self.factor, 1.0)
        return chain._replace(stiffness=chain.stiffness * factor[:, None])


class StiffnessGradient(Effect):
    """Bending stiffness that changes steadily from plate 1 to the last plate, whose factor is `tip_to_base` times that
    of the first; the geometric mean of the factors is 1."""

    kind: Literal["stiffness_gradient"]
    tip_to_base: Annotated[
        Positive, Field(description="Stiffness of the last plate over that of the first, of nominal.")
    ]

    def change(self, chain: Chain, manipulator: Host) -> Chain:
        factor = self.tip_to_base ** _along_arm(chain.plates)
        return chain._replace(stiffness=chain.stiffness * factor[:, None])


def _along_arm(plates: int) -> np.ndarray:
    """(plates,) place of each plate along the arm, from -1/2 for plate 1 to 1/2 for the last; 0 for a single one."""
    return (np.arange(plates) - (plates - 1) / 2) / max(plates - 1, 1)


class NonlinearPlate(Effect):
    """The law `cubic` takes `cubic_m2` (c): M = EI k (1 + c k^2); `bilinear` takes `knee_per_m` and `ratio`: beyond the
    curvature of the knee the tangent stiffness is `ratio` times EI. `smooth` takes a `sharpness` (R) too: M = EI k
    (ratio + (1 - ratio) / (1 + (k / knee)^R)^(1/R)). Instead of `knee_per_m` a knee may be given as `knee_strain`, that
    of the outermost fibre, so that each plate has its own curvature there. With `sections` = similar, for plates of
    which no fibre is known, `knee_per_m` is that of plate 1, and of the others as if all sections had one shape: at the
    same strain, larger by the inverse fourth root of their stiffness. A law with a `side` (positive, negative) is that
    of bending to that side alone."""

    kind: Literal["nonlinear_plate"]
    once: ClassVar[bool] = True
    law: Literal["cubic", "bilinear", "smooth"]
    cubic_m2: NonNegative | None = None
    knee_per_m: Positive | None = None
    ratio: Annotated[float, Field(gt=0, le=10)] | None = None
    knee_strain: Positive | None = None
    sharpness: Annotated[float, Field(ge=1, le=100)] | None = None
    side: Side | None = None
    sections: Literal["similar"] | None = None

    @model_validator(mode="after")
    def _complete(self) -> NonlinearPlate:
        names = "cubic_m2", "knee_per_m", "knee_strain", "ratio", "sharpness", "side", "sections"
        given = {name for name in names if getattr(self, name) is not None}
        knee = "knee_per_m" if self.knee_strain is None else "knee_strain"
        needed = {"cubic": {"cubic_m2"}, "bilinear": {knee, "ratio"}, "smooth": {knee, "ratio", "sharpness"}}[self.law]
        possible = set() if self.law == "cubic" else {"side"} if knee == "knee_strain" else {"side", "sections"}
        if given - possible != needed:
            raise ValueError(f"the {self.law} law takes {' and '.join(sorted(needed))}, nothing else")
        return self

    def change(self, chain: Chain, manipulator: Host) -> Chain:
        if self.cubic_m2 is not None:
            return chain._replace(law=Law(self.cubic_m2))
        knee = np.full((chain.plates, 2), np.inf)
        in_curvature = self.knee_per_m if self.knee_strain is None else self.knee_strain / manipulator.outer_fibre
        if self.sections == "similar":
            in_curvature = in_curvature / relative_size(manipulator.bending_stiffness)
        knee.T[SIDE_COLUMN[self.side]] = in_curvature  # all plates of one side, or of both
        return chain._replace(law=Law(0.0, knee, self.ratio or 1.0, self.sharpness or np.inf))

    def problems(self, manipulator: Host) -> Iterator[str]:
        """A message if a knee is given as strain and the outer fibre of a segment is not known."""
        if self.knee_strain is not None and np.isnan(manipulator.outer_fibre).any():
            yield f"effect {self.kind}: knee_strain needs outer_fibre_m (or thickness_m) of every segment"


def relative_size(bending_stiffness: np.ndarray) -> np.ndarray:
    """(n,) size of the section of each plate over that of plate 1, if all have the same shape and modulus.

    EI grows with the fourth power of the size; `bending_stiffness` (n,) in N m^2.
    """
    return (bending_stiffness / bending_stiffness[0]) ** 0.25


class HystereticPlate(Effect):
    """The plates dissipate as they bend to and fro (superelastic, laminated or plastic ones): `slipping_share` of their
    stiffness is carried by `elements` (1 to 3, absent: 1) equal Jenkin elements, each a spring that slips from a bend
    of its own on: for m of them 1/m, 3/m ... (2m - 1)/m of the curvature `yield_per_m`, or of that at which the
    outermost fibre is strained by `yield_strain`. The rest of the stiffness follows the plates' law. A sequence begins
    with plates that were never bent. As long as they are only loaded, one element is the bilinear law with its knee
    there and the ratio 1 - `slipping_share`."""

    kind: Literal["hysteretic_plate"]
    once: ClassVar[bool] = True
    slipping_share: Annotated[float, Field(ge=0, le=0.95)]
    yield_per_m: Positive | None = None
    yield_strain: Positive | None = None
    elements: Annotated[int, Field(ge=1, le=MOST_ELEMENTS)] | None = None

    @model_validator(mode="after")
    def _complete(self) -> HystereticPlate:
        if (self.yield_per_m is None) == (self.yield_strain is None):
            raise ValueError("hysteresis takes either yield_per_m or yield_strain")
        return self

    def change(self, chain: Chain, manipulator: Host) -> Chain:
        curvature = self.yield_per_m if self.yield_strain is None else self.yield_strain / manipulator.outer_fibre
        slips = Hysteresis(self.slipping_share, np.full(chain.plates, curvature), self.elements or 1)
        return chain._replace(hysteresis=slips)

    def problems(self, manipulator: Host) -> Iterator[str]:
        """A message if yielding is given as strain and the outer fibre of a segment is not known."""
        if self.yield_strain is not None and np.isnan(manipulator.outer_fibre).any():
            yield f"effect {self.kind}: yield_strain needs outer_fibre_m (or thickness_m) of every segment"


class Precurvature(Effect):
    """Stress-free curvature of the arc of all (or the named) plates."""

    kind: Literal["precurvature"]
    curvature_per_m: float
    plates: list[Number] | None = None

    def change(self, chain: Chain, manipulator: Host) -> Chain:
        bent = np.ones(chain.plates) if self.plates is None else mask_of(self.plates, chain.plates)
        return chain._replace(
            rest=chain.rest + self.curvature_per_m * (bent * chain.arc)[:, None] / chain.plate.stiffness
        )


class PrecurvatureGradient(Effect):
    """Stress-free curvature of the arcs that changes steadily along an arm, as of one that was wound up or has taken a
    set: by `change_per_m` from plate 1 to the last, with a mean of zero. So the last plate has half of it, and the
    first as much the other way."""

    kind: Literal["precurvature_gradient"]
    change_per_m: Annotated[
        float, Field(description="Curvature of the last plate less that of the first, both stress-free.")
    ]

    def change(self, chain: Chain, manipulator: Host) -> Chain:
        curvature = self.change_per_m * _along_arm(chain.plates)
        return chain._replace(rest=chain.rest + (curvature * chain.arc)[:, None] / chain.plate.stiffness)


class DiskContact(Effect):
    """Where the bend between two disks exceeds the angle, to either side, the disks (or the edges of a notch) touch and
    carry the stiffness times the excess."""

    kind: Literal["disk_contact"]
    once: ClassVar[bool] = True
    angle_rad: BendAngle
    stiffness_n_m_per_rad: Positive

    def change(self, chain: Chain, manipulator: Host) -> Chain:
        return chain._replace(contact=Contact(self.angle_rad, self.stiffness_n_m_per_rad))


class NotchClosing(Effect):
    """Notches close: where a plate bends beyond `factor` times h / (cable arm + outer fibre), to either side (or only
    to one `side`, positive or negative), its edges touch and carry the stiffness times the excess. Here h is the
    flexible length of the plate, the cable arm the largest offset of a cable on the side to which it bends, and the
    outer fibre 0 where it is not known; toward a side without cables a plate does not close. On the sides where notches
    close it replaces `disk_contact`."""

    kind: Literal["notch_closing"]
    once: ClassVar[bool] = True
    late: ClassVar[int] = 1
    factor: Annotated[Positive, Field(description="What the angle at which edges meet by geometry is multiplied by.")]
    stiffness_n_m_per_rad: Positive
    side: Side | None = None

    def change(self, chain: Chain, manipulator: Host) -> Chain:
        angle, stiffness = np.empty((2, chain.plates, 2))
        angle[:], stiffness[:] = chain.contact
        column = SIDE_COLUMN[self.side]
        angle[:, column] = self.factor * closing_angles(chain.arc, manipulator)[:, column]
        stiffness[:, column] = self.stiffness_n_m_per_rad
        return chain._replace(contact=Contact(angle, stiffness))


def closing_angles(arc: np.ndarray, manipulator: Host) -> np.ndarray:
    """(n, 2) bends toward the negative and the positive side at which notches as long as each `arc` (n,) close, rad.

    A fibre of a plate that is bent to a circle shortens by the bend times its distance from the neutral axis; a notch
    is closed where the fibre at the height of cable and outer fibre together has lost its length.  Infinite toward a
    side without cables.
    """
    height = closing_heights(manipulator)
    return np.divide(arc[:, None], height, out=np.full(height.shape, np.inf), where=height > 0)


def closing_heights(manipulator: Host, fibre: bool = True) -> np.ndarray:
    """(n, 2) distance from the neutral axis at which the edges of notches meet toward the negative and the positive
    side, m: cable arm and outer fibre (if `fibre`, and known) together, or 0 toward a side without cables."""
    arm = np.stack([manipulator.cable_arm(side) for side in (-1, 1)], axis=1)
    beyond = np.nan_to_num(manipulator.outer_fibre)[:, None] if fibre else 0.0
    return np.where(arm > 0, arm + beyond, 0.0)


class ClampCompliance(Effect):
    """A hinge at each end of the arc of every plate."""

    kind: Literal["clamp_compliance"]
    late: ClassVar[int] = 3
    compliance_rad_per_n_m: Positive

    def change(self, chain: Chain, manipulator: Host) -> Chain:
        if np.isnan(chain.plate.stiffness[0]):  # the hinges are there already; this one is in series with them
            stiffness = chain.stiffness.copy()
            stiffness[:, [0, -1]] = 1 / (1 / stiffness[:, [0, -1]] + self.compliance_rad_per_n_m)
            return chain._replace(stiffness=stiffness)
        return hinged(chain, 1 / self.compliance_rad_per_n_m)

    def problems(self, manipulator: Host) -> Iterator[str]:
        """A message for the model of constant curvature, in which node angles are tied to one bend per segment."""
        if manipulator.model == "constant-curvature":
            yield f"effect {self.kind} needs the model 'prb3r' or 'elastica'"


class BaseCompliance(Effect):
    """The clamp in the base gives way: plate 1 turns against the base disk, whose holes stay in place, by the
    compliance times the moment that the plate carries there."""

    kind: Literal["base_compliance"]
    late: ClassVar[int] = 4
    compliance_rad_per_n_m: NonNegative

    def change(self, chain: Chain, manipulator: Host) -> Chain:
        if not np.isnan(chain.plate.stiffness[0]):
            chain = hinged(chain, RIGID * float(chain.stiffness.max()))
        stiffness = chain.stiffness.copy()
        stiffness[0, 0] = 1 / (1 / stiffness[0, 0] + self.compliance_rad_per_n_m)
        return chain._replace(stiffness=stiffness)

    def problems(self, manipulator: Host) -> Iterator[str]:
        """A message for the model of constant curvature, in which node angles are tied to one bend per segment."""
        if manipulator.model == "constant-curvature":
            yield f"effect {self.kind} needs the model 'prb3r' or 'elastica'"


class PlateSoftening(Effect):
    """Plates, with their clamps, that soften as they warm up or wear: for every step of the table before, they lose
    this share of their stiffness at the first step; with a negative share they stiffen."""

    kind: Literal["plate_softening"]
    goes_by_time: ClassVar[bool] = True
    share_per_step: Annotated[float, Field(ge=-1, lt=1)]

    def change(self, chain: Chain, manipulator: Host) -> Chain:
        return chain._replace(softening=chain.softening + self.share_per_step)


class PlateRelaxation(Effect):
    """Plates that creep and relax, as plastics do: of the moment that a plate's law gives, a `share` relaxes in the
    long run, with a time constant of so many `steps`: those of the table, or, where that has times (`time_s`), steps
    of `step_s` each, if given. Under a steady load a plate bends on, in the end 1 / (1 - `share`) times as far; let go,
    it comes back slowly. The loads of a step act as soon as it begins and are held until it is read. A sequence begins
    with plates in which nothing has relaxed, and its first step takes as long as one of these."""

    kind: Literal["plate_relaxation"]
    once: ClassVar[bool] = True
    goes_by_time: ClassVar[bool] = True
    instead_of: ClassVar[frozenset[str]] = frozenset({"hysteretic_plate", "flag_hysteresis"})
    share: Annotated[float, Field(ge=0, le=0.95, description="Share of the plates' moments that relaxes.")]
    steps: Annotated[Positive, Field(description="Time constant of the relaxation, in steps.")]
    step_s: Positive | None = Field(None, description="How long such a step lasts, s; absent: as a mean one.")

    def change(self, chain: Chain, manipulator: Host) -> Chain:
        return chain._replace(relaxation=self.share, relaxation_time=self.steps, relaxation_step=self.step_s or 0.0)


class CableBending(Effect):
    """Each cable that runs through a plate, idle or not unless it is dead, adds its own bending stiffness to the
    plate's; this part neither yields nor wears with the plate."""

    kind: Literal["cable_bending"]
    late: ClassVar[int] = 2
    stiffness_n_m2: NonNegative

    def change(self, chain: Chain, manipulator: Host) -> Chain:
        routed = (np.arange(chain.plates)[:, None] < chain.reach).sum(1)
        added = self.stiffness_n_m2 * routed / chain.arc
        return chain._replace(cable_stiffness=chain.cable_stiffness + added[:, None] * chain.plate.stiffness)
