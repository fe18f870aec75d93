"""What is put on the bench: ranges from which manipulators, load programs and cameras are drawn.

Ranges are uniform unless said.  Most are the paper's prototype (Table 3 of IEEE Access 2018: 14 plates of 30 mm by
0.8 mm, disks of 4 mm, arms of 21 and 25.5 mm) with a margin to both sides, so that no design is the one that the
diagnosis was written on.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field

from prb3r.proof.rig.effects.friction import SLIP_RANGE
from prb3r.recording.recording import Kind


@dataclass(frozen=True)
class Manipulators:
    """Of the nominal manipulators.  SI units."""

    segments: tuple[int, ...] = (1, 2, 2, 3)
    """Numbers of segments, each as often as it stands here: most as the prototype."""
    plates: tuple[int, int] = (5, 9)
    """Fewest and most plates: fewer than the prototype's 14, for the rig's cost grows with their cube."""
    plates_per_segment: int = 2
    """At least, so that a segment is more than a plate."""
    history_segments: tuple[int, ...] = (1, 2)
    """Numbers of segments with friction along the path, each as often as it stands here: few, for cost."""
    history_plates: tuple[int, int] = (4, 5)
    """With friction along the path, for its cost."""
    length_m: tuple[float, float] = (0.026, 0.034)
    """Of a plate: prototype 0.030."""
    clamp_m: tuple[float, float] = (0.005, 0.008)
    """Prototype 0.008."""
    width_m: float = 0.03
    """The prototype's: stiffness varies by thickness."""
    thickness_m: tuple[float, float] = (7.5e-4, 1e-3)
    """Of a segment's plates, thickest at the base: prototype 0.0008."""
    arm_m: tuple[float, float] = (0.023, 0.026)
    """Offset of the outer row of holes: prototype 0.0255."""
    arm_scatter_m: float = 0.001
    """By which each hole is off its row, either way: two sides are never the same."""
    row_m: tuple[float, float] = (0.0035, 0.005)
    """Between rows of holes: prototype 0.0045."""
    pairs_of_one_segment: tuple[int, int] = (1, 2)
    """Fewest and most pairs of cables where there is one segment."""
    spare: float = 0.3
    """Share of rigs with more than a pair that lack one cable: they are not symmetric."""
    frictionless: float = 0.25
    """Share of plain rigs whose nominal model has no friction, so that `cable_friction` can be concealed."""
    friction: tuple[float, float] = (0.15, 0.4)
    """Coefficient of the others: steel on aluminium or polymer; the paper takes 0.3."""
    presliding_log10_m: tuple[float, float] = SLIP_RANGE
    """Of rigs with friction along the path: as it is concealed."""
    youngs_modulus_pa: float = 1.87e11
    """Reproduces the paper's Fig. 11."""
    stiffness: tuple[float, float] = (0.8, 1.1)
    """Factor on it."""
    nitinol_pa: tuple[float, float] = (4e10, 7.5e10)
    """Young's modulus of rigs whose plates are of nitinol."""
    nitinol_thickness_m: tuple[float, float] = (1.2e-3, 1.8e-3)
    """Of their plates, so that strains go beyond a per cent."""
    gravity_m_s2: float = 9.81
    """Standard gravity, rounded as manipulator files have it."""
    disk_thickness_m: tuple[float, float] = (0.003, 0.006)
    """Prototype 0.004."""
    disk_mass_kg: tuple[float, float] = (0.04, 0.1)
    """Prototype 0.0447."""


