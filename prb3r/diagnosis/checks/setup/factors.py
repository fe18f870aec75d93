"""Blunders with the weights of one sequence that are no mistaken unit: noted as a multiple of what hung there."""

from collections.abc import Iterator, Sequence
from functools import partial
from itertools import pairwise

import numpy as np

from prb3r.diagnosis.checks.setup.remedy import Multiple, Remedy, with_scaled
from prb3r.model.step_checks import cable_columns
from prb3r.recording.recording import Recording

FACTORS = (0.5, 0.8, 1.25, 2.0)
"""Factors on what is noted that are tried first.  Choice: halves, doubles, and the next plate of a set of weights."""
AS_FAR = 0.8
"""Share of a cable's largest tension in a mended sequence that it has to reach in another one, as else nothing tells
its weights from the cable itself, or from an arm that bends otherwise when pulled harder.  Choice."""
MISNOTED = "weights of a sequence"
"""Kind of the remedies that multiply the weights of a sequence by a factor."""


def factor_blunders(recording: Recording, among: Sequence[str]) -> Iterator[Remedy]:
    """The remedies of all blunders with the weights of the sequences named in `among`: of each cable that other
    sequences pull too, and of all of a sequence's cables together."""
    names, columns = recording.manipulator.cable_names, cable_columns(recording.manipulator, recording.steps)
    for sequence in among:
        here = recording.of_sequence == recording.sequences.index(sequence)
        most, elsewhere = (recording.loads.tension[rows].max(axis=0, initial=0.0) for rows in (here, ~here))
        told = [name for name, some in zip(names, (most > 0) & (elsewhere > 0), strict=True) if some]
        places = [(f"of cable {name} in sequence {sequence}", [name]) for name in told]
        if 1 < len(told) == (most > 0).sum():
            places.append((f"of sequence {sequence}", told))
        for whose, cables in places:
            noted = [name for name in columns if name.removeprefix("cable_").rpartition("_")[0] in cables]
            reached = [name not in cables for name in names] | (elsewhere >= AS_FAR * most * np.array(FACTORS)[:, None])
            for factor in np.array(FACTORS)[reached.all(1)].tolist():
                yield _multiplied(factor, whose, noted, here)


def _multiplied(factor: float, whose: str, columns: Sequence[str], rows: np.ndarray) -> Remedy:
    """The remedy that multiplies the weights in some columns and rows (a mask) by a factor."""
    return Remedy(
        MISNOTED,
        f"the weights {whose} are noted as {1 / factor:.3g} times what hung there",
        "steps",
        partial(with_scaled, columns=columns, factor=factor, rows=rows),
        factor=Multiple(factor, whose, partial(_multiplied, whose=whose, columns=columns, rows=rows)),
    )


def finer(factor: float, rounds: int) -> list[float]:
    """Factors around the best one after so many rounds of them, four times as close as in the round before."""
    gap = max(np.log(b / a) for a, b in pairwise(FACTORS)) / 4**rounds
    return [float(factor * np.exp(gap * share)) for share in np.linspace(-1, 1, 9)]
