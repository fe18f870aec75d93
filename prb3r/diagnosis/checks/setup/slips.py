"""Blunders with declared slip: its sign is wrong, its columns were forgotten, or steps were sorted without them."""

from collections.abc import Iterator
from functools import partial

import numpy as np

from prb3r.diagnosis.checks.setup.remedy import Mended, Remedy, parts_of, with_scaled, with_steps
from prb3r.markdown import listed
from prb3r.recording.let_go import felt_changes, slips_by_tension
from prb3r.recording.plausibility import FEWEST, contradicted_slips, forgotten_slips
from prb3r.recording.recording import Recording

SLIPS = "slip", "slip of a part"
"""Kinds of blunders with the sign of declared slip: in all cables and sequences, and in one cable or one sequence."""
FORGOTTEN = "slip forgotten"
"""Kind of the blunder that columns of slip are absent."""


def doubted_slips(recording: Recording) -> tuple[str, ...]:
    """Kinds of blunders with declared slip that the changes of tensions speak for, without any fit."""
    signs = SLIPS if contradicted_slips(recording) else ()
    return (*signs, FORGOTTEN) if forgotten_slips(recording) else signs


def slip_blunders(recording: Recording) -> Iterator[Remedy]:
    """The remedies of all blunders with declared slip that a recording could hold; none where it follows the path."""
    if not recording.manipulator.follows_history:
        yield from _wrong_signs(recording)
        yield from _forgotten(recording)
        yield from _sorted(recording)


def _wrong_signs(recording: Recording) -> Iterator[Remedy]:
    """Declared slip with the wrong sign: of all cables and sequences, of one sequence, of one cable."""
    manipulator, steps = recording.manipulator, recording.steps
    declared = {f"slip_{name}": k for k, name in enumerate(manipulator.cable_names) if f"slip_{name}" in steps}
    felt = (recording.loads.slip != 0) & (recording.loads.tension > 0)
    columns = [column for column, k in declared.items() if felt[:, k].any()]
    if not columns:
        return
    concerned = felt[:, [declared[column] for column in columns]].any(1)
    choices = [(columns, rows, where) for rows, where in parts_of(recording, concerned)]
    if len(columns) > 1:
        choices += [([column], np.ones(len(steps), bool), f" for cable {column[5:]}") for column in columns]
    for names, rows, where in choices:
        yield Remedy(
            SLIPS[1] if where else SLIPS[0],
            f"slip is declared with the wrong sign{where}",
            "steps",
            partial(with_scaled, columns=names, factor=-1.0, rows=rows),
        )


def _forgotten(recording: Recording) -> Iterator[Remedy]:
    """Columns of slip that are absent although a cable that lacks one is let go while it is pulled."""
    cables, steps = recording.manipulator.cable_names, recording.steps
    paid_out = np.any((slips_by_tension(recording) > 0) & (recording.loads.tension > 0), axis=0).tolist()
    absent = [name for name in cables if f"slip_{name}" not in steps]
    let_go = [name for name in absent if paid_out[cables.index(name)]]
    if not let_go:
        return
    columns = [f"slip_{name}" for name in let_go]
    which = f"column {columns[0]} was" if len(columns) == 1 else f"columns {listed(columns)} were"
    if len(absent) == len(cables):
        which = "slip columns were"
    blunder = f"the {which} forgotten: a cable without one counts as drawn in even where its tension falls"
    yield Remedy(FORGOTTEN, blunder, "steps", partial(_with_slips, cables=absent))


def _sorted(recording: Recording) -> Iterator[Remedy]:
    """Steps of the way back that were sorted by tension among those of the way there, of cables without a column of
    slip: of two steps with equal tensions the one or the other was let go."""
    change, steps = felt_changes(recording), recording.steps
    of_sequence, cables = recording.of_sequence, recording.manipulator.cable_names
    falls = np.zeros((len(recording.sequences), len(cables)), bool)
    np.logical_or.at(falls, of_sequence, change < 0)
    absent = np.array([f"slip_{name}" not in steps for name in cables])
    again = (change == 0).all(1) & ~recording.begins  # no cable is pulled otherwise than at the step before
    held = again[:, None] & (recording.loads.tension > 0) & ~falls[of_sequence] & absent
    if held.any(1).sum() < FEWEST:
        return
    names = [name for name, lacks in zip(cables, absent.tolist(), strict=True) if lacks]
    for let_go, which in ((held, "second"), (np.roll(held, -1, axis=0), "first")):
        blunder = f"steps were sorted by tension without a column of slip: of two alike the {which} was let go"
        yield Remedy("steps sorted", blunder, "steps", partial(_with_slips, cables=names, let_go=let_go))


def _with_slips(recording: Recording, cables: list[str], let_go: np.ndarray | None = None) -> Mended:
    """A recording in which the slip of some cables, by name, is declared as their tension says, and as paid out where
    they were `let_go` (s, m), a mask."""
    slip, place = slips_by_tension(recording), recording.manipulator.cable_names
    if let_go is not None:
        slip = np.where(let_go, 1, slip)
    return with_steps(recording, recording.steps.assign(**{f"slip_{c}": slip[:, place.index(c)] for c in cables}))
