r"""Equilibrium of the whole chain at once, in O(plates) per Newton step.

Plates nearer to the tip act on those nearer to the base through a few scalars `g` only: the total moment of the dead
loads about the world origin and, where friction follows the cables' travel, the length of each cable.  These are
guessed.  A full Newton step on all angles is therefore one march from base to tip: every plate's correction is found
as ``dq = dq_0 + sum_k dq_k dg_k``, linear in the corrections of the guesses, and the guesses are corrected at the tip,
where no moment may remain and each length must be the sum of the spans passed.
"""

from math import inf

from prb3r.mechanics.balance import balance_plate
from prb3r.mechanics.elimination import solve_block
from prb3r.mechanics.kernel import kernel
from prb3r.mechanics.march import (
    CYCLING,
    DIVERGED,
    FAILED,
    MAX_ITERATIONS,
    MAX_STEP,
    MOMENT_ROUNDING,
    TOLERANCE,
    at_base,
    depart,
    next_frame,
)
from prb3r.mechanics.slip import pull_through_pulleys, slip_at, slip_on, slips_agree
from prb3r.mechanics.variation import clear, enter, feel, local_load, shed, transmit

LENGTH_TOLERANCE = 1e-13
"""Largest error of a cable's length, over the length plus 1 m; small against every presliding length."""
SLOWEST = 0.8
"""Factor by which the largest correction must fall per Newton step from step `CYCLING` on, averaged over twelve steps
and more, or the solve is given up; halved steps come to 0.5.  Of 1,600 load steps of random chains with kinks and a tip
load the same 1,398 converge without this test."""
MAX_EXCHANGES = 24
"""Most Newton steps where slip follows the travel: where holes still change between sticking and slipping after these,
they go round in circles."""


@kernel
def correct_columns(plate, block, column):
    """Write the corrections of a plate's node angles to `column` (n, c), one column per independent variable.

    `block` holds the variations of the residual from its column n on; the residual itself is added to the first.
    Returns the sign of the determinant of the plate's tangent.
    """
    n, columns = column.shape
    for k in range(n):
        for p in range(n):
            block[k, p] = plate.tangent[k, p]
        block[k, n] += plate.residual[k]
    sign = solve_block(block, n, n + columns)
    for k in range(n):
        for d in range(columns):
            column[k, d] = -block[k, n + d]
    return sign


@kernel
def softest_node(packed):
    """Smallest stiffness of a node, N m/rad: the scale of moments, as hinges for rigid clamps may be stiff at will."""
    softest = inf
    for i in range(len(packed.span)):
        for k in range(packed.plate[i].stiffness.shape[0]):
            softest = min(softest, packed.plate[i].stiffness[k])
    return softest


@kernel
def newton_march(packed, loads, work):
    """Evaluate the whole chain under the `loads` of one state, and find the full Newton step from there.

    `work.handed` holds the guesses: the moment of the dead loads about the world origin and, where friction follows
    the cables' travel, the cable lengths.  Leaves the corrections of all node angles in the first column of
    `work.column`, and those of the guesses in the last column of `work.system`.  Returns the largest unbalanced node
    angle (rad), the moment left over at the tip (N m) and the largest error of a length as `close_guesses` has it.
    """
    model, cable, outer, change, block = packed.model[0], packed.cable, work.outer, work.variation, work.block
    force, tip = loads.force, loads.tip
    plates, n, columns = work.column.shape
    work.spent[0] += plates
    follows = model.presliding != 0.0
    outer[0], outer[1], outer[2] = tip[0], tip[1], work.handed[0]
    for i in range(plates):
        outer[0] += force[i, 0]
        outer[1] += force[i, 1]
    at_base(loads.tension, loads.slip, cable)
    clear(change)
    change.moment[1] = 1.0
    for j in range(len(cable)):
        for d in range(columns):
            change.total[j, d] = 0.0
    for j in range(columns - 2):  # at rest lengths are found too, though no slip follows them yet
        cable[j].length = work.handed[1 + j]
        change.total[j, 2 + j] = 1.0
    largest, work.sign[0] = 0.0, 1.0
    for i in range(plates):
        plate, after, span, column = packed.plate[i], packed.plate[i + 1], packed.span[i], work.column[i]
        local_load(plate, outer)
        if follows:
            slip_at(model, span, cable)
            if i == 0:
                pull_through_pulleys(loads.tension, cable, change)
        error = balance_plate(model, plate, span, cable)
        if not error <= largest:
            largest = error
        enter(cable, span, change)
        feel(plate, span, outer, change, block, n)
        work.sign[0] *= correct_columns(plate, block, column)
        transmit(model, plate, span, column, change)
        depart(plate, span, cable)
        next_frame(model, plate, after)
        shed(packed, i, force, tip, outer, change)
    return largest, outer[2], close_guesses(cable, change, outer[2], work)


