r"""Equilibria along a load path: loads are ramped from rest, every step starts from the one before.

A step that fails, or that would turn a plate or a disk so far that another branch could be hit, is halved.
"""

from dataclasses import dataclass
from enum import IntEnum
from typing import NamedTuple

import numpy as np

from prb3r.mechanics.chain import Chain, Loads
from prb3r.mechanics.kernel import kernel
from prb3r.mechanics.march import FAILED, MAX_ITERATIONS, TOLERANCE, balance_loads, march, scratch, solve_block
from prb3r.mechanics.records import Packed, pack
from prb3r.mechanics.stability import lowest_of_plates, plate_moments
from prb3r.mechanics.tangent import chain_tangent, segment_modes, unit_modes

PLATE_TURN = 0.35
"""Largest change of a plate's bend in one step, rad; a larger one is halved."""
DISK_TURN = 1.0
"""Largest change of a disk's angle in one step under dead loads, rad."""
SMALLEST_STEP = 1.0 / 4096


class Outcome(IntEnum):
    """How a solve ended; `sentence` says what it means."""

    CONVERGED = 0
    UNSTABLE = 1
    NO_EQUILIBRIUM = 2

    @property
    def label(self) -> str:
        return self.name.lower().replace("_", " ")

    @property
    def sentence(self) -> str:
        return (
            "In balance.",
            "In balance, but the lowest eigenvalue of the tangent is not positive: the branch is unstable.",
            "No equilibrium was found on the branch that the load path leads along.",
        )[self]


@dataclass(frozen=True)
class Equilibria:
    """Equilibria of `s` load steps of a chain with `n` plates and `m` cables.  Failed steps hold NaN."""

    outcome: np.ndarray
    """(s,) values of :class:`Outcome`."""
    iterations: np.ndarray
    """(s,) Newton steps, of the plate that took most, summed over the halved steps."""
    residual: np.ndarray
    """(s,) largest unbalanced moment, N m."""
    q: np.ndarray
    """(s, n, nodes) node angles, rad."""
    x: np.ndarray
    """(s, n + 1) centres of disks 0..n, m."""
    y: np.ndarray
    """(s, n + 1), m."""
    angle: np.ndarray
    """(s, n + 1) absolute angles of the disks, rad."""
    tension: np.ndarray
    """(s, n, m) cable tension across each plate, N."""
    moment: np.ndarray
    """(s, n, nodes + 2) bending moment where each arc begins, at its nodes and where it ends, N m."""
    lowest_eigenvalue: np.ndarray | None
    """(s,) of the tangent, N m/rad; None where it was not asked for."""


class Path(NamedTuple):
    """What the compiled path writes; see :class:`Equilibria`."""

    status: np.ndarray
    residual: np.ndarray
    q: np.ndarray
    disk: np.ndarray
    tension: np.ndarray
    moment: np.ndarray
    lowest: np.ndarray


@kernel
def newton_modes(packed, tension, slip, force, tip, modes, work):
    """Newton in a few modes of the node angles, from where they are; steps taken or `FAILED`."""
    plates, n, columns = modes.shape
    stiffest = 0.0
    for i in range(plates):
        for k in range(n):
            stiffest = max(stiffest, packed.plate[i].stiffness[k])
    for step in range(MAX_ITERATIONS):
        largest, moment = chain_tangent(packed, tension, slip, force, tip, modes, work)
        if largest <= TOLERANCE * stiffest + 1e-13 * abs(moment):
            return step
        if not largest < 1e12:
            return FAILED
        solve_block(work.system, columns, columns + 1)
        for i in range(plates):
            for k in range(n):
                for c in range(columns):
                    packed.plate[i].q[k] -= modes[i, k, c] * work.system[c, columns]
    return FAILED


@kernel
def furthest_turns(packed, kept):
    """Largest change of a plate's bend and of a disk's angle since `kept` (n, nodes), rad."""
    plate_turn, disk_turn, angle = 0.0, 0.0, 0.0
    for i in range(kept.shape[0]):
        turn = 0.0
        for k in range(kept.shape[1]):
            turn += packed.plate[i].q[k] - kept[i, k]
        angle += turn
        if not abs(turn) <= plate_turn:
            plate_turn = abs(turn)
        if not abs(angle) <= disk_turn:
            disk_turn = abs(angle)
    return plate_turn, disk_turn


