"""Rigs as they are: several effects at once, of sizes that rigs show, and imperfections that nobody was told of.

Nothing here is in units of what is detectable, and nothing is known to the diagnosis but what a recording's folder
says.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import NamedTuple


class Typical(NamedTuple):
    """How large an effect mostly is, in parts of the largest that its record allows, and how common it is."""

    least: float
    """Smallest size, in parts of the largest."""
    most: float
    """Largest size, in parts of the largest."""
    common: float = 1.0
    """How often it is drawn, relative to the others."""


TYPICAL: Mapping[str, Typical] = {
    "weakened_plate": Typical(0.12, 0.7),  # 15 % softer to a crack that leaves 40 %
    "segment_stiffness": Typical(0.12, 0.6),  # a thickness wrong by 4 to 20 %
    "precurvature": Typical(0.08, 0.4),  # strips that were wound up: 5 to 25 % of the largest curvature
    "nonlinear_plate": Typical(0.35, 0.9),  # beyond the knee 65 % of the stiffness down to a third
    "disk_contact": Typical(0.05, 0.5),  # edges as stiff as the plate and a half, up to fifteen times as stiff
    "clamp_compliance": Typical(0.1, 0.5),  # a tenth to a half of the plate's own compliance
    "cable_bending": Typical(0.05, 0.3),  # sheathed cables
    "hole_clearance": Typical(0.03, 0.16),  # 0.2 to 1 mm
    "hole_offset": Typical(0.06, 0.3),  # 0.5 to 2.5 mm: a hole of the wrong row
    "tension_offset": Typical(0.06, 0.4),  # 2 to 12 % of the largest tension: hanger, zero of a load cell
    "pulley_friction": Typical(0.08, 0.6),  # 5 to 30 % lost
    "cable_friction": Typical(0.2, 0.6, 0.5),  # 0.12 to 0.36
    "worn_hole": Typical(0.1, 0.5),  # 0.2 to 1 more
    "slip_history": Typical(1.0, 1.0, 0.0),  # asked for by share
    "edge_wrap": Typical(1.0, 1.0, 0.5),
    "dead_cable": Typical(1.0, 1.0, 0.3),  # seen by eye, mostly
    "gravity": Typical(0.1, 0.8),  # a plane tilted by 6 degrees, up to an arm that hangs
    "tip_force": Typical(0.04, 0.3),  # a wire that pulls
    "tip_load_friction": Typical(0.08, 0.5),  # a pulley that takes 10 to 45 %
    "camera_scale": Typical(0.06, 0.4),  # a board 1 to 6 % too near
    "lens_distortion": Typical(0.06, 0.4),  # 1.5 to 10 % of the radius at the ends of the arm
    # rare ones
    "hysteretic_plate": Typical(0.15, 0.7),  # a tenth to two fifths of the stiffness slips
    "base_compliance": Typical(0.05, 0.3),  # a tenth to half of the plate's own compliance
    "plate_relaxation": Typical(0.15, 0.7),  # 7 to 35 % of the moment lost
    "plate_softening": Typical(0.1, 0.6),  # 3 to 18 % softer in the end
    "hanger": Typical(0.06, 0.4),  # 2 to 12 % of the largest tension: a light hanger under heavy weights
    "tension_play": Typical(0.1, 0.6),  # 1 to 6 % of the largest tension
    "tension_drift": Typical(0.06, 0.4),  # 2 to 12 % of the largest tension in the end
    "load_cell": Typical(0.15, 0.75),  # 3 to 15 % off
    "load_dependent_friction": Typical(0.25, 0.85),  # exponents of 0.1 to 0.33
    "camera_aspect": Typical(0.07, 0.5),  # seen from 8 to 22 degrees off the normal
    "camera_drift": Typical(0.05, 0.4),  # 0.1 to 0.8 % of the length in the end
    "wrap_saturation": Typical(0.15, 0.8),  # the largest turns count three quarters to two fifths
    "hole_drag": Typical(0.1, 0.7),  # 4 to 28 % of the largest tension lost in all holes together
    "friction_drift": Typical(0.25, 0.8),  # a quarter to four fifths more friction in the end
    "breakaway_friction": Typical(0.2, 0.8),  # static friction 1.2 to 1.8 times the kinetic one
    "stiffness_gradient": Typical(0.15, 0.7),  # a tip 10 to 40 % softer or stiffer than the base
    "precurvature_gradient": Typical(0.08, 0.4),  # from end to end 10 to 50 % of the largest curvature
    "base_tilt": Typical(0.1, 0.6),  # one to five degrees
    "payload_scale": Typical(0.1, 0.6),  # from a hanger of a tenth of the weight to twice what is noted
    "superelastic_plate": Typical(1.0, 1.0),  # plateaus as nitinol has them
    "umbilical": Typical(0.05, 0.5),  # 5 to 50 % of the arm's own stiffness from end to end
}
"""By kind, of all that can be concealed.  A size is drawn evenly in its logarithm."""


@dataclass(frozen=True)
class RealRigs:
    """Of the recordings of such rigs."""

    effects: tuple[int, int] = (3, 5)
    """Fewest and most of a recording with several."""
    beside_rare: tuple[int, int] = (1, 2)
    """Fewest and most beside a rare one."""
    bare_every: int = 4
    """One of so many recordings is of a rig whose nominal model leaves friction out."""
    nitinol_every: int = 10
    """One of so many with a rare effect is of a rig of nitinol plates, whose material is what is rare."""
    flags_share: float = 0.5
    """Of the rigs of nitinol plates those whose plates give back less than they took.  A choice."""
    flags: tuple[float, float] = (0.3, 0.7)
    """Least and largest ratio of their lower plateau stress to the upper one (Pelton, DiCello and Miyazaki, Min.
    Invasive Ther. Allied Technol. 9 (2000) 107)."""
    history_every: int = 4
    """One of so many with several effects is of a rig whose friction follows the load path."""
    untold_every: int = 2
    """One of so many of these has a nominal model that leaves that out.  A choice."""
    single_history_every: int = 4
    """Without several effects, one of so many of every `history_every`-th recording is of such a rig: fewer, for their
    cost."""
    blunder_effects_every: int = 2
    """One of so many recordings with a blunder of the set-up has several effects as well; the others have none.  A
    choice."""
    plates: tuple[int, int] = (5, 10)
    """Fewest and most."""
    single_multiple: float = 5.0
    """Of single effects, in smallest detectable ones under the tolerances."""
    tries: int = 60
    """Sets of effects that are drawn for one that has an equilibrium at every step; then as many more, where plates of
    nitinol have another rare effect than their plateau, before the case is given up."""

    tries_of_kind: int = 6
    """Of single effects, so many rigs are tried with the kind that is asked for, then such with any.  A choice: the
    size of a single effect is given, so that one under which loads or designs have no equilibrium never gets any."""

    # Imperfections
    noise: tuple[float, float] = (0.6, 1.8)
    """Factor on the stated reading noise, evenly in its logarithm."""
    noise_freedom: float = 5.0
    """Degrees of freedom of Student's law, scaled to the deviation."""
    common: float = 0.2
    """Share of the variance that neighbouring disks of a photograph have in common."""
    common_reach: float = 2.0
    """Disks over which it falls to 1/e."""
    geometry: float = 0.01
    """Offsets, lengths and thicknesses are off by at most this part: half by segment or cable, half by plate."""
    marker_sd_m: float = 3e-4
    """Of a marker's place in its disk's own frame, along either axis."""
    tension: tuple[float, float] = (0.7, 1.5)
    """Factor on the stated scatter of tensions."""
    gaps_every: int = 3
    """One of so many recordings lacks readings, and one of so many has gross outliers."""
    gaps: float = 0.05
    """Share of their readings that is missing.  A choice."""
    gross: float = 0.01
    """Share of their readings that are gross outliers.  A choice."""

    decimals: int = 6
    """Of the readings in the folder of a recording, m and rad: rounding is then below a hundredth of the noise."""
    most_bend_rad: float = 0.7
    """Of a plate of a recorded rig: beyond, its owner would have taken smaller weights."""

    # Elsewhere
    sequences: int = 3
    """Of other loads, and of another design."""
    thickness: tuple[float, float] = (0.85, 1.25)
    """Factor on the thickness of each segment of another design."""
    more_plates: tuple[int, int] = (-2, 3)
    """Plates that each of its segments has more."""
    fewest_plates: int = 2
    """Of each of its segments.  A choice: a segment is more than a plate."""
    history_plates: int = 3
    """Most of a segment where friction follows the path, for its cost."""
    largest_bend_rad: float = 0.5
    """Of a plate, under loads that are weakened until no plate bends farther."""

    # Scores
    worth: float = 2.0
    """Root mean square, in sd of a reading, by which held-out loads are missed without an effect that counts."""
    largest_worth: float = 1e3
    """Most that an effect is said to be worth, in sd of a reading; also of one without which there is no equilibrium.
    A choice: far above `worth`, and a number that JSON can hold."""
    largest_distance: float = 1e9
    """Largest squared distance of an effect from others that is told, in variances of a reading; also that of one
    without which there is no equilibrium.  A choice: far above `Sizes.apart`, and a number that JSON can hold."""
    excess: float = 1.0
    """The same of calibration alone, from which on there is excess error to remove."""
    worst: float = 0.1
    """Share of recordings that the worst ones are."""
    seconds: tuple[float, float] = (15.0, 60.0)
    """Asked for of a diagnosis, median and longest, with declared slip."""
    history_seconds: tuple[float, float] = (60.0, 180.0)
    """The same with friction along the path."""
    blunders: Mapping[str, float] = field(
        default_factory=lambda: {
            "cables exchanged": 3.0,
            "cables exchanged once": 1.0,
            "offset sign": 1.0,
            "all offset signs": 1.0,
            "cable end": 1.0,
            "slip sign": 1.0,
            "slip sign once": 1.0,
            "mirrored": 1.0,
            "from the tip": 1.0,
            "one off": 2.0,
            "disks exchanged": 3.0,
            "kilograms": 2.0,
            "kilograms once": 1.0,
            "backwards": 1.0,
            "step late": 1.0,
            "sequences exchanged": 1.0,
            "degrees": 1.0,
        }
    )
    """How often each is made, relative to the others."""
