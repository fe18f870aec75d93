r"""The mechanical problem as arrays: a chain of plates and disks threaded by cables, and the loads on it.

Disk 0 is the base; plate `i` (counted from 0 in arrays) joins disk `i` to disk `i + 1`.  The world origin is the
centre of the base disk's distal face, x runs along the straight manipulator, angles are anticlockwise.
"""

from typing import NamedTuple

import numpy as np

from prb3r.mechanics.plate import PlateModel
from prb3r.mechanics.plate_law import Contact, Hysteresis, Law


class Term(NamedTuple):
    """A moment on the arc of each plate that follows the state: `coefficient` (n,) times what `of` names.

    The mechanics leaves terms alone; `prb3r.model.laws.self_consistent` turns them into `Loads.moment`.
    """

    of: str
    coefficient: np.ndarray


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
    """Belt friction at both edges of a hole, each by its own turning, instead of by their sum."""
    clearance: float = 0.0
    """How far a cable lies toward the inner side of its holes on a bent plate, m."""
    pulley: np.ndarray | float = 1.0
    """(m,) efficiency of the pulley before the base hole."""
    law: Law = Law()
    """Bending law of the plates."""
    hysteresis: Hysteresis = Hysteresis()
    """What of their stiffness slips."""
    curvature: np.ndarray | None = None
    """(nodes,) curvature times arc length per node angle, 0 where a node is a hinge; None: all are part of the arc."""
    contact: Contact = Contact()
    """Contact of neighbouring disks."""
    constant: "Loads | None" = None
    """Loads that always act (one step), at rest too; tensions are added to the applied ones."""
    tip_efficiency: float = 1.0
    """Share of the tip load that arrives."""
    disk_efficiency: np.ndarray | float = 1.0
    """(n, 1) share of the load on each disk 1..n that arrives."""
    gain: np.ndarray | float = 1.0
    """(m,) true over noted tension, as the noted one goes to zero."""
    quadratic: np.ndarray | float = 0.0
    """(m,) how that grows with the noted tension, relative, 1/N."""
    play: np.ndarray | float = 0.0
    """(m,) by which the tension lags behind the noted one, either way, N."""
    zero_drift: np.ndarray | float = 0.0
    """(m,) by which the tension grows from step to step beside the noted one, N."""
    softening: float = 0.0
    """Share of the plates' stiffness that is lost with every step."""
    friction_exponent: float = 0.0
    """Of the tension before a hole, by which friction there falls."""
    friction_tension: float = 1.0
    """Tension at which it has the coefficients of `friction`, N."""
    friction_rate: float = 0.0
    """Share by which friction grows where a cable's tension changes e times as fast."""
    friction_reference: float = 1.0
    """How fast tensions change where friction has the coefficients of `friction`, N/s."""
    friction_excess: float = 0.0
    """Share by which friction is larger where a cable begins to slip."""
    friction_decay: float = 1.0
    """Change of its tension over which that falls to 1/e, N."""
    wrap_saturation: float = 0.0
    """How little of a turn at a hole rubs, 1/rad: of a turn t counts t / (1 + wrap_saturation t)."""
    umbilical: float = 0.0
    """Couple by which the tip is turned back, of its turn, N m/rad."""
    closure: tuple[Term, ...] = ()
    """Moments on the arcs that follow the state."""

    @property
    def plates(self) -> int:
        return len(self.arc)

    @property
    def remembers(self) -> bool:
        """Whether states depend on those before: by the slip at holes or in the plates."""
        return self.presliding > 0 or self.hysteresis.slipping > 0

    @property
    def length(self) -> float:
        """Straight length from the base disk's distal face to the tip disk's distal face, m."""
        return float(np.sum(self.arc + 2 * self.clamp) + self.plates * self.disk)


class Loads(NamedTuple):
    """`s` load steps: what hangs on the chain at each."""

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
    """(s, 1) steps of the recording or the case before each."""
    rate: np.ndarray
    """(s, m) how fast each cable's tension came to be, N/s; 0 where no time says."""
    travel: np.ndarray
    """(s, m) by how much each cable's tension has changed since the cable began to slip the way it does, N."""

    @property
    def steps(self) -> int:
        return self.tension.shape[0]


def loads(chain: Chain, tension, slip=-1.0, force=0.0, tip=0.0, moment=0.0, elapsed=0.0) -> Loads:
    """Loads on `chain` from anything that broadcasts to the shapes of :class:`Loads`, each as if pulled from rest."""
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
    )


