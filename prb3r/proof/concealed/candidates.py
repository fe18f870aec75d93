"""Every effect that can be concealed on a design, at every place, from the records of the rig's effects.

This is the independent side's list, written from the meaning of the effects; the diagnosis has another.
"""

import numpy as np

from prb3r.proof.concealed.design import Design
from prb3r.proof.rig.effects import RECORDS
from prb3r.proof.rig.effects.candidate import Candidate, Conditions
from prb3r.recording.recording import Kind


def conditions_of(design: Design) -> Conditions:
    """The conditions of a design: what decides which effects can be concealed on it, and the units of their sizes."""
    manipulator, first = design.manipulator, design.manipulator["segment"][0]
    segments = tuple(segment["plates"] for segment in manipulator["segment"])
    steps = [step for sequence in design.program for step in sequence]
    return Conditions(
        segments=segments,
        reach={cable["name"]: sum(segments[: cable["ends_at_segment"]]) for cable in manipulator["cable"]},
        friction=design.friction,
        declared=manipulator["friction"].get("direction", "declared") == "declared",
        tip_loaded=any(step.get("tip_y_n", 0.0) for step in steps),
        positions=Kind.X in design.kinds,
        pull=design.pull,
        arm=max(abs(cable["offset_m"]) for cable in manipulator["cable"]),
        length=design.length,
        bend=design.largest_bend,
        arc=first["length_m"] - 2 * first["clamp_m"],
        modulus=manipulator["youngs_modulus_pa"],
        rigidity=manipulator["youngs_modulus_pa"] * first["width_m"] * first["thickness_m"] ** 3 / 12,
        fibre=first["thickness_m"] / 2,
        steps=len(steps),
    )


def candidates(design: Design, rare: bool = False) -> list[list[Candidate]]:
    """All candidates of a design whose kinds are not rare, or (if `rare`) all of rare kinds.

    Those of one inner list act together, as the components of a force do.
    """
    given = conditions_of(design)
    return [group for record in RECORDS.values() if record.rare == rare for group in record.candidates(given)]


def concealable() -> tuple[str, ...]:
    """Kinds that can be concealed and are not rare, in the order in which labels ask for them."""
    kinds = [kind for kind, record in RECORDS.items() if record.conceal is not None and not record.rare]
    return tuple(sorted(kinds, key=lambda kind: RECORDS[kind].turn))


def kinds(design: Design) -> set[str]:
    """Kinds that can be concealed on a design at one place at least; rare kinds are not among them."""
    return {group[0].kind for group in candidates(design)}


def shaped(design: Design, candidate: Candidate, rng: np.random.Generator) -> Candidate:
    """The candidate with its shape drawn at random, where it has one."""
    return RECORDS[candidate.kind].drawn(conditions_of(design), candidate, rng)


def twins(design: Design, candidate: Candidate, size: float) -> list[Candidate]:
    """Candidates of other kinds that are the same law, or nearly so, as a candidate at a size."""
    same = RECORDS[candidate.kind].twins
    return [] if same is None else list(same(conditions_of(design), candidate, size))
