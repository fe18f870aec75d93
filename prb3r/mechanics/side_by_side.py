"""Equilibria of independent load steps solved side by side: each from rest in one step, without dead loads.

As in `march.py` plate follows plate from base to tip, here for as many load steps at once as there are lanes.  A lane
that has converged stands still, so that the result for a load does not depend on those beside it.  A load step in which
a plate turns too far for one step, or Newton's method does not converge soon, is left to `path.py`.
"""

from typing import Any, NamedTuple

import numpy as np

from prb3r.mechanics.acting import dead_loads
from prb3r.mechanics.balance import linearise_plate, unbalance_plate
from prb3r.mechanics.block_eigenvalue import has_closed_form, lowest_of_block
from prb3r.mechanics.bundle import bundle
from prb3r.mechanics.chain import Chain, Loads
from prb3r.mechanics.kernel import entrance, kernel
from prb3r.mechanics.lanes.number import LANES, every, where
from prb3r.mechanics.lanes.table import in_lanes_of, lane_table, record_type, room_in_lanes
from prb3r.mechanics.march import AS_FORETOLD, MAX_STEP, TOLERANCE, at_base_hole, correct_plate, depart, next_frame
from prb3r.mechanics.path_output import write_step
from prb3r.mechanics.records import Packed
from prb3r.mechanics.state import PLATE_TURN

MOST_CORRECTIONS = 12
"""Newton steps of a plate after which a load step is left to `path.py`; the march shortens steps from there on."""
WRITTEN = ("q", "residual", "tangent", "node", "end", "bend", "axis", "wrench", "frame")
"""Fields of a plate's record from which results are written, and which are copied out of the lanes for that."""
TOLD_OF_LOADS = ("most", "spent", "farthest")
"""Fields of `march_fields` that are read after the march, for each load step."""


APPLIED = np.dtype([("tension", float), ("slip", float)])
"""Record of what is applied to a cable: its tension before the base hole, N, and its declared slip."""


def march_fields(n: int) -> list[tuple]:
    """Names, types and shapes of the record of a march from base to tip, for plates of `n` nodes; see `foretell`."""
    return [
        ("change", float, (n,)),  # change of the last plate's node angles since rest, rad
        ("first", float, (n,)),  # its first difference from plate to plate
        ("second", float, (n,)),  # its second difference
        ("missed", float, (n,)),  # error of the predicted change of the present plate
        ("known", float),  # number of differences that are known
        ("most", float),  # Newton steps of the plate that took most
        ("spent", float),  # evaluations of a plate
        ("farthest", float),  # largest turn of a plate since rest, rad
    ]


@bundle
class LaneSpace(NamedTuple):
    """Working space of :func:`solve_side_by_side`: records for `lane_table`, and the numbers of each in lanes.

    The width of an array in lanes is the count of numbers of a record that differ from lane to lane.
    """

    plate: np.ndarray
    """(n + 1, width, lanes) numbers of the plates in lanes."""
    span: np.ndarray
    """(n, m, width, lanes) numbers of the cables over the plates in lanes."""
    cable: np.ndarray
    """(m, width, lanes) numbers of the cables in lanes."""
    applied: np.ndarray
    """(m,) records of `APPLIED`, whose numbers in lanes are in `given`."""
    given: np.ndarray
    """(m, width, lanes) tension and slip applied to each cable."""
    march: np.ndarray
    """(1,) record of `march_fields`, whose numbers in lanes are in `told`."""
    told: np.ndarray
    """(1, width, lanes) numbers of the march in lanes."""
    told_at: np.ndarray
    """(3,) positions of the fields `TOLD_OF_LOADS` along the width of `told`."""
    written_at: np.ndarray
    """(2, c) positions of the numbers of the fields `WRITTEN`: along the width of `plate`, and in a plain record."""
    tension_at: np.ndarray
    """(1,) position of the tension along the width of `span`."""
    numbers: np.ndarray
    """(n + 1, c) view of the plain records of the plates as numbers."""
    rows: np.ndarray
    """(lanes,) load step in each lane."""


