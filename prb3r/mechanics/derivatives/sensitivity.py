r"""Sensitivities: derivatives of positions, angles and tensions by parameters, by implicit differentiation.

A parameter is anything that changes the chain or the loads smoothly; it is given by the problem a little ahead and the
one a little behind.  Only what is known without solving is differenced: unbalanced moments with the shape held.  So the
error is that of a central difference of smooth elementary functions, about 1e-9.

Where friction follows the cables' travel, or plates have hysteresis or relax, a state depends on those before it.  The
derivatives of slip, cable lengths, sliders and relaxed moments are then carried from each accepted sub-step to the
next, from rest on; a hole or slider that slips forgets those before.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from prb3r.mechanics.acting import acting
from prb3r.mechanics.chain import Chain, Loads
from prb3r.mechanics.derivatives.differentiate import DerivativeSpace, Memory, differentiate
from prb3r.mechanics.derivatives.feedback import sweep_room
from prb3r.mechanics.derivatives.loops import sliders_at_zero
from prb3r.mechanics.derivatives.partials import HeldState, Sides
from prb3r.mechanics.derivatives.relaxing import nothing_relaxed
from prb3r.mechanics.derivatives.response import room
from prb3r.mechanics.derivatives.solved_path import FOLLOWS_STATE, SolvedPath, solve_path
from prb3r.mechanics.equilibrium import Equilibria
from prb3r.mechanics.load_row import load_row, rows_of_loads
from prb3r.mechanics.records import Packed, differing, pack, pack_held_beside
from prb3r.mechanics.tangent import segment_modes
from prb3r.mechanics.variation import scratch

TOGETHER = 16
"""Parameters differentiated at a time."""

LoadedChain = tuple[Chain, Loads]


class Neighbour(NamedTuple):
    """The problem a little ahead or behind in a parameter."""

    chain: Chain
    loads: Loads
    differ: set[str]
    """Names of the fields in which the chain may differ from the one that was solved; see `differing`."""


class Direction(NamedTuple):
    """One parameter, given by the problems a little ahead and a little behind in it."""

    ahead: LoadedChain
    behind: LoadedChain
    apart: float
    """Difference of the parameter between both, in its unit."""


def direction(problem: Callable[[float], LoadedChain], value: float, step: float) -> Direction:
    """The direction of a parameter of which `problem` is a function, at `value` and to `step` on either side."""
    return Direction(problem(value + step), problem(value - step), 2 * step)


@dataclass(frozen=True)
class Sensitivities:
    """Derivatives by `p` parameters at `s` load steps of `n` plates and `m` cables; failed steps hold NaN."""

    equilibria: Equilibria
    dx: np.ndarray
    """(s, n + 1, p) derivatives of x of the centres of disks 0..n, m per unit of the parameter."""
    dy: np.ndarray
    """(s, n + 1, p) derivatives of y of the centres, m per unit."""
    dangle: np.ndarray
    """(s, n + 1, p) derivatives of the absolute angles of the disks, rad per unit."""
    dtension: np.ndarray
    """(s, n, m, p) derivatives of the cable tensions across the plates, N per unit."""
    dslip: np.ndarray
    """(s, n, m, p) derivatives of the slip at the hole before each plate; no cables where slip is declared."""


def chain_sensitivities(
    chain: Chain, loads: Loads, directions: Sequence[Direction], *, from_rest: bool | np.ndarray = False
) -> Sensitivities:
    """Equilibria of `chain` under `loads` and their derivatives by the parameters of `directions`.

    `from_rest` is that of `solve_chain`; raises what `solve_path` and `derivatives` raise.
    """
    return derivatives(solve_path(chain, loads, from_rest=from_rest), directions)


def derivatives(solved: SolvedPath, directions: Sequence[Direction]) -> Sensitivities:
    """Derivatives by the parameters of `directions` along a path that has been solved.

    A tension of exactly zero has derivatives, as of a cable that is about to be pulled; a cable whose applied and
    constant tensions add up to less than zero stays slack.

    Raises
    ------
    ValueError
        Without a direction; if one changes more than numbers (plates, cables, model, kind of friction or of
        hysteresis); or for a chain with terms of a moment law, which `prb3r.model.laws.derivatives` differentiates.
    """
    chain, loads, equilibria = solved.chain, solved.loads, solved.equilibria
    sides = _sides_of(solved, directions)
    rows, n, cables = acting(chain, loads, solved.begins), chain.stiffness.shape[1], len(chain.reach)
    pose = np.zeros((3, loads.steps, chain.plates + 1, len(directions)))
    tension = np.empty((loads.steps, chain.plates, cables, len(directions)))
    slip = np.empty((loads.steps, chain.plates, cables if chain.presliding > 0 else 0, len(directions)))
    pose[0, :, 0] = [(along.behind[0].disk - along.ahead[0].disk) / (2 * along.apart) for along in directions]
    for first in range(0, len(directions), TOGETHER):
        part = slice(first, first + TOGETHER)
        apart = np.array([along.apart for along in directions[part]], float)
        changes = _derivatives(solved, rows, sides[2 * first : 2 * first + 2 * TOGETHER], apart)
        for row in range(3):
            pose[row, :, 1:, part] = changes[:, :, n + row]
        tension[..., part] = changes[:, :, n + 3 : n + 3 + cables]
        slip[..., part] = changes[:, :, n + 3 + 2 * cables :]
    failed = np.isnan(equilibria.angle[:, -1])
    pose[:, failed], tension[failed], slip[failed] = np.nan, np.nan, np.nan
    return Sensitivities(equilibria, pose[0], pose[1], pose[2], tension, slip)


class OtherKindError(ValueError):
    """A direction that changes the kind of the chain or of its loads, not numbers alone; `number` counts from 0."""

    def __init__(self, number: int) -> None:
        super().__init__(f"direction {number} changes the kind of the chain or of its loads, not numbers alone")
        self.number = number


def _sides_of(solved: SolvedPath, directions: Sequence[Direction]) -> list[Neighbour]:
    """The 2 p problems ahead and behind of each parameter, in turn; raises what `derivatives` raises."""
    if not directions:
        raise ValueError("sensitivities need at least one direction")
    problem, out = (solved.chain, solved.loads), []
    for number, along in enumerate(directions):
        for chain, loads in (along.ahead, along.behind):
            side = Neighbour(chain, loads, differing(chain, solved.chain))
            if chain.closure:
                raise ValueError(FOLLOWS_STATE)
            if not _of_one_kind(side, problem):
                raise OtherKindError(number)
            out.append(side)
    return out


def _derivatives(solved: SolvedPath, rows: Loads, sides: Sequence[Neighbour], apart: np.ndarray) -> np.ndarray:
    """(s, n, rows, p) derivatives in the rows of `response.py`; undefined numbers for failed steps."""
    chain = solved.chain
    (plates, n), cables, count = chain.stiffness.shape, len(chain.reach), len(apart)
    elements = chain.hysteresis.slipping
    packed, held, history = pack(chain), pack(chain, held=True), chain.presliding > 0
    height = n + 3 + (3 if history else 1) * cables
    around = _packed_sides(solved, rows, held, sides, apart, np.zeros((2, plates, height)))
    acts, hanging = rows_of_loads(rows), slice(cables, cables + 2 * plates + 2)  # forces on disks and tip
    dead = acts[:, hanging].any() or around.rows[..., hanging].any()
    dead |= any(model["umbilical"].any() for model in (packed.model, around.packed.model))
    shape = (plates, cables, count)
    memories = (
        Memory(
            slip=np.zeros(shape[:2]),
            dslip=np.zeros(shape),
            dbeyond=np.zeros(shape),
            sliders=sliders_at_zero((plates, n), elements, count),
            relaxed=nothing_relaxed(plates if chain.relaxation else 0, count),
        )
        for _ in range(2)
    )
    modes = segment_modes(chain) if chain.tied else None
    tied = 0 if modes is None else modes.shape[2]
    state = HeldState(
        rows=acts,
        now=load_row(rows),
        handed=np.zeros(int(dead)),
        outer=np.zeros(3),
        partial=np.zeros((plates, height, count)),
        left=np.zeros(count),
    )
    space = DerivativeSpace(
        state=state,
        memory=next(memories),
        at_rest=next(memories),
        room=room(packed, int(dead and not chain.tied), count, history),
        sweep=sweep_room(packed, count if history else 0),
        work=scratch(packed, tied),
        tied=np.zeros((tied, tied + count)),
        out=np.empty((rows.steps - 1, *state.partial.shape)),
    )
    differentiate(packed, held, around, solved.states, modes, space)
    return space.out


def _packed_sides(
    solved: SolvedPath, rows: Loads, held: Packed, sides: Sequence[Neighbour], apart: np.ndarray, out: np.ndarray
) -> Sides:
    """The problems `sides` as compiled code takes them.

    `held` are records of the solved chain with its shape held, `rows` its loads as of `acting`, `out` working space.
    """
    problem, begins = (solved.chain, solved.loads), solved.begins
    acts = [rows if _same_loads(side, problem) else acting(side.chain, side.loads, begins) for side in sides]
    nominal = rows_of_loads(rows)
    every = np.empty((len(nominal), len(acts), nominal.shape[1]))
    for k, act in enumerate(acts):
        every[:, k] = nominal if act is rows else rows_of_loads(act)
    return Sides(
        packed=pack_held_beside(held, [(side.chain, side.differ) for side in sides]),
        alike=np.array([_same_shape(side, solved.chain) for side in sides]),
        rows=every,
        apart=apart,
        now=load_row(rows),
        out=out,
    )


def _same_shape(side: Neighbour, chain: Chain) -> bool:
    """Whether equal node angles (beyond the stress-free ones, if they are tied) give the same shape of both chains."""
    if "plate" in side.differ and not all(map(np.array_equal, side.chain.plate, chain.plate)):
        return False
    return _equal_in(("disk", "arc", "clamp", "rest") if chain.tied else ("disk", "arc", "clamp"), side, chain)


SHAPED = "stiffness", "offset"
"""Fields of a chain whose shapes tell its numbers of plates, nodes and cables."""
OF_LOADS = (
    *("tilt", "tip_efficiency", "disk_efficiency", "gain", "quadratic", "hanger", "play", "zero_drift"),
    *("friction_rate", "friction_reference", "friction_excess", "friction_decay", "friction_drift"),
)
"""Fields of a chain by which the acting loads follow from the recorded ones, without the constant loads."""


def _same_loads(side: Neighbour, problem: LoadedChain) -> bool:
    """Whether the same loads act as in `problem`: the recorded ones are the same object, and all that acts on these is
    equal."""
    chain, loads = problem
    return side.loads is loads and _equal_in(OF_LOADS, side, chain) and _same_constant(side, chain)


def _same_constant(side: Neighbour, chain: Chain) -> bool:
    """Whether the constant loads are equal."""
    if "constant" not in side.differ:
        return True
    always, nominal = side.chain.constant, chain.constant
    if always is None or nominal is None:
        return False
    return all(mine.tobytes() == its.tobytes() for mine, its in zip(always, nominal, strict=True))


def _equal_in(names: Sequence[str], side: Neighbour, chain: Chain) -> bool:
    """Whether a side's chain has the same values as `chain` in the fields `names`."""
    differ = side.differ.intersection(names)
    return all(np.array_equal(getattr(side.chain, name), getattr(chain, name)) for name in differ)


def _of_one_kind(side: Neighbour, problem: LoadedChain) -> bool:
    """Whether a side differs from `problem` in numbers alone: shapes of arrays, reaches of cables, kinds of friction
    and hysteresis and the unit of the time of relaxation are the same."""
    (nominal, loads), chain, differ = problem, side.chain, side.differ
    if side.loads is not loads and any(a.shape != b.shape for a, b in zip(side.loads, loads, strict=True)):
        return False
    if any(getattr(chain, name).shape != getattr(nominal, name).shape for name in differ.intersection(SHAPED)):
        return False
    if "plate" in differ and chain.plate.turn.shape != nominal.plate.turn.shape:
        return False
    history = (chain.presliding > 0) == (nominal.presliding > 0)
    mine, its = chain.hysteresis, nominal.hysteresis
    slips = (mine.slipping, mine.flagged) == (its.slipping, its.flagged)
    relaxes = (chain.relaxation != 0) == (nominal.relaxation != 0)
    return history and slips and relaxes and _equal_in(("reach", "tied", "edges", "relaxation_step"), side, nominal)
