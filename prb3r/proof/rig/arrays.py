"""The rig and what acts on it as compiled code reads them: `n` plates, `m` cables, SI units."""

from typing import NamedTuple

import numpy as np

LINEAR_LAW, CUBIC_LAW, BILINEAR_LAW, SMOOTH_LAW, SECTION_LAW = 0, 1, 2, 3, 4
"""Laws of a plate: M = EI k; M = EI k (1 + c k^2); tangent stiffness `ratio` EI beyond a knee; the same reached
smoothly; a table of the section's own curvatures."""


class Rig(NamedTuple):
    """A manipulator in arrays: `n` plates, `m` cables.  SI units."""

    arc: np.ndarray  # (n,) flexible length
    clamp: np.ndarray  # (n,)
    disk: float  # thickness
    rigidity: np.ndarray  # (n,) EI
    rest: np.ndarray  # (n,) stress-free curvature
    law: int  # of every plate: one of those above
    law_first: np.ndarray  # (n, 2) c, or the knee; bending toward negative and toward positive offsets
    law_second: float  # ratio
    law_third: float  # sharpness
    law_table: np.ndarray  # (n, 2, k, 3) by side: elastic curvature M / EI, the section's own, its derivative by that
    loop_share: float  # of the stiffness that slips
    loop_yield: np.ndarray  # (n,) curvature from which it does, on average over the springs
    loop_springs: int  # that share it, all of one stiffness; 0: nothing slips
    flag_reverse: float  # part of the moment at which a plate yields, at which it turns back; 1: it is elastic
    compliance: float  # of the hinge at each end of each arc
    base_compliance: float  # of one more at the base
    umbilical: float  # couple at the tip against its turn, per rad
    contact_angle: np.ndarray  # (n, 2) as above
    contact_stiffness: np.ndarray  # (n, 2)
    offset: np.ndarray  # (n, m) of each plate's span
    clearance: float
    reach: np.ndarray  # (m,) plates that a cable crosses; 0 if dead
    friction: np.ndarray  # (n, m) coefficient at the hole before plate i
    friction_exponent: float  # by which friction falls with the tension before the hole
    friction_tension: float  # at which it has these coefficients
    wrap_saturation: float  # by which a turn counts less, the larger it is, 1/rad
    pulley: np.ndarray  # (m,) -ln(efficiency)
    edges: bool  # turning counted at both edges of a hole
    presliding: float  # infinite: declared slip
    moment: np.ndarray  # (n,) extra bending moment all along an arc
    moment_per_bend: np.ndarray  # (n,) and per bend of the plate


def plates_remember(rig: Rig) -> bool:
    """Whether plates bend other than before under the same moment."""
    return rig.loop_springs > 0 or rig.flag_reverse < 1


class Slips(NamedTuple):
    """Of the hole of each cable before each plate, (n, m) both."""

    state: np.ndarray  # -1 drawn in, +1 paid out
    sticking: np.ndarray  # whether the state follows the cable's length


class Bent(NamedTuple):
    """What plates remember at every station along their arcs, (n, stations, 2 + springs) both: moment, curvature beyond
    the stress-free one, and the moment of each spring that may slip."""

    before: np.ndarray
    after: np.ndarray


class Pulls(NamedTuple):
    """What the distal part exerts on the plates."""

    wrench: np.ndarray  # (n, 3) moment and force at each arc's start
    by_ends: np.ndarray  # (n, 3, n, 3) its derivatives by the end poses
    tension: np.ndarray  # (n, m) of the spans


class Forces(NamedTuple):
    """Loads at one instant: tension entering the base holes (before pulley friction), dead loads on disks and tip."""

    tension: np.ndarray  # (m,)
    disk: np.ndarray  # (n, 2) at the disks' centres
    tip: np.ndarray  # (2,) at the centre of the last disk's distal face
