r"""The way to one load step where friction follows the cables' travel.

A sub-step of any length is exact as long as no hole that slips turns back within it (see `turning.py`), so sub-steps
are as long as that allows.  They are short at the beginning of a load step, as holes turn soon after the loads change
their course, and then grow; where a hole has turned back within a sub-step, a shorter one that ends before the turn
takes its place.
"""

from math import floor
from typing import Any

from prb3r.mechanics.accepted import keep_state
from prb3r.mechanics.attempt import JUMPED, put_on
from prb3r.mechanics.budget import GAVE_UP
from prb3r.mechanics.kernel import kernel
from prb3r.mechanics.march import FAILED
from prb3r.mechanics.newton import balance_chain, newton_march
from prb3r.mechanics.slip import clip
from prb3r.mechanics.state import restore, save, settle, slide, turned_too_far
from prb3r.mechanics.stick_slip import balance_stick_slip
from prb3r.mechanics.turning import missed_slide, missed_slip

SHORT_STEP = 1.0 / 64
"""First sub-step of a load step.  The rates at its end show which holes have turned with the loads and which slip on.
Sub-steps up to this one are not searched for holes that turn back: holes soon slip again, which ends that error."""
LONGEST_STEP = 1.0 / 2
"""Longest sub-step.  A hole that turns twice need not show in the rates at both ends of a sub-step; without this bound
errors are up to 5 times as large."""
GROWTH = 8.0
"""Ratio of successive sub-steps: 1/64, 1/8, 1/2 and the rest make a load step without turns."""
PARTS = 16
"""Parts of a sub-step in which a hole turned; the next try ends with the last whole part before the turn.  Derivatives
are those of the sub-steps taken, so the ends of these must not vary smoothly with parameters; all are sums of powers
of 2.  Where a small change of a parameter chooses another part, the path changes by its own error; with 8 parts that
is much more."""
TURN_ERROR = 0.004
"""Largest error of a slip that is accepted where a hole turns back within a sub-step."""
CAREFUL_STEP = 1.0 / 512
"""Sub-step below which, after longer ones failed, it is not guessed which holes stick: a wrong guess is the usual cause
of failure."""
JUMP_STEP = 1.0 / 4096
"""Sub-step up to which a disk that turns further than `JUMP_TURN` counts as jumping."""
JUMP_TURN = 0.005
"""Turn of a disk to which no continuous path leads in so short a sub-step, rad."""
SMALLEST_SUB_STEP = 1.0 / 2**26
"""Sub-step below which the path leads no further."""
CLOSE = 1e-7
"""Correction of the node angles, rad, with which Newton's method may end at a sub-step that does not end the load
step."""
SIDESTEP = 1.0 / 64
"""Part of a sub-step over which loads are differenced for the rates: what the solver leaves out of balance, divided by
it, is still far below `TURN_ERROR`."""


@kernel
def leapt(packed, start, step):
    """Whether a disk has turned further since `start` than any continuous path leads in a sub-step as short as `step`;
    see `JUMP_STEP`."""
    angle, most = 0.0, 0.0
    for i in range(start.q.shape[0]):
        for k in range(start.q.shape[1]):
            angle += packed.plate[i].q[k] - start.q[i, k]
        most = max(most, abs(angle))
    return step <= JUMP_STEP and most > JUMP_TURN


@kernel
def find_rates(packed, way, share, width, now, work, rates):
    """Write the rates of the state just found at `share` of the `way` to `rates`; the tensions in the records are lost.

    The state is in balance, so one Newton step under the loads that lie `width` before it leads to the state there;
    that step over `width` is the backward difference.
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
    """Move from an accepted state by `step` along its `rates`, to the first guess of the next state."""
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
    """Newton's method for the equilibrium at `share` of the `way`, from the present guess.

    Returns the steps taken or `FAILED`; `close` is that of `balance_chain`.
    """
    put_on(packed, way, share, now)
    return balance_chain(packed, now, close, work)


@kernel
def solve_sub_step(packed, way, share, careful, space, work):
    """Solve for the equilibrium at `share` of the `way`; returns the Newton steps taken or `FAILED`.

    Newton's method starts from the present guess.  If it fails, or if `careful`, `balance_stick_slip` starts from the
    state in `space.start`, without a guess which holes stick.
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
    """Bring the chain from its present state to the end of the `way`, with friction that follows the cables' travel.

    Returns what `ramp` returns, and leaves the same in `space.kept` and `space.reached`; accepted sub-steps are noted
    in `space.accepted`.  `loaded` tells whether dead loads act.
    """
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
                if packed.model[0].elements > 0:
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
        if packed.model[0].elements > 0:
            slide(packed)
        save(packed, work, start)
        copy_rates(after, before)
        done, iterations, careful = share, iterations + taken, False
        space.reached[0] = done
        keep_state(space.accepted, way.ends[1], done, start)
        step = min(growth * step, LONGEST_STEP, 1.0 - done)
    save(packed, work, space.kept)
    return iterations