@kernel
def write_step(packed, s, path):
    """Keep the present state as step `s`."""
    plates, n = path.q.shape[1], path.q.shape[2]
    half, detail = packed.model[0].disk / 2, len(path.q) > 0
    largest = 0.0
    path.disk[s, 0, 0] = -half
    for i in range(plates):
        plate, frame = packed.plate[i], packed.plate[i + 1].frame
        for k in range(n):
            largest = max(largest, abs(plate.residual[k]))
        path.disk[s, i + 1, 0] = frame[0] - half * frame[3]
        path.disk[s, i + 1, 1] = frame[1] - half * frame[4]
        path.disk[s, i + 1, 2] = frame[2]
        if detail:
            for k in range(n):
                path.q[s, i, k] = plate.q[k]
            for j in range(path.tension.shape[2]):
                path.tension[s, i, j] = packed.span[i, j].tension
    path.residual[s] = largest
    if detail:
        plate_moments(packed, path.moment[s])


@kernel
def blend(of_step, last, s, share, out):
    """Loads `share` of the way from step `last` (-1: no load) to step `s`, in `out`."""
    start, target, flat = of_step[max(last, 0)].ravel(), of_step[s].ravel(), out.ravel()
    for i in range(len(flat)):
        begin = start[i] if last >= 0 else 0.0
        flat[i] = begin + share * (target[i] - begin)


@kernel
def follow(packed, loads, dead, from_rest, modes, work, path):
    """Solve every load step of `loads` and write `path`; each from rest, or each from the one before.

    `dead` (s,) tells the steps with dead loads.  `modes` (n, nodes, c) ties node angles together (c = 0: they are
    free).  Where `path.lowest` is not empty the lowest eigenvalue is written for free angles without dead loads,
    where it is cheap.
    """
    plates = packed.plate
    steps, n = loads.tension.shape[0], packed.plate[0].q.shape[0]
    kept = np.zeros((len(packed.span), n))
    rest = np.zeros((len(packed.span), n))
    for i in range(len(rest)):
        for k in range(n):
            rest[i, k] = plates[i].rest[k]
    tied, eigenvalue = modes.shape[2] > 0, len(path.lowest) > 0
    tension, slip = np.zeros_like(loads.tension[0]), np.zeros_like(loads.slip[0])
    force, tip = np.zeros_like(loads.force[0]), np.zeros_like(loads.tip[0])
    last, moment, last_moment = -1, 0.0, 0.0  # the step solved last; -1 is rest
    kept[:] = rest
    good, good_moment = rest.copy(), 0.0  # node angles there
    for s in range(steps):
        if from_rest:
            last, last_moment = -1, 0.0
            kept[:] = rest
            good[:] = rest
        loaded = dead[s] or (last >= 0 and dead[last])
        for i in range(len(kept)):
            for k in range(n):
                plates[i].q[k] = kept[i, k]
        done, step, iterations = 0.0, 1.0, 0
        while done < 1.0 and step >= SMALLEST_STEP:
            share = done + step
            blend(loads.tension, last, s, share, tension)
            blend(loads.slip, last, s, share if last >= 0 else 1.0, slip)
            if loaded:
                blend(loads.force, last, s, share, force)
                blend(loads.tip, last, s, share, tip)
            moment = last_moment
            if tied:
                taken = newton_modes(packed, tension, slip, force, tip, modes, work)
            elif loaded:
                taken, moment = balance_loads(packed, tension, slip, force, tip, moment, work)
            else:
                taken = march(packed, tension, slip, work)
            plate_turn, disk_turn = furthest_turns(packed, kept)
            if taken != FAILED and plate_turn <= PLATE_TURN and (not loaded or disk_turn <= DISK_TURN):
                done = share
                iterations += taken
                step = min(2 * step, 1.0 - done)
                last_moment = moment
                for i in range(len(kept)):
                    for k in range(n):
                        kept[i, k] = plates[i].q[k]
            else:
                step /= 2
                for i in range(len(kept)):
                    for k in range(n):
                        plates[i].q[k] = kept[i, k]
        path.status[s, 0], path.status[s, 1] = (0 if done == 1.0 else FAILED), iterations
        if done < 1.0:
            kept[:], last_moment = good, good_moment  # go on from the last good step of the sequence
            continue
        last, good_moment = s, last_moment
        good[:] = kept
        write_step(packed, s, path)
        if tied and len(path.moment) > 0:
            for i in range(len(kept)):
                for k in range(n):
                    path.moment[s, i, k + 1] = plates[i].stiffness[k] * (plates[i].q[k] - plates[i].rest[k])
                path.moment[s, i, 0], path.moment[s, i, n + 1] = path.moment[s, i, 1], path.moment[s, i, n]
        if tied:
            path.residual[s] = np.max(np.abs(work.system[:, -1]))
        if eigenvalue and not tied and not loaded:
            path.lowest[s] = lowest_of_plates(packed)


