"""The arrays to which a load path writes its states, and how each state is written."""

from typing import NamedTuple

import numpy as np

from prb3r.mechanics.bundle import bundle
from prb3r.mechanics.kernel import kernel
from prb3r.mechanics.relaxation import relaxed_before
from prb3r.mechanics.stability import plate_moments


@bundle
class Path(NamedTuple):
    """Results of a load path of `s` steps; fields without a description are those of `Equilibria`.

    Arrays that are not wanted have no steps.
    """

    status: np.ndarray
    """(s, 2) 0 for a solved step, else `FAILED`, `JUMPED` or `GAVE_UP`; and the Newton steps of a solved one."""
    reached: np.ndarray
    spent: np.ndarray
    """(s,) evaluations of a plate that the step took: `Equilibria.work`."""
    residual: np.ndarray
    q: np.ndarray
    disk: np.ndarray
    """(s, n + 1, 3) x and y of the centres (m) and absolute angles (rad) of disks 0..n."""
    tension: np.ndarray
    moment: np.ndarray
    slip: np.ndarray
    beyond: np.ndarray
    """(s, n, m) cable length beyond the hole before each plate, m."""
    slider: np.ndarray
    """(s, n, nodes, elements) node angles, beyond the stress-free ones, at which the sliders stand, rad."""
    stiff: np.ndarray
    """(s,) remaining stiffness of the plates over the initial one, also of steps that failed; for the eigenvalue."""
    lowest: np.ndarray
    """(s,) lowest eigenvalue of the tangent, N m/rad."""
    block: np.ndarray
    """(s, n, nodes, nodes) tangents of the plates, N m/rad, where their eigenvalues are left to LAPACK."""


@kernel
def write_step(packed, s, path):
    """Write the present state to row `s` of the path: disks and largest residual always; angles, sliders, tensions,
    slips and moments where the path has room for them."""
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
                for e in range(path.slider.shape[3]):
                    path.slider[s, i, k, e] = plate.slider[k, e]
            for j in range(path.tension.shape[2]):
                path.tension[s, i, j] = packed.span[i, j].tension
                if len(path.slip) > 0:
                    path.slip[s, i, j], path.beyond[s, i, j] = packed.span[i, j].slip, packed.span[i, j].beyond
    path.residual[s] = largest
    if len(path.stiff) > 0:
        path.stiff[s] = packed.model[0].stiff
    if detail:
        plate_moments(packed, path.moment[s])


@kernel
def write_end(packed, s, kept, path):
    """Write the last accepted state `kept` on the way to a step that failed to row `s` of the path, for its eigenvalue.

    It is not an equilibrium of that step.
    """
    path.stiff[s] = packed.model[0].stiff
    if len(path.q) > 0:
        for i in range(path.q.shape[1]):
            for k in range(path.q.shape[2]):
                path.q[s, i, k] = kept.q[i, k]
                for e in range(path.slider.shape[3]):
                    path.slider[s, i, k, e] = kept.slider[i, k, e]
            if len(path.slip) > 0:
                for j in range(path.slip.shape[2]):
                    path.slip[s, i, j], path.beyond[s, i, j] = kept.slip[i, j], kept.beyond[i, j]


@kernel
def write_tied(packed, s, work, path):
    """Overwrite what differs for tied node angles in row `s` of the path, after `write_step`: moments by the linear law
    of the shared curvature, and as residual the largest unbalanced moment of a mode.
    """
    path.residual[s] = work.unbalanced[0]
    if len(path.moment) == 0:
        return
    n = path.moment.shape[2] - 2
    for i in range(path.moment.shape[1]):
        for k in range(n):
            plate = packed.plate[i]
            borne = packed.model[0].stiff * plate.stiffness[k] * (plate.q[k] - plate.rest[k])
            path.moment[s, i, k + 1] = borne - relaxed_before(packed.model[0], plate)
        path.moment[s, i, 0], path.moment[s, i, n + 1] = path.moment[s, i, 1], path.moment[s, i, n]
