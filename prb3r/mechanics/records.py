"""The chain as kernels see it: record arrays, one record per plate or per cable over a plate.

Records reach compiled code as plain pointers whose shapes are known, so that loops over nodes unroll and no
reference is counted; the same arithmetic on a tuple of thirty arrays takes three times as long.  The shapes also tell
the compiler whether a record has room for derivatives by the node angles; without it they are not computed.
"""

from collections.abc import Sequence
from functools import cache
from typing import NamedTuple

import numpy as np

from prb3r.mechanics.bundle import bundle
from prb3r.mechanics.chain import Chain
from prb3r.mechanics.plate_law import LAW_ROWS, MOST_ELEMENTS


@bundle
class Packed(NamedTuple):
    """A chain of `n` plates with `m` cables, together with the present state of its balance."""

    model: np.ndarray
    """(1,) what all plates share: plate model, disk thickness, laws of bending and friction."""
    plate: np.ndarray
    """(n + 1,) every plate, from the base; of the last record only `frame` is used, for the tip disk's distal face."""
    span: np.ndarray
    """(n, m) every cable over every plate."""
    cable: np.ndarray
    """(m,) the cables as they arrive at the disk which the march from base to tip has reached."""


def plate_fields(n: int, links: int, by: int) -> list[tuple]:
    """Names, types and shapes of the record of one plate of `n` nodes, with derivatives by `by` node angles (n or 0).

    Positions, forces and moments are in the frame of the plate's proximal disk, in SI units.
    """
    return [
        ("arc", float),
        ("clamp", float),
        ("stiffness", float, (n,)),
        ("cable_stiffness", float, (n,)),
        ("curvature", float, (n,)),  # per node angle, 1/m
        ("rest", float, (n,)),  # stress-free node angles
        ("knee", float, (2,)),  # curvature from which the law of bending has another slope, negative and positive, 1/m
        ("contact_angle", float, (2,)),  # bend at which the disks touch, negative and positive
        ("contact_stiffness", float, (2,)),
        ("q", float, (n,)),  # node angles
        ("residual", float, (n,)),  # unbalanced moment at each node, N m
        ("tangent", float, (n, by)),  # its derivative by q
        ("node", float, (2, n)),  # positions
        ("slope", float, (n,)),  # derivative of the elastic moment by the node angle, over that of a linear plate
        ("link", float, (2, links)),  # arc length times the direction of each link
        ("end", float, (2,)),  # distal disk's proximal face
        ("dend", float, (2, by)),  # its derivatives by q
        ("bend", float),  # angle of the distal disk to the proximal one
        ("axis", float, (2,)),  # its cosine and sine
        ("wrench", float, (3,)),  # force and moment (about the frame's origin) of the cables on the distal part
        ("dwrench", float, (3, by)),  # its derivatives by q
        ("load", float, (3,)),  # force and moment (about the frame's origin) of the dead loads further out
        ("extra", float),  # extra bending moment all along the arc
        ("frame", float, (5,)),  # proximal disk's distal face in the world: position, angle, its cosine and sine
        ("yields", float, (n,)),  # hysteresis: mean node angle at which the Jenkin elements begin to slip
        ("slider", float, (n, MOST_ELEMENTS)),  # node angle beyond the rest one where each slider stands, last accepted
        ("relaxed", float),  # moment that has relaxed, at the last solved step
    ]


def span_fields(by: int) -> list[tuple]:
    """Names, types and shapes of the record of one cable over one plate, with derivatives by `by` node angles.

    Directions are relative to the axis of the plate's proximal disk.
    """
    return [
        ("present", bool),
        ("rubs", bool),  # whether its direction matters: friction at the hole before or behind it
        ("offset", float),
        ("hole", float),  # offset of the cable in its holes
        ("moved", float),  # its derivative by the plate's bend
        ("along", float, (2,)),  # unit vector from the proximal to the distal hole
        ("friction", float),  # coefficient of the hole in the proximal disk
        ("direction", float),
        ("ddirection", float, (by,)),
        ("length", float),
        ("dlength", float, (by,)),
        ("tension", float),
        ("rate", float),  # d ln(tension) / d direction, signed
        ("rate_in", float),  # d ln(tension) / d approach, signed
        ("wrap", float),  # d ln(tension) / d slip at the hole: friction coefficient times wrap angle, and drag
        ("passes", float),  # d ln(tension) / d ln(tension before the hole)
        ("wrench", float, (3,)),  # on the distal part, as in the plate's record
        ("slip", float),  # history: slip at the hole in the last accepted state, -1 drawn in to +1 paid out
        ("beyond", float),  # history: cable length beyond the hole there
        ("new_slip", float),  # slip and length beyond the hole in the state that is being solved for
        ("new_beyond", float),
        ("sticks", bool),  # history: whether the new slip is between its bounds
    ]


def model_fields(n: int, links: int) -> list[tuple]:
    """Names, types and shapes of the record that all plates share, for plate models of `n` nodes and `links` links."""
    return [
        ("turn", float, (links, n)),
        ("reach", float, (n, links)),
        ("end", float, (links,)),
        ("disk", float),
        ("presliding", float),
        ("edges", bool),
        ("clearance", float),
        ("linear", bool),
        ("cubic", float),
        ("ratio", float),
        ("sharpness", float),
        ("tabled", bool),
        ("table", float, (2, LAW_ROWS, 2)),
        ("share", float),  # share of the stiffness that Jenkin elements carry; 1 for flag-shaped loops
        ("reverse", float),  # stress of reverse yielding over that of yielding
        ("elements", np.int64),  # Jenkin elements per node; 0 without hysteresis, or where the shape is held
        ("softening", float),
        ("relaxation", float),
        ("relaxation_time", float),
        ("decayed", float),  # relaxation: 1 - exp(-time since the last solved step / time constant), present state
        ("stiff", float),  # remaining stiffness of the plates over the initial one, in the present state
        ("friction_exponent", float),
        ("friction_tension", float),
        ("wrap_saturation", float),
        ("hole_drag", float),
        ("umbilical", float),
    ]


