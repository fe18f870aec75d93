"""Blunders to plant in right recordings, by what is said of them."""

from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
from diagnosis.simulated import Case, recorded

from prb3r.diagnosis.checks.setup.remedy import with_manipulator
from prb3r.model.steps import loads_of
from prb3r.recording.reading import load_recording
from prb3r.recording.recording import Kind


def other_steps(known, **columns):
    steps = known.steps.assign(**columns)
    return replace(known, steps=steps, loads=loads_of(known.manipulator, known.manipulator.chain(), steps))


def other_cables(known, **changes):
    cables = [cable.model_copy(update=changes.get(f"cable_{cable.name}", {})) for cable in known.manipulator.cable]
    manipulator = known.manipulator.model_copy(update={"cable": cables})
    return replace(known, manipulator=manipulator, loads=loads_of(manipulator, manipulator.chain(), known.steps))


def relabelled(known, disk=lambda disk, name: disk, step=lambda step, name: step):
    readings = known.readings
    names = np.array(known.sequences)[known.of_sequence[readings.step]]
    labels = [(disk(d, n), step(s, n)) for d, s, n in zip(readings.disk, readings.step, names, strict=True)]
    changed = readings._replace(disk=np.array([d for d, _ in labels]), step=np.array([s for _, s in labels]))
    return replace(
        known,
        readings=changed.where((changed.disk >= 0) & (changed.disk <= known.manipulator.plates) & (changed.step >= 0)),
    )


def swapped(a, b):
    return lambda label: {a: b, b: a}.get(label, label)


def in_sequence(name, change):
    return lambda label, own: change(label) if own == name else label


def rows(known, name):
    return np.flatnonzero(known.of_sequence == known.sequences.index(name))


def mirrored(known, sequences=None):
    """As seen from behind, in all sequences or in some."""
    readings = known.readings
    here = np.isin(np.array(known.sequences)[known.of_sequence[readings.step]], sequences or known.sequences)
    return known.with_values(np.where((readings.kind == Kind.X) | ~here, readings.value, -readings.value))


def exchanged_since(known, sequence, step):
    """With cables 2 and 4 in each other's columns from a step of a sequence on."""
    first = known.steps.index[known.steps["sequence"].eq(sequence) & known.steps["step"].eq(step)][0]
    here, pairs = known.steps.index >= first, [("cable_2_n", "cable_4_n"), ("slip_2", "slip_4")]
    return other_steps(
        known, **{a: known.steps[a].where(~here, known.steps[b]) for pair in pairs for a, b in (pair, pair[::-1])}
    )


def farther(known, factor):
    """With offsets of all cables in the file that are `factor` times what they are."""
    cables = known.manipulator.cable
    return other_cables(known, **{f"cable_{c.name}": {"offset_m": factor * c.offset_m} for c in cables})


def in_kilograms(known, sequence=None, share=1.0):
    """Kilograms, or `share` kilograms, in the columns of newtons, in all sequences or in one."""
    here, gravity = known.steps["sequence"].eq(sequence or known.steps["sequence"]), known.manipulator.gravity_m_s2
    columns = known.steps[[f"cable_{name}_n" for name in "1234"]]
    return other_steps(known, **columns.where(~here, columns / (share * gravity)))


def backward(known, name):
    first, last = rows(known, name)[[0, -1]]
    return relabelled(known, step=in_sequence(name, lambda step: first + last - step))


def late(known, name):
    last = rows(known, name)[-1]
    return relabelled(known, step=in_sequence(name, lambda step: step + 1 if step < last else -1))


def steps_swapped(known, name, a, b):
    first, second = rows(known, name)[[a - 1, b - 1]]
    return relabelled(known, step=in_sequence(name, swapped(first, second)))


def sequences_swapped(known, a, b):
    first, second = rows(known, a), rows(known, b)
    to = dict(zip([*first, *second], [*second, *first], strict=True))
    return relabelled(known, step=lambda step, name: to.get(step, step))