@dataclass(frozen=True)
class Programs:
    """Of the load programs, and the bends that they may cause."""

    sequences: tuple[int, int] = (5, 7)
    """Fewest and most, of plain designs: enough to set two aside."""
    few_sequences: int = 4
    """Of poor designs, which cannot tell effects apart, and of those along the path, for cost."""
    loading_sequences: int = 6
    """Of designs on which calibration hides an effect: four that load, and then as many as follow that unload too."""
    unloading_last: int = 2
    """Of these designs, the last sequences, which unload too."""
    uses: int = 3
    """Sequences in which each cable is pulled: no cable hangs on one sequence that is set aside."""
    steps: tuple[int, int] = (4, 6)
    """Fewest and most of a sequence."""
    few_steps: int = 4
    """Of a sequence of designs with few sequences."""
    bend_rad: float = 0.33
    """Of a plate under the strongest cable alone, by which its largest tension is chosen: a third of a radian, where
    geometry is far from linear."""
    second_cable: tuple[float, float] = (0.3, 0.7)
    """Largest tension of every cable after the first, in parts of that alone."""
    tip_loaded: float = 1 / 3
    """Share of designs with loads at the tip."""
    tip_sequences: float = 0.6
    """Share of their sequences that have one."""
    tip_share: tuple[float, float] = (0.1, 0.3)
    """Of the force whose moment about the base is that of the strongest cable."""
    tip_slope: float = 0.3
    """Axial part of that force over its transverse one: not all on one line with gravity."""
    first_share: tuple[float, float] = (0.25, 0.5)
    """Of the largest tension at the first step, where cables fall again."""
    last_share: tuple[float, float] = (0.15, 0.4)
    """At the last step of such a sequence; and at the first where cables only rise."""
    largest_bend_rad: float = 0.42
    """Of a plate under the largest load; beyond, concealed softening has no equilibrium at many sizes."""
    largest_turn_rad: float = 2.2
    """Of the whole arm: a quarter turn and a half."""
    least_bend_rad: float = 0.12
    """Of the most bent plate: nothing can be seen of one that hardly bends."""
    idle_rad: float = 0.03
    """A plate that never bends by this much is idle: no design has one."""
    weaker: float = 0.88
    """Factor on all loads where bends are too large: five of them halve the loads."""
    weakenings: int = 12
    """Of them before a design is given up: loads are then a fifth."""
    attempts: int = 40
    """Designs that are drawn for one that is moderate, before the seed is given up."""


@dataclass(frozen=True)
class Cameras:
    """Of what is read, how exactly, and what is known beforehand."""

    read: tuple[tuple[Kind, ...], ...] = (
        (Kind.X, Kind.Y, Kind.ANGLE),
        (Kind.X, Kind.Y, Kind.ANGLE),
        (Kind.X, Kind.Y, Kind.ANGLE),
        (Kind.X, Kind.Y),
        (Kind.X, Kind.Y, Kind.BEND),
        (Kind.ANGLE, Kind.BEND),
    )
    """Of plain designs, each as often as it stands here: half read all that a marker shows."""
    read_of_others: tuple[Kind, ...] = (Kind.X, Kind.Y, Kind.ANGLE)
    """Of the other designs: all that a marker shows."""
    read_of_poor: tuple[tuple[Kind, ...], ...] = ((Kind.X, Kind.Y), (Kind.ANGLE, Kind.BEND))
    """Of poor designs, one of these: places alone, or turns alone."""
    tension_sd_relative: tuple[float, float] = (0.002, 0.005)
    """Weights are known to a few grams in a kilogram."""
    position_sd_m: tuple[float, float] = (2e-4, 5e-4)
    """Half a pixel to a pixel of a camera that sees half a metre on a thousand."""
    angle_sd_rad: tuple[float, float] = (3e-3, 8e-3)
    """Of two markers 50 mm apart, each read to 0.1 to 0.3 mm."""
    frame_rotation_sd_rad: tuple[float, float] = (0.002, 0.006)
    """A tripod set up by eye along the arm."""
    frame_position_sd_m: tuple[float, float] = (0.0005, 0.0025)
    """The same for its place: half a millimetre to a few, as a ruler tells."""
    no_prior: float = 0.4
    """Share of designs of which nothing is known beforehand, and all poor ones."""
    prior: Mapping[str, float] = field(default_factory=lambda: {"youngs_modulus": 0.1, "friction_coefficient": 0.3})
    """Relative standard deviations of the others: handbook values of a spring steel and of dry friction."""