def no_loads(chain: Chain) -> Loads:
    """Loads of one step, all zero, in the shapes (1, ...) that the plates and cables of the chain ask for."""
    plates, cables = chain.offset.shape
    shapes = (cables,), (cables,), (plates, 2), (2,), (plates,), (1,), (cables,), (cables,)
    return Loads(*(np.zeros((1, *shape)) for shape in shapes))


def acting(chain: Chain, loads: Loads, begins: np.ndarray) -> Loads:
    """What acts on `chain` at rest (row 0) and under each step of `loads`: the applied loads and the constant ones.

    A negative sum of tensions is a slack cable; it is cut off on the way from step to step, not before.  Declared slip
    stands wherever friction does as its factor, so that it brings what the rate and the travel make of friction along.

    Parameters
    ----------
    begins : (s,) whether a step follows on rest instead of on the step before.
    """
    constant = chain.constant or no_loads(chain)
    return Loads(
        tension=_from_rest(arriving(chain, loads, begins)) + constant.tension,
        slip=_from_rest(loads.slip * rate_factor(chain, loads) * breakaway_factor(chain, loads)),
        force=_from_rest(loads.force * chain.disk_efficiency) + constant.force,
        tip=_from_rest(loads.tip * chain.tip_efficiency) + constant.tip,
        moment=_from_rest(loads.moment) + constant.moment,
        elapsed=_from_rest(loads.elapsed),
        rate=_from_rest(loads.rate),
        travel=_from_rest(loads.travel),
    )


def arriving(chain: Chain, loads: Loads, begins: np.ndarray) -> np.ndarray:
    """(s, m) tension of the cables for the noted one, N, without what always acts; `begins` as of :func:`acting`."""
    true = loads.tension * chain.gain * (1 + chain.quadratic * loads.tension)
    if np.any(chain.play):
        true = with_play(true, chain.play, begins)
    return true + chain.zero_drift * loads.elapsed


def with_play(tension: np.ndarray, play: np.ndarray | float, begins: np.ndarray) -> np.ndarray:
    """(s, m) what follows tensions (s, m) with some `play`, all in N: it stays as long as they are within that of it,
    and is dragged along by them beyond.  It begins at nothing.

    The play operator of hysteresis (Krejci, Hysteresis, Convexity and Dissipation in Hyperbolic Equations, 1996).
    """
    low, high = tension - play, tension + play
    out = np.zeros_like(tension)
    for step in range(len(tension)):
        before = 0.0 if begins[step] or step == 0 else out[step - 1]
        out[step] = np.minimum(np.maximum(before, low[step]), high[step])
    return out


def dead_loads(chain: Chain, loads: Loads) -> np.ndarray:
    """(s,) whether dead loads act on `chain` at a step, or the couple of an umbilical."""
    if chain.umbilical:
        return np.ones(loads.steps, bool)
    if not (loads.force.any() or loads.tip.any()):  # soon seen, and mostly so
        return np.zeros(loads.steps, bool)
    return np.array(loads.force.any((1, 2)) | loads.tip.any(1))


LEAST_FRICTION = 0.05
"""Share of friction that is left at any rate, where its logarithm would take all of it or more."""


def rate_factor(chain: Chain, loads: Loads) -> np.ndarray | float:
    """(s, m) friction of each cable at each step over that at the reference rate; 1 where no time says how fast.

    1 + a ln(v / v_0): the steady state of rate and state friction (Dieterich, J. Geophys. Res. 77 (1972) 3690; Ruina,
    J. Geophys. Res. 88 (1983) 10359), v how fast the tension changes.
    """
    if chain.friction_rate == 0:
        return 1.0
    rate = np.where(loads.rate > 0, loads.rate, chain.friction_reference)
    return np.maximum(1 + chain.friction_rate * np.log(rate / chain.friction_reference), LEAST_FRICTION)


def breakaway_factor(chain: Chain, loads: Loads) -> np.ndarray | float:
    """(s, m) friction of each cable at each step over the kinetic one.

    1 + r exp(-s / d): friction weakens with slip (Rabinowicz, J. Appl. Phys. 22 (1951) 1373; Ida, J. Geophys. Res. 77
    (1972) 3796; exponentially: Dieterich, J. Geophys. Res. 84 (1979) 2161), s the travel in terms of the tension.
    """
    if chain.friction_excess == 0:
        return 1.0
    return 1 + chain.friction_excess * np.exp(-loads.travel / chain.friction_decay)


def _from_rest(steps: np.ndarray) -> np.ndarray:
    """(s + 1, ...) values of steps (s, ...) behind a row of zeros, which stands for rest."""
    out = np.zeros((len(steps) + 1, *steps.shape[1:]))
    out[1:] = steps
    return out


class Pose(NamedTuple):
    """Disks 0..n of one or many equilibria: leading dimensions are those of the node angles."""

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
