"""The rig under construction: a manipulator with every array at full length, which effects change one after another."""

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
    """(n,) length of the rigid clamp at either end of each arc."""
    disk: float
    """Thickness of a disk."""
    mass: np.ndarray
    """(n,) mass that hangs at the centre of each disk from 1 on, kg; NaN: unknown."""
    rigidity: np.ndarray
    """(n,) EI, N m^2."""
    offset: np.ndarray
    """(n, m) offset of each cable's span across each plate."""
    reach: np.ndarray
    """(m,) plates that a cable crosses; 0 if dead."""
    friction: np.ndarray
    """(n, m) coefficient at the hole before each plate."""
    edges: bool
    """Whether the wrap angle is counted at both edges of a hole; else the net turn."""
    presliding: float
    """Cable travel over which friction builds up; infinite: declared slip."""
    cables: tuple[str, ...]
    """Names, in the order of all arrays."""
    segment_of: np.ndarray
    """(n,) number of each plate's segment, from 1."""
    fibre: np.ndarray
    """(n,) distance of the outermost fibre from the neutral axis; NaN: unknown."""
    modulus: float
    """Young's modulus, Pa; NaN: not given."""
    arm: np.ndarray
    """(n, 2) largest distance of a cable from the axis on the negative and the positive side, before any effect; 0 on a
    side without cables."""
    law: int = LINEAR_LAW
    """Bending law of all plates: a constant of `arrays`."""
    law_first: np.ndarray | float = 0.0
    """c or the knee curvature: (n, 2) for bending toward negative and positive offsets, or one number for all."""
    law_second: float = 1.0
    """Ratio of the tangent stiffness beyond the knee to EI."""
    law_third: float = np.inf
    """Sharpness of a knee."""
    law_table: np.ndarray = field(default_factory=lambda: np.zeros((1, 2, 0, 3)))
    """(n or 1, 2, k, 3) for bending toward negative and positive offsets: see `Rig.law_table`."""
    loop_share: float = 0.0
    """Share of the bending stiffness carried by springs that slip (Jenkin elements)."""
    loop_yield: np.ndarray | float = np.inf
    """(n,) curvature at which a spring begins to slip, mean over the springs, 1/m."""
    loop_springs: int = 0
    """Number of these springs; 0: nothing slips."""
    flag_reverse: float = 1.0
    """Ratio of the return moment to the yield moment of a flag-shaped loop; 1: no loop."""
    compliance: float = 0.0
    """Compliance of a hinge at each end of each arc, rad/(N m)."""
    base_compliance: float = 0.0
    """Compliance of one more hinge where the first arc begins, rad/(N m)."""
    umbilical: float = 0.0
    """Restoring couple at the tip per angle of the tip, N m/rad."""
    softening: float = 0.0
    """Share of their first stiffness that the plates lose with every step."""
    relaxation: float = 0.0
    """Share of the moment by the plates' law that relaxes in the long run."""
    relaxation_time: float = 1.0
    """Time constant of that, in steps."""
    relaxation_step: float = 0.0
    """What such a step lasts where steps have times, s; 0: the mean time per step."""
    friction_exponent: float = 0.0
    """Coefficients go with (tension before the hole / `friction_tension`)^-exponent."""
    friction_tension: float = 1.0
    """Tension at which the coefficients are those of `friction`, N."""
    friction_rate: float = 0.0
    """Relative growth of friction when tensions change e times as fast."""
    friction_reference: float = 1.0
    """Rate of change of a tension at which the coefficients hold, N/s."""
    friction_excess: float = 0.0
    """Relative excess of friction where a cable just begins to slide."""
    friction_decay: float = 1.0
    """Change of tension over which `friction_excess` falls to 1/e, N."""
    friction_growth: float = 0.0
    """Share of its first value that friction gains with every step."""
    wrap_saturation: float = 0.0
    """1/rad: a wrap angle t counts as t / (1 + wrap_saturation t)."""
    hole_drag: float = 0.0
    """N: drag of a hole: what it takes from a large tension, or adds to it; see `pull.drag_share`."""
    contact_angle: np.ndarray = field(init=False)
    """(n, 2) bend at which disks touch, for bending toward negative and positive offsets, rad."""
    contact_stiffness: np.ndarray = field(init=False)
    """(n, 2) moment per bend beyond it, N m/rad."""
    clearance: float = 0.0
    """Distance by which both ends of a span move toward the concave side."""
    tip_efficiency: float = 1.0
    """Share of the load on the tip that arrives."""
    disk_efficiency: np.ndarray = field(init=False)
    """(n, 1) share of the load on each disk that arrives."""
    aspect: float = 1.0
    """Ratio of measured to true lengths along y, over that along x."""
    scale: float = 1.0
    """Scale of the camera: measured over true."""
    lens: float = 0.0
    """Distortion k1 of the camera's lens, 1/m^2."""
    camera_shift: np.ndarray = field(init=False)
    """(2,) shift of what the camera reads, m for every step taken before."""
    camera_turn: float = 0.0
    """Rotation of it about the origin, rad for every step taken before."""
    drawn_rigidity: np.ndarray = field(init=False)
    """(n,) EI before any effect has changed it."""
    wires: np.ndarray = field(init=False)
    """(n,) EI of the cables that bend with each plate, N m^2."""
    rest: np.ndarray = field(init=False)
    """(n,) stress-free curvature."""
    moment: np.ndarray = field(init=False)
    """(n,) extra bending moment along an arc."""
    moment_per_bend: np.ndarray = field(init=False)
    """(n,) extra bending moment per bend of the plate, N m/rad."""
    pulley: np.ndarray = field(init=False)
    """(m,) -ln(efficiency)."""
    tension_offset: np.ndarray = field(init=False)
    hanger: np.ndarray = field(init=False)
    """(m,) added to the tension of each cable, N."""
    tension_play: np.ndarray = field(init=False)
    """(m,) half-width of the backlash by which tensions lag behind the applied ones, N."""
    tension_drift: np.ndarray = field(init=False)
    """(m,) added to tensions for every step taken before, N."""
    gain: np.ndarray = field(init=False)
    """(m,) ratio of true to noted tension, in the limit of small tensions."""
    gain_per_n: np.ndarray = field(init=False)
    """(m,) relative growth of `gain` per noted tension, 1/N."""
    gravity: np.ndarray = field(init=False)
    """(2,) gravity in the plane, m/s^2."""
    tilt: float = 0.0
    """Rotation of the base against the frame of all dead loads, rad, anticlockwise."""
    disk_force: np.ndarray = field(init=False)
    """(n, 2) constant forces at the disks' centres, N."""
    tip_force: np.ndarray = field(init=False)
    """(2,) constant force at the centre of the last disk's distal face, N."""

    def __post_init__(self) -> None:
        n, m = self.offset.shape
        self.drawn_rigidity, self.wires = self.rigidity.copy(), np.zeros_like(self.rigidity)
        self.rest, self.moment, self.moment_per_bend = np.zeros(n), np.zeros(n), np.zeros(n)
        self.contact_angle, self.contact_stiffness = np.full((n, 2), np.inf), np.zeros((n, 2))
        self.pulley, self.tension_offset, self.hanger = np.zeros(m), np.zeros(m), np.zeros(m)
        self.tension_drift, self.tension_play = np.zeros(m), np.zeros(m)
        self.gain, self.gain_per_n = np.ones(m), np.zeros(m)
        self.camera_shift = np.zeros(2)
        self.gravity = np.zeros(2)
        self.disk_force, self.tip_force = np.zeros((n, 2)), np.zeros(2)
        self.disk_efficiency = np.ones((n, 1))

    @property
    def plates(self) -> range:
        """Numbers of the plates, 1 at the base."""
        return range(1, len(self.arc) + 1)

    @property
    def disks(self) -> range:
        """Numbers of the disks at which cables rub: from 0, the base, to the last but one."""
        return range(len(self.arc))

    @property
    def segments(self) -> range:
        """Numbers of the segments, 1 at the base."""
        return range(1, int(self.segment_of[-1]) + 1)

    def columns(self, names: Sequence[str] | None) -> list[int]:
        """Columns of the named cables in arrays of `m`; those of all cables where `names` is None."""
        return [j for j, name in enumerate(self.cables) if names is None or name in names]


