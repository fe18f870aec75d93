"""Doubts about the set-up of a recording that need no fit, such as mirrored pictures or wrong units, as sentences."""

from collections.abc import Iterator

import numpy as np

from prb3r.model.files.cells import named, written_out
from prb3r.recording.let_go import felt_changes
from prb3r.recording.recording import FRAME_REACH, Kind, Recording

ENOUGH = 0.9
"""Least share of the relevant steps that has to contradict what the file says of a cable (its side or its slip) for a
doubt.  Choice: the rest may be wrong for other reasons."""
FEWEST = 3
"""Fewest steps, or disks, that have to contradict the file for a doubt.  Choice: one or two may be slips."""
LEAST_TURN = 10.0
"""Least mean deflection of a step that tells to which side the arm bends, in standard deviations of a reading.  Choice:
far more than noise and a slightly shifted frame cause."""
SLACK = 0.25
"""Distance by which a disk may seem too far from the base without a doubt, over the mean distance between disks.
Choice: more than tolerances and a camera's scale cause, and less than a disk that is counted wrongly does."""
NEAREST = 0.5
"""Share of the arm's length up to a disk that the disk has to be away from the base at some step.  Choice: an arm that
is bent to a full circle at every step would have none that is."""
FEWEST_TO_SET_ASIDE = 3
"""Fewest sequences with which a diagnosis sets one aside; two are left then."""
ALIKE = 5.0
"""Largest ratio between the strongest pulls of cables noted in kilograms and in newtons on one rig, either way, without
a doubt.  Choice: half of g."""


MUCH_STRONGER = 30.0
"""Largest ratio between the strongest pulls of a sequence and of all others without a doubt.  Choice: between what
programs have and the 102 by which grams exceed newtons."""


def implausible(recording: Recording) -> Iterator[str]:
    """All doubts about the set-up of a recording, each a sentence."""
    yield from _misplaced_disks(recording)
    yield from _wrong_sides(recording)
    yield from slips_the_other_way(recording)
    yield from _mixed_units(recording)
    yield from _other_unit(recording)
    yield from _never_noted(recording)
    yield from _too_little(recording)


def _misplaced_disks(recording: Recording) -> Iterator[str]:
    """A doubt if disks are farther from the base than the arm is long up to them, as a chord is no longer than its arc;
    and one if none is ever half as far as that, as if the arm were coiled up at every step."""
    disks, away, along, spacing = _distances_from_base(recording)
    slack = SLACK * spacing + FRAME_REACH * recording.measurement.frame_position_sd_m
    read = np.unique(disks).tolist()
    far = [d for d in read if np.median(away[disks == d]) > along[d] + slack]
    near = [d for d in read if away[disks == d].max() + slack < NEAREST * along[d]]
    if len(far) >= FEWEST:
        first = far[0]
        distance = float(np.median(away[disks == first]))
        yield (
            f"disk {first} is {distance:.3g} m from the base, but the arm reaches only {along[first]:.3g} m so far, "
            f"and so for {len(far)} disks; are disks counted from the base, which is 0, or is a length wrong?"
        )
    elif len(near) >= FEWEST and len(near) >= ENOUGH * len(read):
        last = near[-1]
        distance = float(away[disks == last].max())
        yield (
            f"disk {last} is at no step farther than {distance:.3g} m from the base, but the arm is {along[last]:.3g} "
            f"m long so far, and so for {len(near)} disks; are positions in another unit, or is a length wrong?"
        )


def _distances_from_base(recording: Recording) -> tuple[np.ndarray, np.ndarray, np.ndarray, float]:
    """Of every place that was read: (k,) disk and (k,) distance from the base, m; and (n + 1,) length of the arm up to
    every disk and the mean distance between disks, m."""
    readings, chain = recording.readings, recording.manipulator.chain()
    spacing = chain.arc + 2 * chain.clamp + chain.disk
    places = {(s, d): [np.nan, np.nan] for s, d in zip(readings.step.tolist(), readings.disk.tolist(), strict=True)}
    for s, d, kind, value in zip(*(field.tolist() for field in readings), strict=True):
        if Kind(kind).is_position:
            places[s, d][kind] = value
    away = np.linalg.norm(np.array(list(places.values())).reshape(-1, 2), axis=1)
    known = np.isfinite(away)
    disks = np.array([d for _, d in places], int)[known]
    return disks, away[known], np.concatenate([[0.0], np.cumsum(spacing)]), float(spacing.mean())


