r"""Load paths: every step starts from the one before, from rest on.

A step that fails, or that would turn a plate or a disk so far that another branch could be hit, is halved.
"""

from typing import Any, NamedTuple

import numpy as np

from prb3r.mechanics.cable import measure_span
from prb3r.mechanics.chain import Chain
from prb3r.mechanics.grip import balance_grip
from prb3r.mechanics.kernel import kernel
from prb3r.mechanics.march import FAILED, MAX_ITERATIONS, TOLERANCE, march
from prb3r.mechanics.newton import balance_chain, solve_block
from prb3r.mechanics.stability import lowest_of_plates, plate_moments
from prb3r.mechanics.tangent import chain_tangent
from prb3r.mechanics.trail import keep

PLATE_TURN = 0.35
"""Largest change of a plate's bend in one step, rad; a larger one is halved."""
DISK_TURN = 1.0
"""Largest change of a disk's angle in one step under dead loads, rad."""
SMALLEST_STEP = 1.0 / 4096
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


class Path(NamedTuple):
    """What :func:`follow` writes; see `Equilibria`."""

    status: np.ndarray
    residual: np.ndarray
    q: np.ndarray
    disk: np.ndarray
    tension: np.ndarray
    moment: np.ndarray
    slip: np.ndarray
    beyond: np.ndarray
    lowest: np.ndarray


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


class State(NamedTuple):
    """An accepted state of a chain, to come back to."""

    q: np.ndarray
    """(n, nodes) node angles."""
    handed: np.ndarray
    """(1 + m,) moment of the dead loads and cable lengths."""
    slip: np.ndarray
    """(n, m) slip at the holes, where friction follows the cables' travel."""
    beyond: np.ndarray
    """(n, m) cable length beyond the holes."""


def state(chain: Chain) -> State:
    shape = chain.offset.shape
    return State(np.zeros_like(chain.stiffness), np.zeros(1 + shape[1]), np.zeros(shape), np.zeros(shape))


@kernel
def save(packed, work, into):
    """Keep the present state."""
    for d in range(len(into.handed)):
        into.handed[d] = work.handed[d]
    for i in range(len(packed.span)):
        for k in range(into.q.shape[1]):
            into.q[i, k] = packed.plate[i].q[k]
        if packed.model[0].presliding != 0.0:
            for j in range(into.slip.shape[1]):
                into.slip[i, j], into.beyond[i, j] = packed.span[i, j].slip, packed.span[i, j].beyond


@kernel
def restore(packed, work, kept):
    """Come back to a kept state."""
    for d in range(len(kept.handed)):
        work.handed[d] = kept.handed[d]
    for i in range(len(packed.span)):
        for k in range(kept.q.shape[1]):
            packed.plate[i].q[k] = kept.q[i, k]
        if packed.model[0].presliding != 0.0:
            for j in range(kept.slip.shape[1]):
                hole = packed.span[i, j]
                hole.slip, hole.beyond, hole.new_slip = kept.slip[i, j], kept.beyond[i, j], kept.slip[i, j]
                hole.sticks = -1.0 < hole.slip < 1.0


@kernel
def settle(packed):
    """Take the slip and cable lengths of the state just found as accepted."""
    for i in range(len(packed.span)):
        for j in range(len(packed.cable)):
            packed.span[i, j].slip = packed.span[i, j].new_slip
            packed.span[i, j].beyond = packed.span[i, j].new_beyond


@kernel
def turned_too_far(packed, kept, loaded):
    """Whether a plate, or a disk under dead loads, has turned so far since `kept` that branches could be mixed up."""
    angle = 0.0
    for i in range(kept.q.shape[0]):
        turn = 0.0
        for k in range(kept.q.shape[1]):
            turn += packed.plate[i].q[k] - kept.q[i, k]
        angle += turn
        if not abs(turn) <= PLATE_TURN or (loaded and not abs(angle) <= DISK_TURN):
            return True
    return False


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
    if loaded:
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
    return march(packed, now.tension, now.slip, work)


@kernel
def ramp(packed, loads, last, s, loaded, modes, work, now, grip, kept):
    """Bring the chain from step `last`, its state in `kept`, to step `s`, halving steps that fail or go too far.

    Leaves the last accepted state in `kept` and returns Newton steps, or `FAILED` where the path leads no further.
    """
    done, step, iterations = 0.0, 1.0, 0
    while done < 1.0:
        if step < SMALLEST_STEP:
            return FAILED
        taken = attempt(packed, loads, last, s, done + step, loaded, modes, work, now, grip, kept, False)
        if taken == FAILED or turned_too_far(packed, kept, loaded):
            restore(packed, work, kept)
            step /= 2
            continue
        done += step
        iterations += taken
        save(packed, work, kept)
        step = min(2 * step, 1.0 - done)
    return iterations


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
def creep(packed, loads, last, s, loaded, modes, work, now, grip, kept, start, halfway, frames, trail):
    """As `ramp`, with friction that follows the cables' travel.

    Slip depends on the path, so a step is accepted only if two halves of it end where it ends, to `HISTORY_ERROR` of
    the length; the halves are kept, and noted in `trail`.  `start`, `halfway` and `frames` are working space.
    """
    done, step, iterations, straight = 0.0, FIRST_HISTORY_STEP, 0, 0.0
    for i in range(len(packed.span)):
        straight += packed.plate[i].arc + 2 * packed.plate[i].clamp + packed.model[0].disk
    save(packed, work, start)
    while done < 1.0:
        if step < SMALLEST_HISTORY_STEP:
            save(packed, work, kept)
            return FAILED
        careful = step < CAREFUL_STEP
        whole = attempt(packed, loads, last, s, done + step, loaded, modes, work, now, grip, start, careful)
        good = whole != FAILED and not turned_too_far(packed, start, loaded)
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
        save(packed, work, start)
        keep(trail, s, done - step / 2, halfway)
        keep(trail, s, done, start)
        step = min(2 * step if error <= HISTORY_ERROR * straight / 4 else step, LARGEST_HISTORY_STEP, 1.0 - done)
    save(packed, work, kept)
    return iterations


