"""Accepted states of a chain along a load path: saving, restoring, moving sliders on, and noticing jumps."""

from typing import NamedTuple

import numpy as np

from prb3r.mechanics.bending import FREE, held_spring
from prb3r.mechanics.bundle import bundle
from prb3r.mechanics.chain import Chain
from prb3r.mechanics.kernel import kernel

PLATE_TURN = 0.35
"""Largest change of a plate's bend in one step, rad; a step that turns it further is halved."""
DISK_TURN = 1.0
"""Largest change of a disk's angle in one step under dead loads, rad."""
SURPRISE = 0.5
"""Largest part of the largest disk turn in a step by which the first Newton step may miss a disk's final angle; where
it misses by more, the step may be a jump to another branch."""
SLIPS_ON = 1e-9
"""Relative amount of a spring's angle by which its slider is moved back, so that a spring that stands at its bound
slips without doubt: otherwise rounding, which differs between kernels, would decide."""
NO_TURN = 1e-9
"""Turn of a node up to which its direction is of no account, rad."""
SMALLEST_JUMP = 0.02
"""Turn of a disk in one step up to which no step counts as a jump, rad."""


@bundle
class State(NamedTuple):
    """An accepted state of a chain, to which a failed step returns."""

    q: np.ndarray
    """(n, nodes) node angles, rad."""
    handed: np.ndarray
    """(1 + m,) moment of the dead loads about the world origin, N m, and length of each cable, m."""
    slip: np.ndarray
    """(n, m) slip at the holes, where friction follows the cables' travel."""
    beyond: np.ndarray
    """(n, m) cable length beyond the holes, m."""
    sign: np.ndarray
    """(1,) sign of the determinant of the tangent."""
    slider: np.ndarray
    """(n, nodes, elements) node angles, beyond the stress-free ones, at which the sliders of the plates stand, rad."""


@bundle
class Rates(NamedTuple):
    """Derivatives of a state along a load step, by the part of the step that is done (0 to 1)."""

    q: np.ndarray
    """(n, nodes) node angles, rad."""
    handed: np.ndarray
    """(1 + m,) moment of the dead loads (N m) and cable lengths (m)."""
    beyond: np.ndarray
    """(n, m) cable length beyond the holes, m."""


def state(chain: Chain) -> State:
    """Arrays in which :func:`save` keeps a state of a chain; angles, lengths, slips and sliders are zero at first."""
    shape = chain.offset.shape
    return State(
        q=np.zeros_like(chain.stiffness),
        handed=np.zeros(1 + shape[1]),
        slip=np.zeros(shape),
        beyond=np.zeros(shape),
        sign=np.ones(1),
        slider=np.zeros((*chain.stiffness.shape, chain.hysteresis.slipping)),
    )


def rates(chain: Chain) -> Rates:
    """Arrays, all zero, for the rates of a state of `chain`."""
    return Rates(np.zeros_like(chain.stiffness), np.zeros(1 + chain.offset.shape[1]), np.zeros(chain.offset.shape))


@kernel
def save(packed, work, into):
    """Copy the present state of the chain into `into`: angles and sliders of the plates, moment of the dead loads, and,
    where friction follows the travel, slips and lengths."""
    into.sign[0] = work.sign[0]
    for d in range(len(into.handed)):
        into.handed[d] = work.handed[d]
    for i in range(len(packed.span)):
        for k in range(into.q.shape[1]):
            into.q[i, k] = packed.plate[i].q[k]
            for e in range(packed.model[0].elements):
                into.slider[i, k, e] = packed.plate[i].slider[k, e]
        if packed.model[0].presliding != 0.0:
            for j in range(into.slip.shape[1]):
                into.slip[i, j], into.beyond[i, j] = packed.span[i, j].slip, packed.span[i, j].beyond


@kernel
def restore(packed, work, kept):
    """Put the state `kept` by :func:`save` back into the records; its slip is also the guess of the next solve."""
    work.sign[0] = kept.sign[0]
    for d in range(len(kept.handed)):
        work.handed[d] = kept.handed[d]
    for i in range(len(packed.span)):
        for k in range(kept.q.shape[1]):
            packed.plate[i].q[k] = kept.q[i, k]
            for e in range(packed.model[0].elements):
                packed.plate[i].slider[k, e] = kept.slider[i, k, e]
        if packed.model[0].presliding != 0.0:
            for j in range(kept.slip.shape[1]):
                hole = packed.span[i, j]
                hole.slip, hole.beyond, hole.new_slip = kept.slip[i, j], kept.beyond[i, j], kept.slip[i, j]
                hole.sticks = -1.0 < hole.slip < 1.0


@kernel
def settle(packed):
    """Accept slip and cable lengths of the state just found as those from which the next sub-step starts."""
    for i in range(len(packed.span)):
        for j in range(len(packed.cable)):
            hole = packed.span[i, j]
            hole.slip, hole.beyond = hole.new_slip, hole.new_beyond
            hole.sticks = -1.0 < hole.slip < 1.0


@kernel
def slide(packed):
    """Move the sliders of the plates to where the state just found has dragged them."""
    count = packed.model[0].elements
    for i in range(len(packed.span)):
        plate = packed.plate[i]
        for k in range(plate.q.shape[0]):
            angle = plate.q[k] - plate.rest[k]
            for e in range(count):
                spring = angle - plate.slider[k, e]
                held, _, where = held_spring(packed.model[0], plate, k, e, count, angle, spring, 0.0)
                if where != FREE:
                    plate.slider[k, e] = angle - held


@kernel
def turned_too_far(packed, kept, loaded):
    """Whether a plate, or under dead loads (`loaded`) a disk, has turned so far since `kept` that the solver may have
    changed to another branch; see `PLATE_TURN` and `DISK_TURN`."""
    angle = 0.0
    for i in range(kept.q.shape[0]):
        turn = 0.0
        for k in range(kept.q.shape[1]):
            turn += packed.plate[i].q[k] - kept.q[i, k]
        angle += turn
        if not abs(turn) <= PLATE_TURN or (loaded and not abs(angle) <= DISK_TURN):
            return True
    return False


@kernel
def turned_midway(packed, middle, start):
    """Whether a node may have turned back on the way from the state `start` over `middle` to the present one, both
    halves of one length: whether the parabola through its three angles turns."""
    for i in range(start.q.shape[0]):
        for k in range(start.q.shape[1]):
            first, second = middle.q[i, k] - start.q[i, k], packed.plate[i].q[k] - middle.q[i, k]
            if max(abs(first), abs(second)) > NO_TURN and not (3 * first - second) * (3 * second - first) > 0.0:
                return True
    return False


@kernel
def turned_by_surprise(packed, kept, work):
    """Whether disks have turned since `kept` otherwise than the first Newton step of the solve (`work.foreseen`) said:
    by more than `SURPRISE` of the largest turn, where that exceeds `SMALLEST_JUMP`."""
    before, now, turn, off = 0.0, 0.0, 0.0, 0.0
    for i in range(kept.q.shape[0]):
        for k in range(kept.q.shape[1]):
            before += kept.q[i, k]
            now += packed.plate[i].q[k]
        turn, off = max(turn, abs(now - before)), max(off, abs(now - work.foreseen[i]))
    return turn > SMALLEST_JUMP and off > SURPRISE * turn