def _wrong_sides(recording: Recording) -> Iterator[str]:
    """A doubt about cables that bend the arm to the side away from their offset when they alone are pulled, and no less
    the harder they are pulled: an arm that sags, or is bent before any load, lies on a side of its own."""
    turned = _deflections(recording, recording.readings.value)
    moved, known = _deflections(recording, _about_their_mean(recording)), np.abs(turned) > LEAST_TURN
    tension, manipulator = recording.loads.tension, recording.manipulator
    offset = manipulator.chain().offset[0]
    alone = (tension > 0).sum(1) == 1
    laden = np.any(recording.loads.tip != 0, axis=1) | np.any(recording.loads.force != 0, axis=(1, 2))
    wrong = []
    for k, name in enumerate(manipulator.cable_names):
        steps = alone & (tension[:, k] > 0) & known & ~laden
        if steps.sum() < FEWEST or (turned[steps] * offset[k] < 0).mean() < ENOUGH:
            continue
        harder = tension[steps, k] - np.median(tension[steps, k])
        if harder @ (moved[steps] - moved[steps].mean()) * offset[k] <= 0:
            wrong.append(name)
    judged = [k for k in range(len(offset)) if (alone & (tension[:, k] > 0) & known & ~laden).sum() >= FEWEST]
    if len(wrong) > 1 and len(wrong) == len(judged):
        yield "every cable pulls the arm to the other side than its offset says; are the pictures mirrored?"
    elif wrong:
        says = "pulls the arm to the other side than its offset says"
        if len(wrong) > 1:
            says = "pull the arm to the other side than their offsets say"
        yield f"{named('cable', wrong)} {says}; exchanged, or a wrong sign?"


def slips_the_other_way(recording: Recording) -> Iterator[str]:
    """Doubts about cables declared as paid out where they alone are pulled harder, or as drawn in where let go, and one
    about all cables that are let go without a column of slip."""
    for name, sequences in contradicted_slips(recording).items():
        yield (
            f"slip_{name} says in {named('sequence', sequences)} that cable {name} is paid out where it is pulled "
            "harder and drawn in where it is let go; is its sign wrong?"
        )
    yield from _no_slips(recording)


def _no_slips(recording: Recording) -> Iterator[str]:
    """A doubt about the cables of :func:`forgotten_slips`."""
    steps = forgotten_slips(recording)
    names, count = list(steps), int(np.any(list(steps.values()), axis=0).sum())
    columns = named("column", [f"slip_{name}" for name in names])
    if len(names) == 1:
        yield (
            f"cable {names[0]} is let go at {count} steps, and there is no {columns}: it is taken as drawn in at all "
            "holes there too; write 1 where it is paid out"
        )
    elif names:
        yield (
            f"{named('cable', names)} are let go at {count} steps in all, and there are no {columns}: they are taken "
            "as drawn in at all holes there too; write 1 where they are paid out"
        )


def forgotten_slips(recording: Recording) -> dict[str, np.ndarray]:
    """(s,) steps, as masks, at which a cable without a column of slip is let go, by name of the cable.

    Only steps at which no other tension changes are judged; with fewer than `FEWEST` of them no cable is named.
    """
    let_go, known = _changes_alone(recording) < 0, recording.steps.columns
    absent = [k for k, name in enumerate(recording.manipulator.cable_names) if f"slip_{name}" not in known]
    if let_go[:, absent].sum() < FEWEST or not _slip_counts(recording):
        return {}
    return {recording.manipulator.cable_names[k]: let_go[:, k] for k in absent if let_go[:, k].any()}


def contradicted_slips(recording: Recording) -> dict[str, list[str]]:
    """The sequences in which the declared slip of a cable contradicts the changes of its tension, by name of the cable.

    Only steps at which no other tension changes are judged.  Cables without such sequences are absent.
    """
    change, out = _changes_alone(recording), dict[str, list[str]]()
    declared = [(k, n) for k, n in enumerate(recording.manipulator.cable_names) if f"slip_{n}" in recording.steps]
    for k, name in declared:
        for number, sequence in enumerate(recording.sequences):
            steps = (change[:, k] != 0) & (recording.of_sequence == number)
            against = recording.loads.slip[steps, k] == change[steps, k]
            if steps.sum() >= FEWEST and against.mean() >= ENOUGH and _slip_counts(recording):
                out.setdefault(name, []).append(sequence)
    return out


def _slip_counts(recording: Recording) -> bool:
    """Whether declared slip matters by the manipulator's file: friction is declared and not zero."""
    manipulator = recording.manipulator
    return not manipulator.follows_history and manipulator.friction.coefficient > 0


