"""Checking a file or the folder of a recording: what it is, whether it is in order, and remarks on it."""

import os
from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING

import pandas as pd

from prb3r.errors import Problem, SpecError
from prb3r.inverse.target import COORDINATES, target_rows
from prb3r.model.effects.loads import Gravity
from prb3r.model.files.cells import blank_rows, count, numbers, ranges
from prb3r.model.files.kinds import kind_of_keys
from prb3r.model.files.table import TABLE_SUFFIXES, read_table
from prb3r.model.files.toml import toml_contents
from prb3r.model.manipulator import Manipulator, load_manipulator
from prb3r.model.solve import POSITION_COLUMNS
from prb3r.model.step_checks import LOAD_COLUMN_FORMS, ignored_slips, is_load_column, let_go_as_drawn, step_problems
from prb3r.model.steps import load_steps
from prb3r.recording.at_odds import at_odds
from prb3r.recording.frozen import frozen
from prb3r.recording.holds import creeping
from prb3r.recording.markers import MARKER_COLUMNS, MARKER_KEYS, marker_problems
from prb3r.recording.plausibility import implausible
from prb3r.recording.reading import RECORDING_FILE, load_recording
from prb3r.recording.recording import Kind
from prb3r.recording.times import odd_times, times_told

if TYPE_CHECKING:
    from prb3r.study.spec import Study


def only_manipulator(paths: Iterable[Path]) -> Manipulator | None:
    """The manipulator among the files to be checked, if there is a single one and it is in order; else None."""
    different = {os.path.realpath(path): path for path in paths}.values()
    manipulators = [path for path in different if _is_toml(path) and kind_of_file(path) == "manipulator"]
    try:
        return load_manipulator(manipulators[0]) if len(manipulators) == 1 else None
    except SpecError:
        return None


def check_file(path: Path, manipulator: Manipulator | None = None) -> str:
    """Check a file or a recording, and say what it is: one line, and one more for each remark.

    A file may hold a manipulator, a study, requirements or a table.  With a `manipulator`, a table of load steps or of
    readings is checked against it.

    Raises
    ------
    Prb3rError
        With every problem of the file.
    """
    if not os.path.exists(path):
        raise SpecError(Problem(str(path), "no such file or folder"))
    if path.is_dir():
        return _check_recording(path)
    if path.suffix.lower() in TABLE_SUFFIXES:
        return _check_table(path, manipulator)
    if not _is_toml(path):
        raise SpecError(Problem(str(path), "not a .toml, .csv or .parquet file"))
    kind = kind_of_file(path)
    if kind == "recording" or path.name == RECORDING_FILE:
        return _check_recording(path)
    if not kind and (contents := toml_contents(path)) is not None:
        what = "says nothing of a manipulator (disk, segment, cable) or of a study (manipulator, factor, step)"
        raise SpecError(Problem(str(path), what if contents else "is empty: no manipulator, study or recording"))
    checks = {"manipulator": _check_manipulator, "requirements": _check_wishes}
    return checks.get(kind, _check_study)(path)


def kind_of_file(path: Path) -> str:
    """The kind of a TOML file, as :func:`kind_of_keys` names it; empty if it is of none or cannot be read."""
    return kind_of_keys((toml_contents(path) or {}).keys())


def _is_toml(path: Path) -> bool:
    return path.suffix.lower() == ".toml"


def _check_manipulator(path: Path) -> str:
    """What a manipulator is made of, in one line, and a remark on masses without weight and each effect that changes
    nothing; raises SpecError for problems."""
    manipulator = load_manipulator(path)
    line = (
        f"manipulator, {count(len(manipulator.segment), 'segment')}, {count(manipulator.plates, 'plate')}, "
        f"{count(len(manipulator.cable), 'cable')}, {manipulator.chain().length:.4g} m long"
    )
    return "\n  ".join([line, *_thicker_than_wide(manipulator), *_weightless(manipulator), *_idle_effects(manipulator)])


def _thicker_than_wide(manipulator: Manipulator) -> list[str]:
    """A remark on each segment whose plates are thicker than wide, so that they would bend out of the plane first."""
    return [
        f"segment {number}: its plates are thicker ({segment.thickness_m:g} m) than wide ({segment.width_m:g} m), and "
        "would bend out of the plane first: are thickness_m and width_m exchanged?"
        for number, segment in enumerate(manipulator.segment, 1)
        if segment.thickness_m is not None and segment.width_m is not None and segment.thickness_m > segment.width_m
    ]


