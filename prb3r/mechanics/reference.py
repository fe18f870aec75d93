r"""Independent reference models for tests and `prb3r bench`: slow, plain, and sharing no equation with the solver.

Planar vectors are complex numbers here.  A plate lives in the frame of its proximal disk, whose distal face has its
centre at 0: the arc begins at `clamp`, the distal disk is met at `end`, cables leave at ``H = 1j offset`` and arrive at
``Q = end + exp(1j bend) H``.  With the cross product ``a x b = Im(conj(a) b)`` the distal part of plate `i` feels about
its point `P` the moment ``M(P) = moment - P x force`` of a wrench that follows from all bends and ends [Eq. 5-10].
Three models answer it: springs at hinges [Eq. 12], and the elastica ``EI (kappa - kappa_rest) = M(P(s))`` by
quadrature of its first integral or as an initial value problem.  A rest shape enters the elastica as mean curvature.

Loads come as :class:`Loads`; one load step is a :class:`Loads` without its leading dimension.
"""

from collections.abc import Callable
from math import copysign, cos, sin, sqrt

import numpy as np
from scipy.integrate import quad, solve_ivp
from scipy.optimize import fsolve

from prb3r.mechanics.chain import Chain, Loads, Pose

Shape = tuple[np.ndarray, np.ndarray]
"""(..., n) bend (rad) and (..., n) complex end (m) of each plate."""

CONVERGED = 1e-7
"""Largest error of a hinge angle (rad) or of a plate's end (arc lengths) with which a root is accepted."""


def constant_curvature_pose(chain: Chain, bends: np.ndarray) -> Pose:
    """Disks of plates bent to circular arcs by `bends` (..., n), rad [Eq. 13, 14].

    The translation ``r0 (sin theta, 1 - cos theta)`` of Eq. 14 is written as chord of the arc plus two clamps, which
    has no singularity at ``theta = 0``.
    """
    bends = np.asarray(bends, float)
    return _pose(chain, (bends, _end(chain, bends, _chord(bends))))


def wrench(chain: Chain, step: Loads, shape: Shape) -> tuple[np.ndarray, np.ndarray]:
    """Force (n,) on the distal part of each plate, N, and its moment (n,) about the origin of the plate, N m."""
    bend, end = shape
    turned = np.exp(1j * bend)
    angle = np.cumsum(bend) - bend
    span = end[:, None] + 1j * (turned - 1)[:, None] * chain.offset  # Q - H
    turning = angle[:, None] + np.arctan2(span.imag, span.real)
    turning[1:] -= turning[:-1].copy()  # from the span before; at the base from the axis [Eq. 7]
    grip = np.cumsum(step.slip * chain.friction * np.abs(turning), axis=0)
    tension = (np.arange(len(bend))[:, None] < chain.reach) * step.tension * np.exp(grip)  # [Eq. 6]
    pull = -tension * span / np.abs(span)  # from Q toward H, on a line through H [Eq. 5]
    force, moment = pull.sum(1), -(chain.offset * pull.real).sum(1)  # [Eq. 8, 9]
    if step.force.any() or step.tip.any():
        frame = np.exp(1j * angle)
        face = np.cumsum(frame * (end + chain.disk * turned))
        dead = step.force @ (1, 1j)
        about = _cross(face - chain.disk / 2 * frame * turned, dead)
        tip = complex(*step.tip)
        beyond = np.cumsum(dead[::-1])[::-1] + tip
        total = np.cumsum(about[::-1])[::-1] + _cross(face[-1], tip)
        force += beyond / frame
        moment += total - _cross(np.append(0, face[:-1]), beyond)  # [Eq. 10]
    return force, moment


def seed_residual(chain: Chain, step: Loads, q: np.ndarray) -> np.ndarray:
    """Unbalanced moment (n, nodes) at every hinge for hinge angles `q` (n, nodes), N m [Eq. 12]."""
    plate, arc = chain.plate, chain.arc[:, None]
    links = np.exp(1j * (q @ plate.turn.T))
    bend = q.sum(1)
    force, moment = wrench(chain, step, (bend, _end(chain, bend, links @ plate.end)))
    hinge = chain.clamp[:, None] + arc * (links @ plate.reach.T)
    moment = moment + step.moment
    return chain.elastic_stiffness * (q - chain.rest) - moment[:, None] + _cross(hinge, force[:, None])


