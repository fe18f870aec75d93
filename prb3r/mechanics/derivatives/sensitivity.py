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
from prb3r.mechanics.derivatives.partials import HeldState, PathStates, Sides
from prb3r.mechanics.derivatives.response import room
from prb3r.mechanics.derivatives.solved_path import FOLLOWS_STATE, SolvedPath, solve_path
from prb3r.mechanics.equilibrium import Equilibria
from prb3r.mechanics.load_row import load_row, rows_of_loads
from prb3r.mechanics.records import Packed, pack
from prb3r.mechanics.tangent import segment_modes
from prb3r.mechanics.variation import scratch

TOGETHER = 16
"""Parameters differentiated at a time."""

LoadedChain = tuple[Chain, Loads]


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
    chain, loads, equilibria, steps = solved.chain, solved.loads, solved.equilibria, solved.states
    _check(solved, directions)
    rows, n, cables = acting(chain, loads), chain.stiffness.shape[1], len(chain.reach)
    pose = np.zeros((3, loads.steps, chain.plates + 1, len(directions)))
    tension = np.empty((loads.steps, chain.plates, cables, len(directions)))
    slip = np.empty((loads.steps, chain.plates, cables if chain.presliding > 0 else 0, len(directions)))
    pose[0, :, 0] = [(along.behind[0].disk - along.ahead[0].disk) / (2 * along.apart) for along in directions]
    for first in range(0, len(directions), TOGETHER):
        part = slice(first, first + TOGETHER)
        changes = _derivatives((chain, loads), rows, directions[part], steps)
        for row in range(3):
            pose[row, :, 1:, part] = changes[:, :, n + row]
        tension[..., part] = changes[:, :, n + 3 : n + 3 + cables]
        slip[..., part] = changes[:, :, n + 3 + 2 * cables :]
    failed = np.isnan(equilibria.angle[:, -1])
    pose[:, failed], tension[failed], slip[failed] = np.nan, np.nan, np.nan
    return Sensitivities(equilibria, pose[0], pose[1], pose[2], tension, slip)


def _check(solved: SolvedPath, directions: Sequence[Direction]) -> None:
    """Raise ValueError where `directions` are not parameters of `solved`; see `derivatives`."""
    if not directions:
        raise ValueError("sensitivities need at least one direction")
    kind = _kind(solved.chain, solved.loads)
    for number, along in enumerate(directions):
        for chain, loads in (along.ahead, along.behind):
            if chain.closure:
                raise ValueError(FOLLOWS_STATE)
            if _kind(chain, loads) != kind:
                raise ValueError(f"direction {number} changes the kind of the chain or of its loads, not numbers alone")


def _derivatives(problem: LoadedChain, rows: Loads, directions: Sequence[Direction], steps: PathStates) -> np.ndarray:
    """(s, n, rows, p) derivatives in the rows of `response.py`; anything for failed steps."""
    chain = problem[0]
    (plates, n), cables, count = chain.stiffness.shape, len(chain.reach), len(directions)
    elements = chain.hysteresis.slipping
    packed, held, history = pack(chain), pack(chain, held=True), chain.presliding > 0
    height = n + 3 + (3 if history else 1) * cables
    acts = [rows if _same_loads(side, problem) else acting(*side) for side in _problems(directions)]
    sides = _sides(problem, acts, held, directions, np.zeros((2, plates, height)))
    dead = any(act.force.any() or act.tip.any() for act in (rows, *acts))
    dead |= any(model["umbilical"].any() for model in (packed.model, sides.packed.model))
    shape = (plates, cables, count)
    memories = (
        Memory(np.zeros(shape[:2]), np.zeros(shape), np.zeros(shape), sliders_at_zero((plates, n), elements, count))
        for _ in range(2)
    )
    modes = segment_modes(chain) if chain.tied else None
    tied = 0 if modes is None else modes.shape[2]
    state = HeldState(
        rows=rows_of_loads(rows),
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
    differentiate(packed, held, sides, steps, modes, space)
    return space.out


def _problems(directions: Sequence[Direction]) -> list[LoadedChain]:
    """Ahead and behind of each parameter, in turn."""
    return [side for along in directions for side in (along.ahead, along.behind)]


def _sides(
    problem: LoadedChain, acts: list[Loads], held: Packed, directions: Sequence[Direction], out: np.ndarray
) -> Sides:
    """The problems ahead and behind of `problem`, which is `held`, with what acts in each of them."""
    chain = problem[0]
    problems = _problems(directions)
    chains = [held if side is chain else pack(side, held=True) for side, _ in problems]
    return Sides(
        packed=Packed(*(_stack(field) for field in zip(*chains, strict=True))),
        alike=np.array([_same_shape(side, chain) for side, _ in problems]),
        rows=np.stack([rows_of_loads(act) for act in acts], axis=1),
        apart=np.array([along.apart for along in directions], float),
        now=load_row(acts[0]),
        out=out,
    )


def _stack(fields: Sequence[np.ndarray]) -> np.ndarray:
    """As `np.stack`, which copies records number by number."""
    return np.stack([field.view(np.uint8) for field in fields]).view(fields[0].dtype)


def _same_shape(side: Chain, chain: Chain) -> bool:
    """Whether node angles, or bends where they are tied, mean the same shape in both."""
    names = ("disk", "arc", "clamp", "rest") if chain.tied else ("disk", "arc", "clamp")
    pairs = [(getattr(side, name), getattr(chain, name)) for name in names]
    pairs += zip(side.plate, chain.plate, strict=True)
    return all(first is other or np.array_equal(first, other) for first, other in pairs)


def _same_loads(side: LoadedChain, problem: LoadedChain) -> bool:
    """Whether the same loads act, and not only equal ones."""
    (chain, loads), (nominal, nominal_loads) = side, problem
    names = (
        "tip_efficiency",
        "disk_efficiency",
        "gain",
        "quadratic",
        "zero_drift",
        "friction_rate",
        "friction_reference",
        "friction_excess",
        "friction_decay",
    )
    same = loads is nominal_loads and chain.constant is nominal.constant
    if not same:
        return False
    pairs = ((getattr(chain, name), getattr(nominal, name)) for name in names)
    return all(one is other or np.array_equal(one, other) for one, other in pairs)


def _kind(chain: Chain, loads: Loads) -> tuple:
    """What problems ahead and behind must share: shapes of arrays, reaches of cables, switches of the chain."""
    shapes = chain.stiffness.shape, chain.offset.shape, chain.plate.turn.shape, *(field.shape for field in loads)
    slips = chain.hysteresis.slipping
    return shapes, chain.reach.tolist(), chain.tied, chain.edges, chain.presliding > 0, slips
