r"""Lowest eigenvalue of the tangent of a chain whose plates are all coupled: by dead loads or by cables that slip.

The tangent of a short chain is written out and handed to LAPACK, which takes time with the cube of the plates and
memory with their square.  That of a long chain is only ever multiplied by a shape, in O(plates): the node angles are
nearly independent of each other but for a few shapes that bend the whole chain, so a few dozen products single out the
lowest of these (Arnoldi's method; Lehoucq, Sorensen and Yang, ARPACK Users' Guide, 1998).
"""

import contextlib

import numpy as np

from prb3r.mechanics.chain import Loads
from prb3r.mechanics.records import Packed
from prb3r.mechanics.state import SLIPS_ON
from prb3r.mechanics.tangent import chain_tangent, unit_modes
from prb3r.mechanics.variation import scratch

WRITTEN_OUT = 150
"""Of a tangent that is written out: so many take as long either way."""
SEARCHES = ((40, 5, 1e-9), (80, 5, 1e-6), (80, 100, 1e-3))
"""By products, one after the other until one ends: shapes kept at a time, restarts, and residual of the eigenvector
that is exact enough, of the eigenvalue.  The first ends where the lowest eigenvalue stands apart, as it does where a
branch comes near its end; the others where it is the first of many that are the plates' own."""


def lowest_under_load(packed: Packed, modes: np.ndarray | None, loads: Loads, q: np.ndarray) -> float:
    """Lowest real part of the eigenvalues of the whole tangent at node angles `q`, under one step of loads, N m/rad.

    `modes` (n, nodes, c) tie node angles together; None: they are free.  Slip and cable lengths of the state are in
    `packed`, where friction follows the cables' travel, and sliders, where plates remember; what slips in them is taken
    to slip on.  NaN where the tangent is not finite, or is large and its lowest eigenvalue could not be singled out.
    """
    packed.plate["q"][:-1] = q
    springs = packed.plate["q"] - packed.plate["rest"]
    packed.plate["slider"] -= SLIPS_ON * (springs[..., None] - packed.plate["slider"])
    packed.model["stiff"] = 1 - packed.model["softening"] * loads.elapsed
    if modes is None and q.size > WRITTEN_OUT:
        return _lowest_by_products(packed, loads, q)
    modes = unit_modes(q.shape) if modes is None else modes
    work = scratch(packed, modes.shape[2])
    chain_tangent(packed, loads.tension, loads.slip, loads.force, loads.tip, modes, work)
    tangent = work.system[:, :-1]
    return float(np.linalg.eigvals(tangent).real.min()) if np.isfinite(tangent).all() else np.nan


def _lowest_by_products(packed: Packed, loads: Loads, q: np.ndarray) -> float:
    from scipy.sparse.linalg import ArpackError, LinearOperator, eigs

    work = scratch(packed, 1)

    def times(shape: np.ndarray) -> np.ndarray:
        modes = np.ascontiguousarray(shape, float).reshape(*q.shape, 1)
        chain_tangent(packed, loads.tension, loads.slip, loads.force, loads.tip, modes, work)
        return work.column.ravel()

    begin = np.linspace(1.0, 2.0, q.size)  # shared by no symmetry of a chain; the same in every run
    if not np.isfinite(times(begin)).all():
        return np.nan
    tangent = LinearOperator((q.size, q.size), matvec=times, dtype=float)
    for shapes, restarts, exact in SEARCHES:
        with contextlib.suppress(ArpackError):  # among them that it has not ended
            values = eigs(
                tangent, 1, which="SR", v0=begin, ncv=shapes, tol=exact, maxiter=restarts, return_eigenvectors=False
            )
            return float(values.real.min())
    return np.nan
