"""What is kept of the states that a load path leads to."""

from typing import NamedTuple

import numpy as np

from prb3r.mechanics.bundle import bundle
from prb3r.mechanics.kernel import kernel
from prb3r.mechanics.stability import plate_moments


@bundle
class Path(NamedTuple):
    """What is written of a load path of `s` steps; see `Equilibria` for shapes and units."""

    status: np.ndarray
    reached: np.ndarray
    spent: np.ndarray
    residual: np.ndarray
    q: np.ndarray
    disk: np.ndarray
    tension: np.ndarray
    moment: np.ndarray
    slip: np.ndarray
    beyond: np.ndarray
    slider: np.ndarray
    lowest: np.ndarray
    block: np.ndarray
    """(s, n, nodes, nodes) tangents of the plates where their eigenvalues are left to LAPACK."""


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
    if detail:
        plate_moments(packed, path.moment[s])


@kernel
def write_end(s, kept, path):
    """Keep where the path to step `s` ended; it is not an equilibrium of that step."""
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
    """What differs for tied angles: moments are those of the shared curvature, the residual that of the modes."""
    path.residual[s] = 0.0
    for c in range(len(work.system)):
        path.residual[s] = max(path.residual[s], abs(work.system[c, len(work.system)]))
    if len(path.moment) == 0:
        return
    n = path.moment.shape[2] - 2
    for i in range(path.moment.shape[1]):
        for k in range(n):
            plate = packed.plate[i]
            path.moment[s, i, k + 1] = packed.model[0].stiff * plate.stiffness[k] * (plate.q[k] - plate.rest[k])
        path.moment[s, i, 0], path.moment[s, i, n + 1] = path.moment[s, i, 1], path.moment[s, i, n]
