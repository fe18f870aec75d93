"""Equilibria of the rig by Newton's iteration, with holes that slip or stick.

Over a sub-step the slip state of a hole uses the cable lengths at its end,

    sigma <- clip(sigma + (length beyond the hole: after - before) / presliding, -1, 1),

which is exact while that length moves one way.  Just after a hole begins to slip any small load may change which holes
do, a problem without scale that no halving cures: the careful iteration changes one hole at a time (Katzenelson's way
through piecewise linear equations).
"""

from typing import NamedTuple

import numpy as np

from prb3r.proof.rig.arrays import Bent, Forces, Rig, Slips, plates_remember
from prb3r.proof.rig.build import BuiltRig
from prb3r.proof.rig.kernels import imbalance, lengths_beyond

RESIDUAL, ROUNDED = 1e-11, 1e-8
"""A balance has converged where its gap (bends in rad, positions in plate lengths) is below the first number; or, as
rounding may forbid that, where the last move is below the first and the gap below the second."""
ITERATIONS, LARGEST_MOVE = 25, 0.3
"""Most Newton iterations for a balance; and the largest move of one: bends in rad, positions in plate lengths."""
SHORTEST_SUBSTEP = 1e-10
"""Shortest sub-step, in parts of a load step: where a shorter one would be needed the path ends, at a limit load."""


class AppliedLoads(NamedTuple):
    """Loads of one step; between two steps every field varies linearly.

    Tensions (m,) in N, declared slips (m,), forces on disks (n, 2) and tip (2,) in N, number (1,) of steps taken
    before, and factor on the friction of each cable (m,).
    """

    tension: np.ndarray
    slip: np.ndarray
    disk: np.ndarray
    tip: np.ndarray
    elapsed: np.ndarray
    rubbing: np.ndarray


class LoadRamp(NamedTuple):
    """The linear change of loads from one step to the next."""

    begin: AppliedLoads
    end: AppliedLoads

    def at(self, share: float) -> AppliedLoads:
        """Loads at a share (0 to 1) of the ramp."""
        return AppliedLoads(*((1 - share) * a + share * b for a, b in zip(*self, strict=True)))


class RigMemory(NamedTuple):
    """State from which the next sub-step starts: slip state of each hole and cable length beyond it, (n, m) both, and
    the hysteresis state of the plates (`Bent.after`)."""

    slip: np.ndarray
    beyond: np.ndarray
    bent: np.ndarray

    def slip_at(self, rig: Rig, ends: np.ndarray) -> np.ndarray:
        """Slip states (n, m) at end poses (n, 3), not yet clipped to -1..1; with declared slip, the declared ones."""
        if not np.isfinite(rig.presliding):
            return self.slip
        return self.slip + (lengths_beyond(rig, ends) - self.beyond) / rig.presliding


class RigBalance(NamedTuple):
    """An equilibrium: end poses (n, 3) of the plates (see `kernels`), the memory that the next sub-step starts from and
    the span tensions (n, m) in N."""

    ends: np.ndarray
    memory: RigMemory
    tension: np.ndarray


def forces_of(built: BuiltRig, loads: AppliedLoads, constant: float = 1.0) -> Forces:
    """Forces on the rig under applied loads: drift and offset of tensions added (never below zero), the lost share of
    tip and disk loads taken off, constant forces added.  `constant` (0 to 1) is the share of the constant effects."""
    return Forces(
        np.maximum(loads.tension + loads.elapsed * built.tension_drift + constant * built.tension_offset, 0),
        built.disk_efficiency * loads.disk + constant * built.disk_force,
        built.tip_efficiency * loads.tip + constant * built.tip_force,
    )


def rig_at(built: BuiltRig, loads: AppliedLoads) -> Rig:
    """The rig under given loads: plates and hinges softened by the steps before, friction times the loads' factors."""
    left = 1 - built.softening * loads.elapsed[0]
    rig = built.rig
    return rig._replace(
        friction=loads.rubbing * rig.friction,
        pulley=loads.rubbing * rig.pulley,
        rigidity=left * rig.rigidity,
        compliance=rig.compliance / left,
        base_compliance=rig.base_compliance / left,
    )


