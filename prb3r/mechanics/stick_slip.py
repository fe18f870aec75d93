r"""Equilibrium where friction follows the cables' travel, without a guess which holes stick.

This is the fallback where the active set of `slip.py` goes round in circles.  The chain is balanced for given slips of
its holes, each an independent variable of one march from base to tip.  To first order the travel beyond the holes asks
for the slips

    asked = a + B (slip - slip now),    slip = clip(asked, -1, 1)

This linear complementarity problem in the slips alone is solved exactly (`complementarity.py`), and Newton's method
repeats it with the angles to which it leads (Josephy): no set of sticking holes is guessed, so none can cycle.
"""

from typing import NamedTuple

import numpy as np

from prb3r.mechanics.balance import balance_plate
from prb3r.mechanics.bundle import bundle
from prb3r.mechanics.complementarity import distinct, solve_from_afar, solve_near
from prb3r.mechanics.kernel import kernel
from prb3r.mechanics.march import (
    DIVERGED,
    FAILED,
    MAX_STEP,
    MOMENT_ROUNDING,
    TOLERANCE,
    at_base,
    depart,
    next_frame,
)
from prb3r.mechanics.newton import correct_columns, softest_node
from prb3r.mechanics.records import Packed
from prb3r.mechanics.slip import asked_slip, behind_pulley, slips_agree
from prb3r.mechanics.variation import Scratch, clear, enter, feel, local_load, scratch, shed, transmit

MAX_STEPS = 20
"""Most Newton steps; from a near state a handful is enough."""
COLUMNS_AS_A_PLATE, NUMBERS_AS_A_PLATE = 4, 32
"""What takes as long as one evaluation of a plate, some 60 ns: so many derivatives of a plate by slips, and so many
numbers of the complementarity table that is exchanged each time a hole begins or ceases to stick."""
LEEWAY = 1e-6
"""Least slip by which holes at their bounds are taken to be beyond them at first, a little more from hole to hole, so
that one hole changes at a time."""


@bundle
class StickSlip(NamedTuple):
    """Working space for `h` holes, counted plate by plate: all cables at the first plate, then at the next.

    Columns are those of the march: the present imbalance, the guessed moment of the dead loads, then each slip.
    """

    work: Scratch
    """Working space of the march, with 2 + h columns."""
    guess: np.ndarray
    """(2 + h,) change of the guessed moment of the dead loads that closes the chain in each column, N m."""
    travel: np.ndarray
    """(2 + h,) change of the cable length beyond a hole in each column, m."""
    value: np.ndarray
    """(h,) right side of the complementarity problem; this and the fields below are the arguments of `solve_near`."""
    rate: np.ndarray
    side: np.ndarray
    free: np.ndarray
    now: np.ndarray


def stick_slip_space(packed: Packed) -> StickSlip:
    """Working space for the chain of `packed`, whose holes are one for each cable at each plate."""
    holes = packed.span.size
    columns, of_holes = np.zeros(2 + holes), np.zeros(holes)
    return StickSlip(
        work=scratch(packed, 2 + holes),
        guess=columns,
        travel=columns.copy(),
        value=of_holes,
        rate=of_holes.copy(),
        side=of_holes.copy(),
        free=np.zeros(holes, bool),
        now=of_holes.copy(),
    )


@kernel
def stick_slip_march(packed, tension, force, tip, holes):
    """Evaluate the chain at its present slips, with derivatives by the slip of every hole.

    Leaves in `holes.work.column` the corrections of all node angles at the present slips (first column) and per unit
    of slip of every hole (from the third on).  Returns the largest unbalanced node angle (rad) and the moment of the
    dead loads left over at the tip (N m).
    """
    model, work, cable = packed.model[0], holes.work, packed.cable
    outer, change, column = work.outer, work.variation, work.column
    plates, n, columns = column.shape
    outer[0], outer[1], outer[2] = tip[0], tip[1], work.handed[0]
    for i in range(plates):
        outer[0] += force[i, 0]
        outer[1] += force[i, 1]
    at_base(tension, tension, cable)
    clear(change)
    change.moment[1] = 1.0
    largest = 0.0
    for i in range(plates):
        for j in range(len(cable)):
            cable[j].slip, cable[j].owed = packed.span[i, j].new_slip, 0.0
            if i == 0 and cable[j].pulley != 0.0:
                cable[j].tension = behind_pulley(tension[j], cable[j].slip, cable[j].pulley)
                change.log_tension[j, 2 + j] = -cable[j].pulley
        plate, after, span = packed.plate[i], packed.plate[i + 1], packed.span[i]
        local_load(plate, outer)
        error = balance_plate(model, plate, span, cable)
        if not error <= largest:
            largest = error
        enter(cable, span, change)
        for j in range(len(cable)):
            if span[j].tension != 0.0:
                change.log_tension[j, 2 + i * len(cable) + j] += span[j].wrap
        feel(plate, span, outer, change, work.block, n)
        correct_columns(plate, work.block, column[i])
        transmit(model, plate, span, column[i], change)
        depart(plate, span, cable)
        next_frame(model, plate, after)
        shed(packed, i, force, tip, outer, change)
    for d in range(columns):
        guess = 0.0 if d == 1 else -(change.moment[d] + (outer[2] if d == 0 else 0.0)) / change.moment[1]
        holes.guess[d] = guess
        if guess != 0.0:
            for i in range(plates):
                for k in range(n):
                    column[i, k, d] += column[i, k, 1] * guess
    return largest, outer[2]


