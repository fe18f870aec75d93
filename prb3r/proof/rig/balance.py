"""Loads of the rig, and its balance at the end of a sub-step or at rest."""

from typing import NamedTuple

import numpy as np

from prb3r.proof.rig.arrays import Forces, Rig, RigMemory, plates_remember
from prb3r.proof.rig.build import BuiltRig
from prb3r.proof.rig.iteration import iterate

SHORTEST_SUBSTEP = 1e-10
"""Shortest sub-step, in parts of a load step: where a shorter one would be needed the path ends, at a limit load."""


class AppliedLoads(NamedTuple):
    """Loads of one step; between two steps every field varies linearly.

    Tensions (m,) in N, declared slips (m,), forces on disks (n, 2) and tip (2,) in N, number (1,) of steps taken
    before, factor on the friction of each cable (m,), share (1,) of the moments by the plates' laws that has relaxed
    since the step before, and what is left of the moments (n,) that had relaxed by then, N m.
    """

    tension: np.ndarray
    slip: np.ndarray
    disk: np.ndarray
    tip: np.ndarray
    elapsed: np.ndarray
    rubbing: np.ndarray
    fresh: np.ndarray
    relaxed: np.ndarray


class LoadRamp(NamedTuple):
    """The linear change of loads from one step to the next."""

    begin: AppliedLoads
    end: AppliedLoads

    def at(self, share: float) -> AppliedLoads:
        """Loads at a share (0 to 1) of the ramp."""
        return AppliedLoads(*((1 - share) * a + share * b for a, b in zip(*self, strict=True)))


class RigBalance(NamedTuple):
    """An equilibrium: end poses (n, 3) of the plates (see `imbalance`), the memory that the next sub-step starts from
    and the span tensions (n, m) in N."""

    ends: np.ndarray
    memory: RigMemory
    tension: np.ndarray


def forces_of(built: BuiltRig, loads: AppliedLoads, constant: float = 1.0) -> Forces:
    """Forces on the rig under applied loads: drift and offset of tensions added (never below zero), the lost share of
    tip and disk loads taken off, constant forces added, dead loads turned against a tilted base.  `constant` (0 to 1)
    is the share of the constant effects."""
    disk = built.disk_efficiency * loads.disk + constant * built.disk_force
    tip = built.tip_efficiency * loads.tip + constant * built.tip_force
    if built.tilt:
        disk, tip = (_turned(force, -built.tilt) for force in (disk, tip))
    tension = loads.tension + loads.elapsed * built.tension_drift + constant * built.tension_offset
    return Forces(np.maximum(tension, 0), disk, tip)


def _turned(force: np.ndarray, angle: float) -> np.ndarray:
    """(..., 2) forces turned anticlockwise by an angle, rad."""
    turned = (force[..., 0] + 1j * force[..., 1]) * np.exp(1j * angle)
    return np.stack([turned.real, turned.imag], -1)


def rig_at(built: BuiltRig, loads: AppliedLoads) -> Rig:
    """The rig under given loads: plates and hinges softened by the steps before and by what relaxes, friction times the
    loads' factors."""
    left = (1 - built.softening * loads.elapsed[0]) * (1 - loads.fresh[0])
    rig = built.rig
    return rig._replace(
        friction=loads.rubbing * rig.friction,
        pulley=loads.rubbing * rig.pulley,
        drags=loads.rubbing * rig.drags,
        rigidity=left * rig.rigidity,
        compliance=rig.compliance / left,
        base_compliance=rig.base_compliance / left,
        moment=rig.moment + loads.relaxed,
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


def _iterate(
    rig: Rig, forces: Forces, memory: RigMemory, ends: np.ndarray, elements: int, careful: bool
) -> RigBalance | None:
    """The balance by Newton's iteration from `ends`; None if it does not converge."""
    try:
        converged, ends, slip, beyond, bent, tension = iterate(rig, forces, memory, ends, elements, careful)
    except np.linalg.LinAlgError:
        return None
    return RigBalance(ends, RigMemory(slip, beyond, bent), tension) if converged else None


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
