r"""Equilibrium of a chain without dead loads, plate after plate from base to tip.

All forces on a plate are known once the plates before it are solved, so each plate is a small problem of its own.
`newton.py` solves the whole chain at once, for dead loads and for friction that follows the cables' travel.
"""

from prb3r.mechanics.balance import linearise_plate, unbalance_plate
from prb3r.mechanics.kernel import kernel
from prb3r.mechanics.slip import behind_pulley

TOLERANCE = 1e-11
"""Largest unbalanced node angle of a solved plate, rad."""
AS_FORETOLD = 1e-12
"""Largest unbalanced node angle of a plate that counts as solved before any Newton step, rad: sharper than `TOLERANCE`,
as a Newton step leaves much less than that."""
DIVERGED = 1e6
"""Step of an angle, rad, or unbalanced angle, at which Newton's method has left every shape of an arm."""
MOMENT_ROUNDING = 1e-13
"""Relative rounding error of the moment that a chain hands to its base, in which its balance cannot be told."""
MAX_ITERATIONS = 60
"""Evaluations of a plate, or of the chain, after which a solve is given up."""
CYCLING = 12
"""From this Newton step on steps are shortened: at kinks of friction or of a bending law full ones may cycle."""
SHORTEST_SHARE = 1.0 / 64
"""Smallest part to which a Newton step is cut that leads to a larger error, from step `CYCLING` on."""
MAX_STEP = 0.5
"""Longest Newton step of a node angle, rad."""
FAILED = -1
"""What a solve returns, instead of its number of Newton steps, if it did not converge."""


@kernel
def exchange_rows(plate, k):
    """Pivot: exchange row `k` of a plate's tangent, and of its residual, for the row below with the largest entry in
    column `k`."""
    a, b, n = plate.tangent, plate.residual, plate.q.shape[0]
    for r in range(k + 1, n):
        if abs(a[r, k]) > abs(a[k, k]):
            for c in range(k, n):
                a[k, c], a[r, c] = a[r, c], a[k, c]
            b[k], b[r] = b[r], b[k]


@exchange_rows.where_in_lanes
def keep_rows(plate, k):
    """No pivoting in lanes: lanes would need different exchanges, and a lane that needs one does not converge."""


@kernel
def correct_plate(plate):
    """Solve for the Newton step of one plate: `residual` becomes ``tangent^-1 residual``; `tangent` is overwritten."""
    a, b, n = plate.tangent, plate.residual, plate.q.shape[0]
    for k in range(n):
        exchange_rows(plate, k)
        inverse = 1.0 / a[k, k]
        a[k, k] = inverse
        for r in range(k + 1, n):
            factor = a[r, k] * inverse
            for c in range(k + 1, n):
                a[r, c] -= factor * a[k, c]
            b[r] -= factor * b[k]
    for k in range(n - 1, -1, -1):
        value = b[k]
        for r in range(k + 1, n):
            value -= a[k, r] * b[r]
        b[k] = value * a[k, k]


@kernel
def at_base_hole(cable, tension, slip):
    """Set the record of one cable as it enters the base disk: along the disk's axis, with the applied tension (N) as
    changed at this `slip` by the pulley before the base hole."""
    cable.tension, cable.approach, cable.slip = tension, 0.0, slip
    cable.follows, cable.passed = 0.0, 0.0
    if cable.pulley != 0.0:
        cable.tension = behind_pulley(tension, slip, cable.pulley)


@kernel
def at_base(tension, slip, cable):
    """Set the records of all cables as they enter the base disk, under `tension` (m,) with `slip` (m,)."""
    for j in range(len(cable)):
        at_base_hole(cable[j], tension[j], slip[j])


@kernel
def next_frame(model, plate, after):
    """Write the position and angle of the distal disk's distal face (the frame of the plate `after`), from those of the
    proximal disk."""
    c, s = plate.frame[3], plate.frame[4]
    x = plate.end[0] + model.disk * plate.axis[0]
    y = plate.end[1] + model.disk * plate.axis[1]
    after.frame[0] = plate.frame[0] + c * x - s * y
    after.frame[1] = plate.frame[1] + s * x + c * y
    after.frame[2] = plate.frame[2] + plate.bend
    after.frame[3] = c * plate.axis[0] - s * plate.axis[1]
    after.frame[4] = s * plate.axis[0] + c * plate.axis[1]


