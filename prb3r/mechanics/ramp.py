"""The way to one load step where slip is declared: in sub-steps, as far as the branch of equilibria leads.

A sub-step that fails is halved, and so is one that may have led to another branch.
"""

from typing import Any

from prb3r.mechanics.accepted import keep_state
from prb3r.mechanics.attempt import JUMPED, attempt
from prb3r.mechanics.budget import GAVE_UP
from prb3r.mechanics.kernel import kernel
from prb3r.mechanics.march import FAILED
from prb3r.mechanics.state import restore, save, slide, turned_by_surprise, turned_midway, turned_too_far

SHORTEST_WAY = 1.0 / 64
"""Part of a way from which on the smallest sub-step is a share of what has been covered; before, it is a share of
this."""
SMALLEST_CROSSING = 1.0 / 1024
"""Sub-step up to which the determinant of the tangent may change its sign: then the branch itself loses its stability;
in a longer one the solver may have changed to another branch."""
NOWHERE = 2.0
"""Stands for the place where Newton's method failed, as a part of the way, while it has not failed yet."""
TRIED_AGAIN = 4
"""Sub-steps, each half of the way to the place where Newton's method failed, after which that place is tried again: the
method may have failed for coming from too far.  Looking for ends was four fifths of the work of a diagnosis whose fits
met many; with a trial after every sub-step, as it was, it takes twice as much."""

HALF_STEP = 1.0 / 2
"""Sub-steps in which a load step is tried where plates have hysteresis but slip at holes is declared.  Hysteresis is
exact over a sub-step of any length as long as no node that slips turns back within it."""
SLIDING_STEP = 1.0 / 8
"""Longest sub-step where halves fail or a node may have turned back (`turned_midway`): the error of the turn falls with
the square of the sub-step."""


@kernel
def ramp(packed, way, loaded, modes, space, work):
    """Bring the chain from the state `space.kept` to the end of the `way`, halving sub-steps that fail or turn too far.

    `space.good` holds the same state.  Leaves the last accepted state in `space.kept` and its part of the way in
    `space.reached`.  Returns the Newton steps of all accepted sub-steps; `FAILED` or `JUMPED` where the path leads no
    further; `GAVE_UP` where the work that it may take is used up.
    """
    kept, reached, slides = space.kept, space.reached, packed.model[0].elements > 0
    longest = HALF_STEP if slides else 1.0
    done, step, iterations, noted = 0.0, longest, 0, space.accepted.noted[0]
    beyond, closer = NOWHERE, 0  # nearest part of the way where Newton failed, and sub-steps taken toward it since
    reached[0] = 0.0
    why: Any = FAILED
    while done < 1.0:
        if step < space.smallest[0] * max(done, SHORTEST_WAY):
            return why
        if work.spent[0] > space.allowed[0]:
            return GAVE_UP
        taken = attempt(packed, way, done + step, loaded, modes, space.now, work)
        far = taken != FAILED and turned_too_far(packed, kept, loaded)
        if taken != FAILED and not far and loaded and modes is None:
            crossed = work.sign[0] != kept.sign[0] and step > SMALLEST_CROSSING
            # a spring right at its bound may slip on or turn back, so with sliders Newton's first step predicts nothing
            far = crossed or (not slides and turned_by_surprise(packed, kept, work))
        if longest == HALF_STEP and (taken == FAILED or far or (done > 0 and turned_midway(packed, kept, space.good))):
            restore(packed, work, space.good)
            save(packed, work, kept)
            space.accepted.noted[0] = noted
            reached[0], done, step, longest, iterations = 0.0, 0.0, SLIDING_STEP, SLIDING_STEP, 0
            continue
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
        if slides or packed.model[0].relaxation != 0.0:
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