def in_pounds(known, columns, sequence=None, as_kilograms=False):
    """Pounds in some columns of newtons, in all sequences or in one; or, taken for kilograms, 9.81 times as much."""
    here, pound = known.steps["sequence"].eq(sequence or known.steps["sequence"]), 0.45359237  # kg
    worth = pound if as_kilograms else pound * known.manipulator.gravity_m_s2
    return other_steps(known, **known.steps[columns].where(~here, known.steps[columns] / worth))


def misnoted(known, cable, sequence, factor):
    """With the weights of a cable in a sequence noted as a multiple of what hung there."""
    name, here = f"cable_{cable}_n", known.steps["sequence"].eq(sequence)
    return other_steps(known, **{name: known.steps[name].where(~here, factor * known.steps[name])})


def pulled_by(known, factor, *columns):
    """With some tensions noted as what pulls over a factor."""
    return other_steps(known, **{name: known.steps[name] / factor for name in columns})


def as_thick(known, factor):
    """With plates in the file that are a factor times as thick."""
    manipulator = known.manipulator
    for number, segment in enumerate(manipulator.segment, 1):
        manipulator = manipulator.replace(f"segment.{number}.thickness_m", factor * segment.thickness_m)
    return with_manipulator(known, manipulator).recording


def hung_elsewhere(known, disk, other):
    """With what hangs at a disk noted at another one."""
    steps = known.steps.rename(columns={f"disk{disk}_y_n": f"disk{other}_y_n"})
    return replace(known, steps=steps, loads=loads_of(known.manipulator, known.manipulator.chain(), steps))


def other_lengths(known, disks):
    """With plates in the file that are longer by this many disks."""
    manipulator = known.manipulator
    for number, segment in enumerate(manipulator.segment, 1):
        length = segment.length_m + disks * manipulator.disk.thickness_m
        manipulator = manipulator.replace(f"segment.{number}.length_m", length)
    return replace(known, manipulator=manipulator, loads=loads_of(manipulator, manipulator.chain(), known.steps))


FORGOTTEN_SLIPS = "the slip columns were forgotten: a cable without one counts as drawn in even where its tension falls"


def without_slips(known, names="1234"):
    """Without the columns of slip of some cables."""
    steps = known.steps.drop(columns=[f"slip_{name}" for name in names])
    return replace(known, steps=steps, loads=loads_of(known.manipulator, known.manipulator.chain(), steps))


def sorted_by_tension(known):
    """With the steps of every sequence sorted by their largest tension, the way there first, and no slip."""
    order = np.lexsort((known.loads.tension.max(1), known.of_sequence))
    steps = without_slips(known).steps.iloc[order].reset_index(drop=True)
    steps["step"] = known.steps["step"].to_numpy()
    loads = loads_of(known.manipulator, known.manipulator.chain(), steps)
    return replace(relabelled(known, step=lambda step, name: np.argsort(order)[step]), steps=steps, loads=loads)


def axes_exchanged(recording):
    """The recording with x and y in each other's column."""
    kind = recording.readings.kind
    other = np.where(kind == Kind.X, Kind.Y, np.where(kind == Kind.Y, Kind.X, kind))
    return replace(recording, readings=recording.readings._replace(kind=other))