def _weightless(manipulator: Manipulator) -> list[str]:
    """A remark on masses on which no gravity acts, none where there are no masses or gravity acts."""
    falls = any(isinstance(effect, Gravity) and (effect.x_m_s2 or effect.y_m_s2) for effect in manipulator.effect)
    if falls or not manipulator.disk_masses.any():
        return []
    mass = f"{manipulator.disk_masses.sum():.3g} kg"
    return [f"its masses ({mass}) weigh nothing without an effect gravity, as is right where the arm moves level"]


def _idle_effects(manipulator: Manipulator) -> list[str]:
    """A remark on each effect that changes nothing."""
    idle = ((effect.kind, effect.idle(manipulator)) for effect in manipulator.effect)
    return [f"effect {kind} changes nothing: {why}" for kind, why in idle if why]


def _check_wishes(path: Path) -> str:
    """How many requirements and preferences a file holds, in one line; raises SpecError for problems."""
    from prb3r.study.wishes import load_wishes

    wishes = load_wishes(path)
    wanted = f"{count(len(wishes.requirement), 'requirement')}, {count(len(wishes.preference), 'preference')}"
    return f"{wanted} for `prb3r compare --requirements`; their columns are checked with the results"


def _check_study(path: Path) -> str:
    """How many cases a study has, at most if it searches, in one line, and remarks on slips that they ignore or lack;
    raises SpecError for problems."""
    from prb3r.study.loads import drawn_while_let_go, load_columns
    from prb3r.study.plan import plan_study

    plan = plan_study(path)
    ignored: dict[str, int] = {}
    for family in plan.cases.families:
        settings = family.settings
        steps = [] if settings["cloud"] or settings["reach"] else [settings["initial"], *settings["step"]]
        declared = {name for step in steps for name in step if name.startswith("slip_")}
        arm = family.manipulator()
        if what := ignored_slips(arm, declared):
            ignored[what] = ignored.get(what, 0) + len(family)
        columns = load_columns(settings, len(family)) if steps else {}
        alive = [name for name in arm.cable_names if name not in settings["broken"]]
        late = {name: drawn_while_let_go(columns, name) for name in alive}
        if what := let_go_as_drawn(arm, [name in late and bool(late[name].any()) for name in arm.cable_names]):
            cases = zip(*(drawn.tolist() for drawn in late.values()), strict=True)
            ignored[what] = ignored.get(what, 0) + sum(map(any, cases))
    remarks = [f"{what}, in {number} of them" for what, number in ignored.items()]
    remarks += _dropped_loads(plan.study)
    most = "at most " if plan.study.search is not None else ""
    return "\n  ".join([f"study of {most}{count(plan.most_cases, 'case')}", *remarks])


def _dropped_loads(study: "Study") -> list[str]:
    """A remark for each level whose loads stand in place of loads of the study that they do not name."""
    said = []
    for factor in study.factor:
        for level in factor.level or ():
            for key, base, own in (
                ("step", study.step, level.step),
                ("initial", [study.initial], None if level.initial is None else [level.initial]),
            ):
                named = {name for step in own or () for name in step}
                dropped = list(dict.fromkeys(name for step in base for name in step if name not in named))
                if own is not None and dropped:
                    what = f"level {level.label!r} of {factor.name}: its {key} stands in place of the study's"
                    said.append(
                        f"{what}, so that {', '.join(dropped)} of that {'is' if len(dropped) == 1 else 'are'} dropped"
                    )
    return said


def _check_recording(path: Path) -> str:
    """What a recording holds, in one line, and its remarks and doubts about it; raises RecordingError for problems."""
    recording = load_recording(path)
    readings, measured = recording.readings, recording.measurement
    kinds = [(kind.column, int((readings.kind == kind).sum())) for kind in Kind]
    deviations = {"positions": (measured.position_sd_m, "m"), "angles": (measured.angle_sd_rad, "rad")}
    read = {"positions" if Kind(kind).is_position else "angles" for kind in set(readings.kind.tolist())}
    exact = [f"{name} within {sd:g} {unit}" for name, (sd, unit) in deviations.items() if sd and name in read]
    line = (
        f"recording, {count(len(recording.sequences), 'sequence')}, {count(len(recording.steps), 'step')}, "
        f"{count(readings.count, 'reading')} ({', '.join(f'{number} {name}' for name, number in kinds if number)}) "
        f"of disks {ranges(readings.disk)} of {recording.manipulator.plates}; {', '.join(exact)}, "
        f"tensions within {100 * measured.tension_sd_relative:.2g} % (standard deviations)"
    )
    doubts = [
        *implausible(recording),
        *odd_times(recording),
        *at_odds(recording),
        *creeping(recording),
        *frozen(recording),
    ]
    remarks = [*times_told(recording), *recording.remarks, *_idle_effects(recording.manipulator)]
    return "\n  ".join([line, *remarks, *doubts])