def lowest_under_load(packed: Packed, modes: np.ndarray, loads: Loads, q: np.ndarray) -> float:
    """Lowest eigenvalue of the whole tangent in `modes` at node angles `q`, under one step of loads, N m/rad."""
    if not np.isfinite(q).all():
        return np.nan
    work = scratch(packed, modes.shape[2])
    packed.plate["q"][:-1] = q
    chain_tangent(packed, *loads, modes, work)
    return float(np.linalg.eigvals(work.system[:, :-1]).real.min())


def solve(
    chain: Chain, loads: Loads, *, from_rest: bool = False, eigenvalue: bool = False, detail: bool = True
) -> Equilibria:
    """Equilibria of `chain` under every step of `loads`.

    Parameters
    ----------
    from_rest : every step is ramped from rest by itself instead of from the step before.
    eigenvalue : also compute the lowest eigenvalue of the tangent and mark unstable equilibria.
    detail : False leaves `q`, `tension` and `moment` empty (zero steps), for clouds of a great many loads.
    """
    steps, (plates, n), cables = loads.steps, chain.stiffness.shape, chain.offset.shape[1]
    packed = pack(chain)
    modes = segment_modes(chain) if chain.tied else np.zeros((plates, n, 0))
    dead = loads.force.any((1, 2)) | loads.tip.any(1)
    kept = steps if detail or (eigenvalue and (chain.tied or dead.any())) else 0
    path = Path(
        status=np.full((steps, 2), FAILED),
        residual=np.full(steps, np.nan),
        q=np.full((kept, plates, n), np.nan),
        disk=np.concatenate([np.zeros((steps, 1, 3)), np.full((steps, plates, 3), np.nan)], axis=1),
        tension=np.full((kept, plates, cables), np.nan),
        moment=np.full((kept, plates, n + 2), np.nan),
        lowest=np.full(steps if eigenvalue else 0, np.nan),
    )
    work = scratch(packed, modes.shape[2] or 2)
    follow(packed, loads, dead, from_rest, modes, work, path)
    outcome = np.where(path.status[:, 0] == FAILED, Outcome.NO_EQUILIBRIUM, Outcome.CONVERGED).astype(np.int8)
    if eigenvalue:
        modes = segment_modes(chain) if chain.tied else unit_modes(chain)
        for s in np.flatnonzero((outcome == Outcome.CONVERGED) & np.isnan(path.lowest)):
            path.lowest[s] = lowest_under_load(packed, modes, Loads(*(field[s] for field in loads)), path.q[s])
        outcome[path.lowest <= 0] = Outcome.UNSTABLE
    x, y, angle = np.moveaxis(path.disk, -1, 0)
    return Equilibria(
        outcome=outcome,
        iterations=path.status[:, 1],
        residual=path.residual,
        q=path.q,
        x=x,
        y=y,
        angle=angle,
        tension=path.tension,
        moment=path.moment,
        lowest_eigenvalue=path.lowest if eigenvalue else None,
    )
