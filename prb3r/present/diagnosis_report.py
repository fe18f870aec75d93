"""Figures and report of a diagnosis, beside its record."""

from pathlib import Path

from prb3r.recording.diagnose import Diagnosis


def publish_diagnosis(diagnosis: Diagnosis, folder: Path) -> list[Path]:
    """Draw the figures of a diagnosis and write its report; the files written."""
    return []
