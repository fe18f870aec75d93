"""Load paths: every step starts from the one before, from rest on."""

from typing import Any, NamedTuple

import numpy as np

from prb3r.mechanics.accepted import AcceptedStates, keep_state
from prb3r.mechanics.attempt import Way, attempt
from prb3r.mechanics.budget import GAVE_UP, Allowance, usual_allowance
from prb3r.mechanics.bundle import bundle
from prb3r.mechanics.cable import measure_span
from prb3r.mechanics.chain import Chain, Loads
from prb3r.mechanics.history_path import ramp_with_history
from prb3r.mechanics.kernel import entrance, kernel
from prb3r.mechanics.load_row import LoadRow, load_row
from prb3r.mechanics.march import FAILED
from prb3r.mechanics.path_output import write_end, write_step, write_tied
from prb3r.mechanics.ramp import ramp
from prb3r.mechanics.records import Packed
from prb3r.mechanics.same_way import times_as_far
from prb3r.mechanics.stability import write_lowest
from prb3r.mechanics.state import Rates, State, rates, restore, save, state
from prb3r.mechanics.stick_slip import StickSlip, stick_slip_space

SMALLEST_STEP = 1.0 / 2**20
"""Where a path ends is found to this part of what has been reached of the load step, unless less is asked."""


@bundle
class PathSpace(NamedTuple):
    """Working space of :func:`follow`."""

    now: LoadRow
    """Loads of the state that is solved."""
    reached: np.ndarray
    """(1,) part of the way to the last accepted state."""
    kept: State
    """The last accepted state on the way to a step, from its beginning on."""
    good: State
    """The state of the last solved step."""
    rest: State
    smallest: np.ndarray
    """(1,) part of what is reached of a load step, or of the step where that is more, below which the path ends."""
    accepted: AcceptedStates
    """Sub-steps where plates remember."""
    allowed: np.ndarray
    """(1,) work that the sequence may have taken up to the end of the present step; see `Scratch.spent`."""
    allowance: np.ndarray
    """(2,) by which it grows: :class:`Allowance`."""


@bundle
class Program(NamedTuple):
    """The load steps that a path goes through."""

    onset: Way
    """From no load, in its row 0, to rest, in row 1."""
    way: Way
    """Its `rows` hold rest and then each step."""
    dead: np.ndarray
    """(s + 1,) which rows have dead loads."""
    from_rest: np.ndarray
    """(s,) which steps start from rest instead of from the step before."""
    done: np.ndarray
    """(s,) which steps are solved already; no other goes on from them."""


@bundle
class HistorySpace(NamedTuple):
    """Working space where friction follows the travel."""

    now: LoadRow
    reached: np.ndarray
    kept: State
    holes: StickSlip
    start: State
    """The state from which a sub-step is made."""
    before: Rates
    """Rates there."""
    after: Rates
    """Rates where the sub-step ends."""
    accepted: AcceptedStates
    allowed: np.ndarray


def path_space(
    chain: Chain,
    rows: Loads,
    accepted: AcceptedStates,
    smallest: float = SMALLEST_STEP,
    allowance: Allowance | None = None,
) -> PathSpace:
    """Working space for load paths of `chain` under `rows`; their ends are found to the part `smallest` of a load step.

    Where states depend on those before, what is accepted on the way is kept in `accepted`.
    """
    return PathSpace(
        now=load_row(rows),
        reached=np.zeros(1),
        kept=state(chain),
        good=state(chain),
        rest=state(chain),
        smallest=np.array([smallest]),
        accepted=accepted,
        allowed=np.zeros(1, np.int64),
        allowance=np.array(allowance or usual_allowance()),
    )


def history_space(chain: Chain, packed: Packed, space: PathSpace) -> HistorySpace:
    """The same where friction follows the travel, sharing `space`."""
    return HistorySpace(
        now=space.now,
        reached=space.reached,
        kept=space.kept,
        holes=stick_slip_space(packed),
        start=state(chain),
        before=rates(chain),
        after=rates(chain),
        accepted=space.accepted,
        allowed=space.allowed,
    )


