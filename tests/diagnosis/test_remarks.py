"""What is remarked on beside a verdict."""

from types import SimpleNamespace

from diagnosis.simulated import diagnosed, recorded

from prb3r.diagnosis.known import Task
from prb3r.diagnosis.result.remarks import likely_too
from prb3r.diagnosis.settings import Settings
from prb3r.diagnosis.stages import run_stages

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
