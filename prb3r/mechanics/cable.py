r"""Cables: straight spans from disk to disk, turning at holes and belt friction (Eq. 5-9).

A cable runs straight from the hole `H` on the distal face of a disk to the hole `Q` on the proximal face of the next
and pulls the distal part with ``T (H - Q) / |H - Q|``.  On entering the span its tension has changed by

    T = T_in exp(slip mu |beta - alpha|)                                                               [Eq. 6, 7]

`alpha`, `beta`: directions before and after the hole, relative to the axis of the disk; at the base `alpha` is zero.
"""

from math import atan2, exp, sqrt

from prb3r.mechanics.kernel import kernel


@kernel
def pull_cables(plate, span, cable):
    """Wrench of all cables across one plate on its distal part, and its derivatives by the plate's node angles.

    `cable` (m,): tension, approach and declared slip as each enters the holes of the proximal disk.  Reads the distal
    end from `plate`, writes the wrenches to `plate` and `span` (m,).  An idle cable needs nothing.
    """
    n = plate.q.shape[0]
    c, s = plate.axis[0], plate.axis[1]
    for d in range(3):
        plate.wrench[d] = 0.0
        for p in range(n):
            plate.dwrench[d, p] = 0.0
    for j in range(len(span)):
        out = span[j]
        out.tension = 0.0
        pull = cable[j].tension
        if pull == 0.0 or not out.present:
            continue
        offset = out.offset
        x, y = plate.end[0] - offset * s, plate.end[1] + offset * c - offset  # Q - H
        per_length = 1.0 / sqrt(x * x + y * y)
        direction = atan2(y, x)
        rate = cable[j].slip * out.friction
        if rate != 0.0:
            turn = direction - cable[j].approach
            pull *= exp(rate * abs(turn))
            if turn < 0.0:
                rate = -rate
        fx, fy = -x * pull * per_length, -y * pull * per_length
        out.direction, out.tension, out.rate = direction, pull, rate
        out.wrench[0], out.wrench[1], out.wrench[2] = fx, fy, -offset * fx
        for d in range(3):
            plate.wrench[d] += out.wrench[d]
        for p in range(n):
            dx, dy = (plate.dend[0, p] - offset * c) * per_length, (plate.dend[1, p] - offset * s) * per_length
            ddirection = (x * dy - y * dx) * per_length
            relative = rate * ddirection - (x * dx + y * dy) * per_length  # d ln(T / |Q - H|)
            dfx, dfy = relative * fx - dx * pull, relative * fy - dy * pull
            out.ddirection[p] = ddirection
            plate.dwrench[0, p] += dfx
            plate.dwrench[1, p] += dfy
            plate.dwrench[2, p] -= offset * dfx
