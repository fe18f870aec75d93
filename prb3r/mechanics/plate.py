r"""Plate models: how one flexible plate is reduced to a few nodes that bend.

Every model is given by the same four arrays, so springs and collocation share one balance and one solver.  A plate of
arc length `l` has `n` nodes that turn by the angles `q` (rad), and `m` links that run from node to node:

    psi = turn @ q                     direction of each link, relative to the plate's proximal end
    P_k = l * reach[k] @ (cos psi, sin psi)    position of node k
    E   = l * end @ (cos psi, sin psi)         distal end of the arc;  its direction is sum(q)
    M_k = stiffness[k] * EI / l * q_k          elastic moment at node k

* Pseudo-rigid-body (PRB) models put springs at the nodes and rigid links between them (Eq. 1-4, Table 1).
* The elastica is collocated at Gauss-Legendre points: the node turns by ``q_k = w_k l kappa_k``, the implicit
  Runge-Kutta matrix `A` integrates curvature to direction and direction to position.  Order 2 n in the plate length.
"""

from functools import cache
from typing import NamedTuple

import numpy as np

CHEN = ((0.125, 0.35, 0.388, 0.136), (3.25, 2.84, 2.95))
"""Characteristic radius factors and spring coefficients of Chen, Xiong and Huang, Precis. Eng. 35 (2011) 505,
with the coefficient of the first spring restored (Table 1 prints 1, but a pure moment needs ``sum(1 / c) = 1``)."""

SU = ((0.10, 0.35, 0.40, 0.15), (3.51, 2.99, 2.58))
"""Su, J. Mech. Robot. 1 (2009) 021008."""

ONE_HINGE = ((0.5, 0.5), (1.0,))
"""PRB 1R for a pure moment: one spring in the middle of the arc, as stiff as the arc."""

HOWELL_TIP_FORCE = ((0.15, 0.85), (2.25,))
"""PRB 1R for a tip force (Howell, Compliant Mechanisms, 2001); it fails under moments."""

GAUSS_POINTS = 4
"""Collocation points per plate of the elastica: the error is below 1e-5 of the length up to plates that bend by more
than 1 rad."""


class PlateModel(NamedTuple):
    """A plate model for `n` nodes and `m` links; see the module's text for the meaning of each array."""

    turn: np.ndarray
    """(m, n) direction of each link per angle of each node, 1."""
    reach: np.ndarray
    """(n, m) weight of each link in the position of each node, in arc lengths."""
    end: np.ndarray
    """(m,) weight of each link in the position of the arc's distal end, in arc lengths."""
    stiffness: np.ndarray
    """(n,) node stiffness in units of ``EI / l``, which is also the curvature per node angle in units of ``1 / l``."""


def hinged_links(radius_factors: tuple[float, ...], stiffness: tuple[float, ...]) -> PlateModel:
    """The pseudo-rigid-body model of rigid links joined by springs.

    Parameters
    ----------
    radius_factors : (n + 1) characteristic radius factors: lengths of the links in arc lengths, normalised to sum 1.
    stiffness : (n) spring coefficients c_k of the hinges, in units of ``EI / l``.
    """
    links = np.asarray(radius_factors, float) / np.sum(radius_factors)
    n = len(stiffness)
    before = np.tri(n + 1, n, -1)  # link j has turned with every hinge before it
    return PlateModel(before, np.tri(n, n + 1) * links, links, np.asarray(stiffness, float))


def gauss_collocation(points: int = GAUSS_POINTS) -> PlateModel:
    """The elastica by collocation of curvature at `points` Gauss-Legendre points per plate.

    The Runge-Kutta matrix integrates the Lagrange polynomials exactly (Hairer, Norsett and Wanner, Solving
    Ordinary Differential Equations I, II.7).
    """
    nodes, weights = np.polynomial.legendre.leggauss(points)
    nodes, weights = (nodes + 1) / 2, weights / 2
    powers = np.vander(nodes, increasing=True)
    order = np.arange(1, points + 1)
    integral = (nodes[:, None] ** order / order) @ np.linalg.inv(powers)
    return PlateModel(integral / weights, integral, weights, 1 / weights)


def with_end_hinges(model: PlateModel) -> PlateModel:
    """The model with one more node, a hinge, at each end of the arc.

    The stiffness of these hinges is no multiple of ``EI / l``: it is NaN here and stands in `Chain.stiffness`.
    """
    links = len(model.end)
    turn = np.hstack([np.ones((links, 1)), model.turn, np.zeros((links, 1))])
    reach = np.vstack([np.zeros(links), model.reach, model.end])
    return PlateModel(turn, reach, model.end, np.concatenate([[np.nan], model.stiffness, [np.nan]]))


@cache
def plate_model(model: str, hinges: str = "chen") -> PlateModel:
    """The plate model by the names `model` and `hinges` of a manipulator file.

    Constant curvature is an elastica whose nodes are tied to one bend per segment later (`Chain.tied`).
    """
    if model in ("elastica", "constant-curvature"):
        return gauss_collocation()
    return hinged_links(*{"chen": CHEN, "su": SU, "one": ONE_HINGE, "howell": HOWELL_TIP_FORCE}[hinges])
