r"""Load paths where friction follows the cables' travel.

Slip depends on the path, so every step is also made in two halves, and shortened until both ways end alike.
"""

from typing import Any

import numpy as np

from prb3r.mechanics.attempt import JUMPED, attempt
from prb3r.mechanics.kernel import kernel
from prb3r.mechanics.march import FAILED
from prb3r.mechanics.state import restore, save, settle, turned_too_far
from prb3r.mechanics.trail import keep

HISTORY_JUMP = 0.005
"""Largest turn of a disk within a step too small for it, where friction follows the travel, rad."""
FIRST_HISTORY_STEP = 1.0 / 64
"""Where friction follows the travel, holes may turn back soon after the loads do: steps begin small and double."""
SMALLEST_HISTORY_STEP = 1.0 / 2**26
LARGEST_HISTORY_STEP = 1.0 / 4
TURN_ERROR = 0.003
"""Largest slip that may be missed where a hole turns back within a step."""
CAREFUL_STEP = 1.0 / 512
"""Step below which the holes that stick are not guessed: what makes a step so small is mostly such a guess."""
SMALLEST_TURN = 1.0 / 4096
"""Step below which that is no longer looked for: there it is a jump from one slip to another, with no way between."""
HISTORY_ERROR = 1e-6
"""Largest difference between one step and two halves of it where friction follows the travel, of the length."""


@kernel
def furthest(packed, frames):
    """Largest distance of a disk from where `frames` (n, 2) has it, m."""
    distance = 0.0
    for i in range(len(frames)):
        frame = packed.plate[i + 1].frame
        away = np.hypot(frame[0] - frames[i, 0], frame[1] - frames[i, 1])
        if not away <= distance:
            distance = away
    return distance


@kernel
def leapt(packed, start, step):
    """Whether a disk has turned further in a small step than any path leads it."""
    angle, most = 0.0, 0.0
    for i in range(start.q.shape[0]):
        for k in range(start.q.shape[1]):
            angle += packed.plate[i].q[k] - start.q[i, k]
        most = max(most, abs(angle))
    return step <= SMALLEST_TURN and most > HISTORY_JUMP


@kernel
def missed_turn(packed, start):
    """Largest slip that a hole would have made and unmade between `start` and now, unnoticed, halfway being settled.

    A parabola through the cable length beyond the hole at start, halfway and now tells whether it turned back between.
    """
    missed = 0.0
    for i in range(len(packed.span)):
        for j in range(len(packed.cable)):
            hole = packed.span[i, j]
            first, second = hole.beyond - start.beyond[i, j], hole.new_beyond - hole.beyond
            slope, bow = 3.0 * first - second, 2.0 * (second - first)
            if bow != 0.0 and 0.0 < -slope / (2.0 * bow) < 1.0:
                turn = -slope * slope / (4.0 * bow)
                missed = max(missed, min(abs(turn), abs(first + second - turn)))
    return missed / packed.model[0].presliding


@kernel
def creep(packed, loads, last, s, loaded, modes, work, now, grip, kept, reached, start, halfway, frames, trail):
    """As `ramp`, with friction that follows the cables' travel.

    Slip depends on the path, so a step is accepted only if two halves of it end where it ends, to `HISTORY_ERROR` of
    the length; the halves are kept, and noted in `trail`.  `start`, `halfway` and `frames` are working space.
    """
    done, step, iterations, straight = 0.0, FIRST_HISTORY_STEP, 0, 0.0
    for i in range(len(packed.span)):
        straight += packed.plate[i].arc + 2 * packed.plate[i].clamp + packed.model[0].disk
    save(packed, work, start)
    reached[0] = 0.0
    why: Any = FAILED
    while done < 1.0:
        if step < SMALLEST_HISTORY_STEP:
            save(packed, work, kept)
            return why
        careful = step < CAREFUL_STEP
        whole = attempt(packed, loads, last, s, done + step, loaded, modes, work, now, grip, start, careful)
        far = whole != FAILED and (turned_too_far(packed, start, loaded) or leapt(packed, start, step))
        good = whole != FAILED and not far
        why = JUMPED if far else FAILED
        for i in range(len(frames)):
            frames[i, 0], frames[i, 1] = packed.plate[i + 1].frame[0], packed.plate[i + 1].frame[1]
        restore(packed, work, start)
        first, second, error = 0, 0, 0.0
        if good:
            first = attempt(packed, loads, last, s, done + step / 2, loaded, modes, work, now, grip, start, careful)
            good = first != FAILED
        if good:
            settle(packed)
            save(packed, work, halfway)
            second = attempt(packed, loads, last, s, done + step, loaded, modes, work, now, grip, halfway, careful)
            error = furthest(packed, frames)
            good = second != FAILED and not turned_too_far(packed, start, loaded) and error <= HISTORY_ERROR * straight
            good = good and (step <= SMALLEST_TURN or missed_turn(packed, start) <= TURN_ERROR)
        if not good:
            restore(packed, work, start)
            step /= 2
            continue
        settle(packed)
        iterations += whole + first + second
        done += step
        reached[0] = done
        save(packed, work, start)
        keep(trail, s, done - step / 2, halfway)
        keep(trail, s, done, start)
        step = min(2 * step if error <= HISTORY_ERROR * straight / 4 else step, LARGEST_HISTORY_STEP, 1.0 - done)
    save(packed, work, kept)
    return iterations