def _changes_alone(recording: Recording) -> np.ndarray:
    """(s, m) sign of the change of each tension (:func:`felt_changes`); 0 at steps where other tensions change too."""
    change = felt_changes(recording)
    return np.where((change != 0).sum(1, keepdims=True) == 1, change, 0.0)


def _deflections(recording: Recording, values: np.ndarray) -> np.ndarray:
    """(s,) mean of the `values` (r,) of readings of y, angle and bend at each step, in standard deviations, whose sign
    tells the side to which the arm bends."""
    readings, measurement = recording.readings, recording.measurement
    sd = {Kind.Y: measurement.position_sd_m, Kind.ANGLE: measurement.angle_sd_rad, Kind.BEND: measurement.angle_sd_rad}
    total, count = np.zeros(len(recording.steps)), np.zeros(len(recording.steps))
    for kind, deviation in sd.items():
        rows = readings.kind == kind
        if deviation and rows.any():
            total += np.bincount(readings.step[rows], values[rows] / deviation, len(total))
            count += np.bincount(readings.step[rows], minlength=len(total))
    return total / np.maximum(count, 1)


def _about_their_mean(recording: Recording) -> np.ndarray:
    """(r,) readings less the mean of all of their kind on their disk."""
    readings = recording.readings
    _, marker = np.unique(np.stack([readings.kind, readings.disk]), axis=1, return_inverse=True)
    return readings.value - (np.bincount(marker, readings.value) / np.bincount(marker))[marker]


def _mixed_units(recording: Recording) -> Iterator[str]:
    """A doubt if cables noted in kilograms are pulled much harder, or less hard, than others noted in newtons."""
    names, strongest = recording.manipulator.cable_names, recording.loads.tension.max(0, initial=0.0)
    by_unit = {
        unit: [
            f for name, f in zip(names, strongest, strict=True) if f"cable_{name}_{unit}" in recording.steps and f > 0
        ]
        for unit in ("kg", "n")
    }
    if by_unit["kg"] and by_unit["n"]:
        ratio = max(by_unit["kg"]) / max(by_unit["n"])
        if max(ratio, 1 / ratio) > ALIKE:
            stronger = f"{ratio:.2g} times as strong as" if ratio > 1 else f"{1 / ratio:.2g} times weaker than"
            yield f"cables noted in kilograms are pulled {stronger} those noted in newtons; is a unit wrong?"


def _other_unit(recording: Recording) -> Iterator[str]:
    """A doubt for each sequence that is pulled much harder than all others, as if it was noted in another unit."""
    by_step = recording.loads.tension.max(1, initial=0.0)
    strongest = np.array([by_step[recording.of_sequence == k].max() for k in range(len(recording.sequences))])
    for k, name in enumerate(recording.sequences):
        others = np.delete(strongest, k).max(initial=0.0)
        if 0 < MUCH_STRONGER * others < strongest[k]:
            ratio = written_out(strongest[k] / others, ".2g")
            yield (
                f"sequence {name} is pulled by up to {strongest[k]:.3g} N, {ratio} times as hard as any other "
                f"({others:.3g} N); is it in grams, or in another unit?"
            )


def _never_noted(recording: Recording) -> Iterator[str]:
    """Doubts about cables without a column of tensions, and about sequences without any load."""
    known = set(recording.steps.columns)
    absent = [c for c in recording.manipulator.cable_names if not {f"cable_{c}_n", f"cable_{c}_kg"} & known]
    if absent:
        yield f"{named('cable', absent)} without a column of tensions in the steps: taken as never pulled"
    loads = recording.loads
    pulled = np.hstack([loads.tension, loads.tip, *loads.force.transpose(2, 0, 1)]) != 0
    idle = [n for k, n in enumerate(recording.sequences) if not pulled[recording.of_sequence == k].any()]
    if idle:
        yield f"{named('sequence', idle)}: no load at any step; is a column missing?"


def _too_little(recording: Recording) -> Iterator[str]:
    """Sentences on what a sure diagnosis lacks: a sequence to set aside, or steps at which cables are let go."""
    read = len(np.unique(recording.of_sequence[recording.readings.step]))
    if read < FEWEST_TO_SET_ASIDE:
        which = "one sequence" if read == 1 else f"{read} sequences"
        which += " with readings" * (read < len(recording.sequences))
        yield (
            f"{which} alone: none can be set aside, so a diagnosis is not confirmed; {FEWEST_TO_SET_ASIDE} are needed"
        )
    tension = recording.loads.tension
    if len(tension) and tension.any() and not recording.lets_go:
        yield (
            "no cable is ever let go again: with loading alone friction and lossy pulleys look like stiffer plates; "
            "record the way back too"
        )
