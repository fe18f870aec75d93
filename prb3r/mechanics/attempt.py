"""One attempt at a step of a load path: the equilibrium under given loads, from the present state.

Without dead loads plates are solved one by one (`march.py`), with dead loads all at once (`newton.py`), and with tied
node angles by Newton's method in their modes.
"""

from typing import NamedTuple

import numpy as np

from prb3r.mechanics.bundle import bundle
from prb3r.mechanics.elimination import solve_block
from prb3r.mechanics.kernel import kernel
from prb3r.mechanics.load_row import blend, slip_from_the_start
from prb3r.mechanics.march import FAILED, MAX_ITERATIONS, TOLERANCE, march
from prb3r.mechanics.newton import balance_chain
from prb3r.mechanics.relaxation import put_stiffness
from prb3r.mechanics.tangent import chain_tangent

DIVERGED_MODE = 1e12
"""Unbalanced moment of a mode, N m, at which Newton's method has left every shape of an arm."""
JUMPED = -2
"""What a path returns, beside `FAILED`, where states were found but none near the last one."""


@bundle
class Way(NamedTuple):
    """A straight way through the loads, from one row to another."""

    rows: np.ndarray
    """(s + 1, l) loads at rest and at each step, as of `rows_of_loads`."""
    ends: np.ndarray
    """(2,) row from which the way starts, and row to which it leads."""
    duration: np.ndarray
    """(1,) time that the way takes, in steps."""


@kernel
def newton_modes(packed, tension, slip, force, tip, modes, work):
    """Newton's method in a few `modes` (n, nodes, c) of the node angles, from their present values.

    Returns the steps taken or `FAILED`; leaves the largest unbalanced moment of a mode in `work.unbalanced`.
    """
    plates, n, columns = modes.shape
    for step in range(MAX_ITERATIONS):
        work.spent[0] += plates
        largest, _ = chain_tangent(packed, tension, slip, force, tip, modes, work)
        if not largest < DIVERGED_MODE:
            return FAILED
        work.unbalanced[0] = largest
        solve_block(work.system, columns, columns + 1)
        turned = 0.0
        for i in range(plates):
            for k in range(n):
                angle = abs(correction(work.system, modes[i, k], columns))
                if not angle <= turned:
                    turned = angle
        if turned <= TOLERANCE:
            return step
        for i in range(plates):
            for k in range(n):
                packed.plate[i].q[k] -= correction(work.system, modes[i, k], columns)
    return FAILED


@kernel
def correction(system, shares, columns):
    """Correction of a node angle, rad, by its `shares` (c,) in the modes, whose own stand in `system`'s last column."""
    angle = 0.0
    for c in range(columns):
        angle += shares[c] * system[c, columns]
    return angle


@kernel
def put_on(packed, way, share, now):
    """Apply the loads at `share` of the `way`: write them to `now`, with negative tensions cut off at zero, and extra
    moments and the remaining stiffness to the records."""
    last, target = way.ends[0], way.rows[way.ends[1]]
    blend(way.rows[last], target, share, now)
    if last == 0:
        slip_from_the_start(target, now)
    for j in range(len(now.tension)):
        now.tension[j] = max(now.tension[j], 0.0)
    put_stiffness(packed, now.moment, now.elapsed[0], share * way.duration[0])


@kernel
def attempt(packed, way, share, loaded, modes, now, work):
    """Solve for the equilibrium at `share` of the `way`, from the present state, where slip is declared.

    Returns the Newton steps taken or `FAILED`.  `loaded` tells whether dead loads act; `modes` is that of `follow`.
    """
    put_on(packed, way, share, now)
    if modes is not None:
        return newton_modes(packed, now.tension, now.slip, now.force, now.tip, modes, work)
    if loaded:
        return balance_chain(packed, now, 0.0, work)
    work.sign[0] = 1.0  # a plate's lowest eigenvalue tells of instability instead
    return march(packed, now.tension, now.slip, work)
