"""The way to one load step: as far as the branch leads, in parts of the step that are halved where they fail.

A part after which another branch could be mixed up with the one that is followed is halved too.
"""

from typing import Any

from prb3r.mechanics.accepted import keep_state
from prb3r.mechanics.attempt import JUMPED, attempt
from prb3r.mechanics.budget import GAVE_UP
from prb3r.mechanics.kernel import kernel
from prb3r.mechanics.march import FAILED
from prb3r.mechanics.state import restore, save, slide, turned_by_surprise, turned_too_far

SMALLEST_CROSSING = 1.0 / 1024
"""Step below which the determinant of the tangent may change its sign: the branch itself loses its stability there."""
NOWHERE = 2.0
"""Part of the way where nothing has failed yet."""
TRIED_AGAIN = 4
"""Where Newton's method has failed it is tried again after so many steps that each went half of the way there: it may
have failed for coming from too far.  Looking for ends was four fifths of the work of a diagnosis whose fits met
many; where it is tried again after each step, as it was, it takes twice as much."""

SLIDING_STEP = 1.0 / 8
"""Longest part of a load step where plates remember but slip at holes is declared.  Over a sub-step of any length what
slips is exact as long as no node that slips turns back within it; of one that does, what is missed falls with the
square of this."""


@kernel
def ramp(packed, way, loaded, modes, space, work):
    """Bring the chain to the end of the `way`, halving steps that fail or go too far.

    Its state is in `space.kept`.  Leaves the last accepted state there, the part of the way to it in `space.reached`,
    and returns Newton steps, or `FAILED` or `JUMPED` where the path leads no further, `GAVE_UP` where the
    work that it may take is done.
    """
    kept, reached, slides = space.kept, space.reached, packed.model[0].elements > 0
    longest = SLIDING_STEP if slides else 1.0
    done, step, iterations = 0.0, longest, 0
    beyond, closer = NOWHERE, 0  # part of the way that was not reached from `done` or before, and steps toward it since
    reached[0] = 0.0
    why: Any = FAILED
    while done < 1.0:
        if step < space.smallest[0] * max(done, 1.0 / 64):
            return why
        if work.spent[0] > space.allowed[0]:
            return GAVE_UP
        taken = attempt(packed, way, done + step, loaded, modes, space.now, work)
        far = taken != FAILED and turned_too_far(packed, kept, loaded)
        if taken != FAILED and not far and loaded and modes is None:
            crossed = work.sign[0] != kept.sign[0] and step > SMALLEST_CROSSING
            # at first a spring right at its bound may slip on or follow: what Newton's first step foresees is not told
            far = crossed or (not slides and turned_by_surprise(packed, kept, work))
        if taken == FAILED or far:
            why = FAILED if taken == FAILED else JUMPED
            if taken == FAILED and done + step < beyond:
                beyond, closer = done + step, 0
            restore(packed, work, kept)
            step /= 2
            continue
        done += step
        reached[0] = done
        iterations += taken
        if slides:
            slide(packed)
        save(packed, work, kept)
        if slides:
            keep_state(space.accepted, way.ends[1], done, kept)
        if done >= beyond:
            beyond = NOWHERE
        closer += 1
        if beyond < NOWHERE:
            step = beyond - done if closer % TRIED_AGAIN == 0 else (beyond - done) / 2
        else:
            step *= 2
        step = min(step, longest, 1.0 - done)
    return iterations
