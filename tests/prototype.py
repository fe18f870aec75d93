"""Chains and loads that many tests share: the paper's prototype, a cantilever, and anything at random."""

import numpy as np

from prb3r.mechanics.chain import Chain, Loads, loads
from prb3r.mechanics.plate import ONE_HINGE, hinged_links, plate_model

LENGTH = 0.476
"""Straight length of the prototype, m: position errors in % are relative to it."""
ARC = 0.014
RIGIDITY = 187e9 * 0.030 * 0.0008**3 / 12
"""Bending stiffness of a plate of the prototype, N m^2."""

PRB_3R, PRB_1R, ELASTICA = plate_model("prb3r"), hinged_links(*ONE_HINGE), plate_model("elastica")


def prototype(mu=0.3, first_segment=1.0, plate=PRB_3R):
    """Section IV and Table 3; `first_segment` multiplies the stiffness of Segment 1."""
    return Chain(
        plate=plate,
        arc=np.full(14, ARC),
        clamp=np.full(14, 0.008),
        disk=0.004,
        stiffness=np.repeat([first_segment, 1], 7)[:, None] * RIGIDITY / ARC * plate.stiffness,
        rest=np.zeros((14, len(plate.stiffness))),
        offset=np.tile([0.0255, 0.021, -0.021, -0.0255], (14, 1)),
        reach=np.array([14, 7, 7, 14]),
        friction=np.full((14, 4), mu),
        segment=np.repeat([0, 1], 7),
    )


def cantilever(plates=1, plate=ELASTICA):
    """A bare plate of unit length and rigidity, in equal parts."""
    none, arc = np.zeros((plates, 0)), np.full(plates, 1 / plates)
    bending = np.tile(plate.stiffness, (plates, 1)) * plates
    return Chain(plate, arc, 0 * arc, 0.0, bending, 0 * bending, none, np.zeros(0, int), none, np.zeros(plates, int))


def random_chain(rng, plate=PRB_3R, plates=6, cables=3):
    """Two segments of unlike plates; clamps and disks may have no length, cables may be broken or end half-way."""
    first = int(rng.integers(1, plates))
    segment = np.repeat([0, 1], [first, plates - first])
    arc = rng.uniform(0.01, 0.03, plates)
    bending = (rng.uniform(0.1, 0.4, plates) / arc)[:, None] * plate.stiffness
    return Chain(
        plate=plate,
        arc=arc,
        clamp=rng.uniform(0, 0.01, plates) * rng.integers(0, 2, plates),
        disk=0.005 * rng.integers(0, 2),
        stiffness=bending,
        rest=rng.uniform(-0.02, 0.02, bending.shape),
        offset=(rng.uniform(0.01, 0.03, (2, cables)) * rng.choice([-1, 1], cables))[segment],
        reach=rng.choice([0, first, plates, plates], cables),
        friction=rng.uniform(0, 0.6, (plates, cables)),
        segment=segment,
    )


def random_loads(rng, chain, steps=1, tension=20.0, dead=0.4):
    """Tensions, slips, dead loads on every disk and on the tip, and moments on the arcs."""
    cables, plates = len(chain.reach), chain.plates
    return loads(
        chain,
        rng.uniform(0, tension, (steps, cables)),
        rng.uniform(-1, 1, (steps, cables)),
        rng.normal(0, 1, (steps, plates, 2)) * dead / plates,
        rng.normal(0, 1, (steps, 2)) * dead,
        rng.normal(0, 0.1, (steps, plates)),
    )


def row(steps, index=-1):
    """One load step, as the references take it."""
    return Loads(*(field[index] for field in steps))


def tip_face(chain, pose):
    """Centre of the tip disk's distal face, complex."""
    return pose.x[..., -1] + 1j * pose.y[..., -1] + chain.disk / 2 * np.exp(1j * pose.angle[..., -1])


def shift(a, b, disk):
    return np.hypot(a.x[..., disk] - b.x[..., disk], a.y[..., disk] - b.y[..., disk])
