r"""The mechanical problem as arrays: a chain of plates and disks threaded by cables, and the loads on it.

Disk 0 is the base; plate `i` (counted from 0 in arrays) joins disk `i` to disk `i + 1`.  The world origin is the
centre of the base disk's distal face, x runs along the straight manipulator, angles are anticlockwise.
"""

from typing import NamedTuple

import numpy as np

from prb3r.mechanics.plate import PlateModel
from prb3r.mechanics.plate_law import Contact, Hysteresis, Law


class Term(NamedTuple):
    """A moment on the arc of each plate that depends on the state: `coefficient` times the influence `of`.

    The solver of this package ignores terms; `prb3r.model.laws.self_consistent` turns them into `Loads.moment`.
    """

    of: str
    """Name of an influence of `prb3r.model.laws.moment_law.influences`."""
    coefficient: np.ndarray
    """(n,) N m per unit of the influence."""


class Chain(NamedTuple):
    """Geometry, stiffness and friction of a manipulator of `n` plates and `m` cables."""

    plate: PlateModel
    arc: np.ndarray
    """(n,) flexible arc length of each plate, m."""
    clamp: np.ndarray
    """(n,) rigid clamp at either end of the arc, m."""
    disk: float
    """Disk thickness, m."""
    stiffness: np.ndarray
    """(n, nodes) stiffness of each node, N m/rad."""
    rest: np.ndarray
    """(n, nodes) stress-free node angles, rad."""
    offset: np.ndarray
    """(n, m) cable offset over each plate, m."""
    reach: np.ndarray
    """(m,) number of plates each cable crosses, counted from the base; 0 for a broken cable."""
    friction: np.ndarray
    """(n, m) belt friction coefficient at the hole each cable passes before plate `i` (row 0 is the base hole)."""
    segment: np.ndarray
    """(n,) index of the segment of each plate."""
    tied: bool = False
    """Constant curvature: all plates of a segment share one bend."""
    presliding: float = 0.0
    """Cable travel over which friction builds up to full slip, m; 0: slip is declared."""
    edges: bool = False
    """Whether belt friction counts the turns at both edges of a hole separately, instead of the net turn."""
    clearance: float = 0.0
    """Radial play by which a cable lies toward the inner (concave) side of its holes on a bent plate, m."""
    pulley: np.ndarray | float = 1.0
    """(m,) efficiency of the pulley before the base hole."""
    law: Law = Law()
    """Bending law of the plates."""
    cable_stiffness: np.ndarray | float = 0.0
    """(n, nodes) stiffness of the cables that bend with each node, N m/rad: it follows no law of the plates."""
    hysteresis: Hysteresis = Hysteresis()
    """Hysteresis of the plates."""
    curvature: np.ndarray | None = None
    """(nodes,) curvature times arc length per node angle, 0 for a hinge at an end of the arc; None: that of `plate`."""
    contact: Contact = Contact()
    """Contact of neighbouring disks."""
    constant: "Loads | None" = None
    """Loads of one step that always act, at rest too; its tensions are added to the applied ones."""
    gravity: np.ndarray | float = 0.0
    """(2,) acceleration of which `constant` has the forces on the masses of the manipulator, m/s^2."""
    tilt: float = 0.0
    """Angle of the base against the frame of the dead loads, rad, anticlockwise."""
    tip_efficiency: float = 1.0
    """Share of the recorded tip load that acts."""
    disk_efficiency: np.ndarray | float = 1.0
    """(n, 1) share of the recorded load on each disk 1..n that acts."""
    gain: np.ndarray | float = 1.0
    """(m,) true over recorded tension, in the limit of a small one."""
    quadratic: np.ndarray | float = 0.0
    """(m,) relative growth of true over recorded tension per recorded tension, 1/N."""
    hanger: np.ndarray | float = 0.0
    """(m,) true over recorded tension wherever one is recorded, N."""
    play: np.ndarray | float = 0.0
    """(m,) half-width of the play by which the true tension lags behind the recorded one, N; see `with_play`."""
    zero_drift: np.ndarray | float = 0.0
    """(m,) growth of the true tension over the recorded one with every elapsed step, N."""
    softening: float = 0.0
    """Share of the plates' initial stiffness that is lost with every elapsed step."""
    relaxation: float = 0.0
    """Share of the plates' moments that relaxes in the long run; see `relaxation.py`."""
    relaxation_time: float = 1.0
    """Time constant of the relaxation, in elapsed steps."""
    relaxation_step: float = 0.0
    """How long each of these steps lasts, s, where times are known; 0: as a mean step of the loads."""
    friction_exponent: float = 0.0
    """Exponent p of friction that depends on the tension T before a hole: coefficients times (T / T_0)^-p."""
    friction_tension: float = 1.0
    """Tension T_0 at which the coefficients of `friction` hold, N."""
    friction_rate: float = 0.0
    """Relative growth of friction where a cable's tension changes e times as fast."""
    friction_reference: float = 1.0
    """Rate of the tension at which the coefficients of `friction` hold, N/s."""
    friction_excess: float = 0.0
    """Relative excess of static over kinetic friction, where a cable begins to slip."""
    friction_decay: float = 1.0
    """Change of a cable's tension over which the excess falls to 1/e, N."""
    friction_drift: float = 0.0
    """Growth of friction with every elapsed step, as a share of the initial one."""
    wrap_saturation: float = 0.0
    """Saturation c of friction with the turn t at a hole, 1/rad: a turn counts as t / (1 + c t)."""
    hole_drag: float = 0.0
    """Force by which the drag in every hole changes a tension well above it at full slip, N; see `cable.py`."""
    umbilical: float = 0.0
    """Stiffness of a couple that turns the tip disk back to angle 0, N m/rad."""
    closure: tuple[Term, ...] = ()
    """Moments on the arcs that depend on the state."""

    @property
    def plates(self) -> int:
        return len(self.arc)

    @property
    def remembers(self) -> bool:
        """Whether a state depends on those before it, by slip at the holes, or by hysteresis or relaxation of the
        plates."""
        return self.presliding > 0 or self.hysteresis.slipping > 0 or self.relaxation != 0

    @property
    def follows_path(self) -> bool:
        """Whether a state depends on the loads of the steps before it: by memory, by a lag of the tensions, or by a
        moment law along the whole path."""
        return bool(self.remembers or self.closure or np.any(self.play))

    @property
    def retraces(self) -> bool:
        """Whether states depend on the loads of their step and on declared slip alone: on no path, rate or time."""
        timed = (self.zero_drift, self.softening, self.friction_rate, self.friction_excess, self.friction_drift)
        return not (self.follows_path or any(map(np.any, timed)))

    @property
    def length(self) -> float:
        """Straight length from the base disk's distal face to the tip disk's distal face, m."""
        return float(np.sum(self.arc + 2 * self.clamp) + self.plates * self.disk)

    @property
    def elastic_stiffness(self) -> np.ndarray:
        """(n, nodes) stiffness of each node with the cables that bend with it, where nothing yields, N m/rad."""
        return self.stiffness + self.cable_stiffness


