"""Blunders with cables: exchanged, on the wrong side, at the wrong distance, tied to the wrong segment."""

from collections.abc import Iterator
from functools import partial
from itertools import combinations

import numpy as np

from prb3r.diagnosis.checks.setup.remedy import Mended, Remedy, later_parts, parts_of, with_manipulator, with_steps
from prb3r.markdown import listed
from prb3r.model.manipulator import Cable, Manipulator
from prb3r.recording.recording import Recording

ALL_LEVERS = "levers"
"""Kind of the remedies that double or halve the moments of all cables, by their distances or by their tensions."""


def cable_blunders(recording: Recording) -> Iterator[Remedy]:
    """The remedies of all blunders with cables that a recording could hold."""
    yield from _exchanges(recording)
    yield from _sides(recording)
    yield from _distances(recording.manipulator)
    yield from _ends(recording.manipulator)


def _exchanges(recording: Recording) -> Iterator[Remedy]:
    """Weights of two cables noted in each other's column, in all sequences, in one, or from a step on."""
    pulled = recording.loads.tension > 0
    for first, second in combinations(range(pulled.shape[1]), 2):
        pair = tuple(recording.manipulator.cable_names[k] for k in (first, second))
        concerned = pulled[:, first] | pulled[:, second]
        if not concerned.any() or _alike(recording.manipulator, *pair):
            continue
        for when, parts in (("once", parts_of), ("from a step on", later_parts)):
            for rows, where in parts(recording, concerned):
                yield Remedy(
                    f"cables exchanged {when}" if where else "cables exchanged",
                    f"cables {listed(pair)} are exchanged{where}",
                    "steps",
                    partial(_exchanged, pair=pair, rows=rows),
                )


def _alike(manipulator: Manipulator, first: str, second: str) -> bool:
    """Whether two cables, by name, run at the same nominal offset and end at the same segment."""
    a, b = (next(cable for cable in manipulator.cable if cable.name == name) for name in (first, second))
    return a.offset_m == b.offset_m and a.ends_at_segment == b.ends_at_segment


def _exchanged(recording: Recording, pair: tuple[str, ...], rows: np.ndarray) -> Mended:
    """A recording with tensions and slips of two cables, by name, exchanged in the steps `rows` (s,), a mask."""
    steps = recording.steps.copy()
    kilograms = [f"cable_{name}_kg" for name in pair if f"cable_{name}_kg" in steps]
    if len(kilograms) == 1 and any(f"cable_{name}_n" in steps for name in pair):  # noted in two units: newtons for both
        newtons = kilograms[0].removesuffix("_kg") + "_n"
        steps = steps.rename(columns={kilograms[0]: newtons})
        steps[newtons] *= recording.manipulator.gravity_m_s2
    for form, absent in (("cable_{}_n", 0.0), ("cable_{}_kg", 0.0), ("slip_{}", -1.0)):
        names = [form.format(name) for name in pair]
        if not any(name in steps for name in names):
            continue
        values = [steps[name].to_numpy() if name in steps else np.full(len(steps), absent) for name in names]
        for name, here, other in zip(names, values, reversed(values), strict=True):
            steps[name] = np.where(rows, other, here)
    return with_steps(recording, steps)


def _with_cables(recording: Recording, cables: dict[str, Cable]) -> Mended:
    """A recording of a manipulator in which the `cables`, by name, replace those of the same name."""
    manipulator = recording.manipulator
    changed = [cables.get(cable.name, cable) for cable in manipulator.cable]
    return with_manipulator(recording, manipulator.model_copy(update={"cable": changed}))


def _sides(recording: Recording) -> Iterator[Remedy]:
    """Offsets with the wrong sign, of one cable or of all."""
    cables = [cable for cable in recording.manipulator.cable if cable.name in _pulled(recording)]
    chosen = [[cable] for cable in cables] + ([cables] if len(cables) > 1 else [])
    for some in chosen:
        turned = {cable.name: _times(cable, -1.0) for cable in some}
        names = f"of cable {some[0].name}" if len(some) == 1 else "of every cable"
        yield Remedy(
            "sides",
            f"offset_m {names} has the wrong sign",
            "manipulator",
            partial(_with_cables, cables=turned),
        )


def _distances(manipulator: Manipulator) -> Iterator[Remedy]:
    """Offsets of all cables that are twice or half of what they should be."""
    for factor, words in ((0.5, "are the distances of opposite holes"), (2.0, "are half of what they should be")):
        moved = {cable.name: _times(cable, factor) for cable in manipulator.cable}
        if moved:
            change = partial(_with_cables, cables=moved)
            yield Remedy(ALL_LEVERS, f"offset_m of all cables {words}", "manipulator", change)


def _pulled(recording: Recording) -> list[str]:
    """Names of the cables that are ever loaded."""
    used = np.any(recording.loads.tension > 0, axis=0).tolist()
    return [name for name, loaded in zip(recording.manipulator.cable_names, used, strict=True) if loaded]


def _times(cable: Cable, factor: float) -> Cable:
    """A cable with its offsets multiplied by a factor; with -1 it is on the other side of the backbone."""
    offset = cable.offset_m
    several = [factor * value for value in offset] if isinstance(offset, list) else factor * offset
    return cable.model_copy(update={"offset_m": several})


def _ends(manipulator: Manipulator) -> Iterator[Remedy]:
    """Cables that end at another segment: one, all that end at one segment, or those of two segments exchanged."""
    last = len(manipulator.segment)
    groups = {end: [cable for cable in manipulator.cable if cable.ends_at_segment == end] for end in range(1, last + 1)}
    changes = [
        {cable.name: end} for cable in manipulator.cable for end in range(1, last + 1) if end != cable.ends_at_segment
    ]
    changes += [
        {cable.name: other for cable in cables}
        for end, cables in groups.items()
        for other in groups
        if other != end and len(cables) > 1
    ]
    for first, second in combinations([end for end in groups if groups[end]], 2):
        changes.append({c.name: second for c in groups[first]} | {c.name: first for c in groups[second]})
    for ends in changes:
        moved = {cable.name: _ending(cable, ends[cable.name]) for cable in manipulator.cable if cable.name in ends}
        texts = [
            f"cable{'s' * (len(names) > 1)} {listed(names)} end{'s' * (len(names) == 1)} at segment {end}"
            for end in sorted(set(ends.values()))
            if (names := [name for name, at in ends.items() if at == end])
        ]
        yield Remedy(
            "ends",
            f"{' and '.join(texts)}, not where the file says",
            "manipulator",
            partial(_with_cables, cables=moved),
        )


def _ending(cable: Cable, end: int) -> Cable:
    """A cable that ends at segment `end`; where it becomes longer its last offset goes on."""
    offset = cable.offset_m
    if isinstance(offset, list):
        offset = [*offset[:end], *([offset[-1]] * (end - len(offset)))]
    return cable.model_copy(update={"offset_m": offset, "ends_at_segment": end})
