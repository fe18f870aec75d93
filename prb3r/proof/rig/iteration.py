"""Compiled iteration of Newton for the balance of all plates, with holes that slip or stick.

Over a sub-step the slip state of a hole uses the cable lengths at its end,

    sigma <- clip(sigma + (length beyond the hole: after - before) / presliding, -1, 1),

which is exact while that length moves one way.  Just after a hole begins to slip any small load may change which holes
do, a problem without scale that no halving cures: the careful iteration changes one hole at a time (Katzenelson's way
through piecewise linear equations).
"""

import numpy as np
from numba import njit

from prb3r.proof.rig.arrays import Bent, Slips
from prb3r.proof.rig.imbalance import imbalance
from prb3r.proof.rig.pull import lengths_beyond

RESIDUAL, ROUNDED = 1e-11, 1e-8
"""A balance has converged where its gap (bends in rad, positions in plate lengths) is below the first number; or, as
rounding may forbid that, where the last move is below the first and the gap below the second."""
ITERATIONS, LARGEST_MOVE = 25, 0.3
"""Most Newton iterations for a balance; and the largest move of one: bends in rad, positions in plate lengths."""


@njit(cache=True)
def slip_states(rig, memory, ends):
    """(n, m) slip states at end poses (n, 3), not yet clipped to -1..1; with declared slip, the declared ones."""
    if not np.isfinite(rig.presliding):
        return memory.slip.copy()
    return memory.slip + (lengths_beyond(rig, ends) - memory.beyond) / rig.presliding


@njit(cache=True)
def first_change(slip, after, sticking):
    """Part of a move at which the first hole begins or ceases to slip, and the index of that hole.

    `slip` and `after` (n, m) are the unclipped slip states before and after the whole move.  At 1 or more none changes.
    """
    least, plate, cable = np.inf, 0, 0
    for i in range(slip.shape[0]):
        for j in range(slip.shape[1]):
            side, part = np.sign(after[i, j] if sticking[i, j] else slip[i, j]), 1.0
            if sticking[i, j] != (side * after[i, j] < 1) and after[i, j] != slip[i, j]:
                part = (side - slip[i, j]) / (after[i, j] - slip[i, j])
            if part < least:
                least, plate, cable = part, i, j
    return least, plate, cable


@njit(cache=True, error_model="numpy")
def iterate(rig, forces, memory, ends, elements, careful):
    """The balance from end poses `ends` (n, 3): whether it has converged, its end poses, slip states, lengths beyond
    the holes, hysteresis state of the plates and span tensions.

    If `careful`, each move stops where the first hole begins or ceases to slip.

    Raises
    ------
    numpy.linalg.LinAlgError
        Where a tangent is singular.
    """
    lengths, largest = rig.arc + 2 * rig.clamp, np.inf
    slip, bent = slip_states(rig, memory, ends), Bent(memory.bent, np.empty_like(memory.bent))
    sticking, tension = np.abs(slip) < 1, np.zeros(slip.shape)
    for _ in range(ITERATIONS + 2 * slip.size if careful else ITERATIONS):
        state = np.minimum(np.maximum(slip, -1.0), 1.0)
        gap, tangent, tension = imbalance(rig, forces, Slips(state, sticking), bent, ends, elements)
        error = _largest(gap, lengths)
        if error < RESIDUAL or (error < ROUNDED and largest < RESIDUAL):
            return True, ends, state, lengths_beyond(rig, ends), bent.after, tension
        if not np.isfinite(error):
            break
        move = np.linalg.solve(tangent, -gap.ravel()).reshape(ends.shape)
        largest = _largest(move, lengths)
        move *= min(1.0, LARGEST_MOVE / largest)
        after = slip_states(rig, memory, ends + move)
        if careful:
            part, plate, cable = first_change(slip, after, sticking)
            if part < 1:
                move *= max(part, 0.0)
                sticking[plate, cable] = not sticking[plate, cable]
                after = slip_states(rig, memory, ends + move)
        else:
            sticking = np.abs(after) < 1
        ends, slip = ends + move, after
    return False, ends, slip, slip, bent.after, tension


@njit(cache=True)
def _largest(change, lengths):
    """Largest of changes of end poses (n, 3): of positions in plate lengths, of bends in rad; NaN if any is NaN."""
    most = 0.0
    for i in range(len(change)):
        for q in range(3):
            size = abs(change[i, q]) / (1.0 if q == 2 else lengths[i])
            if not size <= most:
                most = size
    return most