class Loads(NamedTuple):
    """The loads on a chain of `n` plates and `m` cables at each of `s` load steps."""

    tension: np.ndarray
    """(s, m) cable tension as it enters the base hole, N."""
    slip: np.ndarray
    """(s, m) declared slip: -1 drawn toward the base, +1 paid out, 0 no friction."""
    force: np.ndarray
    """(s, n, 2) dead force at the centre of each disk 1..n, N."""
    tip: np.ndarray
    """(s, 2) dead force at the centre of the tip disk's distal face, N."""
    moment: np.ndarray
    """(s, n) extra bending moment on the arc of each plate, the same all along it, N m."""
    elapsed: np.ndarray
    """(s, 1) number of steps of the recording or the case that had passed before each step, for drift and softening."""
    rate: np.ndarray
    """(s, m) rate at which each cable's tension changed on the way to the step, N/s; 0 where no times are known."""
    travel: np.ndarray
    """(s, m) change of each cable's tension since the cable began to slip in its present direction, N."""
    time: np.ndarray
    """(s, 1) when each step was read, s; 0 at all where no times are known."""

    @property
    def steps(self) -> int:
        return self.tension.shape[0]


def loads(chain: Chain, tension, slip=-1.0, force=0.0, tip=0.0, moment=0.0, elapsed=0.0) -> Loads:
    """Loads on `chain` from anything that broadcasts to the shapes of :class:`Loads`.

    Rates are unknown (0), and the travel of each cable is its whole tension, as if each step were pulled from rest.
    """
    tension = np.atleast_2d(np.asarray(tension, float))
    steps, cables = tension.shape

    def full(value, *shape: int) -> np.ndarray:
        out = np.empty((steps, *shape))
        out[:] = value
        return out

    return Loads(
        tension.copy(),
        full(slip, cables),
        full(force, chain.plates, 2),
        full(tip, 2),
        full(moment, chain.plates),
        full(elapsed, 1),
        full(0.0, cables),
        np.abs(tension),
        full(0.0, 1),
    )


def no_loads(chain: Chain) -> Loads:
    """Loads of one step, all zero, in shapes (1, ...) that fit the chain."""
    plates, cables = chain.offset.shape
    shapes = (cables,), (cables,), (plates, 2), (2,), (plates,), (1,), (cables,), (cables,), (1,)
    return Loads(*(np.zeros((1, *shape)) for shape in shapes))


class Pose(NamedTuple):
    """Positions and angles of disks 0..n in one or many equilibria; leading dimensions are those of the node angles."""

    x: np.ndarray
    """(..., n + 1) centre of each disk (mid thickness), m."""
    y: np.ndarray
    """(..., n + 1), m."""
    angle: np.ndarray
    """(..., n + 1) absolute angle of each disk, rad."""


def pose(chain: Chain, q: np.ndarray) -> Pose:
    """Centres and angles of all disks for node angles `q` (..., n, nodes): the product of Eq. 3 over all plates."""
    psi = np.einsum("jk,...ik->...ij", chain.plate.turn, q)
    bend = q.sum(-1)
    along = chain.arc * (np.cos(psi) @ chain.plate.end) + chain.clamp * (1 + np.cos(bend)) + chain.disk * np.cos(bend)
    across = chain.arc * (np.sin(psi) @ chain.plate.end) + (chain.clamp + chain.disk) * np.sin(bend)
    angle = np.concatenate([np.zeros((*bend.shape[:-1], 1)), np.cumsum(bend, -1)], -1)
    cos, sin = np.cos(angle), np.sin(angle)
    start = np.zeros((*bend.shape[:-1], 1))
    face_x = np.concatenate([start, np.cumsum(cos[..., :-1] * along - sin[..., :-1] * across, -1)], -1)
    face_y = np.concatenate([start, np.cumsum(sin[..., :-1] * along + cos[..., :-1] * across, -1)], -1)
    return Pose(face_x - chain.disk / 2 * cos, face_y - chain.disk / 2 * sin, angle)