@kernel
def depart(plate, span, cable):
    """Set the records of all cables as they arrive at the distal disk, after the span across this plate."""
    for j in range(len(cable)):
        cable[j].tension = span[j].tension
        cable[j].approach = span[j].direction - plate.bend
        cable[j].passed += span[j].length


@kernel
def foretell(ahead, known):
    """Update the extrapolation `ahead` of angle changes from plate to plate; returns the number of differences known.

    In a load step the changes of the node angles are nearly a polynomial of the plate's number.  Rows 0 to 2 of `ahead`
    hold the change of the last plate and its first two differences, whose sum predicts the next change; row 3 holds
    the error of the last prediction.  Where that is more than half the error of the last change alone as a prediction
    (another segment begins), the differences start anew.
    """
    missed, without = 0.0, 0.0
    for k in range(ahead.shape[1]):
        missed += abs(ahead[3, k])
        without += abs(ahead[3, k] + ahead[1, k] + ahead[2, k])
    anew = known > 1 and missed > 0.5 * without
    for k in range(ahead.shape[1]):
        if anew:
            ahead[0, k] += ahead[1, k] + ahead[2, k] + ahead[3, k]
            ahead[1, k] = ahead[2, k] = 0.0
            continue
        if known > 1:
            ahead[2, k] += ahead[3, k]
            ahead[1, k] += ahead[2, k]
        elif known == 1:
            ahead[1, k] = ahead[3, k]
        ahead[0, k] += ahead[1, k] if known > 0 else ahead[3, k]
    return 1 if anew else known + 1


@kernel
def solve_plate(model, plate, span, cable, ahead):
    """Newton's method on one plate from its present node angles; returns the steps taken or `FAILED`.

    Adds the changes of the node angles to row 3 of `ahead`; row 4 is working space.
    """
    n, last, share = plate.q.shape[0], 0.0, 1.0
    for step in range(MAX_ITERATIONS):
        error = unbalance_plate(model, plate, span, cable)
        if error <= (TOLERANCE if step > 0 else AS_FORETOLD):
            return step
        if step >= CYCLING and not error < last and share > SHORTEST_SHARE:
            share /= 2  # take half of the last step back
            for k in range(n):
                plate.q[k] -= share * ahead[4, k]
                ahead[3, k] -= share * ahead[4, k]
            continue
        linearise_plate(model, plate, span)
        correct_plate(plate)
        last, share = error, 1.0
        for k in range(n):
            ahead[4, k] = min(max(-plate.residual[k], -MAX_STEP), MAX_STEP)
            plate.q[k] += ahead[4, k]
            ahead[3, k] += ahead[4, k]
    return FAILED


@kernel
def march(packed, tension, slip, work):
    """Solve plate after plate without dead loads, starting from the present node angles.

    Returns the largest number of Newton steps a plate took, or `FAILED`.
    """
    model, plates, spans, cable, ahead = packed.model[0], packed.plate, packed.span, packed.cable, work.ahead
    at_base(tension, slip, cable)
    for d in range(3):
        for k in range(ahead.shape[1]):
            ahead[d, k] = 0.0
    most, known = 0, 0
    for i in range(len(spans)):
        plate, after, span = plates[i], plates[i + 1], spans[i]
        plate.load[0], plate.load[1], plate.load[2] = 0.0, 0.0, 0.0
        for k in range(plate.q.shape[0]):
            plate.q[k] += ahead[0, k] + ahead[1, k] + ahead[2, k]
            ahead[3, k] = 0.0
        steps = solve_plate(model, plate, span, cable, ahead)
        if steps == FAILED:
            work.spent[0] += MAX_ITERATIONS
            return FAILED
        known = foretell(ahead, known)
        work.spent[0] += steps + 1
        most = max(most, steps)
        depart(plate, span, cable)
        next_frame(model, plate, after)
    return most
