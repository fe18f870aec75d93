r"""Sensitivities: how positions, angles and tensions depend on parameters, by implicit differentiation.

A parameter is anything that changes the chain or the loads smoothly; it is given by the problem a little ahead and a
little behind.  Only what is known without solving is differenced: unbalanced moments with the shape held.  So the
error is that of a central difference of smooth elementary functions, about 1e-9.

Where friction follows the cables' travel, or part of the plates' stiffness slips, the state remembers, and so do the
derivatives: those of slip, cable lengths and sliders are carried from each accepted sub-step to the next, from rest on.
What slips has forgotten.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from prb3r.mechanics.chain import Chain, Loads, acting
from prb3r.mechanics.derivatives.differentiate import DerivativeSpace, Memory, differentiate
from prb3r.mechanics.derivatives.feedback import sweep_room
from prb3r.mechanics.derivatives.loops import sliders_at_zero
from prb3r.mechanics.derivatives.partials import HeldState, Sides
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
    """The problem on one side of a parameter."""

    chain: Chain
    loads: Loads
    differ: set[str]
    """Names of the fields that the chain does not share with the one that was solved; see `differing`."""


class Direction(NamedTuple):
    """One parameter: the problem a little `ahead` and `behind`, which are `apart` in the parameter's unit."""

    ahead: LoadedChain
    behind: LoadedChain
    apart: float


def direction(problem: Callable[[float], LoadedChain], value: float, step: float) -> Direction:
    """The direction of a parameter at `value` of which `problem` is a function."""
    return Direction(problem(value + step), problem(value - step), 2 * step)


@dataclass(frozen=True)
class Sensitivities:
    """Derivatives by `p` parameters at `s` load steps of `n` plates and `m` cables; failed steps hold NaN."""

    equilibria: Equilibria
    dx: np.ndarray
    """(s, n + 1, p) of the centres of disks 0..n, m per unit of the parameter."""
    dy: np.ndarray
    """(s, n + 1, p)."""
    dangle: np.ndarray
    """(s, n + 1, p) of the absolute angles of the disks, rad per unit."""
    dtension: np.ndarray
    """(s, n, m, p) of the cable tensions across the plates, N per unit."""
    dslip: np.ndarray
    """(s, n, m, p) of the slip at the holes before the plates; no cables where it is declared."""


def chain_sensitivities(
    chain: Chain, loads: Loads, directions: Sequence[Direction], *, from_rest: bool | np.ndarray = False
) -> Sensitivities:
    """Equilibria of `chain` under `loads` and their derivatives by the parameters of `directions`.

    `from_rest` is that of `solve`; raises what `solve_path` and `derivatives` raise.
    """
    return derivatives(solve_path(chain, loads, from_rest=from_rest), directions)


def derivatives(solved: SolvedPath, directions: Sequence[Direction]) -> Sensitivities:
    """Derivatives by the parameters of `directions` along a path that has been solved.

    A tension of zero changes to either side (a slack cable is about to be pulled); one that is negative in sum stays
    slack.

    Raises
    ------
    ValueError
        Without a direction, where one changes more than numbers (plates, cables, model, kind of friction or whether
        stiffness slips), or with moments that follow the state: `prb3r.model.laws.derivatives` has these.
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


def _sides_of(solved: SolvedPath, directions: Sequence[Direction]) -> list[Neighbour]:
    """The problems ahead and behind of each parameter, in turn; raises ValueError where `directions` are not parameters
    of `solved`, see `derivatives`."""
    if not directions:
        raise ValueError("sensitivities need at least one direction")
    problem, out = (solved.chain, solved.loads), []
    for number, along in enumerate(directions):
        for chain, loads in (along.ahead, along.behind):
            side = Neighbour(chain, loads, differing(chain, solved.chain))
            if chain.closure:
                raise ValueError(FOLLOWS_STATE)
            if not _of_one_kind(side, problem):
                raise ValueError(f"direction {number} changes the kind of the chain or of its loads, not numbers alone")
            out.append(side)
    return out


def _derivatives(solved: SolvedPath, rows: Loads, sides: Sequence[Neighbour], apart: np.ndarray) -> np.ndarray:
    """(s, n, rows, p) derivatives in the rows of `response.py`; anything for failed steps."""
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
        Memory(np.zeros(shape[:2]), np.zeros(shape), np.zeros(shape), sliders_at_zero((plates, n), elements, count))
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
    """The sides of a path whose chain is `held`, and under whose loads `rows` act, as compiled code takes them."""
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
    """Whether node angles, or bends where they are tied, mean the same shape in both."""
    if "plate" in side.differ and not all(map(np.array_equal, side.chain.plate, chain.plate)):
        return False
    return _equal_in(("disk", "arc", "clamp", "rest") if chain.tied else ("disk", "arc", "clamp"), side, chain)


SHAPED = "stiffness", "offset"
"""Fields of a chain that tell how many plates, nodes and cables it has."""
OF_LOADS = (
    *("tip_efficiency", "disk_efficiency", "gain", "quadratic", "play", "zero_drift"),
    *("friction_rate", "friction_reference", "friction_excess", "friction_decay"),
)
"""Fields of a chain that say what of the loads acts, beside those that always act."""


def _same_loads(side: Neighbour, problem: LoadedChain) -> bool:
    """Whether equal loads act, under recorded ones that are the same and not only equal."""
    chain, loads = problem
    return side.loads is loads and _equal_in(OF_LOADS, side, chain) and _same_constant(side, chain)


def _same_constant(side: Neighbour, chain: Chain) -> bool:
    """Whether equal loads always act."""
    if "constant" not in side.differ:
        return True
    always, nominal = side.chain.constant, chain.constant
    if always is None or nominal is None:
        return False
    return all(mine.tobytes() == its.tobytes() for mine, its in zip(always, nominal, strict=True))


def _equal_in(names: Sequence[str], side: Neighbour, chain: Chain) -> bool:
    """Whether a side has the values of `chain` in the fields `names`."""
    differ = side.differ.intersection(names)
    return all(np.array_equal(getattr(side.chain, name), getattr(chain, name)) for name in differ)


def _of_one_kind(side: Neighbour, problem: LoadedChain) -> bool:
    """Whether a side has the shapes of arrays, reaches of cables and switches of `problem`, so that numbers alone
    differ."""
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
    return history and slips and _equal_in(("reach", "tied", "edges"), side, nominal)