CABLES_N = [f"cable_{name}_n" for name in "1234"]
"""Columns of the tensions."""
DEAD_N = ["tip_y_n", "disk4_y_n"]
"""Columns of the weights of an arm that is laden."""
PLANTED = {
    "cables 1 and 4 are exchanged": lambda r: other_steps(
        r,
        cable_1_n=r.steps["cable_4_n"],
        cable_4_n=r.steps["cable_1_n"],
        slip_1=r.steps["slip_4"],
        slip_4=r.steps["slip_1"],
    ),
    "cables 1 and 2 are exchanged": lambda r: other_steps(
        r,
        cable_1_n=r.steps["cable_2_n"],
        cable_2_n=r.steps["cable_1_n"],
        slip_1=r.steps["slip_2"],
        slip_2=r.steps["slip_1"],
    ),
    "the pictures are mirrored: the rig was seen from behind": mirrored,
    "x_m and y_m are exchanged": axes_exchanged,
    "the pictures in sequence counter are mirrored: the rig was seen from behind": lambda r: mirrored(r, ("counter",)),
    "cables 2 and 4 are exchanged from step 3 of sequence in on": lambda r: exchanged_since(r, "in", 3),
    "offset_m of cable 3 has the wrong sign": lambda r: other_cables(r, cable_3={"offset_m": 0.021}),
    "the disks are counted from the tip": lambda r: relabelled(r, disk=lambda d, n: r.manipulator.plates + 1 - d),
    "the disks are counted one off: the base disk is counted as 1": lambda r: relabelled(r, disk=lambda d, n: d + 1),
    "disks 5 and 6 are exchanged": lambda r: relabelled(r, disk=lambda d, n: swapped(5, 6)(d)),
    "disks 2 and 3 are exchanged in sequence in": lambda r: relabelled(r, disk=in_sequence("in", swapped(2, 3))),
    "cable 2 ends at segment 1, not where the file says": lambda r: other_cables(r, cable_2={"ends_at_segment": 2}),
    "weights noted as newtons are kilograms": in_kilograms,
    "weights of sequence down noted as newtons are kilograms": lambda r: in_kilograms(r, "down"),
    "weights of sequence out noted as newtons are grams": lambda r: in_kilograms(r, "out", 1e-3),
    "weights of sequence down noted as newtons are pounds": lambda r: in_pounds(r, CABLES_N, "down"),
    "weights of sequence out noted as newtons are pounds that were taken for kilograms": lambda r: in_pounds(
        r, CABLES_N, "out", as_kilograms=True
    ),
    "weights of cable_4_n are half of what pulled": lambda r: pulled_by(r, 2.0, "cable_4_n"),
    "weights of cable_1_n are twice what pulled": lambda r: pulled_by(r, 0.5, "cable_1_n"),
    "length_m of every segment is the pitch, with a disk in it": lambda r: other_lengths(r, 1),
    "the thickness of a disk was taken off length_m of every segment, which is without it anyway": lambda r: (
        other_lengths(r, -1)
    ),
    "slip is declared with the wrong sign": lambda r: other_steps(
        r, **{f"slip_{name}": -r.steps[f"slip_{name}"] for name in "1234"}
    ),
    "the pictures of sequence down are in backward order": lambda r: backward(r, "down"),
    "the pictures of sequence out belong to the step before the one they are noted at": lambda r: late(r, "out"),
    "the pictures of sequences out and counter are exchanged": lambda r: sequences_swapped(r, "out", "counter"),
    "positions (x_m and y_m) are a tenth of what they should be": lambda r: r.with_values(
        np.where(r.readings.kind == Kind.ANGLE, r.readings.value, r.readings.value / 10)
    ),
    "angle_rad is in degrees": lambda r: r.with_values(
        np.where(r.readings.kind == Kind.ANGLE, np.degrees(r.readings.value), r.readings.value)
    ),
}
LADEN = {
    "tip_y_n and disk4_y_n hold pounds": lambda r: in_pounds(r, DEAD_N),
    "tip_y_n and disk4_y_n hold pounds that were taken for kilograms": lambda r: in_pounds(
        r, DEAD_N, as_kilograms=True
    ),
    "weights of all cables are half of what pulled": lambda r: pulled_by(r, 2.0, *CABLES_N),
    "what hung at disk 4 is noted as loads on disk 5": lambda r: hung_elsewhere(r, 4, 5),
    "the disks that loads hang on are counted from the tip": lambda r: hung_elsewhere(r, 4, 3),
    "the disks that loads hang on are counted from the tip, which is 0": lambda r: hung_elsewhere(r, 4, 2),
}
"""The same for the recording of an arm with weights on its tip and on a disk."""


@cache
def example():
    """The shipped recording: 42 steps, pulleys that take a tenth of every pull."""
    return load_recording(Path(__file__).parents[2] / "studies" / "recordings" / "bench-example")


@cache
def lagging():
    """A rig whose friction follows its cables' travel, as the file says."""
    right = recorded(Case(hidden=((("kind", "slip_history"), ("presliding_m", 1e-4)),), program="reversing"))
    friction = {"coefficient": 0.3, "direction": "history", "presliding_m": 1e-4}
    return with_manipulator(right, right.manipulator.replace("friction", friction)).recording
