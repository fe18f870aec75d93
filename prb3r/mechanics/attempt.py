"""One step of a load path: the equilibrium under given loads, from the state before."""

from typing import NamedTuple

from prb3r.mechanics.chain import Loads
from prb3r.mechanics.kernel import kernel
from prb3r.mechanics.march import FAILED, MAX_ITERATIONS, TOLERANCE, march
from prb3r.mechanics.newton import balance_chain, solve_block
from prb3r.mechanics.tangent import chain_tangent

JUMPED = -2
"""Beside `FAILED`: states were found, but none near the last one."""


class Way(NamedTuple):
    """Where the loads change linearly, and between which of their rows."""

    rows: Loads
    """(s + 1, ...) what acts at rest and at each step."""
    last: int
    """Row that the path comes from."""
    step: int
    """Row that it leads to."""


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
def blend(of_step, last, s, share, out):
    """Loads `share` of the way from step `last` to step `s`, in `out`."""
    start, target, flat = of_step[last].ravel(), of_step[s].ravel(), out.ravel()
    for i in range(len(flat)):
        flat[i] = start[i] + share * (target[i] - start[i])


@kernel
def put_on(packed, way, share, now):
    """Write the loads `share` of the `way` to `now`, extra moments to the plates; a cable cannot push."""
    rows, last, step = way.rows, way.last, way.step
    blend(rows.tension, last, step, share, now.tension)
    for j in range(len(now.tension)):
        now.tension[j] = max(now.tension[j], 0.0)
    blend(rows.slip, last, step, share if last > 0 else 1.0, now.slip)
    blend(rows.force, last, step, share, now.force)
    blend(rows.tip, last, step, share, now.tip)
    blend(rows.elapsed, last, step, share, now.elapsed)
    packed.model[0].stiff = 1.0 - packed.model[0].softening * now.elapsed[0]
    if packed.model[0].extra:
        start, target = rows.moment[last], rows.moment[step]
        for i in range(len(target)):
            packed.plate[i].extra = start[i] + share * (target[i] - start[i])


@kernel
def attempt(packed, way, share, loaded, modes, now, work):
    """Solve `share` of the `way` from the present state, without history; steps taken or `FAILED`.

    `loaded` tells whether dead loads act, `modes` is that of `follow`.
    """
    put_on(packed, way, share, now)
    if modes is not None:
        return newton_modes(packed, now.tension, now.slip, now.force, now.tip, modes, work)
    if loaded:
        return balance_chain(packed, now, 0.0, work)
    work.sign[0] = 1.0  # or the eigenvalue of a plate says so
    return march(packed, now.tension, now.slip, work)
