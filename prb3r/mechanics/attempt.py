"""One step of a load path: the equilibrium under given loads, from the state before."""

from typing import Any

from prb3r.mechanics.grip import balance_grip
from prb3r.mechanics.kernel import kernel
from prb3r.mechanics.march import FAILED, MAX_ITERATIONS, TOLERANCE, march
from prb3r.mechanics.newton import balance_chain, solve_block
from prb3r.mechanics.state import restore
from prb3r.mechanics.tangent import chain_tangent

JUMPED = -2
"""Beside `FAILED`: states were found, but none near the last one."""


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
def attempt(packed, loads, last, s, share, loaded, modes, work, now, grip, origin, careful):
    """Solve `share` of the way from step `last` to step `s` from the present state; steps taken or `FAILED`."""
    blend(loads.tension, last, s, share, now.tension)
    for j in range(len(now.tension)):
        now.tension[j] = max(now.tension[j], 0.0)
    blend(loads.slip, last, s, share if last > 0 else 1.0, now.slip)
    blend(loads.force, last, s, share, now.force)
    blend(loads.tip, last, s, share, now.tip)
    if packed.model[0].extra:
        start, target = loads.moment[last], loads.moment[s]
        for i in range(len(target)):
            packed.plate[i].extra = start[i] + share * (target[i] - start[i])
    if modes is not None:
        return newton_modes(packed, now.tension, now.slip, now.force, now.tip, modes, work)
    if loaded or packed.model[0].presliding != 0.0:
        taken: Any = FAILED
        if not careful:
            taken = balance_chain(packed, now.tension, now.slip, now.force, now.tip, work)
        if taken == FAILED and packed.model[0].presliding != 0.0:
            restore(packed, work, origin)
            taken = balance_grip(packed, now.tension, now.force, now.tip, work.handed, grip)
        return taken
    work.sign[0] = 1.0  # or the eigenvalue of a plate says so
    return march(packed, now.tension, now.slip, work)