@kernel
def linearise_slips(packed, holes):
    """Linearise the slips that the travel asks for, at the corrected node angles, by the slips of all holes.

    Leaves the complementarity problem ``M x + w = c`` of the slips in `holes`: ``M = 1 - B`` in `work.system`, `c` in
    `value`, and the present state of every hole in `side`, `free` and `now`.
    """
    work, value, travel = holes.work, holes.value, holes.travel
    plates, n, columns = work.column.shape
    cables, presliding = len(packed.cable), packed.model[0].presliding
    for j in range(cables):
        length = 0.0
        for d in range(columns):
            travel[d] = 0.0
        for back in range(plates):
            i = plates - 1 - back
            hole, row = packed.span[i, j], (plates - 1 - back) * cables + j
            if not hole.present:
                value[row], holes.side[row], holes.free[row], holes.now[row] = (
                    2.0,
                    1.0,
                    False,
                    1.0,
                )  # stays at its bound
                for h in range(columns - 2):
                    work.system[row, h] = 0.0
                work.system[row, row] = 1.0
                continue
            length += hole.length
            for k in range(n):
                for d in range(columns):
                    travel[d] += hole.dlength[k] * work.column[i, k, d]
            hole.new_beyond = length
            asked = asked_slip(hole, length + travel[0], presliding)
            holes.free[row] = hole.sticks
            holes.side[row] = 1.0 if (asked if hole.sticks else hole.new_slip) > 0.0 else -1.0
            holes.now[row] = hole.new_slip
            if not hole.sticks:
                over = holes.side[row] * asked_slip(hole, length, presliding) - 1.0
                holes.now[row] = holes.side[row] * max(over, LEEWAY * distinct(row))
            for h in range(columns - 2):
                follows = travel[2 + h] / presliding
                asked -= follows * packed.span[h // cables, h % cables].new_slip
                work.system[row, h] = -follows
            work.system[row, row] += 1.0
            value[row] = asked
        work.handed[1 + j] = length


@kernel
def take_step(packed, holes):
    """Go to the angles and slips that solve the linearised problem, or a part of the way if an angle would change by
    more than `MAX_STEP`; returns whether the step is finite and of a sensible size."""
    work, plates = holes.work, packed.plate
    count, n, columns = work.column.shape
    cables = len(packed.cable)
    longest, moment = 0.0, holes.guess[0]
    for h in range(columns - 2):
        hole = packed.span[h // cables, h % cables]
        if hole.present:
            change = (holes.now[h] if holes.free[h] else holes.side[h]) - hole.new_slip
            holes.now[h] = change
            moment += holes.guess[2 + h] * change
            if change != 0.0:
                for i in range(count):
                    for k in range(n):
                        work.column[i, k, 0] += work.column[i, k, 2 + h] * change
    for i in range(count):
        for k in range(n):
            if not abs(work.column[i, k, 0]) <= longest:
                longest = abs(work.column[i, k, 0])
    if not longest < DIVERGED:
        return False
    share = min(1.0, MAX_STEP / longest) if longest > 0.0 else 1.0
    for h in range(columns - 2):
        hole = packed.span[h // cables, h % cables]
        if hole.present:
            hole.sticks = holes.free[h]
            hole.new_slip += share * holes.now[h]
            if share == 1.0 and not hole.sticks:
                hole.new_slip = holes.side[h]
    work.handed[0] += share * moment
    for i in range(count):
        for k in range(n):
            plates[i].q[k] += share * work.column[i, k, 0]
    return True


@kernel
def balance_stick_slip(packed, loads, handed, allowed, holes):
    """Newton's method on all angles and slips under the `loads` of one state, from their present values.

    Returns the steps taken or `FAILED`.  The work is added to `holes.work.spent`; the solve fails before that exceeds
    `allowed`.  `handed` is that of :class:`Scratch`: its moment is the first guess, and the solved values replace it.
    """
    work, softest, count = holes.work, softest_node(packed), len(holes.now)
    exchange = count * count // NUMBERS_AS_A_PLATE
    effort = len(packed.span) * (1 + count // COLUMNS_AS_A_PLATE) + count * exchange
    work.handed[0] = handed[0]
    for step in range(MAX_STEPS):
        if work.spent[0] + effort > allowed:
            return FAILED
        work.spent[0] += effort
        largest, left = stick_slip_march(packed, loads.tension, loads.force, loads.tip, holes)
        linearise_slips(packed, holes)
        balanced = largest <= TOLERANCE and abs(left) <= TOLERANCE * softest + MOMENT_ROUNDING * abs(work.handed[0])
        if balanced and slips_agree(packed):
            for d in range(len(handed)):
                handed[d] = work.handed[d]
            return step
        if not largest < DIVERGED:
            return FAILED
        sets = solve_near(work.system, holes.value, holes.rate, holes.side, holes.free, holes.now)
        work.spent[0] += abs(sets) * exchange
        if sets < 0:
            linearise_slips(packed, holes)
            sets = solve_from_afar(work.system, holes.value, holes.rate, holes.side, holes.free, holes.now)
            work.spent[0] += abs(sets) * exchange
            if sets < 0:
                return FAILED
        if not take_step(packed, holes):
            return FAILED
    return FAILED
