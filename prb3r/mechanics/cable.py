r"""Cables: straight spans from disk to disk, turns at the holes and belt friction (Eq. 5-9).

A cable runs straight from the hole `H` on the distal face of a disk to the hole `Q` on the proximal face of the next
disk and pulls the distal part with ``T (H - Q) / |H - Q|``.  At a hole friction changes its tension to

    T = T_in exp(slip mu |beta - alpha|)                                                               [Eq. 6, 7]

with the directions `alpha` before and `beta` after the hole, relative to the axis of the disk; at the base `alpha` is
zero.  Where both edges of a hole rub, ``|alpha| + |beta|`` takes the place of ``|beta - alpha|``.  A cable that is
stiff against bending does not lie against the hole over the whole turn: a turn t may count as ``t / (1 + c t)``.  `mu`
may fall or grow with the tension before the hole, as ``mu_0 (T_in / T_0)^-p`` (Howell and Mazur, J. Text. Inst. 44
(1953) T59: friction as the power 1 - p of the force).

A drag `d` in the holes that does not grow with the tension changes it by a further factor: where the cable is paid out
``(1 + x)^slip``, and where it is drawn in ``(1 - x)^-slip`` with ``x = d / (T_in^2 + d^2 / 4)^(1/2)``.  So at full slip
the tension grows or falls by d.  Where a hole would hold more than the share `MOST_HELD`, the logarithm falls on in a
straight line: a slack cable that is drawn in keeps 0.4 % of its tension, and one that is paid out has three times as
much.

The slip is declared, or it follows from the cable's own travel: when the cable length beyond a hole shortens by the
presliding length, the hole has gone from rest to full slip toward the base.
"""

from math import copysign, log, sqrt, tanh

from prb3r.mechanics.angle import direction_of, exponential
from prb3r.mechanics.kernel import kernel
from prb3r.mechanics.lanes.number import every

LEAN = 0.005
"""Bend of a plate over which a cable with clearance comes to lie against the inner side of its holes, rad: it is moved
by the clearance times tanh(bend / LEAN)."""


MOST_HELD = 0.7
"""Share of a tension that a hole holds back, up to which its drag is a plain force.  Choice: down to tensions of 1.4
times the drag, with slopes that stay finite at none."""


@kernel
def measure_span(model, plate, out):
    """Write the direction, the length and the offset of one cable's span across a plate to its record `out`.

    A cable with clearance lies against the inner side of its holes, which moves both ends of the span alike.  The angle
    of the span (rad) is computed only where friction needs it.
    """
    c, s = plate.axis[0], plate.axis[1]
    offset, out.moved = out.offset, 0.0
    if model.clearance != 0.0:
        lean = tanh(plate.bend / LEAN)
        offset += model.clearance * lean
        out.moved = model.clearance * (1.0 - lean * lean) / LEAN
    x, y = plate.end[0] - offset * s, plate.end[1] + offset * c - offset  # Q - H
    length = sqrt(x * x + y * y)
    per_length = 1.0 / length
    out.along[0], out.along[1] = x * per_length, y * per_length
    out.length, out.hole = length, offset
    if out.rubs:
        out.direction = direction_of(x, y)


@kernel
def linearise_span(plate, out):
    """Write the derivatives by the node angles of a span's direction and length to `out`, after `measure_span`."""
    c, s, ux, uy = plate.axis[0], plate.axis[1], out.along[0], out.along[1]
    per_length = 1.0 / out.length
    turned_x, turned_y = out.hole * c + out.moved * s, out.hole * s - out.moved * (c - 1.0)
    for p in range(plate.dend.shape[1]):
        dx, dy = plate.dend[0, p] - turned_x, plate.dend[1, p] - turned_y
        out.ddirection[p], out.dlength[p] = (ux * dy - uy * dx) * per_length, ux * dx + uy * dy


@kernel
def rubbing_part(turn, saturation):
    """The part of a turn at a hole that rubs, rad, never negative, and its derivative by the turn (rad, signed).

    A turn t counts as t / (1 + `saturation` t), `saturation` in 1/rad.
    """
    share = 1.0 / (1.0 + saturation * abs(turn))
    return abs(turn) * share, copysign(share * share, turn)