CABLE_FIELDS = [
    ("tension", float),
    ("approach", float),
    ("slip", float),
    ("follows", float),  # history: d slip / d (length beyond the hole), 1/m; 0 while the hole slips fully
    ("owed", float),  # history: slip that the length beyond the hole asks for and the hole does not have yet
    ("length", float),  # history: total length of the spans, as guessed
    ("passed", float),  # length of the spans passed so far
    ("pulley", float),  # logarithm of the efficiency of the pulley before the base hole
]
"""Names and types of the record of one cable as it arrives at a disk."""


@cache
def record_types(n: int, links: int, by: int) -> tuple[np.dtype, ...]:
    """Types of the records of the model, a plate, a cable over a plate and a cable, for plate models of `n` nodes and
    `links` links, with derivatives by `by` node angles."""
    fields = model_fields(n, links), plate_fields(n, links, by), span_fields(by), CABLE_FIELDS
    return tuple(np.dtype(f) for f in fields)


def pack(chain: Chain, held: bool = False) -> Packed:
    """Records of `chain` with all node angles zero.

    Records of a `held` shape have no room for derivatives by the node angles, and no Jenkin elements: the moments of
    these are added by `derivatives/loops.py`.
    """
    plates, n = chain.stiffness.shape
    links, cables = len(chain.plate.end), chain.offset.shape[1]
    of_model, of_plate, of_span, of_cable = record_types(n, links, 0 if held else n)
    shapes = (1, of_model), (plates + 1, of_plate), ((plates, cables), of_span), (cables, of_cable)
    packed = Packed(*(np.zeros(shape, kind) for shape, kind in shapes))
    packed.model["stiff"] = 1.0
    packed.plate["frame"][0] = 0, 0, 0, 1, 0
    _write(packed, chain, set(Chain._fields), held)
    return packed


def pack_held_beside(held: Packed, others: Sequence[tuple[Chain, set[str]]]) -> Packed:
    """(v, ...) records of `v` chains with their shape held.

    Each of `others` is a chain with the names of the fields in which it differs from the one whose records are `held`.
    """
    many = Packed(*(_copies(field, len(others)) for field in held))
    for k, (chain, differ) in enumerate(others):
        if differ:
            _write(Packed(*(field[k] for field in many)), chain, differ, True)
    return many


def differing(chain: Chain, other: Chain) -> set[str]:
    """Names of the fields in which two chains hold different objects; the values of these may still be equal."""
    return {name for name, mine, its in zip(Chain._fields, chain, other, strict=True) if mine is not its}


def _copies(records: np.ndarray, count: int) -> np.ndarray:
    """(count, ...) copies of records, made as bytes: NumPy would copy records number by number."""
    raw = records.view(np.uint8)
    return np.broadcast_to(raw, (count, *raw.shape)).copy().view(records.dtype)


OF_MODEL = (
    *("disk", "softening", "relaxation", "relaxation_time", "umbilical", "presliding", "edges", "clearance"),
    *("friction_exponent", "friction_tension", "wrap_saturation", "hole_drag"),
)
"""Fields of a chain that stand under the same name in the record of the model."""
OF_PLATES = "arc", "clamp", "stiffness", "cable_stiffness", "rest"
"""Fields of a chain that stand under the same name in the records of the plates."""


def _write(packed: Packed, chain: Chain, fields: set[str], held: bool) -> None:
    """Write those of a chain's values to its records that depend on the `fields` of the given names."""
    model, plate, span, cable = packed
    plates, slips = len(chain.arc), chain.hysteresis
    for name in fields.intersection(OF_MODEL):
        model[name] = getattr(chain, name)
    for name in fields.intersection(OF_PLATES):
        plate[name][:-1] = getattr(chain, name)
    if "plate" in fields:
        model["turn"], model["reach"], model["end"] = chain.plate.turn, chain.plate.reach, chain.plate.end
    if not fields.isdisjoint(("law", "hysteresis")):
        for name in ("cubic", "ratio", "sharpness"):
            model[name] = getattr(chain.law, name)
        model["linear"], model["tabled"] = chain.law.linear and not slips.slipping, chain.law.table is not None
        model["reverse"] = slips.reverse
        if chain.law.table is not None:
            model["table"] = chain.law.table
        if slips.slipping:
            model["share"] = 1.0 if slips.flagged else slips.share
            model["elements"] = 0 if held else slips.slipping
        plate["knee"][:-1] = chain.law.knee
    if not fields.isdisjoint(("plate", "arc", "curvature", "hysteresis")):
        per_angle = chain.plate.stiffness if chain.curvature is None else chain.curvature
        plate["curvature"][:-1] = per_angle / chain.arc[:, None]
        if slips.slipping:
            with np.errstate(divide="ignore"):  # hinges do not slip
                plate["yields"][:-1] = np.broadcast_to(slips.curvature, plates)[:, None] / plate["curvature"][:-1]
    if "contact" in fields:
        plate["contact_angle"][:-1], plate["contact_stiffness"][:-1] = chain.contact
    if "offset" in fields:
        span["offset"] = chain.offset
    if "friction" in fields:
        span["friction"] = chain.friction
        rubs = chain.friction != 0
        span["rubs"], span["rubs"][:-1] = rubs, rubs[:-1] | rubs[1:]
    if "reach" in fields:
        span["present"] = np.arange(plates)[:, None] < chain.reach
    if "pulley" in fields:
        cable["pulley"] = np.log(chain.pulley)
