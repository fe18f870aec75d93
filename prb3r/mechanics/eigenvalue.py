r"""Lowest eigenvalue of the tangent of a chain whose plates are all coupled: by dead loads, or by slip that follows the
cables' travel.

The tangent of a short chain is formed and handed to LAPACK, which takes time with the cube of the plates and memory
with their square.  That of a long chain is never formed, only multiplied by a vector of node angles, in O(plates).  The
node angles are nearly independent of each other but for a few shapes that bend the whole chain, so a few dozen products
single out the lowest eigenvalue (Arnoldi's method; Lehoucq, Sorensen and Yang, ARPACK Users' Guide, 1998).
"""

import contextlib

import numpy as np

from prb3r.mechanics.chain import Loads
from prb3r.mechanics.records import Packed
from prb3r.mechanics.state import SLIPS_ON
from prb3r.mechanics.tangent import chain_tangent, unit_modes
from prb3r.mechanics.variation import scratch

WRITTEN_OUT = 150
"""Most node angles of a chain whose tangent is formed; with as many both methods take the same time."""
SEARCHES = ((40, 5, 1e-9), (80, 5, 1e-6), (80, 100, 1e-3))
"""Settings of Arnoldi's method, tried in turn until one converges: size of the Krylov basis, restarts, and tolerance
relative to the eigenvalue.  The first converges where the lowest eigenvalue stands apart, as it does where a branch
comes near its end; the others where it is the first of many that belong to single plates."""


def lowest_under_load(packed: Packed, modes: np.ndarray | None, loads: Loads, q: np.ndarray) -> float:
    """Lowest real part of the eigenvalues of the whole tangent at node angles `q`, under one step of loads, N m/rad.

    NaN if the tangent is not finite, or if it is large and Arnoldi's method does not converge.

    Parameters
    ----------
    packed : with the remaining stiffness of the state; where friction follows the cables' travel, with its slip and
        cable lengths; where plates have hysteresis, with its sliders, of which those that slip are taken to slip on.
    modes : (n, nodes, c) modes that tie node angles together; None: the angles are free.
    loads : one step without its leading dimension.
    q : (n, nodes) node angles, rad.
    """
    packed.plate["q"][:-1] = q
    springs = packed.plate["q"] - packed.plate["rest"]
    packed.plate["slider"] -= SLIPS_ON * (springs[..., None] - packed.plate["slider"])
    if modes is None and q.size > WRITTEN_OUT:
        return _lowest_by_products(packed, loads, q)
    modes = unit_modes(q.shape) if modes is None else modes
    work = scratch(packed, modes.shape[2])
    chain_tangent(packed, loads.tension, loads.slip, loads.force, loads.tip, modes, work)
    tangent = work.system[:, :-1]
    return float(np.linalg.eigvals(tangent).real.min()) if np.isfinite(tangent).all() else np.nan


def _lowest_by_products(packed: Packed, loads: Loads, q: np.ndarray) -> float:
    """`lowest_under_load` of a long chain with free node angles, by Arnoldi's method."""
    from scipy.sparse.linalg import ArpackError, LinearOperator, eigs

    work = scratch(packed, 1)

    def times(shape: np.ndarray) -> np.ndarray:
        modes = np.ascontiguousarray(shape, float).reshape(*q.shape, 1)
        chain_tangent(packed, loads.tension, loads.slip, loads.force, loads.tip, modes, work)
        return work.column.ravel()

    begin = np.linspace(1.0, 2.0, q.size)  # has no symmetry that a chain has; the same in every run
    if not np.isfinite(times(begin)).all():
        return np.nan
    tangent = LinearOperator((q.size, q.size), matvec=times, dtype=float)
    for shapes, restarts, exact in SEARCHES:
        with contextlib.suppress(ArpackError):  # no convergence is one of these errors
            values = eigs(
                tangent, 1, which="SR", v0=begin, ncv=shapes, tol=exact, maxiter=restarts, return_eigenvectors=False
            )
            return float(values.real.min())
    return np.nan
