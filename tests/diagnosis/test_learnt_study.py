"""Studies that start from what a diagnosis has learnt."""

import tomllib

import numpy as np
import pytest
from diagnosis.learnt import run
from diagnosis.simulated import diagnosed

from prb3r.study.plan import plan_study

STUDY = """# which one?
name = "next"
title = "next"
manipulator = "same.toml"
{}
[[factor]]
name = "mu_factor"
times = "friction.coefficient"
normal = {{ sd = 0.01 }}
[[step]]
cable_1_n = 20
[[metric]]
kind = "position"
"""


def test_a_study_starts_from_what_was_learnt_with_its_uncertainty(weak_rig, tmp_path):
    study = weak_rig / "study.toml"
    study.write_text(STUDY.format('[sampling]\nmethod = "latin-hypercube"\ncount = 128\n'))
    result = run(weak_rig, study, "-o", tmp_path / "learnt.toml")
    assert result.exit_code == 0, result.output
    text = (tmp_path / "learnt.toml").read_text()
    assert text.startswith("# which one?\n")
    plan = plan_study(tmp_path / "learnt.toml")
    assert [factor.name for factor in plan.study.factor] == ["learnt", "mu_factor"]
    assert len(plan.cases) == 128
    constants = diagnosed().constants["youngs_modulus_pa"]
    moduli = np.array([case.settings["manipulator"]["youngs_modulus_pa"] for case in plan.cases])
    assert moduli.mean() == pytest.approx(constants.explained, rel=0.005)
    sd = (constants.high - constants.low) / (2 * 1.96)
    assert moduli.std() == pytest.approx(sd, rel=0.3)
    assert all(case.settings["manipulator"]["effect"][0]["kind"] == "weakened_plate" for case in plan.cases)
    frictions = {case.settings["manipulator"]["friction"]["coefficient"] for case in plan.cases}
    assert len(frictions) == 128 > len(set(moduli))  # errors of the next rig are drawn beside what was learnt
    study.write_text(STUDY.format(""))
    assert run(weak_rig, study, weak_rig / "steps.csv").exit_code == 2
    again = run(weak_rig, tmp_path / "learnt.toml")
    assert "has what was learnt already" in again.output


def test_words_that_look_like_toml_stay_words(weak_rig):
    """A bracket, and the name of a key, at the beginning of a line of the question."""
    study = weak_rig / "asking.toml"
    asked = 'question = """\nWhich?\n[1] Howell, Compliant Mechanisms\nmanipulator = the next one?\n"""\n'
    plain = STUDY.format("").replace("times =", "path =").replace("normal = { sd = 0.01 }", "values = [0.1, 0.2]")
    study.write_text(asked + plain)
    result = run(weak_rig, study)
    assert result.exit_code == 0, result.output
    spec = tomllib.loads(result.stdout)
    assert spec["question"] == tomllib.loads(asked)["question"]
    assert spec["factor"][0]["name"] == "learnt"
    (weak_rig / "asking-learnt.toml").write_text(result.stdout)
    assert len(plan_study(weak_rig / "asking-learnt.toml").cases) == 2 * 64


def test_a_study_without_sampling_gets_it(weak_rig):
    study = weak_rig / "plain.toml"
    study.write_text(
        STUDY.format("").replace("times =", "path =").replace("normal = { sd = 0.01 }", "values = [0.1, 0.2]")
    )
    result = run(weak_rig, study)
    assert result.exit_code == 0, result.output
    assert "left behind" not in result.output
    (weak_rig / "plain-learnt.toml").write_text(result.stdout)
    assert len(plan_study(weak_rig / "plain-learnt.toml").cases) == 2 * 64


def test_a_study_of_another_design_says_what_was_left_behind(weak_rig):
    study = weak_rig / "longer-study.toml"
    study.write_text(STUDY.format('[sampling]\nmethod = "sobol"\ncount = 64\n').replace("same.toml", "longer.toml"))
    assert "# left behind: weakened plate, which is a fault of one part of this rig\n" in run(weak_rig, study).output
