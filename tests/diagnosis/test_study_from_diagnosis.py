"""A study that starts from a diagnosis keeps what the study says of its manipulator."""

import json

import numpy as np
import pytest
from diagnosis.simulated import diagnosed, manipulator

from prb3r import SpecError, predict
from prb3r.diagnosis.result.files import write_record
from prb3r.diagnosis.result.learnt_study import learnt_study
from prb3r.model.files.toml import toml_text
from prb3r.study.plan import plan_study

STUDY = {
    "name": "next",
    "title": "next",
    "manipulator": "same.toml",
    "step": [{"cable_1_n": 20}],
    "metric": [{"kind": "position"}],
}
GRAVITY = {"kind": "gravity", "x_m_s2": 9.81, "y_m_s2": 0.0}


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    folder = tmp_path_factory.mktemp("learnt")
    write_record(diagnosed(), folder)
    (folder / "same.toml").write_text(toml_text(manipulator()))
    return folder


def learnt(folder, **more):
    """The manipulators of all cases of the study, with what was learnt."""
    study, into = folder / "study.toml", folder / "learnt.toml"
    study.write_text(toml_text(STUDY | more))
    into.write_text(learnt_study(folder, study, into, count=8).text)
    return [case.manipulator() for case in plan_study(into).cases]


def test_effects_that_the_study_sets_act_beside_what_was_learnt(folder):
    for rig in learnt(folder, set={"effect": [GRAVITY]}):
        assert rig.effect[0].model_dump() == GRAVITY
        assert "weakened_plate" in {effect.kind for effect in rig.effect}


def test_of_another_geometry_that_the_study_sets_faults_of_single_parts_stay_behind(folder):
    for rig in learnt(folder, set={"segment.1.length_m": 0.04}):
        assert rig.segment[0].length_m == 0.04
        assert "weakened_plate" not in {effect.kind for effect in rig.effect}
    assert "# left behind: weakened plate" in (folder / "learnt.toml").read_text()


def test_where_nobody_says_on_which_bench_half_of_the_rigs_have_what_belongs_to_it(folder, tmp_path):
    record = json.loads((folder / "diagnosis.json").read_text())
    for model in record["posterior"]["models"]:
        model |= {"effects": [{"kind": "tension_offset", "offset_n": 0.4}], "free": [], "covariance": []}
    (tmp_path / "diagnosis.json").write_text(json.dumps(record))
    (tmp_path / "same.toml").write_text((folder / "same.toml").read_text())
    study, into = tmp_path / "study.toml", tmp_path / "learnt.toml"
    study.write_text(toml_text(STUDY | {"set": {"segment.1.length_m": 0.04}}))
    having, said = [], []
    for bench in (None, True, False):
        learnt = learnt_study(tmp_path, study, into, count=8, same_bench=bench)
        into.write_text(learnt.text)
        having.append(sum(bool(case.manipulator().effect) for case in plan_study(into).cases))
        said.append(any("half of the rigs are for another one" in remark for remark in learnt.remarks))
    assert having == [4, 8, 0]
    assert said == [True, False, False]


def test_the_modulus_that_is_learnt_is_that_of_the_rig_whatever_the_study_sets(folder):
    """The factor on E is one on the nominal modulus of the recorded rig."""
    plain, other = learnt(folder), learnt(folder, set={"youngs_modulus_pa": 1e11})
    assert [rig.youngs_modulus_pa for rig in other] == pytest.approx([rig.youngs_modulus_pa for rig in plain])


@pytest.mark.parametrize(
    ("path", "value", "said"),
    [("segment.9.length_m", 0.04, "'9' is not a number from 1 to 2"), ("segment.1.clamp_m", 0.02, "leave nothing")],
)
def test_what_the_study_sets_wrongly_is_refused_with_its_place(folder, path, value, said):
    with pytest.raises(SpecError, match=r"study\.toml set.*" + said):
        learnt(folder, set={path: value})


def test_friction_that_goes_by_the_rate_is_taken_at_its_reference_where_loads_have_no_times(folder, tmp_path):
    """Of steps without times and of studies; with times it acts."""
    record = json.loads((folder / "diagnosis.json").read_text())
    (plain, *_), rate = record["posterior"]["models"], {"kind": "rate_dependent_friction", "rate": 0.2}
    rare = plain | {
        "probability": 0.3,
        "named": False,
        "effects": [*plain["effects"], rate | {"reference_n_per_s": 1.0}],
    }
    record["posterior"]["models"] = [plain | {"probability": 0.7}, rare]
    (tmp_path / "diagnosis.json").write_text(json.dumps(record))
    (tmp_path / "same.toml").write_text((folder / "same.toml").read_text())
    steps = {"sequence": ["a", "a"], "step": [1, 2], "cable_1_n": [5.0, 40.0]}
    said = "loads have no time_s here: friction that goes by the rate is taken as it is at its reference rate"
    timeless = predict(tmp_path, tmp_path / "same.toml", steps)
    timed = predict(tmp_path, tmp_path / "same.toml", steps | {"time_s": [0.0, 1.0]})
    assert said in timeless.remarks
    assert said not in timed.remarks
    widths = [np.ptp(found.positions.iloc[-1][["y_low_m", "y_high_m"]]) for found in (timeless, timed)]
    assert widths[1] > 2 * widths[0]
    assert "rate_dependent_friction" not in {effect.kind for rig in learnt(tmp_path) for effect in rig.effect}
    assert f"# {said}\n" in (tmp_path / "learnt.toml").read_text()


def remarks(folder, *factors):
    study = folder / "factors.toml"
    study.write_text(toml_text(STUDY | {"factor": list(factors)}))
    return learnt_study(folder, study, folder / "with-factors.toml", count=4).remarks


def test_factors_that_make_other_rigs_of_the_recorded_one_or_set_what_was_learnt_are_told(folder):
    thick = {"name": "thick_m", "path": "segment.1.thickness_m", "values": [8e-4, 1e-3]}
    sheet = {"name": "sheet_m", "added_to": "segment.1.thickness_m", "values": [0.0, 8e-6]}
    stiff = {"name": "stiff", "level": [{"label": "a", "set": {"youngs_modulus_pa": 2e11}}, {"label": "b"}]}
    rough = {"name": "rough", "times": "friction.coefficient", "values": [0.5, 1.0]}
    (said,) = remarks(folder, thick)
    assert said.startswith("with every design of thick_m goes weakened plate, which is a fault of one part of this rig")
    assert remarks(folder, stiff) == ("factor stiff sets youngs_modulus_pa, in the place of what was learnt",)
    assert remarks(folder, rough) == ()
    assert remarks(folder, sheet) == ()