def _check_table(path: Path, manipulator: Manipulator | None) -> str:
    """What a table of steps, readings or targets holds, in one line, and remarks; raises SpecError for problems."""
    frame = read_table(path)
    columns = set(frame.columns)
    if columns & {"disk", *MARKER_COLUMNS} and columns & {"sequence", "disk"}:
        return _check_readings(path, frame, manipulator)
    if columns & set(COORDINATES):
        return f"{count(len(target_rows(path)), 'target')} for `prb3r reach --path`, or for a study"
    if any(map(is_load_column, columns)) or {"sequence", "step"} <= columns:
        return _check_steps(path, frame, manipulator)
    what = (
        f"holds {_named(frame.columns)}; load steps have sequence, step and columns such as {LOAD_COLUMN_FORMS[0]}, "
        f"readings {', '.join(MARKER_KEYS)} and some of {', '.join(MARKER_COLUMNS)}, targets some of "
        f"{', '.join(COORDINATES)}"
    )
    raise SpecError(Problem(str(path), what))


def _named(columns: Iterable[str], most: int = 8) -> str:
    """Names of columns in words, of many the first and how many more there are."""
    names = list(map(str, columns))
    more = f" and {count(len(names) - most, 'more column')}" if len(names) > most else ""
    return "the columns " + ", ".join(names[:most]) + more if names else "no columns"


def _check_steps(path: Path, frame: pd.DataFrame, manipulator: Manipulator | None) -> str:
    """What a table of load steps holds, in one line, and remarks on slips that are ignored or missing; raises SpecError
    for problems."""
    if manipulator is not None:
        table = load_steps(manipulator, frame, str(path))
        line = f"table of {count(len(table.steps), 'step')} in {count(len(table.names), 'sequence')}"
        remarks = [
            ignored_slips(manipulator, frame.columns),
            let_go_as_drawn(manipulator, table.let_go_as_drawn.tolist()),
            _without_loads(frame.columns),
        ]
        return "\n  ".join(filter(None, [line, *remarks]))
    frame = frame[~blank_rows(frame)]
    if problems := step_problems(None, frame, str(path)) or [Problem(str(path), "holds no steps")] * frame.empty:
        raise SpecError(*problems)
    line = (
        f"table of {count(len(frame), 'step')} in {count(frame['sequence'].nunique(), 'sequence')}; "
        "its columns are checked with the manipulator they load, if one is named beside it"
    )
    return "\n  ".join(filter(None, [line, _without_loads(frame.columns)]))


def _without_loads(columns: Iterable[str]) -> str:
    """A remark on a table of steps that loads nothing; empty for all others."""
    return (
        ""
        if any(map(is_load_column, columns))
        else f"no column of loads, such as {LOAD_COLUMN_FORMS[0]}: nothing pulls"
    )


def _check_readings(path: Path, frame: pd.DataFrame, manipulator: Manipulator | None) -> str:
    """What a table of readings, or of shapes that `prb3r solve` writes, holds, in one line; raises SpecError for
    problems."""
    shapes = frame.columns.tolist() == POSITION_COLUMNS
    frame = frame[~blank_rows(frame)]
    readings = frame.drop(columns="outcome") if shapes else frame
    if problems := marker_problems(readings, None, manipulator, None, str(path)):
        raise SpecError(*problems)
    read = [name for name in MARKER_COLUMNS if name in frame]
    return (
        f"table of {'shapes' if shapes else 'readings'} ({', '.join(read)}) of disks {ranges(numbers(frame['disk']))} "
        f"in {count(frame['sequence'].nunique(), 'sequence')}"
        + (", as `prb3r solve` writes them" if shapes else "; its steps are checked with the folder of the recording")
    )