def seed_fsolve(chain: Chain, loads: Loads) -> tuple[np.ndarray, int]:
    """The paper's own method: all hinge angles at once by `fsolve`, numeric Jacobian, from the last step's solution.

    Returns
    -------
    q : (s, n, nodes) hinge angles, rad
    calls : residual evaluations

    Raises
    ------
    RuntimeError
        At the first step whose root is not found.  Friction has a kink where a cable runs straight, and the
        method may stall there.
    """

    def unbalanced(flat, step):
        return seed_residual(chain, step, flat.reshape(chain.rest.shape)).ravel()

    q, calls = chain.rest, 0
    answer: list[np.ndarray] = []
    for step in map(Loads, *loads):
        root, info, *_ = fsolve(unbalanced, q, args=(step,), full_output=True)
        q, calls = root.reshape(q.shape), calls + info["nfev"]
        if not np.abs(info["fvec"] / chain.stiffness.ravel()).max() < CONVERGED:
            raise RuntimeError(f"no equilibrium found at load step {len(answer)}")
        answer.append(q)
    return np.array(answer), calls


def integral_fsolve(chain: Chain, loads: Loads) -> tuple[np.ndarray, Pose, int]:
    """The traditional integral model: first integral of the elastica, adaptive quadrature inside `fsolve`.

    A plate under a constant force `F` keeps ``EI kappa^2 / 2 + F . t`` along its arc, `t` the tangent at direction
    `psi`; arc length and end are integrals of ``dpsi / kappa``.  Unknown are bend and end of all plates at once; the
    last step's solution is the first guess.

    Domain: `kappa` keeps its sign and is not zero within a plate.  Any cables, friction and dead loads are allowed
    as long as they leave no plate straight and no inflection inside one.

    Returns
    -------
    bends : (s, n) rad
    pose : with leading dimension s
    calls : residual evaluations

    Raises
    ------
    ValueError
        At the first step without an equilibrium inside the domain.
    """
    first = Loads(*(field[0] for field in loads))
    ends, calls = _arcs(_felt(chain, first, _arcs(np.zeros(chain.plates)))[0]), 0
    answer: list[np.ndarray] = []
    for step in map(Loads, *loads):
        ends, more = _root(chain, step, _quadrature, ends)
        calls += more
        bend, (curvature, force) = ends[0], _felt(chain, step, ends)
        square = _curvature_square(bend * np.linspace(0, 1, 65)[:, None], curvature, force.real, force.imag)
        if not ((bend * curvature > 0).all() and (square > 0).all()):
            raise ValueError(f"load step {len(answer)} leaves a plate straight or with an inflection")
        answer.append(ends)
    bends, x, y = np.stack(answer, axis=1)
    return bends, _pose(chain, (bends, _end(chain, bends, x + 1j * y))), calls


def elastica_shooting(chain: Chain, step: Loads, ramp: int = 4) -> tuple[np.ndarray, Pose]:
    """The elastica under any loads: every arc an initial value problem (DOP853), all ends found as one root.

    The load is applied in `ramp` equal steps, each started from the last.

    Returns
    -------
    bends : (n,) rad
    pose : Pose

    Raises
    ------
    ValueError
        When the root is not found.
    """
    ends = _arcs(np.zeros(chain.plates))
    for share in np.arange(1, ramp + 1) / ramp:
        part = Loads(*(share * field for field in step))._replace(slip=step.slip)
        ends, _ = _root(chain, part, _initial_value, ends, xtol=1e-12)
    bend, x, y = ends
    return bend, _pose(chain, (bend, _end(chain, bend, x + 1j * y)))


# Below, arcs have unit length and rigidity.  `ends` (3, n): bend and end (x, y) of each arc in the frame of its start.


