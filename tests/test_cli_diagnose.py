"""`prb3r diagnose`: what it writes, says and refuses."""

import json

import pandas as pd
import pytest
from command import prb3r
from diagnosis.simulated import write_recording
from diagnosis.sisters import write_sister

from prb3r.present.diagnosis import report


@pytest.fixture
def undrawn(monkeypatch):
    """Pages without figures, for tests that look at something else."""
    monkeypatch.setattr(report, "FIGURES", {})


def test_diagnose_writes_its_record_and_says_what_it_found(tmp_path):
    recording, folder = write_recording(tmp_path / "rig"), tmp_path / "out"
    done = prb3r("diagnose", recording, "-o", folder, "-j", 1)
    assert done.returncode == 0, done.stderr
    assert done.stdout.startswith("small rig: explained; chi-square per degree of freedom ")
    assert "- Plate 4 bends as if its stiffness were 0.6" in done.stdout
    assert "held out (out): error 0.58" in done.stdout
    steps = ("set-up", "calibrate", "doubt", "test", "search", "check", "tell", "write")
    told = [line.split(":")[1].split("(")[0].strip() for line in done.stderr.splitlines()]
    assert told == list(steps)
    written = {path.name for path in folder.iterdir()}
    assert {"diagnosis.json", "calibrated.toml", "explained.toml", "report.html"} <= written
    assert {"residuals.parquet", "mismatch.parquet", "residuals.png", "residuals.svg"} <= written
    assert json.loads((folder / "diagnosis.json").read_text())["verdict"] == "explained"
    assert prb3r("solve", folder / "explained.toml", recording / "steps.csv").returncode == 0


def test_diagnose_is_judged_on_other_recordings(tmp_path, undrawn):
    recording, other = write_recording(tmp_path / "rig"), write_recording(tmp_path / "other", seed=1)
    done = prb3r("diagnose", recording, "-o", tmp_path / "out", "--holdout", other, "-j", 1)
    assert done.returncode == 0, done.stderr
    record = json.loads((tmp_path / "out/diagnosis.json").read_text())
    assert record["heldout"]["sequences"][0] == "small rig: out"
    assert record["heldout"]["rmse_explained_m"] < 0.7 * record["heldout"]["rmse_calibrated_m"]
    assert not pd.read_parquet(tmp_path / "out/residuals.parquet")["held_out"].any()


@pytest.mark.long
def test_recordings_are_diagnosed_together_and_one_by_one_otherwise(tmp_path, undrawn):
    short, thick = (write_sister(tmp_path / name, name) for name in ("short", "thick"))
    alone = prb3r("diagnose", short, thick, "-o", tmp_path / "out")
    assert alone.returncode == 2
    assert "several recordings go with --together" in alone.stderr
    done = prb3r("diagnose", short, thick, "--together", "-o", tmp_path / "out", "-j", 1)
    assert done.returncode == 0, done.stderr
    assert "The recordings agree on Young's modulus: 197" in done.stdout
    assert json.loads((tmp_path / "out/together.json").read_text())["recordings"] == ["short", "thick"]
    for name in ("short", "thick"):
        record = json.loads((tmp_path / "out" / name / "diagnosis.json").read_text())
        assert record["verdict"] == "explained"
        assert (tmp_path / "out" / name / "report.html").exists()


@pytest.mark.long
def test_diagnose_exits_with_1_where_nothing_explains(tmp_path, undrawn):
    """Weights that are wrong again and again are neither one slip nor physics."""
    recording = write_recording(tmp_path / "rig", hidden=(), seed=6)
    steps = pd.read_csv(recording / "steps.csv").set_index(["sequence", "step"])
    steps.loc[[("in", 4), ("counter", 2)], "cable_1_n"] *= 0.8
    steps.reset_index().to_csv(recording / "steps.csv", index=False)
    done = prb3r("diagnose", recording, cwd=tmp_path)
    assert done.returncode == 1, done.stderr
    assert done.stdout.startswith("small rig: unexplained")
    record = json.loads((tmp_path / "results/diagnoses/small-rig/diagnosis.json").read_text())
    assert record["verdict"] == "unexplained"


def test_diagnose_refuses_what_is_no_recording(tmp_path):
    recording = write_recording(tmp_path / "rig", hidden=())
    text = (recording / "recording.toml").read_text()
    assert prb3r("diagnose", tmp_path / "none").returncode == 2
    (recording / "recording.toml").write_text(text.replace("position_sd_m", "position_sd_mm"))
    done = prb3r("diagnose", recording, "-o", tmp_path / "out")
    assert done.returncode == 2
    assert "as 'position_sd_m'" in done.stderr
    assert not (tmp_path / "out").exists()
    (recording / "recording.toml").write_text(text)
    done = prb3r("diagnose", recording, "-o", recording / "steps.csv")
    assert done.returncode == 2
    assert "steps.csv is a file" in done.stderr
    done = prb3r("diagnose", recording, "-o", tmp_path / "out", "--holdout", tmp_path / "none")
    assert done.returncode == 2
    assert not (tmp_path / "out").exists()
