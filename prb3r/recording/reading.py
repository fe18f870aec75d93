"""Reading the folder of a recording into a :class:`Recording`, or reporting all its problems at once."""

from pathlib import Path

import numpy as np
import pandas as pd

from prb3r.errors import Problem, RecordingError, SpecError, did_you_mean
from prb3r.model.files.cells import blank_rows, is_empty, rows_of
from prb3r.model.files.kinds import wrong_kind
from prb3r.model.files.table import TABLE_SUFFIXES, read_table
from prb3r.model.files.toml import place_of, read_toml, toml_contents
from prb3r.model.manipulator import Manipulator, load_manipulator
from prb3r.model.steps import loads_of
from prb3r.recording import markers
from prb3r.recording.findings import Findings
from prb3r.recording.recording import Kind, Measurement, Recording, RecordingFile
from prb3r.recording.steps import cleaned
from prb3r.recording.units import doubts

RECORDING_FILE = "recording.toml"


def load_recording(path: str | Path) -> Recording:
    """Read a recording.

    Parameters
    ----------
    path : the folder of the recording, or its TOML file.

    Raises
    ------
    RecordingError
        With every problem of its files at once.

    Examples
    --------
    >>> import prb3r
    >>> prb3r.load_recording("studies/recordings/bench-example")
    Recording('bench example', sequences=6, steps=42, readings=1713)
    """
    path = Path(path)
    if not path.exists():
        raise RecordingError(Problem(str(path), "no such file or folder"))
    file = path / RECORDING_FILE if path.is_dir() else path
    if file.suffix.lower() != ".toml":
        raise RecordingError(Problem(str(path), f"not a recording; give its folder or its {RECORDING_FILE}"))
    if path.is_dir() and not any(next(path.glob(name), None) for name in (RECORDING_FILE, "steps.*", "markers.*")):
        what = f"holds no recording: that is a folder with {RECORDING_FILE}, and steps and markers as .csv or .parquet"
        raise RecordingError(Problem(str(path), what))
    if what := wrong_kind(toml_contents(file) or {}, "recording"):
        raise RecordingError(Problem(str(file), what))
    findings = Findings()
    described = findings.tried(lambda: read_toml(file, RecordingFile))
    named = described.manipulator if described else _named_manipulator(file)
    manipulator = findings.tried(lambda: _manipulator(file, named)) if named else None
    measurement = described.measurement if described else None
    step_file, steps = _table(file.parent, "steps", findings)
    if steps is not None:
        steps = cleaned(steps, manipulator, step_file, findings)
    marker_file, rows = _table(file.parent, "markers", findings)
    if rows is not None:
        findings.problems += markers.marker_problems(rows, steps, manipulator, measurement, marker_file)
        if measurement:
            findings.problems += _without_deviation(rows, measurement, file)
    if findings.problems or described is None or manipulator is None or steps is None or rows is None:
        raise RecordingError(*findings.problems)
    readings = markers.readings_of(rows, steps, manipulator.plates, marker_file, findings)
    of_sequence, names = pd.factorize(steps["sequence"])
    return Recording(
        name=described.name,
        manipulator=manipulator,
        measurement=described.measurement,
        prior=described.prior,
        tolerance=described.tolerance,
        sharing=described.sharing,
        image_centre_m=described.image_centre_m,
        sequences=tuple(names),
        steps=steps,
        of_sequence=of_sequence.astype(np.int64),
        loads=loads_of(manipulator, manipulator.chain(), steps),
        readings=readings,
        remarks=(*findings.remarks, *doubts(manipulator, described.measurement, described.tolerance)),
    )


def _manipulator(file: Path, named: str) -> Manipulator:
    """The manipulator whose file is `named` in the recording `file`.

    Raises SpecError for a wrong file, or, if there is no such file, with the place of its name in the recording file.
    """
    path = file.parent / named
    if not path.exists():
        others = [other.name for other in path.parent.glob("*.toml") if other != file]
        place = place_of(file, ("manipulator",))
        raise SpecError(Problem(place, f"there is no file {str(path)!r}{did_you_mean(named, others)}"))
    return load_manipulator(path)


def _named_manipulator(file: Path) -> str | None:
    """The manipulator file that a recording file with problems names, as far as it can be read; None if it cannot."""
    named = (toml_contents(file) or {}).get("manipulator")
    return named if isinstance(named, str) and named else None


def _table(folder: Path, name: str, findings: Findings) -> tuple[str, pd.DataFrame | None]:
    """The file of one table of a recording (`steps` or `markers`), and the table without its empty rows.

    The table is None, and the file may be empty, where there are problems; these are added to `findings`.
    """
    there = (file for file in sorted(folder.glob(f"{name}.*")) if file.stem == name)
    files = [file for file in there if file.suffix.lower() in TABLE_SUFFIXES]
    if len(files) != 1:
        what = (
            f"both {' and '.join(file.name for file in files)}; keep one"
            if files
            else f"no {name}.csv or {name}.parquet"
        )
        findings.problems.append(Problem(str(folder), what))
        return "", None
    frame = findings.tried(lambda: read_table(files[0]))
    if frame is None:
        return str(files[0]), None
    if (blank := blank_rows(frame)).any():
        findings.remarks.append(
            f"{rows_of(blank)} of {files[0].name} hold{'s' if blank.sum() == 1 else ''} nothing at all"
        )
    return str(files[0]), frame[~blank]


def _without_deviation(rows: pd.DataFrame, measurement: Measurement, file: Path) -> list[Problem]:
    """A problem for each kind of readings, positions or angles, that is recorded but whose standard deviation is not
    given."""
    problems = []
    for key, kinds in (("position_sd_m", (Kind.X, Kind.Y)), ("angle_sd_rad", (Kind.ANGLE, Kind.BEND))):
        read = [kind.column for kind in kinds if kind.column in rows and not is_empty(rows[kind.column]).all()]
        if read and getattr(measurement, key) is None:
            place = place_of(file, ("measurement",))
            problems.append(Problem(place, f"{key!r} is missing, but the markers record {' and '.join(read)}"))
    return problems