def find_balance(rig: Rig, forces: Forces, memory: RigMemory, guess: np.ndarray, elements: int) -> RigBalance | None:
    """The balance at the end of a sub-step that began with `memory`, sought from end poses `guess` (n, 3).

    None if neither the quick nor, where friction follows the load path, the careful iteration converges.  `elements` is
    the number of integration steps along the arc of each plate.
    """
    quick = _iterate(rig, forces, memory, guess, elements, careful=False)
    if quick is not None or not np.isfinite(rig.presliding):
        return quick
    return _iterate(rig, forces, memory, guess, elements, careful=True)


@np.errstate(all="ignore")
def _iterate(
    rig: Rig, forces: Forces, memory: RigMemory, ends: np.ndarray, elements: int, careful: bool
) -> RigBalance | None:
    """The balance by Newton's iteration from `ends`; None if it does not converge.

    If `careful`, each move stops where the first hole begins or ceases to slip.
    """
    lengths = rig.arc + 2 * rig.clamp
    scale = np.stack([lengths, lengths, np.ones_like(lengths)], 1)
    slip = memory.slip_at(rig, ends)
    sticking, moved, bent = np.abs(slip) < 1, np.inf, Bent(memory.bent, np.empty_like(memory.bent))
    for _ in range(ITERATIONS + 2 * slip.size if careful else ITERATIONS):
        slips = Slips(np.minimum(np.maximum(slip, -1), 1), sticking)
        gap, tangent, tension = imbalance(rig, forces, slips, bent, ends, elements)
        error = np.abs(gap / scale).max()
        if error < RESIDUAL or (error < ROUNDED and moved < RESIDUAL):
            return RigBalance(ends, RigMemory(slips.state, lengths_beyond(rig, ends), bent.after), tension)
        if not np.isfinite(error):
            return None
        try:
            move = np.linalg.solve(tangent, -gap.ravel()).reshape(ends.shape)
        except np.linalg.LinAlgError:
            return None
        moved = np.abs(move / scale).max()
        move = move * min(1, LARGEST_MOVE / moved)
        after = memory.slip_at(rig, ends + move)
        if careful:
            part, hole = _first_change(slip, after, sticking)
            if part < 1:
                move = move * max(part, 0)
                sticking[hole] ^= True
                after = memory.slip_at(rig, ends + move)
        else:
            sticking = np.abs(after) < 1
        ends, slip = ends + move, after
    return None


def _first_change(slip: np.ndarray, after: np.ndarray, sticking: np.ndarray) -> tuple[float, tuple[int, ...]]:
    """Part of a move at which the first hole begins or ceases to slip, and the index of that hole.

    `slip` and `after` (n, m) are the unclipped slip states before and after the whole move.  At 1 or more none changes.
    """
    side = np.sign(np.where(sticking, after, slip))
    change = sticking != (side * after < 1)
    part = np.divide(side - slip, after - slip, out=np.ones_like(slip), where=change & (after != slip))
    hole = np.unravel_index(np.argmin(part), part.shape)
    return float(part[hole]), tuple(map(int, hole))


def rest(built: BuiltRig, nothing: AppliedLoads, elements: int) -> RigBalance | None:
    """The balance at rest: no applied load, constant effects raised from zero, slip state zero; None if there is none.

    `nothing` are loads of zero.  The plates have not been bent before.
    """
    rig = built.rig._replace(presliding=np.inf)
    zero, lengths = np.zeros_like(rig.offset), rig.arc + 2 * rig.clamp
    stations = 2 * elements + 1 if plates_remember(rig) else 1
    memory = RigMemory(zero, zero, np.zeros((len(lengths), stations, 2 + rig.loop_springs)))
    state = RigBalance(np.stack([lengths, 0 * lengths, 0 * lengths], 1), memory, zero)
    done, share = 0.0, 1.0
    while done < 1:
        to = min(done + share, 1)
        raised = rig._replace(rest=to * rig.rest)
        after = find_balance(raised, forces_of(built, nothing, to), state.memory, state.ends, elements)
        if after is not None:
            done, state = to, after
        elif share < SHORTEST_SUBSTEP:
            return None
        else:
            share /= 2
    return state
