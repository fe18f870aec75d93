"""Writing the folder of a recording, from its parts or from a recording in memory."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any, Literal

import numpy as np
import pandas as pd

from prb3r.model.files.table import write_table
from prb3r.model.files.toml import toml_text
from prb3r.recording.reading import RECORDING_FILE
from prb3r.recording.recording import Kind, Recording, RecordingFile

WRITTEN_AGAIN = RECORDING_FILE, "manipulator.toml", "steps.csv", "markers.csv"
"""Names of the files of :func:`write_again`."""


def write_recording(
    folder: str | Path,
    described: RecordingFile,
    manipulator: Mapping[str, Any] | str,
    steps: pd.DataFrame | Mapping[str, Any],
    markers: pd.DataFrame | Mapping[str, Any],
    suffix: Literal[".csv", ".parquet"] = ".csv",
) -> None:
    """Write `recording.toml`, the file of the manipulator that it names, and both tables into a folder.

    Parameters
    ----------
    described : what `recording.toml` is to hold.
    manipulator : the contents of the manipulator's file, as data or as text.
    steps, markers : tables, or their columns.
    suffix : file type of the tables.

    Raises
    ------
    SpecError
        For a place that cannot be written.
    """
    folder = Path(folder)
    folder.mkdir(parents=True, exist_ok=True)
    (folder / RECORDING_FILE).write_text(
        toml_text(described.model_dump(exclude_unset=True, exclude_none=True)), "utf-8"
    )
    text = manipulator if isinstance(manipulator, str) else toml_text(manipulator)
    (folder / described.manipulator).write_text(text, "utf-8")
    for name, table in (("steps", steps), ("markers", markers)):
        write_table(pd.DataFrame(table), folder / f"{name}{suffix}")


def marker_table(recording: Recording) -> pd.DataFrame:
    """The readings of a recording as a table of markers; a marker that was read several times has as many rows."""
    step, disk, kind, value = recording.readings
    rows = pd.DataFrame({"row": step, "disk": disk, "kind": kind, "value": value})
    rows["again"] = rows.groupby(["row", "disk", "kind"]).cumcount()
    wide = rows.pivot(index=["row", "disk", "again"], columns="kind", values="value").reset_index()
    keys = recording.steps.loc[wide["row"], ["sequence", "step"]].reset_index(drop=True)
    read = {Kind(k).column: wide[k] for k in np.unique(kind).tolist()}
    return keys.assign(disk=wide["disk"], **read)


def write_again(recording: Recording, folder: str | Path) -> None:
    """Write a recording in memory as a folder from which the same recording is read.

    Raises
    ------
    SpecError
        For a place that cannot be written.
    """
    described = RecordingFile(
        name=recording.name,
        manipulator="manipulator.toml",
        image_centre_m=recording.image_centre_m,
        measurement=recording.measurement,
        prior=recording.prior,
        tolerance=recording.tolerance,
        sharing=recording.sharing,
    )
    plain = recording.manipulator.model_dump(exclude_none=True)
    manipulator = {key: value for key, value in plain.items() if value != []}
    write_recording(folder, described, manipulator, recording.steps, marker_table(recording))
