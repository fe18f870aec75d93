"""Manipulator descriptions and readings of states that the tests of the rig share."""

import numpy as np

RIGIDITY, LENGTH, FACE = 187e9 * 0.030 * 0.0008**3 / 12, 0.476, 0.002
ARMS = {"1": 0.0255, "2": 0.021, "3": -0.021, "4": -0.0255}


def prototype(*effects, plates=7, **friction):
    """The paper's manipulator (Table 3), with effects."""
    segment = {"plates": plates, "length_m": 0.030, "clamp_m": 0.008, "width_m": 0.030, "thickness_m": 0.0008}
    return {
        "youngs_modulus_pa": 187e9,
        "gravity_m_s2": 9.785,
        "disk": {"thickness_m": 0.004, "mass_kg": 0.0447},
        "friction": {"coefficient": 0.3, "presliding_m": 3e-5} | friction,
        "segment": [dict(segment), dict(segment)],
        "cable": [{"name": n, "offset_m": y, "ends_at_segment": 2 if n in "14" else 1} for n, y in ARMS.items()],
        "effect": list(effects),
    }


def short(*effects, plates=3, rigidity=RIGIDITY, **friction):
    """One segment of few plates with one cable above and one below."""
    cables = [{"name": n, "offset_m": y, "ends_at_segment": 1} for n, y in (("up", 0.02), ("down", -0.025))]
    segment = {"plates": plates, "length_m": 0.030, "clamp_m": 0.006, "bending_stiffness_n_m2": rigidity}
    segment["outer_fibre_m"] = 4e-4
    return prototype(*effects, **friction) | {"segment": [segment], "cable": cables}


def effect(kind, **parameters):
    return {"kind": kind} | parameters


def point(states, step=-1, disk=-1, face=0.0):
    """A disk's centre, or a point `face` further along its axis."""
    x, y, a = (values[step, disk] for values in (states.x, states.y, states.angle))
    return np.array([x + face * np.cos(a), y + face * np.sin(a)])


def apart(a, b, **where):
    return np.linalg.norm(point(a, **where) - point(b, **where))


def spans(manipulator, states, shift=0.0):
    """Per plate and cable, complex: hole `H`, direction from `H` to `Q`, and the axes of both disks, in the world."""
    axis = np.exp(1j * states.angle[-1])
    centre = states.x[-1] + 1j * states.y[-1]
    offset = np.array([each["offset_m"] for each in manipulator["cable"]]) + shift
    holes = centre[:-1, None] + axis[:-1, None] * (FACE + 1j * offset)
    ends = centre[1:, None] + axis[1:, None] * (-FACE + 1j * offset)
    return holes, (ends - holes) / abs(ends - holes), axis, ends
