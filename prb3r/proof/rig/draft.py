"""A rig while it is put together: the manipulator of a file, every array at full length, for effects to change."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from prb3r.proof.rig.arrays import LINEAR_LAW


@dataclass
class Draft:
    """A manipulator of `n` plates and `m` cables before and while effects act on it.  SI units."""

    arc: np.ndarray
    """(n,) flexible length of each plate."""
    clamp: np.ndarray
    """(n,)"""
    disk: float
    """Thickness."""
    mass: float | None
    """Of a disk, kg; None: unknown."""
    rigidity: np.ndarray
    """(n,) EI, N m^2."""
    offset: np.ndarray
    """(n, m) of each plate's span."""
    reach: np.ndarray
    """(m,) plates that a cable crosses; 0 if dead."""
    friction: np.ndarray
    """(n, m) coefficient at the hole before each plate."""
    edges: bool
    """Turning counted at both edges of a hole."""
    presliding: float
    """Infinite: declared slip."""
    cables: tuple[str, ...]
    segment_of: np.ndarray
    """(n,) number of each plate's segment, from 1."""
    fibre: np.ndarray
    """(n,) distance of the outermost fibre from the neutral axis; NaN: unknown."""
    modulus: float
    """Young's, Pa."""
    arm: np.ndarray
    """(n, 2) largest offset of a cable toward negative and toward positive ones, as drawn; 0 without any."""
    law: int = LINEAR_LAW
    law_first: np.ndarray | float = 0.0
    """c, or the knee; (n, 2) of bending toward negative and toward positive offsets, or one for all."""
    law_second: float = 1.0
    """Ratio of stiffness."""
    law_third: float = np.inf
    """Sharpness of a knee."""
    law_table: np.ndarray = field(default_factory=lambda: np.zeros((1, 2, 0, 3)))
    """(n or 1, 2, k, 3) of bending toward negative and toward positive offsets."""
    loop_share: float = 0.0
    """Of the stiffness, that slips."""
    loop_yield: np.ndarray | float = np.inf
    """(n,) curvature from which it does, 1/m."""
    loop_springs: int = 0
    flag_reverse: float = 1.0
    """Part of the moment at which plates yield, at which they turn back."""
    compliance: float = 0.0
    """Of a hinge at each end of each arc, rad/(N m)."""
    base_compliance: float = 0.0
    """Of one more where the first arc begins."""
    umbilical: float = 0.0
    """Couple at the tip against its turn, N m/rad."""
    softening: float = 0.0
    """Share of the plates' stiffness that every step takes."""
    friction_exponent: float = 0.0
    friction_tension: float = 1.0
    friction_rate: float = 0.0
    """How much more cables rub, relative, at e times the rate of tension."""
    friction_reference: float = 1.0
    """Rate of tension at which they rub as `friction` says, N/s."""
    friction_excess: float = 0.0
    """How much more, relative, cables rub that just begin to slide."""
    friction_decay: float = 1.0
    """Newtons by which their tension changes while that falls to 1/e."""
    wrap_saturation: float = 0.0
    """How little of a turn counts, 1/rad."""
    contact_angle: np.ndarray = field(init=False)
    """(n, 2) toward negative and toward positive offsets."""
    contact_stiffness: np.ndarray = field(init=False)
    """(n, 2)"""
    clearance: float = 0.0
    tip_efficiency: float = 1.0
    disk_efficiency: np.ndarray = field(init=False)
    """(n, 1) share of the load on each disk that arrives."""
    scale: float = 1.0
    lens: float = 0.0
    """1/m^2."""
    camera_shift: np.ndarray = field(init=False)
    """(2,) of what the camera has, m for every step before."""
    camera_turn: float = 0.0
    """And rad."""
    drawn_rigidity: np.ndarray = field(init=False)
    """(n,) EI before any effect has changed it."""
    rest: np.ndarray = field(init=False)
    """(n,) stress-free curvature."""
    moment: np.ndarray = field(init=False)
    """(n,) extra bending moment along an arc."""
    moment_per_bend: np.ndarray = field(init=False)
    pulley: np.ndarray = field(init=False)
    """(m,) -ln(efficiency)."""
    tension_offset: np.ndarray = field(init=False)
    """(m,)"""
    tension_play: np.ndarray = field(init=False)
    """(m,) N."""
    tension_drift: np.ndarray = field(init=False)
    """(m,) N for every step before."""
    gain: np.ndarray = field(init=False)
    """(m,) true over noted tension, of small ones."""
    gain_per_n: np.ndarray = field(init=False)
    """(m,) how that grows with the noted tension, relative."""
    disk_force: np.ndarray = field(init=False)
    """(n, 2)"""
    tip_force: np.ndarray = field(init=False)
    """(2,)"""

    def __post_init__(self) -> None:
        n, m = self.offset.shape
        self.drawn_rigidity = self.rigidity.copy()
        self.rest, self.moment, self.moment_per_bend = np.zeros(n), np.zeros(n), np.zeros(n)
        self.contact_angle, self.contact_stiffness = np.full((n, 2), np.inf), np.zeros((n, 2))
        self.pulley, self.tension_offset = np.zeros(m), np.zeros(m)
        self.tension_drift, self.tension_play = np.zeros(m), np.zeros(m)
        self.gain, self.gain_per_n = np.ones(m), np.zeros(m)
        self.camera_shift = np.zeros(2)
        self.disk_force, self.tip_force = np.zeros((n, 2)), np.zeros(2)
        self.disk_efficiency = np.ones((n, 1))

    @property
    def plates(self) -> range:
        """Numbers of the plates, 1 at the base."""
        return range(1, len(self.arc) + 1)

    @property
    def disks(self) -> range:
        """Numbers of the disks at which cables rub, from the base's 0."""
        return range(len(self.arc))

    @property
    def segments(self) -> range:
        """Numbers of the segments, 1 at the base."""
        return range(1, int(self.segment_of[-1]) + 1)

    def columns(self, names: Sequence[str] | None) -> list[int]:
        """Numbers of the named cables, of all where none is named."""
        return [j for j, name in enumerate(self.cables) if names is None or name in names]


