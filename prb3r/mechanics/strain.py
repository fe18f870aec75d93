"""Bending strain of the plates' outermost fibres, from the bending moment along their arcs: strain = M c / EI."""

from functools import reduce

import numpy as np

from prb3r.mechanics.equilibrium import Equilibria


def plate_strain(states: Equilibria, bending_stiffness: np.ndarray, outer_fibre: np.ndarray) -> np.ndarray:
    """(s, n, nodes + 2) bending strain of the outermost fibre where each arc begins, at its nodes and where it ends.

    It is that of a linear plate under the same moment; a bending law that softens is not taken into account.

    Parameters
    ----------
    states : with `detail`, as `moment` is read.
    bending_stiffness : (n,) EI, N m^2.
    outer_fibre : (n,) distance of the outermost fibre from the neutral axis, m.
    """
    return states.moment / bending_stiffness[:, None] * outer_fibre[:, None]


def peak_strain(states: Equilibria, bending_stiffness: np.ndarray, outer_fibre: np.ndarray) -> np.ndarray:
    """(s, n) largest magnitude of the bending strain of each plate; see :func:`plate_strain`."""
    first, *others = np.moveaxis(np.abs(states.moment), -1, 0)
    largest = reduce(np.maximum, others, first)  # ten times as fast as np.max along so short an axis
    return largest / bending_stiffness * outer_fibre
