"""Which factors tell designs apart, and what is said where none does."""

import pytest
from command import PROTOTYPE, prb3r

from prb3r.study.spec import Study

STUDY = {
    "name": "small",
    "title": "Which",
    "manipulator": str(PROTOTYPE),
    "step": [{"cable_1_n": 20}],
    "metric": [{"kind": "position"}],
    "requirement": [{"metric": "tip_y_m", "at_least": 0.0}],
}
THICKNESS = {"name": "thickness_m", "path": "segment.1.thickness_m", "values": [8e-4, 1e-3]}


def named(*settings, **more):
    """A factor of named alternatives, the first of which changes nothing."""
    levels = [{"label": "as drawn"}, *({"label": str(k)} | part for k, part in enumerate(settings))]
    return {"name": "kind", "level": levels, **more}


def design_factors(*factors, **more):
    return Study.model_validate(STUDY | {"factor": list(factors)} | more).design_factors


@pytest.mark.parametrize("path", ["segment.1.thickness_m", "manipulator.friction.coefficient", "disk.tip_mass_kg"])
def test_what_changes_the_manipulator_tells_designs_apart_by_a_path_or_in_a_level(path):
    by_path = {"name": "kind", "path": path, "values": [0.1, 0.2]} | ({"name": "kind_m"} if path.endswith("_m") else {})
    by_path |= {"name": "kind_kg"} if path.endswith("_kg") else {}
    assert design_factors(by_path) == [by_path["name"]]
    assert design_factors(named({"set": {path: 0.1}})) == ["kind"]
    assert design_factors(named({"model": "elastica"})) == ["kind"]


def test_what_changes_loads_alone_is_a_circumstance():
    loads = named({"broken": ["2"]}, {"step": [{"cable_1_n": 5}]}, {"set": {"step.1.cable_2_n": 5.0}})
    assert design_factors(THICKNESS, loads) == ["thickness_m"]


def test_alternatives_that_nobody_chooses_are_errors():
    spread = named({"set": {"friction.coefficient": 0.2}}, chosen=False)
    assert design_factors(THICKNESS, spread, sampling={"method": "sobol", "count": 4}) == ["thickness_m"]


def test_preferences_of_one_design_rank_nothing():
    wish = {"requirement": [], "preference": [{"metric": "tip_y_m", "better": "greater"}]}
    with pytest.raises(ValueError, match=r"no factor tells designs apart.*\[designs\] factors"):
        design_factors(named({"broken": ["2"]}), **wish)
    assert not design_factors(named({"broken": ["2"]}), **wish | {"requirement": STUDY["requirement"]})


def run(folder, *, bound, designs=""):
    """What a study of three payloads, which bend the arm the more the heavier, says of its requirement."""
    arm = PROTOTYPE.read_text().replace("[disk]", "[disk]\ntip_mass_kg = 0.01")
    (folder / "arm.toml").write_text(f'{arm}\n[[effect]]\nkind = "gravity"\ny_m_s2 = -9.81\n')
    (folder / "one.toml").write_text(
        f"""name = "one"
title = "Payloads"
manipulator = "arm.toml"
[[factor]]
name = "payload_kg"
path = "disk.tip_mass_kg"
values = [0.01, 0.1, 0.2]
[[step]]
cable_1_n = 20
[[metric]]
kind = "position"
[[requirement]]
metric = "tip_y_m"
at_least = {bound}
{designs}
"""
    )
    done = prb3r("run", folder / "one.toml", "-o", folder)
    assert done.returncode == 0, done.stderr
    return done.stdout, (folder / "one/summary.md").read_text(), prb3r("compare", folder / "one")


def test_one_design_keeps_requirements_or_breaks_them_and_the_margin_is_told(tmp_path):
    said, summary, compared = run(tmp_path, bound=-5, designs="[designs]\nfactors = []")
    assert "The design keeps every requirement. Nearest to its bound, tip y is " in said
    assert " inside)" in said
    assert "## Requirements" in summary
    assert "each value by itself (0.01 to 0.2 kg)" in summary
    assert compared.returncode == 0
    said, summary, compared = run(tmp_path, bound=5, designs="[designs]\nfactors = []")
    assert "The design does not keep every requirement: tip y is " in said
    assert " off)" in said
    assert "no value by itself" in summary
    assert compared.returncode == 1
    assert "Recommendation" not in said + summary + compared.stdout


def test_payloads_that_are_taken_for_designs_are_told(tmp_path):
    said, summary, compared = run(tmp_path, bound=-5)
    told = "Payload tells designs apart; if each design has to bear all of it, say [designs] factors = []."
    assert all(told in text for text in (said, summary, compared.stdout))
    assert told not in "".join(map(str, run(tmp_path, bound=-5, designs='[designs]\nfactors = ["payload_kg"]')))