def nominal_draft(manipulator: Mapping[str, Any]) -> Draft:
    """The manipulator of a file before any effect."""
    segments, cables = manipulator["segment"], manipulator.get("cable", [])
    friction, disk = manipulator.get("friction", {}), manipulator.get("disk", {})
    number = np.repeat(np.arange(1, len(segments) + 1), [segment["plates"] for segment in segments])
    n, m = len(number), len(cables)
    clamp = np.array([float(segment.get("clamp_m", 0)) for segment in segments])
    history = friction.get("direction", "declared") == "history"

    def rigidity(segment):
        if "bending_stiffness_n_m2" in segment:
            return float(segment["bending_stiffness_n_m2"])
        return manipulator["youngs_modulus_pa"] * segment["width_m"] * segment["thickness_m"] ** 3 / 12

    def fibre(segment):
        return segment["thickness_m"] / 2 if "thickness_m" in segment else segment.get("outer_fibre_m", np.nan)

    def offset(cable, plate):
        value, last = cable["offset_m"], cable["ends_at_segment"]
        return float(value[min(number[plate], last) - 1] if isinstance(value, Sequence) else value)

    offsets = np.array([[offset(cable, i) for cable in cables] for i in range(n)]).reshape(n, m)
    there = np.array([number <= cable["ends_at_segment"] for cable in cables]).reshape(m, n).T
    return Draft(
        arc=(np.array([float(segment["length_m"]) for segment in segments]) - 2 * clamp)[number - 1],
        clamp=clamp[number - 1],
        disk=float(disk.get("thickness_m", 0)),
        mass=disk.get("mass_kg"),
        rigidity=np.array([rigidity(segment) for segment in segments])[number - 1],
        offset=offsets,
        reach=there.sum(0),
        friction=np.full((n, m), float(friction.get("coefficient", 0))),
        edges=friction.get("wrap", "net") == "edges",
        presliding=friction["presliding_m"] if history else np.inf,
        cables=tuple(str(cable["name"]) for cable in cables),
        segment_of=number,
        fibre=np.array([fibre(segment) for segment in segments], float)[number - 1],
        modulus=float(manipulator.get("youngs_modulus_pa", np.nan)),
        arm=np.stack([np.max(side * offsets * there, axis=1, initial=0.0) for side in (-1, 1)], 1),
    )
