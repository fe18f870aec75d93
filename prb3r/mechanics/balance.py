r"""The only statement of equilibrium: what one plate feels, and how that changes.

A plate is cut free at each of its nodes `P_k`.  The part beyond carries the tension of every cable that crosses the
plate and the dead loads further out (Eq. 8-10, 12); in the frame of the plate's proximal disk

    r_k = K_k (q_k - rest_k) - [ moment + extra - P_k x force ]

with `force` and `moment` (about the frame's origin) of cables and dead loads together, and `extra` on the arc itself.
Plates further in enter only through the tensions and directions with which cables arrive and through the frame; plates
further out only through the dead loads, whose forces are known and whose total moment about the world origin is one
scalar.
"""

from prb3r.mechanics.angle import cos_sin
from prb3r.mechanics.bending import contact, law_of_plate
from prb3r.mechanics.cable import linearise_pull, pull_cables
from prb3r.mechanics.kernel import kernel
from prb3r.mechanics.lanes.number import where


@kernel
def place_plate(model, plate):
    """Nodes and distal end of a plate for its node angles `q` (Eq. 3, 4)."""
    arc, clamp = plate.arc, plate.clamp
    n, links = plate.q.shape[0], plate.link.shape[1]
    bend, end_x, end_y = 0.0, clamp, 0.0
    for j in range(links):
        psi = 0.0
        for k in range(n):
            psi += model.turn[j, k] * plate.q[k]
        c, s = cos_sin(psi)
        plate.link[0, j], plate.link[1, j] = arc * c, arc * s
        end_x += model.end[j] * plate.link[0, j]
        end_y += model.end[j] * plate.link[1, j]
    for k in range(n):
        bend += plate.q[k]
        x, y = clamp, 0.0
        for j in range(links):
            x += model.reach[k, j] * plate.link[0, j]
            y += model.reach[k, j] * plate.link[1, j]
        plate.node[0, k], plate.node[1, k] = x, y
    plate.axis[0], plate.axis[1] = cos_sin(bend)
    plate.bend = bend
    along, across = clamp * plate.axis[0], clamp * plate.axis[1]
    plate.end[0], plate.end[1] = end_x + along, end_y + across


@kernel
def linearise_shape(model, plate):
    """Derivatives by the node angles of the distal end of a plate that has been placed."""
    along, across = plate.clamp * plate.axis[0], plate.clamp * plate.axis[1]
    for p in range(plate.dend.shape[1]):
        dx, dy = -across, along
        for j in range(plate.link.shape[1]):
            share = model.end[j] * model.turn[j, p]
            dx -= share * plate.link[1, j]
            dy += share * plate.link[0, j]
        plate.dend[0, p], plate.dend[1, p] = dx, dy


@kernel
def unbalance_plate(model, plate, span, cable):
    """Residual of one plate [Eq. 12]; returns the largest unbalanced node angle, rad.

    `plate` holds node angles and dead loads, `cable` the cables as they arrive; writes `plate` and `span`.  A plate
    whose shape is held (see `derivatives/partials.py`) has been placed.
    """
    if plate.tangent.shape[1] > 0:  # known when compiled
        place_plate(model, plate)
    pull_cables(model, plate, span, cable)
    fx, fy = plate.wrench[0] + plate.load[0], plate.wrench[1] + plate.load[1]
    moment = plate.wrench[2] + plate.load[2] + plate.extra - contact(plate)[0]
    largest = 0.0
    for k in range(plate.q.shape[0]):
        x, y, stiffness = plate.node[0, k], plate.node[1, k], plate.stiffness[k]
        elastic, slope = plate.q[k] - plate.rest[k], 1.0
        if not model.linear:
            elastic, slope = law_of_plate(model, plate, k, elastic)
        plate.slope[k] = slope
        residual = model.stiff * stiffness * elastic - moment + (x * fy - y * fx)
        plate.residual[k] = residual
        error = abs(residual) / stiffness
        largest = where(error <= largest, largest, error)  # NaN too
    return largest


@kernel
def linearise_plate(model, plate, span):
    """Tangent of one plate whose residual is known, and the derivatives of its end and of its cables by its angles."""
    n, links = plate.q.shape[0], plate.link.shape[1]
    linearise_shape(model, plate)
    linearise_pull(model, plate, span)
    fx, fy = plate.wrench[0] + plate.load[0], plate.wrench[1] + plate.load[1]
    help = contact(plate)[1]
    for k in range(n):
        x, y = plate.node[0, k], plate.node[1, k]
        for p in range(n):
            plate.tangent[k, p] = (x * plate.dwrench[1, p] - y * plate.dwrench[0, p]) - plate.dwrench[2, p] + help
        for j in range(links):  # the node moves at right angles to links that turn
            moved = model.reach[k, j] * (plate.link[0, j] * fx + plate.link[1, j] * fy)
            for p in range(n):
                plate.tangent[k, p] -= moved * model.turn[j, p]
        plate.tangent[k, k] += model.stiff * plate.stiffness[k] * plate.slope[k]


@kernel
def balance_plate(model, plate, span, cable):
    """Residual and, where there is room, tangent of one plate; returns what `unbalance_plate` returns."""
    largest = unbalance_plate(model, plate, span, cable)
    if plate.tangent.shape[1] > 0:
        linearise_plate(model, plate, span)
    return largest