@kernel
def write_step(packed, s, path):
    """Keep the present state as step `s`."""
    plates, n = path.q.shape[1], path.q.shape[2]
    half, detail = packed.model[0].disk / 2, len(path.q) > 0
    largest = 0.0
    path.disk[s, 0, 0] = -half
    for i in range(plates):
        plate, frame = packed.plate[i], packed.plate[i + 1].frame
        for k in range(n):
            largest = max(largest, abs(plate.residual[k]))
        path.disk[s, i + 1, 0] = frame[0] - half * frame[3]
        path.disk[s, i + 1, 1] = frame[1] - half * frame[4]
        path.disk[s, i + 1, 2] = frame[2]
        if detail:
            for k in range(n):
                path.q[s, i, k] = plate.q[k]
            for j in range(path.tension.shape[2]):
                path.tension[s, i, j] = packed.span[i, j].tension
                if len(path.slip) > 0:
                    path.slip[s, i, j], path.beyond[s, i, j] = packed.span[i, j].slip, packed.span[i, j].beyond
    path.residual[s] = largest
    if detail:
        plate_moments(packed, path.moment[s])


@kernel
def come_to_rest(packed, onset, dead, modes, work, now, grip, kept):
    """Bring the chain from nothing to its rest (row 1 of `onset`), where no hole slips; whether that was possible."""
    presliding = packed.model[0].presliding
    packed.model[0].presliding = 0.0
    for i in range(len(packed.span)):
        for k in range(kept.q.shape[1]):
            packed.plate[i].q[k] = packed.plate[i].rest[k]
    save(packed, work, kept)
    taken = ramp(packed, onset, np.int64(0), np.int64(1), dead[0], modes, work, now, grip, kept)
    packed.model[0].presliding = presliding
    if presliding != 0.0:
        for j in range(len(packed.cable)):
            length = 0.0
            for i in range(len(packed.span) - 1, -1, -1):
                if packed.span[i, j].present:
                    measure_span(packed.model[0], packed.plate[i], packed.span[i, j])
                    length += packed.span[i, j].length
                hole = packed.span[i, j]
                hole.slip, hole.beyond, hole.new_slip, hole.sticks = 0.0, length, 0.0, True
            work.handed[1 + j] = length
        save(packed, work, kept)
    return taken != FAILED


@kernel
def follow(packed, onset, loads, dead, from_rest, modes, work, space, path):
    """Solve every load step of `loads` after row 0, which is rest, and write `path`.

    `from_rest` (s,) tells the steps that start from rest instead of from the step before.  `onset` has no load in
    row 0 and rest in row 1.  `dead` (s + 1,) tells the rows with dead loads.  `modes` (n, nodes, c) ties node angles
    together; None: they are free, and what ties them need not be compiled.  Where `path.lowest` is not empty the
    lowest eigenvalue is written where it is cheap: for free angles without dead loads or history.
    """
    eigenvalue = len(path.lowest) > 0
    history = packed.model[0].presliding != 0.0
    now, grip, kept, good, rest, start, halfway, frames, trail = space
    possible = come_to_rest(packed, onset, dead, modes, work, now, grip, rest)
    last: Any = np.int64(0)  # not a literal, for which everything would be compiled once more
    restore(packed, work, rest)
    save(packed, work, good)
    keep(trail, last, 1.0, rest)
    for s in range(1, len(loads.tension)):
        if from_rest[s - 1]:
            last = np.int64(0)
            restore(packed, work, rest)
            save(packed, work, good)
        else:
            restore(packed, work, good)
        save(packed, work, kept)
        loaded = dead[s] or dead[last]
        taken = FAILED
        if possible and history:
            taken = creep(packed, loads, last, s, loaded, modes, work, now, grip, kept, start, halfway, frames, trail)
        elif possible:
            taken = ramp(packed, loads, last, s, loaded, modes, work, now, grip, kept)
        path.status[s - 1, 0], path.status[s - 1, 1] = (FAILED if taken == FAILED else 0), max(taken, 0)
        if taken == FAILED:
            continue  # the next step goes on from the last good one
        last = s
        save(packed, work, good)
        write_step(packed, s - 1, path)
        if modes is not None:
            write_tied(packed, s - 1, work, path)
        elif eigenvalue and not loaded and not history:
            path.lowest[s - 1] = lowest_of_plates(packed)


@kernel
def write_tied(packed, s, work, path):
    """What differs for tied angles: moments are those of the shared curvature, the residual that of the modes."""
    path.residual[s] = 0.0
    for c in range(len(work.system)):
        path.residual[s] = max(path.residual[s], abs(work.system[c, len(work.system)]))
    if len(path.moment) == 0:
        return
    n = path.moment.shape[2] - 2
    for i in range(path.moment.shape[1]):
        for k in range(n):
            plate = packed.plate[i]
            path.moment[s, i, k + 1] = plate.stiffness[k] * (plate.q[k] - plate.rest[k])
        path.moment[s, i, 0], path.moment[s, i, n + 1] = path.moment[s, i, 1], path.moment[s, i, n]