def _felt(chain: Chain, step: Loads, ends: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Curvature (n,) at the start of each arc and complex force (n,) on its end."""
    bend, x, y = ends
    force, moment = wrench(chain, step, (bend, _end(chain, bend, x + 1j * y)))
    flexibility = chain.plate.stiffness[0] / chain.elastic_stiffness[:, 0]  # l / EI
    return chain.rest.sum(1) + flexibility * (
        moment + step.moment - chain.clamp * force.imag
    ), flexibility * chain.arc * force


def _quadrature(ends: np.ndarray, curvature: np.ndarray, force: np.ndarray) -> np.ndarray:
    """(3, n) residuals of length, x and y of each arc, all by integrals over its direction."""
    bend, x, y = ends
    arcs = [_integrals(*arc) for arc in zip(bend, curvature, force.real, force.imag, strict=True)]
    return np.transpose(arcs) - [np.ones_like(bend), x, y]


def _integrals(bend: float, curvature: float, fx: float, fy: float) -> tuple[float, float, float]:
    """Length, x and y of one arc: integrals of ds, cos psi ds, sin psi ds over the direction psi from 0 to `bend`."""

    def length(psi):  # ds / dpsi, kept finite outside the domain while the root is being sought
        return 1 / copysign(sqrt(max(_curvature_square(psi, curvature, fx, fy, cos, sin), 1e-12)), curvature)

    integral = lambda f: quad(f, 0, bend, full_output=1)[0]  # noqa: E731 - full output: no warnings on the way
    return integral(length), integral(lambda psi: cos(psi) * length(psi)), integral(lambda psi: sin(psi) * length(psi))


def _curvature_square(psi, curvature, fx, fy, cos=np.cos, sin=np.sin):
    """First integral of the elastica: ``kappa^2 / 2 + f . t`` is the same at direction `psi` and at 0."""
    return curvature * curvature + 2 * (fx * (1 - cos(psi)) - fy * sin(psi))


def _initial_value(ends: np.ndarray, curvature: np.ndarray, force: np.ndarray) -> np.ndarray:
    """(3, n) residuals of bend, x and y of each arc, when its curvature, linear in position, is integrated along it."""

    def slope(_, state):
        psi, x, y = state.reshape(3, -1)
        return np.concatenate([curvature - x * force.imag + y * force.real, np.cos(psi), np.sin(psi)])

    arcs = solve_ivp(slope, (0, 1), np.zeros(ends.size), "DOP853", rtol=1e-12, atol=1e-14)
    return arcs.y[:, -1].reshape(ends.shape) - ends


def _root(chain: Chain, step: Loads, miss: Callable, start: np.ndarray, xtol: float = 1e-9) -> tuple[np.ndarray, int]:
    """The `ends` (3, n) at which the residuals `miss` of all arcs vanish, and the number of evaluations.

    `miss` takes the ends, and the curvature and force of each arc under the wrenches that these ends cause.  Raises
    ValueError if no root is found.
    """

    def missed(flat):
        ends = flat.reshape(start.shape)
        return miss(ends, *_felt(chain, step, ends)).ravel()

    root, info, *_ = fsolve(missed, start, xtol=xtol, full_output=True)
    if not np.abs(info["fvec"]).max() < CONVERGED:
        raise ValueError("no equilibrium of the elastica found in the domain of this model")
    return root.reshape(start.shape), info["nfev"]


def _cross(a, b):
    return a.real * b.imag - a.imag * b.real


def _chord(bend: np.ndarray) -> np.ndarray:
    """Chord of a circular arc of unit length."""
    return np.sinc(bend / (2 * np.pi)) * np.exp(0.5j * bend)


def _arcs(bend: np.ndarray) -> np.ndarray:
    """(3, n) bend of circular arcs of unit length and x and y of their ends, from bends (n,), rad."""
    chord = _chord(bend)
    return np.array([bend, chord.real, chord.imag])


def _end(chain: Chain, bend: np.ndarray, chord: np.ndarray) -> np.ndarray:
    """Proximal face of each distal disk, m: clamp, arc with `chord` in arc lengths, clamp."""
    return chain.arc * chord + chain.clamp * (1 + np.exp(1j * bend))


def _pose(chain: Chain, shape: Shape) -> Pose:
    bend, end = shape
    angle = np.concatenate([np.zeros_like(bend[..., :1]), np.cumsum(bend, -1)], -1)
    frame = np.exp(1j * angle)
    faces = np.cumsum(frame[..., :-1] * end + chain.disk * frame[..., 1:], -1)
    centre = np.concatenate([np.zeros_like(faces[..., :1]), faces], -1) - chain.disk / 2 * frame
    return Pose(centre.real, centre.imag, angle)
