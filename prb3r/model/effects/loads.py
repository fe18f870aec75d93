"""Effects on dead loads: constant loads that are not recorded, and recorded loads of which only a share acts."""

from collections.abc import Iterator
from typing import Annotated, ClassVar, Literal

import numpy as np
from pydantic import Field

from prb3r.mechanics.chain import Chain, no_loads
from prb3r.model.effects.base import Effect, Efficiency, Host, Number
from prb3r.model.files.numbers import NonNegative, Positive
from prb3r.model.files.plausible import TiltAngle


class Gravity(Effect):
    """In-plane part of gravity on the mass of every disk and plate, and on what the tip carries."""

    kind: Literal["gravity"]
    x_m_s2: float = 0.0
    y_m_s2: float = 0.0

    def change(self, chain: Chain, manipulator: Host) -> Chain:
        constant = chain.constant or no_loads(chain)
        gravity = np.array([self.x_m_s2, self.y_m_s2])
        force = constant.force + manipulator.disk_masses[:, None] * gravity
        return chain._replace(constant=constant._replace(force=force), gravity=chain.gravity + gravity)

    def idle(self, manipulator: Host) -> str:
        if self.x_m_s2 == self.y_m_s2 == 0:
            return "x_m_s2 and y_m_s2 are 0"
        masses = manipulator.disk_masses.any() or any(isinstance(effect, TipMass) for effect in manipulator.effect)
        return "" if masses else "nothing has a mass (disk.mass_kg, disk.tip_mass_kg, segment.1.plate_mass_kg)"


class SelfWeight(Effect):
    """The weight of the arm itself where the manipulator file gives nothing a mass: forces `x_n` and `y_n` in all,
    shared evenly by the disks from 1 to the tip."""

    kind: Literal["self_weight"]
    x_n: float = 0.0
    y_n: float = 0.0

    def change(self, chain: Chain, manipulator: Host) -> Chain:
        constant = chain.constant or no_loads(chain)
        share = np.array([self.x_n, self.y_n]) / chain.plates
        return chain._replace(constant=constant._replace(force=constant.force + share))

    def idle(self, manipulator: Host) -> str:
        return "x_n and y_n are 0" if self.x_n == self.y_n == 0 else ""


class TipForce(Effect):
    """An unrecorded constant force where tip loads act."""

    kind: Literal["tip_force"]
    x_n: float = 0.0
    y_n: float = 0.0

    def change(self, chain: Chain, manipulator: Host) -> Chain:
        constant = chain.constant or no_loads(chain)
        return chain._replace(constant=constant._replace(tip=constant.tip + np.array([self.x_n, self.y_n])))


class TipMass(Effect):
    """The tip is heavier or lighter than noted, as by a gripper, a camera or a hose: gravity acts on `mass_kg` more at
    the last disk. Without `gravity` it does nothing."""

    kind: Literal["tip_mass"]
    late: ClassVar[int] = 1  # after all gravity
    mass_kg: Annotated[
        float, Field(le=20, description="Mass at the last disk beside what the file gives it, kg; negative: less.")
    ]

    def change(self, chain: Chain, manipulator: Host) -> Chain:
        constant = chain.constant or no_loads(chain)
        force = constant.force.copy()
        force[..., -1, :] += self.mass_kg * chain.gravity
        return chain._replace(constant=constant._replace(force=force))

    def idle(self, manipulator: Host) -> str:
        weighs = any(isinstance(effect, Gravity) for effect in manipulator.effect)
        return "" if weighs else "there is no effect gravity beside it"

    def problems(self, manipulator: Host) -> Iterator[str]:
        if -self.mass_kg > (mass := manipulator.disk_masses[-1]):
            yield f"effect {self.kind}: of the {mass:.4g} kg of the last disk {-self.mass_kg:.4g} kg cannot be missing"


class BaseTilt(Effect):
    """The base stands tilted in the plane by `angle_rad`, anticlockwise in the frame in which dead loads are noted: all
    these loads, gravity among them, act on the arm as if turned clockwise by this angle. To a camera the tilt is a
    rotation of its frame."""

    kind: Literal["base_tilt"]
    angle_rad: TiltAngle

    def change(self, chain: Chain, manipulator: Host) -> Chain:
        return chain._replace(tilt=chain.tilt + self.angle_rad)


class Umbilical(Effect):
    """A tube or bundle of wires through the middle, free inside and held at both ends: a couple turns the tip back by
    the stiffness times the tip's angle to the base, and bends every plate alike."""

    kind: Literal["umbilical"]
    stiffness_n_m_per_rad: Annotated[NonNegative, Field(description="Couple per angle of the tip, N m per rad.")]

    def change(self, chain: Chain, manipulator: Host) -> Chain:
        return chain._replace(umbilical=chain.umbilical + self.stiffness_n_m_per_rad)


class TipLoadFriction(Effect):
    """Of the recorded tip load this share arrives."""

    kind: Literal["tip_load_friction"]
    efficiency: Efficiency

    def change(self, chain: Chain, manipulator: Host) -> Chain:
        return chain._replace(tip_efficiency=chain.tip_efficiency * self.efficiency)


class WeightFriction(Effect):
    """Of the recorded load on every disk (or one that is named) this share arrives."""

    kind: Literal["weight_friction"]
    efficiency: Efficiency
    disk: Annotated[Number | None, Field(description="Number of the disk, from 1; absent: all.")] = None

    def change(self, chain: Chain, manipulator: Host) -> Chain:
        share = np.broadcast_to(chain.disk_efficiency, (chain.plates, 1)).copy()
        share[slice(None) if self.disk is None else self.disk - 1] *= self.efficiency
        return chain._replace(disk_efficiency=share)

    def problems(self, manipulator: Host) -> Iterator[str]:
        if self.disk is not None and self.disk > manipulator.plates:
            yield f"effect {self.kind}: loads act on disks 1 to {manipulator.plates}, not on {self.disk}"


class PayloadScale(Effect):
    """Recorded loads on the tip and on disks act `scale` times as large as noted: a payload that was weighed wrongly,
    a hanger that was not counted."""

    kind: Literal["payload_scale"]
    scale: Annotated[Positive, Field(le=100, description="Load that acts over the one that is noted.")]

    def change(self, chain: Chain, manipulator: Host) -> Chain:
        return chain._replace(
            tip_efficiency=self.scale * chain.tip_efficiency, disk_efficiency=self.scale * chain.disk_efficiency
        )
