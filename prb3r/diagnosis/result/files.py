"""The files of a diagnosis: `diagnosis.json`, both manipulators, tables, proposed steps."""

import json
import re
from collections.abc import Iterator
from pathlib import Path

import pandas as pd

from prb3r.diagnosis.fit.model import Fit
from prb3r.diagnosis.result import tables
from prb3r.diagnosis.result.diagnosis import Diagnosis
from prb3r.diagnosis.result.projection import as_json, proposals
from prb3r.model.files.toml import toml_text
from prb3r.model.manipulator import Manipulator
from prb3r.recording.recording import Recording
from prb3r.runs.files import ensure_writable, write_whole
from prb3r.runs.store import arrow_table, write_arrow


def default_folder(recording: Recording) -> Path:
    """Where the record of a diagnosis goes if nobody says: `results/diagnoses/<name>`."""
    return Path("results", "diagnoses", re.sub(r"[^\w.-]+", "-", recording.name).strip("-.") or "recording")


def write(diagnosis: Diagnosis, folder: str | Path) -> list[Path]:
    """Write everything but figures and report, each file whole or not at all; the files written.

    Raises
    ------
    SpecError
        If the folder cannot be made or written to.
    EngineError
        If the disk is full.
    """
    folder = Path(folder)
    ensure_writable(folder)
    record = json.dumps(as_json(diagnosis), indent=1, allow_nan=False, ensure_ascii=False)
    texts = {"diagnosis.json": record + "\n"}
    for name, fitted in models(diagnosis).items():
        texts[f"{name}.toml"] = manipulator_toml(diagnosis.manipulator(fitted), _provenance(diagnosis, name))
    texts |= {name: steps.to_csv(index=False) for name, steps in _proposed(diagnosis)}
    for old in [*folder.glob("next_experiment*.csv"), *folder.glob("closure.toml")]:
        if old.name not in texts and re.fullmatch(r"next_experiment(_\d+)?\.csv|closure\.toml", old.name):
            old.unlink()  # of an earlier diagnosis
    files = [write_whole(folder / name, text.encode()) for name, text in texts.items()]
    made = {"recording": diagnosis.recording.name, "seed": diagnosis.seed, "verdict": diagnosis.verdict}
    for name, frame in (
        ("residuals", tables.residuals(diagnosis)),
        ("mismatch", tables.missing_moments(diagnosis)),
        ("detectable", tables.detectable(diagnosis)),
    ):
        columns = {column: frame[column].to_numpy() for column in frame}
        files.append(folder / f"{name}.parquet")
        write_arrow(arrow_table(columns, tables.QUANTITIES, made), files[-1])
    return files


def models(diagnosis: Diagnosis) -> dict[str, Fit]:
    """The fitted models that become manipulator files."""
    found = {"calibrated": diagnosis.calibrated, "explained": diagnosis.explained}
    return found | ({"closure": diagnosis.closure.fitted} if diagnosis.closure else {})


def _proposed(diagnosis: Diagnosis) -> Iterator[tuple[str, pd.DataFrame]]:
    """Name and steps of the table of each proposed experiment."""
    found = proposals(diagnosis)
    for number, each in enumerate(found, 1):
        yield f"next_experiment{f'_{number}' if len(found) > 1 else ''}.csv", each.experiment.steps


def _provenance(diagnosis: Diagnosis, name: str) -> str:
    what = {
        "calibrated": "the nominal manipulator with refitted constants",
        "explained": "the nominal manipulator with refitted constants and the effects that the diagnosis names",
        "closure": "as an empirical law describes it, a missing moment without a mechanism",
    }
    recording = json.dumps(diagnosis.recording.name, ensure_ascii=False)
    return f"prb3r diagnose, recording {recording}, seed {diagnosis.seed}: {what[name]} (verdict {diagnosis.verdict})"


def manipulator_toml(manipulator: Manipulator, comment: str) -> str:
    """A manipulator as its file, with a comment line on top; empty lists are left out."""
    plain = {key: value for key, value in manipulator.model_dump(exclude_none=True).items() if value != []}
    return f"# {comment}\n{toml_text(plain)}"
