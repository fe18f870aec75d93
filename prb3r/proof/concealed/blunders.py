"""Blunders of the set-up: where each can be made, what makes it, and the sentence by which a diagnosis says it.

Written from what a person does at the bench, and not from how the diagnosis undoes it.
"""

from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import numpy as np

from prb3r.proof.concealed.blundering import (
    Details,
    Tables,
    count_from_tip,
    count_from_zero,
    exchange_cables,
    exchange_disks,
    exchange_sequences,
    in_degrees,
    in_kilograms,
    mirror,
    note_end,
    note_late,
    play_backwards,
    turn_offsets,
    turn_slips,
)
from prb3r.proof.concealed.design import Design, LoadSteps
from prb3r.proof.settings import SETTINGS
from prb3r.recording.recording import Kind


class BlunderKind(NamedTuple):
    """One kind of blunder."""

    possible: Callable[[Design], list[dict[str, Any]]]
    """All ways to make it on a design: the details of each."""
    make: Callable[[Tables, Details], Tables]
    """The tables after the blunder."""
    said: Callable[[Details], str]
    """The sentence that says it."""


def drawn_blunder(rng: np.random.Generator, design: Design) -> dict[str, Any]:
    """A random blunder that can be made on a design: its `kind`, its details, and the sentence `said` that names it."""
    options = {kind: places for kind, blunder in BLUNDERS.items() if (places := blunder.possible(design))}
    weight = np.array([SETTINGS.real.blunders[kind] for kind in options])
    kind = str(rng.choice(list(options), p=weight / weight.sum()))
    details = options[kind][int(rng.integers(len(options[kind])))]
    return {"kind": kind, **details, "said": BLUNDERS[kind].said(details)}


def blundered(tables: Tables, blunder: Details) -> Tables:
    """The tables of a recording after a blunder as :func:`drawn_blunder` returns it."""
    return BLUNDERS[blunder["kind"]].make(tables, blunder)


def sequence_names(design: Design) -> list[str]:
    """Names of the sequences of a design's program, as recordings have them: `s1`, `s2` and so on."""
    return [f"s{k + 1}" for k in range(len(design.program))]


def _pulled(design: Design, cable: str, steps: LoadSteps) -> bool:
    """Whether a cable has tension at any of the steps."""
    return any(step[f"cable_{cable}_n"] for step in steps)


def _pairs(design: Design) -> list[dict[str, Any]]:
    """Details of every pair of cables."""
    names = design.cables
    return [{"cables": [a, b]} for k, a in enumerate(names) for b in names[k + 1 :]]


def _pairs_once(design: Design) -> list[dict[str, Any]]:
    """Details of every pair of cables with every sequence in which at least one of the two is pulled."""
    return [
        {**pair, "sequence": name}
        for pair in _pairs(design)
        for name, steps in zip(sequence_names(design), design.program, strict=True)
        if any(_pulled(design, cable, steps) for cable in pair["cables"])
    ]


def _exchange_said(details: Details) -> str:
    where = f" in sequence {details['sequence']}" if "sequence" in details else ""
    return f"cables {' and '.join(details['cables'])} are exchanged{where}"


def _ends(design: Design) -> list[dict[str, Any]]:
    """Details of every cable with every segment at which it does not end."""
    count = len(design.manipulator["segment"])
    return [
        {"cable": cable["name"], "noted": end, "true": cable["ends_at_segment"]}
        for cable in design.manipulator["cable"]
        for end in range(1, count + 1)
        if end != cable["ends_at_segment"]
    ]


def _declared(design: Design) -> bool:
    """Whether declared slip directions matter: there is friction, and it does not follow the load path."""
    return design.friction > 0 and not design.follows_path


def _sequences(design: Design) -> list[dict[str, Any]]:
    """Details of every sequence."""
    return [{"sequence": name} for name in sequence_names(design)]


def _kilograms_said(details: Details) -> str:
    of = f"of sequence {details['sequence']} " if "sequence" in details else ""
    return f"weights {of}noted as newtons are kilograms"


def _of_equal_length(design: Design) -> list[dict[str, Any]]:
    """Details of every pair of sequences with equally many steps."""
    names, program = sequence_names(design), design.program
    return [
        {"sequences": [names[a], names[b]]}
        for a in range(len(names))
        for b in range(a + 1, len(names))
        if len(program[a]) == len(program[b])
    ]


def _listed(names: Sequence[Any]) -> str:
    return " and ".join(map(str, names))


BLUNDERS: dict[str, BlunderKind] = {
    "cables exchanged": BlunderKind(_pairs, exchange_cables, _exchange_said),
    "cables exchanged once": BlunderKind(_pairs_once, exchange_cables, _exchange_said),
    "offset sign": BlunderKind(
        lambda design: [{"cable": name} for name in design.cables],
        turn_offsets,
        lambda details: f"offset_m of cable {details['cable']} has the wrong sign",
    ),
    "all offset signs": BlunderKind(
        lambda design: [{}], turn_offsets, lambda details: "offset_m of every cable has the wrong sign"
    ),
    "cable end": BlunderKind(
        _ends,
        note_end,
        lambda details: f"cable {details['cable']} ends at segment {details['true']}, not where the file says",
    ),
    "slip sign": BlunderKind(
        lambda design: [{}] if _declared(design) else [],
        turn_slips,
        lambda details: "slip is declared with the wrong sign",
    ),
    "slip sign once": BlunderKind(
        lambda design: _sequences(design) if _declared(design) else [],
        turn_slips,
        lambda details: f"slip is declared with the wrong sign in sequence {details['sequence']}",
    ),
    "mirrored": BlunderKind(
        lambda design: [{}], mirror, lambda details: "the pictures are mirrored: the rig was seen from behind"
    ),
    "from the tip": BlunderKind(
        lambda design: [{"disks": design.plates}],
        count_from_tip,
        lambda details: "the disks are counted from the tip",
    ),
    "one off": BlunderKind(
        lambda design: [] if Kind.BEND in design.kinds else [{}],
        count_from_zero,
        lambda details: "the disks are counted one off: the first disk after the base is counted as 0",
    ),
    "disks exchanged": BlunderKind(
        lambda design: [{"disks": [a, b]} for a in range(1, design.plates) for b in range(a + 1, design.plates + 1)],
        exchange_disks,
        lambda details: f"disks {_listed(details['disks'])} are exchanged",
    ),
    "kilograms": BlunderKind(lambda design: [{}], in_kilograms, _kilograms_said),
    "kilograms once": BlunderKind(_sequences, in_kilograms, _kilograms_said),
    "backwards": BlunderKind(
        _sequences,
        play_backwards,
        lambda details: f"the pictures of sequence {details['sequence']} are in backward order",
    ),
    "step late": BlunderKind(
        lambda design: [{}],
        note_late,
        lambda details: "the pictures of every sequence belong to the step after the one they are noted at",
    ),
    "sequences exchanged": BlunderKind(
        _of_equal_length,
        exchange_sequences,
        lambda details: f"the pictures of sequences {_listed(details['sequences'])} are exchanged",
    ),
    "degrees": BlunderKind(
        lambda design: [{}] if Kind.ANGLE in design.kinds else [],
        in_degrees,
        lambda details: "angle_rad is in degrees",
    ),
}
"""All kinds of blunder, by the name that `SETTINGS.real.blunders` gives them."""
