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
    play: np.ndarray | float = 0.0
    """(m,) half-width of the play by which the true tension lags behind the recorded one, N; see `with_play`."""
    zero_drift: np.ndarray | float = 0.0
    """(m,) growth of the true tension over the recorded one with every elapsed step, N."""
    softening: float = 0.0
    """Share of the plates' initial stiffness that is lost with every elapsed step."""
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
    umbilical: float = 0.0
    """Stiffness of a couple that turns the tip disk back to angle 0, N m/rad."""
    closure: tuple[Term, ...] = ()
    """Moments on the arcs that depend on the state."""

    @property
    def plates(self) -> int:
        return len(self.arc)

    @property
    def remembers(self) -> bool:
        """Whether a state depends on those before it, by slip at the holes or by hysteresis of the plates."""
        return self.presliding > 0 or self.hysteresis.slipping > 0

    @property
    def follows_path(self) -> bool:
        """Whether a state depends on the loads of the steps before it: by memory, by a lag of the tensions, or by a
        moment law along the whole path."""
        return bool(self.remembers or self.closure or np.any(self.play))

    @property
    def length(self) -> float:
        """Straight length from the base disk's distal face to the tip disk's distal face, m."""
        return float(np.sum(self.arc + 2 * self.clamp) + self.plates * self.disk)


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
    )


def no_loads(chain: Chain) -> Loads:
    """Loads of one step, all zero, in shapes (1, ...) that fit the chain."""
    plates, cables = chain.offset.shape
    shapes = (cables,), (cables,), (plates, 2), (2,), (plates,), (1,), (cables,), (cables,)
    return Loads(*(np.zeros((1, *shape)) for shape in shapes))


def acting(chain: Chain, loads: Loads, begins: np.ndarray) -> Loads:
    """(s + 1) steps of what acts on `chain`: the constant loads at rest (row 0), and with each step of `loads` added.

    Tensions may be negative here, which stands for a slack cable: the solver cuts them off at zero after it has
    interpolated between two steps.  Declared slip enters the equations only as a factor of friction, so the factor by
    which rate, travel and elapsed steps change friction is multiplied into it.

    Parameters
    ----------
    begins : (s,) whether a step follows on rest instead of on the step before.
    """
    constant = chain.constant or no_loads(chain)
    return Loads(
        tension=_from_rest(arriving(chain, loads, begins)) + constant.tension,
        slip=_from_rest(loads.slip * friction_factor(chain, loads)),
        force=_seen_from_base(chain, _from_rest(loads.force * chain.disk_efficiency) + constant.force),
        tip=_seen_from_base(chain, _from_rest(loads.tip * chain.tip_efficiency) + constant.tip),
        moment=_from_rest(loads.moment) + constant.moment,
        elapsed=_from_rest(loads.elapsed),
        rate=_from_rest(loads.rate),
        travel=_from_rest(loads.travel),
    )


def _seen_from_base(chain: Chain, force: np.ndarray) -> np.ndarray:
    """(..., 2) forces in the frame of a base that is tilted, from those in the frame of the dead loads."""
    if chain.tilt == 0:
        return force
    c, s = np.cos(chain.tilt), np.sin(chain.tilt)
    return force @ np.array([[c, -s], [s, c]])  # rows of the rotation by -tilt, as forces are rows


def arriving(chain: Chain, loads: Loads, begins: np.ndarray) -> np.ndarray:
    """(s, m) true tension of the cables for the recorded one, N, without the constant loads.

    `begins` is that of :func:`acting`.
    """
    true = loads.tension * chain.gain * (1 + chain.quadratic * loads.tension)
    if np.any(chain.play):
        true = with_play(true, chain.play, begins)
    return true + chain.zero_drift * loads.elapsed


def with_play(tension: np.ndarray, play: np.ndarray | float, begins: np.ndarray) -> np.ndarray:
    """(s, m) output of the play operator for tensions (s, m), N (Krejci, Hysteresis, Convexity and Dissipation in
    Hyperbolic Equations, 1996).

    The output stays as long as the tension is within `play` (N) of it, and is dragged along by the tension beyond
    that.  It is 0 at rest, before every step that `begins` (s,).  A negative play leads by as much as a positive one
    lags, so that differences to both sides of none are the derivative there.
    """
    low, high = tension - np.abs(play), tension + np.abs(play)
    out = np.zeros_like(tension)
    for step in range(len(tension)):
        before = 0.0 if begins[step] or step == 0 else out[step - 1]
        out[step] = np.minimum(np.maximum(before, low[step]), high[step])
    return np.where(np.less(play, 0), 2 * tension - out, out)


def dead_loads(chain: Chain, loads: Loads) -> np.ndarray:
    """(s,) whether dead loads, or the couple of an umbilical, act on `chain` at each step."""
    if chain.umbilical:
        return np.ones(loads.steps, bool)
    if not (loads.force.any() or loads.tip.any()):  # the usual case, cheap to see
        return np.zeros(loads.steps, bool)
    return np.array(loads.force.any((1, 2)) | loads.tip.any(1))


LEAST_FRICTION = 0.05
"""Lower bound of `rate_factor` and `drift_factor`, where these would take all of friction away or more."""


def friction_factor(chain: Chain, loads: Loads) -> np.ndarray | float:
    """(s, m) friction of each cable at each step over that of the coefficients of `chain`: the product of all
    factors."""
    return rate_factor(chain, loads) * breakaway_factor(chain, loads) * drift_factor(chain, loads)


def rate_factor(chain: Chain, loads: Loads) -> np.ndarray | float:
    """(s, m) friction of each cable at each step over that at the reference rate; 1 where the rate is unknown.

    1 + a ln(v / v_0) with the rate v of the tension: the steady state of rate and state friction (Dieterich, J.
    Geophys. Res. 77 (1972) 3690; Ruina, J. Geophys. Res. 88 (1983) 10359).
    """
    if chain.friction_rate == 0:
        return 1.0
    rate = np.where(loads.rate > 0, loads.rate, chain.friction_reference)
    return np.maximum(1 + chain.friction_rate * np.log(rate / chain.friction_reference), LEAST_FRICTION)


def breakaway_factor(chain: Chain, loads: Loads) -> np.ndarray | float:
    """(s, m) friction of each cable at each step over the kinetic one.

    1 + r exp(-s / d): friction weakens with slip (Rabinowicz, J. Appl. Phys. 22 (1951) 1373; Ida, J. Geophys. Res. 77
    (1972) 3796; exponentially: Dieterich, J. Geophys. Res. 84 (1979) 2161).  The slip is measured by `Loads.travel`
    s, the change of the tension in N.
    """
    if chain.friction_excess == 0:
        return 1.0
    return 1 + chain.friction_excess * np.exp(-loads.travel / chain.friction_decay)


def drift_factor(chain: Chain, loads: Loads) -> np.ndarray | float:
    """(s, 1) friction at each step over the initial one, which grows in proportion to the elapsed steps."""
    if chain.friction_drift == 0:
        return 1.0
    return np.maximum(1 + chain.friction_drift * loads.elapsed, LEAST_FRICTION)


def _from_rest(steps: np.ndarray) -> np.ndarray:
    """(s + 1, ...) a row of zeros, which stands for rest, followed by the values of the steps (s, ...)."""
    out = np.zeros((len(steps) + 1, *steps.shape[1:]))
    out[1:] = steps
    return out


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