def lane_space(packed: Packed) -> LaneSpace:
    """Working space for the chain of `packed`."""
    march, applied = np.zeros(1, march_fields(packed.plate["q"].shape[1])), np.zeros(len(packed.cable), APPLIED)
    of_plate, of_span, of_march = (record_type(records.dtype) for records in (packed.plate, packed.span, march))
    in_plate = in_lanes_of(of_plate)
    places = [(name, k) for name in WRITTEN for k in range(int(np.prod(in_plate[name][1])))]
    return LaneSpace(
        plate=room_in_lanes(packed.plate),
        span=room_in_lanes(packed.span),
        cable=room_in_lanes(packed.cable),
        applied=applied,
        given=room_in_lanes(applied),
        march=march,
        told=room_in_lanes(march),
        told_at=np.array([in_lanes_of(of_march)[name][0] for name in TOLD_OF_LOADS]),
        written_at=np.array([(in_plate[name][0] + k, of_plate.offset(name) // 8 + k) for name, k in places]).T.copy(),
        tension_at=np.array([in_lanes_of(of_span)["tension"][0]]),
        numbers=packed.plate.view(float).reshape(len(packed.plate), -1),
        rows=np.zeros(LANES, np.int64),
    )


def stand_alone(chain: Chain, rows: Loads, from_rest: np.ndarray, eigenvalue: bool) -> np.ndarray:
    """(s,) whether each step can be solved side by side with others.

    It has to start from rest without any load, no other step may start from it, no dead load or extra moment may act,
    and plates and friction must be plain: no bending law, hysteresis, history, softening, tied angles, drag in holes
    or friction that depends on tension.

    Parameters
    ----------
    rows : loads at rest and at each step, as of `acting`.
    from_rest : (s,) whether a step starts from rest.
    eigenvalue : whether the lowest eigenvalue is asked for, which then needs a closed form.
    """
    of_tension = chain.friction_exponent or chain.hole_drag
    plain = chain.law.linear and not (chain.tied or chain.remembers or chain.softening or of_tension)
    dead, free = dead_loads(chain, rows), not (rows.tension[0].any() or rows.moment.any())
    if not plain or not free or dead[0] or (eigenvalue and not has_closed_form(chain)):
        return np.zeros(len(from_rest), bool)
    return from_rest & np.append(from_rest[1:], True) & ~dead[1:]


@kernel
def solve_plates(model, plate, span, cable, march):
    """Newton's method on one plate in every lane; returns the steps of each lane, `MOST_CORRECTIONS` if one failed."""
    n, steps = plate.q.shape[0], 0.0 * plate.q[0]
    for step in range(MOST_CORRECTIONS + 1):
        solved = unbalance_plate(model, plate, span, cable) <= (TOLERANCE if step > 0 else AS_FORETOLD)
        if every(solved) or step == MOST_CORRECTIONS:
            break
        linearise_plate(model, plate, span)
        correct_plate(plate)
        steps += where(solved, 0.0, 1.0)
        for k in range(n):
            change = -plate.residual[k]
            change = where(change > MAX_STEP, MAX_STEP, where(change < -MAX_STEP, -MAX_STEP, change))
            change = where(solved, 0.0, change)
            plate.q[k] += change
            march.missed[k] += change
    return steps


@kernel
def foretell_in_lanes(march):
    """`foretell` of `march.py`, in every lane for itself."""
    missed, without, known = 0.0, 0.0, march.known
    for k in range(len(march.missed)):
        missed += abs(march.missed[k])
        without += abs(march.missed[k] + march.first[k] + march.second[k])
    anew = missed > where(known > 1.0, 0.5 * without, 1e300)
    for k in range(len(march.missed)):
        off, first, second = march.missed[k], march.first[k], march.second[k]
        next_second = where(known > 1.0, second + off, 0.0)
        next_first = where(known > 1.0, first + next_second, where(known > 0.0, off, 0.0))
        march.change[k] += where(anew, first + second + off, where(known > 0.0, next_first, off))
        march.first[k] = where(anew, 0.0, next_first)
        march.second[k] = where(anew, 0.0, next_second)
    march.known = where(anew, 1.0, known + 1.0)


@kernel
def march_side_by_side(model, plates, spans, cable, applied, march, eigenvalue):
    """Solve plate after plate in every lane under the loads `applied`; with `eigenvalue` also write the tangents of the
    solved plates."""
    n = len(march.missed)
    for j in range(len(cable)):
        at_base_hole(cable[j], applied[j].tension, applied[j].slip)
    for k in range(n):
        march.change[k] = march.first[k] = march.second[k] = 0.0
    march.known = march.most = march.spent = march.farthest = 0.0
    base: Any = plates[0]
    for k in range(5):
        base.frame[k] = 1.0 if k == 3 else 0.0
    for i in range(len(spans)):
        plate, span = plates[i], spans[i]
        for k in range(n):
            plate.q[k] = plate.rest[k] + (march.change[k] + march.first[k] + march.second[k])
            march.missed[k] = 0.0
        steps = solve_plates(model, plate, span, cable, march)
        if eigenvalue:
            linearise_plate(model, plate, span)
        foretell_in_lanes(march)
        turn = 0.0
        for k in range(n):
            turn += plate.q[k] - plate.rest[k]
        turn = abs(turn)
        march.most = where(steps > march.most, steps, march.most)
        march.spent += steps + 1.0
        march.farthest = where(turn <= march.farthest, march.farthest, turn)  # NaN too
        depart(plate, span, cable)
        next_frame(model, plate, plates[i + 1])


@kernel
def write_lane(packed, space, lane, row, path):
    """Copy the state in one lane into the plain records and write it as step `row` of `path`."""
    plates, cables = packed.span.shape
    for i in range(plates + 1):
        for c in range(space.written_at.shape[1]):
            space.numbers[i, space.written_at[1, c]] = space.plate[i, space.written_at[0, c], lane]
    lowest = np.inf
    for i in range(plates):
        for j in range(cables):
            packed.span[i, j].tension = space.span[i, j, space.tension_at[0], lane]
        if len(path.lowest) > 0:
            lowest = min(lowest, lowest_of_block(packed.plate[i].tangent))
    path.status[row, 0], path.status[row, 1] = 0, int(space.told[0, space.told_at[0], lane])
    path.reached[row], path.spent[row] = 1.0, int(space.told[0, space.told_at[1], lane])
    write_step(packed, row, path)
    if len(path.lowest) > 0:
        path.lowest[row] = lowest


@entrance
def solve_side_by_side(packed, tension, slip, alone, space, path, done):
    """Solve the load steps that are marked in `alone` (s,) under `tension` (N) and `slip` (s, m), and write them to
    `path` as `follow` does.

    Marks in `done` (s,) which of them were solved; for the others nothing is written.
    """
    march: Any = lane_table(space.march, space.told)[0]  # type: ignore[call-arg]
    plates, spans = lane_table(packed.plate, space.plate), lane_table(packed.span, space.span)  # type: ignore[call-arg]
    cable, applied = lane_table(packed.cable, space.cable), lane_table(space.applied, space.given)  # type: ignore[call-arg]
    rows, cables, s = space.rows, len(packed.cable), 0
    while s < len(alone):
        count = 0
        while s < len(alone) and count < LANES:
            if alone[s]:
                rows[count] = s
                count += 1
            s += 1
        if count == 0:
            break
        for lane in range(LANES):
            row = rows[min(lane, count - 1)]  # lanes that are left over do the last one once more
            for j in range(cables):
                space.given[j, 0, lane] = max(tension[row, j], 0.0)  # a cable cannot push
                space.given[j, 1, lane] = slip[row, j]
        march_side_by_side(packed.model[0], plates, spans, cable, applied, march, len(path.lowest) > 0)
        for lane in range(count):
            most, farthest = space.told[0, space.told_at[0], lane], space.told[0, space.told_at[2], lane]
            if most < MOST_CORRECTIONS and farthest <= PLATE_TURN:
                write_lane(packed, space, lane, rows[lane], path)
                done[rows[lane]] = True