def nominal_draft(manipulator: Mapping[str, Any]) -> Draft:
    """The draft of the contents of a manipulator file before any effect acts."""
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
        """Distance of the outermost fibre from the neutral axis, m; NaN: unknown."""
        return segment["thickness_m"] / 2 if "thickness_m" in segment else segment.get("outer_fibre_m", np.nan)

    def offset(cable, plate):
        """Offset of a cable at a plate (index from 0), m; beyond the cable's end that of its last segment."""
        value, last = cable["offset_m"], cable["ends_at_segment"]
        return float(value[min(number[plate], last) - 1] if isinstance(value, Sequence) else value)

    offsets = np.array([[offset(cable, i) for cable in cables] for i in range(n)]).reshape(n, m)
    there = np.array([number <= cable["ends_at_segment"] for cable in cables]).reshape(m, n).T
    return Draft(
        arc=(np.array([float(segment["length_m"]) for segment in segments]) - 2 * clamp)[number - 1],
        clamp=clamp[number - 1],
        disk=float(disk.get("thickness_m", 0)),
        mass=_masses(disk, [float(segments[k - 1].get("plate_mass_kg", 0)) for k in number]),
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


def _masses(disk: Mapping[str, Any], of_plates: Sequence[float]) -> np.ndarray:
    """(n,) mass at the centre of each disk from 1 on, with half of every plate that ends there and what the tip
    carries, kg; NaN where nothing in the file has a mass."""
    at_disk = np.full(len(of_plates), float(disk.get("mass_kg", 0)))
    for plate, mass in enumerate(of_plates):
        at_disk[plate] += mass / 2
        if plate > 0:  # the other half of plate 1 rests on the base
            at_disk[plate - 1] += mass / 2
    at_disk[-1] += disk.get("tip_mass_kg", 0)
    return at_disk if at_disk.any() else np.full(len(of_plates), np.nan)