@kernel
def close_guesses(cable, change, moment_left, work):
    """Find the Newton step of the guesses, so that no moment is left beyond the tip and each cable length is the sum of
    its spans, and add what it does to the node angles to their corrections.

    Returns the largest error of a cable length, over the length plus 1 m.
    """
    columns, system = len(change.moment), work.system
    count, worst = columns - 1, 0.0
    for d in range(count):
        system[0, d] = change.moment[1 + d]
    system[0, count] = -(moment_left + change.moment[0])
    for j in range(count - 1):
        error = cable[j].passed - work.handed[1 + j]
        if not abs(error) <= worst * (1.0 + cable[j].passed):
            worst = abs(error) / (1.0 + cable[j].passed)
        for d in range(count):
            system[1 + j, d] = change.passed[j, 1 + d] - change.total[j, 1 + d]
        system[1 + j, count] = -(error + change.passed[j, 0])
    work.sign[0] *= solve_block(system, count, count + 1)
    for i in range(work.column.shape[0]):
        for k in range(work.column.shape[1]):
            for d in range(count):
                work.column[i, k, 0] += work.column[i, k, 1 + d] * system[d, count]
    return worst


@kernel
def foresee(plates, work):
    """Write the angles (rad) of all disks to which the full Newton step leads to `work.foreseen`."""
    angle = 0.0
    for i in range(len(work.foreseen)):
        for k in range(work.column.shape[1]):
            angle += plates[i].q[k] + work.column[i, k, 0]
        work.foreseen[i] = angle


@kernel
def leads_nowhere(step, left, at_first):
    """Whether the largest correction has fallen so little, from `at_first` at step `CYCLING` to `left` at `step`, that
    Newton's method will not converge; see `SLOWEST`."""
    return step > 2 * CYCLING and left > at_first * SLOWEST ** (step - CYCLING)


@kernel
def balance_chain(packed, loads, close, work):
    """Newton's method on all angles and on the guesses of `newton_march`, from their present values.

    Returns the steps taken, or `FAILED`.  `loads` are those of one state.  The solve also ends after a correction of no
    node angle by more than `close` (rad): Newton's method squares the error, so what is left is far below `TOLERANCE`.
    Residuals, tensions and frames are then those before that correction.
    """
    plates, column, handed = packed.plate, work.column, work.handed
    n, count, softest = column.shape[1], column.shape[2] - 1, softest_node(packed)
    follows, settled, first = packed.model[0].presliding != 0.0, True, 0.0
    for step in range(MAX_EXCHANGES if follows else MAX_ITERATIONS):
        largest, left, length_error = newton_march(packed, loads, work)
        if (
            settled
            and largest <= TOLERANCE
            and abs(left) <= TOLERANCE * softest + MOMENT_ROUNDING * abs(handed[0])
            and length_error <= LENGTH_TOLERANCE
            and (not follows or slips_agree(packed))
        ):
            return step
        longest = 0.0
        for i in range(len(column)):
            for k in range(n):
                if not abs(column[i, k, 0]) <= longest:
                    longest = abs(column[i, k, 0])
        if not longest < DIVERGED:
            return FAILED
        if step == CYCLING:
            first = longest
        elif not follows and leads_nowhere(step, longest, first):
            return FAILED
        if step == 0:
            foresee(plates, work)
        damping = 1.0 if longest <= MAX_STEP else MAX_STEP / longest
        if step >= CYCLING and not (follows and settled):
            damping *= 0.5
        if follows:
            settled = not slip_on(packed, work, damping)
        for d in range(count):
            handed[d] += damping * work.system[d, count]
        for i in range(len(column)):
            for k in range(n):
                plates[i].q[k] += damping * column[i, k, 0]
        if settled and damping == 1.0 and longest <= close and length_error <= close:
            return step + 1
    return FAILED
