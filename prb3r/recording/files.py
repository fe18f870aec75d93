"""The files of a diagnosis: `diagnosis.json`, both manipulators, tables, proposed steps."""

import json
import re
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import pandas as pd
import tomli_w

from prb3r.model.manipulator import Manipulator
from prb3r.recording import tables
from prb3r.recording.diagnose import Diagnosis
from prb3r.recording.record import as_json, proposals
from prb3r.recording.recording import Recording
from prb3r.study import store


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
    store.ensure_writable(folder)
    record = json.dumps(as_json(diagnosis), indent=1, allow_nan=False, ensure_ascii=False)
    texts = {"diagnosis.json": record + "\n"}
    for name, fitted in (("calibrated", diagnosis.calibrated), ("explained", diagnosis.explained)):
        texts[f"{name}.toml"] = manipulator_toml(diagnosis.manipulator(fitted), _provenance(diagnosis, name))
    texts |= {name: steps.to_csv(index=False) for name, steps in _proposed(diagnosis)}
    for old in folder.glob("next_experiment*.csv"):
        if old.name not in texts and re.fullmatch(r"next_experiment(_\d+)?\.csv", old.name):
            old.unlink()
    files = [store.write_whole(folder / name, text.encode()) for name, text in texts.items()]
    made = {"recording": diagnosis.recording.name, "seed": diagnosis.seed, "verdict": diagnosis.verdict}
    for name, frame in (
        ("residuals", tables.residuals(diagnosis)),
        ("mismatch", tables.missing_moments(diagnosis)),
        ("detectable", tables.detectable(diagnosis)),
    ):
        columns = {column: frame[column].to_numpy() for column in frame}
        files.append(folder / f"{name}.parquet")
        store.write(store.table(columns, tables.QUANTITIES, made), files[-1])
    return files


def _proposed(diagnosis: Diagnosis) -> Iterator[tuple[str, pd.DataFrame]]:
    """Name and steps of the table of each proposed experiment."""
    found = proposals(diagnosis)
    for number, each in enumerate(found, 1):
        yield f"next_experiment{f'_{number}' if len(found) > 1 else ''}.csv", each.experiment.steps


def _provenance(diagnosis: Diagnosis, name: str) -> str:
    what = {
        "calibrated": "the nominal manipulator with refitted constants",
        "explained": "the nominal manipulator with refitted constants and the effects that the diagnosis names",
    }
    recording = json.dumps(diagnosis.recording.name, ensure_ascii=False)
    return f"prb3r diagnose, recording {recording}, seed {diagnosis.seed}: {what[name]} (verdict {diagnosis.verdict})"


def manipulator_toml(manipulator: Manipulator, comment: str) -> str:
    """A manipulator as its file, with a comment line on top."""
    plain = manipulator.model_dump(exclude_none=True)
    return f"# {comment}\n{tomli_w.dumps(_own(plain))}{''.join(_tables(plain, ''))}"


def _own(plain: Mapping[str, Any]) -> dict[str, Any]:
    """What is not a list of tables."""
    return {key: value for key, value in plain.items() if not _is_list_of_tables(value)}


def _is_list_of_tables(value: Any) -> bool:
    return isinstance(value, list) and all(isinstance(each, dict) for each in value)


def _tables(plain: Mapping[str, Any], above: str) -> Iterator[str]:
    """Lists of tables, each table under its own heading as people write them; empty lists are left out."""
    for key, value in plain.items():
        for each in value if _is_list_of_tables(value) else ():
            yield f"\n[[{above}{key}]]\n{tomli_w.dumps(_own(each))}"
            yield from _tables(each, f"{above}{key}.")
