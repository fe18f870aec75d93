"""The chain as kernels see it: record arrays, one row a plate or a cable over a plate.

Records reach compiled code as plain pointers whose shapes are known, so that loops over nodes unroll and no
reference is counted; the same arithmetic on a tuple of thirty arrays takes three times as long.  For the same reason
records without room for derivatives by the node angles are computed without them, at no cost.
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
    """(1,) plate model and disk thickness."""
    plate: np.ndarray
    """(n + 1,) every plate, from the base; of the last row only `frame` is used, the tip disk's distal face."""
    span: np.ndarray
    """(n, m) every cable over every plate."""
    cable: np.ndarray
    """(m,) the cables as they arrive at the disk that is being passed."""


def plate_fields(n: int, links: int, by: int) -> list[tuple]:
    """One plate of `n` nodes with derivatives by `by` of their angles, all or none; positions, forces and moments in
    the frame of its proximal disk, SI units."""
    return [
        ("arc", float),
        ("clamp", float),
        ("stiffness", float, (n,)),
        ("curvature", float, (n,)),  # per node angle, 1/m
        ("rest", float, (n,)),  # stress-free node angles
        ("knee", float, (2,)),  # curvature from which the law of bending has another slope, negative and positive, 1/m
        ("contact_angle", float, (2,)),  # bend at which the disks touch, negative and positive
        ("contact_stiffness", float, (2,)),
        ("q", float, (n,)),  # node angles
        ("residual", float, (n,)),  # unbalanced moment at each node
        ("tangent", float, (n, by)),  # its derivative by q
        ("node", float, (2, n)),  # positions
        ("slope", float, (n,)),  # derivative of the elastic moment by the node angle, of that of a linear plate
        ("link", float, (2, links)),
        ("end", float, (2,)),  # distal disk's proximal face
        ("dend", float, (2, by)),  # its derivatives by q
        ("bend", float),  # angle of the distal disk to the proximal one
        ("axis", float, (2,)),  # its cosine and sine
        ("wrench", float, (3,)),  # force and moment (about the frame's origin) of the cables on the distal part
        ("dwrench", float, (3, by)),
        ("load", float, (3,)),  # the same of the dead loads further out
        ("extra", float),  # extra bending moment all along the arc
        ("frame", float, (5,)),  # proximal disk's distal face in the world: position, angle, its cosine and sine
        ("yields", float, (n,)),  # hysteresis: node angle from which Jenkin elements slip, on average
        ("slider", float, (n, MOST_ELEMENTS)),  # node angle where the slider of each stood in the last accepted state
    ]


def span_fields(by: int) -> list[tuple]:
    """One cable over one plate with derivatives by `by` node angles; directions relative to the axis of the plate's
    proximal disk."""
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
        ("wrap", float),  # friction coefficient times turning angle
        ("passes", float),  # d ln(tension) / d ln(tension before the hole)
        ("wrench", float, (3,)),
        ("slip", float),  # history: slip at the hole in the last accepted state, -1 drawn in to +1 paid out
        ("beyond", float),  # history: cable length beyond the hole there
        ("new_slip", float),  # the same two in the state that is tried
        ("new_beyond", float),
        ("sticks", bool),  # history: whether the slip there is between its bounds
    ]


def model_fields(n: int, links: int) -> list[tuple]:
    """Names, types and shapes of the one record that all plates share, for models of `n` nodes and so many links."""
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
        ("extra", bool),  # whether any plate ever has an extra moment
        ("share", float),  # of the stiffness that slips
        ("reverse", float),  # stress at which plates turn back over that at which they yield
        ("elements", np.int64),  # in which it does; 0 where nothing slips, or where the shape is held
        ("softening", float),
        ("stiff", float),  # share of the plates' stiffness that is left in the present state
        ("friction_exponent", float),
        ("friction_tension", float),
        ("wrap_saturation", float),
        ("umbilical", float),
    ]


CABLE_FIELDS = [
    ("tension", float),
    ("approach", float),
    ("slip", float),
    ("follows", float),  # history: d slip / d (length beyond the hole), 1/m; 0 while the hole slips fully
    ("owed", float),  # history: slip that the length beyond the hole asks for and the hole does not have yet
    ("length", float),  # history: total length of the spans, as guessed
    ("passed", float),  # history: length of the spans passed so far
    ("pulley", float),  # logarithm of the efficiency of the pulley before the base hole
]


@cache
def record_types(n: int, links: int, by: int) -> tuple[np.dtype, ...]:
    """Types of the records of the model, a plate, a cable over a plate and a cable, for `n` nodes, so many links, and
    derivatives by `by` node angles."""
    fields = model_fields(n, links), plate_fields(n, links, by), span_fields(by), CABLE_FIELDS
    return tuple(np.dtype(f) for f in fields)


def pack(chain: Chain, held: bool = False) -> Packed:
    """Records of `chain` at rest; without derivatives by the node angles where its shape is `held`.

    A held shape is without the moments of what slips in the plates too; see `derivatives/loops.py`.
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
    """(v, ...) records of chains with their shape held; each is given with the fields in which it differs from the one
    that is `held`."""
    many = Packed(*(_copies(field, len(others)) for field in held))
    for k, (chain, differ) in enumerate(others):
        if differ:
            _write(Packed(*(field[k] for field in many)), chain, differ, True)
    return many


def differing(chain: Chain, other: Chain) -> set[str]:
    """Names of the fields of which two chains do not share the value; values that they do not share may be equal."""
    return {name for name, mine, its in zip(Chain._fields, chain, other, strict=True) if mine is not its}


def _copies(records: np.ndarray, count: int) -> np.ndarray:
    """(count, ...) copies of records; NumPy copies records number by number, but bytes at once."""
    raw = records.view(np.uint8)
    return np.broadcast_to(raw, (count, *raw.shape)).copy().view(records.dtype)


OF_MODEL = (
    *("disk", "softening", "umbilical", "presliding", "edges", "clearance"),
    *("friction_exponent", "friction_tension", "wrap_saturation"),
)
"""Fields of a chain that are fields of its model's record."""
OF_PLATES = "arc", "clamp", "stiffness", "rest"
"""Fields of a chain that are fields of its plates' records."""


def _write(packed: Packed, chain: Chain, fields: set[str], held: bool) -> None:
    """Write to the records of a chain what some `fields` of it say."""
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
