r"""The only statement of equilibrium of the package: residual and tangent of one plate.

The chain is cut at each node `P_k` of a plate.  The part beyond carries the tension of every cable that crosses the
plate and the dead loads further out (Eq. 8-10, 12); in the frame of the plate's proximal disk

    r_k = K_k (q_k - rest_k) - [ moment + extra - P_k x force ]

with `force` and `moment` (about the frame's origin) of cables and dead loads together, and `extra` on the arc itself.
Plates nearer to the base enter only through the frame and through the tensions and directions with which cables arrive;
plates nearer to the tip only through the dead loads, whose forces are known and whose total moment about the world
origin is one scalar.
"""

from prb3r.mechanics.angle import cos_sin
from prb3r.mechanics.bending import contact, law_of_plate
from prb3r.mechanics.cable import linearise_pull, pull_cables
from prb3r.mechanics.kernel import kernel
from prb3r.mechanics.lanes.number import where


@kernel
def place_plate(model, plate):
    """Write links, nodes, distal end and bend of a plate for its node angles `q` (Eq. 3, 4)."""
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
    """Write the derivatives by the node angles of the plate's distal end to `plate.dend`, after `place_plate`."""
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
    """Write the residual of one plate [Eq. 12], N m, and return its largest unbalanced node angle, rad: the residual
    moment over the stiffness of the node.

    `plate` holds node angles and dead loads, `cable` the cables as they arrive; writes `plate` and `span`.  The nodes
    of a plate whose shape is held (see `derivatives/partials.py`) have been placed before.
    """
    if plate.tangent.shape[1] > 0:  # known when compiled
        place_plate(model, plate)
    pull_cables(model, plate, span, cable)
    fx, fy = plate.wrench[0] + plate.load[0], plate.wrench[1] + plate.load[1]
    moment = plate.wrench[2] + plate.load[2] + plate.extra - contact(plate)[0]
    largest = 0.0
    for k in range(plate.q.shape[0]):
        x, y, stiffness = plate.node[0, k], plate.node[1, k], plate.stiffness[k]
        angle = plate.q[k] - plate.rest[k]
        elastic, slope = angle, 1.0
        if not model.linear:
            elastic, slope = law_of_plate(model, plate, k, angle)
        plate.slope[k] = slope
        carried = model.stiff * stiffness * elastic + plate.cable_stiffness[k] * angle
        residual = carried - moment + (x * fy - y * fx)
        plate.residual[k] = residual
        error = abs(residual) / stiffness
        largest = where(error <= largest, largest, error)  # NaN too
    return largest


@kernel
def linearise_plate(model, plate, span):
    """Write the derivatives of a plate's residual (its tangent, N m/rad), end and cables by its node angles, after
    `unbalance_plate`."""
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
        plate.tangent[k, k] += model.stiff * plate.stiffness[k] * plate.slope[k] + plate.cable_stiffness[k]


@kernel
def balance_plate(model, plate, span, cable):
    """Write the residual and, where the record has room for derivatives, the tangent of one plate.

    Returns what `unbalance_plate` returns.
    """
    largest = unbalance_plate(model, plate, span, cable)
    if plate.tangent.shape[1] > 0:
        linearise_plate(model, plate, span)
    return largest
