"""The rig and what acts on it as compiled code reads them: `n` plates, `m` cables, SI units."""

from typing import NamedTuple

import numpy as np

LINEAR_LAW, CUBIC_LAW, BILINEAR_LAW, SMOOTH_LAW, SECTION_LAW = 0, 1, 2, 3, 4
"""Bending laws of a plate, in this order: M = EI k; M = EI k (1 + c k^2); tangent stiffness `ratio` EI beyond a knee; a
smooth passage from EI to `ratio` EI about a knee; a table computed from the section."""


class Rig(NamedTuple):
    """A manipulator in arrays: `n` plates, `m` cables.  SI units."""

    arc: np.ndarray  # (n,) flexible length
    clamp: np.ndarray  # (n,) length of the rigid clamp at either end of the arc
    disk: float  # thickness
    rigidity: np.ndarray  # (n,) EI
    wires: np.ndarray  # (n,) EI of the cables that bend with the plate, which is all of theirs at any bend
    rest: np.ndarray  # (n,) stress-free curvature
    law: int  # bending law, the same for every plate: one of the constants above
    law_first: np.ndarray  # (n, 2) c or the knee curvature, for bending toward negative and positive offsets
    law_second: float  # ratio of the tangent stiffness beyond the knee to EI
    law_third: float  # sharpness of a smooth knee
    law_table: np.ndarray  # (n, 2, k, 3) by side: M / EI, the curvature under M, its derivative by M / EI
    loop_share: float  # share of the bending stiffness carried by springs that slip (Jenkin elements)
    loop_yield: np.ndarray  # (n,) curvature at which a spring begins to slip, mean over the springs
    loop_springs: int  # number of these springs, equally stiff; 0: nothing slips
    flag_reverse: float  # ratio of the return moment to the yield moment of a flag-shaped loop; 1: no loop
    compliance: float  # of the hinge at each end of each arc, rad/(N m)
    base_compliance: float  # of one more hinge where the first arc begins, rad/(N m)
    umbilical: float  # restoring couple at the tip per angle of the tip, N m/rad
    contact_angle: np.ndarray  # (n, 2) bend at which disks touch, by side as `law_first`
    contact_stiffness: np.ndarray  # (n, 2) moment per bend beyond it, N m/rad
    offset: np.ndarray  # (n, m) of each cable's span across each plate
    clearance: float  # distance by which both ends of a span move toward the concave side
    reach: np.ndarray  # (m,) plates that a cable crosses; 0 if dead
    friction: np.ndarray  # (n, m) coefficient at the hole before plate i
    friction_exponent: float  # coefficients go with (tension before the hole / `friction_tension`)^-exponent
    friction_tension: float  # tension at which the coefficients are those of `friction`
    hole_drag: float  # N: what a hole takes from a large tension at full slip, or adds to it
    drags: np.ndarray  # (m,) factor of what that does to ln of the tension, which goes as the coefficients do
    wrap_saturation: float  # 1/rad: a wrap angle t counts as t / (1 + wrap_saturation t)
    pulley: np.ndarray  # (m,) -ln(efficiency)
    edges: bool  # wrap angle counted at both edges of a hole; else the net turn
    presliding: float  # cable travel over which friction builds up; infinite: declared slip
    moment: np.ndarray  # (n,) extra bending moment all along an arc
    moment_per_bend: np.ndarray  # (n,) extra moment per bend of the plate, N m/rad


def plates_remember(rig: Rig) -> bool:
    """Whether the bend of a plate depends on its past moments and not on the present one alone (hysteresis)."""
    return rig.loop_springs > 0 or rig.flag_reverse < 1


class Slips(NamedTuple):
    """Slip at the hole of each cable before each plate; both arrays are (n, m)."""

    state: np.ndarray  # slip state: -1 cable drawn in, +1 paid out
    sticking: np.ndarray  # whether the state changes with the cable's length beyond the hole


class Bent(NamedTuple):
    """Hysteresis state of the plates before and after a sub-step, (n, stations along the arc, 2 + springs) each.

    At each station: moment, curvature less the stress-free one, and the moment of each spring that may slip.
    """

    before: np.ndarray
    after: np.ndarray


class RigMemory(NamedTuple):
    """State from which the next sub-step starts."""

    slip: np.ndarray  # (n, m) slip state of each hole
    beyond: np.ndarray  # (n, m) cable length beyond it
    bent: np.ndarray  # hysteresis state of the plates: `Bent.after`


class Pulls(NamedTuple):
    """Wrenches of the distal part of the arm on each plate, and span tensions."""

    wrench: np.ndarray  # (n, 3) moment and force at each arc's start
    by_ends: np.ndarray  # (n, 3, n, 3) derivatives of the wrenches by the end poses of the plates
    tension: np.ndarray  # (n, m) of the spans


class Forces(NamedTuple):
    """Loads at one instant: tension entering the base holes (before pulley friction), dead loads on disks and tip."""

    tension: np.ndarray  # (m,)
    disk: np.ndarray  # (n, 2) at the disks' centres
    tip: np.ndarray  # (2,) at the centre of the last disk's distal face
