"""What is remarked on beside a verdict."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
from diagnosis.simulated import Case, diagnosed, recorded

from prb3r.diagnosis.known import Task
from prb3r.diagnosis.result.remarks import likely_too, misplaced_marker
from prb3r.diagnosis.settings import Settings
from prb3r.diagnosis.stages import calibrate, doubt, run_stages, serially
from prb3r.recording.recording import Kind, Tolerance

SAID = "the most probable model has 1 effect, as many as are sought"


def test_a_model_with_as_many_effects_as_are_sought_is_said_to_have_them():
    """One weak plate is there: of at most one effect it is the whole."""
    found = run_stages(Task(recorded(), hold_out=False, settings=Settings(most_effects=1)))
    assert [effect.kind for effect in found.effects] == ["weakened_plate"]
    assert any(remark.startswith(SAID) for remark in found.remarks)
    assert not any("as many as are sought" in remark for remark in diagnosed().remarks)


def test_what_is_likely_but_not_named_is_said():
    presence = {"weakened_plate": 1.0, "camera_scale": 0.94, "gravity": 0.3}
    choice = SimpleNamespace(presence=presence, kinds=frozenset({"weakened_plate"}))
    (remark,) = likely_too(choice)
    assert remark.startswith("camera_scale is likely there too (probability 0.94)")
    assert not any("likely there too" in remark for remark in diagnosed().remarks)


def test_a_marker_that_sits_off_its_disk_alone_is_remarked_on():
    """4 mm across disk 3, whose tolerance is 0.2 mm; a bent plate moves the markers behind it too, and is none."""
    recording, tolerance = recorded(Case(hidden=())), Tolerance(marker_m=2e-4)
    here = recording.readings.disk == 3
    angle = np.zeros(len(recording.steps))
    turned = here & (recording.readings.kind == Kind.ANGLE)
    angle[recording.readings.step[turned]] = recording.readings.value[turned]
    across = np.array([-np.sin(angle), np.cos(angle)])[:, recording.readings.step]
    moved = np.select([recording.readings.kind == Kind.X, recording.readings.kind == Kind.Y], across, 0.0)
    placed = recording.with_values(recording.readings.value + 4e-3 * here * moved, tolerance=tolerance)
    bent = {"kind": "precurvature", "curvature_per_m": 1.0, "plates": (3,)}
    told = {}
    for name, task in {
        "off": Task(placed),
        "right": Task(replace(recording, tolerance=tolerance)),
        "bent": Task(replace(recorded(Case(hidden=(tuple(bent.items()),))), tolerance=tolerance)),
    }.items():
        doubted = doubt(calibrate(task), serially)
        told[name] = misplaced_marker(doubted.fitted, doubted.doubts)
    (remark,) = told["off"]
    assert "marker 3 across its disk would be off by 3" in remark or "would be off by 4" in remark
    assert told["right"] == told["bent"] == []
