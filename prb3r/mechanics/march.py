r"""Equilibrium of a chain without dead loads, plate after plate from base to tip.

What a plate feels is known when its turn comes, so each is one small problem.  `newton.py` has the whole chain at once,
for dead loads and for friction that follows the cables' travel.
"""

from math import exp

from prb3r.mechanics.angle import cos_sin
from prb3r.mechanics.balance import balance_plate
from prb3r.mechanics.kernel import kernel

TOLERANCE = 1e-11
"""Largest unbalanced node angle of a solved plate, rad."""
MAX_ITERATIONS = 60
"""Evaluations of a plate, or of the chain, after which a solve is given up."""
CYCLING = 12
"""From this Newton step on steps are shortened: at kinks of friction or of a bending law full ones may cycle."""
SHORTEST_SHARE = 1.0 / 64
"""Of a step that leads to a larger error, where steps are shortened."""
MAX_STEP = 0.5
"""Longest Newton step of a node angle, rad."""
FAILED = -1


@kernel
def correct_plate(plate):
    """Newton step of one plate: `residual` becomes ``tangent^-1 residual``; `tangent` is used up."""
    a, b, n = plate.tangent, plate.residual, plate.q.shape[0]
    for k in range(n):
        for r in range(k + 1, n):
            if abs(a[r, k]) > abs(a[k, k]):
                for c in range(k, n):
                    a[k, c], a[r, c] = a[r, c], a[k, c]
                b[k], b[r] = b[r], b[k]
        inverse = 1.0 / a[k, k]
        for r in range(k + 1, n):
            factor = a[r, k] * inverse
            for c in range(k + 1, n):
                a[r, c] -= factor * a[k, c]
            b[r] -= factor * b[k]
    for k in range(n - 1, -1, -1):
        value = b[k]
        for r in range(k + 1, n):
            value -= a[k, r] * b[r]
        b[k] = value / a[k, k]


@kernel
def at_base(tension, slip, cable):
    """Cables as they enter the base disk: along its axis, under the applied tension less what a pulley takes."""
    for j in range(len(cable)):
        cable[j].tension, cable[j].approach, cable[j].slip = tension[j], 0.0, slip[j]
        cable[j].follows, cable[j].passed = 0.0, 0.0
        if cable[j].pulley != 0.0:
            cable[j].tension *= exp(-slip[j] * cable[j].pulley)


@kernel
def next_frame(model, plate, after):
    """Position and angle of the distal disk's distal face, from those of the proximal one."""
    c, s = plate.frame[3], plate.frame[4]
    x = plate.end[0] + model.disk * plate.axis[0]
    y = plate.end[1] + model.disk * plate.axis[1]
    after.frame[0] = plate.frame[0] + c * x - s * y
    after.frame[1] = plate.frame[1] + s * x + c * y
    after.frame[2] = plate.frame[2] + plate.bend
    after.frame[3], after.frame[4] = cos_sin(after.frame[2])


@kernel
def depart(plate, span, cable):
    """Cables as they arrive at the distal disk."""
    for j in range(len(cable)):
        cable[j].tension = span[j].tension
        cable[j].approach = span[j].direction - plate.bend
        cable[j].passed += span[j].length


@kernel
def march(packed, tension, slip, work):
    """Solve plate after plate without dead loads, starting from the present node angles.

    Returns the largest number of Newton steps a plate took, or `FAILED`.
    """
    model, plates, spans, cable = packed.model[0], packed.plate, packed.span, packed.cable
    n, way = work.block.shape[0], work.block[:, 0]  # the last step, to go back by
    at_base(tension, slip, cable)
    most = 0
    for i in range(len(spans)):
        plate, after, span = plates[i], plates[i + 1], spans[i]
        plate.load[0], plate.load[1], plate.load[2] = 0.0, 0.0, 0.0
        steps, last, share = FAILED, 0.0, 1.0
        for step in range(MAX_ITERATIONS):
            error = balance_plate(model, plate, span, cable)
            if error <= TOLERANCE:
                steps = step
                break
            if step >= CYCLING and not error < last and share > SHORTEST_SHARE:
                share /= 2  # back by half of what was gone
                for k in range(n):
                    plate.q[k] -= share * way[k]
                    after.q[k] -= share * way[k]
                continue
            correct_plate(plate)
            last, share = error, 1.0
            for k in range(n):
                way[k] = min(max(-plate.residual[k], -MAX_STEP), MAX_STEP)
                plate.q[k] += way[k]
                after.q[k] += way[k]  # the next plate will change much alike
        if steps == FAILED:
            work.spent[0] += MAX_ITERATIONS
            return FAILED
        work.spent[0] += steps + 1
        most = max(most, steps)
        depart(plate, span, cable)
        next_frame(model, plate, after)
    return most