@kernel
def come_to_rest(packed, onset, dead, modes, space, work):
    """Bring the chain from nothing to its rest (row 1 of `onset`), where no hole slips, in `space.rest`.

    Returns Newton steps, or what `ramp` returns where that was not possible; `dead` tells whether dead loads act.
    """
    presliding, kept = packed.model[0].presliding, space.kept
    packed.model[0].presliding = 0.0
    for i in range(len(packed.span)):
        for k in range(kept.q.shape[1]):
            packed.plate[i].q[k] = packed.plate[i].rest[k]
            for e in range(packed.model[0].elements):
                packed.plate[i].slider[k, e] = 0.0
    save(packed, work, kept)
    taken = ramp(packed, onset, dead, modes, space, work)
    packed.model[0].presliding = presliding
    space.accepted.noted[0] = 0
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
    save(packed, work, space.rest)
    return taken


@entrance
def follow(packed, program, modes, space, history, work, path):
    """Solve every load step of a program that is not done and write `path`.

    `modes` (n, nodes, c) ties node angles together; None: they are free, and what ties them need not be compiled.
    `history` is None, likewise, where slip is declared.  Where `path.lowest` is not empty the lowest eigenvalue is
    written where it is cheap: for free angles without dead loads or history.  A step in the direction of the one
    before, where that was lost on the same way, is lost where that was.
    """
    way, dead, from_rest = program.way, program.dead, program.from_rest
    eigenvalue, kept, good = len(path.lowest) > 0, space.kept, space.good
    rows = way.rows
    work.spent[0], space.allowed[0] = 0, space.allowance[0]
    rest = come_to_rest(packed, program.onset, dead[0], modes, space, work)
    possible = rest >= 0
    last: Any = np.int64(0)  # not a literal, for which everything would be compiled once more
    restore(packed, work, space.rest)
    save(packed, work, good)
    if history is not None or packed.model[0].elements > 0:
        keep_state(space.accepted, last, 1.0, space.rest)
    lost_from: Any = np.int64(-1)  # row from which the step before was lost; -1: it was not
    for s in range(1, len(rows)):
        if program.done[s - 1]:
            lost_from = np.int64(-1)
            continue
        if from_rest[s - 1]:
            last = np.int64(0)
            work.spent[0], space.allowed[0] = 0, space.allowance[0]
        space.allowed[0] += space.allowance[1]
        before = work.spent[0]
        as_before = history is None and lost_from == last and packed.model[0].softening == 0.0
        farther = times_as_far(rows, len(packed.cable), last, s) if as_before else 0.0
        end = path.reached[s - 2]  # where the step before was lost, if it was
        known = farther > end + space.smallest[0] * max(end, 1.0 / 64) > 0.0
        loaded, taken = dead[s] or dead[last], GAVE_UP if rest == GAVE_UP else FAILED
        way.ends[0], way.ends[1] = last, s
        if known:
            taken = path.status[s - 2, 0]
            space.reached[0] = end / farther
        else:
            if from_rest[s - 1]:
                restore(packed, work, space.rest)
                save(packed, work, good)
            else:
                restore(packed, work, good)
            save(packed, work, kept)
            space.reached[0] = 0.0
            if possible:
                if history is None:
                    taken = ramp(packed, way, loaded, modes, space, work)
                else:
                    taken = ramp_with_history(packed, way, loaded, history, work)
        path.status[s - 1, 0], path.status[s - 1, 1] = min(taken, 0), max(taken, 0)
        path.reached[s - 1], path.spent[s - 1] = space.reached[0], work.spent[0] - before
        lost_from = last if possible and taken < 0 else np.int64(-1)
        if taken < 0:
            if possible and eigenvalue:
                write_end(s - 1, kept, path)
                if modes is None and not loaded and history is None:
                    restore(packed, work, kept)
                    attempt(packed, way, space.reached[0], loaded, modes, space.now, work)
                    write_lowest(packed, s - 1, path)
            continue  # the next step goes on from the last good one
        last = s
        save(packed, work, good)
        write_step(packed, s - 1, path)
        if modes is not None:
            write_tied(packed, s - 1, work, path)
        elif eigenvalue and not loaded and history is None:
            write_lowest(packed, s - 1, path)