@kernel
def drag_of_hole(model, tension, slip):
    """Derivative of the log tension behind a hole by the slip, as the drag makes it, and the derivative of that by the
    log tension before the hole."""
    drag = model.hole_drag
    square = tension * tension + drag * drag / 4.0
    share = drag / sqrt(square)
    grows = -share * tension * tension / square
    if slip > 0.0:
        return log(1.0 + share), grows / (1.0 + share)
    left = 1.0 - min(share, MOST_HELD)
    return max(share - MOST_HELD, 0.0) / left - log(left), grows / left


@drag_of_hole.where_in_lanes
def no_drag(model, tension, slip):
    """`drag_of_hole` for equilibria solved side by side, whose holes have none."""
    return 0.0, 0.0


@kernel
def rub(model, out, cable):
    """Write the friction at the hole before a span to its record `out`: the derivatives of the log tension behind the
    hole by slip (`wrap`), direction, approach and log tension before it.

    `cable` holds the cable as it arrives at the hole.  A tension a little below zero, as beside an idle cable where its
    derivatives are taken, rubs as one above.
    """
    after, before, slip, friction = out.direction, cable.approach, cable.slip, out.friction
    if model.friction_exponent != 0.0:
        friction *= (abs(cable.tension) / model.friction_tension) ** -model.friction_exponent
    if model.edges:
        leaving, grows = rubbing_part(after, model.wrap_saturation)
        entering, grows_in = rubbing_part(before, model.wrap_saturation)
        out.wrap = friction * (leaving + entering)
        out.rate = slip * (friction * grows)
        out.rate_in = slip * (friction * grows_in)
    else:
        turning, grows = rubbing_part(after - before, model.wrap_saturation)
        out.wrap = friction * turning
        out.rate = slip * (friction * grows)
        out.rate_in = -out.rate
    out.passes = 1.0 - model.friction_exponent * slip * out.wrap
    if model.hole_drag != 0.0:
        dragged, grows = drag_of_hole(model, cable.tension, slip)
        out.wrap += dragged
        out.passes += slip * grows


@kernel
def pull_cables(model, plate, span, cable):
    """Compute the wrench of all cables across one plate on its distal part.

    `cable` (m,) holds tension, approach and slip of each as it enters the hole of the proximal disk.  Reads the distal
    end from `plate`; writes tension and wrench of each cable to `span` (m,) and their sum to `plate`.  A cable without
    tension is skipped, but its length is measured where slip follows the travel.
    """
    x, y, moment = 0.0, 0.0, 0.0
    for j in range(len(span)):
        out = span[j]
        out.tension, out.passes = 0.0, 1.0
        pull = cable[j].tension
        if not out.present or (every(pull == 0.0) and model.presliding == 0.0):
            continue
        measure_span(model, plate, out)
        if every(pull == 0.0):
            continue
        out.rate = out.rate_in = out.wrap = 0.0
        if out.friction != 0.0 or model.hole_drag != 0.0:
            rub(model, out, cable[j])
            pull *= exponential(cable[j].slip * out.wrap)
        fx, fy = -out.along[0] * pull, -out.along[1] * pull
        out.tension = pull
        out.wrench[0], out.wrench[1], out.wrench[2] = fx, fy, -out.hole * fx
        x, y, moment = x + fx, y + fy, moment - out.hole * fx
    plate.wrench[0], plate.wrench[1], plate.wrench[2] = x, y, moment


@kernel
def linearise_pull(model, plate, span):
    """Write the derivatives by the node angles of the wrench of all cables to `plate.dwrench`, after `pull_cables`."""
    derivatives = plate.dwrench.shape[1]
    for d in range(3):
        for p in range(derivatives):
            plate.dwrench[d, p] = 0.0
    for j in range(len(span)):
        out = span[j]
        if not out.present or (every(out.tension == 0.0) and model.presliding == 0.0):
            continue
        linearise_span(plate, out)
        if every(out.tension == 0.0):
            continue
        fx, fy = out.wrench[0], out.wrench[1]
        for p in range(derivatives):
            dfx = out.ddirection[p] * (out.rate * fx - fy)
            dfy = out.ddirection[p] * (out.rate * fy + fx)
            plate.dwrench[0, p] += dfx
            plate.dwrench[1, p] += dfy
            plate.dwrench[2, p] -= out.hole * dfx + out.moved * fx
