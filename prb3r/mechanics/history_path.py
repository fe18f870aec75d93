r"""Load paths where friction follows the cables' travel.

A sub-step of any length is exact as long as no hole that slips turns back within it (see `turning.py`).  So steps are
as long as that allows: short where the loads have changed their course, as holes turn soon after they do, then growing;
where a hole has turned back on the way, another one ends shortly before it did.
"""

from math import floor
from typing import Any

from prb3r.mechanics.accepted import keep_state
from prb3r.mechanics.attempt import JUMPED, put_on
from prb3r.mechanics.budget import GAVE_UP
from prb3r.mechanics.kernel import kernel
from prb3r.mechanics.march import FAILED
from prb3r.mechanics.newton import balance_chain, newton_march
from prb3r.mechanics.state import restore, save, settle, slide, turned_too_far
from prb3r.mechanics.stick_slip import balance_stick_slip
from prb3r.mechanics.turning import clip, missed_slide, missed_slip

SHORT_STEP = 1.0 / 64
"""First sub-step of a load step.  The rates at its end show which holes have turned with the loads and which slip on;
steps as short as this are not searched for holes that turn back, as then the error is soon slipped away again."""
LONGEST_STEP = 1.0 / 2
"""A hole that turns twice need not show in rates at both ends; without this bound errors are up to 5 times as large."""
GROWTH = 8.0
"""Of sub-steps: 1/64, 1/8, 1/2 and the rest make a load step without turns."""
PARTS = 16
"""Of a step in which a hole turned: the next one ends with the last of these before the turn.  Derivatives are those of
the sub-steps taken, so where these end must not follow the parameters smoothly; all are sums of powers of 2.  Where a
small change of a parameter chooses another part, the path changes by its own error; with 8 parts that is much more."""
TURN_ERROR = 0.004
"""Largest slip that may be missed where a hole turns back within a step."""
CAREFUL_STEP = 1.0 / 512
"""Step below which the holes that stick are not guessed where longer ones failed: it is mostly such a guess."""
JUMP_STEP = 1.0 / 4096
"""Step below which a disk that turns further than `JUMP_TURN` jumps."""
JUMP_TURN = 0.005
"""Turn of a disk that no path leads to in so short a step, rad."""
SMALLEST_SUB_STEP = 1.0 / 2**26
"""Step below which the path leads no further."""
CLOSE = 1e-7
"""Newton step of the node angles that may be the last of a sub-step within a load step, rad."""
SIDESTEP = 1.0 / 64
"""Part of a step over which loads are differenced for the rates: what the solver leaves out of balance, divided by
this, is far below `TURN_ERROR` still."""


@kernel
def leapt(packed, start, step):
    """Whether a disk has turned further in a small step than any path leads it."""
    angle, most = 0.0, 0.0
    for i in range(start.q.shape[0]):
        for k in range(start.q.shape[1]):
            angle += packed.plate[i].q[k] - start.q[i, k]
        most = max(most, abs(angle))
    return step <= JUMP_STEP and most > JUMP_TURN


@kernel
def find_rates(packed, way, share, width, now, work, rates):
    """Write the rates at the state just found, `share` of the `way`, to `rates`; its tensions are lost.

    The state is in balance, so under the loads `width` before it a Newton step leads to the state there.
    """
    put_on(packed, way, share - width, now)
    newton_march(packed, now, work)
    count = work.column.shape[2] - 1
    for d in range(count):
        rates.handed[d] = -work.system[d, count] / width
    for j in range(len(packed.cable)):
        left = rates.handed[1 + j]
        for i in range(len(packed.span)):
            rates.beyond[i, j] = left
            if packed.span[i, j].present:
                for k in range(work.column.shape[1]):
                    left += packed.span[i, j].dlength[k] * work.column[i, k, 0] / width
    for i in range(len(packed.span)):
        for k in range(work.column.shape[1]):
            rates.q[i, k] = -work.column[i, k, 0] / width


