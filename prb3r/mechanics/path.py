"""Load paths: `follow` solves step after step, each from the last solved one or from rest, and writes a `Path`."""

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
from prb3r.mechanics.ramp import SHORTEST_WAY, ramp
from prb3r.mechanics.records import Packed
from prb3r.mechanics.relaxation import forget_relaxation, relax
from prb3r.mechanics.same_way import times_as_far
from prb3r.mechanics.stability import write_lowest
from prb3r.mechanics.state import Rates, State, rates, restore, save, state
from prb3r.mechanics.stick_slip import StickSlip, stick_slip_space

SMALLEST_STEP = 1.0 / 2**20
"""Usual accuracy of the place where a path ends, relative to the part of the load step that has been reached."""


@bundle
class PathSpace(NamedTuple):
    """Working space of :func:`follow`."""

    now: LoadRow
    """Loads of the state that is being solved."""
    reached: np.ndarray
    """(1,) part of the way to the present load step at which the last accepted state lies."""
    kept: State
    """The last accepted state on the way to the present load step; at its beginning, the state that it starts from."""
    good: State
    """The state of the last solved load step."""
    rest: State
    """The state at rest."""
    smallest: np.ndarray
    """(1,) sub-step below which a path ends, over the part of the load step that is reached (1/64 at least)."""
    accepted: AcceptedStates
    """Accepted sub-steps, where states depend on those before."""
    allowed: np.ndarray
    """(1,) most work that the sequence may have taken by the end of the present step; see `Scratch.spent`."""
    allowance: np.ndarray
    """(2,) increments of `allowed` at the beginning of a sequence and of a step: :class:`Allowance`."""


@bundle
class Program(NamedTuple):
    """The load steps of a path, for :func:`follow`."""

    onset: Way
    """The way from no load at all (row 0) to the constant loads at rest (row 1)."""
    way: Way
    """Loads at rest and then at each step; its `ends` are set by :func:`follow`."""
    dead: np.ndarray
    """(s + 1,) whether dead loads act at rest and at each step."""
    from_rest: np.ndarray
    """(s,) whether a step starts from rest instead of from the step before."""
    done: np.ndarray
    """(s,) whether a step is solved already; no other step starts from such a one."""


@bundle
class HistorySpace(NamedTuple):
    """Working space of :func:`follow` where friction follows the cables' travel.

    Fields without a description are those of `PathSpace`.
    """

    now: LoadRow
    reached: np.ndarray
    kept: State
    holes: StickSlip
    """Working space of `balance_stick_slip`."""
    start: State
    """The state from which a sub-step starts."""
    before: Rates
    """Rates at the beginning of a sub-step."""
    after: Rates
    """Rates at its end."""
    accepted: AcceptedStates
    allowed: np.ndarray


def path_space(
    chain: Chain,
    rows: Loads,
    accepted: AcceptedStates,
    smallest: float = SMALLEST_STEP,
    allowance: Allowance | None = None,
) -> PathSpace:
    """Working space for load paths of `chain` under the loads `rows`.

    Parameters
    ----------
    accepted : arrays in which accepted sub-steps are kept, where states depend on those before.
    smallest : as `PathSpace.smallest`.
    allowance : most work that a sequence may take; absent: `usual_allowance`.
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
    """Working space for load paths where friction follows the cables' travel; it shares arrays with `space`."""
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
    """Bring the chain from no load to rest, under the constant loads in row 1 of `onset`, and save it as `space.rest`.

    No hole slips at rest, and no friction acts on the way there.  `dead` tells whether dead loads act at rest.  Returns
    what `ramp` returns: Newton steps, or a negative number where rest was not reached.
    """
    presliding, kept = packed.model[0].presliding, space.kept
    packed.model[0].presliding = 0.0
    for i in range(len(packed.span)):
        for k in range(kept.q.shape[1]):
            packed.plate[i].q[k] = packed.plate[i].rest[k]
            for e in range(packed.model[0].elements):
                packed.plate[i].slider[k, e] = 0.0
    forget_relaxation(packed)
    save(packed, work, kept)
    save(packed, work, space.good)
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
    """Solve every load step of `program` that is not done, and write the results to `path`.

    `modes` (n, nodes, c) tie node angles together; with None they are free.  `history` is None where slip is declared.
    With None, the code for tied angles or for history is not even compiled.  If `path.lowest` is not empty, the lowest
    eigenvalue is written where that is cheap: for free angles without dead loads or history.  A step whose loads lie
    further along the same straight way as a failed step before is not tried: it fails at the same loads.
    """
    way, dead, from_rest = program.way, program.dead, program.from_rest
    eigenvalue, kept, good = len(path.lowest) > 0, space.kept, space.good
    rows = way.rows
    work.spent[0], space.allowed[0] = 0, space.allowance[0]
    rest = come_to_rest(packed, program.onset, dead[0], modes, space, work)
    possible = rest >= 0
    last: Any = np.int64(0)  # a literal 0 is a type of its own, for which everything would be compiled once more
    restore(packed, work, space.rest)
    save(packed, work, good)
    relaxes = packed.model[0].relaxation != 0.0
    if history is not None or packed.model[0].elements > 0 or relaxes:
        keep_state(space.accepted, last, 1.0, space.rest)
    time = len(rows[0]) - 1  # column of the time, in steps
    since = rows[1, time] - 1.0  # that of the last solved step; the first one takes as long as a step
    lost_from: Any = np.int64(-1)  # row from which the step before started if it failed; -1: it did not fail
    for s in range(1, len(rows)):
        if program.done[s - 1]:
            lost_from = np.int64(-1)
            continue
        if from_rest[s - 1]:
            last = np.int64(0)
            work.spent[0], space.allowed[0] = 0, space.allowance[0]
            since = rows[s, time] - 1.0
            forget_relaxation(packed)
        space.allowed[0] += space.allowance[1]
        before = work.spent[0]
        as_before = history is None and lost_from == last and packed.model[0].softening == 0.0 and not relaxes
        farther = times_as_far(rows, len(packed.cable), last, s) if as_before else 0.0
        end = path.reached[s - 2]  # part of the step before that was reached, if it failed
        lost_at = end + space.smallest[0] * max(end, SHORTEST_WAY)
        known = lost_at > 0.0 and farther > lost_at
        loaded, taken = dead[s] or dead[last], GAVE_UP if rest == GAVE_UP else FAILED
        way.ends[0], way.ends[1], way.duration[0] = last, s, rows[s, time] - since
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
                write_end(packed, s - 1, kept, path)
                if modes is None and not loaded and history is None:
                    restore(packed, work, kept)
                    attempt(packed, way, space.reached[0], loaded, modes, space.now, work)
                    write_lowest(packed, s - 1, path)
            continue  # the next step goes on from the last good one
        last = s
        since = rows[s, time]
        save(packed, work, good)
        write_step(packed, s - 1, path)
        if modes is not None:
            write_tied(packed, s - 1, work, path)
        elif eigenvalue and not loaded and history is None:
            write_lowest(packed, s - 1, path)
        if relaxes:
            relax(packed)
