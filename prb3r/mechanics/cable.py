r"""Cables: straight spans from disk to disk, turning at holes and belt friction (Eq. 5-9).

A cable runs straight from the hole `H` on the distal face of a disk to the hole `Q` on the proximal face of the next
and pulls the distal part with ``T (H - Q) / |H - Q|``.  On entering the span its tension has changed by

    T = T_in exp(slip mu |beta - alpha|)                                                               [Eq. 6, 7]

`alpha`, `beta`: directions before and after the hole, relative to the axis of the disk; at the base `alpha` is zero.
Where both edges of a hole rub, the exponent has ``|alpha| + |beta|``.  A cable that is stiff against bending does not
lie against a hole over all of a turn: of each turn t may count ``t / (1 + c t)``.  `mu` may fall or grow with the
tension before the hole, as ``mu_0 (T_in / T_0)^-p`` (Howell and Mazur, J. Text. Inst. 44 (1953) T59: friction as the
power 1 - p of the force).
The slip is declared, or it follows from the cable's own travel: when the length beyond a hole shortens by the
presliding length, the hole has gone from rest to full slip toward the base.
"""

from math import copysign, sqrt, tanh

from prb3r.mechanics.angle import direction_of, exponential
from prb3r.mechanics.kernel import kernel
from prb3r.mechanics.lanes.number import every

LEAN = 0.005
"""Bend of a plate at which a cable with clearance has come to lie against the inner side of its holes, rad."""


@kernel
def measure_span(model, plate, out):
    """Direction and length of one cable across a plate, and where its ends are.

    A cable with clearance lies against the inner side of its holes, which moves both ends of the span alike.
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
    """Derivatives by the node angles of the direction and the length of a cable that has been measured."""
    c, s, ux, uy = plate.axis[0], plate.axis[1], out.along[0], out.along[1]
    per_length = 1.0 / out.length
    turned_x, turned_y = out.hole * c + out.moved * s, out.hole * s - out.moved * (c - 1.0)
    for p in range(plate.dend.shape[1]):
        dx, dy = plate.dend[0, p] - turned_x, plate.dend[1, p] - turned_y
        out.ddirection[p], out.dlength[p] = (ux * dy - uy * dx) * per_length, ux * dx + uy * dy


@kernel
def rubbing_part(turn, saturation):
    """How much of a turn at a hole (rad, with its sign) rubs, in rad without a sign, and its derivative by the turn."""
    share = 1.0 / (1.0 + saturation * abs(turn))
    return abs(turn) * share, copysign(share * share, turn)


@kernel
def rub(model, out, cable):
    """Friction coefficient times turning angle at the hole before a span, and how the tension behind depends on it."""
    after, before, slip, friction = out.direction, cable.approach, cable.slip, out.friction
    if model.friction_exponent != 0.0:
        friction *= (cable.tension / model.friction_tension) ** -model.friction_exponent
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


@kernel
def pull_cables(model, plate, span, cable):
    """Wrench of all cables across one plate on its distal part.

    `cable` (m,): tension, approach and slip as each enters the holes of the proximal disk.  Reads the distal end from
    `plate`, writes the wrenches to `plate` and `span` (m,).  An idle cable needs nothing but where travel is followed.
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
        if out.friction != 0.0:
            rub(model, out, cable[j])
            pull *= exponential(cable[j].slip * out.wrap)
        fx, fy = -out.along[0] * pull, -out.along[1] * pull
        out.tension = pull
        out.wrench[0], out.wrench[1], out.wrench[2] = fx, fy, -out.hole * fx
        x, y, moment = x + fx, y + fy, moment - out.hole * fx
    plate.wrench[0], plate.wrench[1], plate.wrench[2] = x, y, moment


@kernel
def linearise_pull(model, plate, span):
    """Derivatives by the node angles of the wrench of all cables, as they have been pulled, in `plate`."""
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