@kernel
def predict(packed, step, rates, work):
    """Go from an accepted state along its tangent to where the next one is looked for."""
    for d in range(len(rates.handed)):
        work.handed[d] += step * rates.handed[d]
    for i in range(len(packed.span)):
        for k in range(rates.q.shape[1]):
            packed.plate[i].q[k] += step * rates.q[i, k]
        for j in range(len(packed.cable)):
            hole = packed.span[i, j]
            if not hole.present:
                continue
            slip = hole.slip + step * rates.beyond[i, j] / packed.model[0].presliding
            hole.new_slip, hole.sticks = clip(slip), -1.0 < slip < 1.0


@kernel
def newton(packed, way, share, close, now, work):
    """Equilibrium `share` of the `way` from the present guess; steps taken or `FAILED`; `close`: `balance_chain`."""
    put_on(packed, way, share, now)
    return balance_chain(packed, now, close, work)


@kernel
def solve_sub_step(packed, way, share, careful, space, work):
    """Equilibrium `share` of the `way`, from the present guess; Newton steps taken or `FAILED`.

    Where that fails or `careful`, from the state in `space.start` without guessing which holes stick.
    """
    taken: Any = FAILED
    if not careful:
        taken = newton(packed, way, share, CLOSE, space.now, work)
    if taken == FAILED:
        restore(packed, work, space.start)
        put_on(packed, way, share, space.now)
        space.holes.work.spent[0] = work.spent[0]
        taken = balance_stick_slip(packed, space.now, work.handed, space.allowed[0], space.holes)
        work.spent[0] = space.holes.work.spent[0]
    return taken


@kernel
def copy_rates(source, into):
    """Copy the rates of a state along its load step from `source` into the arrays of `into`."""
    for d in range(len(into.handed)):
        into.handed[d] = source.handed[d]
    for i in range(len(into.q)):
        for k in range(into.q.shape[1]):
            into.q[i, k] = source.q[i, k]
        for j in range(into.beyond.shape[1]):
            into.beyond[i, j] = source.beyond[i, j]


@kernel
def ramp_with_history(packed, way, loaded, space, work):
    """As `ramp`, with friction that follows the cables' travel; accepted sub-steps are noted in `space.accepted`."""
    start, before, after = space.start, space.before, space.after
    done, step, growth, iterations, careful = 0.0, SHORT_STEP, GROWTH, 0, False
    save(packed, work, start)
    space.reached[0] = 0.0
    why: Any = FAILED
    while done < 1.0:
        if step < SMALLEST_SUB_STEP or work.spent[0] > space.allowed[0]:
            save(packed, work, space.kept)
            return why if step < SMALLEST_SUB_STEP else GAVE_UP
        if done > 0.0 and not careful:
            predict(packed, step, before, work)
        share, missed, where = done + step, 0.0, 1.0
        taken = solve_sub_step(packed, way, share, careful, space, work)
        good, why = taken != FAILED, FAILED
        if good and (turned_too_far(packed, start, loaded) or leapt(packed, start, step)):
            good, why = False, JUMPED
        if good:
            find_rates(packed, way, share, SIDESTEP * step, space.now, work, after)
            if step > SHORT_STEP:
                missed, where = missed_slip(packed, step, before, after)
                if packed.plate[0].slider.shape[1] > 0:
                    slide_missed, slide_where = missed_slide(packed, step, start, before, after)
                    if slide_missed > missed:
                        missed, where = slide_missed, slide_where
        if good and missed <= TURN_ERROR and share == 1.0:
            final = newton(packed, way, share, 0.0, space.now, work)
            good, taken = final != FAILED, taken + final
        if not good or missed > TURN_ERROR:
            restore(packed, work, start)
            if good:
                step *= min(max(floor(PARTS * where), 1.0), PARTS - 1.0) / PARTS
            else:
                step, growth = step / 2, 2.0
                careful = step < CAREFUL_STEP
            continue
        settle(packed)
        if packed.plate[0].slider.shape[1] > 0:
            slide(packed)
        save(packed, work, start)
        copy_rates(after, before)
        done, iterations, careful = share, iterations + taken, False
        space.reached[0] = done
        keep_state(space.accepted, way.ends[1], done, start)
        step = min(growth * step, LONGEST_STEP, 1.0 - done)
    save(packed, work, space.kept)
    return iterations
