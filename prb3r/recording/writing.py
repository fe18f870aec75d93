"""Write a recording's folder."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any, Literal

import pandas as pd

from prb3r.model.files.table import write_table
from prb3r.model.files.toml import toml_text
from prb3r.recording.reading import RECORDING_FILE
from prb3r.recording.recording import RecordingFile


def write_recording(
    folder: str | Path,
    described: RecordingFile,
    manipulator: Mapping[str, Any] | str,
    steps: pd.DataFrame | Mapping[str, Any],
    markers: pd.DataFrame | Mapping[str, Any],
    suffix: Literal[".csv", ".parquet"] = ".csv",
) -> None:
    """Write `recording.toml`, the manipulator that it names, and both tables.

    Parameters
    ----------
    manipulator : the contents of its file, as data or as text.
    steps, markers : tables, or their columns.

    Raises
    ------
    SpecError
        For a place that cannot be written.
    """
    folder = Path(folder)
    folder.mkdir(parents=True, exist_ok=True)
    (folder / RECORDING_FILE).write_text(toml_text(described.model_dump(exclude_unset=True)), "utf-8")
    text = manipulator if isinstance(manipulator, str) else toml_text(manipulator)
    (folder / described.manipulator).write_text(text, "utf-8")
    for name, table in (("steps", steps), ("markers", markers)):
        write_table(pd.DataFrame(table), folder / f"{name}{suffix}")
