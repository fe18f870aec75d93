"""What relaxes in the plates of the rig from step to step.

Of the moment by its law a plate loses, in the long run, the same share everywhere.  The lost moment, of a plate's mean,
is followed from step to step as if its law's moment were all the time that at the end of the step.
"""

import numpy as np
from numba import njit

from prb3r.proof.rig.arrays import Bent, Rig, Slips
from prb3r.proof.rig.balance import AppliedLoads, RigBalance, forces_of, rig_at
from prb3r.proof.rig.build import BuiltRig
from prb3r.proof.rig.imbalance import wrenches
from prb3r.proof.rig.plate import bent_alone, bent_beside_wires

PARTS_OF_ARC = 64
"""Parts of an arc over which its moment is averaged, by the midpoint rule: the error falls with their square."""


def relaxing(built: BuiltRig, load: AppliedLoads, waited: float, relaxed: np.ndarray) -> AppliedLoads:
    """The loads of a step at the end of the time `waited` since the step before, when the moments `relaxed` (n,) had
    been lost."""
    if built.relaxation == 0:
        return load
    left = np.exp(-waited / built.relaxation_time)
    return load._replace(fresh=np.full(1, (1 - left) * built.relaxation), relaxed=left * relaxed)


def lost_moments(built: BuiltRig, load: AppliedLoads, state: RigBalance) -> np.ndarray:
    """(n,) moments lost at the end of a step with its loads, of :func:`relaxing`, in balance."""
    if built.relaxation == 0:
        return load.relaxed
    fresh = load.fresh[0]
    return load.relaxed + fresh / (1 - fresh) * _borne(rig_at(built, load), forces_of(built, load), state)


def _borne(rig: Rig, forces, state: RigBalance) -> np.ndarray:
    """(n,) mean moments that the plates themselves bear, without the cables that bend with them, N m."""
    slips = Slips(state.memory.slip, np.zeros(state.memory.slip.shape, bool))
    wrench, *_ = wrenches(rig, forces, slips, state.ends)
    return np.array([_mean_moment(rig, i, wrench[i]) for i in range(len(wrench))])


@njit(cache=True)
def _mean_moment(rig, i, wrench):
    """Mean moment along the arc of plate `i` under a wrench at its start, less what wires bear, N m."""
    moment, force_x, force_y = wrench
    untouched = np.zeros((1, 1, 2))
    bent, h = Bent(untouched, untouched), rig.arc[i] / PARTS_OF_ARC
    x = y = total = 0.0
    angle = (rig.compliance + (rig.base_compliance if i == 0 else 0.0)) * moment
    for _ in range(PARTS_OF_ARC):
        k, there = 0.0, moment - x * force_y + y * force_x
        for half in range(2):  # the curvature in the middle of a part, from that at its beginning
            if rig.wires[i] > 0:
                k, _ = bent_beside_wires(rig, i, there, 0, bent)
            else:
                k, _ = bent_alone(rig, i, there, 0, bent)
            if half == 0:
                middle = angle + h / 4 * (rig.rest[i] + k)
                over, up = x + h / 2 * np.cos(middle), y + h / 2 * np.sin(middle)
                there = moment - over * force_y + up * force_x
        total += there - rig.wires[i] * k
        along = angle + h / 2 * (rig.rest[i] + k)
        x, y, angle = x + h * np.cos(along), y + h * np.sin(along), angle + h * (rig.rest[i] + k)
    return total / PARTS_OF_ARC
