"""Plates that would yield are told of a study that asks for no safety factor."""

from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest
from command import prb3r

from prb3r.study.unasked import unasked_warnings
from prb3r.study.wishes import Requirement

ARM = """
name = "arm"
youngs_modulus_pa = 2e11
yield_stress_pa = 1e9
[disk]
thickness_m = 0.004
[friction]
coefficient = 0.1
[[segment]]
plates = 2
length_m = 0.03
width_m = 0.02
thickness_m = 0.0005
[[cable]]
name = "up"
offset_m = 0.02
ends_at_segment = 1
"""
STUDY = """
name = "pull"
title = "Pull"
manipulator = "arm.toml"
[[step]]
cable_up_n = 5.0
[[factor]]
name = "pull_n"
path = "step.1.cable_up_n"
values = [5.0, 80.0]
[[metric]]
kind = "safety"
"""
ASKED = '[[requirement]]\nmetric = "safety_factor"\nat_least = 1.0\n[designs]\nfactors = ["pull_n"]\n'


@pytest.mark.parametrize("asked", [False, True])
def test_yield_is_told_where_no_requirement_judges_it(tmp_path, asked):
    (tmp_path / "arm.toml").write_text(ARM)
    (tmp_path / "pull.toml").write_text(STUDY + ASKED * asked)
    ran = prb3r("run", tmp_path / "pull.toml", "-o", tmp_path, "--jobs", "1")
    assert ran.returncode == 0, ran.stderr
    worst = pd.read_parquet(tmp_path / "pull" / "cases.parquet")["safety_factor"].min()
    assert worst < 1
    told = f"1 of 2 cases, which no requirement rules out: the lowest safety factor is {worst:.3g}"
    for text in (ran.stdout, (tmp_path / "pull" / "summary.md").read_text()):
        assert (told in text) == (not asked)


def test_a_cloud_that_leaves_out_what_yields_is_no_proof_of_strength(tmp_path):
    """Whatever the arm is pulled with, the loads that count have a safety factor of 1."""
    wish = '[[requirement]]\nmetric = "safety_factor"\nat_least = 1.0\n[designs]\nfactors = ["thickness_m"]\n'
    factor = '[[factor]]\nname = "thickness_m"\npath = "segment.1.thickness_m"\nvalues = [0.0005, 0.0006]\n'
    for safety, said in ((1.0, True), (0.0, False)):
        cloud = f"[cloud]\ncount = 64\nsafety = {safety}\ntension_n = {{ up = 80.0 }}\n"
        text = f'name = "cloud"\ntitle = "Cloud"\nmanipulator = "arm.toml"\n{factor}{cloud}'
        (tmp_path / "arm.toml").write_text(ARM)
        (tmp_path / "cloud.toml").write_text(f'{text}[[metric]]\nkind = "safety"\n{wish}')
        ran = prb3r("run", tmp_path / "cloud.toml", "-o", tmp_path, "--jobs", "1")
        assert ran.returncode == 0, ran.stderr
        assert ("Requirement 1 holds by itself" in ran.stdout) == said
        assert ("No design keeps every requirement" in ran.stdout) != said


@pytest.mark.parametrize(
    ("shares", "asked", "decides", "said"),
    [
        ([1.0, 0.5], [], True, ["Targets are missed in 1 of 2 cases, which no requirement rules out."]),
        ([1.0, 1.0], [], True, []),
        ([1.0, 0.5], [Requirement(metric="farthest_off_m", at_most=1e-3)], True, []),
        ([1.0, 0.5], [], False, []),
    ],
)
def test_missed_targets_are_told_where_no_requirement_judges_them(shares, asked, decides, said):
    study = SimpleNamespace(decides=decides, requirement=asked, cloud=None)
    told = unasked_warnings(pd.DataFrame({"reached_share": shares}), study)
    assert [text.partition(" A requirement")[0] for text in told] == said


SAFE = {"metric": "safety_factor"}


@pytest.mark.parametrize(
    ("factors", "asked", "safety", "said"),
    [
        ([1.0, 1.2], [Requirement(**SAFE, at_least=1.0)], 1.0, ["Requirement 1 holds by itself"]),
        ([1.0, 1.2], [Requirement(**SAFE, at_most=1.0)], 1.0, []),  # plates that are not too strong
        ([1.0, 1.2], [Requirement(**SAFE, at_least=1.5)], 1.0, []),
        ([np.nan, np.nan], [Requirement(**SAFE, at_least=1.0)], 1.0, []),  # no yield stress is given
        ([0.8, 1.2], [], 0.0, ["Plates would yield in 1 of 2 cases"]),
    ],
)
def test_of_a_cloud_is_said_what_holds_by_itself_and_what_yields(factors, asked, safety, said):
    study = SimpleNamespace(decides=True, requirement=asked, cloud=SimpleNamespace(safety=safety))
    told = unasked_warnings(pd.DataFrame({"safety_factor": factors, "case_id": [0, 1]}), study)
    assert [len([text for text in told if text.startswith(beginning)]) for beginning in said] == [1] * len(told)
