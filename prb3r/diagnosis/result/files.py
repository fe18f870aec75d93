"""The files of a diagnosis but for figures and report: `diagnosis.json`, the manipulators, tables, proposed steps, and
a mended recording."""

import json
import re
from pathlib import Path

from prb3r.diagnosis.result.diagnosis import Diagnosis
from prb3r.diagnosis.result.projection import MENDED, as_json
from prb3r.diagnosis.result.proposals import files_of, proposed
from prb3r.diagnosis.result.tables import QUANTITIES
from prb3r.model.files.comma_separated import csv_text
from prb3r.model.files.toml import toml_text
from prb3r.model.manipulator import Manipulator
from prb3r.recording.writing import WRITTEN_AGAIN, write_again
from prb3r.runs.files import ensure_writable, write_json, write_whole
from prb3r.runs.store import arrow_table, write_arrow

WRITTEN_TABLES = ("residuals", "mismatch", "detectable")
"""Tables that are written as files."""


def default_folder(name: str) -> Path:
    """The folder of a diagnosis of the recording `name` unless another one is asked for: `results/diagnoses/<name>`."""
    return Path("results", "diagnoses", re.sub(r"[^\w.-]+", "-", name).strip("-.") or "recording")


def write_record(diagnosis: Diagnosis, folder: str | Path) -> list[Path]:
    """Write everything but figures and report, each file whole or not at all, and return the paths of the files.

    Raises
    ------
    SpecError
        If the folder cannot be made or written to.
    EngineError
        If the disk is full.
    """
    folder = Path(folder)
    ensure_writable(folder)
    texts = {}
    for name, manipulator in diagnosis.manipulators.items():
        texts[f"{name}.toml"] = manipulator_toml(manipulator, _provenance(diagnosis, name))
    programs = files_of(proposed(diagnosis.experiments))
    texts |= {name: csv_text(program.experiment.steps) for name, program in programs.items()}
    for old in [*folder.glob("next_experiment*.csv"), *folder.glob("closure.toml")]:
        if old.name not in texts and re.fullmatch(r"next_experiment(_\d+)?\.csv|closure\.toml", old.name):
            old.unlink()  # of an earlier diagnosis
    if not diagnosis.setup:
        _clear(folder / MENDED)
    files = [write_json(folder / "diagnosis.json", as_json(diagnosis))]
    files += [write_whole(folder / name, text.encode()) for name, text in texts.items()]
    made = {"recording": diagnosis.name, "seed": diagnosis.seed, "verdict": diagnosis.verdict}
    for name in WRITTEN_TABLES:
        columns = {column: values.to_numpy() for column, values in diagnosis.tables[name].items()}
        files.append(folder / f"{name}.parquet")
        write_arrow(arrow_table(columns, QUANTITIES, made), files[-1])
    if diagnosis.setup:
        write_again(diagnosis.setup[-1].mended, folder / MENDED)
        files += sorted((folder / MENDED).iterdir())
    return files


def _clear(mended: Path) -> None:
    """Remove the mended recording of an earlier diagnosis; whatever else stands in its folder stays."""
    for name in WRITTEN_AGAIN:
        (mended / name).unlink(missing_ok=True)
    if mended.is_dir() and not any(mended.iterdir()):
        mended.rmdir()


def _provenance(diagnosis: Diagnosis, name: str) -> str:
    """The comment at the top of the manipulator file `name`: where it is from and what it holds."""
    made = {
        "calibrated": "the nominal manipulator with refitted constants",
        "explained": "the nominal manipulator with refitted constants and the effects that the diagnosis names",
        "closure": "as an empirical law describes it, a missing moment without a mechanism",
    }
    recording = json.dumps(diagnosis.name, ensure_ascii=False)
    return f"prb3r diagnose, recording {recording}, seed {diagnosis.seed}: {made[name]} (verdict {diagnosis.verdict})"


def manipulator_toml(manipulator: Manipulator, comment: str) -> str:
    """The text of a manipulator file with a comment line on top; empty lists are left out."""
    plain = {key: value for key, value in manipulator.model_dump(exclude_none=True).items() if value != []}
    return f"# {comment}\n{toml_text(plain)}"
